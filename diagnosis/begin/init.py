"""`selflock rig init`: a guess at what a log is, written as a rig file, and held against the log at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from selflock.fmus.shown import visible

from ..data.gathered import gathered, several
from ..data.rig import load
from ..data.sanity import box
from ..errors import DataError
from ..residuals.drive_experiment import DriveExperiment
from ..rules import RULES
from . import write
from .guess import LogGuess
from .place import place
from .raw import MOST_LISTED, SECONDS, UNSURE, read

GIVEN = {"motor.voltage", "motor.duty", "controller.voltage"}
TORQUES = {"motor.torque", "motor.current", "reducer.input_torque", "reducer.output_torque"}
EXAMPLE = ("time [ms]", "goal angle [deg]", "load angle [deg]", "motor voltage [V]", "motor current [A]")
MOVES = {"reducer.input_angle", "reducer.input_speed", "load.angle", "load.speed"}


@dataclass
class Begun:
    """What `rig_init` returns."""

    path: Path
    guess: LogGuess
    kind: str  # inverse | forward | steady; "" of what is no drive
    why: str
    compares: list[str] = field(default_factory=list)  # what a replay will compare
    lacks: str = ""  # why it would compare nothing yet
    remarks: list[str] = field(default_factory=list)  # of the log, held against the rig

    def summary(self) -> str:
        """A table of what was taken for what, how sure, and what to do next."""
        rows = [tuple(" ".join(visible(cell).split()) for cell in row) for row in write.table(self.guess)]
        names, places = (min(36, max((len(row[k]) for row in rows), default=0)) for k in (0, 1))
        lines = [f"{'column':{names}}  {'taken as':{places}}  how sure  why"]
        for name, placed, sure, why in rows:
            short = name if len(name) <= names else name[: names - 1] + "…"
            lines.append(f"{short:{names}}  {placed:{places}}  {sure:8}  {why if len(why) <= 110 else why[:109] + '…'}".rstrip())
        lines += [f"kind {self.kind}: {self.why}" if self.kind else f"no drive: {self.why}"]
        lines += [f"note: {visible(note)}" for note in self.guess.notes + self.guess.raw.notes]
        lines += [f"note: {remark}" for remark in self.remarks]
        if self.compares:
            lines.append(f"A replay will compare {', '.join(self.compares)}.")
        if self.lacks:
            lines.append(f"It lacks: {self.lacks}")
        if not self.kind:
            lines.append(f"Written to {self.path}.")
            return "\n".join(lines)
        log = self.guess.raw.paths[0]
        lines.append(f"Written to {self.path}: look at what is unsure and give what the data sheets say, then")
        lines.append(f"  selflock replay {self.path} {log}")
        return "\n".join(lines)


def rig_init(
    logs: str | Path | Sequence[str | Path], out: str | Path = "rig.toml", only: str = "", columns: str | Sequence[str] = ()
) -> Begun:
    """Guess what the columns of raw logs are, and write a rig to begin with. Nothing is asked, and nothing overwritten.

    logs: of one drive, with the same columns. out: the rig file. only: of a log that holds several drives, the one whose
    columns have this in their names. columns: what these are, in their order and with their units, as "load angle [deg]", of a
    log that does not say it; "-" for one that does not matter; in one text, with commas between, too.

    Raises DataError where a log cannot be read, where `out` is there already, or where neither names nor numbers tell of a motion.
    """
    out, logs = Path(out), several(logs)
    columns = columns.split(",") if isinstance(columns, str) and columns else columns
    if not logs:
        raise DataError("give at least one log: selflock rig init LOG -o rig.toml.")
    if out.exists():
        raise DataError(f"{out}: is there already, and is not overwritten. Name another file with -o.")
    guess = place(read(logs, columns), only)
    kind, why = _kind(guess)
    if guess.raw.nameless:
        _nameless(guess, kind, out)
    if guess.raw.clock.guessed:
        _timed(guess, kind)
    begun = Begun(out, guess, kind, why)
    out.parent.mkdir(parents=True, exist_ok=True)
    text = write.text(guess, kind, why, out)
    with out.open("x", encoding="utf-8") as file:
        file.write(text)
    _look(begun, Path(logs[0]))
    return begun


def _nameless(guess: LogGuess, kind: str, out: Path) -> None:
    """Of a log without a line of names: a note how to say what its columns are, or DataError where their numbers tell nothing."""
    raw = guess.raw
    columns = [raw.clock.column] * bool(raw.clock.column) + list(raw.columns.values) + list(raw.texts)
    names = [EXAMPLE[k] if k < len(EXAMPLE) else "-" for k in range(len(columns))]
    command = f"selflock rig init {' '.join(str(path) for path in raw.paths)} -o {out} --columns {', '.join(names)!r}"
    say = f"say what they are, in their order, with their units and - for what does not matter, as {command}"
    text = "has no line with the names of its columns"
    if kind:
        guess.notes.append(f"the log {text}, and their numbers are all that tells them apart: {say}")
        return
    spans = (
        ", ".join(f"{name} ({looks.partition(';')[0]})" for name, looks in list(guess.left.items())[:MOST_LISTED])
        or "its columns"
    )
    clock = f"; the time is column {raw.clock.column}, by its steps" if raw.clock.column else ""
    raise DataError(
        f"{raw.paths[0]}: {text}, and the numbers of {spans} do not tell a drive's motion{clock}. Nothing is written: {say}."
    )


def _timed(guess: LogGuess, kind: str) -> None:
    """A time whose unit its steps alone tell: said, where another is as plausible. Of what is no drive s are taken, as of any log."""
    clock, time = guess.raw.clock, guess.raw.columns.time
    steps = np.concatenate([np.diff(time[part]) for part in guess.raw.columns.parts]) / clock.factor
    step = float(np.median(steps[steps > 0.0]))
    lasts = float(np.sum(steps))
    if not kind:
        other, clock.unit, clock.factor, clock.sure = clock.unit, "s", 1.0, UNSURE
        clock.why = f"steps of {step:.3g}; nobody says its unit, which is s where none is said"
    else:
        other = {"s": "ms", "ms": "s", "us": "ms", "ns": "us"}[clock.unit]
        if step * SECONDS[other] > RULES.begin.slowest_rows:
            return
    last, else_ = (f"{SECONDS[unit] * lasts:.3g} s" for unit in (clock.unit, other))
    guess.notes.append(
        f"nobody says the unit of the time, column {clock.column!r}: {clock.unit} was taken, so that the log lasts {last} with a row every "
        f'{SECONDS[clock.unit] * step:.3g} s; if it lasts {else_}, write unit = "{other}" under [time]'
    )


def _kind(guess: LogGuess) -> tuple[str, str]:
    """Which kind of measurement it is, and by what."""
    seen = {signal for signal, one in guess.taken.items() if not one.lacks} or set(guess.taken)
    seen |= {signal for signal, one in guess.taken.items() if one.lacks and (signal in TORQUES | GIVEN or not seen & MOVES)}
    if not seen & MOVES:
        return "", "no column is the motion of a drive; [columns] says what each looks like"
    driven = sorted(seen & TORQUES)
    if _steady(guess) and driven:
        return "steady", "runs at constant speed" if guess.raw.run else "rows are points at constant speed"
    if given := sorted(seen & GIVEN):
        return "forward", f"{given[0]} in, motion{' and current' if 'motor.current' in seen else ''} out"
    if driven:
        return "inverse", f"a motion, and {driven[0]} that it took"
    if "controller.angle_setpoint" in seen:
        return "forward", "set-points in, motion out; neither voltage, current nor torque is placed"
    return "inverse", "a motion; nothing that drives it is placed"


def _steady(guess: LogGuess) -> bool:
    """Whether each run has one speed, or each row is a point of its own."""
    raw, rules = guess.raw, RULES.data
    speed = next((guess.taken[s].column for s in ("reducer.input_speed", "load.speed") if s in guess.taken), "")
    if not speed:
        return False
    x = raw.columns.values[speed]
    if raw.run and len(raw.columns.parts) >= 4:
        size = float(np.sqrt(np.nanmean(x * x)))
        within = [float(np.nanstd(x[part])) for part in raw.columns.parts if part.stop - part.start > 2]
        ends = [abs(float(np.nanmean(x[part]))) for part in raw.columns.parts]
        return (
            bool(within)
            and float(np.median(within)) < rules.unsteady * size
            and float(np.median(within)) < 0.5 * float(np.median(ends))
        )
    return not raw.clock.column and not raw.clock.step and len(x) <= 1000 and not raw.run


def _look(begun: Begun, log: Path) -> None:
    """Load what was written and hold it against the log, as a replay will."""
    if not begun.kind:
        begun.lacks = (
            "the motion of a drive. For a system of FMUs give system = ..., and its variables under [columns] (docs/rig.md)."
        )
        return
    clock = begun.guess.raw.clock
    if not clock.column and not clock.step and begun.kind != "steady":
        begun.lacks = "the time: no column has it. Give step = ... (s between rows) under [time]."
        return
    held = [f"{one.lacks} of column {one.column!r} ({signal})" for signal, one in begun.guess.taken.items() if one.lacks]
    if held:
        begun.lacks = f"{', '.join(held)}: give it under [columns], and take away the # before it."
    try:
        rig = load(begun.path)
        runs, _ = gathered(log, rig)
        begun.compares = [f"{residual.output} ({residual.name})" for residual in DriveExperiment(rig, runs).residuals]
        found, signals = box(rig, runs), {*runs[0].signals, "time"}
        begun.remarks = [f.sentence for f in found.findings if all(name in signals for name in f.about)]
    except DataError as error:
        begun.lacks = begun.lacks or str(error).removeprefix(f"{begun.path}: ")
    if begun.compares and not held and not (begun.guess.ratio and begun.guess.firm):
        why = "hangs on a unit that nobody says" if begun.guess.ratio else "this log does not tell"
        begun.lacks = f"reducer.gear_ratio, which {why}: the data sheet has it."
