"""Initial values made consistent: every output is read after the inputs it depends on have been given.

What depends on itself is an algebraic loop (master.circles): it is named, and solved by master.secant; refused where it has
no solution that is found.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .circles import Circle, Node, loops
from .errors import DescriptionError
from .face import Part
from .secant import Unsettled
from .unknowns import Unknowns
from .wiring import Wiring

ROUNDS = 100
CLOSE = 1e-10


def initialize(wiring: Wiring, stop: float | None) -> list[Circle]:
    """Take the parts through initialization. Returns the algebraic loops."""
    parts, start = wiring.parts, wiring.system.run.start
    for part in parts.values():
        part.enter_initialization(start, stop)
    found, order = loops(wiring)
    _evaluate(wiring, order)
    for part in parts.values():
        part.exit_initialization()
    return found


def untaken(wiring: Wiring) -> list[str]:
    """A sentence for each parameter that is not what it was set to once the parts are initialized."""
    values = wiring.values
    return [
        not_taken(f"{name}.{variable}", values[name][variable], found)
        for name, part in wiring.parts.items()
        for variable, found in part.untaken.items()
    ]


def not_taken(name: str, given: Any, found: Any) -> str:
    """The sentence about a parameter that was set to `given` and is `found`, None where the FMU does not tell."""
    if found is None:
        return f"{name} = {given} cannot be read back: whether the FMU took it is unknown"
    return f"{name} = {given} was not taken: the FMU has {found}"


def _evaluate(wiring: Wiring, order: list[Circle | Node]) -> None:
    parts, start = wiring.parts, wiring.system.run.start
    unknowns = {one.name: Unknowns(one, wiring, CLOSE) for one in order if isinstance(one, Circle)}
    for one in order:
        if isinstance(one, Circle):
            _solve(wiring, unknowns[one.name])
        else:
            feed(wiring, one[0])
            parts[one[0]].at(start)
    for component in parts:
        feed(wiring, component)


def _solve(wiring: Wiring, unknowns: Unknowns) -> None:
    """Solve a loop; what in it is no number of any size, such as a Boolean, is passed on until it stands still."""
    start, parts = wiring.system.run.start, unknowns.parts

    def evaluate(values: np.ndarray) -> np.ndarray:
        for part in parts:
            feed(wiring, part.name, lambda: unknowns.put(values))
        for part in parts:
            part.at(start)
        return unknowns.given()

    def probe(part: Part) -> None:
        part.write()
        part.at(start)

    residual = math.inf
    for _ in range(ROUNDS):
        for part in parts:
            feed(wiring, part.name)
            part.at(start)
        before = unknowns.passed()
        try:
            unknowns.solver.solve(unknowns.given(), evaluate, lambda: unknowns.slopes(probe, exact=True))
        except Unsettled as error:
            residual = error.residual
            break
        if unknowns.passed() == before:
            return
    raise DescriptionError(
        f"The initial values do not settle: outputs act on each other at the same instant in {unknowns.circle.name}"
        f"{f' (residual {residual:.2g})' if math.isfinite(residual) else ''}. "
        "Break the loop with a part whose output does not depend on its input at once (an inertia, a delay), or change its gain."
    )


def feed(wiring: Wiring, component: str, then: Callable[[], None] | None = None) -> None:
    """Give a part its inputs from the outputs as they are; `then` may change them before they go in."""
    part = wiring.parts[component]
    for link in wiring.into[component]:
        if link.text:
            part.set(link.input, wiring.parts[link.source].get(link.output))
            continue
        inputs, _ = wiring.bound[component]
        _, outputs = wiring.bound[link.source]
        told = wiring.seen(link.source, link.output, wiring.parts[link.source].y[outputs.index(link.output)])
        value = dict(link.mapping).get(told, told) if link.mapping else link.factor * told + link.offset
        if math.isfinite(value):
            part.u[inputs.index(link.input)] = wiring.seen(component, link.input, value)
    if then is not None:
        then()
    part.write()
