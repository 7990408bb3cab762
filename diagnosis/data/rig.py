"""The rig: what the columns of a log are, and what is known of the drive that made it (docs/rig.md)."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime
from fnmatch import fnmatch
from math import isfinite
from pathlib import Path
from typing import Any

from selflock.fmus.shown import one_line
from selflock.master import toml
from selflock.master.drives import KNOWN

from ..errors import DataError
from ..rules import RULES
from .signals import ALIASES, SETPOINTS, SIGNALS, canonical, unit
from .units import conversion

KINDS = ("inverse", "forward", "steady")
SHARES = {"%": 1e-2, "‰": 1e-3, "permille": 1e-3, "1": 1.0}
"""Units of what is told as a share of a nominal value."""
EVERY_SECOND = "every second run"
SMOOTH, HELD = "smooth", "held"
LOAD, MOTOR, DUAL = "load", "motor", "dual"

TABLES = ("rig", "time", "columns", "parameters", "uncertain", "calibrate", "logs", "fleet")
HEAD: dict[str, type] = {"name": str, "kind": str, "description": str, "linear": bool, "run": str, "known": list, "system": str, "drives": list,
        "named": bool, "effects": str, "hold_out": str, "simulate": str, "valid": str, "smoothing": float, "step": float, "inputs": str,
        "loop": str, "unit": str, "recorded": str}  # fmt: skip
TIME: dict[str, type] = {"column": str, "unit": str, "factor": float, "step": float, "spread": bool,
        "skip": float, "from": float, "to": float, "lowpass": float, "every": float}  # fmt: skip
COLUMN: dict[str, type] = {
    "column": str,
    "unit": str,
    "factor": float,
    "offset": float,
    "nominal": float,
    "commanded": bool,
    "wraps": float,
    "value": float,
}
FLEET: dict[str, type] = {"logs": str}
WANTED: dict[str, type] = {"start": float, "low": float, "high": float, "each_run": bool}
_TYPES = {str: "text in quotes", bool: "true or false", float: "a number", list: 'a list of texts, such as ["a", "b"]'}
CHOICES = {
    "hold_out": ("", EVERY_SECOND),
    "inputs": ("", SMOOTH, HELD),
    "simulate": ("", "open", "closed", "whole", "parts"),
    "loop": ("", LOAD, MOTOR, DUAL),
}


@dataclass(frozen=True)
class LogColumn:
    """One column of a log: signal = factor · (value in its unit, as SI) + offset."""

    column: str
    signal: str  # drive prefix + canonical name, such as "rear_motor.current"
    unit: str = ""  # of the values in the log; "" takes the header's or SI
    factor: float = 1.0
    offset: float = 0.0
    late: bool = False  # a row has the command of the step that ends there
    nominal: float = 0.0  # SI: what 100 % is, of a column that is a share of it
    commanded: bool = False  # somebody gave it as a number: it may rest and jump
    wraps: float = 0.0  # in the unit of the log: an angle that begins anew there; 0: it does not
    value: float | None = None  # of a set-point that is one number, in no column


@dataclass(frozen=True)
class Rows:
    """Which rows of a log are used, at which times, and how they are made fewer."""

    step: float = 0.0  # s between rows, of a log without a column of time
    spread: bool = False  # the times are too coarse: rows are evenly apart
    skip: int = 0  # rows at the begin of each run that are left out
    first: float = 0.0  # s after a run's begin, from which on it is used
    last: float = float("inf")  # s after a run's begin, until which
    lowpass: float = 0.0  # Hz: all channels are filtered alike, forward and backward; 0: not at all
    every: int = 1  # rows that become one, their mean


@dataclass(frozen=True)
class Wanted:
    """A number of a system that `calibrate` fits; None: as the system and its FMU say."""

    start: float | None = None  # from where the first fit begins
    low: float | None = None
    high: float | None = None
    each_run: bool = False  # each run has one of its own, as the state that it begins with


@dataclass(frozen=True)
class Rig:
    """A measurement and its nominal simulation, as plain data."""

    path: Path
    name: str
    kind: str  # inverse | forward | steady
    columns: tuple[LogColumn, ...]
    parameters: dict[str, float]  # nominal, "component.parameter"
    uncertain: dict[str, tuple[float, float]] = field(default_factory=dict)  # refitted in every search
    wanted: dict[str, Wanted] = field(default_factory=dict)  # what `calibrate` fits beside what is uncertain
    known: frozenset[str] = frozenset()  # never questioned
    time: LogColumn = LogColumn("time", "time")
    rows: Rows = Rows()
    run: str = ""  # column that tells runs apart
    linear: bool = False
    drives: tuple[str, ...] = ("",)  # prefixes of the drives, such as "front_", "rear_"
    alone: str = ""  # with what this file and its logs begin the names of their one drive; all else leaves it out
    named: bool = False  # columns named component.variable stand for themselves
    hold_out: str = ""  # EVERY_SECOND | "" (blocks)
    valid: str = ""  # column that is 0 where a sample does not belong to the rig's kind, as with the power switched off
    simulate: str = (
        ""  # forward rigs: the whole drive, "open" | "closed" | "whole"; "parts": each component on its measured inputs
    )
    loop: str = ""  # LOAD | MOTOR: at which shaft the controller's sensors are; DUAL: its angle's at the load, its speed's at the motor; "": the load's, or as the log tells
    smoothing: float = 0.0  # s over which motions and torques are smoothed alike; 0: chosen by their noise
    logs: dict[str, dict[str, float]] = field(default_factory=dict)  # other parameters for logs whose name fits a pattern
    system: Path | None = None  # an FMU system to replay instead of a drive
    step: float = 0.0  # s; of that system, in place of its own
    inputs: str = (
        ""  # SMOOTH: what the log gives to that system is read in the middle of each step, on a smooth curve through its rows
    )
    unit: str = ""  # which one of a fleet the drive is
    recorded: str = ""  # when its logs were recorded, ISO 8601; "": the log or its file says it
    recorded_by: str = "rig"  # who says so: "rig", or the "name" of a file of a fleet
    pattern: str = ""  # how the logs of a fleet lie in their folder: tracking.logs
    only: str = ""  # the one component that is compared
    units: dict[str, str] = field(default_factory=dict)  # of that system's variables, as its FMUs tell
    effects: Path | None = None  # folder of effects that join ours; code, so that it needs allow_code
    allow_code: bool = False  # parts of other packages, and effects, may be loaded; no rig file can say so
    isolate: bool = False  # every FMU of its system runs in a process of its own with limits and without rights

    def of_log(self, name: str) -> dict[str, float]:
        """Parameters that belong to this log alone."""
        found: dict[str, float] = {}
        for pattern, values in self.logs.items():
            if fnmatch(name, pattern):
                found |= values
        return found

    @property
    def commanded(self) -> frozenset[str]:
        """Signals that somebody gave as numbers, as the rig says."""
        return frozenset(column.signal for column in self.columns if column.commanded)

    def questioned(self, parameter: str) -> bool:
        """Whether a diagnosis may doubt this nominal value."""
        return parameter not in self.known and parameter.split(".")[0] + ".*" not in self.known

    def trusted(self, channel: str) -> bool:
        """Whether what this channel's sensor says is never doubted. What is known of a component says nothing of its sensors."""
        return not self.known.isdisjoint({channel, f"sensor.{channel}.*", "sensor.*"})


def load(path: str | Path) -> Rig:
    """Read a rig file; DataError tells what is wrong in it."""
    path = Path(path)
    try:
        data = toml.read(path)
    except OSError as error:
        raise DataError(
            f"{path}: cannot be read ({error.strerror}). Give the path of a rig file (.toml); docs/rig.md shows one."
        ) from None
    except UnicodeDecodeError:
        raise DataError(f"{path}: is not a text file. The rig comes first, then the logs: selflock diagnose RIG LOG.") from None
    except ValueError as error:
        raise DataError(f"{path}: is not TOML: {error}. docs/rig.md shows a rig file.") from None
    if other := toml.of_another_kind(path, data, "rig"):
        raise DataError(f"{other} The rig comes first, then the logs; docs/rig.md shows one.")
    return _rig(path, data)


def _rig(path: Path, data: dict) -> Rig:
    _only(path, "table", data, TABLES)
    for table in data:
        if not isinstance(data[table], dict):
            raise DataError(f"{path}: {table!r} is a table: write [{table}], and its keys below.")
        _one_line_each(path, f"[{table}]", data[table])
    head = _typed(path, "[rig]", data.get("rig", {}), HEAD)
    for key in ("drives", "system", "effects"):
        _one_line_each(path, f"[rig] {key}", given if isinstance(given := head.get(key, []), list) else [given])
    alone = head["drives"][0] if len(head.get("drives", [])) == 1 and not head.get("system") else ""
    if alone:
        data, head = (
            _bared(path, data, alone),
            head | {"drives": [""], "known": [_bare(name, alone) for name in head.get("known", [])]},
        )
    clock = _typed(path, "[time]", data.get("time", {}), TIME)
    system = head.get("system")
    kind = head.get("kind", "forward" if system else None)
    if kind not in KINDS:
        raise DataError(
            f'{path}: [rig] kind = {kind!r}: write "inverse" (motion imposed, torque measured), '
            '"forward" (voltage or duty in, motion or current out) or "steady" (steady-state points).'
        )
    for key, allowed in CHOICES.items():
        if head.get(key, "") not in allowed:
            raise DataError(
                f"{path}: [rig] {key} = {head[key]!r}: write {' or '.join(repr(a) for a in allowed if a)}, or leave it out."
            )
    linear, drives = head.get("linear", False), tuple(head.get("drives", [""]))
    columns = tuple(_column(path, name, entry, drives, linear, bool(system)) for name, entry in data.get("columns", {}).items())
    taken: dict[str, str] = {}
    for column in columns:
        if column.signal in taken:
            raise DataError(
                f"{path}: columns {taken[column.signal]!r} and {column.column!r} are both {column.signal}. Keep one of them."
            )
        taken[column.signal] = column.column
        for other in columns if column.column and not system else ():  # of a drive, whose signals have one unit each
            mine, theirs = (unit(split(one.signal, drives)[1], linear) for one in (column, other))
            if other.column == column.column and mine != theirs:
                raise DataError(
                    f"{path}: column {column.column!r} cannot be both {column.signal} ({mine}) and {other.signal} ({theirs}): "
                    "one of them is another column."
                )
    named = head.get("named", False)
    if not columns and not named:
        raise DataError(
            f"{path}: [columns] is empty. Say which column is which variable, such as "
            '"reducer.input_speed" = { column = "speed", unit = "rpm" }.'
        )
    for pattern, table in data.get("logs", {}).items():
        if not isinstance(table, dict):
            raise DataError(f'{path}: [logs] {pattern!r} = {table!r}: write [logs."{pattern}"], and parameters below.')
    return Rig(
        path=path,
        name=head.get("name", path.stem),
        kind=kind,
        columns=columns,
        time=LogColumn(clock.get("column", "time"), "time", clock.get("unit", ""), clock.get("factor", 1.0)),
        rows=_rows(path, clock),
        parameters=_of_the_drive(_numbers(path, "parameters", data.get("parameters", {})), () if system else drives),
        uncertain=_ranges(path, data.get("uncertain", {})),
        wanted={name: _wanted(path, name, entry) for name, entry in data.get("calibrate", {}).items()},
        logs={pattern: _numbers(path, f'logs."{pattern}"', table) for pattern, table in data.get("logs", {}).items()},
        known=frozenset(head.get("known", [])),
        run=head.get("run", ""),
        linear=linear,
        drives=drives,
        alone=alone,
        named=named,
        hold_out=head.get("hold_out", ""),
        simulate=head.get("simulate", ""),
        loop=head.get("loop", ""),
        valid=head.get("valid", ""),
        smoothing=head.get("smoothing", 0.0),
        step=head.get("step", 0.0),
        inputs=head.get("inputs", ""),
        unit=head.get("unit", ""),
        recorded=_date(path, head.get("recorded", "")),
        pattern=_typed(path, "[fleet]", data.get("fleet", {}), FLEET).get("logs", ""),
        system=(path.parent / system) if system else None,
        effects=(path.parent / head["effects"]) if head.get("effects") else None,
    )


def _one_line_each(path: Path, where: str, names: Iterable[str]) -> None:
    """Refuse names that would break the lines of a message or of the answer."""
    for name in names:
        if one_line(name) != name:
            raise DataError(f"{path}: {where} '{one_line(name)}': a name has no line breaks, tabs or other control characters.")


def _of_the_drive(given: dict[str, float], drives: tuple[str, ...]) -> dict[str, float]:
    """Parameters, with what a controller is told of its drive where the rig says it of the drive alone."""
    beside = {
        f"{prefix}controller.{key}": given[f"{prefix}{part}.{key}"]
        for prefix in drives
        if any(name.startswith(f"{prefix}controller.") for name in given)
        for key, part in KNOWN.items()
        if f"{prefix}{part}.{key}" in given
    }
    return beside | given


def _bared(path: Path, data: dict, prefix: str) -> dict:
    """A rig of one drive with its names as every other rig has them: without what they begin with."""
    found = dict(data)
    for table in ("columns", "parameters", "uncertain", "calibrate"):
        found[table] = {_bare(name, prefix): value for name, value in data.get(table, {}).items()}
        for name in data.get(table, {}) if table != "columns" else ():
            if name == _bare(name, prefix):
                raise DataError(
                    f"{path}: [{table}] {name!r}: there is no such component. The drives are {prefix}: begin with one of them."
                )
    found["logs"] = {
        pattern: {_bare(name, prefix): value for name, value in table.items()} if isinstance(table, dict) else table
        for pattern, table in data.get("logs", {}).items()
    }
    return found


def _bare(name: str, prefix: str) -> str:
    """arm_load.angle as load.angle, sensor.arm_load.angle.bias as sensor.load.angle.bias; other names as they are."""
    before = "sensor." if name.startswith(f"sensor.{prefix}") else ""
    return before + name.removeprefix(before).removeprefix(prefix)


def _date(path: Path, text: str) -> str:
    """A date, or a date with its time of day, as ISO 8601 has them."""
    try:
        return datetime.fromisoformat(text).isoformat(timespec="seconds") if text else ""
    except ValueError:
        raise DataError(
            f'{path}: [rig] recorded = {text!r} is no date: write it as "2026-05-31" or "2026-05-31T14:00".'
        ) from None


def _rows(path: Path, clock: dict[str, Any]) -> Rows:
    """What [time] says of the rows, each number in its range."""
    for key in ("skip", "every"):
        if clock.get(key, 1.0) != int(clock.get(key, 1.0)):
            raise DataError(f"{path}: [time] {key} = {clock[key]:g} counts rows: write a whole number.")
    for key, least in (("step", 0.0), ("skip", 0.0), ("from", 0.0), ("lowpass", 0.0), ("every", 1.0)):
        if clock.get(key, least) < least:
            raise DataError(f"{path}: [time] {key} = {clock[key]:g}: write a number of at least {least:g}.")
    if clock.get("to", float("inf")) <= clock.get("from", 0.0):
        raise DataError(
            f"{path}: [time] to = {clock['to']:g} s ends before from = {clock.get('from', 0.0):g} s, both after a run's begin."
        )
    return Rows(
        clock.get("step", 0.0), clock.get("spread", False), int(clock.get("skip", 0)), clock.get("from", 0.0),
        clock.get("to", float("inf")), clock.get("lowpass", 0.0), int(clock.get("every", 1)),
    )  # fmt: skip


def _typed(path: Path, where: str, given: dict, types: dict[str, type]) -> dict[str, Any]:
    """The keys of a table, each known and of its type; numbers as finite floats."""
    _only(path, f"key of {where}", given, types)
    found: dict[str, Any] = {}
    for key, value in given.items():
        kind: Any = types[key]
        if kind is float:
            found[key] = _number(path, f"{where} {key}", value)
        elif type(value) is kind and (kind is not list or all(isinstance(item, str) for item in value)):
            found[key] = value
        else:
            raise DataError(f"{path}: {where} {key} = {value!r} is not {_TYPES[kind]}.")
    return found


def _number(path: Path, where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
        raise DataError(f"{path}: {where} = {value!r} is not a number.")
    return float(value)


def _only(path: Path, what: str, given: dict, allowed) -> None:
    for key in given:
        if key not in allowed:
            raise DataError(f"{path}: unknown {what} {key!r}.{suggest(key, allowed)}")


def suggest(name: str, among) -> str:
    """' Did you mean …?' or the names that exist."""
    close = difflib.get_close_matches(name, list(among), n=1)
    return f" Did you mean {close[0]!r}?" if close else f" There are: {', '.join(sorted(among))}."


def split(name: str, drives: tuple[str, ...]) -> tuple[str, str]:
    """'rear_motor.current' as ('rear_', 'motor.current')."""
    for prefix in sorted(drives, key=len, reverse=True):
        if name.startswith(prefix):
            return prefix, name[len(prefix) :]
    return "", name


def _column(path: Path, name: str, entry: Any, drives: tuple[str, ...], linear: bool, plain: bool) -> LogColumn:
    if isinstance(entry, str):
        entry = {"column": entry}
    if isinstance(entry, dict) and "value" in entry:
        return _one_number(path, name, entry, drives, linear)
    if not isinstance(entry, dict) or "column" not in entry:
        quotes = " A name with a dot stands in quotes." if "." not in name else ""
        raise DataError(f'{path}: [columns] "{name}": say which column, as "{name}" = {{ column = "..." }}.{quotes}')
    entry = _typed(path, f'[columns] "{name}"', entry, COLUMN)
    given, signal, nominal = entry.get("unit", ""), name, entry.get("nominal", 0.0)
    if "nominal" in entry and not (nominal > 0.0 and given in ("", *SHARES)):
        raise DataError(
            f"{path}: [columns] {name!r}: nominal = {nominal:g} is what 100 % is, above 0, of a column with unit = "
            f"{' or '.join(map(repr, SHARES))}. A sign belongs in factor."
        )
    if given in SHARES and not nominal and not plain and given != "1" and unit(canonical(split(name, drives)[1]), linear) != "1":
        wanted = unit(canonical(split(name, drives)[1]), linear)
        raise DataError(f"{path}: [columns] {name!r} is in {given}: say what 100 % is, as nominal = ... in {wanted}.")
    if not plain:  # else a variable of an FMU system, whatever its name
        prefix, bare = split(name, drives)
        signal = prefix + _signal(path, name, bare)
        try:
            conversion("" if nominal else given, unit(canonical(bare), linear))
        except ValueError as error:
            raise DataError(f"{path}: [columns] {name!r}: {error}.") from None
    return LogColumn(entry["column"], signal, given, entry.get("factor", 1.0), entry.get("offset", 0.0), False, nominal, entry.get("commanded", False), entry.get("wraps", 0.0))  # fmt: skip


def _one_number(path: Path, name: str, entry: dict[str, Any], drives: tuple[str, ...], linear: bool) -> LogColumn:
    """A set-point that is one number, as of a controller that is asked for no speed; whatever is measured stands in a column."""
    prefix, bare = split(name, drives)
    if canonical(bare) not in SETPOINTS:
        raise DataError(
            f"{path}: [columns] {name!r}: value = {entry['value']} is for what is asked for alone, "
            f"{' or '.join(sorted(SETPOINTS))}: say which column has it."
        )
    if more := {*entry} - {"value", "unit"}:
        raise DataError(
            f"{path}: [columns] {name!r}: value stands in the place of a column: leave out {', '.join(sorted(more))}."
        )
    entry = _typed(path, f'[columns] "{name}"', entry, COLUMN)
    signal, given = canonical(bare), entry.get("unit", "")
    try:
        conversion(given, unit(signal, linear))
    except ValueError as error:
        raise DataError(f"{path}: [columns] {name!r}: {error}.") from None
    return LogColumn("", prefix + signal, given, value=entry["value"])


def _signal(path: Path, name: str, bare: str) -> str:
    """The one name of a signal; any other name is a variable beside the drive, unless it looks like a slip of the pen."""
    signal = canonical(bare)
    if signal in SIGNALS:
        return signal
    if bare.split(".")[0] in {"controller", "motor", "reducer", "load"}:
        raise DataError(f"{path}: [columns] {name!r} is not a variable that a log can hold.{suggest(bare, SIGNALS)}")
    if difflib.get_close_matches(bare.lower(), [*SIGNALS, *ALIASES], n=1, cutoff=RULES.data.like_name):
        raise DataError(
            f"{path}: [columns] {name!r} is no variable of the drive.{suggest(bare.lower(), [*SIGNALS, *ALIASES])} "
            "If it is another quantity, give it another name."
        )
    return signal


def _numbers(path: Path, table: str, given: dict) -> dict[str, float]:
    for name, value in given.items():
        if isinstance(value, dict):
            raise DataError(f'{path}: [{table}] {name}: write it as "component.parameter" = number, with the name in quotes.')
    return {  # true and false are for a switch alone: whoever knows the parameters holds them against it
        name: value if isinstance(value, bool) else _number(path, f'[{table}] "{name}"', value) for name, value in given.items()
    }


def _wanted(path: Path, name: str, entry: Any) -> Wanted:
    where = f'[calibrate] "{name}"'
    if isinstance(entry, list):
        low, high = _ranges(path, {name: entry}, "calibrate")[name]
        return Wanted(None, low, high)
    if not isinstance(entry, dict) or not set(entry) <= set(WANTED):
        raise DataError(
            f'{path}: {where} = {entry!r}: write "component.parameter" = [low, high], or {{ start = 0.5, low = 0.0, high = 2.0 }}, '
            "with each_run = true for what every run begins with anew, and the name in quotes."
        )
    found = Wanted(**_typed(path, where, entry, WANTED))
    if found.low is not None and found.high is not None and not found.low < found.high:
        raise DataError(f"{path}: {where}: low = {found.low:g} must be below high = {found.high:g}.")
    return found


def _ranges(path: Path, given: dict, table: str = "uncertain") -> dict[str, tuple[float, float]]:
    ranges = {}
    for name, value in given.items():
        where = f'[{table}] "{name}"'
        if not (isinstance(value, list) and len(value) == 2):
            raise DataError(f"{path}: {where} = {value!r}: write the lowest and the highest value, as [low, high].")
        low, high = (_number(path, where, end) for end in value)
        if low >= high:
            raise DataError(f"{path}: {where} = {value!r}: the lowest value comes first, and the highest is above it.")
        ranges[name] = (low, high)
    return ranges
