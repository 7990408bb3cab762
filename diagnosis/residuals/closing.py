"""What a command tells of its controller: at which shaft its sensors are, where both are logged, whether it acts between rows, and
whether it saw what the log has.

Seen at the motor the command is that of the load's angle and speed, and beside it what the wind-up between both shafts makes,

    u = k_a (wanted - load) + k_v (rate - speed) + x,      x = k_a (load - motor / r) + k_v (speed - motor speed / r)

Of its angle at the load and its speed at the motor x is the second part alone.
Angles are noisy, and their noise is in u's misfit and in x alike. So both are seen through set-points alone, which have none
(instrumental variables; Soderstrom and Stoica, System identification, 1989, ch. 8).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion, uniform_filter1d

from ..data.rig import DUAL, LOAD, MOTOR
from ..rules import RULES
from . import drive, driven
from .channels import Channels, derivative
from .recorder import commanded, counts, least_step

_LOADS, _MOTORS = "load.", "reducer.input_"

SENSORS = {LOAD: (_LOADS, _LOADS), MOTOR: (_MOTORS, _MOTORS), DUAL: (_LOADS, _MOTORS)}
"""At which shaft a controller may have its sensors: of angle and of speed, as their channels' names begin."""


def shaft(missed: dict[str, float]) -> str:
    """MOTOR where most of what the load's motion misses of the command is told by the wind-up; else LOAD; "" where no command tells."""
    if LOAD not in missed:
        return ""
    return MOTOR if missed.get(MOTOR, np.inf) < RULES.residuals.seen_at_motor * missed[LOAD] else LOAD


def dual(missed: dict[str, float]) -> bool:
    """Whether DUAL sensors miss less than half of the command that both the load's and the motor's do.

    The wind-up's change is little beside the wind-up, and what set-points tell of it may be chance: a drive is simulated with them
    before they are believed.
    """
    others = [missed[at] for at in (LOAD, MOTOR) if at in missed]
    return DUAL in missed and missed[DUAL] < RULES.residuals.seen_at_motor * min(others)


def command_missed(channels: list[Channels]) -> dict[str, float]:
    """What set-points tell of the command that the motion at each place of sensors misses, V; empty where there is no command.

    Whether a controller was told the speeds that are logged, or those of its angles, nobody says: a difference over many rows is
    late and blurred, a tacho has an error of its own. Each place is asked with those that suit it best.
    """
    least: dict[str, float] = {}
    speeds = any(ch.has(name) for ch in channels for name in ("load.speed", "reducer.input_speed"))
    for logged in (True, False) if speeds else (False,):
        found = [one for ch in channels if (one := _misses(ch, logged)) is not None]
        for at in found[0] if found else ():
            missed = float(np.linalg.norm(np.concatenate([one[at] for one in found])))
            least[at] = min(missed, least.get(at, np.inf))
    return least


def ahead(ch: Channels) -> bool:
    """Whether commands stand in the row before the one that they answer: a controller acted between rows."""
    command = commanded(ch)
    if ch.steady or not command or not ch.has("controller.angle_setpoint"):
        return False
    for at in (LOAD, MOTOR):
        if ch.has(f"{SENSORS[at][0]}angle"):
            asked, good = _asked(ch, command, at)
            off = ch.raw(command) - asked, ch.raw(command)[:-1] - asked[1:]
            now, then = (
                float(np.sqrt(np.mean(e[g] ** 2))) if g.any() else 0.0 for e, g in zip(off, (good, good[:-1] & good[1:]))
            )
            if then < RULES.residuals.of_next_row * now:
                return True
    return False


def unseen(ch: Channels) -> str:
    """The encoder that counts from anywhere, over which the loop closes, whose counts the command has nothing of; "" for none.

    Of a controller of speed alone the speed, with its noise.

    In step a row's command is the law of that row's samples, or of those some rows before, and has their counts times a gain,
    whatever the law is beside that. Such an encoder always counts: where its command does not, these are the recorder's. Only
    counts that would show beside the command's own noise tell anything.
    """
    command, angle = commanded(ch), "reducer.input_angle"
    ratio = ch.setting.value(ch.prefix + "reducer.gear_ratio", {})
    if driven.of(ch) == driven.SPEED and command and not ch.steady:
        speed = "reducer.input_speed" if ch.has("reducer.input_speed") else "load.speed"
        gain = ch.setting.value("controller.speed_gain", {}) / (ratio if speed != "load.speed" else 1.0)
        return speed if ch.has(speed) and gain > 0.0 and _nothing_of(ch, command, speed, gain) else ""
    if ch.steady or not command or not _at_motor(ch) or not ch.has("controller.angle_setpoint", angle):
        return ""
    gain = ch.setting.value(ch.prefix + "controller.angle_gain", {}) / ratio
    return angle if gain > 0.0 and _nothing_of(ch, command, angle, gain) else ""


def taken_at(ch: Channels) -> str:
    """Where the sensors are over which the loop closes, as log and rig have it."""
    return ch.setting.rig.loop or LOAD if ch.has("load.angle") else MOTOR


def sensed(ch: Channels) -> list[str]:
    """Where a controller may have its sensors of which a log has what they tell, a speed perhaps as the change of an angle."""
    there = lambda first, second: ch.has(f"{first}angle") and (ch.has(f"{second}angle") or ch.has(f"{second}speed"))
    return [at for at, sides in SENSORS.items() if there(*sides)]


def _at_motor(ch: Channels) -> bool:
    """Whether the loop closes over the motor's angle, as log and rig have it."""
    return taken_at(ch) == MOTOR


def _nothing_of(ch: Channels, command: str, name: str, gain: float) -> bool:
    """Whether the command has surely less than half of gain times what is new in every row of a channel, whenever it acts."""
    rules = RULES.residuals
    new, acts = -gain * np.diff(ch.raw(name), n=4), np.diff(ch.raw(command), n=4)
    good = binary_erosion(ch.good(name) & ch.good(command), iterations=4)[2:-2]
    good &= abs(new) <= rules.coarse_steps * max(
        float(np.median(abs(new[good]))) if good.any() else 0.0, 16.0 * gain * counts(name, ch)[0]
    )
    shares, errors = [], []
    for late in range(min(rules.acts_late, len(new) // 2)):
        both = good[: len(good) - late] & good[late:]
        x, y = new[: len(new) - late][both], acts[late:][both]
        if len(x) <= rules.noise_samples or not (size := float(x @ x)):
            return False
        shares.append(abs(float(x @ y)) / size)
        errors.append(np.sqrt(float((x * x) @ (y * y))) / size)
    return max(s + rules.sees_counts_errors * e for s, e in zip(shares, errors)) < rules.sees_counts


def answers_its_rows(ch: Channels) -> bool:
    """Whether a command is the law of its own row's angle and of that angle's difference from the row before, to its own step.

    So a small controller writes what it saw and what it made of that; where it acts between rows, or sees what the log has not, more
    is left than the step of its command, which is the variance of a number in steps (Widrow and Kollar 2008), and as much again.
    Asked where the angle turns and the command is none of its limits.
    """
    command = commanded(ch)
    if ch.steady or not command or driven.of(ch) != driven.ANGLE or not (step := least_step(command, ch)):
        return False
    law = drive.law("controller", {}, ch)
    name = "reducer.input_angle" if _at_motor(ch) else "load.angle"
    if not ch.has(name):
        return False
    ratio = ch.setting.value(ch.prefix + "reducer.gear_ratio", {}) if _at_motor(ch) else 1.0
    wanted, angle, given = ch.raw("controller.angle_setpoint"), ch.raw(name) / ratio, ch.raw(command)
    rate = drive.speed_setpoint(wanted, {}, ch)[1:] - np.diff(angle) / np.diff(ch.run.time)
    asked = law.angle_gain * (wanted - angle)[1:] + law.speed_gain * rate
    inside = lambda u: (u > law.voltage_min + step) & (u < law.voltage_max - step)
    good = ch.good(command) & ch.good(name)
    good = good[1:] & good[:-1] & inside(asked) & inside(given[1:]) & (abs(np.diff(angle)) > 1.5 * counts(name, ch)[0] / ratio)
    off = (given[1:] - asked)[good]
    return len(off) > RULES.residuals.noise_samples and float(np.mean(off**2)) <= 2.0 * step**2 / 12.0


def answers_its_motion(ch: Channels, missed: float) -> bool:
    """Whether a command is the law of the logged motion far more nearly than that of a drive which misses it by so much, V or duty.

    Then that drive is wrong behind its command: what a power stage does with it (a dead zone, a limit, a delay) is not in the log of it.
    """
    command, at = commanded(ch), taken_at(ch)
    if ch.steady or not command or driven.of(ch) != driven.ANGLE or at not in sensed(ch):
        return False
    asked, speed, inside = _law(ch, command, at)
    good = inside & (speed != 0.0)
    off = (ch.raw(command) - asked)[good]
    return len(off) > RULES.residuals.noise_samples and float(np.sqrt(np.mean(off**2))) < RULES.residuals.answers * missed


def zero(values: dict, ch: Channels) -> float:
    """What has to be added to the load's angle, as an encoder that counts from anywhere has it, for that which its controller held, rad.

    A drive in motion is not where it is asked to be, and how far from there its command tells,

        u = k_a (wanted - angle) + k_v (rate - speed),

    over all rows: of channels that are late this misses what goes with the rate and the acceleration. Where no command tells
    anything the drive began where it was asked to be.
    """
    ratio = ch.setting.value(ch.prefix + "reducer.gear_ratio", values)
    known = ch.memory.setdefault("zero", {})
    law = drive.law("controller", values, ch)
    key = ratio, law.angle_gain, law.speed_gain
    if key not in known:
        known[key] = _zero(ratio, law, ch)
    return known[key]


def _zero(ratio: float, law, ch: Channels) -> float:
    wanted, (_, second) = ch.raw("controller.angle_setpoint"), drive.both({"reducer.gear_ratio": ratio}, ch)
    began = float(wanted[0] - second.angle[0])
    if not (command := commanded(ch)) or law.angle_gain <= 0.0 or not ch.has("reducer.input_angle"):
        return began
    _, good = _asked(ch, command, MOTOR)
    rate = drive.speed_setpoint(wanted, {}, ch)
    told = np.stack([np.ones(len(rate)), rate, derivative(rate, np.cumsum(ch.dt))], axis=1)[good]
    if len(told) <= RULES.residuals.noise_samples * 3:
        return began
    off = (wanted - second.angle - (ch.raw(command) - law.speed_gain * (rate - second.speed)) / law.angle_gain)[good]
    return float(np.linalg.lstsq(told, off, rcond=None)[0][0])


def _asked(ch: Channels, command: str, at: str, logged: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """The command, V, that the motion measured there asks for, and where a controller that does not let go would give it."""
    asked, _, inside = _law(ch, command, at, logged)
    rate = drive.speed_setpoint(ch.raw("controller.angle_setpoint"), {}, ch)
    moving = binary_erosion(rate != 0.0, iterations=RULES.residuals.near)  # at rest it may have let go
    return asked, moving & inside


def _law(ch: Channels, command: str, at: str, logged: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The command, V, that the motion measured there asks for, its speed, and where neither is at a limit.

    logged: with the speed as it is logged, where it is, and not that of its shaft's angle.
    """
    law, time, (first, side) = drive.law("controller", {}, ch), np.cumsum(ch.dt), SENSORS[at]
    turns = ch.setting.value(ch.prefix + "reducer.gear_ratio", {})
    ratio = turns if side == _MOTORS else 1.0
    wanted, angle = ch.raw("controller.angle_setpoint"), ch.raw(f"{first}angle") / (turns if first == _MOTORS else 1.0)
    logged = ch.has(f"{side}speed") and (logged or not ch.has(f"{side}angle"))
    speed = ch.raw(f"{side}speed") / ratio if logged else derivative(ch.raw(f"{side}angle") / ratio, time)
    asked = law.angle_gain * (wanted - angle) + law.speed_gain * (drive.speed_setpoint(wanted, {}, ch) - speed)
    inside = lambda u: (u > law.voltage_min) & (u < law.voltage_max)
    count = 0.0 if logged else law.speed_gain * counts(f"{side}angle", ch)[0] / ratio / float(np.median(ch.dt))
    # a difference jumps with every count, and rows without one would be all that is inside: a mean over as many as even that out
    rows = int(np.ceil(count / (RULES.residuals.coarse * (law.voltage_max - law.voltage_min)))) if count else 1
    usual = uniform_filter1d(asked, rows) if rows > 1 else asked
    return asked, speed, inside(usual) & inside(ch.raw(command)) & ch.good(command) & ch.good(f"{first}angle")


def _misses(ch: Channels, logged: bool) -> dict[str, np.ndarray] | None:
    """What the motion at each place of a controller's sensors misses of a run's command, V, as far as set-points tell; None where nothing can.

    logged: with speeds as they are logged.
    """
    command = commanded(ch)
    places = sensed(ch)
    if ch.steady or not command or not ch.has("controller.angle_setpoint") or places[:1] != [LOAD] or not places[1:]:
        return None
    asked, inside = zip(*(_asked(ch, command, at, logged) for at in places))
    good, time, wanted = np.logical_and.reduce(inside), np.cumsum(ch.dt), ch.raw("controller.angle_setpoint")
    rate = drive.speed_setpoint(wanted, {}, ch)
    bend = derivative(rate, time)

    def told(rows: slice) -> np.ndarray:
        w, r, known = wanted[rows], rate[rows], good[rows]
        return np.stack([np.sin(w), np.cos(w), w, r, np.sign(r), bend[rows]])[:, known]

    if good.sum() <= RULES.residuals.noise_samples * (count := len(told(slice(0)))):
        return None
    centred = lambda x: x - x[good].mean()
    speed = derivative(ch.raw("load.angle"), time)
    # set-points stand in their rows: it is the motion that a recorder has late, its angle and its speed, and the command
    late = derivative(asked[0], time), speed, derivative(speed, time)
    parts = [centred(x) for x in (*(ch.raw(command) - one for one in asked), *late)]
    del asked, inside, time, speed, late
    pieces = [slice(i, i + RULES.residuals.piece) for i in range(0, len(good), RULES.residuals.piece)]
    mean = sum(told(rows).sum(1, keepdims=True) for rows in pieces) / good.sum()  # encoders' zeros are nobody's fault
    sizes = np.sqrt(sum(((told(rows) - mean) ** 2).sum(1, keepdims=True) for rows in pieces))
    triangles, shares = [], np.zeros((count, len(parts)))
    for rows in pieces:  # an hour of it at once would take a gigabyte
        some = (told(rows) - mean) / np.maximum(sizes, 1e-300)
        triangles.append(np.linalg.qr(some.T, mode="r"))
        shares += some @ np.stack([x[rows][good[rows]] for x in parts], axis=1)
    _, lengths, ways = np.linalg.svd(np.concatenate(triangles))
    felt = lengths > 1e-6
    by_told = (ways[: len(lengths)][felt] @ shares / lengths[felt, None]).T  # by an orthonormal basis of what is told
    misses, moved = by_told[: len(places)].T, by_told[len(places) :]
    nothing = np.stack([x / max(np.linalg.norm(x), 1e-300) for x in moved], axis=1)  # is made of these
    return dict(zip(places, (misses - nothing @ np.linalg.lstsq(nothing, misses, rcond=None)[0]).T))
