"""The calls of a user: a rig says whether it is a drive that is asked about, or a system of FMUs.

Each loads the rooms that it needs: half of what a replay takes is loading.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import wraps
from importlib import import_module
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

from selflock.fmus.place import claimed, tidied
from selflock.master.stops import Stops

from .asked import asked, files, laws
from .data.gathered import several
from .data.rig import Rig
from .errors import DataError
from .progress import Tell, shown
from .rules import RULES

if TYPE_CHECKING:
    from .calibration.result import Calibration
    from .calibration.run import Spread
    from .judge.result import Diagnosis
    from .naming.outcome import Naming
    from .naming.plan import NextInputs
    from .pipeline.replay import Replay
    from .planning.run import NextRun
    from .search.kept import Kept
    from .tracking.track import Track

P = ParamSpec("P")
T = TypeVar("T")


def _narrow(call: Callable[P, T]) -> Callable[P, T]:
    """A call in which BLAS has one thread: matrices are narrow, and a search has threads of its own; more of them only cost.

    SciPy's own BLAS is loaded before, so that it is told, too.
    """

    @wraps(call)
    def narrow(*given: P.args, **named: P.kwargs) -> T:
        import_module("scipy.linalg")
        with threadpool_limits(limits=1):
            return call(*given, **named)

    return narrow


@_narrow
def replay(
    rig: str | Path | Rig,
    log: str | Path,
    out: str | Path | None = "out/replay",
    allow_code: bool = False,
    anyway: bool = False,
    isolate: bool = False,
) -> Replay:
    """Simulate a measured log with nominal parameters and compare; figures, tables and replay.json go to `out`.

    allow_code: parts of other packages may be loaded, where the rig has a system, and the rig's own effects (docs/security.md).
    anyway: go on where the log of a drive and its rig contradict each other (docs/rig.md); else that is a DataError.
    isolate: every FMU of the rig's system runs in a process of its own with limits and without rights (docs/security.md).
    """
    if not isinstance(log, (str, Path)):
        raise DataError(f"replay takes one log, the path of a file: a {type(log).__name__} ({log!r}) is none.")
    rig = asked(rig, allow_code, isolate)
    with laws(rig), claimed(out, "replay", "replay.json") as folder:
        if rig.system is not None:
            from .systems.system import replay_system

            return replay_system(rig, log, folder, anyway)
        from .pipeline.replay import replay_drive

        return replay_drive(rig, log, folder, anyway)


@_narrow
def diagnose(
    rig: str | Path | Rig,
    logs: str | Path | Sequence[str | Path],
    test: Sequence[str | Path] = (),
    out: str | Path | None = "out/diagnosis",
    progress: bool | Callable[[str, float], None] = False,
    seed: int | None = None,
    allow_code: bool = False,
    anyway: bool = False,
    max_time: float | None = None,
    isolate: bool = False,
) -> Diagnosis:
    """Name what the simulation of `rig` gets wrong on `logs`, extend it, measure the gain on `test` or held-out blocks.

    out: folder for diagnosis.json, report.html, figures and the extended FMUs; None writes nothing.
    progress: True draws a bar, or writes a line to stderr now and then where no terminal shows one; a function is called
    with what is being done and how much of it is.
    seed: of the draws that measure chance; drawn when not given, and kept in the result.
    allow_code: parts of other packages may be loaded, where the rig has a system, and the rig's own effects (docs/security.md).
    anyway: go on where the logs of a drive and its rig contradict each other (docs/rig.md); else that is a DataError.
    max_time: of wall time for all of it, s; then it ends with TimeUp. What was fitted until then, or until Ctrl-C, is kept in
    `out`, and the same call goes on with it, to the same bits.
    isolate: every FMU of the rig's system runs in a process of its own with limits and without rights (docs/security.md).
    """
    from .answered import answer

    rig, logs, test = asked(rig, allow_code, isolate), several(logs), several(test)
    with (
        claimed(out, "diagnosis", "diagnosis.json") as folder,
        _keeping("The diagnosis", folder, rig, files(rig, logs, test), seed, max_time, progress) as (kept, tell, _),
    ):
        seed = kept.seed if kept else secrets.randbits(32) if seed is None else seed
        with laws(rig):
            result = answer(rig, logs, test, folder, tell, seed, anyway, kept)
        if kept:
            kept.forget()
        return result


@contextmanager
def _keeping(
    what: str,
    folder: Path | None,
    rig: Rig,
    read: Sequence[Path],
    seed: int | None,
    max_time: float | None,
    progress: bool | Callable[[str, float], None],
) -> Iterator[tuple[Kept | None, Tell, Stops]]:
    """Where fits are kept while `what` is at work, for who forgets them at its end; how it is told that it was stopped.

    And what tells progress, which also ends the work where what should have done so got lost on its way.
    """
    from .search.kept import FOLDER, Kept

    stops = Stops(max_time)
    kept = None if folder is None else Kept.of(folder, asdict(replace(rig, isolate=False)), read, seed)  # it changes no number
    try:
        with stops, shown(progress) as tell:

            def heeding(doing: str, share: float) -> None:
                stops.obey()
                tell(doing, share)

            yield kept, heeding, stops
    except BaseException as error:
        # what reads a file in C may meet the interrupt, and tell of a damaged file in its place
        if not (stops.asked or isinstance(error, KeyboardInterrupt)):
            if kept and not kept.count:
                kept.forget()
            raise
        why = "nothing is kept"
        if kept and folder and not kept.folder.exists():
            why = f"its answer is whole, in {folder}"
        elif kept and folder:
            why = f"{kept.count} fits are kept in {folder / FOLDER}, and the same command goes on with them"
        raise stops.error(what, why) from None


@_narrow
def plan(
    diagnosis: str | Path,
    limits: Mapping[str, str | float] | None = None,
    out: str | Path | None = "out/plan",
    rig: str | Path | None = None,
    progress: bool | Callable[[str, float], None] = False,
    seed: int = 0,
    allow_code: bool = False,
) -> NextRun | NextInputs:
    """The run to record next: set-points, or inputs, that tell apart the models between which a diagnosis or a naming did not decide.

    diagnosis: the folder that `diagnose`, or `name`, wrote to. rig: where its rig lies now, where it was moved.
    limits: of the output side, SI: angle ("low:high"), speed, acceleration, voltage, current, duration; as far as the logs went
    where not given. Of a naming's: a column's variable ("low:high", as the rig reads it) and duration.
    out: folder for plan.csv (the set-points, in the rig's own columns), report.html and plan.json; None writes nothing.

    Raises DataError where nothing is open, or rig and logs describe no loop.
    """
    from .planning.page import write
    from .planning.run import opened, plan_run

    folder, out = Path(diagnosis), Path(out) if out else None
    if (folder / "naming.json").is_file() and not (folder / "diagnosis.json").is_file():
        return _plan_system(folder, limits or {}, out, Path(rig) if rig else None, progress, seed, allow_code)
    told, found = opened(folder, Path(rig) if rig else None)
    found = asked(found, allow_code)
    with laws(found), shown(progress) as tell, tidied(out):
        result = plan_run(folder, told, found, limits or {}, out, seed, tell)
        if out is not None:
            write(result, out)
        return result


def _plan_system(
    folder: Path,
    limits: Mapping[str, str | float],
    out: Path | None,
    rig: Path | None,
    progress: bool | Callable[[str, float], None],
    seed: int,
    allow_code: bool,
) -> NextInputs:
    from .naming.plan import plan_system, read

    told, models = read(folder)
    path = rig or folder / told["sources"]["rig"]
    if not path.exists():
        raise DataError(f"{path}: the rig of this naming is not there any more. Give it: --rig.")
    with shown(progress) as tell, tidied(out):
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)  # a place that cannot be used is told before the work, not after it
        result = plan_system(folder, told, models, asked(path, allow_code), limits, seed, tell)
        if out is not None:
            result.write(out)
        return result


@_narrow
def calibrate(
    rig: str | Path | Rig,
    logs: str | Path | Sequence[str | Path],
    test: Sequence[str | Path] = (),
    out: str | Path | None = "out/calibrate",
    progress: bool | Callable[[str, float], None] = False,
    starts: int | None = None,
    seed: int = 0,
    allow_code: bool = False,
    max_time: float | None = None,
    spread: Spread | None = None,
    isolate: bool = False,
) -> Calibration:
    """Fit the numbers that `rig` names under [calibrate] and [uncertain] to `logs`; the error is told on `test` or held-out blocks.

    rig: of any system of FMI 2.0 co-simulation FMUs: a system file, an SSP, one FMU (docs/calibrate.md).
    out: folder for calibration.json, report.html, parameters.toml and the system with the fitted values; None writes nothing.
    progress: as of `diagnose`.
    starts: fits from so many places, the first from the values given; as many as the rules say when not given.
    seed: of the other places.
    allow_code: parts of other packages may be loaded (docs/security.md).
    max_time: of wall time for all of it, s, as of `diagnose`: what was fitted is kept in `out`, and the same call goes on with it.
    spread: where the fits from the starts are made, as spread(function, items, context); here, one by one, when not given.
    isolate: every FMU runs in a process of its own with limits and without rights (docs/security.md); slower, to the same bits.

    Raises DataError where rig or logs cannot carry a calibration, DescriptionError where the system is wrong.
    """
    from .calibration.run import calibrate_system, here

    rig, logs, test = asked(rig, allow_code, isolate), several(logs), several(test)
    with (
        claimed(out, "calibration", "calibration.json") as folder,
        _keeping("The calibration", folder, rig, files(rig, logs, test), seed, max_time, progress) as (kept, tell, _),
    ):
        result = calibrate_system(rig, logs, test, folder, tell, starts, seed, spread or here, kept)
        if kept:
            kept.forget()
        return result


@_narrow
def name(
    rig: str | Path | Rig,
    logs: str | Path | Sequence[str | Path],
    test: Sequence[str | Path] = (),
    out: str | Path | None = "out/naming",
    progress: bool | Callable[[str, float], None] = False,
    starts: int = 2,
    seed: int = 0,
    kinds: Sequence[str] | None = None,
    allow_code: bool = False,
    max_time: float | None = None,
    isolate: bool = False,
) -> Naming:
    """Name what the system of `rig` lacks beside `logs`: a number, a path, an event, a law, a curve, or nothing (docs/name.md).

    rig: of any system of FMI 2.0 co-simulation FMUs, as for `calibrate`; what it names under [calibrate] and [uncertain] is
    fitted in all rivals.
    out: folder for naming.json, report.html, the correction's FMU and the extended system; None writes nothing.
    starts: fits of the base from so many places. seed: of these places, and of the draws that measure chance.
    kinds: what is held against the base: "parameter", "path", "event", "law"; all when not said.
    progress, allow_code, isolate: as of `calibrate`.
    max_time: of wall time for all of it, s. After four fifths of it nothing more is looked at, and the best of what was fitted by
    then is the answer (`stopped`); the same call with more time goes on. Where one step of the search takes longer it is
    interrupted when the time is up, and the answer comes a little later. TimeUp where not even the logs were simulated once.

    Raises DataError where rig or logs cannot carry it, DescriptionError where the system is wrong.
    """
    from .naming.guesses import KINDS
    from .naming.limit import Limit
    from .naming.run import name_system

    rig, logs, test = asked(rig, allow_code, isolate), several(logs), several(test)
    kinds = KINDS if kinds is None else tuple(kinds)
    with (
        claimed(out, "naming", "naming.json") as folder,
        _keeping("The naming", folder, rig, files(rig, logs, test), seed, max_time, progress) as (kept, tell, stops),
    ):
        began = monotonic()
        limit = Limit(lambda: max_time is not None and monotonic() - began > RULES.naming.enough * max_time, stops)
        result = name_system(rig, logs, test, folder, tell, starts, seed, kinds, kept, limit)
        if kept and not result.stopped:
            kept.forget()
        return result


def track(folders: str | Path | Sequence[str | Path], page: str | Path | None = "track.html", since: str = "") -> Track:
    """What diagnoses say of each number of each unit over time, and which of them change beyond chance (docs/track.md).

    folders: of `diagnose`, of `diagnose_fleet`, or above such. page: the page to write, with a table beside it; None writes nothing.
    since: a date, ISO 8601; what was recorded before it is left out, as after a repair.

    Raises DataError where no diagnosis is found, or one does not say when its logs were recorded.
    """
    from selflock.view import checked

    from .tracking.changes import changes
    from .tracking.page import write
    from .tracking.series import read, series_of
    from .tracking.track import Track

    given = [folders] if isinstance(folders, (str, Path)) else list(folders)
    path = checked(Path(page)) if page else None
    diagnoses = read(given, since)
    found = Track(diagnoses, changes(series_of(diagnoses.values)))
    if path:
        write(found, path)
    return found
