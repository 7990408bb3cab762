"""Guesses that follow from one that was fitted: laws of more numbers of its family, and a path that it is the same as with one less."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..rules import RULES
from .guesses import LAW, Guess, number, saturation, words

ENDS = {"limit": "high", "limit below": "low"}
"""Of a limit the end of the saturation that it may be."""


def relatives(guess: Guess, at: dict[str, float]) -> Iterator[tuple[Guess, dict[str, float]]]:
    """Laws of the family of one that looks well, with where their fits start."""
    if len(guess.inserts) > 1:
        return
    if guess.law in ENDS and guess.plain and guess.inserts[0].own:
        yield _saturation(guess, at)
    if guess.law not in ("Coulomb", "Dahl"):
        return
    prefix = guess.inserts[0].name
    w = next(n for n in guess.numbers if n.name.endswith(".w"))
    if guess.law == "Coulomb":  # what fits it fits no worse with nothing more of it near 0
        a = next(n for n in guess.numbers if n.name.endswith(".a"))
        b, v = (replace(like, name=f"{prefix}.{word}", variable=f"{prefix}.{word}") for like, word in ((a, "b"), (w, "v")))
        one = replace(guess.inserts[0], law="Stribeck")
        made = Guess(LAW, "Stribeck", words("Stribeck", one), (one,), (*guess.numbers, b, v))
        wide = at[w.name]
        while wide < v.high:
            wide = float(np.clip(RULES.naming.dying * wide, v.low, v.high))
            yield made, at | {b.name: 0.0, v.name: wide}
        return
    for name, more in (
        ("LuGre", (number(f"{prefix}.b", 0.5, 0.0, 5.0), number(f"{prefix}.v", w.high, 1e-3 * w.high, 10.0 * w.high))),
        ("Bouc-Wen", (number(f"{prefix}.b", 0.5, -1.0, 1.0), number(f"{prefix}.n", 1.5, 1.0, 6.0))),
    ):
        one = replace(guess.inserts[0], law=name)
        made = Guess(LAW, name, words(name, one), (one,), (*guess.numbers, *more))
        yield made, at | {n.name: n.start for n in more}


def _saturation(guess: Guess, at: dict[str, float]) -> tuple[Guess, dict[str, float]]:
    """What a limit of a signal itself is where it takes all that is beyond it: s - (s - l) above l is l.

    It has a number less. A look may see the limit, whose slope is linear in what is left, and not the saturation.
    """
    one, end = guess.inserts[0], ENDS[guess.law]
    brim = next(n for n in guess.numbers if n.name == f"{one.name}.l")
    bound = replace(brim, name=f"{one.name}.{end}", variable=f"{one.name}.{end}")
    rest = {name: value for name, value in at.items() if name not in {n.name for n in guess.numbers}}
    return saturation(one.name, one.place, end, bound), rest | {bound.name: at[brim.name]}
