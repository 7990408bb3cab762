"""A manoeuvre that anybody can write: set-points over time, as a table or as a list of turns (docs/system.md).

    [components.setpoints]
    manoeuvre = "moves.csv"

    time, ramp, rear_angle [deg], front_angle [deg]
    0,    0,    0,                0
    2,    0,    0,                0
    4,    0.1,  180,              0

A row says where the set-points are at its time. With a column `ramp` (s) they go there from the row before from rest to rest,
their speed rising and falling for so long (fmus/turn.py); without one, or with 0, on a straight line. Two rows of one time are a jump.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from ..fmus.turn import Turn
from . import toml
from .errors import DescriptionError
from .face import Part, Variable
from .files import read, seconds
from .system import did_you_mean
from .units import unit

MOVES = ({"rad": 1}, {"m": 1})  # an angle, a way: what has units of these has a derivative that is a set-point, too
SPOKEN = {"rev": "turn"}  # units that pint reads alone, and not in a quotient
TURN = {"from": "s, where the turn begins", "until": "s, where it ends", "to": "where it goes", "ramp": "s"}
TABLE = {"unit": str, "start": float, "ramp": float, "turns": list}


class Setpoint:
    """One set-point over time: a start, and turns one after the other."""

    def __init__(self, where: str, start: float, turns: Iterable[Turn]):
        self.turns = list(turns)
        for one, after in zip(self.turns, self.turns[1:]):
            if after.start < one.stop:
                raise DescriptionError(f"{where}: the turn from {after.start:g} s begins before that until {one.stop:g} s ends.")
        for turn in self.turns:
            if not all(map(math.isfinite, turn)) or turn.stop < turn.start or turn.ramp < 0.0:
                raise DescriptionError(
                    f"{where}: a turn from {turn.start:g} until {turn.stop:g} s with a ramp of {turn.ramp:g} s is none."
                )
            if turn.ramp > 0.5 * (turn.stop - turn.start) * (1.0 + 1e-9):
                raise DescriptionError(
                    f"{where}: a ramp of {turn.ramp:g} s is longer than half of the turn from {turn.start:g} until {turn.stop:g} s."
                )
        self.begins = [turn.start for turn in self.turns]
        self.places = list(accumulate((turn.angle for turn in self.turns), initial=start))

    def at(self, time: float) -> tuple[float, float]:
        """Set-point, and its derivative."""
        number = bisect_right(self.begins, time) - 1
        if number < 0:
            return self.places[0], 0.0
        if time >= self.turns[number].stop:
            return self.places[number + 1], 0.0
        moving = self.turns[number].at(time)
        return self.places[number] + moving.angle, moving.speed

    def ahead(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same at each of these times, to the bit: of all times of a steady speed at once, of those of ramps one by one."""
        number, places = np.searchsorted(self.begins, times, "right") - 1, np.array(self.places)
        found, speed = places[number + 1], np.zeros(len(times))  # where the turn that began last has ended
        for k in np.unique(number[number >= 0]).tolist():
            turn = self.turns[k]
            moving = np.flatnonzero((number == k) & (times < turn.stop))
            since, left = times[moving] - turn.start, turn.stop - times[moving]
            steady = (since > 0.0) & (since >= turn.ramp) & (left >= turn.ramp)
            if steady.any():
                top = turn.angle / (turn.stop - turn.start - turn.ramp)
                found[moving[steady]] = places[k] + top * (since[steady] - turn.ramp / 2)
                speed[moving[steady]] = top
            for i in moving[~steady].tolist():
                found[i], speed[i] = self.at(float(times[i]))
        return found, speed


class Manoeuvre(Part):
    """A part without inputs whose outputs are the columns of a file, and the speeds of those that are angles or ways."""

    can_roll_back = True
    tells_ahead = True

    def __init__(self, name: str, path: Path):
        self._courses, units = read_file(path, name)
        self._of: dict[str, tuple[Setpoint, int]] = {column: (course, 0) for column, course in self._courses.items()}
        described = [Variable(c, units[c], causality="output", depends_on=()) for c in self._courses]
        for column in self._courses:
            speed = f"{column.removesuffix('_angle')}_speed"
            known, per = unit(units[column]), f"{SPOKEN.get(units[column], units[column])}/s"
            if units[column] and known and known.exponents in MOVES and speed not in self._of:
                self._of[speed] = self._courses[column], 1
                described.append(Variable(speed, per, causality="output", depends_on=(), derivative_of=column))
                if column == "angle" and "speed" not in self._of:  # as the set-point of a drive is called; and not recorded twice
                    self._of["speed"] = self._of[speed]
                    described.append(Variable("speed", per, causality="local", depends_on=()))
        super().__init__(name, described)
        self._time = 0.0

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time = start

    def exit_initialization(self) -> None:
        self.read()

    def step(self, time: float, size: float) -> None:
        self._time = time + size

    def at(self, time: float) -> None:
        """y at this time."""
        for place, name in enumerate(self.outputs):
            course, which = self._of[name]
            self.y[place] = course.at(time)[which]

    def ahead(self, times: np.ndarray) -> np.ndarray:
        told = {course: course.ahead(times) for course in self._courses.values()}
        found = np.empty((len(times), len(self.outputs)))
        for place, name in enumerate(self.outputs):
            course, which = self._of[name]
            found[:, place] = told[course][which]
        return found

    def read(self) -> None:
        self.at(self._time)

    def get(self, name: str) -> float:
        self._told(name)
        course, which = self._of[name]
        return course.at(self._time)[which]

    def set(self, name: str, value: Any) -> None:
        raise DescriptionError(f"{self.name}.{name} is given by its manoeuvre; it cannot be set.")

    def reset(self) -> None:
        self._time = 0.0

    def save(self) -> float:
        return self._time

    def restore(self, state: float) -> None:
        self._time = state


def read_file(path: Path, component: str) -> tuple[dict[str, Setpoint], dict[str, str]]:
    """Courses and units by name. Raises DescriptionError, ResultError."""
    courses, units = _turns(path) if path.suffix.lower() == ".toml" else _table(path, component)
    for name in courses:
        if not name.isidentifier():
            raise DescriptionError(f"{path}: {name!r} is no name of a variable; write it with letters, digits and _ only.")
        if not units.get(name) and name.split("_")[-1] == "angle":
            how = f'unit = "deg" under [{name}]' if path.suffix.lower() == ".toml" else f"{name} [deg]"
            raise DescriptionError(f"{path}: nobody says the unit of {name}: write {how}, or rad, or turn.")
        if units.get(name) and name.split("_")[-1] == "angle" and unit(units[name]) is None:
            raise DescriptionError(f"{path}: nobody knows the unit {units[name]} of {name}: write deg, rad or turn.")
    if not courses:
        raise DescriptionError(f"{path}: holds no set-point. docs/system.md shows a manoeuvre.")
    return courses, units


def _table(path: Path, component: str) -> tuple[dict[str, Setpoint], dict[str, str]]:
    """Of a .csv or .parquet file; its columns may be called as a result has them, component.name: so a planned run's are."""
    frame, units = read(path, whole=True)
    called = {name: name.strip() for name in frame}
    for name, told in called.items():
        if (own := told.removeprefix(f"{component}.")) not in called.values():
            called[name] = own
    units = {called[name]: unit for name, unit in units.items()}
    frame = frame.rename(columns=called)
    if "time" not in frame or not len(frame):
        raise DescriptionError(f"{path}: a column `time` in s, columns of set-points, and rows are wanted here.")
    numbers, zeros = {}, [0.0] * len(frame)
    for name in frame:
        try:
            numbers[name] = [float(x) for x in frame[name]]
        except (TypeError, ValueError):
            numbers[name] = [math.nan]
        if not all(map(math.isfinite, numbers[name])):
            raise DescriptionError(f"{path}: column {name} holds what is no number.")
    time, ramps = ([seconds(path, units.get(name, "")) * x for x in numbers.pop(name, zeros)] for name in ("time", "ramp"))
    if any(after < before for before, after in zip(time, time[1:])):
        raise DescriptionError(f"{path}: its time falls. Sort the rows.")
    courses = {}
    for name, x in numbers.items():
        moves = [Turn(a, b, r if v != u else 0.0, v - u) for a, b, r, u, v in zip(time, time[1:], ramps[1:], x, x[1:])]
        courses[name] = Setpoint(f"{path}: {name}", x[0], moves)
    return courses, units


def _turns(path: Path) -> tuple[dict[str, Setpoint], dict[str, str]]:
    """Of a .toml file with a table for each set-point."""
    try:
        data = toml.read(path)
    except FileNotFoundError:
        raise DescriptionError(f"There is no manoeuvre {path}.") from None
    except (OSError, ValueError) as error:
        raise DescriptionError(f"{path} is not valid TOML: {error}.") from None
    courses, units = {}, {}
    for name, table in data.items():
        where = f"{path}: [{name}]"
        if not isinstance(table, dict):
            raise DescriptionError(f"{where}: a set-point is a table, [{name}], with {', '.join(TABLE)}.")
        _known(where, table, TABLE)
        units[name] = str(table.get("unit", ""))
        place = start = _number(where, table, "start", 0.0)
        usual, turns = _number(where, table, "ramp", 0.0), []
        given = table.get("turns", [])
        if not isinstance(given, list) or not all(isinstance(turn, dict) for turn in given):
            raise DescriptionError(f"{where} turns: write turns = [{{ from = 2.0, until = 4.0, to = 180.0 }}, ...].")
        for turn in given:
            _known(f"{where} turns", turn, TURN)
            begin, end, to = (_number(f"{where} turns", turn, key) for key in ("from", "until", "to"))
            turns.append(Turn(begin, end, _number(f"{where} turns", turn, "ramp", usual), to - place))
            place = to
        courses[name] = Setpoint(where, start, turns)
    return courses, units


def _known(where: str, table: dict[str, Any], known: Iterable[str]) -> None:
    for key in table:
        if key not in known:
            raise DescriptionError(f"{where} has no key {key}{did_you_mean(key, known)}")


def _number(where: str, table: dict[str, Any], key: str, default: float | None = None) -> float:
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise DescriptionError(f"{where}: {key} = {value!r} is no number." if key in table else f"{where}: {key} is not given.")
    return float(value)
