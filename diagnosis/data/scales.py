"""Numbers that are a unit off where no balance of torques tells: a coil's inductance, a shaft's stiffness, a controller's gains and limits.

    u - R i - k_e w = L di/dt          what the voltage leaves for the inductance
    d phi = P / k                      how far a shaft winds up under what it carries
    U = k_phi e + k_w de/dt            the controller's command within its limits, eq 21, 22

A log that says nothing of such a number is told as one: a slip of its unit would not change what is found here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import product
from math import degrees, pi, sqrt

import numpy as np

from ..rules import RULES
from .balances import CURRENT, KE, KT, R, heaviest, input_speed, motor_volts, rms
from .finding import Finding, Said
from .lifting import LIMITS
from .motions import RATIO, near, number
from .pieces import Pieces

COIL, SHAFT, GAIN, DAMPS = "motor.inductance", "reducer.shaft_stiffness", "controller.angle_gain", "controller.speed_gain"
DEGREE, ARCMIN = 180.0 / pi, 60.0 * 180.0 / pi
SLIPS = {
    COIL: (1e3,),
    SHAFT: (1.0 / DEGREE,),
    GAIN: (1e3, 1e-3),
    DAMPS: (1e3, 1e-3),
    LIMITS[0]: (1e3, 1e-3),
    LIMITS[1]: (1e3, 1e-3),
}
"""By what a number is too large where its unit was another: mH, N.m/deg, mV, kV."""


def scales(pieces: Pieces, said: Said, suspects: set[str], parts: Iterable[str]) -> tuple[list[Finding], list[str]]:
    """Findings about these numbers, and which of those that were given this log says nothing of. parts: components that are simulated."""
    checks: dict[str, Callable[[Said], list[Finding]]] = {
        COIL: lambda it: coil(pieces, it, suspects),
        SHAFT: lambda it: shaft(pieces, it, suspects),
        LIMITS[1]: lambda it: limits(pieces, it, suspects),
        GAIN: lambda it: gains(pieces, it, suspects),
    }
    checks |= {LIMITS[0]: checks[LIMITS[1]], DAMPS: checks[GAIN]}
    asked = {name: check for name, check in checks.items() if name.partition(".")[0] in parts}
    found = [finding for check in dict.fromkeys(asked.values()) for finding in check(said)]
    about = {name for finding in found for name in finding.about}
    silent = []
    for name, check in asked.items():
        given = said.given(name) and said.prefix + name not in said.rig.uncertain and said.value(name)
        if given and name not in about and not any(_would_tell(check, said, name, times) for times in SLIPS[name]):
            silent.append(said.prefix + name)
    return found, silent


def _would_tell(check: Callable[[Said], list[Finding]], said: Said, name: str, times: float) -> bool:
    """Whether a number that much larger would be told."""
    slipped = replace(said, values={**said.values, said.prefix + name: times * said.value(name)})
    return any(name in finding.about for finding in check(slipped))


def coil(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """An inductance that takes more than the voltage leaves, or that no winding has beside its resistance."""
    value, resistance = max(said.ends(COIL)), said.value(R)
    if not said.given(COIL) or not value or suspects & {R, KE}:
        return []
    name, full = said.prefix + COIL, f"{said.prefix}{COIL} = {value:g} H"
    left = _left_for_coil(pieces, said, suspects)
    if left is not None:
        u_name, rest, change = left
        if (times := value * rms(change) / (rms(rest) or 1e-300)) > RULES.data.gross and rms(change):
            text = f"{full} takes {number(times)} times what {said(u_name)} has beyond R i + k_e w while {said(CURRENT)} changes"
            slips = [
                f"{unit} given as H? Write {name} = {value * share:.4g}"
                for unit, share in MILLI
                if times * share < RULES.data.gross
            ]
            return [Finding(f"{text}: {slips[0] if slips else 'look at its unit (H)'}.", True, (COIL,))]
    if not resistance:
        return []
    lasts = value / resistance
    begin = f"{full} beside {said.prefix}{R} = {resistance:g} Ohm is a time constant of {number(lasts)} s, and windings have 0.01 ms to 0.1 s"
    if lasts > RULES.data.slow_coil:
        fits = [(unit, share) for unit, share in MILLI if RULES.data.fast_coil < lasts * share < RULES.data.slow_coil]
        slip = f"{fits[0][0]} given as H? Write {name} = {value * fits[0][1]:.4g}" if fits else "look at the units of both"
        return [Finding(f"{begin}: {slip}.", False, (COIL,))]
    if lasts < RULES.data.fast_coil:
        return [Finding(f"{begin}: henries are asked for, and sheets have mH; {value * 1e3:.4g} or so would do.", False, (COIL,))]
    return []


MILLI = (("mH", 1e-3), ("µH", 1e-6))


def _left_for_coil(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[str, np.ndarray, np.ndarray] | None:
    """The voltage's name; what it has beyond resistance and speed, V, and the current's rate, A/s, over pieces."""
    volts, motion = motor_volts(pieces, said), input_speed(pieces, said, suspects)
    if volts is None or motion is None or not pieces.has(CURRENT) or suspects & {volts[0], CURRENT, motion[0], RATIO}:
        return None
    (u_name, u), (_, w) = volts, motion
    i, change = pieces.mean(CURRENT), pieces.at_ends(CURRENT) / pieces.lasting
    sound = np.isfinite(u) & np.isfinite(w) & np.isfinite(i) & np.isfinite(change)
    if said.rig.kind == "steady" or sound.sum() < RULES.data.fewest_pieces:
        return None
    rests = [u[sound] - r * i[sound] - k * w[sound] for r, k in product(said.ends(R), said.ends(KE))]
    return u_name, max(rests, key=rms), change[sound]


def shaft(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """A stiffness with which the output would wind up farther than both shafts' angles say, or than any gear does."""
    value = max(said.ends(SHAFT))
    if (
        not said.given(SHAFT)
        or not value
        or suspects & {RATIO, "load.mass", "load.arm", "load.angle", "reducer.input_angle", "load.constant_torque"}
    ):
        return []
    carried, by = _carried(pieces, said, suspects)
    full = f"{said.prefix}{SHAFT} = {value:g} {'N/m' if said.linear else 'N.m/rad'}"
    if (seen := _wound_up(pieces, said, carried / value)) is not None:
        asked, measured = seen
        if asked > RULES.data.gross * measured > 0.0:
            text = f"with {full} the output winds up by {number(asked)} {'m' if said.linear else 'rad'} rms under {by}, and {said('reducer.input_angle')} and {said('load.angle')} leave {number(measured)}"
            return [Finding(f"{text}: {_stiffer(said, value, measured / asked * RULES.data.gross)}.", True, (SHAFT,))]
    most = float(np.nanmax(abs(carried), initial=0.0)) / value
    if said.linear:
        return []
    if most > RULES.data.limp:
        text = f"with {full} the output winds up by {number(degrees(most))} degrees under {by}"
        return [
            Finding(
                f"{text}, and gears do by a degree or two: {_stiffer(said, value, RULES.data.limp / most)}.",
                most > RULES.data.gross * RULES.data.limp,
                (SHAFT,),
            )
        ]
    inertia = max(said.ends("load.inertia")) * said.given("load.inertia") + said.value("load.mass") * said.value("load.arm") ** 2
    if inertia and (pace := sqrt(value / inertia) / (2.0 * pi)) < RULES.data.slow_shaft:
        text = f"with {full} the load swings at {number(pace)} Hz on the gear's shaft, and gears hold it stiffer"
        return [Finding(f"{text}: {_stiffer(said, value, (pace / RULES.data.slow_shaft) ** 2)}.", False, (SHAFT,))]
    return []


def _stiffer(said: Said, value: float, most: float) -> str:
    """Which unit it may have been. most: share of the wind-up that may be left."""
    units = (("N/mm", 1e3), ("N/µm", 1e6)) if said.linear else (("N.m/deg", DEGREE), ("N.m/arcmin", ARCMIN))
    fits = [
        f"{said.prefix}{SHAFT} = {round4(value * times)}, if {value:g} is in {unit}"
        for unit, times in units
        if 1.0 / times < most
    ]
    return f"write {' or '.join(fits)}" if fits else f"look at its unit ({'N/m' if said.linear else 'N.m/rad'})"


def _carried(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[np.ndarray, str]:
    """What the output shaft carries at least, N.m over pieces, and what tells it."""
    none = np.zeros(len(pieces.lasting))
    if pieces.has("reducer.output_torque"):
        return pieces.mean("reducer.output_torque"), f"the torque of {said('reducer.output_torque')}"
    pull = said.value("load.constant_torque") * (said.prefix + "load.constant_torque" not in said.rig.uncertain)
    weight = heaviest(said) * (said.prefix + "load.mass" not in said.rig.uncertain)
    if weight and pieces.has("load.angle"):
        return pull + weight * np.cos(pieces.mean("load.angle") + said.value("load.arm_angle")), "the load's weight"
    if weight or pull:
        return none + abs(pull) + 0.5 * weight, "the load"
    if said.given(KT) and pieces.has(CURRENT) and not suspects & {CURRENT, KT}:
        push = max(said.ends(KT)) * pieces.mean(CURRENT) * said.value(RATIO)
        return push / RULES.data.gross, f"a fifth of what the motor gives with {said(CURRENT)}"  # friction takes the rest
    return none, ""


def _wound_up(pieces: Pieces, said: Said, twist: np.ndarray) -> tuple[float, float] | None:
    """rms of a twist and of the measured one, without what a zero and a ratio that is a little off make of both."""
    shafts = ("reducer.input_angle", "load.angle")
    if not all(map(pieces.has, shafts)):
        return None
    angle = pieces.mean(shafts[1])
    apart = pieces.mean(shafts[0]) / said.value(RATIO) - angle
    sound = np.isfinite(apart) & np.isfinite(twist)
    if sound.sum() < RULES.data.fewest_pieces or not np.ptp(angle[sound]):
        return None
    lines = np.column_stack([np.ones(sound.sum()), angle[sound]])
    both = np.column_stack([twist[sound], apart[sound]])
    left = both - lines @ np.linalg.lstsq(lines, both, rcond=None)[0]
    return rms(left[:, 0]), rms(left[:, 1])


def limits(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """A limit that the voltage passes by far, or that no supply of a drive has; of a duty one that is none."""
    if pieces.has("motor.duty") and not any(map(pieces.has, ("controller.voltage", "motor.voltage"))):
        return _duties(said)
    found, extremes = [], _extremes(pieces, suspects)
    for side, name in zip((-1.0, 1.0), LIMITS):
        given, value = said.given(name), side * (max if side > 0.0 else min)(said.ends(name))
        had = max(side * extremes[1][int(side > 0.0)], 0.0) if extremes else 0.0
        full = f"{said.prefix}{name} = {side * value:g} V"
        if extremes and had > RULES.data.gross * max(value, 0.0) and had > RULES.data.surely * max(map(abs, extremes[1])):
            text = f"{said(extremes[0])} goes to {side * had:.3g} V, beyond {full}, which no command of the controller passes"
            slip = (
                f"kV given as V? Write {said.prefix}{name} = {1e3 * side * value:.4g}"
                if value > 0.0 and near(had / value, 1e3, 5.0)
                else f"write {said.prefix}{name} = {-side * value:.4g}"
                if near(-value, had, 5.0)
                else "look at its sign and its unit (V)"
            )
            found.append(Finding(f"{text}{'' if given else ' and was assumed'}: {slip}.", True, (name,)))
        elif given and value > RULES.data.most_volts:
            beside = f", and {said(extremes[0])} stays within {max(map(abs, extremes[1])):.3g} V" if extremes else ""
            found.append(
                Finding(
                    f"{full} is more than drives have{beside}: mV given as V? Write {said.prefix}{name} = {1e-3 * side * value:.4g}.",
                    False,
                    (name,),
                )
            )
    return found


def _duties(said: Said) -> list[Finding]:
    """Limits in V where the controller commands a share of its supply."""
    most = 1.0 + RULES.data.known_slip
    wrong = [name for name in LIMITS if said.given(name) and min(map(abs, said.ends(name))) > most]
    if not wrong:
        return []
    told = " and ".join(f"{said.prefix}{name} = {said.value(name):g}" for name in wrong)
    text = f"{told}, and what drives this log is {said('motor.duty')}, a share of its supply between -1 and 1"
    mend = "write -1 and 1, and the gains per rad, what they are in V over the supply's volts"
    return [Finding(f"{text}: {mend}.", False, tuple(wrong))]


def _extremes(pieces: Pieces, suspects: set[str]) -> tuple[str, tuple[float, float]] | None:
    """The voltage's name, and between what nearly all of it lies, V."""
    for name in ("controller.voltage", "motor.voltage"):
        if pieces.has(name) and name not in suspects:
            full = pieces.prefix + name
            x = np.concatenate([run.signals[full][run.usable(full)] for run in pieces.runs])
            x = x[np.isfinite(x)]
            if len(x):
                low, high = np.quantile(x, RULES.data.range_quantiles)
                return name, (float(low), float(high))
    return None


def gains(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """Gains that make a voltage of the errors that is another by far: where it follows them, or none that could drive the motion."""
    given = [name for name in (GAIN, DAMPS) if said.given(name) and said.prefix + name not in said.rig.uncertain]
    errors = _errors(pieces, said, suspects)
    told = _command(pieces, said, suspects)
    if not given or errors is None or told is None:
        return []
    u_name, u = told
    sound = np.isfinite(u) & np.all(np.isfinite(errors), axis=1)
    sound &= abs(u) < RULES.data.unlimited * np.nanmax(abs(u), initial=0.0)
    if sound.sum() < RULES.data.fewest_pieces:
        return []
    u, errors = _centred(u[sound]), _centred(errors[sound])
    size = np.sqrt(np.mean(errors**2, axis=0))
    scaled = errors / np.where(size, size, 1.0)
    fitted = np.linalg.lstsq(scaled, u, rcond=None)[0]
    if not rms(u) or rms(u - scaled @ fitted) > RULES.data.mended * rms(u):
        return []  # it follows something else, too
    found = []
    for name, unit, made, wide in zip((GAIN, DAMPS), ("V/rad", "V.s/rad"), fitted, size):
        value = said.value(name)
        if name not in given or not wide or not value:
            continue
        times = value * wide / (abs(made) if abs(made) > RULES.data.told_share * rms(u) else rms(u))
        firm = abs(made) > RULES.data.told_share * rms(u)
        if times > RULES.data.gross_beside or (firm and times < 1.0 / RULES.data.gross_beside):
            found.append(Finding(_gain_text(said, u_name, name, unit, value, times, made / wide if firm else 0.0), True, (name,)))
    return found


def _gain_text(said: Said, u_name: str, name: str, unit: str, value: float, times: float, seen: float) -> str:
    full = f"{said.prefix}{name} = {value:g} {unit}"
    much = f"{number(times)} times" if times > 1.0 else f"1/{number(1.0 / times)} times"
    text = f"{full} makes {much} the voltage of {said(u_name)} of what its set-point is missed by"
    units = ((1e-3, f"m{unit}"), (1e3, unit.replace("rad", "mrad")), (DEGREE, unit.replace("rad", "deg")))
    fits = [
        f"{said.prefix}{name} = {round4(value * share)}, if {value:g} is in {what}"
        for share, what in units
        if (near(times * share, 1.0, RULES.data.gross) if seen else times * share < RULES.data.gross < times)
    ]
    about = f" (the log says about {number(seen)})" if seen > 0.0 else ""
    return f"{text}{about}: {'write ' + ' or '.join(fits) if fits else f'look at its unit ({unit})'}."


def round4(value: float) -> str:
    """To four digits, as people write it."""
    return f"{float(f'{value:.4g}'):g}"


def follows(pieces: Pieces, said: Said) -> bool:
    """Whether the voltage is what the gains make of the set-points and the motion: then all of them are borne out.

    A loop of a proportional gain alone goes slower than it is asked to, whatever turns it down.
    """
    errors, told = _errors(pieces, said, set()), _command(pieces, said, set())
    if errors is None or told is None or not said.given(DAMPS):
        return False
    u = told[1]
    made = errors @ np.array([said.value(GAIN) if said.given(GAIN) else 0.0, said.value(DAMPS)])
    sound = np.isfinite(u) & np.isfinite(made) & (abs(u) < RULES.data.unlimited * np.nanmax(abs(u), initial=0.0))
    if sound.sum() < RULES.data.fewest_pieces:
        return False
    u, made = _centred(u[sound]), _centred(made[sound])
    return rms(u - made) < RULES.data.mended * rms(u)


def _centred(x: np.ndarray) -> np.ndarray:
    """Without its mean: from which zero an angle counts is told elsewhere."""
    return x - np.mean(x, axis=0)


def _errors(pieces: Pieces, said: Said, suspects: set[str]) -> np.ndarray | None:
    """By how much set-points are missed, rad and rad/s, at the output: (pieces, 2). What nobody asks for is not missed."""
    angle_asked, speed_asked = "controller.angle_setpoint", "controller.speed_setpoint"
    if suspects & {angle_asked, speed_asked, RATIO, "time"} or not (pieces.has(angle_asked) or pieces.has(speed_asked)):
        return None
    ratio, none = said.value(RATIO), np.zeros(len(pieces.lasting))
    for angle, speed, geared in (("load.angle", "load.speed", 1.0), ("reducer.input_angle", "reducer.input_speed", ratio)):
        if suspects & {angle, speed} or not (pieces.has(angle) or (pieces.has(speed) and not pieces.has(angle_asked))):
            continue
        had = pieces.mean(speed) if pieces.has(speed) else pieces.change(angle) / pieces.lasting
        wanted = pieces.mean(speed_asked) if pieces.has(speed_asked) else pieces.change(angle_asked) / pieces.lasting
        missed = pieces.mean(angle_asked) - pieces.mean(angle) / geared if pieces.has(angle_asked) else none
        return np.column_stack([missed, wanted - had / geared])
    return None


def _command(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[str, np.ndarray] | None:
    """What the controller commands, V, or of a duty 1."""
    for name in ("controller.voltage", "motor.duty", "motor.voltage"):
        if pieces.has(name) and name not in suspects:
            return name, pieces.mean(name)
    return None
