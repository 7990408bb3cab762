"""Of which shaft a motion is, what was asked for and what was measured, which way is positive, and the gear's ratio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..rules import RULES
from . import numbers as of
from . import words
from .guess import FACTORS, SLIPS
from .measures import Measures
from .numbers import Columns
from .raw import LIKELY, SURE, UNSURE
from .words import ANGLE, LOAD, MOTOR, SETPOINT, SPEED, Word


class Shafts(Measures):
    """The motions of a drive."""

    def motions(self) -> None:
        """The measured angles and speeds of both shafts, with units and signs; set-points; the ratio."""
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
                best = max(
                    mine,
                    key=lambda n: (
                        self.words[n].strength,
                        self.words[n].role == words.ACTUAL,
                        -of.roughness(self.columns.values[n]),
                    ),
                )
                taken = self._take(signal, best)
                for other in mine:
                    if other != best and self.words[best].strength == 3 and self._asks(other):
                        self.words[other] = replace(self.words[other], role=SETPOINT)
                    elif other != best:
                        tie = of.proportional(self.columns, other, best, quantity == ANGLE)
                        same = (
                            f"goes as {best!r} does (r = {tie.r:.3f}, factor {tie.factor:.4g})"
                            if abs(tie.r) > RULES.begin.same
                            else f"claims the place of {best!r}"
                        )
                        self.guess.left[other] = same
                        if abs(tie.r) < RULES.begin.borne_out:
                            taken.doubt(f"{other!r} claims the same place, and is another motion")
                if best in base:
                    taken.doubt(base[best])
        self._units()
        self._orient()
        self._setpoints()
        self._ratio()

    def _asks(self, name: str) -> bool:
        """Whether a run's result is of a component that says no more than motions: of a manoeuvre."""
        whole = f"{name.partition('.')[0]}."
        return "." in name and all(w.quantity in (ANGLE, SPEED) for n, w in self.words.items() if n.startswith(whole))

    def _lone_setpoints(self, actual: dict[str, list[str]]) -> None:
        """Of two channels that are one motion, and of which no name says so, the one that leads without noise is asked for."""
        if any(word.strength == 3 for word in self.words.values()):
            return  # in a run's results what leads by a row is an input of the step
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
                        self.words[first] = Word(
                            first, quantity, word.side, SETPOINT, word.unit, word.said, word.strength, word.rest
                        )
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
                for other in sorted(names, key=lambda n: quantity[n] != quantity[name]):  # like with like first
                    factor = relation(name, other) if side[other] and other != name else None
                    if factor is None:
                        continue
                    if RULES.begin.one_shaft[0] < factor < RULES.begin.one_shaft[1]:
                        side[name] = side[other]
                    elif factor < RULES.begin.other_shaft and side[other] == MOTOR:
                        side[name] = LOAD
                    elif factor > 1.0 / RULES.begin.other_shaft and side[other] == LOAD:
                        side[name] = MOTOR
                    else:
                        continue
                    break
        unknown = [n for n in names if not side[n]]
        if not unknown:
            return doubts
        first = max(unknown, key=lambda n: float(np.nansum(abs(self._si_change(n, quantity[n])))))
        counted = lambda n: "counts" in (self._unit(n, quantity[n])[0], self._unit(first, quantity[first])[0])
        apart = lambda n: (
            (f := relation(n, first)) is not None
            and f < RULES.begin.other_shaft
            and not counted(n)
            and (self._scaled(n, quantity, first) or not _slip(f))
        )
        others = [n for n in unknown if n != first and apart(n)]
        taken = set(side.values()) - {""}
        if others or LOAD in taken:
            side[first] = MOTOR
        elif MOTOR in taken:
            side[first] = LOAD
        else:
            scaled = [n for n in unknown if self._unit(n, quantity[n])[0]]
            fast = max(self._fastest(n, quantity[n]) for n in scaled or [first])
            side[first] = (
                MOTOR
                if fast > RULES.begin.motor_speed or self.words[first].unit == "rpm" and fast > 0.5 * RULES.begin.motor_speed
                else LOAD
            )
            where = "motor's" if side[first] == MOTOR else "load's"
            word = "reducer.input_..." if side[first] == LOAD else "load...."
            doubts[first] = f"shaft not told, taken for the {where} (else {word})"
        for name in unknown:
            if not side[name]:
                side[name] = LOAD if name in others and side[first] == MOTOR else side[first]
                if name in others:
                    doubts[name] = (
                        f"it goes {1.0 / (relation(name, first) or 1.0):.4g} times less far than {first!r}: taken for the other shaft"
                    )
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
        if not tie.holds(RULES.begin.borne_out):
            return None
        if a != b and not self._clocked():
            return 1.0  # without a time nothing is known of it
        return abs(tie.factor) * self._guessed(name, a) / self._guessed(other, b)

    def _si_change(self, name: str, quantity: str) -> np.ndarray:
        x = self.columns.change(name) if quantity == ANGLE else self.columns.way(name)
        return x * self._guessed(name, quantity)

    def _fastest(self, name: str, quantity: str) -> float:
        """rad/s that are rarely exceeded."""
        with np.errstate(all="ignore"):
            speed = abs(self._si_change(name, quantity)) / self.columns.lasting
        return float(np.nanquantile(speed, 0.98)) if len(speed) else 0.0

    def _base(self) -> str:
        """The channel whose direction is positive."""
        return next(
            (s for s in ("load.angle", "load.speed", "reducer.input_speed", "reducer.input_angle") if s in self.guess.taken), ""
        )

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
        motion = ANGLE if measured.endswith("angle") else SPEED
        tie = self._tie(name, one.column, quantity, motion)
        word = self.words[name]
        turning = {True: ("rad", "deg", "turn", "m", "mm"), False: ("rad/s", "rpm", "deg/s", "turn/s", "m/s", "mm/s")}[
            quantity == ANGLE
        ]
        # SI for each unit of the set-point, if the drive goes where it is sent
        wanted = guess.scale(measured) / tie.factor if tie.factor else float("nan")
        fits = [u for u in turning if abs(FACTORS[u] / abs(wanted) - 1.0) < 0.25]
        alike = abs(abs(tie.factor) - 1.0) < 0.25
        if word.strength == 0 and motion == quantity == SPEED and tie.holds(0.8) and not fits and not alike:
            self.words[name] = replace(word, quantity="")  # a voltage goes with its speed, too
            return
        taken = self._take(signal, name)
        if one.unsaid and not word.unit:
            taken.unsaid = True
            taken.doubt(f"its unit as that of {one.column!r}, which nobody says")
        side = measured.startswith("reducer.") and word.side != MOTOR
        if word.unit in FACTORS:
            taken.unit = word.unit
        if not tie.holds(0.8):
            taken.unit = taken.unit or (one.unit if motion == quantity else "")
            taken.factor = one.factor if motion == quantity and taken.unit == one.unit else 1.0
            taken.doubt(f"{one.column!r} does not follow it closely {tie.told}")
            return
        taken.why.append(f"{one.column!r} follows it (r = {tie.r:.3f})")
        if motion == quantity and alike and not word.unit:
            taken.unit, taken.factor = one.unit, float(np.copysign(one.factor, tie.factor * one.factor))
        elif taken.unit:
            taken.factor = -1.0 if wanted < 0.0 else 1.0
            if taken.unit not in fits:
                taken.doubt(
                    f"by its unit it asks for {FACTORS[taken.unit] / abs(wanted):.4g} times the way of {one.column!r}: of the other shaft?"
                )
        elif fits:
            taken.unit, taken.factor = fits[0], -1.0 if wanted < 0.0 else 1.0
        else:
            taken.factor = wanted
            taken.doubt(f"factor {wanted:.4g}, by {one.column!r}")
        if abs(tie.r) > RULES.begin.same and not guess.taken[measured].sure == UNSURE:
            taken.sure = SURE if word.strength >= 2 else LIKELY
        if side:
            taken.doubt(
                "a set-point is of the load's side, and what goes with it is the motor's motion: factor over the gear's ratio"
            )
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
        for first, second in (
            ("reducer.input_angle", "load.angle"),
            ("reducer.input_speed", "load.speed"),
            ("reducer.input_speed", "load.angle"),
            ("reducer.input_angle", "load.speed"),
        ):
            if first not in self.guess.taken or second not in self.guess.taken:
                continue
            a, b = self.guess.taken[first], self.guess.taken[second]
            factor = self._si_factor(first, second)
            if factor is None:
                continue
            error = max(_tie_error(self.columns, a.column, b.column, first, second), 1e-6) * abs(factor)
            by = f"{a.column!r} over {b.column!r}"
            alike = first.rpartition("_")[2] == second.rpartition(".")[2]  # two angles without a unit have the same one
            alike = alike and first.endswith("angle")  # speeds are rpm at one shaft and rad/s at the other
            self.guess.firm = a.unsaid == b.unsaid if alike else not (a.unsaid or b.unsaid)
            if self.guess.firm and a.unsaid:
                by += ", if both are in one unit"
            if not self.guess.firm:
                by += f", if their units are {a.unit} and {b.unit}"
            elif "told as that turning" in " ".join((*a.why, *b.why)):
                by += ", by the making of that factor"
            self.guess.ratio = (abs(factor), error, by)
            for one in (a, b):
                one.why.append("both shafts go together")
                word = self.words[one.column]
                if word.unit and word.side and one.sure == LIKELY:
                    one.sure = SURE
            return


def _slip(factor: float) -> bool:
    """Whether a factor between two channels may be one between units."""
    return any(abs(max(factor, 1.0 / factor) / slip - 1.0) < 0.03 for slip in SLIPS)


def _tie_error(columns: Columns, a: str, b: str, first: str, second: str) -> float:
    """Relative error of a ratio."""
    if first.endswith("angle") == second.endswith("angle"):
        return of.proportional(columns, a, b, first.endswith("angle")).spread
    return (of.integral(columns, a, b) if first.endswith("angle") else of.integral(columns, b, a)).spread
