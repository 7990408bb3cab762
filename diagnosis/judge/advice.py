"""Which run would tell two causes apart."""

from __future__ import annotations

from collections.abc import Sequence

from ..search.hypotheses import Free, Hypothesis


def separate(winner: Hypothesis, rivals: list[Hypothesis]) -> str:
    """A sentence that names the run, empty where nothing needs telling apart."""
    if not rivals:
        return ""
    runs = list(dict.fromkeys(h.advice for h in (winner, *rivals) if h.advice))[:3]
    return "Would separate them: " + "; or ".join(runs) + "."


def beyond(p: Free) -> str:
    """An uncertain value outside of what a rig gives it, in words."""
    return f"{p.name} outside of its range, {p.low:.4g} to {p.high:.4g}"


def widen(narrow: Sequence[Free]) -> str:
    """What to do where uncertain values ended where their ranges do, empty where none did."""
    return f"Widen {', '.join(p.name for p in narrow)} under [uncertain], and diagnose again." if narrow else ""
