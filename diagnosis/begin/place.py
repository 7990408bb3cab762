"""Which column is which variable of a drive: names claim, numbers confirm, contradict or find, and what is left stays a gap.

Each placed column says how sure that is: `sure` where a name or a unit and the numbers agree, or two relations do; `likely`
where one of them speaks; `unsure` where a letter does, or where a unit was taken because nobody said it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from math import pi

import numpy as np

from . import numbers as of
from . import words
from .numbers import Columns, Tie
from .raw import LIKELY, SURE, UNSURE, Raw
from .words import ANGLE, CURRENT, DUTY, LOAD, MOTOR, SETPOINT, SPEED, SUPPLY, TEMPERATURE, TORQUE, VOLTAGE, Word

RPM, DEG, TURN = pi / 30.0, pi / 180.0, 2.0 * pi
FACTORS = {
    "rad": 1.0, "mrad": 1e-3, "deg": DEG, "turn": TURN, "rad/s": 1.0, "rpm": RPM, "deg/s": DEG, "turn/s": TURN,
    "m": 1.0, "mm": 1e-3, "um": 1e-6, "m/s": 1.0, "mm/s": 1e-3,
}  # fmt: skip
SLIPS = (1.0, 1.0 / DEG, 1.0 / RPM, RPM / DEG, 1e3)
"""Factors between units of one motion: what goes so much farther may be the same in another unit."""
METRES = {"m", "mm", "um", "m/s", "mm/s"}
ROUND = {n * k for n in (100, 125, 128, 250, 256, 360, 400, 500, 512, 600, 720, 1000, 1024, 1250, 1440, 2000, 2048, 2500, 3600, 4000, 4096, 5000, 8192, 16384, 32768, 65536, 131072, 262144) for k in (1, 2, 4, 10)}  # fmt: skip
"""Counts that encoders have to a turn."""

KINEMATIC = 0.995  # correlation from which on one channel is the integral of another, whatever they are called
BORNE_OUT = 0.9  # the same, where their names say so
SAME = 0.98  # correlation from which on two channels are one motion
FITS = 0.4  # share of a torque, a current or a voltage that its law may leave to be told by it


@dataclass
class Taken:
    """A column that has a place."""

    column: str
    signal: str
    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    nominal: float = 0.0
    wraps: float = 0.0
    commanded: bool = False
    lacks: str = ""  # a number without which it is not in force: nominal, or factor
    sure: str = LIKELY
    why: list[str] = field(default_factory=list)

    def doubt(self, why: str, sure: str = UNSURE) -> None:
        """Something is not known of it."""
        order = (UNSURE, LIKELY, SURE)
        self.sure = min(self.sure, sure, key=order.index)
        self.why.append(why)


@dataclass
class Guess:
    """What a log's columns seem to be."""

    raw: Raw
    taken: dict[str, Taken] = field(default_factory=dict)  # by signal
    left: dict[str, str] = field(default_factory=dict)  # column: what it looks like
    linear: bool = False
    valid: str = ""
    ratio: tuple[float, float, str] | None = None  # value, its error, by what
    hints: dict[str, str] = field(default_factory=dict)  # parameter: what the log says of it
    notes: list[str] = field(default_factory=list)
    drives: list[str] = field(default_factory=list)  # of which one was taken

    def si(self, signal: str) -> np.ndarray:
        """A placed channel's means over the pieces, in SI as the rig would have it (without offset)."""
        return self.scale(signal) * self.raw.columns.mean(self.taken[signal].column)

    def scale(self, signal: str) -> float:
        """SI for each unit of a placed column."""
        one = self.taken[signal]
        return one.factor * FACTORS.get(one.unit, {"mA": 1e-3, "mV": 1e-3, "mN.m": 1e-3, "N.cm": 1e-2, "kN": 1e3, "%": 1e-2}.get(one.unit, 1.0))


def place(raw: Raw, only: str = "") -> Guess:
    """The guess. only: of columns that belong to one of several drives, those whose names hold this."""
    return _Placing(raw, only).guess


class _Placing:
    """One log, step by step: motions first, for everything else is told by them."""

    def __init__(self, raw: Raw, only: str):
        self.raw, self.columns, self.guess = raw, raw.columns, Guess(raw)
        self.words = dict(raw.words)
        self.ties: dict[tuple[str, str], Tie] = {}
        self._alike_letters()
        self.varying = [name for name, x in raw.columns.values.items() if self._look(name, x)]
        self._one_drive(only)
        self._claims_by_numbers()
        self.motions()
        self._orient()
        self._setpoints()
        self._ratio()
        self.electric()
        self._signs()
        self._lone_letters()
        self._beside()
        self._rest()

    # --- looks

    def _alike_letters(self) -> None:
        """x1, x2, x3 are no claims: a letter that many columns have says nothing of one."""
        bare = {n: w for n, w in self.words.items() if w.strength == 1 and not w.side and not w.role and all(t.isdigit() for t in w.rest)}
        letters = Counter(words.tokens(n)[0] for n in bare)
        for name, word in bare.items():
            if letters[words.tokens(name)[0]] >= 3:
                self.words[name] = Word(name, rest=())

    def _look(self, name: str, x: np.ndarray) -> bool:
        """Whether a column may be a channel: it changes, and is more than a switch."""
        good = x[np.isfinite(x)]
        distinct = len(np.unique(good[: of.LOOKED_AT]))
        if distinct < 2:
            self.guess.left[name] = f"always {good[0]:.6g}" if len(good) else "no numbers"
        elif self.words[name].quantity in (words.FLAG, words.RUN, words.INDEX):
            self.guess.left[name] = "a mark, by its name"
        elif distinct < 4 and self.words[name].strength < 2:
            self.guess.left[name] = f"a switch: {', '.join(f'{v:g}' for v in np.unique(good)[:3])}"
        elif _counts_rows(good):
            self.guess.left[name] = "it counts rows"
        else:
            return True
        return False

    def _of(self, *quantities: str, role: str | None = None) -> list[str]:
        """Columns that still have no place and claim to be one of these, the strongest claims first."""
        found = [n for n in self.varying if self.words[n].quantity in quantities and n not in self.guess.left]
        found = [n for n in found if n not in {t.column for t in self.guess.taken.values()}]
        if role is not None:
            found = [n for n in found if (self.words[n].role == SETPOINT) == (role == SETPOINT)]
        return sorted(found, key=lambda n: -self.words[n].strength)

    def _take(self, signal: str, column: str, **more) -> Taken:
        word = self.words[column]
        why = more.pop("why", None) or [
            "its unit" if word.said else "its name" if word.strength == 2 else "a letter of its name" if word.strength else "its numbers"
        ]
        sure = more.pop("sure", LIKELY if word.strength == 2 or word.strength == 0 else UNSURE)
        self.guess.taken[signal] = Taken(column, signal, why=why, sure=sure, **more)
        return self.guess.taken[signal]

    # --- one drive of several

    def _one_drive(self, only: str) -> None:
        """Columns whose names differ in what is no word (a number, a joint's name) are of several drives: one is taken."""
        if only:
            wanted = [n for n in self.varying if only.lower() in n.lower()]
            if not wanted:
                raise self._no(only)
            shared = (SUPPLY, words.FLAG, words.TIME)
            for name in self.varying:
                if name not in wanted and self.words[name].quantity not in shared:
                    self.guess.left[name] = "not of the drive that was asked for"
            self.varying = [n for n in self.varying if n not in self.guess.left]
        slots: dict[tuple[str, ...], set] = {}
        for name in self.varying:
            word = self.words[name]
            if word.rest and word.quantity in (ANGLE, SPEED, TORQUE, CURRENT, VOLTAGE, DUTY):
                slots.setdefault(word.rest, set()).add((word.quantity, word.side, word.role))
        several = [rest for rest, mine in slots.items() if len({q for q, _, _ in mine}) > 1 and {ANGLE, SPEED} & {q for q, _, _ in mine}]
        alike = [rest for rest in several if any(slots[rest] & slots[other] for other in several if other != rest)]
        if len(alike) < 2:
            return
        most = max(len(slots[rest]) for rest in alike)
        best = [rest for rest in alike if len(slots[rest]) == most]
        chosen = max(best, key=lambda rest: (self._motion(rest), -best.index(rest)))
        names = {rest: " ".join(rest) for rest in slots}
        self.guess.drives = [names[chosen], *(names[rest] for rest in alike if rest != chosen)]
        for name in self.varying:
            rest = self.words[name].rest
            if rest in alike and rest != chosen:
                self.guess.left[name] = f"of another drive ({names[rest]})"
        self.varying = [n for n in self.varying if n not in self.guess.left]
        self.guess.notes.append(
            f"the log holds {len(alike)} drives ({', '.join(names[r] for r in alike[:8])}): taken is {names[chosen]!r}; "
            "for another: --only with what its columns have in their names"
        )

    def _motion(self, rest: tuple[str, ...]) -> float:
        """How much a drive's named motion changes, in its own range: which of several tells most."""
        best = 0.0
        for name in self.varying:
            if self.words[name].rest == rest and self.words[name].quantity in (SPEED, ANGLE):
                best = max(best, float(np.nansum(abs(self.columns.change(name)))))
        return best

    def _no(self, only: str):
        from ..errors import DataError

        return DataError(f"--only {only}: no column has that in its name. There are: {', '.join(list(self.raw.words)[:20])}.")

    # --- motions

    def integral(self, angle: str, speed: str) -> Tie:
        """Tie of an angle to a speed, remembered."""
        if (angle, speed) not in self.ties:
            self.ties[angle, speed] = of.integral(self.columns, angle, speed)
        return self.ties[angle, speed]

    def _claims_by_numbers(self) -> None:
        """Columns without a claim that are the derivative or the integral of one with a claim; then pairs without any."""
        known = {ANGLE: self._of(ANGLE), SPEED: self._of(SPEED)}
        free = [n for n in self.varying if self.words[n].strength == 0 and n not in self.guess.left]
        for name in free:
            partner = [s for s in known[SPEED] if self.integral(name, s).holds(KINEMATIC)]
            if partner:
                self._claim(name, ANGLE)
                continue
            partner = [a for a in known[ANGLE] if self.integral(a, name).holds(0.999)]
            if partner and not any(self.integral(a, s).holds(SAME) for a in partner for s in known[SPEED]):
                self._claim(name, SPEED)
        free = [n for n in free if self.words[n].quantity == ""]
        self._claim_same(free, known)
        free = [n for n in free if self.words[n].quantity == ""]
        if known[ANGLE] or known[SPEED] or len(free) > 60:
            return
        pairs = [
            (a, s) for a in free for s in free
            if a != s and self.integral(a, s).holds(0.999) and self.integral(a, s).pieces >= 30 and not abs(self.integral(s, a).r) > BORNE_OUT
        ]  # fmt: skip
        speeds = {s for _, s in pairs}
        for angle, speed in pairs:
            if angle not in speeds:  # which would be the integral of an acceleration
                self._claim(angle, ANGLE)
                self._claim(speed, SPEED)
        self._claim_same([n for n in free if self.words[n].quantity == ""], {ANGLE: self._of(ANGLE), SPEED: self._of(SPEED)})

    def _claim_same(self, free: list[str], known: dict[str, list[str]]) -> None:
        """Columns that go as a known motion does, in its own size or as the other shaft's."""
        for name in free:
            for quantity, mine in known.items():
                if any(of.proportional(self.columns, name, other, quantity == ANGLE).holds(KINEMATIC) for other in mine):
                    self._claim(name, quantity)
                    break

    def _claim(self, name: str, quantity: str) -> None:
        word = self.words[name]
        self.words[name] = Word(name, quantity, word.side, word.role, word.unit if word.said else "", word.said, 0, word.rest)

    def motions(self) -> None:
        """The measured angles and speeds of both shafts."""
        actual = {ANGLE: self._of(ANGLE, role=""), SPEED: self._of(SPEED, role="")}
        if not actual[ANGLE] and not actual[SPEED]:
            return
        self._lone_setpoints(actual)
        side = {name: self.words[name].side for both in actual.values() for name in both}
        base = self._sides(actual, side)
        for quantity, signals in ((ANGLE, ("reducer.input_angle", "load.angle")), (SPEED, ("reducer.input_speed", "load.speed"))):
            for where, signal in zip((MOTOR, LOAD), signals):
                mine = [n for n in actual[quantity] if side[n] == where]
                if not mine:
                    continue
                best = max(mine, key=lambda n: (self.words[n].strength, self.words[n].role == words.ACTUAL, -of.roughness(self.columns.values[n])))
                taken = self._take(signal, best)
                for other in mine:
                    if other != best:
                        tie = of.proportional(self.columns, other, best, quantity == ANGLE)
                        same = f"goes as {best!r} does (r = {tie.r:.3f}, factor {tie.factor:.4g})" if abs(tie.r) > SAME else f"claims the place of {best!r}"
                        self.guess.left[other] = same
                        if abs(tie.r) < BORNE_OUT:
                            taken.doubt(f"{other!r} claims the same place, and is another motion")
                if best in base:
                    taken.doubt(base[best])
        self._units()

    def _lone_setpoints(self, actual: dict[str, list[str]]) -> None:
        """Of two channels that are one motion, and of which no name says so, the one that leads without noise is asked for."""
        for quantity, names in actual.items():
            for first in list(names):
                for second in list(names):
                    if first == second or first not in names or second not in names:
                        continue
                    if any(self.words[n].side for n in (first, second)) and self.words[first].side != self.words[second].side:
                        continue
                    tie = of.proportional(self.columns, second, first, quantity == ANGLE)
                    if not (tie.holds(0.9) and 0.8 < tie.factor < 1.25) or self.words[first].role == words.ACTUAL:
                        continue
                    rows = of.lead(self.columns, first, second)
                    smooth = of.roughness(self.columns.values[first]) < 0.7 * of.roughness(self.columns.values[second])
                    if rows >= 1.0 and (smooth or self.words[second].role == words.ACTUAL):
                        word = self.words[first]
                        self.words[first] = Word(first, quantity, word.side, SETPOINT, word.unit, word.said, word.strength, word.rest)
                        self.raw_lead = rows
                        names.remove(first)

    def _sides(self, actual: dict[str, list[str]], side: dict[str, str]) -> dict[str, str]:
        """Of which shaft each channel is: as its name says, as its ratio to a named one says, else by its size. What is doubtful."""
        doubts: dict[str, str] = {}
        names = [*actual[ANGLE], *actual[SPEED]]
        quantity = {n: q for q, mine in actual.items() for n in mine}
        relation = lambda a, b: self._relation(a, b, quantity)
        for _ in range(len(names)):
            for name in names:
                if side[name]:
                    continue
                for other in names:
                    factor = relation(name, other) if side[other] and other != name else None
                    if factor is None:
                        continue
                    if 0.85 < factor < 1.18:
                        side[name] = side[other]
                    elif factor < 0.7 and side[other] == MOTOR:
                        side[name] = LOAD
                    elif factor > 1.4 and side[other] == LOAD:
                        side[name] = MOTOR
                    else:
                        continue
                    break
        unknown = [n for n in names if not side[n]]
        if not unknown:
            return doubts
        first = max(unknown, key=lambda n: float(np.nansum(abs(self._si_change(n, quantity[n])))))
        counted = lambda n: "counts" in (self._unit(n, quantity[n])[0], self._unit(first, quantity[first])[0])
        apart = lambda n: (f := relation(n, first)) is not None and f < 0.7 and not counted(n) and (self._scaled(n, quantity, first) or not _slip(f))
        others = [n for n in unknown if n != first and apart(n)]
        taken = set(side.values()) - {""}
        if others or LOAD in taken:
            side[first] = MOTOR
        elif MOTOR in taken:
            side[first] = LOAD
        else:
            scaled = [n for n in unknown if self._unit(n, quantity[n])[0]]
            fast = max(self._fastest(n, quantity[n]) for n in scaled or [first])
            side[first] = MOTOR if fast > 30.0 or self.words[first].unit == "rpm" and fast > 15.0 else LOAD
            where = "motor's" if side[first] == MOTOR else "load's"
            word = "reducer.input_..." if side[first] == LOAD else "load...."
            doubts[first] = f"shaft not told, taken for the {where} (else {word})"
        for name in unknown:
            if not side[name]:
                side[name] = LOAD if name in others and side[first] == MOTOR else side[first]
                if name in others:
                    doubts[name] = f"it goes {1.0 / (relation(name, first) or 1.0):.4g} times less far than {first!r}: taken for the other shaft"
                elif first in doubts and name != first:
                    doubts[name] = "of the same shaft as " + repr(first)
        return doubts

    def _scaled(self, name: str, quantity: dict[str, str], other: str) -> bool:
        """Whether the units of both are known, so that their sizes can be compared."""
        return all(self._unit(n, quantity[n])[0] for n in (name, other))

    def _relation(self, name: str, other: str, quantity: dict[str, str]) -> float | None:
        """How much farther a channel moves than another, in SI as far as units are known; None where they are two motions."""
        a, b = quantity[name], quantity[other]
        tie = self._tie(name, other, a, b)
        if not tie.holds(BORNE_OUT):
            return None
        if a != b and not self._clocked():
            return 1.0  # without a time nothing is known of it
        return abs(tie.factor) * self._guessed(name, a) / self._guessed(other, b)

    def _tie(self, name: str, other: str, a: str, b: str) -> Tie:
        """How a motion follows another, of these quantities: angles by their changes, speeds by their means."""
        if a == b:
            return of.proportional(self.columns, name, other, a == ANGLE)
        if a == ANGLE:
            return self.integral(name, other)
        back = self.integral(other, name)
        return Tie(1.0 / back.factor if back.factor else float("nan"), back.r, back.centred, back.pieces, back.spread)

    def _clocked(self) -> bool:
        """Whether the time is told in s."""
        return bool(self.raw.clock.factor) and bool(self.raw.clock.column or self.raw.clock.step)

    def _guessed(self, name: str, quantity: str) -> float:
        unit = self._unit(name, quantity)[0]
        return TURN / 4096.0 if unit == "counts" else FACTORS.get(unit, 1.0)

    def _si_change(self, name: str, quantity: str) -> np.ndarray:
        x = self.columns.change(name) if quantity == ANGLE else self.columns.way(name)
        return x * self._guessed(name, quantity)

    def _fastest(self, name: str, quantity: str) -> float:
        """rad/s that are rarely exceeded."""
        with np.errstate(all="ignore"):
            speed = abs(self._si_change(name, quantity)) / self.columns.lasting
        return float(np.nanquantile(speed, 0.98)) if len(speed) else 0.0

    # --- units

    def _unit(self, name: str, quantity: str) -> tuple[str, str, str]:
        """Unit of a motion by itself, how sure, and why; "" where nothing says it."""
        word = self.words[name]
        if word.unit:
            return word.unit, SURE, f"unit {word.unit} by its name"
        x = self.columns.values[name]
        if quantity == ANGLE and np.ptp(x[np.isfinite(x)]) >= 200.0 and bool(np.all(x[np.isfinite(x)] == np.round(x[np.isfinite(x)]))):
            return "counts", UNSURE, "whole numbers"
        step = of.grain(x)
        if step:
            return _by_grain(step, quantity, self._row_step())
        return "", UNSURE, ""

    def _row_step(self) -> float:
        steps = np.concatenate([np.diff(self.columns.time[part]) for part in self.columns.parts])
        return float(np.median(steps)) if len(steps) and self.raw.clock.factor else 0.0

    def _units(self) -> None:
        """Units of the placed motions: what they say, what an angle and its speed say of each other, what is common."""
        guess = self.guess
        told: dict[str, tuple[str, str, str]] = {}
        for signal, one in guess.taken.items():
            told[signal] = self._unit(one.column, ANGLE if signal.endswith("angle") else SPEED)
        guess.linear = bool(told) and all(unit in METRES or not unit for unit, _, _ in told.values()) and any(u in METRES for u, _, _ in told.values())
        for angle, speed in (("reducer.input_angle", "reducer.input_speed"), ("load.angle", "load.speed")):
            if angle not in told or speed not in told:
                continue
            a, s = guess.taken[angle], guess.taken[speed]
            tie = self.integral(a.column, s.column)
            if not tie.holds(BORNE_OUT):
                why = f"{a.column!r} is not the integral of {s.column!r} (r = {tie.r:.2f})"
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
                one.doubt(f"no unit is said: {unit} was taken")
            elif sure != SURE:
                one.doubt(why, sure)
            else:
                one.why.append(why)
            one.unit = unit
            period = of.wraps(self.columns.values[one.column]) if signal.endswith("angle") else 0.0
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
        for one in (a, s):
            one.why.append(both)
            if tie.r and abs(tie.r) > SAME and one.sure != UNSURE:
                one.sure = SURE
            elif abs(tie.r) > KINEMATIC and one.sure == UNSURE and len(one.why) <= 2:
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
                told[speed] = (fits[0] if fits else "own", LIKELY, f"{'unit ' + fits[0] if fits else f'{want:.4g} rad/s for each of its units'}, by {a.column!r}")
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
                told[other] = (fits[0], SURE, f"unit {fits[0]} by {partner.column!r}")
            elif not known_a:
                self._counted(a, want, s, told, angle)
            return
        pairs = [(x, y) for x in ("rad", "deg") for y in ("rad/s", "rpm", "deg/s") if abs(FACTORS[y] / FACTORS[x] / rate - 1.0) < 0.02]
        pairs = [pair for pair in pairs if pair != ("deg", "deg/s")]
        if pairs and pairs[0] != ("rad", "rad/s"):
            for signal, unit in zip((angle, speed), pairs[0]):
                told[signal] = (unit, LIKELY, f"units {pairs[0][0]} and {pairs[0][1]} by their ratio, {rate:.4g}")
        elif not pairs and not 0.9 < rate < 1.1:
            for one in (a, s):
                one.doubt(f"{a.column!r} goes {1.0 / rate:.4g} times as far as the integral of {s.column!r}: their units are not told")

    def _clock_or_scale(self, ratio: float, a: Taken, s: Taken) -> None:
        """Both units are said, and do not agree: the time's may be wrong, or they are of two shafts."""
        clock = self.raw.clock
        for factor, unit in ((1e3, "ms"), (1e6, "us"), (1e9, "ns"), (1e-3, "s")):
            if clock.column and clock.sure != SURE and abs(ratio * factor - 1.0) < 0.2 and clock.unit == "s" and factor > 1.0:
                clock.unit, clock.sure = unit, LIKELY
                clock.why = f"{a.column!r} and {s.column!r} say that it is {unit}"
                self.columns.time *= 1.0 / factor
                self._forget()
                return
        for one in (a, s):
            one.doubt(f"by their units {a.column!r} goes {ratio:.4g} times as far as {s.column!r} says: two shafts, or a unit is wrong")

    def _forget(self) -> None:
        """What was told by another time."""
        self.columns.__dict__.pop("lasting", None)
        self.columns._memory.clear()
        self.ties.clear()

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
            one.doubt(f"{turn:.1f} counts a turn, by {by.column!r}: write the encoder's own number, factor = 2 pi / counts", LIKELY)
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
                    one.doubt(f"a straight motion, {lead:.4g} of its unit for each turn of {guess.taken[other].column!r}: told as that turning", LIKELY)
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
        return tie.factor * self.guess.scale(other) if tie.holds(SAME) else None

    # --- signs, set-points, ratio

    def _base(self) -> str:
        """The channel whose direction is positive."""
        return next((s for s in ("load.angle", "load.speed", "reducer.input_speed", "reducer.input_angle") if s in self.guess.taken), "")

    def _orient(self) -> None:
        """All motions in the direction of one of them."""
        base = self._base()
        for signal, one in self.guess.taken.items():
            if signal != base and (factor := self._si_factor(signal, base)) is not None and factor < 0.0:
                one.factor = -one.factor
                one.why.append(f"turned: it goes the other way than {self.guess.taken[base].column!r}")

    def _si_factor(self, signal: str, other: str) -> float | None:
        """How much farther a placed motion goes than another, in SI; None where they do not go together."""
        factor = self._tie_of(other, signal)
        scale = self.guess.scale(other)
        return factor / scale if factor is not None and scale else None

    def _setpoints(self) -> None:
        for quantity, signal, actual in (
            (ANGLE, "controller.angle_setpoint", ("load.angle", "reducer.input_angle")),
            (SPEED, "controller.speed_setpoint", ("load.speed", "reducer.input_speed", "load.angle", "reducer.input_angle")),
        ):
            asked = self._of(quantity, role=SETPOINT)
            measured = next((a for a in actual if a in self.guess.taken), "")
            for name in asked:
                if signal in self.guess.taken:
                    self.guess.left[name] = f"claims the place of {self.guess.taken[signal].column!r}"
                elif measured:
                    self._setpoint(name, signal, quantity, measured)
                else:
                    self.guess.left[name] = "asked for, by its name; no such motion was measured"

    def _setpoint(self, name: str, signal: str, quantity: str, measured: str) -> None:
        guess, one = self.guess, self.guess.taken[measured]
        taken = self._take(signal, name)
        motion = ANGLE if measured.endswith("angle") else SPEED
        tie = self._tie(name, one.column, quantity, motion)
        word = self.words[name]
        turning = {True: ("rad", "deg", "turn", "m", "mm"), False: ("rad/s", "rpm", "deg/s", "turn/s", "m/s", "mm/s")}[quantity == ANGLE]
        side = measured.startswith("reducer.") and word.side != MOTOR
        if word.unit in FACTORS:
            taken.unit = word.unit
        if not tie.holds(0.8):
            taken.unit = taken.unit or (one.unit if motion == quantity else "")
            taken.factor = one.factor if motion == quantity and taken.unit == one.unit else 1.0
            taken.doubt(f"{one.column!r} does not follow it closely (r = {tie.r:.2f})")
            return
        taken.why.append(f"{one.column!r} follows it (r = {tie.r:.3f})")
        wanted = guess.scale(measured) / tie.factor  # SI for each unit of the set-point, if the drive goes where it is sent
        fits = [u for u in turning if abs(FACTORS[u] / abs(wanted) - 1.0) < 0.25]
        if motion == quantity and abs(abs(tie.factor) - 1.0) < 0.25 and not word.unit:
            taken.unit, taken.factor = one.unit, float(np.copysign(one.factor, tie.factor * one.factor))
        elif taken.unit:
            taken.factor = -1.0 if wanted < 0.0 else 1.0
            if taken.unit not in fits:
                taken.doubt(f"by its unit it asks for {FACTORS[taken.unit] / abs(wanted):.4g} times the way of {one.column!r}: of the other shaft?")
        elif fits:
            taken.unit, taken.factor = fits[0], -1.0 if wanted < 0.0 else 1.0
        else:
            taken.factor = wanted
            taken.doubt(f"factor {wanted:.4g}, by {one.column!r}")
        if abs(tie.r) > SAME and not guess.taken[measured].sure == UNSURE:
            taken.sure = SURE if word.strength == 2 else LIKELY
        if side:
            taken.doubt("a set-point is of the load's side, and what goes with it is the motor's motion: factor over the gear's ratio")
            taken.lacks = "factor"
        rows = of.lead(self.columns, name, one.column) if motion == quantity else 0.0
        if rows >= 1.0:
            taken.why.append(f"leads it by {rows:.0f} rows")
        if motion == quantity == ANGLE:
            apart = self.columns.mean(one.column) * guess.scale(measured) - self.columns.mean(name) * guess.scale(signal)
            low, middle, high = np.nanquantile(apart, (0.1, 0.5, 0.9))
            if abs(middle) > 5.0 * (high - low) and abs(middle) > 1e-9:
                taken.offset = float(f"{middle:.5g}")
                taken.why.append(f"its zero lies {middle:.4g} beside that of {one.column!r}")

    def _ratio(self) -> None:
        """What the motor's shaft turns for each turn of the load."""
        for first, second in (("reducer.input_angle", "load.angle"), ("reducer.input_speed", "load.speed"), ("reducer.input_speed", "load.angle"), ("reducer.input_angle", "load.speed")):
            if first not in self.guess.taken or second not in self.guess.taken:
                continue
            a, b = self.guess.taken[first], self.guess.taken[second]
            factor = self._si_factor(first, second)
            if factor is None:
                continue
            doubtful = [one.column for one in (a, b) if UNSURE == one.sure]
            error = max(_tie_error(self.columns, a.column, b.column, first, second), 1e-6) * abs(factor)
            by = f"{a.column!r} over {b.column!r}"
            if "told as that turning" in " ".join((*a.why, *b.why)):
                by += ", by the making of that factor"
            elif doubtful:
                by += "; as sure as their units are"
            self.guess.ratio = (abs(factor), error, by)
            for one in (a, b):
                one.why.append("both shafts go together")
            return

    # --- what drives it

    def electric(self) -> None:
        """Voltage, duty, current, torque, temperature, supply."""
        self._supply()
        for quantity, put in ((CURRENT, self._current), (TORQUE, self._torque), (VOLTAGE, self._voltage), (DUTY, self._duty)):
            for name in sorted(self._of(quantity), key=lambda n: (self.words[n].role == SETPOINT, -self.words[n].strength)):
                put(name)
        driven = {"motor.voltage", "motor.duty", "controller.voltage", "motor.current", "motor.torque", "reducer.output_torque"}
        if self._base() and not driven & set(self.guess.taken):
            self._torque_by_numbers()

    def _supply(self) -> None:
        for name in self._of(SUPPLY, VOLTAGE):
            x = self.columns.values[name]
            steady = float(np.nanmin(x)) > 0.4 * float(np.nanmax(x)) > 0.0 and float(np.nanstd(x)) < 0.15 * float(np.nanmean(x))
            said = self.words[name].quantity == SUPPLY
            if not (said or (steady and self._both_ways())):
                continue
            if "motor.supply_voltage" in self.guess.taken:
                self.guess.left[name] = "another supply, by its name"
                continue
            taken = self._take("motor.supply_voltage", name, unit=self._electric_unit(name, ("V", "mV")))
            taken.why.append("positive and steady" if steady else "not steady")
            taken.sure = SURE if said and steady else UNSURE if not said else LIKELY

    def _both_ways(self) -> bool:
        """Whether the drive moves both ways."""
        base = self._base()
        if not base:
            return False
        column = self.guess.taken[base].column
        x = self.columns.change(column) if base.endswith("angle") else self.columns.mean(column)
        fast = x[abs(x) > 0.1 * np.nanmax(abs(x))] if len(x) else x
        return len(fast) > 5 and 0.1 < float(np.mean(fast > 0.0)) < 0.9

    def _electric_unit(self, name: str, units: tuple[str, str]) -> str:
        word, x = self.words[name], self.columns.values[name]
        if word.unit in units:
            return word.unit
        size = float(np.nanmax(abs(x)))
        limit = 300.0 if units[0] == "A" else 1500.0
        return units[1] if size > limit else units[0]

    def _magnitude(self, name: str) -> bool:
        """Whether a channel never changes its sign while the drive goes both ways by something that asks for both."""
        x = self.columns.values[name]
        if float(np.nanmin(x)) < 0.0 or not self._both_ways():
            return False
        w, a, _ = self._motion_parts()
        y = self.columns.mean(name)
        left = of.fitted(y - np.nanmean(y), w, np.sign(w), a)[1] if w is not None else 1.0  # a weight keeps a sign, friction shows
        return float(np.nanmin(x)) < 0.05 * float(np.nanmax(x)) or left > 0.9

    def _said(self, name: str, taken: Taken, unit: str) -> None:
        """How sure a unit is."""
        if self.words[name].unit == unit:
            taken.why.append(f"unit {unit} by its name")
        else:
            taken.doubt(f"no unit is said: {unit} was taken", LIKELY if unit in ("A", "V") else UNSURE)

    def _current(self, name: str) -> None:
        tokens = set(words.tokens(name))
        if tokens & {"ib", "ic", "iv", "iw", "b", "c"} or (tokens & {"id", "d"} and not tokens & {"q", "iq"}):
            self.guess.left[name] = "a phase's current or a field's, by its name: it makes no torque by itself"
        elif "motor.current" in self.guess.taken:
            self.guess.left[name] = f"claims the place of {self.guess.taken['motor.current'].column!r}"
        elif {"ia", "a"} & tokens and any({"ib", "ic"} & set(words.tokens(n)) for n in self.varying):
            self.guess.left[name] = "one of several phases, by its name"
        elif self._magnitude(name):
            self.guess.left[name] = "a current by its name, never negative while the drive goes both ways: it has lost its sign"
        elif self.words[name].unit == "%":
            taken = self._take("motor.current", name, unit="%", lacks="nominal")
            taken.doubt("in % of a nominal current: nominal = A that are 100 %, of the data sheet", LIKELY)
        else:
            unit = self._electric_unit(name, ("A", "mA"))
            taken = self._take("motor.current", name, unit=unit, commanded=self.words[name].role == SETPOINT)
            self._said(name, taken, unit)

    def _torque(self, name: str) -> None:
        word = self.words[name]
        signal = "reducer.output_torque" if word.side == LOAD and word.strength == 2 else "motor.torque"
        if signal in self.guess.taken:
            self.guess.left[name] = f"claims the place of {self.guess.taken[signal].column!r}"
            return
        if self._magnitude(name):
            self.guess.left[name] = "a torque by its name, never negative while the drive goes both ways: it has lost its sign"
            return
        if word.strength < 2 and {"load", "last"} & set(words.tokens(name)):
            self.guess.left[name] = "a load by its name, of what is not told (of servos the share of their torque or duty)"
            return
        if not word.side and self.guess.ratio and "motor.current" in self.guess.taken:
            self.guess.left[name] = "a torque; of which shaft (motor.torque, reducer.output_torque) its name does not say"
            return
        x = self.columns.values[name]
        taken = self._take(signal, name, commanded=word.role == SETPOINT)
        if not word.side and self.guess.ratio:
            taken.doubt("of which shaft is not told: taken for the motor's (else reducer.output_torque)")
        whole = bool(np.all(x[np.isfinite(x)] == np.round(x[np.isfinite(x)]))) and float(np.nanmax(abs(x))) > 20.0
        if word.unit in ("%", "‰") or (not word.unit and whole and "value" in words.tokens(name)):
            taken.unit, taken.lacks = word.unit or "‰", "nominal"
            doubt = "" if word.unit else "; taken for ‰, as drives of CiA 402 tell it"
            taken.doubt(f"in {taken.unit} of a nominal torque{doubt}: nominal = N.m that are 100 %, of the data sheet", LIKELY if word.unit else UNSURE)
        elif word.unit in ("N", "kN"):
            taken.unit = word.unit
            if not self.guess.linear:
                taken.doubt("a force, and the motion turns: give the lever in factor, and unit = N.m")
                taken.unit = ""
        else:
            usual = "N" if self.guess.linear else "N.m"
            taken.unit = word.unit if word.unit in ("N.m", "mN.m", "N.cm") else usual
            self._said(name, taken, taken.unit)
        if taken.commanded:
            taken.why.append("asked for, by its name: it may rest and jump")

    def _voltage(self, name: str) -> None:
        asked = self.words[name].role == SETPOINT
        signal = "controller.voltage" if asked and "motor.voltage" in self.guess.taken else "motor.voltage"
        if signal in self.guess.taken:
            self.guess.left[name] = f"claims the place of {self.guess.taken[signal].column!r}"
        elif {"ud", "d", "ub", "uc"} & set(words.tokens(name)) - {"v"} and not {"uq", "q"} & set(words.tokens(name)):
            self.guess.left[name] = "a voltage of another phase or axis, by its name"
        elif self._magnitude(name):
            self.guess.left[name] = "a voltage by its name, never negative while the drive goes both ways: it has lost its sign"
        elif not self._base():
            self.guess.left[name] = "a voltage, by its name"
        else:
            unit = self._electric_unit(name, ("V", "mV"))
            taken = self._take(signal, name, unit=unit)
            self._said(name, taken, unit)
            if self.words[name].strength < 2 and not self._goes_with_motion(name):
                del self.guess.taken[signal]
                self.guess.left[name] = "a voltage by a letter of its name alone; it does not go with the motion"

    def _goes_with_motion(self, name: str) -> bool:
        w, a, angle = self._motion_parts()
        parts = [w, a, np.sign(w), np.ones(len(w))] if w is not None else []
        return bool(parts) and of.fitted(self.columns.mean(name), *parts)[1] < 0.8

    def _duty(self, name: str) -> None:
        if "motor.duty" in self.guess.taken:
            self.guess.left[name] = f"claims the place of {self.guess.taken['motor.duty'].column!r}"
            return
        if self._magnitude(name):
            self.guess.left[name] = "a duty by its name, never negative while the drive goes both ways: it has lost its sign"
            return
        x = self.columns.values[name]
        size = float(np.nanmax(abs(x)))
        if self.words[name].unit == "%":
            self._take("motor.duty", name, unit="%").why.append("unit % by its name")
        elif size <= 1.0001:
            self._take("motor.duty", name, unit="1").why.append("within -1 and 1")
        elif size in (100.0, 255.0, 256.0, 511.0, 512.0, 885.0, 1000.0, 1023.0, 1024.0, 2047.0, 4095.0, 32767.0):
            taken = self._take("motor.duty", name, unit="1", factor=1.0 / size)
            taken.doubt(f"its greatest value, {size:g}, was taken for the whole supply", LIKELY)
        else:
            self.guess.left[name] = f"a duty by its name, up to {size:g}; what is the whole supply is not told (motor.duty with factor)"

    def _motion_parts(self):
        """Speed, acceleration and angle of the base, in SI over the pieces."""
        taken = self.guess.taken
        speed = next((s for s in ("reducer.input_speed", "load.speed") if s in taken), "")
        angle = next((s for s in ("load.angle", "reducer.input_angle") if s in taken), "")
        if not speed and not angle:
            return None, None, None
        where = self.guess.si(angle) if angle else None
        if speed:
            w = self.guess.si(speed)
            a = self.columns.slope(taken[speed].column) * self.guess.scale(speed)
        else:
            w = self.columns.change(taken[angle].column) * self.guess.scale(angle) / self.columns.lasting
            a = np.gradient(w) / self.columns.lasting if len(w) > 2 else np.zeros(len(w))
        return w, a, where

    def _torque_by_numbers(self) -> None:
        """A channel without a name that goes with acceleration and friction as what drives a motion does."""
        w, a, angle = self._motion_parts()
        if w is None:
            return
        parts = [a, w, np.sign(w), np.ones(len(w)), *([np.cos(angle), np.sin(angle)] if angle is not None and np.ptp(angle) > 0.3 and not self.guess.linear else [])]
        found = []
        for name in self.varying:
            if name in self.guess.left or self.words[name].strength == 2 or name in {t.column for t in self.guess.taken.values()}:
                continue
            y = self.columns.mean(name)
            (inertia, damping, coulomb, *_), left = of.fitted(y, *parts)
            along = abs(of.tie(y, w).r)
            motion = any(of.proportional(self.columns, name, one.column, True).holds(0.8) for one in self.guess.taken.values())
            if left < FITS and along < 0.97 and inertia * coulomb > 0.0 and not motion:
                found.append((left, name, coulomb))
        if len(found) == 1 or (found and sorted(found)[1][0] > 2.0 * min(found)[0]):
            left, name, coulomb = min(found)
            taken = self._take("motor.torque", name, sure=UNSURE, why=[f"it goes with the acceleration and the friction of the motion ({100 * left:.0f} % is left)"])
            sign = ", below 0" if coulomb < 0.0 else ""
            taken.lacks = "factor"
            taken.doubt(f"a torque, a current, or the command that makes them: factor = {'N' if self.guess.linear else 'N.m'} for each of its units{sign}, of the data sheet")
        elif found:
            for _, name, _ in found:
                self.guess.left[name] = "it goes with the acceleration and the friction of the motion, as a torque, a current or a command does"

    def _signs(self) -> None:
        """Signs of what drives it, and what its laws say of the motor's constants."""
        guess = self.guess
        w, a, angle = self._motion_parts()
        if w is None:
            return
        taken = guess.taken
        source = next((s for s in ("motor.voltage", "motor.duty", "controller.voltage") if s in taken), "")
        ones = np.ones(len(w))
        on_motor = "reducer.input_speed" in taken or "reducer.input_angle" in taken
        ratio = guess.ratio[0] if guess.ratio and not on_motor else 1.0
        if source and "motor.current" in taken:
            u, i = guess.si(source), guess.si("motor.current")
            if source == "motor.duty":
                supply = guess.si("motor.supply_voltage") if "motor.supply_voltage" in taken else None
                u = u * supply if supply is not None else u
            (r, k, _), left = of.fitted(u, i, w, ones)
            if left < FITS and r and k:
                volt = "V" if source != "motor.duty" or "motor.supply_voltage" in taken else "of the supply"
                if k < 0.0:
                    taken[source].factor *= -1.0
                    taken[source].why.append("turned: it drives the other way")
                    r, k = -r, -k
                if r < 0.0:
                    taken["motor.current"].factor *= -1.0
                    taken["motor.current"].why.append("turned: it flows against its voltage")
                    r = -r
                for signal in (source, "motor.current"):
                    taken[signal].why.append(f"u = R i + k w holds ({100 * left:.0f} % is left)")
                    taken[signal].sure = SURE if taken[signal].sure == LIKELY else LIKELY if left < 0.2 else taken[signal].sure
                if volt == "V":
                    guess.hints["motor.resistance"] = f"u = R i + k w says about {r:.3g}, with the units taken"
                    guess.hints["motor.voltage_constant"] = f"u = R i + k w says about {k * ratio:.3g}" + (" over the ratio" if not on_motor and ratio == 1.0 else "")
            else:
                for signal in (source, "motor.current"):
                    taken[signal].why.append(f"u = R i + k w does not bear it out ({100 * left:.0f} % is left)")
                    if taken[signal].sure == SURE:
                        taken[signal].sure = LIKELY
        elif source:
            (k, _), left = of.fitted(guess.si(source), w, ones)
            (k_full, _, _, _), left = of.fitted(guess.si(source), w, np.sign(w), a, ones)
            if k < 0.0 and k_full < 0.0 and left < 0.6:
                taken[source].factor *= -1.0
                taken[source].why.append("turned: it drives the other way")
        for signal in ("motor.torque", "motor.current", "reducer.output_torque"):
            if signal not in taken or (signal == "motor.current" and source):
                continue
            self._sign_of_torque(signal, w, a, angle)

    def _sign_of_torque(self, signal: str, w, a, angle) -> None:
        one, y = self.guess.taken[signal], self.guess.si(signal)
        parts = [np.sign(w), a, np.ones(len(w))]
        if angle is not None and np.ptp(angle) > 0.3 and not self.guess.linear:
            parts += [np.cos(angle), np.sin(angle)]
        moves = abs(w) > 0.05 * np.nanmax(abs(w))
        (coulomb, inertia, *_), left = of.fitted(np.where(moves, y, np.nan), *parts)
        if not self._both_ways():
            if one.sure == SURE:
                one.sure = LIKELY
            one.why.append("its sign is not told: the log goes one way")
            return
        if left > 0.7 or not np.isfinite(coulomb):
            one.why.append("its sign is not told by this log")
            return
        rubs = coulomb * float(np.sqrt(np.mean(moves)))
        pulls = inertia * float(np.sqrt(np.nanmean(a * a)))
        size = float(np.sqrt(np.nanmean(y * y)))
        if rubs < -0.2 * size and pulls < 0.2 * size:
            one.factor *= -1.0
            one.why.append("turned: as it stood friction would have driven")
        elif rubs > 0.2 * size and pulls > -0.2 * size:
            one.why.append("it goes against friction, as what drives does")
            if one.sure == LIKELY and self.words[one.column].unit == one.unit and not one.lacks:
                one.sure = SURE

    def _lone_letters(self) -> None:
        """Motions that a letter of a name claims, and that nothing in the log bears out, are left open; with them what was told by them."""
        taken = self.guess.taken
        moves = [s for s in taken if s.startswith(("reducer.input_", "load."))]
        weak = [s for s in moves if self.words[taken[s].column].strength < 2 and not self.words[taken[s].column].unit]
        if not moves or weak != moves or len(moves) > 1 or "controller.angle_setpoint" in taken or "controller.speed_setpoint" in taken:
            return
        if any("holds" in why or "against friction" in why for one in taken.values() for why in one.why):
            return
        for signal, one in list(taken.items()):
            if signal != "motor.supply_voltage":
                self.guess.left[one.column] = f"{signal} by a letter of its name alone, which nothing bears out"
                del taken[signal]

    # --- the rest

    def _beside(self) -> None:
        for name in self._of(TEMPERATURE):
            if "motor.temperature" not in self.guess.taken:
                taken = self._take("motor.temperature", name, unit=self.words[name].unit or "degC")
                x = self.columns.values[name]
                if not (-30.0 < float(np.nanmin(x)) and float(np.nanmax(x)) < 250.0):
                    taken.doubt("no temperature of a motor in degC, by its size")
        marks = [n for n in self.columns.values if self.words[n].quantity == words.FLAG]
        for name in marks:
            x = self.columns.values[name]
            good = x[np.isfinite(x)]
            says = {"enable", "enabled", "valid", "freigabe"} & set(words.tokens(name))
            if says and len(good) and set(np.unique(good)) == {0.0, 1.0} and np.mean(good) > 0.3 and not self.guess.valid:
                self.guess.valid = name
                self.guess.left.pop(name, None)

    def _rest(self) -> None:
        """What has no place, and what it looks like."""
        placed = {one.column for one in self.guess.taken.values()}
        base = self._base()
        motion = {}
        w, a, _ = self._motion_parts()
        if w is not None:
            motion = {"the speed": w, "the acceleration": a}
        for name in self.varying:
            if name in placed or name == self.guess.valid:
                continue
            x = self.columns.values[name]
            step = of.grain(x)
            looks = [f"{np.nanmin(x):.4g} to {np.nanmax(x):.4g}", *([f"steps of {step:.4g}"] if step else [])]
            for one in self.guess.taken.values():
                tie = of.proportional(self.columns, name, one.column, True)
                if tie.holds(0.9):
                    looks.append(f"goes with {one.column!r} (r = {tie.r:.2f})")
                    break
            else:
                for what, part in motion.items():
                    tie = of.tie(self.columns.mean(name), part)
                    if tie.pieces >= of.FEWEST and abs(tie.r) > 0.8 and base:
                        looks.append(f"goes with {what} of {self.guess.taken[base].column!r} (r = {tie.r:.2f})")
                        break
            claim = self.words[name]
            if name in self.guess.left:
                looks.insert(0, self.guess.left[name])
            elif claim.quantity:
                looks.insert(0, f"{claim.quantity}, by its name")
            self.guess.left[name] = "; ".join(looks)


def _slip(factor: float) -> bool:
    """Whether a factor between two channels may be one between units."""
    return any(abs(max(factor, 1.0 / factor) / slip - 1.0) < 0.03 for slip in SLIPS)


def _counts_rows(x: np.ndarray) -> bool:
    steps = np.diff(x)
    return len(x) > 10 and bool(np.all(steps[:10000] == 1.0))


def _by_grain(step: float, quantity: str, row: float) -> tuple[str, str, str]:
    """The unit of a motion by the step in which it is told: whole counts of a turn, of a turn in a row's time, whole rpm."""

    def counts(turn: float) -> int | None:
        n = turn / step
        near = round(n)
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
            n = turn / (step * row)
            near = round(n)
            if near in ROUND and abs(n / near - 1.0) < 2e-3:
                return unit, LIKELY, f"in steps of a turn's {near}th in a row's time, in {unit}"
    return "", UNSURE, ""


def _tie_error(columns: Columns, a: str, b: str, first: str, second: str) -> float:
    """Relative error of a ratio."""
    if first.endswith("angle") == second.endswith("angle"):
        return of.proportional(columns, a, b, first.endswith("angle")).spread
    return (of.integral(columns, a, b) if first.endswith("angle") else of.integral(columns, b, a)).spread


def tally(guess: Guess) -> Counter:
    """How many columns are how sure."""
    return Counter(one.sure for one in guess.taken.values())
