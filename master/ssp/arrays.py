"""Array connectors of SSP 2.0 as their elements, `x[1]`, `A[1,2]`: by these the master knows the arrays of FMI 3.0.

Source: System Structure and Parameterization 2.0, Dimension Sequence, Connections, Parameters.
"""

from __future__ import annotations

import math
from itertools import product

from lxml import etree

from ..errors import DescriptionError
from .flat import Joint, Port

Shape = tuple[int | None, ...]  # None: a size that the document does not say
LARGEST = 1_000_000  # elements


def shape_of(node: etree._Element, where: str) -> Shape:
    """The dimensions of a connector, a dictionary's entry or a parameter; () of a scalar."""
    sizes: list[int | None] = []
    for one in [child for child in node if str(child.tag).endswith("}Dimension")]:
        text = one.get("size")
        if text is not None and not text.strip().isdecimal():
            raise DescriptionError(f"{where}: its dimension has the size {text!r}, which is no number of elements.")
        sizes.append(None if text is None else int(text))
    if math.prod(size or 1 for size in sizes) > LARGEST:
        raise DescriptionError(f"{where} has more than {LARGEST} elements; at most so many are read.")
    return tuple(sizes)


def names(name: str, shape: tuple[int, ...]) -> list[str]:
    """The names of an array's elements, rows first."""
    return [f"{name}[{','.join(map(str, place))}]" for place in product(*(range(1, size + 1) for size in shape))]


def indices_of(connection: etree._Element, side: str, where: str) -> tuple[int, ...]:
    words = (connection.get(f"{side}Indices") or "").split()
    if not all(word.isdecimal() for word in words):
        raise DescriptionError(f"{where}: {side}Indices = {connection.get(f'{side}Indices')!r} are no indices.")
    return tuple(map(int, words))


class Arrays:
    """The shapes of ports, completed by what they are connected to, and connections between their elements."""

    def __init__(self, shapes: dict[Port, Shape], links: list[Joint], notes: list[str]):
        self.shapes, self.links, self.notes = shapes, links, notes
        for _ in range(len(shapes)):
            if not any([self._complete(link) for link in links]):
                break
        self.first = {port: self._first(port) for port, shape in shapes.items() if shape}

    def shape(self, port: Port) -> tuple[int, ...]:
        """Of a port all of whose sizes are known; () of a scalar. Raises DescriptionError."""
        shape = self.shapes.get(port, ())
        if any(size is None for size in shape):
            raise DescriptionError(f"{'.'.join(port)} is an array, and nobody says of how many elements.")
        return tuple(size or 0 for size in shape)

    def elements(self, port: Port) -> list[Port]:
        """The ports of an array's elements; a scalar is its own."""
        shape = self.shape(port)
        return [(port[0], name) for name in names(port[1], shape)] if shape else [port]

    def joints(self) -> list[Joint]:
        """All connections, those between arrays element by element. Raises DescriptionError where they do not fit."""
        found = []
        for link in self.links:
            ends = [self._chosen(port, chosen) for port, chosen in zip((link.start, link.end), link.indices)]
            if len(ends[0]) != len(ends[1]):
                said = " → ".join(f"{'.'.join(port)} ({len(end)})" for port, end in zip((link.start, link.end), ends))
                raise DescriptionError(f"{said}: the numbers of elements differ.")
            found += [Joint(start, end, link.transform, link.convert) for start, end in zip(*ends)]
        return found

    def _complete(self, link: Joint) -> bool:
        """Sizes that only one end of a connection says."""
        if any(link.indices):
            return False
        for known, other in ((link.start, link.end), (link.end, link.start)):
            shape, told = self.shapes.get(known, ()), self.shapes.get(other, ())
            if len(shape) == len(told) and any(a is not None and b is None for a, b in zip(shape, told)):
                self.shapes[other] = tuple(a if b is None else b for a, b in zip(shape, told))
                return True
        return False

    def _first(self, port: Port) -> int:
        """Where its indices begin. The standard does not say it: at 0 where one is 0, else at 1, as in FMI's names of elements."""
        shape = self.shapes[port]
        used = [
            index
            for link in self.links
            for end, mine in zip((link.start, link.end), link.indices)
            if end == port
            for index in mine
        ]
        ends = [i for link in self.links for end, mine in zip((link.start, link.end), link.indices) if end == port
                for i, size in zip(mine, shape if len(mine) == len(shape) else shape * len(mine)) if i == size]  # fmt: skip
        if used and 0 not in used and not ends:
            self.notes.append(f"{'.'.join(port)}: indices of its elements are counted from 1")
        return 0 if 0 in used else 1

    def _chosen(self, port: Port, indices: tuple[int, ...]) -> list[Port]:
        every, shape = self.elements(port), self.shape(port)
        if not indices:
            return every
        places = [index - self.first.get(port, 1) for index in indices]
        if not shape:
            raise DescriptionError(
                f"{'.'.join(port)} is no array, and a connection names its element {' '.join(map(str, indices))}."
            )
        if len(shape) == 1:
            chosen: list[tuple[int, ...]] = [(place,) for place in places]
        elif len(places) == len(shape):
            chosen = [tuple(places)]
        else:
            raise DescriptionError(
                f"{'.'.join(port)} has {len(shape)} dimensions, a connection names it with {len(indices)} indices."
            )
        if any(not 0 <= place < size for one in chosen for place, size in zip(one, shape)):
            raise DescriptionError(f"{'.'.join(port)} has no element {' '.join(map(str, indices))}.")
        rows = [sum(place * math.prod(shape[k + 1 :]) for k, place in enumerate(one)) for one in chosen]
        return [every[row] for row in rows]
