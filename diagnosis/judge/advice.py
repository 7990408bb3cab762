"""Which run would tell two causes apart."""

from __future__ import annotations

from ..search.hypotheses import Hypothesis


def separate(winner: Hypothesis, rivals: list[Hypothesis]) -> str:
    """A sentence that names the run, empty where nothing needs telling apart."""
    if not rivals:
        return ""
    runs = list(dict.fromkeys(h.advice for h in (winner, *rivals) if h.advice))[:3]
    return "Would separate them: " + "; or ".join(runs) + "."
