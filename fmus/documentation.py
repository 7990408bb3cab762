"""The documentation page and the icon in each FMU, made from the law's own text, the tables and a run of the slave.

Everything drawn is repeatable to the byte: no dates, no random ids.
"""

from __future__ import annotations

import hashlib
import io
import re
from functools import cache as once
from html import escape
from importlib.metadata import version
from inspect import cleandoc
from math import cos, pi, sin
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, NamedTuple

from . import cache
from .effect import Effect
from .shown import policy

if TYPE_CHECKING:
    from .slave import Slave
    from .variable import Variable


class Picture(NamedTuple):
    """A short run that shows what a component does: inputs as functions of time, and the outputs to draw."""

    caption: str
    stop: float  # s
    outputs: tuple[str, ...]
    inputs: dict[str, Callable[[float], float]]
    parameters: dict[str, Any] = {}


R = 50.0
PICTURES = {
    "Motor": Picture(
        "12 V are switched on while the rotor stands, and it begins to turn at 2 ms.",
        0.006,
        ("current", "torque"),
        {"voltage": lambda t: 12.0, "speed": lambda t: 1e5 * max(0.0, t - 0.002)},
    ),
    "Controller": Picture(
        "The set-point turns until 0.2 s and what is driven follows with a lag; at rest the voltage is released.",
        0.8,
        ("voltage",),
        {
            "angle_setpoint": lambda t: min(t, 0.2),
            "speed_setpoint": lambda t: 1.0 if t < 0.2 else 0.0,
            "angle": lambda t: min(max(t - 0.02, 0.0), 0.19),
            "speed": lambda t: 1.0 if 0.02 < t < 0.21 else 0.0,
        },
    ),
    "Load": Picture(
        "A mass of 1 kg falls from the horizontal.",
        3.0,
        ("angle", "speed"),
        {"torque": lambda t: 0.0},
        {"mass": 1.0},
    ),
    "Sensor": Picture(
        "A sine through a lag and steps.",
        1.0,
        ("reading",),
        {"value": lambda t: sin(2.0 * pi * t)},
        {"lag_time": 0.05, "resolution": 0.1},
    ),
    "Reducer": Picture(
        "Kinematic mode: the input turns to and fro while the output carries a load of 10 N.m.",
        1.0,
        ("input_torque", "friction_torque"),
        {
            "imposed_angle": lambda t: R * 0.5 * (1.0 - cos(2.0 * pi * t)),
            "imposed_speed": lambda t: R * pi * sin(2.0 * pi * t),
            "output_angle": lambda t: 0.5 * (1.0 - cos(2.0 * pi * t)) - 0.0005,
            "output_speed": lambda t: pi * sin(2.0 * pi * t),
        },
        {"kinematic": True, "gear_ratio": R, "friction_kinetic": 0.01, "friction_static": 0.01, "shaft_stiffness": 2e4},
    ),
    "Robot": Picture(
        "On flat ground the tracks begin to run, at 3 rad/s after 0.3 s, with the holders free.",
        0.6,
        ("chassis_vx", "rear_ground_normal"),
        {"sprocket_speed": lambda t: -3.0 * min(1.0, t / 0.3)},
    ),
    "Setpoints": Picture("The manoeuvre with its standard values.", 9.0, ("rear_angle", "rear_speed", "front_angle"), {}),
}
ICONS = {"Reducer": "r", "Motor": "M", "Controller": "PD", "Load": "J", "Sensor": "S"}

SHORT = ("unit", "start", "range")  # columns that share a line on a phone
STYLE = """
body { font: 16px/1.55 system-ui, sans-serif; max-width: 58rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
p, li { max-width: 42rem } h1 { margin: 0 } h2 { margin-top: 2.5rem }
pre { background: #f6f8fa; padding: 0.7rem 1rem; overflow-x: auto; line-height: 1.4; font-size: 0.9rem }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.15rem 1rem; max-width: 42rem } dd { margin: 0 }
dt { font-family: ui-monospace, monospace } figure { margin: 1.5rem 0 } svg { max-width: 100%; height: auto }
table { border-collapse: collapse; width: 100%; margin: 0.5rem 0 1.5rem } th { text-align: left; background: #eef2f6 }
td, th { border: 1px solid #ccd; padding: 0.25rem 0.5rem; vertical-align: top }
@media (max-width: 48rem) {
  tr, td { display: block } tr { border-top: 1px solid #ccd; padding: 0.4rem 0 }
  td { border: 0; padding: 0 } td:first-child { font-weight: 600; overflow-wrap: anywhere } td.short { display: inline-block; margin-right: 1rem }
  td.short::before { content: attr(data-label) " "; color: #667 } td.short:empty, td:empty, tr:first-child { display: none }
}
"""


def page(slave: Slave, key: str, sources: str) -> str:
    """documentation/index.html of a slave; `key` names its content, `sources` what it is made of, whatever its start values are."""
    face = type(slave)
    name, effects = face.__name__, getattr(slave.law, "EFFECTS", ())
    laws = [cleandoc(module.__doc__ or "") for module in face.explained or (slave.law,)]
    parts = [
        f"<h1>{escape(name)}.fmu</h1><p>{escape(face.__doc__ or '')}</p>",
        "<h2>Equations</h2>",
        *(_prose(law) for law in laws),
        *(f"<figure>{svg}<figcaption>{escape(text)}</figcaption></figure>" for svg, text in _drawn(slave, sources)),
        "<h2>Variables</h2>",
    ]
    own = {parameter.name for effect in effects for parameter in effect.parameters}
    table = [row for row in slave._table if row.name not in own]
    first, last = slave._first_output, slave._first_parameter
    for title, some in (("Inputs", table[:first]), ("Outputs", table[first:last]), ("Parameters", table[last:])):
        parts.append(f"<h3>{title}</h3>{_variables(some, start=title != 'Outputs')}" if some else "")
    if effects:
        parts.append(f"<h2>Effects</h2><p>Off by default.</p>{_effects(effects, slave)}")
    parts.append(f"<p>Content {key}. FMI 2.0 for co-simulation.</p>")
    head = f"<meta charset='utf-8'>{policy()}<meta name='viewport' content='width=device-width'><title>{name}.fmu</title><style>{STYLE}</style>"
    return f"<!DOCTYPE html><html lang='en'><head>{head}</head><body>{''.join(parts)}</body></html>"


TERM = re.compile(r"(\S.{0,15}?)  +(\S.*)")  # "F  input torque": a symbol, two spaces, what it is


def _prose(text: str) -> str:
    """A docstring as HTML: indented lines are formulas, kept as they are; symbols with two spaces behind make a list."""
    parts: list[str] = []
    for kind, lines in _runs(text):
        if kind == "formula":
            parts.append(f"<pre>{escape(cleandoc(chr(10) + chr(10).join(lines)))}</pre>")
        elif kind == "terms":
            pairs = (match.groups() for line in lines if (match := TERM.fullmatch(line)))
            parts.append("<dl>" + "".join(f"<dt>{escape(a)}</dt><dd>{escape(b)}</dd>" for a, b in pairs) + "</dl>")
        elif kind == "words":
            parts.append("<p>" + re.sub("`(.+?)`", r"<code>\1</code>", escape(" ".join(lines))) + "</p>")
    return "".join(parts)


def _runs(text: str) -> list[tuple[str, list[str]]]:
    """Neighbouring lines of one kind: words, formula, terms."""
    runs: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        kind = "blank" if not line else "formula" if line.startswith(" ") else "terms" if TERM.fullmatch(line) else "words"
        if runs and runs[-1][0] == kind:
            runs[-1][1].append(line)
        else:
            runs.append((kind, [line]))
    return runs


def _rows(header: list[str], rows: list[list[str]]) -> str:
    def cell(label: str, text: str) -> str:
        return f"<td class='short' data-label='{label}'>{escape(text)}</td>" if label in SHORT else f"<td>{escape(text)}</td>"

    lines = ("<tr>" + "".join(cell(label, text) for label, text in zip(header, row)) + "</tr>" for row in rows)
    return f"<table><tr>{''.join(f'<th>{escape(label)}</th>' for label in header)}</tr>{''.join(lines)}</table>"


def _variables(table: list[Variable], start: bool) -> str:
    def limits(row: Variable) -> str:
        return "" if row.minimum is row.maximum is None else f"{_number(row.minimum, '-inf')} … {_number(row.maximum, 'inf')}"

    cells = [[row.name, row.unit, *([str(row.start)] if start else []), limits(row), row.description] for row in table]
    return _rows(["name", "unit", *(["start"] if start else []), "range", "description"], cells)


def _number(value: float | None, missing: str) -> str:
    return missing if value is None else f"{value:.6g}"


def _effects(effects: tuple[Effect, ...], slave: Slave) -> str:
    rows = []
    for effect in effects:
        for parameter in effect.parameters:
            start = slave._table[slave._place[parameter.name]].start
            named = f"{parameter.name} [{parameter.unit}]"
            said = [effect.name, effect.summary, named, str(start), parameter.description, effect.advice, effect.source]
            rows.append(said)
    return _rows(["effect", "formula", "parameter", "start", "description", "the run that tells it", "source"], rows)


def _drawn(slave: Slave, sources: str) -> list[tuple[str, str]]:
    """The picture of a component as (svg, caption), or nothing where it has none.

    It shows the law at start values of its own, so that it is drawn once for a law, not for each FMU of it.
    """
    picture = PICTURES.get(name := type(slave).__name__)
    if not picture:
        return []
    drawn = _once(name, sources, ".svg", lambda: _svg(slave, picture).encode())
    return [(drawn.decode(), picture.caption)]


def _once(name: str, of: str, ending: str, draw: Callable[[], bytes]) -> bytes:
    """A picture as `draw` makes it where the cache has none of this name, that is `of` the same; matplotlib takes long to load."""
    key = hashlib.sha256(f"{of} {_drawer()}".encode() + Path(__file__).read_bytes()).hexdigest()[:12]
    return cache.kept(f"pictures/{name}_{key}{ending}", lambda path: cache.write(path, draw())).read_bytes()


@once
def _drawer() -> str:
    """The version of what draws."""
    return version("matplotlib")


def _svg(slave: Slave, picture: Picture, points: int = 300) -> str:
    face = type(slave)
    shown = face(instance_name="picture", resources="")
    for name, value in picture.parameters.items():
        shown._set(shown._place[name], value, shown._table[shown._place[name]].type)
    size, times = picture.stop / points, []
    curves: dict[str, list[float]] = {name: [] for name in picture.outputs}
    for step in range(points + 1):
        for name, signal in picture.inputs.items():
            shown.set_real([shown._place[name]], [signal(step * size)])
        if step == 0:
            shown.enter_initialization_mode()
            shown.exit_initialization_mode()
        times.append(step * size)
        for name, curve in curves.items():
            curve.append(shown.value(name))
        shown.do_step(step * size, size)

    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.hashsalt": "selflock", "svg.fonttype": "none"}):
        figure = Figure(figsize=(7, 1.8 * len(curves) + 0.4), layout="constrained")
        for axes, (name, curve) in zip(figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0], curves.items()):
            axes.plot(times, curve, color="tab:blue")
            axes.set_ylabel(f"{name} [{shown._table[shown._place[name]].unit}]".replace(" []", ""))
            axes.grid(alpha=0.3)
        axes.set_xlabel("time [s]")
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    svg = text.getvalue()
    return svg[svg.index("<svg") :]


def icon(name: str) -> bytes:
    """model.png: the component's symbol in a box."""
    return _once(name, "", ".png", lambda: _icon(name))


def _icon(name: str) -> bytes:
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch

    figure = Figure(figsize=(1.28, 1.28), dpi=100)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.axis("off")
    axes.add_patch(FancyBboxPatch((0.12, 0.12), 0.76, 0.76, boxstyle="round,pad=0.04", fc="#eef2f6", ec="#33506b", lw=2.5))
    axes.text(0.5, 0.5, ICONS.get(name, name[:2]), ha="center", va="center", fontsize=34, color="#33506b", fontweight="bold")
    data = io.BytesIO()
    figure.savefig(data, format="png", metadata={"Software": None})
    return data.getvalue()
