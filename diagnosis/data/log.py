"""Logs: tables (table.py) read into runs of signals in SI units. Faults are marked elsewhere (check)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pyarrow import Table, csv

from ..errors import DataError
from ..rules import RULES
from .plain import NumberTable, arrow
from .rig import SHARES, LogColumn, Rig, split, suggest
from .signals import ALIASES, SIGNALS, canonical, unit
from .table import table as read_table
from .units import agree, conversion, is_unit

if TYPE_CHECKING:
    import pandas as pd

VALID = "rig.valid"
"""The signal of the rig's `valid` column."""

HELD = ("controller.voltage", "motor.voltage", "motor.duty")
"""In a table of `selflock run` a row has the command of the step that ends there; here that of the step that begins."""


@dataclass
class MeasuredRun:
    """One stretch of measurement: signals on one time axis. `good` is False where a channel is not to be trusted."""

    log: str
    name: str
    rows: np.ndarray  # row of each sample in the file, 0 is the first after the header
    time: np.ndarray  # s, strictly increasing
    signals: dict[str, np.ndarray]
    good: dict[str, np.ndarray] = field(default_factory=dict)
    repeated: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # rows left out: no time, or the time before again
    source: str = ""  # path of the log: two logs may have one name
    began: str = ""  # when its first row was recorded, by the log's own time stamps (ISO 8601); "" where these tell no date
    within: tuple[MeasuredRun, np.ndarray] | None = None  # the run of which this is some samples, and which
    memory: dict = field(default_factory=dict, init=False, repr=False)  # what was derived from the signals, for all who look

    def __len__(self) -> int:
        return len(self.time)

    @property
    def key(self) -> str:
        """What tells this run from all others."""
        return f"{self.source or self.log}:{self.name}"

    @property
    def behind_gaps(self) -> np.ndarray:
        """Samples before which others are missing, bool."""
        steps = np.diff(self.time)
        return np.append(
            np.zeros(min(1, len(self)), bool), steps > RULES.data.gap * np.median(steps) if len(steps) else steps > 0.0
        )

    @property
    def uneven(self) -> float:
        """Share of steps that differ from the usual one by more than half; beyond `most_uneven` a clock is irregular."""
        if len(self) < 2:
            return 0.0
        steps = np.diff(self.time)
        usual = np.median(steps)
        return float(np.mean(abs(steps - usual) > RULES.data.uneven * usual))

    def head(self, samples: int) -> MeasuredRun:
        """The first samples, as a run of its own."""
        signals, good = ({name: x[:samples] for name, x in which.items()} for which in (self.signals, self.good))
        return MeasuredRun(self.log, self.name, self.rows[:samples], self.time[:samples], signals, good, source=self.source)

    def picked(self, samples: np.ndarray) -> MeasuredRun:
        """These samples, in their order, as a run that knows where it is from: what lies between them is not lost."""
        signals, good = ({name: x[samples] for name, x in which.items()} for which in (self.signals, self.good))
        within = self, samples
        return MeasuredRun(
            self.log, self.name, self.rows[samples], self.time[samples], signals, good, source=self.source, within=within
        )

    def usable(self, *names: str) -> np.ndarray:
        """Samples at which all these channels can be trusted."""
        mask = np.ones(len(self), bool)
        for name in names:
            if name in self.good:
                mask &= self.good[name]
        return mask


def read(path: str | Path, rig: Rig) -> list[MeasuredRun]:
    """The runs of a log. DataError names file, line or column, and what to do."""
    path = Path(path)
    table = read_table(path, plain=not rig.run)
    if table.empty or not len(table.columns):
        raise DataError(
            f"{path}: is empty. Export the log again; it needs a header line and at least {RULES.data.shortest_log} samples."
        )
    named = _named(path, table, rig) if rig.named else []
    columns = list(rig.columns) + named
    data: dict[str, np.ndarray] = {}
    turns: dict[str, float] = {}
    for column in columns:
        if column.value is not None:
            data[column.signal] = _si(path, np.full(len(table), column.value), "", column, rig)
            continue
        header = _find(path, table, column.column, rig)
        data[column.signal] = _possible(_si(path, _numbers(path, table, header), header, column, rig))
        if column.wraps:
            turns[column.signal] = float(
                column.wraps * np.diff(_si(path, np.arange(2.0), header, replace(column, wraps=0.0), rig))[0]
            )
    time, began = _time(path, table, rig), _began(table, rig)
    if rig.valid:
        data[VALID] = (_numbers(path, table, _find(path, table, rig.valid, rig)) != 0.0).astype(float)
    names = _run_names(path, table, rig)
    runs = []
    late = [
        column.signal
        for column in columns
        if column.late or (column in named and column.signal.endswith(HELD) and not rig.system)
    ]
    for name in dict.fromkeys(names.tolist()):
        rows = np.flatnonzero(names == name)
        for signal in late:
            data[signal][rows] = np.append(data[signal][rows[1:]], data[signal][rows[-1]])
        mine = data if len(rows) == len(time) else {k: v[rows] for k, v in data.items()}  # an hour is not copied
        signals = _in_one_turn(mine, turns, rig)
        run = MeasuredRun(path.name, str(name), rows, time[rows], signals, source=str(path.resolve()), began=began)
        runs.append(_trimmed(path, _ordered(path, run, rig, _line(table, 0)), rig))
    points = rig.kind == "steady" and not rig.run
    least = RULES.data.fewest_points if points else RULES.data.shortest_log
    if sum(len(run) for run in runs) < least:
        what, better = ("points", "in both directions") if points else ("samples", "better some seconds")
        raise DataError(f"{path}: has {len(table)} {what}, too few to tell anything. Give a log of at least {least}, {better}.")
    return runs


def _in_one_turn(signals: dict[str, np.ndarray], turns: dict[str, float], rig: Rig) -> dict[str, np.ndarray]:
    """Signals of a run with an angle that begins anew in the turn of its set-point: which turn it was the log does not say.

    A drive that moves may be turns behind; how far its controller's voltage tells, where that and the gain are known.
    turns: of signals that begin anew, what they go through until then, in SI.
    """
    found = dict(signals)
    for prefix in rig.drives:
        angle, wanted = prefix + "load.angle", prefix + "controller.angle_setpoint"
        moved = angle if angle in turns else wanted
        if angle in signals and wanted in signals and (turn := turns.get(moved, 0.0)):
            off = signals[angle] - signals[wanted]
            gain = rig.parameters.get(prefix + "controller.angle_gain", 0.0)
            volts = next((signals[prefix + v] for v in ("controller.voltage", "motor.voltage") if prefix + v in signals), None)
            off = off if volts is None or gain <= 0.0 else off + volts / gain
            known = off[np.isfinite(off)]
            whole = turn * np.round((np.median(known) if len(known) else 0.0) / turn)
            found[moved] = signals[moved] - (whole if moved == angle else -whole)
    return found


def _parts(header: str) -> tuple[str, str]:
    """'rear_motor.current [A]' as name and unit; in brackets whatever it is, in parentheses where it is known as one."""
    found = re.fullmatch(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))\s*", str(header))
    if found is None or (found[3] is not None and not is_unit(found[3].strip())):
        return str(header).strip(), ""
    return found[1].strip(), (found[2] if found[3] is None else found[3]).strip()


def _bare(header: str) -> str:
    return _parts(header)[0]


def _named(path: Path, table: pd.DataFrame | NumberTable, rig: Rig) -> list[LogColumn]:
    """The columns that are called as what they hold; what is called as nothing is left out, unless it seems misspelt."""
    taken = {column.signal for column in rig.columns}
    found, other = [], []
    for name, said in map(_parts, table.columns):
        prefix, bare = split(name.removeprefix(rig.alone), rig.drives)
        if not name.startswith(rig.alone) or "." not in name:
            continue
        signal = name if rig.system else prefix + canonical(bare)
        if canonical(bare) not in SIGNALS and signal not in rig.units:
            other.append((name, said, prefix, bare))
        elif signal not in taken:
            taken.add(signal)
            found.append(LogColumn(name, signal))
    for name, said, prefix, bare in other if not rig.system else ():
        near = get_close_matches(bare.lower(), [*SIGNALS, *ALIASES], 1, RULES.data.like_name)
        meant = canonical(near[0]) if near else ""
        as_unit = not is_unit(said) or _converts(said, unit(meant, rig.linear))  # else it is another quantity
        if meant and prefix + meant not in taken and as_unit:
            raise DataError(
                f"{path}: column {name!r} is no variable of the drive. Did you mean {rig.alone + prefix + meant!r}? "
                f"If it is another quantity, give it another name{'' if said else ', or its unit in brackets behind it'}."
            )
    return found


def _converts(said: str, wanted: str) -> bool:
    """Whether a number of the one unit can be one of the other."""
    try:
        conversion(said, wanted)
    except ValueError:
        return False
    return True


def _find(path: Path, table: pd.DataFrame | NumberTable, name: str, rig: Rig) -> str:
    """The header of a column, by its whole text or without its unit."""
    headers = [str(header) for header in table.columns]
    if name in headers:
        return table.columns[headers.index(name)]
    found = [header for header in table.columns if _bare(header) == _bare(name)]
    if len(found) > 1:
        raise DataError(
            f"{path}: {' and '.join(map(repr, found))} are both {name!r}. Write the one that is meant in {rig.path.name}, with its unit."
        )
    if found:
        return found[0]
    shorter = table.attrs.get("left out", {})
    if name in shorter:
        raise DataError(
            f"{path}: {name!r} has {shorter[name]} samples where others have {len(table)}. Save vectors of one length."
        )
    raise DataError(f"{path}: there is no column {name!r}, which {rig.path.name} asks for.{suggest(name, headers)}")


def _run_names(path: Path, table: pd.DataFrame | NumberTable, rig: Rig) -> np.ndarray:
    """The name of the run that each row is of; "" where there is one run."""
    if not rig.run or isinstance(table, NumberTable):
        return np.full(len(table), "")
    if rig.kind == "steady" and _bare(rig.run) not in [_bare(header) for header in table.columns]:
        raise DataError(
            f"{path}: there is no column {rig.run!r}, which tells the points of {rig.path.name} apart. If this log is a motion, points at constant "
            f'speed cannot be judged by it: copy {rig.path.name} with kind = "inverse" and without run, with the parameters that were found, and '
            f"selflock replay that on {path.name}."
        )
    header = _find(path, table, rig.run, rig)
    if (empty := np.flatnonzero(table[header].isna() | (table[header].astype(str).str.strip() == ""))).size:
        raise DataError(
            f"{path}: line {_line(table, empty[0])}, column {header!r} is empty, and in {empty.size} lines in all: it tells runs apart. "
            "Write in each line of which run it is, or leave such lines out."
        )
    return table[header].astype(str).to_numpy()


def _line(table: pd.DataFrame | NumberTable, row: int) -> int:
    """The line of the file that a row was, below a header of one line where nothing else is known."""
    return table.attrs.get("first line", 2) + row


def _numbers(path: Path, table: pd.DataFrame | NumberTable, header: str) -> np.ndarray:
    values = table[header]
    if isinstance(values, np.ndarray) or values.dtype.kind in "fiub":
        return np.asarray(values, float)
    import pandas as pd

    if values.dtype.kind in "mM":
        raise DataError(f"{path}: column {header!r} holds dates or times ({values.dtype}), not numbers.")
    try:
        numbers = pd.to_numeric(values, errors="coerce")
    except OverflowError:
        raise DataError(f"{path}: column {header!r} holds a whole number of hundreds of digits.") from None
    wrong = numbers.isna() & values.notna() & ~values.astype(str).str.strip().str.lower().isin(["nan", "inf", "-inf", "", "none"])
    if wrong.any():
        row = int(np.flatnonzero(wrong.to_numpy())[0])
        raise DataError(
            f"{path}: line {_line(table, row)}, column {header!r}: {values.iloc[row]!r} is not a number. "
            "Mend or remove that line; a decimal point is '.'."
        )
    return numbers.to_numpy(float)


def _si(path: Path, values: np.ndarray, header: str, column: LogColumn, rig: Rig) -> np.ndarray:
    _, bare = split(column.signal, rig.drives)
    wanted = rig.units.get(column.signal, "") if rig.system else unit(bare, rig.linear)
    if column.wraps:
        values = _unwrapped(values, column.wraps)
    if column.nominal:
        return column.factor * column.nominal * values * _share(path, header, column, rig) + column.offset
    factor, offset = _conversion(path, header, column, wanted, rig)
    return column.factor * (factor * values + offset) + column.offset


def _possible(values: np.ndarray) -> np.ndarray:
    """Numbers whose square is beyond any double are no measurement: not finite, as those that are beyond any themselves."""
    return np.where(np.abs(values) < np.sqrt(np.finfo(float).max), values, np.nan)


def _unwrapped(values: np.ndarray, period: float) -> np.ndarray:
    """An angle that begins anew at its period, as one that goes on."""
    good = np.isfinite(values)
    found = values.copy()
    found[good] = np.unwrap(values[good], period=period)
    return found


def _share(path: Path, header: str, column: LogColumn, rig: Rig) -> float:
    """What 1 of a column is of its nominal value: its unit says whether it is in %, in per mille or a number."""
    said = column.unit or _parts(header)[1] or "1"
    if said not in SHARES:
        raise DataError(
            f"{path}: column {column.column!r} is in {said}, and nominal = {column.nominal:g} in {rig.path.name} says what 100 % is: "
            f"leave nominal out, or write unit = {' or '.join(map(repr, SHARES))}."
        )
    return SHARES[said]


def _conversion(path: Path, header: str, column: LogColumn, wanted: str, rig: Rig) -> tuple[float, float]:
    """To the wanted unit from the rig's or the header's, which must not contradict each other."""
    said = _parts(header)[1]
    if not column.unit and abs(column.factor) != 1.0 and not is_unit(said) and said not in SHARES:
        return 1.0, 0.0  # counts, increments: the factor says what one of them is
    if (column.unit or said) in SHARES and wanted not in ("", "1"):
        raise DataError(
            f"{path}: column {column.column!r} is in {column.unit or said}: say in {rig.path.name} what 100 % is, "
            f"as nominal = ... in {wanted} (of a motor its nominal torque or current)."
        )
    try:
        factor, offset = conversion(column.unit or said, wanted)
    except ValueError as error:
        mend = f"Write the unit of the values in {rig.path.name}, or as factor what one of it is in {wanted}"
        raise DataError(f"{path}: column {column.column!r}: {error}. {mend}.") from None
    if column.unit and is_unit(said) and not agree(said, column.unit, wanted):
        raise DataError(
            f"{path}: the header {header!r} contradicts the unit {column.unit!r} in {rig.path.name}. Mend one of them."
        )
    return factor, offset


def _time(path: Path, table: pd.DataFrame | NumberTable, rig: Rig) -> np.ndarray:
    clock, headers = rig.time, [_bare(header) for header in table.columns]
    if rig.rows.step and (not clock.column or _bare(clock.column) not in headers):
        return rig.rows.step * np.arange(len(table))
    if rig.kind == "steady" and _bare(clock.column) not in headers:
        return np.arange(len(table), dtype=float)
    if clock.column == "time" and "time" not in headers:
        raise DataError(
            f"{path}: there is no column 'time'. Name the one that has it, [time] column = \"...\", or say how far rows are apart, "
            f"[time] step = 0.001 (s), in {rig.path.name}.{suggest('time', [str(h) for h in table.columns])}"
        )
    header = _find(path, table, clock.column, rig)
    values = table[header]
    if not isinstance(values, np.ndarray):
        from .stamps import stamps_of

        stamps = stamps_of(values)
        if stamps is not None:
            return stamps
    factor, _ = _conversion(path, header, clock, "s", rig)
    return factor * clock.factor * _numbers(path, table, header)


def _began(table: pd.DataFrame | NumberTable, rig: Rig) -> str:
    """When the first row was recorded, where the column of time tells a date."""
    header = next((header for header in table.columns if rig.time.column in (str(header), _bare(header))), None)
    if header is None or isinstance(table, NumberTable):
        return ""
    from .stamps import began

    return began(table[header])


def _ordered(path: Path, run: MeasuredRun, rig: Rig, first: int) -> MeasuredRun:
    """Refuse time that runs backward; drop samples without a time or at the same time again (check reports them).

    first: the line of the file that row 0 was.
    """
    where = f"{path}: run {run.name!r}, " if run.name else f"{path}: "
    finite = np.isfinite(run.time)
    if finite.sum() < 2 and rig.kind != "steady":
        raise DataError(
            f"{where}column {rig.time.column!r} has fewer than two times. "
            'Rows that are points of steady state belong to a rig of kind = "steady".'
        )
    steps = np.diff(run.time[finite])
    if rig.rows.spread and finite.all() and rig.kind != "steady" and len(steps) and not np.any(steps < 0.0):
        run = replace(run, time=spread_out(run.time))
        steps = np.diff(run.time)
    if len(steps) and np.mean(steps == 0.0) > RULES.data.same_times and finite.all():
        again = _written_again(run)  # of a recorder that was faster than what it read
        if np.mean(again) > RULES.data.same_times:
            run = _of_rows(run, ~again)
            finite, steps = finite[~again], np.diff(run.time)
    if rig.kind != "steady" and len(steps) and np.mean(steps == 0.0) > RULES.data.same_times:
        raise DataError(
            f"{where}column {rig.time.column!r} has only {len(np.unique(run.time[finite]))} different times in "
            f"{len(run)} rows. Export it with more digits; or, if rows are evenly apart, write spread = true under [time] in {rig.path.name}."
        )
    if np.any(steps < 0):
        row = int(run.rows[finite][np.flatnonzero(steps < 0)[0] + 1])
        hint = "" if rig.run else ' If the file holds several runs, name the column that tells them apart: [rig] run = "...".'
        raise DataError(f"{where}line {first + row}: time runs backward in column {rig.time.column!r}.{hint}")
    keep = finite.copy()
    keep[np.flatnonzero(finite)[1:][steps == 0]] = False
    if keep.all():
        return run
    return replace(_of_rows(run, keep), repeated=run.rows[~keep])


def spread_out(time: np.ndarray) -> np.ndarray:
    """Times that were written too coarsely, evenly between the first and the last of them."""
    firsts = np.flatnonzero(np.append(True, np.diff(time) > 0.0))
    if len(firsts) < 2:
        return time
    place = np.arange(len(time), dtype=float)
    step = (time[firsts[-1]] - time[firsts[0]]) / (firsts[-1] - firsts[0])
    even = time[0] + step * place
    coarse = float(np.median(np.diff(time[firsts])))
    if np.max(abs(even - time)) <= 2.0 * coarse:
        return even
    return np.interp(place, firsts, time[firsts], right=time[firsts[-1]]) + np.maximum(place - firsts[-1], 0.0) * step


def _written_again(run: MeasuredRun) -> np.ndarray:
    """Rows that repeat the time and every value of the row before."""
    same = np.append(False, np.diff(run.time) == 0.0)
    for x in run.signals.values():
        same[1:] &= (x[1:] == x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1]))
    return same


def _of_rows(run: MeasuredRun, keep: np.ndarray) -> MeasuredRun:
    return replace(run, rows=run.rows[keep], time=run.time[keep], signals={k: v[keep] for k, v in run.signals.items()})


def _trimmed(path: Path, run: MeasuredRun, rig: Rig) -> MeasuredRun:
    """The part of a run that the rig takes: [time] skip, from and to."""
    rows = rig.rows
    since = run.time - run.time[0] if len(run) else run.time
    keep = (np.arange(len(run)) >= rows.skip) & (since >= rows.first) & (since <= rows.last)
    if keep.all():
        return run
    if not keep.any():
        raise DataError(
            f"{path}: nothing is left of {f'run {run.name!r}' if run.name else 'it'} by skip, from and to under [time] in {rig.path.name}: "
            f"it has {len(run)} rows and lasts {np.ptp(run.time):.4g} s."
        )
    return _of_rows(run, keep)


def write_csv(table: pd.DataFrame | Mapping[str, np.ndarray], path: Path) -> None:
    """A table, or columns by their names, as text, in full precision, NaN as nothing; an hour of samples takes pandas a minute."""
    csv.write_csv(arrow(table) if isinstance(table, Mapping) else Table.from_pandas(table, preserve_index=False), path)
