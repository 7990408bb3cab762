"""The inputs of a circle as one vector of numbers that must be what the outputs make of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .circles import Circle
from .face import Part
from .secant import Secant
from .wiring import Wiring, Wrong

NUDGE = 1e-6  # of an input, relative, for differences


class Unknowns:
    """The inputs of a circle whose values may be any number, bound to where they lie.

    Booleans, Integers and what changes at events alone are no unknowns: such values pass on as they are.
    """

    def __init__(self, circle: Circle, wiring: Wiring, tolerance: float):
        self.circle = circle
        self.parts = [wiring.parts[name] for name in circle.parts]
        self.wiring, self.others = wiring, list(circle.links)
        self.places: list[tuple[Part, int, Part, int, float, float]] = []  # target, place in its u; source, place in its y; …
        self.names: list[tuple[str, str]] = []  # component and input
        self.wrong: dict[int, tuple[Wrong | None, Wrong | None]] = {}  # by place: what faults make of output and input
        for link in circle.links:
            source, target = wiring.parts[link.source], wiring.parts[link.target]
            ends = source.variables[link.output], target.variables[link.input]
            if all(v.type == "Real" and v.variability in ("", "continuous") for v in ends):
                i, j = wiring.bound[link.target][0].index(link.input), wiring.bound[link.source][1].index(link.output)
                self.places.append((target, i, source, j, link.factor, link.offset))
                self.names.append((link.target, link.input))
                self.others.remove(link)
                wrong = wiring.wrong.get((link.source, link.output)), wiring.wrong.get((link.target, link.input))
                if any(wrong):
                    self.wrong[len(self.places) - 1] = wrong
        self.solver = Secant(len(self.places), tolerance)
        self.solver.last[:] = [target.u[i] for target, i, *_ in self.places]  # start values: a guess, where a user gave one

    def given(self) -> np.ndarray:
        """What the outputs make of the inputs."""
        found = np.array([factor * source.y[j] + offset for _, _, source, j, factor, offset in self.places])
        for k, (out, into) in self.wrong.items():
            *_, source, j, factor, offset = self.places[k]
            value = factor * (out(source.y[j]) if out else source.y[j]) + offset
            found[k] = into(value) if into else value
        return found

    def passed(self) -> list[Any]:
        """What else passes along the circle."""
        return [self.wiring.parts[link.source].get(link.output) for link in self.others]

    def put(self, values: np.ndarray) -> None:
        for (target, i, *_), value in zip(self.places, values.tolist()):
            target.u[i] = value

    def slopes(self, probe: Callable[[Part], None], exact: bool) -> np.ndarray:
        """How `given` changes with each unknown, from here. probe: brings the y of a part to its u as it is.

        exact: an FMU's own directional derivatives are what is asked for.
        """
        found = np.zeros((len(self.places), len(self.places)))
        for part in self.parts:
            mine = [k for k, place in enumerate(self.places) if place[0] is part]
            listeners = [
                (k, place[3], place[4] if all(one.keeps for one in self.wrong.get(k, ()) if one) else 0.0)
                for k, place in enumerate(self.places)
                if place[2] is part
            ]
            before, nudged = part.y.copy(), False
            for k in mine:
                i = self.places[k][1]
                change = part.slopes(i) if exact else None
                if change is None:
                    held, nudged = float(part.u[i]), True
                    part.u[i] = held + NUDGE * max(abs(held), float(self.solver.scale[k]))
                    probe(part)
                    change = (part.y - before) / (part.u[i] - held)
                    part.u[i] = held
                for listener, j, factor in listeners:
                    found[listener, k] = factor * change[j]
            if nudged:
                probe(part)
        return found
