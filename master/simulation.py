"""A run from start to stop."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from . import control
from .algorithms import ALGORITHMS, Stepped
from .errors import DescriptionError, PartFailed
from .face import Part
from .results import Result
from .running import Observer, Running
from .single import driven, single
from .slips import call, checked
from .ssp.structure import system_of
from .stops import Stops
from .system import System, check_choice

LEVELS = 10  # step_min = step / 2**LEVELS unless told
WORTH = 3000  # FMU steps from which on it pays to load the compiled loop of master.convoy
LOADED = 0.05  # share of that where it is loaded already


def run(
    system: System | Path | str,
    settings: dict[str, Any] | None = None,
    stop: float | None = None,
    out: Path | str | None = None,
    progress: bool | Callable[[float], None] = False,
    observe: Observer | None = None,
    keep: dict[str, Part] | None = None,
    step: float | None = None,
    algorithm: str | None = None,
    tolerance: float | None = None,
    inputs: Path | str | None = None,
    allow_code: bool = False,
    unlimited: bool = False,
    isolate: bool = False,
    max_time: float | None = None,
    resume: bool = False,
) -> Result:
    """Couple the components of `system` from its start to `stop` [s]. A path may also be that of one FMU (master.single).

    settings: "component.variable" = value, over those of the system; text is taken as the variable's type wants it. Of
        one FMU "variable" is enough.
    out: a .csv or .parquet file to write to; without one the table stays in memory.
    progress: True draws a bar; a function is called with the fraction done.
    observe: called as observe(time, parts) at the start and after every communication step.
    keep: an empty dictionary at first; holds the parts from run to run of the same system, which are then reset
        instead of made again. Whoever gives it closes them. A run that fails closes its parts and leaves none in it.
    allow_code: parts of other packages may be loaded (docs/security.md).
    unlimited: FMUs and SSPs may be of any size.
    isolate: every FMU runs in a process of its own with limits and without rights.
    max_time: of wall time for all of it, s; then TimeUp is raised, whose `result` holds what was computed until then.
    resume: go on from the state that the same call saved beside `out` before it was ended, to the same bits; where there is
        none, begin. Now and then a state is saved. Only where all parts can put their state into bytes.
    step, algorithm: the communication step [s] and "gauss-seidel" or "jacobi", in place of the system's.
    inputs: a .csv or .parquet file with a column `time` and columns named as inputs (master.single).
    tolerance: relative, of the FMUs' own solvers, in place of the system's fmu_tolerance.

    A part that fails raises PartFailed, whose `result` holds what was computed until then. Ctrl-C is a KeyboardInterrupt that
    says what is kept.
    """
    call(system, settings, stop, out)
    if not isinstance(system, System) and Path(system).suffix.lower() == ".fmu":
        system = replace(single(system, unlimited, stop, step), isolate=isolate)
    elif not isinstance(system, System):
        system = system_of(system, allow_code, unlimited, isolate)
    else:
        system = replace(
            system,
            allow_code=system.allow_code or allow_code,
            unlimited=system.unlimited or unlimited,
            isolate=system.isolate or isolate,
        )
    checked(system)
    given: dict[str, Any] = {"step": step, "algorithm": algorithm, "fmu_tolerance": tolerance}
    system = replace(system, run=replace(system.run, **{key: value for key, value in given.items() if value is not None}))
    check_choice("algorithm", system.run.algorithm, ALGORITHMS)
    if inputs is not None:
        system = driven(system, inputs)
    end = system.run.stop if stop is None else float(stop)
    _check_times(system, end)
    stops = Stops(max_time)
    try:
        with stops, _Progress(progress, system.run.start, end) as tell:
            return _simulate(Running(system, settings, end, out, tell, observe, keep, stops, resume))
    except KeyboardInterrupt as error:
        if error.args:
            raise
        raise stops.error("The run", "it had not begun") from None


def _simulate(running: Running) -> Result:
    """Run, close everything whatever happens, and give the result, or raise the failure with the result in it."""
    done = False
    try:
        try:
            running.start()
        except (KeyboardInterrupt, PartFailed) as error:
            if stopped := running.stopped(error):
                raise stopped from None
            raise
        with _failing(running):
            _go(running)
            running.recorder.check()
            running.sink.flush()
            for part in running.wiring.parts.values():
                part.terminate()
        result = running.result()
        done = True
        if running.keep is not None:
            running.keep |= running.wiring.parts
            running.wiring.parts = {}
        return result
    finally:
        try:
            if running.states:
                running.sink.whole = done or running.states.time is None
            running.sink.close()
            if running.states and done:
                running.states.forget()
        finally:
            running.wiring.close()


def _go(running: Running) -> None:
    """All steps from the start to the stop."""
    run = running.system.run
    if not running.resumed:
        running.arrive(run.start)
    if run.step_control:
        _controlled(running)
        return
    seats = [seat for seat in running.seats if not seat.timed]
    stepped: Sequence[Stepped] = seats
    advance, windows, arrive = running.wiring.algorithm.step, running.faults, running.arrive
    start, step = run.start, run.step
    count = round((running.stop - start) / step)
    every = max(1, round(run.interval / step)) if run.interval else 1
    worth = LOADED * WORTH if f"{__package__}.convoy" in sys.modules else WORTH
    if stepped and count * len(stepped) >= worth and find_spec("numba"):  # which the master alone does without
        from . import convoy

        stepped = formed = convoy.form(seats)
        one, observed = formed[0], running.observe is not None or running.recorder.texts or running.recorder.timed
        if len(formed) == 1 and isinstance(one, convoy.Convoy) and not observed and not windows.parameters:
            if one.clocks() is not None:
                return convoy.sail(running, one, count, every)
    ends, time = running.ends, running.time
    for index in range(running.index, count):
        if windows.parameters:
            windows.switch(time)
        advance(stepped, index, time, step)
        time = start + (index + 1) * step
        running.index = index + 1
        if ends and running.over(time):
            return
        arrive(time, (index + 1) % every == 0)


def _controlled(running: Running) -> None:
    """Step from start to stop with a step that follows the error."""
    description = running.system.run
    stepped = [seat for seat in running.seats if not seat.timed]
    levels = LEVELS if not description.step_min else max(0, math.ceil(math.log2(description.step / description.step_min) - 1e-9))
    tick = description.step / 2**levels
    total = round((running.stop - description.start) / description.step) * 2**levels
    estimate = control.CONTROLS[description.step_control](running.wiring, running.balances, stepped)
    position, size = 0, 1
    while position < total:
        time = description.start + position * tick
        if running.faults.parameters:
            running.faults.switch(time)
        snapshot = control.Snapshot(stepped) if estimate.goes_back else None
        try:
            error = estimate.step(running.index, time, size * tick, snapshot)
        except PartFailed as failure:
            if snapshot is None or size == 1 or not failure.status.startswith("Discard"):
                raise
            error = math.inf
        if running.ends:
            running.index += 1
            running.over(time + size * tick)
            return
        if error > 1.0 and size > 1 and snapshot is not None:
            snapshot.restore()
            running.rejected += 1
            size //= 2
            continue
        position += size
        if error > 1.0 and size > 1:
            size //= 2
        elif error < estimate.grow and size < 2**levels and position % (2 * size) == 0:
            size *= 2
        running.index += 1
        running.arrive(description.start + position * tick)


class _failing:
    """Hands the results so far to whatever failure ends a run, and says where they are."""

    def __init__(self, running: Running):
        self.running = running

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        running = self.running
        if isinstance(error, (KeyboardInterrupt, PartFailed)) and (stopped := running.stopped(error)):
            raise stopped from None
        if isinstance(error, PartFailed):
            try:
                running.recorder.check()
            except PartFailed as earlier:  # what ended the run began with nonsense
                if earlier.status != error.status:
                    earlier.args = (f"{earlier}\n  after that, {error}",)
                    error.args = earlier.args
            running.sink.flush()
            error.result = result = running.result()
            where = f"in {result.path}" if result.path else "in the `result` of this exception"
            error.args = (f"{error}\n  the results until t = {running.time:.9g} s are {where}",)
        return False


def _check_times(system: System, stop: float) -> None:
    run = system.run
    if not run.step > 0.0 or not math.isfinite(run.step):
        raise DescriptionError(f"[run] step = {run.step:g}: a step above zero is wanted here.")
    if not stop > run.start or not math.isfinite(stop):
        raise DescriptionError(f"The stop time {stop:g} s must be after the start {run.start:g} s.")
    for what, length in (("The time from start to stop", stop - run.start), ("[run] interval", run.interval)):
        steps = length / run.step
        if abs(steps - round(steps)) > 1e-6 * max(1.0, steps):
            raise DescriptionError(f"{what}, {length:g} s, is not a whole number of steps of {run.step:g} s.")


class _Progress:
    """A bar, a function, or nothing; told the time now and then."""

    def __init__(self, progress, start: float, stop: float):
        self.start, self.length, self.bar = start, stop - start, None
        self.next, self.function = 0.0, progress if callable(progress) else None
        if progress is True:
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

            self.bar = Progress(
                TextColumn("{task.completed:.2f} of {task.total:g} s"), BarColumn(), TimeRemainingColumn(), transient=True
            )

    def __enter__(self):
        if self.bar:
            self.bar.start()
            task = self.bar.add_task("run", total=self.length)
            self.function = lambda fraction: self.bar.update(task, completed=fraction * self.length)
        return self.tell if self.function else None

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()

    def tell(self, time: float) -> None:
        fraction = (time - self.start) / self.length
        if self.function and (fraction >= self.next or fraction >= 1.0):
            self.next = fraction + 0.005
            self.function(fraction)
