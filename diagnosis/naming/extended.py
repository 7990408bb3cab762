"""A system with corrections, run on logs over and over: what all fits of a naming are made with."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from selflock.fmus.correction import law
from selflock.master.errors import DescriptionError, PartFailed
from selflock.master.simulation import run as run_system
from selflock.master.system import Component

from ..calibration.fit import Calibrating, Rows
from ..calibration.numbers import Number
from ..calibration.played import Played, Settings, closed
from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..data.values import resolution
from ..errors import DataError
from ..rules import RULES
from ..systems.parts import LOG, Parts
from .places import IN, Insert, Place, extended, listening
from .rounding import Rounded, beside_step

COMPILED = "selflock.diagnosis.naming.part:CompiledCorrection"


def component(one: Insert) -> Component:
    """A correction that steps in the compiled loop."""
    options = {"kind": one.law, "multiplies": one.multiplies, "taken": one.taken, "own": one.own, "points": one.points}
    return Component(part=COMPILED, options=options, start=dict(one.fixed))


class Extended(Played):
    """A system on the runs of its logs, with corrections that come and go."""

    def __init__(self, rig: Rig, parts: Parts, runs: Sequence[MeasuredRun], numbers: Sequence[Number]):
        super().__init__(rig, parts, runs, numbers)
        fed = {feed.channel for feed in self.group.feeds}
        self.rounded: dict[str, Rounded] = {}  # outputs that were rounded, as they were recorded
        self.logged = list(runs)  # the runs as they were recorded, where they are told otherwise
        self.beside = [name for name in runs[0].signals if name not in fed and name not in parts.variables]
        self.plain = [parts.played(self.group, run, self.outputs, self.beside) for run in runs]
        self.inserts: tuple[Insert, ...] = ()
        self.extend(())

    def extend(self, inserts: Sequence[Insert]) -> None:
        """From now on the system has these corrections, and no others."""
        for one in {*self.inserts} - {*inserts}:
            if one.name in self.kept:
                self.kept.pop(one.name).close()
        self.inserts = tuple(inserts)
        both = [extended(system, self.parts, inserts, component) for system in self.plain]
        self.systems = [system for system, _ in both]
        self.moved = both[0][1]
        last = {f"{one.name}.corrected": one.name for one in inserts if one.law == "quantisation" and one.place.where != IN}
        self.rounding = {name: last[self.moved[name]] for name in self.rounded if self.moved.get(name) in last}
        signal = {name: f"{part}.signal" for name, part in self.rounding.items()}
        self.recorded = {name: signal.get(name, self.moved.get(name, name)) for name in self.outputs}
        if signal:
            before = {self.moved[name]: heard for name, heard in signal.items()}
            record = [before.get(name, name) for name in self.systems[0].run.record]
            self.systems = [replace(one, run=replace(one.run, record=record)) for one in self.systems]
        self.memory = [{} for _ in self.runs]

    @contextmanager
    def having(self, inserts: Sequence[Insert]) -> Iterator[None]:
        """With these corrections for a while, then with those that it has."""
        before = self.inserts
        self.extend(inserts)
        try:
            yield
        finally:
            self.extend(before)

    def runs_along(self, name: str) -> bool:
        head = name.partition(".")[0]
        return any(one.name == head for one in self.inserts) or super().runs_along(name)

    def steps(
        self, settings: Sequence[Settings], i: int, place: Place | None = None, overs: Sequence[str] = ()
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]] | None:
        """The outputs of run i at all steps, and what a correction at a place would be given; None where the run breaks off.

        What is given is by variable, the signal under "", of each step as it is taken: one value less than there are outputs.
        """
        system = self.systems[i]
        columns: dict[str, str] = {}
        if place is not None:
            system, columns = listening(self.plain[i], system, self.parts, self.moved, place, overs, component)
        mine = {name: value for name, value in settings[i].items() if self.runs_along(name)}
        kept, self.kept = self.kept if self.reusable else {}, {}
        self.effort.runs += 1
        try:
            result = run_system(system, settings=self.base[i] | mine, keep=kept)
        except (PartFailed, DescriptionError):
            closed(kept)
            return None
        closed({name: kept.pop(name) for name in {*kept} - {*self.systems[i].components} | {LOG} & {*kept}})
        self.kept = kept
        if not self.reusable:
            self.close()
        self.effort.steps += result.steps * len(self.group.members)
        self.effort.seconds += result.duration
        outputs = {name: result.column(self.recorded[name]) for name in self.outputs}
        return outputs, {over: result.column(column)[1:] for over, column in columns.items()}

    def series(self, settings: Sequence[Settings], which: Sequence[int]) -> dict[str, list[np.ndarray]]:
        """All numbers of the components that run, and of the log beside them, at the steps of these runs: `time` among them."""
        names = [
            name
            for name, v in self.parts.variables.items()
            if self.parts.owner(name) in self.group.members and v.causality in ("input", "output") and v.type == "Real"
        ]
        found: dict[str, list[np.ndarray]] = {name: [] for name in ("time", *names, *self.beside)}
        for i in which:
            mine = {name: value for name, value in settings[i].items() if self.runs_along(name)}
            system = replace(self.systems[i], run=replace(self.systems[i].run, record=names))
            table = run_system(system, settings=self.base[i] | mine).table
            time = table["time"].to_numpy(float)
            for name in ("time", *names):
                found[name].append(table[name].to_numpy(float))
            run = self.runs[i]
            for name in self.beside:
                found[name].append(np.interp(time, run.time - run.time[0], run.signals[name]))
        return found


@dataclass
class Extending(Calibrating):
    """A fit of a system with corrections. `acts`: of a number that sets others than its own variable, which ones, and by how much of it."""

    acts: dict[str, dict[str, float]] = field(default_factory=dict)
    every = True

    def floor(self, name: str, errors: list[np.ndarray], quantum: float = 0.0) -> float:
        """Of what was rounded no more than it has about its steps: from row to row a rounding differs as noise does.

        Whatever of it is asked, the steps of its recorder are noise: a battery's voltage in steps of 50 mV was 3.5 times it.
        """
        assert isinstance(self.played, Extended)
        found, rounded = super().floor(name, errors, max(quantum, self.quanta[name])), self.played.rounded
        return min(found, rounded[name].noise) if name in rounded else found

    @cached_property
    def quanta(self) -> dict[str, float]:
        """The resolution of each output as it was recorded, whatever steps miss of it."""
        assert isinstance(self.played, Extended)
        logged = self.played.logged
        return {name: resolution(np.concatenate([logged[i].signals[name] for i in self.which])) for name in self.played.outputs}

    def begins(self) -> list[Any]:
        assert isinstance(self.played, Extended)
        return [*super().begins(), self.played.inserts, self.acts]

    def errors(self, values: dict[str, float], which: Sequence[int] | None = None) -> Rows | None:
        """None also where a law runs away. Of what is rounded, as the log has it, beside the step where the log has it."""
        found = self.unrounded(values, which)
        assert isinstance(self.played, Extended)
        if found is not None and self.played.rounding:
            chosen = self.which if which is None else which
            settings = self.settings(values)
            for name, part in self.played.rounding.items():
                for k, i in enumerate(chosen):
                    y, step = self.played.logged[i].signals[name], settings[i].get(f"{part}.q", 0.0)
                    found[name][k] = beside_step(y, y - found[name][k], step)
        return found

    def unrounded(self, values: dict[str, float], which: Sequence[int] | None = None) -> Rows | None:
        """The same of what the model has before it is rounded; None where a law runs away: so far off no number says anything."""
        found = super().errors(values, which)
        if found is None:
            return None
        for name, parts in found.items():
            most = max(float(np.max(abs(e), initial=0.0, where=~np.isnan(e))) for e in parts)
            if most > RULES.naming.away * self.units.get(name, 1.0):
                self.played.last = DataError(
                    f"{name} runs away, to {most:.2g} beside what is measured, which varies by {self.played.spread(name):.2g}: is a sign "
                    "wrong in the system, or a loop of it unstable?"
                )
                return None
        return found

    def settings(self, values: dict[str, float]) -> list[Settings]:
        found = super().settings({name: value for name, value in values.items() if name not in self.acts})
        for n in self.numbers:
            for variable, factor in self.acts.get(n.name, {}).items():
                for i, mine in enumerate(found):
                    if n.run in (None, i):
                        mine[variable] = mine.get(variable, 0.0) + factor * values[n.name]
        return found


@dataclass
class Vanishing(Extending):
    """The same of a model as it would be in steps that vanish: values that are held for a step err by a part that falls with it.

    What half the step changed is left once more (Richardson). doubled: the problem in steps twice as long.
    """

    doubled: Extending | None = None

    @classmethod
    def of(cls, problem: Extending, doubled: Extending) -> Vanishing:
        found = cls(**{f.name: getattr(problem, f.name) for f in fields(problem)}, doubled=doubled)
        vars(found)["played"], vars(found)["trusted"] = problem.played, problem.trusted
        return found

    def unrounded(self, values: dict[str, float], which: Sequence[int] | None = None) -> Rows | None:
        assert self.doubled is not None
        chosen = self.which if which is None else which
        return vanished(super().unrounded(values, chosen), self.doubled.unrounded(values, chosen))


def vanished(fine: Rows | None, twice: Rows | None) -> Rows | None:
    """What is left in steps that vanish, of what is in some and in steps twice as long; None where a run breaks off."""
    if fine is None or twice is None:
        return None
    return {name: [2.0 * a - b for a, b in zip(fine[name], twice[name])] for name in fine}


def gone_through(series: dict[str, list[np.ndarray]], name: str, what: int = law.VALUE, beside: str = "") -> np.ndarray:
    """What of a variable, or of two, a law goes with, at all steps of all runs."""
    parts = zip(series[name], series["time"], series[beside or name])
    return np.concatenate([taken(x, time, what, w) for x, time, w in parts])


def taken(x: np.ndarray, time: np.ndarray, what: int, w: np.ndarray) -> np.ndarray:
    """What of x, and of w, a law goes with, at all steps: as the law itself takes it, but for where in a step."""
    if what == law.RATE:
        return np.gradient(x, time)
    if what == law.INTEGRAL:
        return np.concatenate([[0.0], np.cumsum(x[:-1] * np.diff(time))])
    if what == law.SINCE_TURN:
        way = np.sign(np.diff(x, prepend=2.0 * x[0] - x[1]))  # as if it had come as it goes on
        places = np.where(way != 0.0, np.arange(len(x)), 0)
        way = way[np.maximum.accumulate(places)]
        turned = np.flatnonzero(np.diff(way, prepend=way[0]) != 0.0)
        last = np.zeros(len(x), int)
        last[turned] = turned
        return time - time[np.maximum.accumulate(last)]
    if what == law.DIFFERENCE:
        return x - w
    if what == law.PRODUCT:
        return x * w
    if what == law.ROOTED:
        return x * np.sign(w) * np.sqrt(abs(w))
    return x
