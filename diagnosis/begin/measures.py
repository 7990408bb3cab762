"""Units of motions: what names say, in what steps a channel is told, what an angle and its speed say of each other."""

from __future__ import annotations

import numpy as np

from ..data import wrapped
from ..rules import RULES
from . import numbers as of
from . import words
from .guess import FACTORS, METRES, ROUND, RPM, TURN, Taken
from .looking import Looking
from .numbers import Tie
from .raw import LIKELY, SECONDS, SURE, UNSURE
from .words import ANGLE, SPEED


class Measures(Looking):
    """The units of what moves."""

    def _unit(self, name: str, quantity: str) -> tuple[str, str, str]:
        """Unit of a motion by itself, how sure, and why; "" where nothing says it."""
        word = self.words[name]
        if word.unit:
            return word.unit, SURE, f"unit {word.unit} by its name"
        x = self.columns.values[name]
        if (
            quantity == ANGLE
            and np.ptp(x[np.isfinite(x)]) >= 200.0
            and bool(np.all(x[np.isfinite(x)] == np.round(x[np.isfinite(x)])))
        ):
            return "counts", UNSURE, "whole numbers"
        step = of.grain(x)
        if step:
            return _by_grain(step, quantity, self._row_step())
        return "", UNSURE, ""

    def _row_step(self) -> float:
        steps = np.concatenate([np.diff(self.columns.time[part]) for part in self.columns.parts])
        return float(np.median(steps)) if len(steps) and self.raw.clock.factor else 0.0

    def _guessed(self, name: str, quantity: str) -> float:
        unit = self._unit(name, quantity)[0]
        return TURN / 4096.0 if unit == "counts" else FACTORS.get(unit, 1.0)

    def _units(self) -> None:
        """Units of the placed motions: what they say, what an angle and its speed say of each other, what is common."""
        guess = self.guess
        told: dict[str, tuple[str, str, str]] = {}
        for signal, one in guess.taken.items():
            told[signal] = self._unit(one.column, ANGLE if signal.endswith("angle") else SPEED)
        guess.linear = (
            bool(told)
            and all(unit in METRES or not unit for unit, _, _ in told.values())
            and any(u in METRES for u, _, _ in told.values())
        )
        for angle, speed in (("reducer.input_angle", "reducer.input_speed"), ("load.angle", "load.speed")):
            if angle not in told or speed not in told:
                continue
            a, s = guess.taken[angle], guess.taken[speed]
            tie = self.integral(a.column, s.column)
            if not tie.holds(RULES.begin.borne_out):
                why = f"that {a.column!r} is the integral of {s.column!r} is not borne out {tie.told}"
                a.doubt(why)
                s.doubt(why)
                continue
            self._pair(angle, speed, tie, told)
        for signal, (unit, sure, why) in told.items():
            one = guess.taken[signal]
            if unit in METRES and not guess.linear:
                one.unit, one.why = unit, [*one.why, why]
                continue
            if unit == "counts":
                self._counts(one, signal)
                continue
            if unit == "own":  # a factor of its own
                one.doubt(why, sure)
                continue
            if not unit:
                unit, why = self._default(one.column, signal), ""
                one.unsaid = True
                one.doubt(f"no unit is said: {unit} was taken")
            elif sure != SURE:
                one.doubt(why, sure)
            else:
                one.why.append(why)
            one.unit = unit
            period = wrapped.period(self.columns.values[one.column]) if signal.endswith("angle") else 0.0
            if period:
                one.wraps = period if unit != "rad" or period < 7.0 else 0.0
                one.why.append(f"begins anew at {period:g}")
        if not guess.linear:
            self._mixed()

    def _pair(self, angle: str, speed: str, tie: Tie, told: dict[str, tuple[str, str, str]]) -> None:
        """An angle and the speed of its shaft: each says the other's unit, and both are borne out."""
        guess = self.guess
        a, s = guess.taken[angle], guess.taken[speed]
        known_a, known_s = told[angle][0], told[speed][0]
        rate = abs(tie.factor)
        clocked = self._clocked()
        both = f"{a.column!r} is the integral of {s.column!r} (r = {tie.r:.4f})"
        if tie.factor < 0.0:
            both += ", turned"
        sides = {self.words[one.column].side for one in (a, s)}
        firm = bool(self.words[a.column].unit and self.words[s.column].unit) or (len(sides) == 1 and "" not in sides)
        for one in (a, s):
            one.why.append(both)
            if firm and abs(tie.r) > RULES.begin.same and one.sure != UNSURE:
                one.sure = SURE
            elif abs(tie.r) > RULES.begin.kinematic and one.sure == UNSURE and len(one.why) <= 2:
                one.sure = LIKELY
        if known_a == "counts":
            if known_s in FACTORS and clocked:
                self._counted(a, FACTORS[known_s] / rate, s)
                return
            self._counts(a, angle)
            if not a.lacks and clocked and not known_s:
                want = a.factor * rate
                fits = [u for u in ("rad/s", "rpm", "deg/s", "turn/s") if abs(FACTORS[u] / want - 1.0) < 0.04]
                s.factor = 1.0 if fits else float(f"{want:.4g}")
                told[speed] = (
                    fits[0] if fits else "own",
                    LIKELY,
                    f"{'unit ' + fits[0] if fits else f'{want:.4g} rad/s for each of its units'}, by {a.column!r}",
                )
            return
        if known_a in FACTORS and known_s in FACTORS and not clocked:
            step = abs(rate) * FACTORS[known_a] / FACTORS[known_s]
            self.raw.clock.step, self.raw.clock.factor, self.raw.clock.sure = float(f"{step:.3g}"), 1.0, LIKELY
            self.raw.clock.why = f"so {a.column!r} is the integral of {s.column!r}, by their units"
            self.columns.time *= step
            self._forget()
            return
        if known_a and known_s:
            ratio = rate * FACTORS.get(known_a, 1.0) / FACTORS.get(known_s, 1.0)
            if not 0.8 < ratio < 1.25:
                self._clock_or_scale(ratio, a, s)
            elif self.raw.clock.guessed:
                self._timed_by(a, s)
            return
        if not clocked:
            return
        if known_a in FACTORS or known_s in FACTORS:
            want = FACTORS[known_a] * rate if known_a else FACTORS[known_s] / rate
            units = ("rad/s", "rpm", "deg/s", "turn/s", "m/s", "mm/s") if known_a else ("rad", "deg", "turn", "m", "mm")
            metres = (known_a or known_s) in METRES
            fits = [u for u in units if (u in METRES) == metres and abs(FACTORS[u] / want - 1.0) < 0.04]
            other, partner = (speed, a) if known_a else (angle, s)
            if fits:
                told[other] = (fits[0], SURE if firm else LIKELY, f"unit {fits[0]} by {partner.column!r}")
            elif not known_a:
                self._counted(a, want, s, told, angle)
            return
        pairs = [
            (x, y) for x in ("rad", "deg") for y in ("rad/s", "rpm", "deg/s") if abs(FACTORS[y] / FACTORS[x] / rate - 1.0) < 0.02
        ]
        pairs = [pair for pair in pairs if pair != ("deg", "deg/s")]
        if pairs and pairs[0] != ("rad", "rad/s"):
            for signal, unit in zip((angle, speed), pairs[0]):
                told[signal] = (unit, LIKELY, f"units {pairs[0][0]} and {pairs[0][1]} by their ratio, {rate:.4g}")
        elif not pairs and not 0.9 < rate < 1.1:
            for one in (a, s):
                one.doubt(
                    f"{a.column!r} goes {1.0 / rate:.4g} times as far as the integral of {s.column!r}: their units are not told"
                )

    def _clock_or_scale(self, ratio: float, a: Taken, s: Taken) -> None:
        """Both units are said, and do not agree: the time's may be wrong, or they are of two shafts."""
        clock = self.raw.clock
        for unit, factor in SECONDS.items():
            if clock.column and clock.sure != SURE and abs(ratio * clock.factor / factor - 1.0) < 0.2:
                self.columns.time *= factor / clock.factor
                clock.unit, clock.factor = unit, factor
                self._timed_by(a, s)
                self._forget()
                return
        for one in (a, s):
            one.doubt(
                f"by their units {a.column!r} goes {ratio:.4g} times as far as {s.column!r} says: two shafts, or a unit is wrong"
            )

    def _timed_by(self, a: Taken, s: Taken) -> None:
        """The unit of the time is no guess any more."""
        clock = self.raw.clock
        clock.sure, clock.guessed, clock.why = LIKELY, False, f"{a.column!r} and {s.column!r} say that it is {clock.unit}"

    def _counted(self, one: Taken, per_count: float, by: Taken, told: dict | None = None, signal: str = "") -> None:
        """An angle in counts: rad for each, by a speed whose unit is known."""
        turn = TURN / per_count
        near = min(ROUND, key=lambda n: abs(n / turn - 1.0))
        if abs(near / turn - 1.0) < 0.01:
            one.factor, one.unit = TURN / near, ""
            one.why.append(f"{near} counts a turn, by {by.column!r} ({turn:.1f})")
            one.sure = SURE if one.sure == SURE else LIKELY
        else:
            one.factor, one.unit = per_count, ""
            one.doubt(
                f"{turn:.1f} counts a turn, by {by.column!r}: write the encoder's own number, factor = 2 pi / counts", LIKELY
            )
        if told is not None:
            told.pop(signal)
            told[signal] = ("counts", SURE, "")

    def _counts(self, one: Taken, signal: str) -> None:
        if one.factor not in (1.0, -1.0) or one.lacks:
            return
        x = self.columns.values[one.column]
        low, high = float(np.nanmin(x)), float(np.nanmax(x))
        joint = {"present", "goal"} & set(words.tokens(one.column))
        if joint and 0.0 <= low and high <= 4095.0 and high > 500.0:
            one.factor = TURN / 4096.0
            one.doubt("whole numbers from 0 to 4095: taken for 4096 counts a turn", LIKELY)
        else:
            one.doubt("in counts, and how many are a turn is not said: factor = 2 pi / counts (of a linear drive m for each)")
            one.lacks = "factor"

    def _default(self, column: str, signal: str) -> str:
        """The unit where nobody says one."""
        if self.guess.linear:
            return "m" if signal.endswith("angle") else "m/s"
        size = float(np.nanquantile(abs(self.columns.values[column]), 0.98))
        kind = signal.rpartition("_")[2].rpartition(".")[2]  # angle or speed
        both = [one for other, one in self.guess.taken.items() if other.endswith(kind) and not self.words[one.column].unit]
        if kind == "angle":
            return "deg" if signal == "load.angle" and size > 25.0 else "rad"
        largest = max(float(np.nanquantile(abs(self.columns.values[one.column]), 0.98)) for one in both) if both else size
        return "rpm" if largest > 1000.0 else "rad/s"

    def _mixed(self) -> None:
        """A shaft that turns, and a load that goes straight: metres become the screw's angle, by the log itself."""
        guess = self.guess
        metres = [s for s, one in guess.taken.items() if one.unit in METRES]
        turning = [s for s, one in guess.taken.items() if one.unit in FACTORS and one.unit not in METRES]
        for signal in metres:
            one = guess.taken[signal]
            for other in turning:
                factor = self._tie_of(signal, other)
                if factor is not None:
                    one.factor, one.unit = factor, ""
                    lead = TURN / abs(factor)
                    one.doubt(
                        f"a straight motion, {lead:.4g} of its unit for each turn of {guess.taken[other].column!r}: told as that turning",
                        LIKELY,
                    )
                    break
            else:
                guess.left[one.column] = f"in {one.unit}, and no turning shaft goes with it"
                del guess.taken[signal]

    def _tie_of(self, signal: str, other: str) -> float | None:
        """SI of `other` for each unit of `signal`, where they are one motion."""
        a, b = self.guess.taken[signal].column, self.guess.taken[other].column
        first, second = signal.endswith("angle"), other.endswith("angle")
        tie = self._tie(b, a, ANGLE if second else SPEED, ANGLE if first else SPEED)
        if first != second and not self._clocked():
            return None
        return tie.factor * self.guess.scale(other) if tie.holds(RULES.begin.same) else None


def _by_grain(step: float, quantity: str, row: float) -> tuple[str, str, str]:
    """The unit of a motion by the step in which it is told: whole counts of a turn, of a turn in a row's time, whole rpm."""

    def counts(turn: float) -> int | None:
        n = turn / step
        near = int(round(n))
        return near if near in ROUND and abs(n / near - 1.0) < 2e-3 else None

    decimal = abs(np.log10(step) - round(float(np.log10(step)))) < 1e-6
    if quantity == ANGLE:
        if n := counts(TURN):
            return "rad", SURE, f"in steps of a turn's {n}th, in rad"
        if not decimal and (n := counts(360.0)):
            return "deg", LIKELY, f"in steps of a turn's {n}th, in degrees"
        return "", UNSURE, ""
    if abs(step / RPM - round(step / RPM)) < 2e-3 * round(step / RPM) and round(step / RPM) in (1, 2, 5, 10):
        return "rad/s", SURE, f"in steps of {round(step / RPM)} rpm, in rad/s"
    if row and not decimal:
        for unit, turn in (("rad/s", TURN), ("rpm", 60.0), ("deg/s", 360.0)):
            lines = turn / (step * row)
            near = int(round(lines))
            if near in ROUND and abs(lines / near - 1.0) < 2e-3:
                return unit, LIKELY, f"in steps of a turn's {near}th in a row's time, in {unit}"
    return "", UNSURE, ""
