"""What voltage, current, torque and motion of a drive say of each other by the simplest laws.

    u = R i + k_e w                        the motor's voltage, but for its inductance
    M = J dw/dt + friction + m g d / r     the torque at the input shaft

They are no simulation: what a diagnosis may find beside them (brushes, cables, friction that nobody told) is allowed for.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from math import degrees, inf, pi

import numpy as np

from ..rules import RULES
from .finding import Finding, Said
from .motions import DEGREE, RATIO, RPM, look_at_ratio, near, number
from .pieces import Pieces

R, KE, KT = "motor.resistance", "motor.voltage_constant", "motor.torque_constant"
CURRENT, SPEED = "motor.current", "reducer.input_speed"
INERTIAS = (("kg.cm2", 1e-4), ("kg.mm2", 1e-6), ("g.cm2", 1e-7), ("g.mm2", 1e-9))
MASSES = (("g", 1e-3),)


def rms(x: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(x * x)))


def borne_out(pieces: Pieces, said: Said) -> set[str]:
    """The signals of a voltage's balance that holds with a measured speed."""
    (u_name, u), (w_name, w) = motor_volts(pieces, said) or ("", None), input_speed(pieces, said, set()) or ("", None)
    if u is None or w is None or w_name != SPEED or not pieces.has(CURRENT):
        return set()
    back, asked = said.value(KE) * w, u - said.value(R) * pieces.mean(CURRENT)
    sound = np.isfinite(back) & np.isfinite(asked)
    few = sound.sum() < RULES.data.fewest_pieces
    if few or rms((asked - back)[sound]) > RULES.data.mended * rms(back[sound]) or not rms(back[sound]):
        return set()
    return {u_name, CURRENT, SPEED}


def voltage(pieces: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """The voltage against current and speed. suspects: signals that are wrong already; nothing is said by them."""
    volts = motor_volts(pieces, said)
    motion = input_speed(pieces, said, suspects)
    if volts is None or motion is None:
        return []
    (u_name, u), (w_name, w) = volts, motion
    if u_name in suspects or CURRENT in suspects:
        return []
    measured = pieces.has(CURRENT)
    i = pieces.mean(CURRENT) if measured else np.zeros(len(u))
    sound = np.isfinite(u) & np.isfinite(i) & np.isfinite(w)
    if sound.sum() < RULES.data.fewest_pieces or not rms(u[sound]):
        return []
    u, i, w = u[sound], i[sound], w[sound]
    ends = list(product(said.ends(R), said.ends(KE)))
    r, k = min(ends, key=lambda e: rms(u - e[0] * i - e[1] * w))
    miss, asked = rms(u - r * i - k * w) / rms(u), rms(r * i + k * w) / rms(u)
    if not measured:
        if asked > RULES.data.gross:
            slips = [
                text
                for text, x, y in _slips(u, i, w, r, k, said, (u_name, CURRENT, w_name))
                if 1.0 / RULES.data.gross < rms(y) / rms(x) < RULES.data.gross
            ]
            return [
                _unlike(f"the speed alone asks for {number(asked)} times the voltage of {said(u_name)}", slips, u_name, w_name)
            ]
        return []
    if miss < RULES.data.unlike:
        return _hidden_resistance(u - k * w, i, r, said) if measured else []
    tried = sorted((rms(x - y) / rms(x), text) for text, x, y in _slips(u, i, w, r, k, said, (u_name, CURRENT, w_name)) if rms(x))
    best = tried[0][0]
    slips = [text for left, text in tried if left <= max(1.3 * best, best + 0.02)]
    named = best < RULES.data.mended and best * RULES.data.mends < miss
    if not named and 1.0 / RULES.data.gross_beside < asked < RULES.data.gross:
        return []
    much = f"{number(asked)} times" if asked >= 0.01 else f"1/{number(1.0 / asked)} times" if asked else "0 times"
    begin = f"R i + k_e w, of {said(CURRENT)} and {said(w_name)}, is {much} {said(u_name)}"
    if 1.0 / RULES.data.gross < asked < RULES.data.gross:
        begin = f"R i + k_e w, of {said(CURRENT)} and {said(w_name)}, does not follow {said(u_name)} ({100 * miss:.0f} % is left)"
    return [_unlike(begin, slips if named else [], u_name, CURRENT, w_name, R, KE)]


def _hidden_resistance(left: np.ndarray, i: np.ndarray, r: float, said: Said) -> list[Finding]:
    """A resistance far below that of the log: the balance holds as well without it, and a current made of it is off as far.

    left: V, of the voltage without what the speed takes.
    """
    found = float(left @ i) / float(i @ i) if np.any(i) else 0.0
    if not r or found < RULES.data.gross_beside * r or rms(left - found * i) > RULES.data.mended * rms(left):
        return []
    text = f"{said.prefix}{R} = {r:g} Ohm, and beside the voltage and the speed the current of {said(CURRENT)} takes {found:.4g} V for each A"
    kilo = near(found / r, 1e3)
    return [Finding(f"{text}{': kOhm given as Ohm?' if kilo else '.'} Write {said.prefix}{R} = {found:.4g}.", True, (R, CURRENT))]


def _unlike(begin: str, slips: list[str], *about: str) -> Finding:
    end = (
        "; or ".join(slips)
        if slips
        else "look at the units and signs of these columns, at motor.resistance (Ohm) and motor.voltage_constant (V.s/rad)"
    )
    return Finding(f"{begin}: {end}.", True, about)


def _slips(u, i, w, r: float, k: float, said: Said, names) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """What somebody may have slipped in: the sentence, the voltage, and what current and speed then make of it."""
    u_name, i_name, w_name = names
    measured = bool(np.any(i))
    v = k * w
    duty = u_name == "motor.duty"  # of a supply, which is in V
    supply = "motor.supply_voltage" if duty else u_name
    for times, what, unit in ((1e-3, "mV read as V", "mV"), (1e3, "V read as mV", "V")):
        if not said.read_in(supply, unit):
            yield f'{what}? Write unit = "{unit}" for {said(supply)}', u * times, r * i + v
    if duty and not said.read_in(u_name, "%"):
        yield f'percent read as 1? Write unit = "%" for {said(u_name)}', u * 1e-2, r * i + v
    if measured:
        for times, what, unit in ((1e-3, "mA read as A", "mA"), (1e3, "A read as mA", "A")):
            if said.read_in(i_name, unit):
                continue
            yield f'{what}? Write unit = "{unit}" for {said(i_name)}', u, r * i * times + v
        yield f"turn the sign of {said(i_name)}, {said.turned(i_name)}", u, v - r * i
        yield f"turn the sign of {said(w_name)}, {said.turned(w_name)}", u, r * i - v
        yield f"turn the sign of {said(u_name)}, {said.turned(u_name)}", -u, r * i + v
        yield f"{said(u_name)} and {said(i_name)} may be exchanged: swap their columns", i, r * u + v
        for times, what in ((1e-3, "mOhm given as Ohm"), (1e3, "kOhm given as Ohm")):
            yield f"{what}? {said.prefix}{R} = {r * times:.4g} would do", u, r * i * times + v
    turning = () if said.linear else (
        ((RPM, "rpm read as rad/s", "rpm"), (1 / RPM, "rad/s read as rpm", "rad/s"),
         (DEGREE, "deg/s read as rad/s", "deg/s"), (1 / DEGREE, "rad/s read as deg/s", "rad/s"))
        if w_name.endswith("speed") else
        ((DEGREE, "degrees read as rad", "deg"), (1 / DEGREE, "rad read as degrees", "rad"))
    )  # fmt: skip
    for times, what, unit in turning:
        if not said.read_in(w_name, unit):
            yield f'{what}? Write unit = "{unit}" for {said(w_name)}', u, r * i + times * v
    both = said.given(KE) and said.given(KT)
    alike = both and near(said.value(KE) / (said.value(KT) or inf), 1.0)  # one number of a motor, and both would have to slip
    for value, what in () if alike else constants(k):
        yield f"{what} given as V.s/rad? {said.prefix}{KE} = {value:.4g} would do", u, r * i + value * w


def constants(k: float) -> list[tuple[float, str]]:
    """V.s/rad of what data sheets write otherwise."""
    if not k:
        return []
    return [(1.0 / (k * RPM), "rpm/V"), (k / RPM, "V/rpm"), (1e-3 * k / RPM, "mV/rpm"), (1e-3 * k, "mV.s/rad")]


def motor_constants(said: Said) -> list[Finding]:
    """k_e and k_m of a motor are one number in SI units; what the rig says of both."""
    if said.linear or said.prefix + KE in said.rig.uncertain or said.prefix + KT in said.rig.uncertain:
        return []
    ke, kt = said.value(KE), said.value(KT)
    if not (said.given(KE) or said.given(KT)) or not ke or not kt or 1.0 / RULES.data.gross < ke / kt < RULES.data.gross:
        return []
    for missing, other, unit in ((KE, KT, "V.s/rad"), (KT, KE, "N.m/A")):
        if not said.given(missing):
            text = f"{said.prefix}{missing} is not given, and {said.value(missing):g} {unit} was assumed beside {other} = {said.value(other):g}"
            return [Finding(f"{text}: in SI units they are one number of a motor. Give it under [parameters].", True, (KE, KT))]
    tried = [(value, f"{said.prefix}{KE} = {value:.4g}, if {ke:g} is in {what}", kt) for value, what in constants(ke)]
    tried += [
        (value, f"{said.prefix}{KT} = {value:.4g}, if {kt:g} is in {what}", ke)
        for value, what in constants(kt)
        if what != "mV.s/rad"
    ]
    tried += [(1e-3 * kt, f"{said.prefix}{KT} = {1e-3 * kt:.4g}, if {kt:g} is in mN.m/A", ke)]
    fits = [(value, text) for value, text, other in tried if near(value, other, RULES.data.one_factor)]
    slips = [text for value, text in fits if value <= RULES.data.one_factor * min(fits)[0]]  # 239 is rpm/V, and not 0.04
    end = f"write {' or '.join(slips)}" if slips else "look at their units"
    text = f"{said.prefix}{KE} = {ke:g} V.s/rad and {said.prefix}{KT} = {kt:g} N.m/A are one number of a motor in SI units"
    return [Finding(f"{text}: {end}.", True, (KE, KT))]


def torque(pieces: Pieces, coarse: Pieces, said: Said, suspects: set[str]) -> list[Finding]:
    """The torque at the input shaft against the motion that it makes. coarse: pieces long enough for a speed to change in."""
    given = _torque(pieces, said)
    motion = input_speed(pieces, said, suspects)
    if given is None or motion is None or suspects & {given[0], RATIO} or (given[0] == CURRENT and KT in suspects):
        return []
    (name, m), (w_name, w) = given, motion
    steady = said.rig.kind == "steady"
    a = np.zeros(len(w)) if steady else pieces.slope(w)
    if not steady:
        m, w = pieces.smooth(m), pieces.smooth(w)
    placed = pieces.has("load.angle") and not suspects & {"load.angle", "load.arm_angle"}
    angle = pieces.mean("load.angle") if placed else None
    sound = np.isfinite(m) & np.isfinite(w) & np.isfinite(a)
    sound &= np.isfinite(angle) if angle is not None else True
    if sound.sum() < RULES.data.fewest_pieces or not rms(m[sound]) or not rms(w[sound]):
        return []
    sound &= abs(w) > RULES.data.surely * np.nanmax(abs(w[sound]))  # slower, friction may act either way
    if sound.sum() < RULES.data.fewest_pieces:
        return []
    m, w, a = m[sound], w[sound], a[sound]
    angle = angle[sound] if angle is not None else None
    return _inertia(coarse, said, name, w_name) + _judged(said, name, w_name, m, w, a, angle)


def _judged(said: Said, name: str, w_name: str, m, w, a, angle) -> list[Finding]:
    """The torque as a sum of inertia, friction and gravity, fitted, against what the rig says of them."""
    rules, size = RULES.data, rms(m)
    weight = heaviest(said)
    lean = said.value("load.arm_angle") if weight and angle is not None else None
    swing = (said.value("load.inertia") + _hung(said)) / (weight or 1.0) / said.value(RATIO)
    columns = _columns(w, a, angle, lean, swing)
    parts, left = _fit(columns, m)
    rubbing = [key for key in ("speed", "side", "pressed") if key in columns]
    rubs = sum(float(np.mean(parts[key] * w)) for key in rubbing)
    push = float(np.mean(parts["inertia"] * a)) if "inertia" in parts else 0.0  # above 0: it drives what it accelerates
    heavy = float(np.copysign(rms(parts["inertia"]), push)) / size if push else 0.0
    power = float(np.mean(abs(m * w)))
    gives = rubs < rules.against * power and float(np.mean(m * w)) < rules.against * power
    told = left < rules.unlike * size  # else it is none of these sums, as the noise of a drive that coasts
    if told and (("side" in columns and gives and heavy < rules.told_share) or (heavy < -rules.told_share and rubs < 0.0)):
        text = f"{said(name)} pulls against the motion of {said(w_name)}: by their signs friction drives and inertia brakes"
        mend = f"turn the sign of one, {said.turned(name)}"
        return [Finding(f"{text}. Torques are positive in the direction of positive angles: {mend}.", True, (name, w_name))]
    known = _inertia_of(said)[1]
    if told and heavy > rules.told_share and known and (times := heavy * size / rms(a) / known) > rules.gross_beside:
        text = f"{said(name)} accelerates the drive as if its inertia were {number(times)} times what the rig says"
        return [Finding(f"{text}: {_thousand(said, name, times)}.", True, (name, "reducer.shaft_inertia", "load.inertia"))]
    if told and lean is not None and rms(parts["pull"]) > rules.told_share * size:
        without = _fit({key: x for key, x in columns.items() if key != "pull"}, m)[1]
        if float(np.mean(parts["pull"] * columns["pull"])) < 0.0 and without > rules.zero_mends * left:
            text = (
                f"gravity pushes {said('load.angle')} up by {said(name)}, as if the arm stood half a turn from where the rig says"
            )
            mend = f"load.arm_angle = {lean + pi if lean < 0.0 else lean - pi:.4g}, or the sign of {said('load.angle')}, {said.turned('load.angle')}"
            return [Finding(f"{text}: {mend}.", False, ("load.angle", "load.arm_angle"))]
        times = rms(parts["pull"]) / rms(columns["pull"]) / (weight / said.value(RATIO))
        if times > rules.gross_beside:
            text = f"{said(name)} goes with the load's weight, and is {number(times)} times what the rig makes of it"
            return [Finding(f"{text}: {_thousand(said, name, times)}.", True, (name, "load.mass"))]
    if said.rig.kind == "steady" and (pull := _pull(said)):
        ratio = said.value(RATIO)
        grip = 1.0 + max(said.ends("reducer.friction_kinetic")) * ratio
        if (times := size / (pull / ratio * grip)) > rules.gross_beside:
            text = f"{said(name)} is {number(times)} times what the load asks for at the input shaft"
            return [Finding(f"{text}: {_thousand(said, name, times)}.", True, (name, "load.constant_torque"))]
    return _lean(said, m, w, a, angle, lean, swing, left) if lean is not None else []


def _columns(w, a, angle, lean: float | None, swing: float) -> dict[str, np.ndarray]:
    """What a torque is made of, eq 2 to 13: a part of the load, and one of its size, against the motion.

    lean: of the arm at angle 0; None: there is no weight. swing: its inertia over its weight, per rad/s2 of the input shaft.
    """
    side = np.sign(w)
    found = {"one": np.ones(len(w)), "speed": w}
    if min(np.mean(w > 0), np.mean(w < 0)) > RULES.data.both_ways:
        found["side"] = side
    if rms(a):
        found["inertia"] = a
    if lean is not None:
        pull = np.cos(angle + lean) + swing * a
        found |= {"pull": pull, "pressed": abs(pull) * side}
    return found


def _fit(columns: dict[str, np.ndarray], m: np.ndarray) -> tuple[dict[str, np.ndarray], float]:
    """Each part of the torque, and what is left of it (rms)."""
    matrix = np.column_stack([x / (rms(x) or 1.0) for x in columns.values()])
    fitted, *_ = np.linalg.lstsq(matrix, m, rcond=None)
    return {key: matrix[:, k] * fitted[k] for k, key in enumerate(columns)}, rms(m - matrix @ fitted)


def _lean(said: Said, m, w, a, angle, lean: float, swing: float, left: float) -> list[Finding]:
    """Gravity that would pull at another angle than the rig says, if that explains much more of the torque: a remark."""
    if np.ptp(angle) < RULES.data.zero_angle:
        return []
    look = lambda offs: min((_fit(_columns(w, a, angle, lean + off, swing), m)[1], off) for off in offs)
    _, near_by = look(np.arange(-5, 7) * pi / 6.0)
    best, off = look(near_by + np.array([-1.0, 0.0, 1.0]) * pi / 12.0)
    off = (off + pi) % (2.0 * pi) - pi
    if RULES.data.zero_mends * best > left or abs(off) < RULES.data.zero_angle:
        return []
    text = f"gravity pulls on {said('load.angle')} as if the arm stood {degrees(off):.0f} degrees from where the rig says"
    mend = f"load.arm_angle = {lean + off:.3g}, or an offset of the angle ({off:.3g}), or its sign, {said.turned('load.angle')}"
    return [Finding(f"{text}: {mend}.", False, ("load.angle", "load.arm_angle"))]


def _thousand(said: Said, name: str, times: float) -> str:
    unit = "mA" if name == CURRENT else "mN" if said.linear else "mN.m"
    slipped = near(times, 1e3, 5.0) and not said.read_in(name, unit)
    slip = f'{unit} read as {unit[1:]}? Write unit = "{unit}" for {said(name)}; or ' if slipped else ""
    return f"{slip}look at the unit of {said(name)}, at the inertias (kg.m2) and the load under [parameters]"


def _inertia(pieces: Pieces, said: Said, name: str, w_name: str) -> list[Finding]:
    """What the inertia alone asks for while the drive gets faster, against the torque that there was."""
    least = _inertia_of(said)[0]
    if said.rig.kind == "steady" or not least:
        return []
    push, (gain, pace) = _impulse(pieces, said, name), _faster(pieces, said, w_name)
    faster = np.isfinite(push) & np.isfinite(gain) & (gain * pace > 0.0)  # what slows it down may be friction, or a stop
    if faster.sum() < RULES.data.fewest_pieces:
        return []
    push, gain = push[faster], gain[faster]
    strong = abs(gain) > RULES.data.told_share * np.max(abs(gain))
    asked, had = least * np.sum(abs(gain[strong])), np.sum(push[strong])
    helped = np.sum(_falls(said) * pieces.lasting[faster][strong])  # by a load that falls
    if not had or asked < RULES.data.gross * (had + helped):
        return []
    right = "kg" if said.linear else "kg.m2"
    units = [
        (1.0 / times, f"{full} may be in {unit}: {said.value(full) * times:.3g} {right} would do")
        for full, share in (("reducer.shaft_inertia", 1.0), ("load.inertia", said.value(RATIO) ** -2))
        for unit, times in (MASSES if said.linear else INERTIAS)
        if said.given(full)
        and min(said.ends(full)) * share > 0.5 * least
        and asked / had < RULES.data.gross / times < RULES.data.gross * RULES.data.gross_beside * asked / had
    ]
    end = (
        "; or ".join(text for _, text in sorted(units))
        if units
        else f"look at the inertias ({right}), at {look_at_ratio(said)} and at the unit of {said(name)}"
    )
    text = f"to gain speed as {said(w_name)} does, the rig's inertia asks for {number(asked / had)} times the {'force' if said.linear else 'torque'} of {said(name)}"
    gross = asked > RULES.data.gross_beside * (had + helped)
    return [Finding(f"{text}: {end}.", gross, (name, "reducer.shaft_inertia", "load.inertia"))]


def _faster(pieces: Pieces, said: Said, name: str) -> tuple[np.ndarray, np.ndarray]:
    """By how much the input shaft gets faster over each piece, and its speed there, rad/s. name: the signal that tells it."""
    geared = said.value(RATIO) if name.startswith("load") else 1.0
    if name.endswith("speed"):
        return geared * pieces.at_ends(name), geared * pieces.mean(name)
    pace = geared * pieces.change(name) / pieces.lasting
    return pieces.slope(pieces.smooth(pace)) * pieces.lasting, pace


def _impulse(pieces: Pieces, said: Said, name: str) -> np.ndarray:
    """N.m.s by which the motor pushed over each piece, either way."""
    return (max(said.ends(KT)) if name == CURRENT else 1.0) * abs(pieces.way(name))


def _falls(said: Said) -> float:
    """The most by which the load may push the input shaft, N.m."""
    return (abs(said.value("load.constant_torque")) + heaviest(said)) / said.value(RATIO)


def _inertia_of(said: Said) -> tuple[float, float]:
    """At the input shaft, kg.m2: what the rig gives at least, and all that it may be."""
    ratio = said.value(RATIO)
    parts = {"reducer.shaft_inertia": 1.0, "load.inertia": ratio**-2}
    least = sum(min(said.ends(n)) * times for n, times in parts.items() if said.given(n))
    most = sum(max(said.ends(n)) * times for n, times in parts.items())
    return least, most + _hung(said) / ratio**2


def _hung(said: Said) -> float:
    """Inertia of the mass on its arm, kg.m2."""
    return said.value("load.mass") * said.value("load.arm") ** 2


def heaviest(said: Said) -> float:
    """The most that gravity pulls on the load, N.m."""
    return said.value("load.mass") * said.value("load.arm") * said.value("load.gravity")


def _pull(said: Said) -> float:
    """N.m by which the load pulls at the output, as its mean size."""
    return abs(said.value("load.constant_torque")) + 0.7 * heaviest(said)


def moves(x: np.ndarray) -> bool:
    """Whether a speed is a motion and not noise: what one piece does goes on in the next."""
    x = x[np.isfinite(x)]
    return len(x) > 2 and float(np.mean(x[1:] * x[:-1])) > RULES.data.goes_on * float(np.mean(x * x))


def motor_volts(pieces: Pieces, said: Said) -> tuple[str, np.ndarray] | None:
    for name in ("motor.voltage", "controller.voltage"):
        if pieces.has(name):
            return name, pieces.mean(name)
    if pieces.has("motor.duty") and pieces.has("motor.supply_voltage"):
        return "motor.duty", pieces.mean("motor.duty") * pieces.mean("motor.supply_voltage")
    return None


def _torque(pieces: Pieces, said: Said) -> tuple[str, np.ndarray] | None:
    """At the input shaft, N.m, as the motor gives it."""
    if pieces.has("motor.torque"):
        return "motor.torque", pieces.mean("motor.torque")
    if pieces.has(CURRENT) and said.given(KT) and said.prefix + KT not in said.rig.uncertain:
        return CURRENT, said.value(KT) * pieces.mean(CURRENT)
    return None


def input_speed(pieces: Pieces, said: Said, suspects: set[str]) -> tuple[str, np.ndarray] | None:
    """Of the input shaft, rad/s, by what is not suspected."""
    ratio = said.value(RATIO)
    for name, of in ((SPEED, pieces.mean), ("reducer.input_angle", pieces.change), ("load.speed", pieces.mean), ("load.angle", pieces.change)):  # fmt: skip
        if pieces.has(name) and name not in suspects:
            if name.startswith("load") and RATIO in suspects:
                continue
            x = of(name) * (ratio if name.startswith("load") else 1.0)
            x = x / pieces.lasting if of == pieces.change else x
            return (name, x) if said.rig.kind == "steady" or moves(x) else None
    return None
