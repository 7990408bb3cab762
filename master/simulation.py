"""A run from start to stop."""

from __future__ import annotations

import logging
import math
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .algorithms import ALGORITHMS
from .errors import DescriptionError, PartFailed, RunInterrupted, warn
from .face import Part
from .garbage import left_alone
from .opening import system_of
from .results import Result
from .running import Observer, Running
from .single import driven, of_one, single
from .slips import call, checked
from .stepping import Controlled, Fixed, Stepping
from .stops import Stops
from .system import System, check_choice

log = logging.getLogger(__name__)

WORTH = 3000  # FMU steps from which on it pays to load the compiled loop of master.convoy
COUNTED = 2.0**53  # steps from which on a double does not tell one from the next
LOADED = 0.05  # share of that where it is loaded already
TWINS = 200_000  # steps of FMUs in Python, of all runs of a process, that take as long as loading the laws of ours, compiled
_stepped = [0.0]  # how many there were


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
    interface: str | None = None,
    max_time: float | None = None,
    resume: bool = False,
    as_fmu: bool = False,
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
    step, algorithm: the communication step [s] and "gauss-seidel", "jacobi" or "iterated", in place of the system's.
    inputs: a .csv or .parquet file with a column `time` and columns named as inputs (master.single).
    tolerance: relative, of the FMUs' own solvers, in place of the system's fmu_tolerance.
    max_time: of wall time for all of it, s; then TimeUp is raised, whose `result` holds what was computed until then.
    resume: go on from the state that the same call saved beside `out` before it was ended, to the same bits; where there is
        none, begin. Now and then a state is saved. Only where all parts can put their state into bytes.
    interface: of one FMU, "cs" co-simulation, "me" model exchange or "se" scheduled execution; co-simulation where it has that.
    as_fmu: FMUs of ours are stepped as anybody's; else long runs step them by their compiled laws, to the same bits (master.twin).

    A part that fails raises PartFailed, and Ctrl-C RunInterrupted, a KeyboardInterrupt that says what is kept: their `result`
    holds what was computed until then.
    """
    call(system, settings, stop, out)
    system, end = prepared(system, stop, step, algorithm, tolerance, inputs, allow_code, unlimited, isolate, interface, as_fmu)
    check_times(system, end)
    stops = Stops(max_time)
    try:
        with stops, _Progress(progress, system.run.start, end) as tell:
            return _simulate(Running(system, settings, end, out, tell, observe, keep, stops, resume))
    except KeyboardInterrupt as error:
        if error.args:
            raise
        raise stops.error("The run", "it had not begun") from None
    except Exception as error:  # an FMU in Python, or a compiler, met the interrupt while it was made, and there is none
        if not stops.asked or getattr(error, "result", None) is not None:
            raise
        raise stops.error("The run", "it had not begun") from None


def prepared(
    system: System | Path | str,
    stop: float | None,
    step: float | None,
    algorithm: str | None,
    tolerance: float | None,
    inputs: Path | str | None,
    allow_code: bool,
    unlimited: bool,
    isolate: bool,
    interface: str | None = None,
    as_fmu: bool = False,
) -> tuple[System, float]:
    """The system that `run` is asked for by these arguments of it, and its stop, s."""
    if not isinstance(system, System) and of_one(Path(system)):
        system = replace(single(system, unlimited, None if stop == math.inf else stop, step, interface or ""), isolate=isolate)
    elif interface:
        raise DescriptionError(
            "interface is said of one FMU; a system says it of its components: interface = under [components.NAME]."
        )
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
    given: dict[str, Any] = {"step": step, "algorithm": algorithm, "fmu_tolerance": tolerance, "as_fmu": as_fmu or None}
    system = replace(system, run=replace(system.run, **{key: value for key, value in given.items() if value is not None}))
    check_choice("algorithm", system.run.algorithm, ALGORITHMS)
    if inputs is not None:
        system = driven(system, inputs, stop)
    return system, system.run.stop if stop is None else float(stop)


def _simulate(running: Running) -> Result:
    """Run, close everything whatever happens, and give the result, or raise the failure with the result in it."""
    done = False
    try:
        try:
            running.start()
        except (KeyboardInterrupt, Exception) as error:
            if stopped := running.stopped(error):
                raise stopped from None
            raise
        with failing(running):
            _go(running)
        with failing(running):
            running.recorder.check(running.time)
            running.sink.flush()
        for part in running.wiring.parts.values():
            try:
                part.terminate()
            except PartFailed as error:  # every row is there
                running.notes.append(f"{part.name} answered {error.status}, after its last step; the results are whole")
                warn(running.notes[-1])
        result = running.result()
        log.info("%s: %d steps to %g s in %.2f s", result.system, result.steps, running.time, result.duration)
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


def stepping(running: Running) -> Stepping:
    """The steps of a run that has been started, one by one; brings it to its start."""
    if not running.resumed:
        running.arrive(running.system.run.start)
    return Controlled(running) if running.system.run.step_control else Fixed(running)


def _go(running: Running) -> None:
    """All steps from the start to the stop."""
    steps = stepping(running)
    with _laws(steps):
        _all(running, steps)


@left_alone()
def _laws(steps: Stepping) -> AbstractContextManager[None]:
    """While it lasts, FMUs of ours are stepped by their compiled laws: from when others took as long as loading these takes."""
    if not isinstance(steps, Fixed) or steps.running.system.run.as_fmu or not find_spec("numba"):
        return nullcontext()
    natives = [seat.part.native() for seat in steps.seats]
    count = steps.count * sum(native is not None and native.python for native in natives)
    _stepped[0] += count
    if not count or _stepped[0] < TWINS:
        return nullcontext()
    from .twin import offered

    return offered()


def _all(running: Running, steps: Stepping) -> None:
    coupling = steps.coupling
    if isinstance(steps, Fixed) and not coupling.redone:
        worth = LOADED * WORTH if f"{__package__}.convoy" in sys.modules else WORTH
        if steps.seats and steps.count * len(steps.seats) >= worth and find_spec("numba"):  # which the master alone does without
            from . import convoy

            formed = convoy.form(steps.seats)
            one, observed = formed[0], running.observe is not None or running.recorder.texts
            if (
                len(formed) == 1
                and isinstance(one, convoy.Convoy)
                and coupling.plain
                and not observed
                and not running.faults.parameters
            ):
                if convoy.clocks(one, running.recorder) is not None:
                    log.debug("all %d FMUs are stepped in one compiled loop", len(steps.seats))
                    return convoy.sail(running, one, round(steps.count), steps.kept)
            steps.stepped = formed
            log.debug("%d FMUs and parts are stepped as %d", len(steps.seats), len(formed))
    while not steps.over:
        steps.step()


@contextmanager
def ready(running: Running) -> Iterator[None]:
    """Steps between: the first Ctrl-C takes effect at the next communication point, where all parts are sound; another one at once.

    Inside a step it would hit whatever Python is at, such as an FMU's own, which tells of it as of a failure.
    """
    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not ours:
        yield
        return

    def later(number: int, frame: Any) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        running.interrupted = True

    signal.signal(signal.SIGINT, later)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    running.heed()


class failing:
    """Hands the results so far to whatever ends a run before its time, a failure or a person, and says where they are."""

    def __init__(self, running: Running):
        self.running = running

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        running = self.running
        if (
            isinstance(error, (KeyboardInterrupt, Exception))  # a compiler that met Ctrl-C in its C has an error of its own
            and not isinstance(error, RunInterrupted)
            and (stopped := running.stopped(error))
        ):
            raise stopped from None
        if isinstance(error, PartFailed):
            try:
                running.recorder.check(running.time)
            except PartFailed as earlier:  # what ended the run began with nonsense
                if earlier.status != error.status:
                    earlier.args = (f"{earlier}\n  after that, {error}",)
                    error.args = earlier.args
            running.sink.want_last()
            running.sink.flush()
            error.result = result = running.result()
            where = f"in {result.path}" if result.path else "in the `result` of this exception"
            error.args = (f"{error}\n  the results until t = {running.time:.9g} s are {where}",)
        return False


def check_times(system: System, stop: float, endless: bool = False) -> None:
    """Refuse times and steps that do not go together. endless: the stop may be infinite. Raises DescriptionError."""
    run = system.run
    if not run.step > 0.0 or not math.isfinite(run.step):
        raise DescriptionError(f"[run] step = {run.step:g}: a step above zero is wanted here.")
    if endless and stop == math.inf:
        stop = run.start + run.step
    if not math.isfinite(stop):
        raise DescriptionError(f"The stop time {stop:g} s is none that a run comes to: a number of s is wanted here.")
    if not stop > run.start:
        raise DescriptionError(f"The stop time {stop:g} s must be after the start {run.start:g} s.")
    for what, length in (("The time from start to stop", stop - run.start), ("[run] interval", run.interval)):
        steps = length / run.step
        if not steps < COUNTED:
            raise DescriptionError(f"{what}, {length:g} s, is beyond any number of steps of {run.step:g} s.")
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
