"""The rig: what the columns of a log are, and what is known of the drive that made it (docs/rig.md)."""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import dataclass, field
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

from .errors import DataError
from .signals import SIGNALS, canonical, unit

KINDS = ("inverse", "forward", "steady")
_TABLES = {"rig", "time", "columns", "parameters", "uncertain", "logs"}
_RIG_KEYS = {
    "name",
    "kind",
    "description",
    "linear",
    "run",
    "known",
    "system",
    "drives",
    "named",
    "hold_out",
    "simulate",
    "valid",
    "smoothing",
}


@dataclass(frozen=True)
class Column:
    """One column of a log: signal = factor · (value in its unit, as SI) + offset."""

    column: str
    signal: str  # drive prefix + canonical name, such as "rear_motor.current"
    unit: str = ""  # of the values in the log; "" takes the header's or SI
    factor: float = 1.0
    offset: float = 0.0
    late: bool = False  # a row has the command of the step that ends there


@dataclass(frozen=True)
class Rig:
    """A measurement and its nominal simulation, as plain data."""

    path: Path
    name: str
    kind: str  # inverse | forward | steady
    columns: tuple[Column, ...]
    parameters: dict[str, float]  # nominal, "component.parameter"
    uncertain: dict[str, tuple[float, float]] = field(default_factory=dict)  # refitted in every contest
    known: frozenset[str] = frozenset()  # never questioned
    time: Column | None = None
    run: str = ""  # column that tells runs apart
    linear: bool = False
    drives: tuple[str, ...] = ("",)  # prefixes of the drives, such as "front_", "rear_"
    named: bool = False  # columns named component.variable stand for themselves
    hold_out: str = ""  # "every second run" | "" (blocks)
    valid: str = ""  # column that is 0 where a sample does not belong to the rig's kind, as with the power switched off
    simulate: str = ""  # forward rigs: "open" | "closed"; "" decides by the columns
    smoothing: float = 0.0  # s over which motions and torques are smoothed alike; 0: chosen by their noise
    logs: dict[str, dict[str, float]] = field(
        default_factory=dict
    )  # other parameters for logs whose name fits a pattern
    system: Path | None = None  # an FMU system to replay instead of a drive
    only: str = ""  # the one component that is compared
    units: dict[str, str] = field(default_factory=dict)  # of that system's variables, as its FMUs tell

    def of_log(self, name: str) -> dict[str, float]:
        """Parameters that belong to this log alone."""
        found: dict[str, float] = {}
        for pattern, values in self.logs.items():
            if fnmatch(name, pattern):
                found |= values
        return found

    def questioned(self, parameter: str) -> bool:
        """Whether a diagnosis may doubt this nominal value."""
        return parameter not in self.known and parameter.split(".")[0] + ".*" not in self.known


def load(path: str | Path) -> Rig:
    """Read a rig file; DataError tells what is wrong in it."""
    path = Path(path)
    try:
        text = path.read_text()
    except OSError as error:
        raise DataError(
            f"{path}: cannot be read ({error.strerror}). Give the path of a rig file (.toml); docs/rig.md shows one."
        ) from None
    except UnicodeDecodeError:
        raise DataError(
            f"{path}: is not a text file. The rig comes first, then the logs: selflock diagnose RIG LOG."
        ) from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"{path}: is not TOML: {error}. docs/rig.md shows a rig file.") from None
    return _rig(path, data)


def _rig(path: Path, data: dict) -> Rig:
    _only(path, "table", data, _TABLES)
    head = data.get("rig", {})
    _only(path, "key of [rig]", head, _RIG_KEYS)
    system = head.get("system")
    kind = head.get("kind", "forward" if system else None)
    if kind not in KINDS:
        raise DataError(f"{path}: [rig] kind = {kind!r}: write \"inverse\" (motion imposed, torque measured), "
                        "\"forward\" (voltage or duty in, motion or current out) or \"steady\" (steady-state points).")
    linear, drives = bool(head.get("linear", False)), tuple(head.get("drives", [""]))
    columns = tuple(
        _column(path, name, entry, drives, linear, bool(system)) for name, entry in data.get("columns", {}).items()
    )
    taken: dict[str, str] = {}
    for column in columns:
        if column.signal in taken:
            raise DataError(
                f"{path}: columns {taken[column.signal]!r} and {column.column!r} are both {column.signal}. "
                "Keep one of them."
            )
        taken[column.signal] = column.column
    named = bool(head.get("named", False))
    if not columns and not named:
        raise DataError(f"{path}: [columns] is empty. Say which column is which variable, such as "
                        '"reducer.input_speed" = { column = "speed", unit = "rpm" }.')
    clock = data.get("time", {"column": "time"})
    time = Column(clock.get("column", "time"), "time", clock.get("unit", ""), float(clock.get("factor", 1.0)))
    return Rig(
        path=path, name=head.get("name", path.stem), kind=kind, columns=columns, time=time,
        parameters=_numbers(path, "parameters", data.get("parameters", {})),
        uncertain=_ranges(path, data.get("uncertain", {})),
        logs={pattern: _numbers(path, f'logs."{pattern}"', table) for pattern, table in data.get("logs", {}).items()},
        known=frozenset(head.get("known", [])), run=head.get("run", ""), linear=linear, drives=drives, named=named,
        hold_out=head.get("hold_out", ""), simulate=head.get("simulate", ""), valid=head.get("valid", ""),
        smoothing=float(head.get("smoothing", 0.0)),
        system=(path.parent / system) if system else None,
    )


def _only(path: Path, what: str, given: dict, allowed: set[str]) -> None:
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
            return prefix, name[len(prefix):]
    return "", name


def _column(path: Path, name: str, entry, drives: tuple[str, ...], linear: bool, plain: bool) -> Column:
    if isinstance(entry, str):
        entry = {"column": entry}
    if "column" not in entry:
        raise DataError(f'{path}: [columns] "{name}": say which column, as "{name}" = {{ column = "..." }}.')
    _only(path, f'key of "{name}"', entry, {"column", "unit", "factor", "offset"})
    if plain:  # a variable of an FMU system, whatever its name
        return Column(
            str(entry["column"]),
            name,
            str(entry.get("unit", "")),
            float(entry.get("factor", 1.0)),
            float(entry.get("offset", 0.0)),
        )
    prefix, bare = split(name, drives)
    signal = canonical(bare)
    component = signal.split(".")[0]
    if signal not in SIGNALS and component in {"controller", "motor", "reducer", "load"}:
        raise DataError(f"{path}: [columns] {name!r} is not a variable that a log can hold.{suggest(bare, SIGNALS)}")
    given = str(entry.get("unit", ""))
    if given:
        try:
            conversion(given, unit(signal, linear))
        except ValueError as error:
            raise DataError(f"{path}: [columns] {name!r}: {error}.") from None
    return Column(
        str(entry["column"]), prefix + signal, given, float(entry.get("factor", 1.0)), float(entry.get("offset", 0.0))
    )


def _numbers(path: Path, table: str, given: dict) -> dict[str, float]:
    for name, value in given.items():
        if not isinstance(value, (int, float)):
            raise DataError(
                f'{path}: [{table}] {name!r} = {value!r}: write it as "component.parameter" = number, '
                "with the name in quotes."
            )
    return {name: float(value) for name, value in given.items()}


def _ranges(path: Path, given: dict) -> dict[str, tuple[float, float]]:
    ranges = {}
    for name, value in given.items():
        if not (isinstance(value, list) and len(value) == 2 and value[0] < value[1]):
            raise DataError(
                f"{path}: [uncertain] {name!r} = {value!r}: write the lowest and the highest value, as [low, high]."
            )
        ranges[name] = (float(value[0]), float(value[1]))
    return ranges


@cache
def _registry():
    import pint

    registry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    return registry


def conversion(given: str, wanted: str) -> tuple[float, float]:
    """Factor and offset from one unit to another; ValueError says why there is none."""
    if not wanted or not given or given == wanted:
        return 1.0, 0.0
    registry = _registry()
    try:
        quantity = registry.Unit(
            given.replace("N.m", "N*m").replace("·", "*").replace(".", "*") if given != "1" else "dimensionless"
        )
        target = registry.Unit(wanted.replace(".", "*") if wanted != "1" else "dimensionless")
    except Exception:
        raise ValueError(
            f"unit {given!r} is not known; write SI units such as rad/s, N.m, V, A, or rpm, deg, mN.m"
        ) from None
    try:
        zero = registry.Quantity(0.0, quantity).to(target).magnitude
        one = registry.Quantity(1.0, quantity).to(target).magnitude
    except Exception:
        raise ValueError(f"unit {given!r} cannot be {wanted!r}") from None
    return float(one - zero), float(zero)
