"""One FMU as a system: its default experiment, and a table of what goes into it.

selflock run X.fmu --stop 5 --set a=1 --input u.csv -o x.csv
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from fmpy.model_description import InterfaceType, ModelDescription

from ..fmus.variable import INTEGERS, WHOLE
from .binary import open_fmu
from .described import number_of, places_of, variables_of
from .errors import DescriptionError
from .face import Part, Variable
from .files import read, seconds
from .folder import is_fmu
from .results import KINDS
from .system import Component, Connection, Run, System, did_you_mean
from .wiring import fmu_path

SHOWN = 100  # variables of an FMU without outputs that are recorded
POINTS = 1000  # steps of an experiment whose FMU names no step
ENDLESS = 1e12  # s: what an experiment without an end is given as
STEPS = 1e9  # of an experiment; more are no experiment's
SLACK = 1e-9  # s: a time that is met but for its rounding


def of_one(path: Path) -> bool:
    """Whether it is one FMU: a .fmu, or a folder like an unpacked one."""
    return path.suffix.lower() == ".fmu" or is_fmu(path)


def single(
    path: Path | str, unlimited: bool = False, stop: float | None = None, step: float | None = None, interface: str = ""
) -> System:
    """The system of one FMU under the name of its model, in the FMU's default experiment. Raises DescriptionError.

    interface: "cs", "me" or "se", where it has several. Without an output its continuous states are recorded, without those
    its local numbers.
    stop, step: in place of the experiment's. An experiment without a stop lasts 1 s; without a step it has 1000,
    or fewer that are multiples of the step inside the FMU, and one
    that is no multiple of its step a shorter step.
    """
    path = Path(path).absolute()
    binary = open_fmu(path, unlimited)
    description = binary.description
    _, way = binary.interface(interface)
    told = {key: number_of(getattr(description.defaultExperiment, key, None)) for key in ("startTime", "stopTime", "stepSize")}
    start = told["startTime"] or 0.0
    stop = stop if stop is not None else told["stopTime"] if told["stopTime"] is not None else start + 1.0
    length = stop - start
    if not 0.0 < length < ENDLESS:
        said = "ends before it has begun" if length <= 0.0 else "has no end that a run would come to"
        raise DescriptionError(f"{path}: its experiment from {start:g} to {stop:g} s {said}. Give a stop (--stop 5, stop=5).")
    if step is None:
        step = told["stepSize"] or _internal(way, length / POINTS)
        step = length / max(1, math.ceil(length / step - 1e-6)) if step > length / STEPS else length / POINTS
    name = re.sub(r"\W", "_", way.modelIdentifier or path.stem)
    run = Run(start=start, stop=stop, step=step, open_inputs=True, record=[f"{name}.{one}" for one in _shown(description)])
    components = {name: Component(fmu=str(path), interface=interface)}
    return System(name, folder=path.parent, run=run, components=components, unlimited=unlimited, alone=name)


def _internal(way: InterfaceType, about: float) -> float:
    """A step of about that length: a multiple of the FMU's own, where it says one."""
    own = number_of(getattr(way, "fixedInternalStepSize", None)) or 0.0
    return own * math.ceil(about / own - 1e-6) if own > 0.0 else about


def _shown(description: ModelDescription) -> list[str]:
    """What is recorded of an FMU without an output; nothing of others, whose outputs are."""
    if any(v.causality == "output" for v in description.modelVariables):
        return []
    states = {u.variable.derivative.valueReference for u in description.derivatives if u.variable and u.variable.derivative}
    places = places_of(description)
    local = [v.name for v in variables_of(description) if v.causality == "local" and v.type != "String" and v.sized != "Clock"]
    return [name for name in local if places[name].reference in states][:SHOWN] or local[:SHOWN]


def driven(system: System, path: Path | str, stop: float | None = None) -> System:
    """The system with the columns of a table, .csv or .parquet, as its inputs. Raises DescriptionError, ResultError.

    stop: of the run, s, in place of the system's; a table that is not there during the run is noted.

    The table has a column `time`, in s, that does not fall, and columns named as inputs, units in brackets behind the names
    of a .csv as in our results. Between its rows continuous Reals are straight, all else is held; before and after it, too. Of
    two rows of one time the second is what comes after it.
    """
    name = next(
        n for n in ("input", "input_table", *(f"input_{k}" for k in range(len(system.components)))) if n not in system.components
    )
    table = Table(name, str(path))
    types = dict(table.types)
    connections = dict(system.connections)
    known: dict[str, dict[str, Variable]] = {}
    for column in table.types:
        component, variable = system.split(column, f"{path}")
        target = f"{component}.{variable}"
        if target in connections:
            raise DescriptionError(
                f"{path}: {target} is connected to {connections[target].source}; an input takes one connection only."
            )
        connections[target] = Connection(f"{name}.{column}")
        if component not in known and system.components[component].fmu:
            described = open_fmu(fmu_path(system.components[component], system), system.unlimited).description
            known[component] = {v.name: v for v in variables_of(described)}
        if component in known:
            if variable not in known[component]:
                raise DescriptionError(
                    f"{path}: {component} has no variable {variable}{did_you_mean(variable, known[component])}"
                )
            wanted = known[component][variable]
            smooth = wanted.type == "Real" and wanted.variability == "continuous"
            types[column] = "Real" if smooth else f"held {wanted.sized if wanted.sized in WHOLE else wanted.type}"
    part = Component(part=f"{__name__}:Table", options={"path": str(Path(path).absolute()), "types": types})
    order = [name, *system.run.order] if system.run.order else []
    components = {name: part, **system.components}
    notes = [*system.notes, *table.elsewhere(system.run.start, system.run.stop if stop is None else stop)]
    return replace(system, components=components, connections=connections, run=replace(system.run, order=order), notes=notes)


class Table(Part):
    """A table of a file as a function of time, see `driven`."""

    tells_ahead = True

    def __init__(self, name: str, path: str, types: dict[str, str] | None = None):
        """types: by column, such as "Real" or "held Integer"; those of the file where none are given."""
        frame, units = read(path, whole=True)
        frame = frame.rename(columns=str.strip)
        if "time" not in frame or len(frame) == 0 or len(frame.columns) < 2:
            raise DescriptionError(f"{path}: a column `time` in s, columns named as inputs, and rows are wanted here.")
        if frame["time"].dtype.kind not in "fiu":
            raise DescriptionError(
                f"{path}: its column time holds what is no number; it is to be in s from the start of the run on."
            )
        self.header = path
        given = {key.strip(): unit for key, unit in units.items()}
        self.types = types or {column: _type(frame[column].dtype) for column in frame.columns if column != "time"}
        self._columns: dict[str, np.ndarray] = {}
        for column in ("time", *self.types):
            if column not in frame:
                raise DescriptionError(f"{path} has no column {column}{did_you_mean(column, frame.columns)}")
            try:  # of dates pandas would give ns
                values = frame[column].to_numpy(dtype=float) if frame[column].dtype.kind not in "mM" else np.array([math.nan])
            except (TypeError, ValueError):
                values = np.array([math.nan])
            if not np.isfinite(values).all():
                raise DescriptionError(f"{path}: column {column} holds what is no number.")
            kind = self.types.get(column, "").split()[-1:]
            least, most = WHOLE.get(kind[0], INTEGERS) if kind else INTEGERS
            if kind and kind[0] in ("Integer", "Boolean", *WHOLE) and (values != np.trunc(values)).any():
                raise DescriptionError(f"{path}: column {column} holds numbers that are not whole; its input is of that type.")
            if kind and kind[0] in ("Integer", *WHOLE):
                for value in values[(values < least) | (values > most)][:1]:
                    beyond = Variable(column, type="Integer", sized=kind[0]).beyond
                    raise DescriptionError(f"{path}: column {column} holds {value:.0f}, which {beyond}.")
            self._columns[column] = values
        self._time = seconds(path, given["time"]) * self._columns.pop("time")
        if (np.diff(self._time) < 0.0).any():
            raise DescriptionError(f"{path}: its time falls. Sort the rows.")
        super().__init__(
            name,
            [
                Variable(column, given.get(column, ""), causality="output", type=_plain(kind), depends_on=())
                for column, kind in self.types.items()
            ],
        )

    def elsewhere(self, start: float, stop: float) -> list[str]:
        """A sentence where no row of several is within a run, one of which is held through all of it."""
        first, last = self._time[0], self._time[-1]
        if len(self._time) == 1 or (first <= stop and last >= start):
            return []
        of = f"{self.header}: its times, {first:.10g} to {last:.10g} s, are all"
        if first > stop:
            return [f"{of} after the run's end at {stop:g} s: its first row is held through all of it"]
        return [f"{of} before the run's start at {start:g} s: its last row is held through all of it"]

    def at(self, time: float) -> None:
        """y at this time."""
        self.y[:] = self.ahead(np.array([time]))[0]

    def ahead(self, times: np.ndarray) -> np.ndarray:
        """y at each of these times, a row each."""
        when = self._time
        after = np.searchsorted(when, times + SLACK, side="right")
        before = np.maximum(after - 1, 0)
        span = when[np.minimum(after, len(when) - 1)] - when[before]
        share = np.where(after > 0, np.maximum(0.0, times - when[before]), 0.0) / np.where(span > 0.0, span, np.inf)
        found = np.empty((len(times), len(self.outputs)))
        for place, column in enumerate(self.outputs):
            values = self._columns[column]
            found[:, place] = values[before]
            if self.types[column] == "Real":
                found[:, place] += (values[np.minimum(after, len(when) - 1)] - values[before]) * share
        return found

    def get(self, name: str) -> float:
        self._told(name)
        return float(self._columns[name][0])


def _plain(kind: str) -> str:
    """Real, Integer or Boolean, of a type as it is given."""
    return "Integer" if kind.split()[-1] in WHOLE else kind.split()[-1]


def _type(kind: np.dtype) -> str:
    """The type that a column of numbers has by itself."""
    return next((type_ for type_, known in KINDS.items() if kind == known and type_ != "Real"), "Real")
