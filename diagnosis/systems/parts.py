"""Any FMU system on a measured log: the whole from its set-points, and each component alone on its measured inputs.

A component runs alone where the log has all that it is given. What the log does not have is simulated: the components
that give it run along, up to where the log has their inputs. Inputs come to a component as they would in the system:
under Gauss-Seidel those of components stepped before it are those of the end of the step, all others of its start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from selflock.master import load, values
from selflock.master.simulation import run as run_system
from selflock.master.system import Component, Connection, System, did_you_mean
from selflock.master.units import unit
from selflock.master.wiring import wire

from ..data.log import MeasuredRun
from ..data.rig import HELD, LogColumn, Rig
from ..errors import DataError
from ..output.playback import Playback
from ..rules import RULES

LOG = "the_log"
"""Name of the part that plays the log."""

CLOSE = 1e-6  # share of a step: a row at a step but for its rounding


@dataclass(frozen=True)
class Feed:
    """An input that the log gives: factor · channel + offset, of the step's end where `ahead`."""

    target: str
    channel: str
    factor: float = 1.0
    offset: float = 0.0
    ahead: bool = False


@dataclass(frozen=True)
class Group:
    """Components that run together, and what the log gives them."""

    members: tuple[str, ...]
    feeds: tuple[Feed, ...]


class Signals(Playback):
    """Columns of a log given as arrays."""

    def __init__(self, name: str, time: np.ndarray, columns: dict[str, np.ndarray], types: dict[str, str]):
        self._play(name, time, columns, types, [column for column in columns if types[column] != "Real"])


class Parts:
    """The system of a rig: its variables, its links, and groups of its components on measured inputs."""

    def __init__(self, rig: Rig):
        assert rig.system is not None, "a rig of a system names it"
        described = load(rig.system, rig.allow_code, isolate=rig.isolate)
        system, parameters = values.given(described, rig.parameters)
        self.rig, self.path, self.system = rig, rig.system, values.resolved(system)
        self.shared = frozenset(described.values)  # which the rig may give under [parameters], for all logs
        for pattern, table in rig.logs.items():
            for name in self.shared & set(table):
                raise DataError(
                    f'{rig.path}: [logs."{pattern}"] {name!r} is a value of the whole system: put it under [parameters].'
                )
        if rig.step:
            self.system.run.step = rig.step
        self.step = self.system.run.step  # s, which a search may make finer in the system
        wiring = wire(replace(self.system, run=replace(self.system.run, open_inputs=True)), parameters)
        try:
            self.variables = {f"{name}.{v.name}": v for name, part in wiring.parts.items() for v in part.variables.values()}
            self.algorithm = wiring.algorithm
            self.values = wiring.values
            self.links = {f"{link.target}.{link.input}": link for link in wiring.links}
        finally:
            wiring.close()
        self.inputs: dict[str, list[str]] = {component: [] for component in self.system.components}
        for name, variable in self.variables.items():
            if variable.causality == "input":
                self.inputs[self.owner(name)].append(name)

    def owner(self, name: str) -> str:
        """The component that a variable belongs to."""
        return self.system.split(name, str(self.rig.path))[0]

    def unit(self, name: str) -> str:
        """The unit that an FMU says of its variable; "" of what says none, or is none."""
        return variable.unit if (variable := self.variables.get(name)) else ""

    def check(self, names) -> None:
        """Refuse columns that are no variables of the system, or none that a log can hold."""
        for name in names:
            if name in self.variables:
                causality = self.variables[name].causality
                if causality not in ("input", "output", "local"):
                    raise DataError(f"{self.rig.path}: [columns] {name!r} is a {causality}: put its value under [parameters].")
            elif name.split(".")[0] in self.system.components:
                near = did_you_mean(name, self.variables)
                raise DataError(f"{self.rig.path}: [columns] {name!r}: {self.path.name} has no such variable{near}")

    def check_units(self, columns: Sequence[LogColumn]) -> None:
        """Refuse a unit that asks for a conversion of what no FMU says the unit of: it would be taken as it is, without a word."""
        for column in columns:
            variable = self.variables.get(column.signal)
            if variable is None or variable.unit or not column.unit:
                continue
            known = unit(column.unit)
            if known is None or known.factor != 1.0:
                raise DataError(
                    f"{self.rig.path}: [columns] {column.signal!r}: unit = {column.unit!r} cannot be converted, for the FMU says no unit "
                    "of it. Leave it out where the log has what the FMU has, else write factor = (what 1 of the log is there)."
                )

    def not_as_wired(self, group: Group) -> list[str]:
        """Sentences on the inputs of a group that nothing gives, and on those whose own column goes before what is connected to them."""
        given = {*self.links, *(feed.target for feed in group.feeds)}
        left = [name for member in group.members for name in self.inputs[member] if name not in given]
        own = [
            n for n in (column.signal for column in self.rig.columns) if n in self.links and self.links[n].target in group.members
        ]
        source = lambda name: f"{self.links[name].source}.{self.links[name].output}"
        return [f"no column gives {', '.join(left)}: taken to stay as the FMU starts"] * bool(left) + [
            f"{name} is given by its own column, and not by {source(name)}, which is connected to it" for name in own
        ]

    def group(self, wanted: list[str], measured: set[str]) -> Group:
        """The components in `wanted` with all that the log must be helped out with."""
        members, feeds, todo = [], [], list(wanted)
        while todo:
            component = todo.pop()
            if component in members:
                continue
            members.append(component)
            for name in self.inputs[component]:
                link = self.links.get(name)
                source = f"{link.source}.{link.output}" if link else ""
                if name in measured:
                    feeds.append(Feed(name, name))
                elif link and source in measured:
                    feeds.append(Feed(name, source, link.factor, link.offset, self.ahead(link.source, component)))
                elif link:
                    todo.append(link.source)
        return Group(tuple(c for c in self.system.components if c in members), tuple(feeds))

    def ahead(self, source: str, target: str) -> bool:
        """Whether a component is given the source's value of the end of its step."""
        return self.algorithm.ahead(source, target)

    def replay(self, group: Group, run: MeasuredRun, wanted: list[str]) -> dict[str, np.ndarray]:
        """The variables `wanted` of a group at the times of a run."""
        result, time = run_system(self.played(group, run, wanted), settings=self.given(group, run)), run.time - run.time[0]
        for name, end in result.ended.items():
            raise DataError(
                f"{run.log}: {name} ends every run itself at t = {end:.9g} s, the log goes on until {time[-1]:.9g} s. "
                "Cut the log there."
            )
        table = result.table
        return {name: np.interp(time, table["time"], table[name].astype(float)) for name in wanted}

    def given(self, group: Group, run: MeasuredRun) -> dict[str, float]:
        """What the rig says of a group's parameters in a run."""
        given = self.rig.parameters | self.rig.of_log(run.log)
        return {name: value for name, value in given.items() if name not in self.shared and self.owner(name) in group.members}

    def _check_rows(self, run: MeasuredRun) -> None:
        """Refuse rows that lie as many steps apart as where ms are read as s, unless the rig says which of the two they are."""
        apart = float(np.median(np.diff(run.time))) / self.rig.rows.every if len(run) > 1 else 0.0
        if apart < RULES.calibrate.steps_between * self.step or self.rig.time.unit or self.rig.rows.step:
            return
        raise DataError(
            f"{run.log}: its rows lie {apart:.4g} s apart, which is {apart / self.step:.0f} steps of {self.step:.4g} s. Write "
            f'unit = "ms" under [time] in {self.rig.path.name} where that is what column {self.rig.time.column!r} is in, or unit = "s" '
            "where it is in seconds."
        )

    def _steps(self, time: np.ndarray) -> np.ndarray:
        """The steps that a run of these times takes, and its end, s."""
        step = self.system.run.step
        return np.arange(max(1, int(np.ceil(time[-1] / step - 1e-9))) + 1) * step

    def _read(self, time: np.ndarray, values: np.ndarray, grid: np.ndarray, ahead: bool, real: bool) -> np.ndarray:
        """A column as an input is given it: at the rows, or, where the rig says how it goes on between them, at the steps."""
        step = self.system.run.step
        if not self.rig.inputs:
            return np.interp(grid + (step if ahead else 0.0), time, values)
        if self.rig.inputs == HELD or not real:
            return values[np.maximum(np.searchsorted(time, grid + CLOSE * step, side="right") - 1, 0)]
        middles = np.clip(grid + 0.5 * step, time[0], time[-1])
        return np.asarray(make_interp_spline(time, values, k=min(3, len(time) - 1))(middles))

    def played(self, group: Group, run: MeasuredRun, wanted: list[str], beside: Sequence[str] = ()) -> System:
        """A group as a system that is fed by the log of a run, from its begin at 0 s, and records the variables `wanted`.

        beside: channels that the log plays although no component is given them.
        """
        time = run.time - run.time[0]
        step = self.system.run.step
        self._check_rows(run)
        steps = self._steps(time)
        stop = max(1, int(np.ceil(time[-1] / step - 1e-9))) * step
        grid = steps if self.rig.inputs else time
        columns = {}
        for feed in (*group.feeds, *(Feed(channel, channel) for channel in beside)):
            good = run.usable(feed.channel)
            if not good.any():
                raise DataError(
                    f"{run.log}: column of {feed.channel!r} has no sound sample, and {feed.target} needs it. Leave it out."
                )
            real = feed.target not in self.variables or self.variables[feed.target].type == "Real"
            values = self._read(time[good], run.signals[feed.channel][good], grid, feed.ahead, real)
            columns[feed.target] = feed.factor * values + feed.offset
        components = {name: self.system.components[name] for name in group.members}
        inside = [name for name, link in self.links.items() if link.target in group.members and name not in columns]
        connections = {name: self.system.connections[name] for name in inside}
        if columns:
            types = {name: self.variables[name].type if name in self.variables else "Real" for name in columns}
            options = {"time": grid, "columns": columns, "types": types}
            components = {LOG: Component(part="selflock.diagnosis.systems.parts:Signals", options=options), **components}
            connections |= {feed.target: Connection(f"{LOG}.{feed.target}", convert=False) for feed in group.feeds}
        order = [LOG] * bool(columns) + [name for name in self.system.order if name in group.members]
        return System(
            self.system.name,
            folder=self.system.folder,
            allow_code=self.system.allow_code,
            isolate=self.system.isolate,
            components=components,
            connections=connections,
            run=replace(self.system.run, start=0.0, stop=stop, order=order, record=wanted, interval=0.0),
            alone=self.system.alone,
            notes=self.system.notes,
        )
