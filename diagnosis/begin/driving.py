"""What drives a motion: voltage, duty, current, torque and supply, by their names and by the laws that tie them to it."""

from __future__ import annotations

import numpy as np

from ..rules import RULES
from . import numbers as of
from . import words
from .guess import Taken
from .raw import LIKELY, SURE, UNSURE
from .shafts import Shafts
from .words import CURRENT, DUTY, LOAD, SETPOINT, SUPPLY, TORQUE, VOLTAGE

DRIVEN = {"motor.voltage", "motor.duty", "controller.voltage", "motor.current", "motor.torque", "reducer.output_torque"}
"""Signals that say what drives a motion."""


class Driving(Shafts):
    """What is beside the motions."""

    def electric(self) -> None:
        """Voltage, duty, current, torque, temperature, supply."""
        self._supply()
        for quantity, put in ((CURRENT, self._current), (TORQUE, self._torque), (VOLTAGE, self._voltage), (DUTY, self._duty)):
            for name in sorted(self._of(quantity), key=lambda n: (self.words[n].role == SETPOINT, -self.words[n].strength)):
                put(name)
        self._command()
        if self._base() and not DRIVEN & set(self.guess.taken):
            self._torque_by_numbers()
        self._unsupplied()
        self._signs()
        self._lone_letters()

    def _supply(self) -> None:
        for name in self._of(SUPPLY, VOLTAGE):
            x = self.columns.values[name]
            steady = float(np.nanmin(x)) > 0.4 * float(np.nanmax(x)) > 0.0 and float(np.nanstd(x)) < 0.15 * float(np.nanmean(x))
            said = self.words[name].quantity == SUPPLY
            if not (said or (steady and self._pace_changes())):
                continue
            if "motor.supply_voltage" in self.guess.taken:
                self.guess.left[name] = "another supply, by its name"
                continue
            taken = self._take("motor.supply_voltage", name, unit=self._electric_unit(name, ("V", "mV")))
            taken.why.append("positive and steady" if steady else "not steady")
            taken.sure = SURE if said and steady else UNSURE if not said else LIKELY

    def _pace_changes(self) -> bool:
        """Whether the speed changes by much: the voltage on a motor would, too."""
        w = self._motion_parts()[0]
        return w is not None and bool(np.nanstd(w) > 0.3 * np.sqrt(np.nanmean(w * w)))

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
        left = (
            of.fitted(y - np.nanmean(y), w, np.sign(w), a)[1] if w is not None else 1.0
        )  # a weight keeps a sign, friction shows
        return float(np.nanmin(x)) < 0.05 * float(np.nanmax(x)) or left > 0.9

    def _said(self, name: str, taken: Taken, unit: str) -> None:
        """How sure a unit is."""
        if self.words[name].unit == unit:
            taken.why.append(f"unit {unit} by its name")
        else:
            x = self.columns.values[name]
            whole = bool(np.all(x == np.round(x))) and float(np.ptp(x)) > 20.0
            taken.doubt(f"no unit is said: {unit} was taken", LIKELY if unit in ("A", "V") and not whole else UNSURE)

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
        signal = "reducer.output_torque" if word.side == LOAD and word.strength >= 2 else "motor.torque"
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
            taken.doubt(
                f"in {taken.unit} of a nominal torque{doubt}: nominal = N.m that are 100 %, of the data sheet",
                LIKELY if word.unit else UNSURE,
            )
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
            self._commanded(name, f"a duty by its name, up to {size:g}, and what is the whole supply is not told")

    def _command(self) -> None:
        """What a name says was asked for, and not what of: where nothing else drives the motion, it is the voltage's share."""
        asked = [name for name in self._of("", role=SETPOINT) if not self._magnitude(name)]
        if asked and self._base() and not DRIVEN & set(self.guess.taken):
            size = float(np.nanmax(abs(self.columns.values[asked[0]])))
            self._commanded(asked[0], f"asked for, by its name, up to {size:g}, and what of is not told: taken for a duty (PWM)")

    def _commanded(self, name: str, why: str) -> None:
        """A share of the supply whose whole nobody says."""
        supplied = "motor.supply_voltage" in self.guess.taken
        taken = self._take("motor.duty" if supplied else "motor.voltage", name, lacks="factor", sure=UNSURE)
        taken.why = [why]
        taken.doubt(f"factor = {'1' if supplied else 'the volts of the supply'} over the command that is all of it, such as 255")

    def _unsupplied(self) -> None:
        """A duty beside which nothing has the supply: the voltage, as a share of what somebody has to give."""
        taken = self.guess.taken
        if "motor.duty" in taken and not {"motor.supply_voltage", "motor.voltage", "controller.voltage"} & set(taken):
            one = taken.pop("motor.duty")
            one.signal, one.lacks = "motor.voltage", one.lacks or "nominal"
            one.doubt("a duty, and no column has the supply: nominal = its volts", LIKELY)
            taken["motor.voltage"] = one

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
        parts = [
            a,
            w,
            np.sign(w),
            np.ones(len(w)),
            *([np.cos(angle), np.sin(angle)] if angle is not None and np.ptp(angle) > 0.3 and not self.guess.linear else []),
        ]
        found = []
        for name in self.varying:
            if name in self.guess.left or self.words[name].strength >= 2 or name in {t.column for t in self.guess.taken.values()}:
                continue
            y = self.columns.mean(name)
            (inertia, damping, coulomb, *_), left = of.fitted(y, *parts)
            along = abs(of.tie(y, w).r)
            motion = any(of.proportional(self.columns, name, one.column, True).holds(0.8) for one in self.guess.taken.values())
            if left < RULES.begin.fits and along < 0.97 and inertia * coulomb > 0.0 and not motion:
                found.append((left, name, coulomb))
        if len(found) == 1 or (found and sorted(found)[1][0] > 2.0 * min(found)[0]):
            left, name, coulomb = min(found)
            taken = self._take(
                "motor.torque",
                name,
                sure=UNSURE,
                why=[f"it goes with the acceleration and the friction of the motion ({100 * left:.0f} % is left)"],
            )
            sign = ", below 0" if coulomb < 0.0 else ""
            taken.lacks = "factor"
            taken.doubt(
                f"a torque, a current, or the command that makes them: factor = {'N' if self.guess.linear else 'N.m'} for each of its units{sign}, of the data sheet"
            )
        elif found:
            for _, name, _ in found:
                self.guess.left[name] = (
                    "it goes with the acceleration and the friction of the motion, as a torque, a current or a command does"
                )

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
            if left < RULES.begin.fits and r and k:
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
                    said = bool(self.words[taken[signal].column].unit)  # the law holds in any unit
                    if taken[signal].sure == LIKELY and said:
                        taken[signal].sure = SURE
                    elif taken[signal].sure == UNSURE and left < 0.2:
                        taken[signal].sure = LIKELY
                if volt == "V" and not taken[source].lacks:
                    guess.hints["motor.resistance"] = f"u = R i + k w says about {r:.3g}, with the units taken"
                    guess.hints["motor.voltage_constant"] = f"u = R i + k w says about {k * ratio:.3g}" + (
                        " over the ratio" if not on_motor and ratio == 1.0 else ""
                    )
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
        if (
            not moves
            or weak != moves
            or len(moves) > 1
            or "controller.angle_setpoint" in taken
            or "controller.speed_setpoint" in taken
        ):
            return
        if any("holds" in why or "against friction" in why for one in taken.values() for why in one.why):
            return
        drivers = [one.column for signal, one in taken.items() if signal in ("motor.torque", "motor.current", "motor.voltage")]
        if any(self.words[column].strength >= 2 for column in drivers):
            return
        for signal, one in list(taken.items()):
            if signal != "motor.supply_voltage":
                self.guess.left[one.column] = f"{signal} by a letter of its name alone, which nothing bears out"
                del taken[signal]
