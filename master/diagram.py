"""The wiring of a system as a picture: an SVG that stands in a notebook, a page or a document. Nothing of the system is loaded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from markupsafe import escape

from ..fmus.shown import visible
from .code import named
from .errors import DescriptionError
from .system import Component, Connection, System

MOST = 60  # components and 10 times as many connections that are drawn
LETTERS, WIDE, ROW, HEAD = 26, 6.3, 16, 40  # of a name; px of a letter, of a port, of a box's head
APART, LANE, EDGE = 26, 7, 14  # px between boxes, between ways back, around all
AHEAD, BACK, WRONG = "#1f6f8b", "#b3681e", "#b3261e"


@dataclass
class Placed:
    """A component: its ports in the order in which they are named, and its place."""

    name: str
    kind: str
    step: float
    inputs: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    column: int = 0
    x: float = 0.0
    y: float = 0.0

    @property
    def width(self) -> float:
        ports = max((len(_short(n)) for n in self.inputs), default=0) + max((len(_short(n)) for n in self.outputs), default=0)
        return max(WIDE * (ports + 4), 7.2 * len(_short(self.name)) + 20, WIDE * len(_short(self.kind)) + 20)

    @property
    def height(self) -> float:
        return HEAD + ROW * max(len(self.inputs), len(self.outputs), 1) + 4

    def port(self, name: str, out: bool) -> tuple[float, float]:
        """Where a line begins or ends."""
        place = (self.outputs if out else self.inputs).index(name)
        return self.x + self.width * out, self.y + HEAD + ROW * (place + 0.5)


@dataclass
class Wire:
    """A connection between two boxes."""

    source: Placed
    output: str
    target: Placed
    input: str
    words: str
    back: bool  # to a component that is stepped no later: its value is of the step before


def svg(system: System) -> str:
    """The components as boxes in columns, in the order of stepping; lines to those behind, and, below them and dashed, ways back."""
    boxes, wires, left = _read(system)
    width, height = _place(list(boxes.values()), wires)
    faults = {fault.variable: fault.kind for fault in system.faults}
    lines = [line for lane, wire in enumerate(sorted(wires, key=lambda wire: wire.back)) for line in _line(wire, lane, wires)]
    back = sum(wire.back for wire in wires)
    height += EDGE + (LANE * back + EDGE if back else 0)
    notes = [f"not drawn: {_text(one)}" for one in left[:5]] + [f"… and {len(left) - 5} more"] * (len(left) > 5)
    rows = [
        f'<text x="{EDGE}" y="{height + 14 * k:.0f}" font-size="11" fill="{WRONG}">{note}</text>'
        for k, note in enumerate(notes, 1)
    ]
    height += 14 * len(notes) + EDGE * bool(notes)
    drawn = [part for box in boxes.values() for part in _drawn(box, faults)]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        'style="max-width: 100%; height: auto" font-family="system-ui, sans-serif" role="img">'
    )
    title = f"<title>{_text(system.name)}</title>"
    return "".join(
        [head, title, f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>', *lines, *drawn, *rows, "</svg>"]
    )


def page(system: System) -> str:
    """The picture with a line of words, for a notebook."""
    run = system.run
    told = [
        f"{run.algorithm}, {run.start:g} to {run.stop:g} s in steps of {run.step:g} s" + " at most" * bool(run.step_control),
        f"{len(system.components)} components, {len(system.connections)} connections",
    ]
    told += [f"faults: {', '.join(f'{f.kind} of {f.variable}' for f in system.faults[:5])}"] * bool(system.faults)
    told += [f"values: {', '.join(f'{name} = {value}' for name, value in list(system.values.items())[:10])}"] * bool(
        system.values
    )
    about = f" {_text(system.description)}" if system.description else ""
    return f"<div><b>{_text(system.name)}</b>{about}<br><small>{'; '.join(map(_text, told))}</small><br>{svg(system)}</div>"


def _read(system: System) -> tuple[dict[str, Placed], list[Wire], list[str]]:
    """Boxes by name, wires, and what cannot be drawn."""
    order = [name for name in system.order if name in system.components]
    order += [name for name in system.components if name not in order]
    rank = {name: place for place, name in enumerate(order)}
    boxes = {name: Placed(name, _kind(system.components[name]), system.components[name].step) for name in order[:MOST]}
    left = [f"{len(order) - MOST} components more"] * (len(order) > MOST)
    wires = []
    for target, connection in list(system.connections.items())[: 10 * MOST]:
        try:
            (to, into), (of, out) = system.split(target, ""), system.split(connection.source, "")
        except DescriptionError:
            left.append(f"{target} = {connection.source}")
            continue
        if to not in boxes or of not in boxes:
            continue
        for ports, port in ((boxes[to].inputs, into), (boxes[of].outputs, out)):
            if port not in ports:
                ports.append(port)
        wires.append(Wire(boxes[of], out, boxes[to], into, _words(target, connection), rank[of] >= rank[to]))
    for fault in system.faults:
        try:
            of, name = system.split(fault.variable, "")
        except DescriptionError:
            continue
        if of in boxes and name not in boxes[of].inputs + boxes[of].outputs:
            boxes[of].inputs.append(name)
    return boxes, wires, left


def _words(target: str, connection: Connection) -> str:
    factor = "" if connection.factor == 1.0 else f" · {connection.factor}"
    offset = "" if connection.offset == 0.0 else f" + {connection.offset}"
    mapping = "".join(f", {old} → {new}" for old, new in connection.mapping.items())
    return f"{target} = {connection.source}{factor}{offset}{mapping}"


def _kind(component: Component) -> str:
    if component.fmu:
        return component.fmu.replace("\\", "/").rpartition("/")[2].removesuffix(".fmu").removeprefix("selflock:")
    return named(component.part).rpartition(":")[2] if component.part else component.manoeuvre or component.host


def _place(boxes: list[Placed], wires: list[Wire]) -> tuple[float, float]:
    """Columns so that every line but the ways back goes to the right; width and height of all."""
    for box in boxes:  # in the order of stepping: what gives to it has its column already
        box.column = max((wire.source.column + 1 for wire in wires if wire.target is box and not wire.back), default=0)
    columns = [[box for box in boxes if box.column == k] for k in range(max((box.column for box in boxes), default=-1) + 1)]
    tall = [sum(box.height + APART for box in column) - APART for column in columns]
    x = float(EDGE)
    for column, height in zip(columns, tall):
        ways = sum(wire.back and wire.target in column for wire in wires)
        x += LANE * ways + (EDGE if ways else 0)
        y = EDGE + (max(tall) - height) / 2
        for box in column:
            box.x, box.y = x, y
            y += box.height + APART
        leaving = sum(wire.back and wire.source in column for wire in wires)
        x += max(box.width for box in column) + 60 + LANE * leaving
    return x - (60 if boxes else 0) + EDGE + 10, EDGE + max(tall, default=0.0)


def _line(wire: Wire, lane: int, wires: list[Wire]) -> Iterator[str]:
    x, y = wire.source.port(wire.output, True)
    to, end = wire.target.port(wire.input, False)
    if wire.back:
        others = [other for other in wires if other.back]
        leaving = [other for other in others if other.source.column == wire.source.column]
        coming = [other for other in others if other.target.column == wire.target.column]
        mine = [other.source.x + other.source.width for other in leaving]
        right = max(mine) + 12 + LANE * leaving.index(wire)
        left = min(other.target.x for other in coming) - 14 - LANE * coming.index(wire)
        below = (
            max(box.y + box.height for other in wires for box in (other.source, other.target)) + EDGE + LANE * others.index(wire)
        )
        path = f"M{x:.1f} {y:.1f}H{right:.1f}V{below:.1f}H{left:.1f}V{end:.1f}H{to - 5:.1f}"
        color, more = BACK, ' stroke-dasharray="5 3"'
    else:
        bend = max(24.0, 0.45 * (to - x))
        path = f"M{x:.1f} {y:.1f}C{x + bend:.1f} {y:.1f} {to - bend:.1f} {end:.1f} {to - 5:.1f} {end:.1f}"
        color, more = AHEAD, ""
    title = f"<title>{_text(wire.words)}</title>"
    yield f'<path class="wire" d="{path}" fill="none" stroke="{color}" stroke-width="1.3"{more}>{title}</path>'
    yield f'<path d="M{to - 6:.1f} {end - 3:.1f}l6 3l-6 3z" fill="{color}"/>'


def _drawn(box: Placed, faults: dict[str, str]) -> Iterator[str]:
    yield (
        f'<rect x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" rx="5" fill="#f7f9fa" '
        'stroke="#5c6b73"/>'
    )
    kind = _short(box.kind) + (f", {box.step:g} s" if box.step else "")
    middle = box.x + box.width / 2
    for text, down, style in (
        (box.name, 16, 'font-size="13" font-weight="600" fill="#1b2a30"'),
        (kind, 30, 'font-size="11" fill="#5c6b73"'),
    ):
        yield f'<text x="{middle:.1f}" y="{box.y + down:.1f}" text-anchor="middle" {style}>{_text(_short(text))}</text>'
    for names, out, anchor in ((box.inputs, False, "start"), (box.outputs, True, "end")):
        for name in names:
            x, y = box.port(name, out)
            fault = faults.get(f"{box.name}.{name}")
            color, words = (WRONG, f"{name}: {fault}") if fault else ("#33434a", name)
            yield (
                f'<text x="{x + (-7 if out else 7):.1f}" y="{y + 4:.1f}" text-anchor="{anchor}" font-size="11" fill="{color}">'
                f"<title>{_text(words)}</title>{_text(_short(name))}</text>"
            )


def _short(name: str) -> str:
    return name if len(name) <= LETTERS else f"{name[: LETTERS - 1]}…"


def _text(words: object) -> str:
    return str(escape(visible(words)))
