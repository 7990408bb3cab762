"""A system: components, connections, parameters and how to run them, as plain data read from a TOML file.

docs/system.md describes the file. Nothing here knows whether names exist: that is checked when the parts are
there, in master.wiring.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

from ..fmus.shown import one_line
from . import toml
from .algorithms import ALGORITHMS
from .errors import DescriptionError, ResultError
from .face import Part

CONTROLS = ("power", "doubling")
INTERFACES = ("cs", "me", "se")  # of FMUs: co-simulation, model exchange, scheduled execution
FAULTS = ("stuck", "offset", "drop-out", "delay", "noise")


class Plain:
    """Plain data, whose fields are all there is: another name is a slip."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in (known := type(self).__dataclass_fields__):  # type: ignore[attr-defined]
            raise DescriptionError(f"{type(self).__name__} has no field {name}{did_you_mean(name, known)}")
        super().__setattr__(name, value)


@dataclass
class Run(Plain):
    """How to run: times and steps in s."""

    start: float = 0.0
    stop: float = 1.0
    step: float = 0.001  # communication step; with step control the largest one
    algorithm: str = "gauss-seidel"
    order: list[str] = field(default_factory=list)  # of stepping, for Gauss-Seidel; empty: as in the file
    record: list[str] = field(default_factory=list)  # names or patterns such as "robot.*"; empty: every output
    interval: float = 0.0  # between recorded rows; 0: every communication point
    open_inputs: bool = False  # True: inputs that nobody gives keep their FMU's start value
    step_control: str = ""  # "" | power | doubling
    tolerance: float = 1e-3  # of step control, relative
    hold_outputs: bool = False  # of components with longer steps: they stay until these are over, else they are on a line
    input_derivatives: bool = False  # FMUs that interpolate their inputs are told how these change in a step
    coupling_tolerance: float | None = None  # of circles, relative; 0: loops lag; None: 1e-9, and 1e-5 if iterated
    fmu_tolerance: float | None = None  # of the FMUs' own solvers, relative; 0: none is told; None: of their default experiments
    as_fmu: bool = False  # FMUs of ours run as any other's, and not by their compiled laws in long runs
    step_min: float = 0.0  # smallest step of step control; 0: step / 1024

    @property
    def every(self) -> int:
        """Steps from one recorded row to the next."""
        return max(1, round(self.interval / self.step))


@dataclass
class Component(Plain):
    """An FMU or an in-process part, under the name it has in this system."""

    fmu: str = ""  # path relative to the system file, or "selflock:Reducer" for one of this package
    part: str | type[Part] = ""  # "package.module:Class" instead of an FMU; in Python the class itself
    manoeuvre: str = ""  # instead: a file of set-points over time, relative to the system file
    host: str = ""  # "machine:port" where `selflock serve` holds the FMU
    options: dict[str, Any] = field(default_factory=dict)  # keyword arguments of an in-process part
    step: float = 0.0  # its own step in s; 0: the communication step
    samples: bool = False  # its own step is longer: what it gives is there as that begins, and stays, as a sampled controller's
    tolerance: float | None = None  # of its own solver, relative; 0: none is told; None: as [run] fmu_tolerance
    start: dict[str, Any] = field(default_factory=dict)  # parameters and start values
    interface: str = ""  # of its FMU: "cs", "me" or "se"; "": co-simulation where it has that, else model exchange
    process: bool = False  # in a process of its own
    isolate: bool = False  # in one with limits and without rights (docs/security.md)
    step_timeout: float = 0.0  # s of wall time for a step of a process; 0: 60 s; 1e8, three years, is no limit


@dataclass
class Connection(Plain):
    """target = factor · source + offset, after conversion of units; or what a mapping makes of the source."""

    source: str
    factor: float | str = 1.0  # or "= 1 / ratio", over the system's values
    offset: float | str = 0.0
    convert: bool = True  # False: the numbers are passed on whatever the units say
    mapping: dict[str, int | bool] = field(
        default_factory=dict
    )  # whole numbers, true and false, that become others; what it does not name stays

    def __post_init__(self):
        if isinstance(self.source, str):
            self.source = self.source.strip()


@dataclass
class Bond(Plain):
    """Two variables whose product is the power that crosses a connection: effort one way, flow the other."""

    effort: str  # such as a torque, in N.m
    flow: str  # such as a speed, in rad/s, that comes back
    name: str = ""


@dataclass
class Fault(Plain):
    """A variable made wrong from `start` to `stop`. docs/system.md says what each kind does."""

    variable: str
    kind: str
    start: float
    stop: float = float("inf")
    value: float | None = None  # stuck: at this value; offset: added; drop-out: in its place
    delay: float = 0.0  # s
    deviation: float = 0.0  # of the noise, in the variable's unit
    seed: int | None = None


@dataclass
class System(Plain):
    """A whole description. Change what you like between `load` and `run`."""

    name: str = "system"
    description: str = ""
    folder: Path = Path(".")  # paths of FMUs are relative to it
    run: Run = field(default_factory=Run)
    components: dict[str, Component] = field(default_factory=dict)
    connections: dict[str, Connection] = field(default_factory=dict)  # by target
    bonds: list[Bond] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    values: dict[str, float | bool | str] = field(default_factory=dict)  # shared numbers, for "= ..." in start values and factors
    allow_code: bool = False  # parts of other packages may be loaded; no file can say so
    unlimited: bool = False  # its archives may be of any size; likewise
    isolate: bool = False  # every FMU as if its component said so
    alone: str = ""  # the component whose name may be left out
    drives: dict[str, str] = field(default_factory=dict)  # what its file calls drives, each in words: their parts are components
    notes: list[str] = field(default_factory=list)  # what its file says and nobody uses, a sentence each

    @property
    def order(self) -> list[str]:
        """The components in the order of stepping."""
        return self.run.order or list(self.components)

    def save(self, path: Path | str, about: str = "") -> Path:
        """Write it as a system file (.toml), which `load` reads as the same, or as an SSP with its FMUs (.ssp).

        about: first lines of the file, as comments. Raises ResultError, DescriptionError.
        """
        if Path(path).suffix.lower() == ".ssp":
            from .ssp.write import export

            return Path(export(self, path))
        if Path(path).suffix.lower() != ".toml":
            raise ResultError(f"{path}: a system is written as .toml or .ssp; choose one of these endings.")
        from .dump import save

        return save(self, path, about)

    def _repr_html_(self) -> str:
        """A picture of its wiring, for a notebook."""
        from .diagram import page

        return page(self)

    def split(self, name: str, where: str) -> tuple[str, str]:
        """component and variable of "component.variable"; either may contain dots."""
        parts = name.split(".")
        for count in range(len(parts) - 1, 0, -1):
            if ".".join(parts[:count]) in self.components:
                return ".".join(parts[:count]), ".".join(parts[count:])
        if self.alone:
            return self.alone, name
        if len(parts) == 1:
            raise DescriptionError(f"{where}: {name} should be written as component.variable.")
        raise DescriptionError(f"{where}: there is no component {parts[0]}{did_you_mean(parts[0], self.components)}")


Made = TypeVar("Made", Run, Component, Connection, Bond, Fault)


def did_you_mean(name: str, known) -> str:
    """The end of a sentence about an unknown name."""
    known = list(known)
    near = get_close_matches(name, known, 1, 0.6)
    if near:
        return f". Did you mean {near[0]}?"
    return f"; there is: {', '.join(known)}." if 0 < len(known) <= 20 else "."


def load_toml(path: Path | str, allow_code: bool = False, unlimited: bool = False, isolate: bool = False) -> System:
    """The system described in a TOML file.

    allow_code: its parts may be of other packages than this. Whoever wrote the file then runs what they like as you.
    unlimited: its archives, FMUs and SSPs, may be of any size (docs/security.md).
    isolate: every FMU runs in a process of its own with limits and without rights.
    """
    path = Path(path)
    if path.suffix.lower() in (".csv", ".parquet") and path.is_file():
        raise DescriptionError(f"{path} is a table: selflock view {path} shows it.")
    try:
        data = toml.read(path)
    except FileNotFoundError:
        beside = [one.name for one in path.parent.glob(f"*{path.suffix}")] if path.parent.is_dir() else []
        near = get_close_matches(path.name, beside[:1000], 1, 0.6)
        raise DescriptionError(f"There is no system file {path}.{f' Did you mean {near[0]}?' if near else ''}") from None
    except OSError as error:
        raise DescriptionError(f"The system file {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError as error:
        raise DescriptionError(f"The system file {path} cannot be read: {error}.") from None
    except ValueError as error:
        twice = " An input takes one connection only." if "a second time" in str(error) else ""
        raise DescriptionError(f"{path} is not valid TOML: {error}.{twice}") from None
    if other := toml.of_another_kind(path, data, "system"):
        raise DescriptionError(other)
    try:
        return replace(from_dict(data, path.parent), allow_code=allow_code, unlimited=unlimited, isolate=isolate)
    except DescriptionError as error:
        raise DescriptionError(f"{path}: {error}") from None


def from_dict(data: dict[str, Any], folder: Path | str = ".") -> System:
    """A system from the tables of a system file."""
    _check_keys(data, ("system", "values", "run", "components", "drives", "connections", "bonds", "faults"), "the file")
    for key in ("components", "connections"):
        _check_keys(data.get(key, {}), data.get(key, {}), f"[{key}]")
    for key in ("bonds", "faults"):
        if not isinstance(data.get(key, []), list):
            raise DescriptionError(f"{key} should be a list of tables: write [[{key}]].")
    head = data.get("system", {})
    _check_keys(head, ("name", "description"), "[system]")
    system = System(
        head.get("name", "system"), head.get("description", ""), Path(folder), made(Run, data.get("run", {}), "[run]")
    )
    system.values = _values(data.get("values", {}))
    one_line_each("[components]", data.get("components", {}))
    for name, table in data.get("components", {}).items():
        where = f"[components.{name}]"
        component = made(Component, table, where)
        one_line_each(where, map(str, (component.fmu, component.part, component.manoeuvre, component.host)))
        component.start = {n: value for n, value in _flat(component.start, where)}
        if sum(map(bool, (component.fmu or component.host, component.part, component.manoeuvre))) != 1:
            raise DescriptionError(
                f'{where} needs either fmu = "path/to.fmu", or part = "package.module:Class", or manoeuvre = "file.csv", '
                'or host = "machine:port".'
            )
        if component.interface:
            check_choice(f"{where} interface", component.interface, INTERFACES)
        system.components[name] = component
    for target, source in _flat(data.get("connections", {}), "[connections]", leaf="from"):
        if target in system.connections:
            raise DescriptionError(f"[connections]: {target} is connected twice; an input takes one connection only.")
        system.connections[target] = connection_of(target, source)
    if "drives" in data:
        from .drives import join  # which makes what is here

        join(system, data["drives"])
    system.bonds = [made(Bond, table, "[[bonds]]") for table in data.get("bonds", [])]
    system.faults = [made(Fault, table, "[[faults]]") for table in data.get("faults", [])]
    for fault in system.faults:
        check_choice("[[faults]] kind", fault.kind, FAULTS)
    check_choice("[run] algorithm", system.run.algorithm, ALGORITHMS)
    check_choice("[run] step_control", system.run.step_control, ("", *CONTROLS))
    return system


def _values(table: Any) -> dict[str, float | bool | str]:
    """Shared numbers by name; a text is an expression over those above it."""
    _check_keys(table, table, "[values]")
    for name, value in table.items():
        if not name.isidentifier():
            raise DescriptionError(f"[values] {name}: the name is used in expressions; write it with letters, digits and _ only.")
        if not isinstance(value, (int, float)) and not formula(value):
            raise DescriptionError(
                f'[values] {name} = {value!r}: a number is wanted here, or an expression such as "= 2 * ratio".'
            )
    return dict(table)


def one_line_each(where: str, names: Iterable[str]) -> None:
    """Refuse names that would break the lines of a message, a summary or a table."""
    for name in names:
        if one_line(name) != name:
            raise DescriptionError(f"{where} '{one_line(name)}': a name has no line breaks, tabs or other control characters.")


def formula(value: Any) -> str | None:
    """The expression in "= ..."; None where it is none."""
    return value[1:].strip() if isinstance(value, str) and value.startswith("=") else None


def connection_of(target: str, source: Any) -> Connection:
    """A connection as a file writes it: the source, or a table of it."""
    if isinstance(source, str):
        return Connection(source)
    if not isinstance(source, dict) or not isinstance(source.get("from"), str):
        raise DescriptionError(
            f'[connections]: write "{target}" = "component.variable", or {{ from = "component.variable", factor = 2.0 }}.'
        )
    table = {"source" if key == "from" else key: value for key, value in source.items()}
    return made(Connection, table, f"[connections] {target}")


def _flat(table: dict[str, Any], where: str, leaf: str | None = None):
    """Entries of nested tables with dotted names: a.b = 1 and "a.b" = 1 mean the same."""
    if not isinstance(table, dict):
        raise DescriptionError(f"{where} should be a table of name = value.")
    for name, value in table.items():
        if isinstance(value, dict) and (leaf is None or leaf not in value):
            for inner, deep in _flat(value, where, leaf):
                yield f"{name}.{inner}", deep
        else:
            yield name, value


def _check_keys(table: Any, known, where: str) -> None:
    if not isinstance(table, dict):
        raise DescriptionError(f"{where} should be a table.")
    for key in table:
        if key not in known:
            raise DescriptionError(f"{where} has no key {key}{did_you_mean(key, known)}")


def check_choice(what: str, value: str, choices) -> None:
    """Refuse a value that is none of the choices."""
    if value not in choices:
        raise DescriptionError(f'{what} = "{value}" is unknown; choose from: {", ".join(c for c in choices if c)}.')


def made(kind: type[Made], table: dict[str, Any], where: str) -> Made:
    """A dataclass from a table, its keys and types checked."""
    known = {f.name: str(f.type) for f in fields(kind)}
    _check_keys(table, ["from" if key == "source" else key for key in known] + ["source"] * (kind is Connection), where)
    for key, value in table.items():
        wanted = known[key]
        if not fits(value, wanted):
            raise DescriptionError(f"{where} {key} = {value!r}: {WANTED[wanted.split('[')[0].split(' ')[0]]} is wanted here.")
    values: dict[str, Any] = {
        key: float(v) if known[key].startswith("float") and not isinstance(v, str) else v for key, v in table.items()
    }
    try:
        return kind(**values)
    except TypeError as error:
        raise DescriptionError(
            f"{where}: {str(error).split(') ')[-1].replace('__init__()', '')} is not all there is to say."
        ) from None


WANTED = {"float": "a number", "int": "a whole number", "str": "text in quotes", "bool": "true or false",
           "list": "a list of names in quotes", "dict": "a table"}  # fmt: skip


def fits(value: Any, wanted: str) -> bool:
    """Whether a value is of a field's kind, as its annotation says it."""
    if wanted == "float | str" and formula(value):
        return True
    if wanted.startswith("str |") and isinstance(value, type):
        return issubclass(value, Part)
    if wanted.startswith("float"):
        return isinstance(value, Real) and not isinstance(value, bool)
    if wanted.startswith("int"):
        return isinstance(value, Integral) and not isinstance(value, bool)
    if wanted.startswith("list"):
        return isinstance(value, list) and all(isinstance(item, str) for item in value)
    return isinstance(value, {"str": str, "bool": bool, "dict": dict}[wanted.split("[")[0].split(" ")[0]])
