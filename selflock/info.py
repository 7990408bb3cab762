"""What a file is and what is in it: an FMU, an SSP, a system, a result, a rig, a log. Nothing of it is run.

Words of the file are cut to a line and a width, lists to LIMIT entries.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import isinf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from selflock.fmus.errors import SelflockError
from selflock.master import toml
from selflock.master.folder import is_fmu

if TYPE_CHECKING:
    import pandas as pd

    from selflock.master import System, Variable

LIMIT = 200  # entries of a list that are shown, unless all are asked for
WIDTH = 60  # characters of a name or a description


def info(path: str | Path, everything: bool = False) -> str:
    """A page of text about a file. everything: lists without end. Raises SelflockError."""
    path = Path(path)
    kinds: dict[str, Callable[[Path, int | None], Iterator[str]]] = {
        ".fmu": _fmu, ".ssp": _system, ".ssd": _system, ".xml": _system, ".csv": _result, ".parquet": _result, ".toml": _toml,
    }  # fmt: skip
    kind = kinds.get(path.suffix.lower())
    if path.is_dir():
        kind = _fmu if is_fmu(path) else _system
    if kind is None:
        from selflock.diagnosis.data.table import ENDINGS

        kind = _log if path.suffix.lower() in ENDINGS or not path.suffix else None
    if kind is None:
        raise SelflockError(
            f"{path}: info tells of {', '.join(kinds)} files, of logs, and of folders of FMUs and system structures."
        )
    if not path.exists():
        raise SelflockError(f"There is no file {path}.")
    return "\n".join(kind(path, None if everything else LIMIT))


def _toml(path: Path, limit: int | None) -> Iterator[str]:
    """A system, a rig or a study, by its tables."""
    try:
        data = toml.read(path)
    except (OSError, ValueError) as error:
        raise SelflockError(f"{path} is no TOML: {_short(error)}.") from None
    of = toml.kind(data)
    if of:
        return _study(path) if of == "sweep" else {"rig": _rig, "system": _system}[of](path, limit)
    raise SelflockError(
        f"{path} is no file of ours: a system has [components.NAME] or [drives.NAME], a rig [rig], a study [vary.NAME]."
    )


def _fmu(path: Path, limit: int | None) -> Iterator[str]:
    import fmpy

    from selflock.master.binary import open_fmu
    from selflock.master.described import SAID, offered, variables_of

    binary = open_fmu(path)
    d, ways = binary.description, offered(binary.description)
    kinds = ", ".join(SAID[name] for name in ways)
    yield f"{path.name}: FMU {_short(d.modelName)}, FMI {d.fmiVersion} {kinds}, for {', '.join(fmpy.supported_platforms(str(binary.folder)))}"
    yield from _words(d.description, f"made by {_short(d.generationTool)}" if d.generationTool else "")
    told = d.defaultExperiment
    names = {"startTime": "from {} s", "stopTime": "to {} s", "stepSize": "step {} s", "tolerance": "tolerance {}"}
    if said := [text.format(value) for name, text in names.items() if (value := getattr(told, name, None)) is not None]:
        yield f"  default experiment: {', '.join(map(_short, said))}"
    can = {"canGetAndSetFMUstate": "goes back", "canSerializeFMUstate": "saves its state", "canHandleVariableCommunicationStepSize": "takes steps of any size", "canBeInstantiatedOnlyOncePerProcess": "one instance in a process"}  # fmt: skip
    can |= {"hasEventMode": "has event mode"}
    for name, way in ways.items():
        if able := [text for key, text in can.items() if getattr(way, key, False)]:
            yield f"  {SAID[name] + ': ' if len(ways) > 1 else ''}{'; '.join(able)}"
    if "me" in ways:
        many = ((d.numberOfContinuousStates, "continuous state"), (d.numberOfEventIndicators, "event indicator"))
        yield f"  {', '.join(f'{count} {what}' + 's' * (count != 1) for count, what in many)}"
    variables = list(variables_of(d))
    for causality in ("input", "output", "parameter", "calculatedParameter", "local", "independent"):
        mine = [v for v in variables if v.causality == causality]
        if mine:
            yield f"{len(mine)} {causality}{'s' if len(mine) != 1 else ''}"
            yield from _cut((_variable(v) for v in mine), len(mine), limit)


def _variable(v: Variable) -> str:
    low, high = (None if end is None or isinf(end) else f"{end:g}" for end in (v.minimum, v.maximum))
    ends = f", {low} to {high}" if low and high else f", at least {low}" if low else f", at most {high}" if high else ""
    kind = f"  {v.sized}" if v.sized else "" if v.type == "Real" else f"  {v.type}"
    start = "" if v.start is None or (v.causality == "output" and not v.initial) else f" = {_short(v.start)}"
    return f"  {_short(v.name)}{start}{_unit(v.unit)}{ends}{kind}" + (f"  {_short(v.description)}" if v.description else "")


def _system(path: Path, limit: int | None) -> Iterator[str]:
    from selflock.master import load
    from selflock.master.values import numbers, resolved

    system = load(path)
    run = system.run
    yield f"{path.name}: system {_short(system.name)}, {len(system.components)} components, {len(system.connections)} connections"
    yield from _words(system.description)
    interval = f", a row every {run.interval:g} s" if run.interval else ""
    yield f"  from {run.start:g} to {run.stop:g} s in steps of {run.step:g} s, {run.algorithm}{interval}"
    if known := numbers(system):
        yield "values"
        yield from _cut((f"  {name} = {_short(value)}" for name, value in known.items()), len(known), limit)
    if system.drives:
        yield "drives, which become components"
        yield from (f"  {_short(name)}: {_short(words, 3 * WIDTH)}" for name, words in system.drives.items())
    system = resolved(system)
    for name in system.order:
        if name in system.components:
            yield from _component(system, name, limit)
    for note in system.notes:
        yield f"  {_short(note)}"


def _component(system: System, name: str, limit: int | None) -> Iterator[str]:
    from selflock.master.code import named

    component = system.components[name]
    fmu = component.fmu.removeprefix(f"{system.folder.resolve().as_posix()}/")  # of an archive that was unpacked somewhere
    yield f"{_short(name)}: {_short(fmu or component.host or component.manoeuvre or named(component.part))}" + (
        f", own step {component.step:g} s" if component.step else ""
    )
    try:
        variables = _variables(system, name)
    except SelflockError as error:
        variables = {}
        yield f"  its variables are not known: {_short(error)}"
    into = {target: c for target, c in system.connections.items() if _owner(system, target) == name}
    known = {f"{name}.{v.name}" for v in variables.values()}
    rows = []
    for target in dict.fromkeys([*into, *(f"{name}.{v.name}" for v in variables.values() if v.causality == "input")]):
        bare = target[len(name) + 1 :]
        unit = _unit(variables[bare].unit) if bare in variables else ""
        lost = "" if target in known or not variables else "  (there is no such variable)"
        if target in into:
            c = into[target]
            factor = "" if c.factor == 1.0 else f"{float(c.factor):.6g} · "
            offset = "" if c.offset == 0.0 else f" + {float(c.offset):.6g}"
            rows.append(f"  {_short(bare)}{unit} <- {factor}{_short(c.source)}{offset}{lost}")
        elif bare in component.start:
            rows.append(f"  {_short(bare)} = {_short(component.start[bare])}{unit}, held")
        else:
            start = variables[bare].start
            rows.append(
                f"  {_short(bare)}{unit} is not connected" + (f" (start value {_short(start)})" if start is not None else "")
            )
    for bare, value in component.start.items():
        if f"{name}.{bare}" not in into and not (bare in variables and variables[bare].causality == "input"):
            unit = _unit(variables[bare].unit) if bare in variables else ""
            lost = "" if bare in variables or not variables else "  (there is no such variable)"
            rows.append(f"  {_short(bare)} = {_short(value)}{unit}{lost}")
    rest = [v for v in variables.values() if v.causality == "parameter" and v.name not in component.start]
    if rest:
        rows.append(
            f"  {len(rest)} more parameter{'s' * (len(rest) > 1)} at the component's own start value{'s' * (len(rest) > 1)}"
        )
    outward: dict[str, list[str]] = {}
    for target, c in system.connections.items():
        if _owner(system, c.source) == name:
            outward.setdefault(c.source[len(name) + 1 :], []).append(target)
    for bare in [v.name for v in variables.values() if v.causality == "output"] or list(outward):
        unit = _unit(variables[bare].unit) if bare in variables else ""
        rows.append(f"  {_short(bare)}{unit}" + (f" -> {', '.join(map(_short, outward[bare]))}" if bare in outward else ""))
    yield from _cut(iter(rows), len(rows), limit)


def _variables(system: System, name: str) -> dict[str, Variable]:
    """What a component says of its variables; no code of others is loaded."""
    from selflock.master.binary import open_fmu
    from selflock.master.code import load_part, named
    from selflock.master.described import variables_of
    from selflock.master.manoeuvre import Manoeuvre
    from selflock.master.wiring import fmu_path

    component = system.components[name]
    if component.manoeuvre:
        return dict(Manoeuvre(name, system.folder / component.manoeuvre).variables)
    if component.fmu:
        return {v.name: v for v in variables_of(open_fmu(fmu_path(component, system)).description)}
    if component.host:
        raise SelflockError(f"they lie at {component.host}, and nothing is asked of it here")
    kind: Any = load_part(named(component.part), f"[components.{name}]", False)
    return {v.name: v for v in kind.described}


def _owner(system: System, name: str) -> str:
    try:
        return system.split(name, "")[0]
    except SelflockError:
        return ""


def _result(path: Path, limit: int | None) -> Iterator[str]:
    import numpy as np

    from selflock.master import ResultError
    from selflock.master.files import read, seconds

    try:
        table, units = read(path)
        if "time" not in table:  # of a run of ours it is there
            raise ResultError(f"{path} has no column 'time'.")
    except ResultError as error:
        yield from _raw(path, limit, error)
        return
    yield f"{path.name}: table of {len(table)} rows, {len(table.columns)} columns"
    if len(table) > 1 and table["time"].dtype.kind in "fiu":
        time = seconds(path, units.get("time", "")) * table["time"].to_numpy(float)
        yield f"  from {time[0]:.6g} to {time[-1]:.6g} s, a row every {np.median(np.diff(time)):.3g} s"
    yield from _columns(table, units, limit)


def _raw(path: Path, limit: int | None, error: SelflockError) -> Iterator[str]:
    """A table that is none of ours, as a log. One with our `time`, or that is no log either: what was wrong with it."""
    from selflock.diagnosis.data.table import table

    try:
        ours = any(str(name).partition(" [")[0] == "time" for name in table(path).columns)
        lines = [] if ours else list(_log(path, limit))
    except SelflockError:
        lines = []
    if not lines:
        raise error from None
    yield from lines


def _log(path: Path, limit: int | None) -> Iterator[str]:
    """What a recorder wrote."""
    from selflock.diagnosis.data.table import table

    found = table(path)
    found.columns = [str(name) for name in found.columns]
    nameless = all(name.isdigit() for name in found.columns)
    yield f"{path.name}: log of {len(found)} rows, {len(found.columns)} columns" + ", which it has no names for" * nameless
    yield from _columns(found, {}, limit)
    if any(found[name].dtype.kind in "fiu" for name in found.columns):
        named = " --columns 'time [ms], ...'" * nameless
        yield f"a rig for it: selflock rig init {path}{named}"


def _columns(table: pd.DataFrame, units: dict[str, str], limit: int | None) -> Iterator[str]:
    """Range and last value of each column but the time."""
    import numpy as np

    def told() -> Iterator[str]:
        for name in table.columns:
            values = table[name]
            if name == "time" and units:
                continue
            unit = _unit(units.get(name, ""))
            if values.dtype.kind not in "fiub" or not len(values):
                yield f"  {_short(name)}{unit}  {values.dtype}" + (f", at last {_short(values.iloc[-1])}" if len(values) else "")
                continue
            x = values.to_numpy(float)
            good = x[np.isfinite(x)]
            lost = f", {len(x) - len(good)} no numbers" if len(good) < len(x) else ""
            span = f"{good.min():.5g} to {good.max():.5g}, at last {x[-1]:.5g}" if len(good) else "nothing"
            yield f"  {_short(name)}{unit}  {span}{lost}"

    yield from _cut(told(), len(table.columns) - ("time" in table and bool(units)), limit)


def _rig(path: Path, limit: int | None) -> Iterator[str]:
    from selflock.diagnosis.data.rig import load, split
    from selflock.diagnosis.data.sanity import assumed
    from selflock.diagnosis.data.signals import SIGNALS, canonical, unit

    rig = load(path)
    of = f"of the system {rig.system.name}" if rig.system else f'of kind "{rig.kind}"'
    yield f"{path.name}: rig {_short(rig.name)}, {of}"
    yield f"time: column {_short(rig.time.column)}{_unit(rig.time.unit or 's')}" + (
        f"; runs by column {_short(rig.run)}" if rig.run else ""
    )
    yield f"{len(rig.columns)} columns"
    for column in rig.columns[:limit]:
        bare = canonical(split(column.signal, rig.drives)[1])
        kept = column.unit or "the header's unit, else " + (unit(bare, rig.linear) or "as it is")
        change = "" if column.factor == 1.0 else f", times {column.factor:g}"
        change += "" if column.offset == 0.0 else f", plus {column.offset:g}"
        about = f"  {SIGNALS[bare][1]}" if bare in SIGNALS and not rig.system else ""
        yield f"  {_short(column.signal)} <- {_short(column.column)} ({_short(kept)}{change}){about}"
    yield f"{len(rig.parameters)} parameters"
    rows = [f"  {_short(n)} = {v:g}" + (f", refitted in [{rig.uncertain[n][0]:g}, {rig.uncertain[n][1]:g}]" if n in rig.uncertain else "") for n, v in rig.parameters.items()]  # fmt: skip
    rows += [f"  {_short(n)} in [{low:g}, {high:g}]" for n, (low, high) in rig.uncertain.items() if n not in rig.parameters]
    yield from _cut(iter(rows), len(rows), limit)
    if rig.known:
        yield f"never questioned: {', '.join(map(_short, sorted(rig.known)))}"
    if rig.system is None and (taken := assumed(rig, {c.signal for c in rig.columns})):
        yield f"{len(taken)} values that would be assumed, for nobody gave them"
        yield from _cut((f"  {n} = {v:g}{_unit(u)}" for n, (v, u) in taken.items()), len(taken), limit)


def _study(path: Path) -> Iterator[str]:
    from selflock.sweep.study import read

    study = read(path)
    yield f"{path.name}: study {_short(study.name)} of {_short(study.system.name)}, {len(study.parameters)} runs"
    yield f"varies: {', '.join(map(_short, study.varied))}"
    yield f"keeps: {', '.join(_short(f.name) + _unit(f.unit) for f in study.record) or 'tables'}"


def _cut(lines: Iterator[str], count: int, limit: int | None) -> Iterator[str]:
    """The first lines, and how many there are more."""
    for number, line in enumerate(lines):
        if limit is not None and number == limit:
            yield f"  … and {count - limit} more; --all shows them"
            return
        yield line


def _words(*texts: Any) -> Iterable[str]:
    return [f"  {_short(text, 2 * WIDTH)}" for text in texts if text]


def _short(value: Any, width: int = WIDTH) -> str:
    """A word of the file in one line, not too long."""
    text = f"{value:.6g}" if isinstance(value, float) else " ".join(str(value)[: 10 * width].split())
    return text if len(text) <= width else f"{text[: width - 1]}…"


def _unit(unit: str) -> str:
    return f" {_short(unit)}" if unit else ""
