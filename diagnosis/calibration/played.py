"""A system run on logs, over and over with other numbers: FMUs are made once and reset between runs where they can be."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from selflock.master.errors import DescriptionError, PartFailed
from selflock.master.face import Part
from selflock.master.initial import not_taken
from selflock.master.results import Result
from selflock.master.simulation import run as run_system
from selflock.master.system import System

from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..errors import DataError
from ..rules import RULES
from ..systems.parts import LOG, Parts
from .numbers import Number

Settings = dict[str, float]


@dataclass
class Effort:
    """What the simulations of a fit took."""

    runs: int = 0  # of the system on one run of the log
    steps: int = 0  # of FMUs
    seconds: float = 0.0  # of these, in the master
    failed: Counter = field(default_factory=Counter)  # runs that broke off, by what was said

    def add(self, other: Effort) -> None:
        self.runs, self.steps, self.seconds = self.runs + other.runs, self.steps + other.steps, self.seconds + other.seconds
        self.failed += other.failed

    def since(self, before: Effort) -> Effort:
        """What was added to what it was before."""
        runs, steps, seconds = self.runs - before.runs, self.steps - before.steps, self.seconds - before.seconds
        return Effort(runs, steps, seconds, self.failed - before.failed)

    def plain(self) -> list[Any]:
        """As plain data, from which `Effort.of` makes it again."""
        return [self.runs, self.steps, self.seconds, dict(self.failed)]

    @classmethod
    def of(cls, plain: Sequence[Any]) -> Effort:
        runs, steps, seconds, failed = plain
        return cls(runs, steps, seconds, Counter(failed))

    def told(self) -> dict[str, float]:
        """As a result file says it."""
        rate = self.steps / self.seconds if self.seconds else 0.0
        failed = sum(self.failed.values())
        return {
            "simulations": self.runs,
            "failed": failed,
            "fmu_steps": self.steps,
            "seconds": self.seconds,
            "steps_per_second": rate,
        }


SAME, OTHER, CHANCE = range(3)
TRUSTED = (
    "",
    "an FMU is another after fmi2Reset than when it is new: FMUs are made anew for each run, which takes longer",
    "the same numbers give other results each time: the system has chance of its own, and no slope can be trusted",
)
"""What is to be told of a system that was run again: the same, another after a reset, another each time."""


class Played:
    """A system on the runs of its logs. `outputs`: what is compared; `group`: the components that run, and what feeds them."""

    def __init__(self, rig: Rig, parts: Parts, runs: Sequence[MeasuredRun], numbers: Sequence[Number]):
        self.rig, self.parts, self.runs = rig, parts, list(runs)
        free = {parts.owner(number.variable) for number in numbers}
        logged = {name for name in runs[0].signals if name in parts.variables}
        sources = {component for component, inputs in parts.inputs.items() if not inputs} - free
        causality = {name: variable.causality for name, variable in parts.variables.items()}
        given = {n for n in logged if parts.owner(n) in sources or causality[n] == "input"}
        self.outputs = [name for name in parts.variables if name in logged - given and causality[name] == "output"]
        if not self.outputs:
            known = [name for name, kind in causality.items() if kind == "output" and name not in given]
            if alone := sorted({parts.owner(name) for name in given if causality[name] == "output"}):
                raise DataError(
                    f"{rig.path}: {', '.join(alone)} has no inputs, so that what was measured of it is taken as given to others, and nothing is "
                    f"left to compare. Name a number of it under [calibrate], such as {_number_of(parts, alone[0])!r}, and it is simulated."
                )
            raise DataError(
                f"{rig.path}: no column is an output of the system that is simulated, so nothing can be compared. Map one under "
                f"[columns], such as {(known or ['component.output'])[0]!r}."
            )
        self.group = parts.group(sorted({parts.owner(name) for name in self.outputs}), given)
        self.systems: list[System] = [parts.played(self.group, run, self.outputs) for run in runs]
        self.recorded = {name: name for name in self.outputs}  # what stands for an output in the table of results
        self.early: frozenset[str] = frozenset()  # outputs that were read before the step that computes them
        self.late: dict[str, float] = {}  # s by which an output was read later than its rows say
        self.base = [parts.given(self.group, run) for run in runs]
        import_module("selflock.master.convoy")  # once loaded, it steps short runs too: there will be many
        self.reusable = True  # FMUs can be reset
        self.kept: dict[str, Part] = {}  # them
        self.effort = Effort()
        self.memory: list[dict[tuple, dict[str, np.ndarray] | None]] = [{} for _ in runs]
        self.last: Exception | None = None  # why a run broke off
        self.untaken = ""  # of the first number that an FMU did not take, the sentence
        self.notes: list[str] = []  # what the master has to tell of the first run

    # --- one run -------------------------------------------------------------------------------------------------

    def simulate(self, i: int, settings: Settings) -> dict[str, np.ndarray] | None:
        """The outputs at the times of run i; None where the run broke off, or was one of other numbers. `settings`: over the rig's."""
        mine = {name: value for name, value in settings.items() if self.runs_along(name)}
        key = tuple(sorted(mine.items()))
        memory = self.memory[i]
        if key not in memory:
            while len(memory) > 2:
                memory.pop(next(iter(memory)))
            memory[key] = self._run(i, mine)
        return memory[key]

    def _run(self, i: int, settings: Settings) -> dict[str, np.ndarray] | None:
        system, run, kept = self.systems[i], self.runs[i], self.kept if self.reusable else {}
        self.kept = {}
        try:
            result = run_system(system, settings=self.base[i] | settings, keep=kept)
        except (PartFailed, DescriptionError) as error:
            closed(kept)  # those that were not yet taken
            if self.reusable and isinstance(error, PartFailed) and "fmi2Reset" in error.status:
                self.reusable = False
                return self._run(i, settings)
            if isinstance(error, DescriptionError) and not self.effort.runs:
                raise  # nothing ran yet: it is the description that is wrong
            self.last = error
            self.effort.failed[_said(error)] += 1
            self.effort.runs += 1
            return None
        whole = self._whole(result, kept, settings, float(run.time[-1] - run.time[0]))
        if LOG in kept:
            kept.pop(LOG).close()
        self.kept = kept
        if not self.reusable:
            self.close()
        self.notes = self.notes or result.notes
        self.effort.runs += 1
        self.effort.steps += result.steps * len(self.group.members)
        self.effort.seconds += result.duration
        if not whole:
            return None
        grid = result.column("time")
        return {name: np.interp(self.times(i, name), grid, result.column(self.recorded[name])) for name in self.outputs}

    def forget(self) -> None:
        """Simulate what comes next anew."""
        for memory in self.memory:
            memory.clear()

    def runs_along(self, name: str) -> bool:
        """Whether the component of a variable is simulated."""
        return self.parts.owner(name) in self.group.members

    def _whole(self, result: Result, parts: dict[str, Part], settings: Settings, stop: float) -> bool:
        """Whether a run was one of these settings, until there; what it was otherwise is told as of one that broke off."""
        for name, part in parts.items():
            for variable, found in part.untaken.items():
                if (given := settings.get(f"{name}.{variable}")) is not None and found is not None:
                    sentence = not_taken(f"{name}.{variable}", given, found)
                    self.untaken = self.untaken or sentence
                    return self._failed(f"{name}.{variable} was not taken", sentence)
        for name, end in result.ended.items():
            if end < stop - 1e-9 * max(1.0, stop):
                return self._failed(f"{name} ended the run itself", f"{name} ends the run itself at t = {end:.9g} s")
        return True

    def _failed(self, reason: str, sentence: str) -> bool:
        self.effort.failed[reason] += 1
        self.last = DataError(sentence)
        return False

    def close(self) -> None:
        """Free the FMUs."""
        closed(self.kept)

    def trust(self, settings: Settings, others: Settings, i: int) -> str:
        """See whether FMUs that were reset do what new ones do; from now on they are made anew where not. What is to be told of it.

        Native code whose reset writes where it should not spoils, or ends, all that is in its process: it is tried in another.
        """
        asked = settings, others, i
        found = self._apart(lambda: self._as_new(*asked))
        if found < SAME:
            self.reusable = False
            if (again := self._apart(lambda: self._as_new(*asked))) < SAME:
                raise DataError(
                    f"{self.rig.path}: an FMU of the system crashes its process ({signal.Signals(-again).name}) when it is run a second time. "
                    f"Give it one of its own: process = true under its [components.NAME] in {self.parts.path.name}."
                )
        self.reusable = found == SAME
        for one in (settings, others):  # what is to be told of them is told here
            self.simulate(i, one)
        self.memory[i].clear()
        if found < SAME:
            return f"an FMU crashes its process ({signal.Signals(-found).name}) when it is reset: FMUs are made anew for each run, which takes longer"
        return TRUSTED[found]

    def _as_new(self, settings: Settings, others: Settings, i: int) -> int:
        """Whether FMUs that were reset do what new ones do, as a place in TRUSTED."""
        first = self.simulate(i, settings)
        self.simulate(i, others)
        self.memory[i].clear()
        if first is None or _same(first, self.simulate(i, settings)):
            return SAME
        self.reusable = False
        self.close()
        self.memory[i].clear()
        again = self.simulate(i, settings)
        self.memory[i].clear()
        return OTHER if _same(again, self.simulate(i, settings)) else CHANCE

    def _apart(self, function: Callable[[], int]) -> int:
        """What a function of 0 to 255 answers in a process of its own, or minus the signal that ends that; here where there is no fork."""
        if not hasattr(os, "fork"):
            return function()
        self.close()  # FMUs are made there
        sys.stdout.flush()  # or it would be said there, too
        if not (child := os.fork()):
            faulthandler.disable()  # a crash there is an answer
            answer = SAME  # whatever is raised is raised again where it can be told
            try:
                answer = function()
            finally:
                os._exit(answer)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

    # --- what is compared ----------------------------------------------------------------------------------------

    def times(self, i: int, name: str) -> np.ndarray:
        """The times of run i at which an output is compared: what was read before the step that computes it, at the end of that."""
        time = self.runs[i].time - self.runs[i].time[0] + self.late.get(name, 0.0)
        return time + self.systems[i].run.step if name in self.early else time

    def errors(self, settings: Sequence[Settings], which: Sequence[int]) -> dict[str, list[np.ndarray]] | None:
        """measured - simulated of each output in the runs `which`; None where one of them broke off."""
        found: dict[str, list[np.ndarray]] = {name: [] for name in self.outputs}
        for i in which:
            simulated = self.simulate(i, settings[i])
            if simulated is None:
                return None
            for name, values in simulated.items():
                found[name].append(self.runs[i].signals[name] - values)
        return found

    def trusted(self, name: str, which: Sequence[int]) -> list[np.ndarray]:
        """Which samples of an output count.

        The first row of a run is before any step. What is no start value there, an FMU that computes in its steps has not
        computed yet: it says nothing of the model. Nor does what was read before the first step, or behind the last.
        """
        found = [self.runs[i].usable(name) & np.isfinite(self.runs[i].signals[name]) for i in which]
        begins = name in self.early or self.parts.variables[name].initial in ("exact", "approx")
        for i, good in zip(which, found):
            times = self.times(i, name)
            good &= (times >= 0.0) & (times <= self.systems[i].run.stop * (1.0 + 1e-9))
            good[0] &= begins
        return found

    def spread(self, name: str) -> float:
        """Standard deviation of what is measured, over all runs."""
        values = np.concatenate(
            [run.signals[name][good] for run, good in zip(self.runs, self.trusted(name, range(len(self.runs))))]
        )
        return float(np.std(values)) if len(values) else 0.0

    def still(self) -> bool:
        """Whether all that the log gives to the system stands still in all its runs."""
        for feed in self.group.feeds:
            for run in self.runs:
                values = run.signals[feed.channel][run.usable(feed.channel)]
                if len(values) and np.ptp(values) > RULES.calibrate.unmoved * max(1.0, float(abs(values).max())):
                    return False
        return bool(self.group.feeds)


def closed(parts: dict[str, Part]) -> None:
    """Free parts."""
    while parts:
        parts.popitem()[1].close()


def _same(a: dict[str, np.ndarray] | None, b: dict[str, np.ndarray] | None) -> bool:
    if a is None or b is None:
        return a is b
    return all(np.allclose(a[name], b[name], rtol=1e-9, atol=1e-12 * float(np.std(a[name]))) for name in a)


def _said(error: Exception) -> str:
    if isinstance(error, PartFailed):
        return f"{error.part} answered {error.status}"
    return str(error).splitlines()[0]


def _number_of(parts: Parts, component: str) -> str:
    """A parameter of a component, by its name; any word where it has none."""
    of = (name for name, v in parts.variables.items() if parts.owner(name) == component and v.causality == "parameter")
    return next(of, f"{component}.parameter")
