"""Initial values made consistent: every output is read after the inputs it depends on have been given.

Outputs act through connections on inputs, and through a part on those of its outputs that depend on the input
without a step (`depends_on`; all outputs where an FMU tells nothing). What is left in a circle is an algebraic
loop: it is named, its values are repeated until they stand still, and refused if they do not. During steps the
values in a loop lag by a step in any case: such is non-iterative coupling.
"""

from __future__ import annotations

import math
from graphlib import CycleError, TopologicalSorter
from typing import Any

from .errors import DescriptionError
from .wiring import Link, Wiring

ROUNDS = 100
CLOSE = 1e-10

Node = tuple[str, str]  # component, output


def initialize(wiring: Wiring, stop: float | None) -> list[str]:
    """Take the parts through initialization. Returns the algebraic loops, each as text a -> b -> a."""
    parts, start = wiring.parts, wiring.system.run.start
    for part in parts.values():
        part.enter_initialization(start, stop)
    loops, order = _order(wiring)
    _evaluate(wiring, order, loops)
    for part in parts.values():
        part.exit_initialization()
    return [" -> ".join(loop) for loop in loops]


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


def _order(wiring: Wiring) -> tuple[list[list[str]], list[Node]]:
    """The loops, and all connected outputs in an order in which each comes after what it depends on."""
    given: dict[str, list[Link]] = {}
    for link in wiring.links:
        given.setdefault(link.target, []).append(link)
    graph: dict[Node, set[Node]] = {}
    for link in wiring.links:
        depends = wiring.parts[link.source].variables[link.output].depends_on
        graph[link.source, link.output] = {
            (back.source, back.output) for back in given.get(link.source, ()) if depends is None or back.input in depends
        }
    loops: list[list[str]] = []
    while True:
        try:
            return loops, list(TopologicalSorter(graph).static_order())
        except CycleError as error:
            cycle = error.args[1]  # each acts on the next, the last is the first
            loops.append([".".join(node) for node in cycle])
            graph[cycle[1]].discard(cycle[0])


def _evaluate(wiring: Wiring, order: list[Node], loops: list[list[str]]) -> None:
    parts = wiring.parts
    for attempt in range(ROUNDS if loops else 1):
        change = 0.0
        for component, _ in order:
            part = parts[component]
            feed(wiring, component)
            old = part.y.copy()
            part.at(wiring.system.run.start)
            if attempt:
                difference = abs(part.y - old) / (1.0 + abs(part.y))
                change = max(change, float(difference.max(initial=0.0)))
        if attempt and not change > CLOSE:
            break
    else:
        if loops:
            named = "; ".join(" -> ".join(loop) for loop in loops)
            raise DescriptionError(
                f"The initial values do not settle: outputs act on each other at the same instant in {named}. "
                "Break the loop with a part whose output does not depend on its input at once (an inertia, a delay), or reduce "
                "its gain."
            )
    for component in parts:
        feed(wiring, component)


def feed(wiring: Wiring, component: str) -> None:
    """Give a part its inputs from the outputs as they are."""
    part = wiring.parts[component]
    for link in wiring.links:
        if link.target != component:
            continue
        if link.text:
            part.set(link.input, wiring.parts[link.source].get(link.output))
            continue
        inputs, _ = wiring.bound[component]
        _, outputs = wiring.bound[link.source]
        value = link.factor * wiring.parts[link.source].y[outputs.index(link.output)] + link.offset
        if math.isfinite(value):
            part.u[inputs.index(link.input)] = value
    part.write()
