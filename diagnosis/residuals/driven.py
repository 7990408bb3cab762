"""What a whole drive is simulated from: set-points, with the loop closed, or in open loop the voltage that it is given.

An angle that no controller holds is an integral of all that is wrong: a speed that is off by a share of it, as every data sheet
makes it, is soon off by turns. So such an angle is compared by its change over some rows (`rows_of_change`), which forgets what
was before, as the error of an integrating plant is white in its differences (Ljung 1999, ch. 14.1); and what goes with a place
(a wave over a turn, a weight on an arm) is told the place that was measured.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..data.rig import Rig
from ..data.signals import ANGLE_OF, MOVES
from ..rules import RULES
from . import drive
from .channels import Channels
from .messages import age
from .recorder import counts
from .set_points import between, jump, jumps, leaps

ANGLE, SPEED, VOLTAGE = "angle", "speed", "voltage"
"""Ways: a controller of angle, one of speed alone, none."""

SETPOINT = {ANGLE: "controller.angle_setpoint", SPEED: "controller.speed_setpoint"}

DUTY, SUPPLY = "motor.duty", "motor.supply_voltage"

GIVEN = (("controller.voltage",), ("motor.voltage",), (DUTY, SUPPLY))
"""Channels that say the voltage in open loop, the first that a log has: a command is a number, a voltage was measured."""

NOISE = "recorder.driving.noise"
"""V: with this value a drive in open loop is simulated with so much white noise on the voltage, the same each time."""

ACTS, BY_ROWS, OWN_SPEED, AT_ONCE = "acts", "by rows", "own speed", "at once"
"""Where a run keeps how what drives its motor acts: at its rows alone, and of its controller that it makes its speed of its angle,
and that its logged command is what it made in that row, however late it then acts."""

STEPS = "recorder.controller.steps"
"""Counts: with this value a loop is simulated with the counts that its controller sees, their zero so far away, and its command's steps."""


def lacking(rig: Rig, signals: set[str], way: str = ANGLE) -> str:
    """Why a log with these signals and its rig describe no drive of this way, as what would have to be; "" where they describe one."""
    described = {name.rpartition(".")[0] for name in rig.parameters}
    hangs = all(rig.parameters.get(f"load.{name}", 0.0) for name in ("mass", "arm"))  # and no speed says at which angle
    moves = {*ANGLE_OF.values()} if way == ANGLE or hangs else {*MOVES}
    motion = {f"a column of {' or '.join(sorted(moves))}": bool(moves & signals)}
    asked = {
        'a log in time, that is kind = "forward"': rig.kind == "forward",
        "one drive, not several": rig.drives == ("",),
        "all of it, not one component": not rig.only,
    }
    if way != VOLTAGE:
        asked |= {
            f"a column of {SETPOINT[way]}": SETPOINT[way] in signals,
            f"a column of {SUPPLY} beside {DUTY}, and none of a voltage": DUTY not in signals
            or {*source(signals)} == {DUTY, SUPPLY},
            **motion,
            f"the controller's {way}_gain in [parameters]": f"controller.{way}_gain" in rig.parameters,
        }
    else:
        asked |= {
            "a column of the voltage, and no gains of a controller that makes it of a set-point": bool(source(signals))
            and not holds(rig, signals),
            **motion,
        }
    asked |= {f"parameters of the {part}": part in described for part in ("motor", "reducer", "load")}
    return next((what for what, there in asked.items() if not there), "")


def way(rig: Rig, signals: set[str]) -> str:
    """How a rig and its log drive a whole; "" where they describe none."""
    asked = holds(rig, signals) or VOLTAGE
    return "" if lacking(rig, signals, asked) else asked


def holds(rig: Rig, signals: set[str]) -> str:
    """What a controller holds, of which the rig tells gains and the log set-points; "" where that makes no voltage of what is logged.

    A log may well have set-points of a controller that nobody describes: then the voltage alone says what drove the motor.
    """
    if not {*SETPOINT.values()} & signals or not {f"controller.{of}_gain" for of in SETPOINT} & {*rig.parameters}:
        return ""
    return ANGLE if SETPOINT[ANGLE] in signals or rig.parameters.get("controller.angle_gain", 0.0) > 0.0 else SPEED


def source(signals: set[str]) -> tuple[str, ...]:
    """The channels that say the voltage in open loop; none where there are none."""
    return next((names for names in GIVEN if {*names} <= signals), ())


def of(ch: Channels) -> str:
    """The way of a run that is compared as a whole."""
    if "way" not in ch.memory:
        ch.memory["way"] = way(ch.setting.rig, {*ch.run.signals})
    return ch.memory["way"]


def inputs(ch: Channels) -> tuple[str, ...]:
    """Channels that were measured and drive the simulation: of an open loop what says the voltage, of a duty in a closed one the supply."""
    if of(ch) == VOLTAGE:
        return source({*ch.run.signals})
    return (SUPPLY,) if ch.has(DUTY) else ()


def wanted(ch: Channels) -> np.ndarray:
    """What the drive is asked for, at the rows of the log: the set-point that it follows, or the voltage or duty."""
    return ch.raw(SETPOINT[of(ch)] if of(ch) in SETPOINT else inputs(ch)[0])


def usual(ch: Channels) -> float:
    """The size of what it is asked for (root mean square) as the voltage is made of it, for what `formulas` of that is."""
    x, electric = wanted(ch), drive.electric(ch)
    if of(ch) == VOLTAGE or not electric:
        return float(np.sqrt(np.mean((x if of(ch) == VOLTAGE else x - x.mean()) ** 2)))
    gain = ch.setting.value(f"controller.{of(ch)}_gain", {})
    return float(np.sqrt(np.mean((ch.true(electric, {}) / gain) ** 2)))


def jumped(ch: Channels) -> np.ndarray:
    """Where what the drive is asked for jumps: the last row before and the first one behind, (jumps, 2).

    What was measured is seen to jump in up to some rows, for it was sent as a message now and then, and may have done so sooner.
    """
    if "jumped" not in ch.memory:
        if of(ch) == VOLTAGE:
            ch.memory["jumped"] = leaps(wanted(ch), ch.run.time)
        else:
            rows = jumps(wanted(ch), ch.run.time)
            ch.memory["jumped"] = np.stack([rows - 1, rows], axis=1)
    return ch.memory["jumped"]


def between_jumps(ch: Channels) -> np.ndarray:
    """Which rows of a run show no jump of what the drive is asked for."""
    found = np.ones(len(ch.run), bool)
    for first, last in jumped(ch):
        found[first : last + 1] = False
    return found


def sooner(ch: Channels) -> dict[int, float]:
    """Of rows behind a jump: the share of the rows before by which it came sooner, once that is found.

    Until then it is half-way through the rows that show it: at their end all channels would seem early for it.
    """
    if "jumped sooner" not in ch.run.memory:
        pairs = jumped(ch)
        shown = lambda first, last: max(last - first - RULES.residuals.leap_held, 1)
        ch.run.memory["jumped sooner"] = {int(last): 0.5 * float(shown(first, last) / (last - first)) for first, last in pairs}
    return ch.run.memory["jumped sooner"]


def instants(time: np.ndarray, ch: Channels) -> np.ndarray:
    """When it jumps, s from the first row on, which of a voltage that is held is at each row; time: of the rows asked about."""
    time = sent(time, ch) if of(ch) == VOLTAGE else time
    if of(ch) == VOLTAGE and row_by_row(ch):
        return time[1:]
    return np.array([jump(pair, time, sooner(ch)) for pair in jumped(ch) if pair[1] < len(time)])


def sent(time: np.ndarray, ch: Channels) -> np.ndarray:
    """When that was which stands in rows of these times, s: what was measured may be as old as a message."""
    return time - age(inputs(ch)[0], ch)[: len(time)]


def asked(time: np.ndarray, values: dict, ch: Channels) -> Callable[[np.ndarray], np.ndarray]:
    """Set-points of angle and speed, or the voltage and 0, at any instants, s: (2, instants). time: of the rows, from the first on."""
    n, known = len(time), sooner(ch)
    pairs = jumped(ch)
    pairs = pairs[pairs[:, 1] < n]
    if of(ch) == VOLTAGE:
        first, *supply = (ch.true(name, values)[:n] for name in inputs(ch))
        if volts_of_noise := values.get(NOISE, 0.0):
            noise = np.random.default_rng(len(ch.run)).standard_normal(len(ch.run))[:n] * lively(first, between_jumps(ch)[:n])
            first = first + volts_of_noise * noise / (np.maximum(abs(supply[0]), 1e-9) if supply else 1.0)
        times = [time - age(name, ch)[:n] for name in inputs(ch)]

        def volts(when: np.ndarray) -> np.ndarray:
            if row_by_row(ch):
                told = first[np.clip(np.searchsorted(times[0], when + 1e-9, side="right") - 1, 0, n - 1)]
            else:
                told = between(when, times[0], first, known, pairs)
            return np.stack([told * np.interp(when, times[1], supply[0]) if supply else told, np.zeros(len(when))])

        return volts
    angle = wanted(ch) if of(ch) == ANGLE else np.zeros(len(ch.run))
    both = angle[:n], drive.speed_setpoint(angle, {}, ch)[:n]
    return lambda when: np.stack([between(when, time, x, known) for x in both])


def lively(x: np.ndarray, told: np.ndarray) -> np.ndarray:
    """By how much noise a row has more than all have on average: none where a command stays as it is, as at rest or at a limit.

    told: rows of which noise tells anything; where a command jumps it is no noise.
    """
    stays = x[1:] == x[:-1]
    moves = ~(np.append(True, stays) & np.append(stays, True)) & told
    return moves / np.sqrt(max(float(moves.mean()), 1e-12))


def supply(when: np.ndarray, time: np.ndarray, values: dict, ch: Channels) -> np.ndarray:
    """Voltage at these instants of the supply of which a controller commands a duty, V; 0 where it commands a voltage."""
    if of(ch) == VOLTAGE or not inputs(ch):
        return np.zeros(len(when))
    return np.interp(when, time - age(SUPPLY, ch)[: len(time)], ch.true(SUPPLY, values)[: len(time)])


def row_by_row(ch: Channels) -> bool:
    """Whether what drives the motor acts at the instants of the rows alone, and is held between them: a small controller wrote the log."""
    return BY_ROWS in ch.run.memory.get(ACTS, ())


def places(when: np.ndarray, time: np.ndarray, ch: Channels) -> np.ndarray:
    """Angle of the load at these instants as it was measured, or of the motor behind the gear; nothing where a controller holds it."""
    if of(ch) == ANGLE:
        return np.full(len(when), np.nan)
    return np.interp(when, time, drive.both({}, ch)[1].angle[: len(time)])


def of_motor(ch: Channels) -> bool:
    """Whether places are the motor's: the load, which was not measured, is behind it by its play and what the shaft winds up."""
    return not (ch.has("load.angle") or ch.has("load.speed"))


def by_change(name: str, ch: Channels) -> bool:
    """Whether a channel is an angle that no controller holds, and no wind-up beside another."""
    return of(ch) != ANGLE and (name == "load.angle" or (name == "reducer.input_angle" and not ch.has("load.angle")))


def lasting(name: str, ch: Channels) -> float:
    """How long the change lasts that is compared, s; 0 where it is the channel itself."""
    return rows_of_change(name, ch) * float(np.median(np.diff(ch.run.time))) if by_change(name, ch) else 0.0


def rows_of_change(name: str, ch: Channels) -> int:
    """Over how many rows an angle's change is compared: the fewest at which its noise is no more than `formulas` of the change.

    Over fewer it would be counts and stamps that are compared, over more what no formula tells of so long a way. The noise is that
    of a line through three rows, whose stamps may scatter, or of the angle's counts.
    """
    known, rules = ch.beside[0].memory.setdefault("rows of change", {}), RULES.residuals
    if name not in known:
        channels = [Channels(run, ch.prefix, ch.setting, None, ch.beside) for run in ch.beside]
        bent = np.concatenate([np.diff(np.diff(c.raw(name)) / np.diff(c.run.time)) * np.diff(c.run.time)[1:] for c in channels])
        noise = float(np.median(abs(bent))) / rules.normal_median / np.sqrt(6.0) if len(bent) else 0.0
        noise = max(noise, counts(name, ch)[0] / np.sqrt(12.0))
        most, rows = min(rules.settling / float(np.median(np.diff(ch.run.time))), 0.5 * min(map(len, ch.beside))), 1
        moves = lambda n: np.concatenate([c.raw(name)[n:] - c.raw(name)[:-n] for c in channels])
        while 2 * rows <= most and rules.formulas * np.sqrt(np.mean(moves(rows) ** 2)) < np.sqrt(2.0) * noise:
            rows *= 2
        known[name] = rows
    return known[name]
