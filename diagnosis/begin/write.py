"""The rig file of a guess: what is taken stands, with what is doubtful said beside it; what is not known stands as a comment."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

from selflock.fmus import laws
from selflock.fmus.effect_file import LAWS
from selflock.fmus.shown import visible

from ..data.rig import Rig
from ..data.sanity import assumed
from ..data.signals import MOVES, along
from .driving import DRIVEN
from .guess import LogGuess, Taken
from .raw import LIKELY, SURE, UNSURE

WIDTH = 150  # characters of a comment about a column
FIRST = (
    "reducer.gear_ratio", "motor.resistance", "motor.torque_constant", "motor.voltage_constant", "motor.inductance",
    "reducer.wedge_angle", "reducer.friction_kinetic", "reducer.friction_static", "reducer.shaft_inertia", "reducer.viscous_damping",
    "reducer.drag_torque", "load.inertia", "load.mass", "load.arm", "load.arm_angle", "load.constant_torque", "load.damping",
    "controller.angle_gain", "controller.speed_gain", "controller.voltage_max", "controller.voltage_min",
)  # fmt: skip
"""What data sheets and drawings tell, in the order in which somebody looks for it."""


def quoted(text: str) -> str:
    """A text as TOML has it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def told(text: str, width: int = WIDTH) -> str:
    """Words of a stranger in one line of a comment."""
    line = " ".join(visible(text).split())
    return line if len(line) <= width else line[: width - 1] + "…"


def number(value: float) -> str:
    """A factor to nine digits, as TOML has a float."""
    text = f"{value:.9g}"
    return text if any(c in text for c in ".en") else text + ".0"


def entry(one: Taken) -> str:
    """What a column is, as its line in the rig has it."""
    parts = [f"column = {quoted(one.column)}"]
    if one.unit:
        parts.append(f"unit = {quoted(one.unit)}")
    if one.lacks:
        parts.append(f"{one.lacks} = ?")
    if one.factor != 1.0 and one.lacks != "factor":
        parts.append(f"factor = {number(one.factor)}")
    if one.offset:
        parts.append(f"offset = {number(one.offset)}")
    if one.nominal:
        parts.append(f"nominal = {number(one.nominal)}")
    if one.wraps:
        parts.append(f"wraps = {number(one.wraps)}")
    if one.commanded:
        parts.append("commanded = true")
    return f"{quoted(one.signal)} = {{ {', '.join(parts)} }}"


def text(guess: LogGuess, kind: str, why: str, path: Path) -> str:
    """The whole file."""
    return "\n".join(_lines(guess, kind, why, path)) + "\n"


def _lines(guess: LogGuess, kind: str, why: str, path: Path) -> Iterator[str]:
    raw = guess.raw
    logs = ", ".join(told(p.name) for p in raw.paths[:4]) + (f" and {len(raw.paths) - 4} more" if len(raw.paths) > 4 else "")
    yield f"# A rig to begin with, read from {logs} ({raw.rows} rows) by `selflock rig init`."
    yield "# What stands behind # is not in force. Look at what is unsure, give what the data sheets say below, then:"
    yield f"#   selflock replay {told(path.name)} {told(raw.paths[0].name)}"
    for note in guess.notes + raw.notes:
        yield f"# Note: {told(note, 4 * WIDTH)}"
    yield ""
    yield "[rig]"
    yield f"name = {quoted(path.stem if path.stem != 'rig' else raw.paths[0].stem)}"
    yield f'kind = "{kind}"  # {told(why)}' if kind else '# kind = "forward"  # inverse, forward or steady: docs/rig.md'
    if raw.run:
        yield f"run = {quoted(raw.run)}  # its values tell runs apart"
        if kind == "steady":
            yield 'hold_out = "every second run"  # which runs judge, where no --test log is given'
    if guess.linear:
        yield "linear = true  # m, m/s, N, kg stand for rad, rad/s, N.m, kg.m2"
    elif kind and all(one.unsaid for name, one in guess.taken.items() if name in MOVES):
        yield "# linear = true  # of a drive that pushes: m, m/s, N, kg stand for rad, rad/s, N.m, kg.m2, in the units below, too"
    if guess.valid:
        yield f"valid = {quoted(guess.valid)}  # where it is 0 samples are left out"
    if closed(guess, kind):
        yield 'simulate = "closed"  # the whole drive from its set-points, for no column says what drives it; the controller is described below'
    elif kind == "forward" and "controller.angle_setpoint" in guess.taken:
        yield '# simulate = "closed"  # the whole drive from its set-points, where the controller is described below'
    if not kind:
        yield '# system = "model.fmu"  # of what is no drive: a system of FMUs, whose variables are named under [columns]'
    yield ""
    yield from _clock(guess, kind)
    yield ""
    yield "[columns]"
    for one in guess.taken.values():
        line = entry(one)
        if one.lacks:
            yield f"# {line}  # {one.sure}: {told('; '.join(one.why))}"
        else:
            yield f"{line}  # {one.sure}: {told('; '.join(one.why))}"
    if guess.left or raw.texts:
        yield "#"
        yield "# not placed (to use one: name its variable, docs/rig.md; any other name, such as room.temperature, is read beside the drive):"
        for name, looks in (guess.left | raw.texts).items():
            yield f'# "" = {{ column = {quoted(name)} }}  # {told(looks)}'
    if raw.scalars:
        yield "# single numbers in the file: " + told(", ".join(f"{name} = {value:.6g}" for name, value in raw.scalars.items()))
    yield ""
    yield from _parameters(guess, kind, path)


def closed(guess: LogGuess, kind: str) -> bool:
    """Whether a log has a loop's set-points and its motion, and nothing between."""
    return kind == "forward" and "controller.angle_setpoint" in guess.taken and not DRIVEN & set(guess.taken)


def _clock(guess: LogGuess, kind: str) -> Iterator[str]:
    clock = guess.raw.clock
    yield "[time]"
    if clock.column:
        yield f"column = {quoted(clock.column)}  # {clock.sure}: {told(clock.why)}"
        if clock.unit:
            yield f'unit = "{clock.unit}"'
        if clock.spread:
            yield "spread = true  # rows are evenly apart: the times are written too coarsely"
    elif clock.step:
        yield f"step = {number(clock.step)}  # s between rows: {told(clock.why)}"
    elif kind == "steady":
        yield "# no column has the time, and points at constant speed need none"
        return
    else:
        yield "# step = 0.001  # s between rows: no column has the time. The recorder's setting says it; without it nothing can be replayed"
    yield "# skip = 100 (rows), from = 0.5 and to = 20.0 (s) leave a run's begin and end out; lowpass = 50.0 (Hz), every = 5 (rows) smooth it"


def _parameters(guess: LogGuess, kind: str, path: Path) -> Iterator[str]:
    yield "[parameters]"
    if not kind:
        return
    if guess.ratio:
        value, error, by = guess.ratio
        near = round(value, max(0, 3 - int(math.floor(math.log10(max(value, 1e-9))))))
        held = "" if guess.firm else "# "
        yield f'{held}"reducer.gear_ratio" = {number(near)}  # by the log: {told(by)}, {value:.6g} ± {max(error, 1e-6 * value):.1g}; the data sheet has it exactly'
    yield "# What the data sheets say: take away the # and give the value. What stays behind # is assumed as it stands."
    yield "# A value that no sheet tells goes under [uncertain], with its bounds."
    rows, seldom = parameters(guess, kind, path), False
    for name in sorted(rows, key=lambda n: FIRST.index(n) if n in FIRST else len(FIRST)):
        if name not in FIRST and not seldom:
            seldom = True
            yield "# Seldom on a sheet, and seldom missed:"
        if name == "reducer.gear_ratio" and guess.ratio:
            continue
        value, unit, about = rows[name]
        hint = f"; {guess.hints[name]}" if name in guess.hints else ""
        yield f'# "{name}" = {number(value)}  # {unit + ", " if unit else ""}data sheet: {told(about)}{hint}'
    yield ""
    yield "# [uncertain]  # what no sheet tells, such as friction: [lowest, highest], refitted by `selflock diagnose`"
    yield '# "reducer.friction_kinetic" = [0.0, 0.5]'


def parameters(guess: LogGuess, kind: str, path: Path) -> dict[str, tuple[float, str, str]]:
    """Value, unit and meaning of every parameter that would be assumed."""
    rig = Rig(
        path,
        "",
        kind,
        (),
        {"reducer.gear_ratio": guess.ratio[0]} if guess.ratio and guess.firm else {},
        linear=guess.linear,
        simulate="closed" if closed(guess, kind) else "",
    )
    found = assumed(rig, set(guess.taken))
    seen = {"load.mass": ("load.arm", "load.arm_angle", "load.gravity")}
    rows = {}
    for name, (value, unit) in found.items():
        rows[name] = (value, unit, _about(name))
    for owner, more in seen.items():
        for name in more:
            if owner in rows and name not in rows and (row := _row(name)) is not None:
                rows[name] = (
                    row.off,
                    along(row.unit, name) if guess.linear else row.unit,
                    f"{_about(name)}, where there is a {owner}",
                )
    return rows


def _row(name: str):
    component, _, parameter = name.partition(".")
    return next((p for p in laws.module(LAWS[component]).BASE if p.name == parameter), None)


def _about(name: str) -> str:
    row = _row(name)
    return row.description if row is not None else ""


def table(guess: LogGuess) -> list[tuple[str, str, str, str]]:
    """Rows of what is printed: column, taken as, how sure, why."""
    raw, rows = guess.raw, []
    clock = raw.clock
    if clock.column:
        rows.append((clock.column, f"time{f' [{clock.unit}]' if clock.unit else ''}", clock.sure, clock.why))
    elif clock.step:
        rows.append(("", f"a row every {clock.step:g} s", clock.sure, clock.why))
    if raw.run:
        rows.append((raw.run, "run", SURE, "tells runs apart"))
    if guess.valid:
        rows.append((guess.valid, "valid", "likely", "a mark that is 0 and 1, by its name"))
    for one in guess.taken.values():
        unit = f" [{one.unit}]" if one.unit else f" [× {one.factor:.4g}]" if one.factor not in (1.0, -1.0) else ""
        sign = "-" if one.factor < 0.0 else ""
        placed = f"{sign}{one.signal}{unit}" if not one.lacks else f"({one.signal}, give {one.lacks})"
        rows.append((one.column, placed, one.sure, "; ".join(one.why)))
    if guess.ratio:
        value, error, by = guess.ratio
        rows.append(
            (
                "",
                f"gear ratio {value:.6g}",
                UNSURE if not guess.firm else LIKELY if "one unit" in by else SURE,
                f"{by}, ± {max(error, 1e-6 * value):.1g}",
            )
        )
    for name, looks in (guess.left | raw.texts).items():
        rows.append((name, "-", "", looks))
    return rows
