"""Circles in a system: outputs that act on themselves at one instant, and components that act on each other at all.

Outputs act through connections on inputs, and through a part on those of its outputs that depend on the input without a step
(`depends_on`; on all where an FMU tells nothing).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

from .wiring import Link, Wiring

Node = tuple[str, str]  # component, output
Thing = TypeVar("Thing", bound=Hashable)


@dataclass(frozen=True)
class Circle:
    """Links of a system that depend on each other."""

    name: str  # a.y -> b.y -> a.y
    links: tuple[Link, ...]
    declared: bool = True  # every part on it says itself which of its outputs depend on which inputs

    @property
    def parts(self) -> list[str]:
        return list(dict.fromkeys(link.target for link in self.links))


def strong(graph: Mapping[Thing, Iterable[Thing]]) -> list[tuple[list[Thing], list[list[Thing]]]]:
    """Groups of nodes that depend on each other, each after those that it depends on; with circles found in it.

    graph: what each node depends on. A node alone is a group; it has a circle where it depends on itself.
    """
    groups: dict[Thing, tuple[list[Thing], list[list[Thing]]]] = {node: ([node], []) for node in graph}  # by their first node
    first = {node: node for node in graph}
    while True:
        between: dict[Thing, dict[Thing, None]] = {one: {} for one in groups}
        for node, befores in graph.items():
            for before in befores:
                if first[before] != first[node] or before == node and not groups[first[node]][1]:
                    between[first[node]][first[before]] = None
        try:
            return [groups[one] for one in TopologicalSorter(between).static_order()]
        except CycleError as error:
            cycle = error.args[1]  # each acts on the next, the last is the first
            nodes = [node for one in cycle[:-1] for node in groups[one][0]]
            found = [circle for one in cycle[:-1] for circle in groups.pop(one)[1]]
            groups[cycle[0]] = nodes, [*found, cycle]
            first |= dict.fromkeys(nodes, cycle[0])


def loops(wiring: Wiring) -> tuple[list[Circle], list[Circle | Node]]:
    """The algebraic loops; and these and all other connected outputs in an order in which each comes after what it depends on."""
    given: dict[str, list[Link]] = {}
    for link in wiring.links:
        given.setdefault(link.target, []).append(link)
    graph: dict[Node, list[Node]] = {}
    for link in wiring.links:
        graph[link.source, link.output] = [
            (back.source, back.output)
            for back in given.get(link.source, ())
            if _acts(wiring, back.input, (link.source, link.output))
        ]
    order: list[Circle | Node] = []
    for nodes, found in strong(graph):
        if not found:
            order += nodes
            continue
        name = "; ".join(" -> ".join(".".join(node) for node in circle) for circle in found)
        links = tuple(
            link
            for link in wiring.links
            if (link.source, link.output) in nodes
            and any(component == link.target and _acts(wiring, link.input, (component, output)) for component, output in nodes)
        )
        declared = all(wiring.parts[component].variables[output].depends_on is not None for component, output in nodes)
        order.append(Circle(name, links, declared))
    return [one for one in order if isinstance(one, Circle)], order


def _acts(wiring: Wiring, input_: str, on: Node) -> bool:
    """Whether an input may act at once on an output of its component."""
    depends = wiring.parts[on[0]].variables[on[1]].depends_on
    return depends is None or input_ in depends


def coupled(wiring: Wiring) -> list[tuple[list[str], Circle | None]]:
    """The components that are stepped, each after those that act on it; as one with a circle those that act on each other."""
    stepped = [name for name in wiring.system.order if not wiring.parts[name].timed]
    graph: dict[str, list[str]] = {name: [] for name in stepped}
    for link in wiring.links:
        if link.source in graph and link.target in graph:
            graph[link.target].append(link.source)
    groups: list[tuple[list[str], Circle | None]] = []
    for names, found in strong(graph):
        names.sort(key=stepped.index)
        links = tuple(link for link in wiring.links if link.source in names and link.target in names)
        groups.append((names, Circle(", ".join(names), links) if found else None))
    return groups
