"""The whole drive against every measured channel, each read as its recorder read it.

Set-points are numbers, and no noise is on them. So nothing measured goes into this simulation but where a run begins:
what is left of a channel is its own noise, and what is wrong in the drive (output error; Ljung 1999, ch. 4). In open loop the
voltage that drives it does (driven), whose noise inertia and inductance smooth. How a channel was recorded is said by numbers that are fitted beside all else and never named a cause:

    recorder.<channel>.shift     s, read so much later than its row says
    recorder.<channel>.window    s, mean over so long before (of a switched voltage, over part of its step)
    recorder.<channel>.filter    s, time constant of a first-order filter
    recorder.<channel>.zero      rad, an encoder's zero lies anywhere within a count, which it rounds down or to the nearest
    recorder.<channel>.ripple…   relative, cosine and sine of so many waves in a turn (a tacho's)
    recorder.controller.hold     s, the command acts so much later: half the period of a controller faster than the log
    recorder.controller.filter   s, time constant of the speed that a controller makes of its angle

The loop closes over the load's sensors, or over the encoder on the motor's shaft where the load has none, or where rig or log
say so (closing).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from selflock.fmus.motor.effects.supply_sag import supplied

from ..data.rig import DUAL, LOAD, MOTOR, Rig
from ..data.signals import ANGLE_OF
from ..errors import DataError
from ..rules import RULES
from . import drive, driven, free_law, laws, memory
from .channels import Channels, integral, mean_rate
from .closing import SENSORS, zero
from .compare import Compared
from .forward import ROWS, stable
from .grid import Grid, ahead, grid, refined, stamps
from .messages import age, period, told
from .recorder import commanded, counts, least_step, over_lost_rows, ticks
from .set_points import about

SUPPLY, DUTY = "supply", "duty"

SHOWN = {
    "controller.voltage": "voltage",
    "motor.voltage": "voltage",
    "motor.duty": DUTY,
    "motor.current": "current",
    "motor.torque": "torque",
    "reducer.output_torque": "output_torque",
    "motor.supply_voltage": SUPPLY,
    "load.angle": "angle",
    "load.speed": "speed",
    "reducer.input_angle": "input_angle",
    "reducer.input_speed": "input_speed",
}
"""Signals that are compared, and their rows in a simulation."""

VARIED = {"speed": "input_speed", "load": "output_torque", "output position": "angle", "current": "current", "voltage": "voltage"}
"""Variables of free laws that are rows of a simulation."""

TURNS = {speed: SHOWN[angle] for speed, angle in ANGLE_OF.items()}
"""Speeds, and the row of the angle with which a tacho's ripple goes."""

WHOLE = "whole"
"""What a rig's `simulate` says to ask for this."""

PARTED = "parts"
"""And what it says to ask for each component on its measured inputs."""

FASTEST = "fastest swing"
"""Where a run keeps the swings of its output shaft, rad/s, beyond which its log shows nothing."""

LATE = "lateness"
"""Where a run's channels keep how late they are, while something else is looked for that would go with it."""

HOLD = "recorder.controller.hold"
FILTER = "recorder.controller.filter"
MOVING = (HOLD, FILTER)
"""Numbers of recorders that move the drive itself."""

PARTS = laws.COMPONENTS


def undescribed(rig: Rig, signals: set[str]) -> str:
    """Why a log with these signals and its rig describe no whole drive, as what a loop would have to have; "" where they describe one."""
    return "" if driven.way(rig, signals) else driven.lacking(rig, signals)


def refuse_open(rig: Rig, signals: set[str]) -> None:
    """Refuse to simulate a whole drive that is not described."""
    if what := undescribed(rig, signals):
        raise DataError(f'{rig.path}: simulate = "{WHOLE}" needs {what}. Give it, or write simulate = "parts".')


def compared(ch: Channels) -> list[str]:
    """Channels that are: all that a simulation has but what drives it."""
    return [name for name in SHOWN if ch.has(name) and name not in driven.inputs(ch)]


def components(ch: Channels) -> tuple[str, ...]:
    """Those that are simulated."""
    return PARTS[1:] if driven.of(ch) == driven.VOLTAGE else PARTS


def seen_by_controller(ch: Channels) -> tuple[str, ...]:
    """Channels of angle and speed over which the loop closes: the load's where it has any, unless rig or log say the motor's, or its speed.

    None in open loop.
    """
    if (way := driven.of(ch)) == driven.VOLTAGE:
        return ()
    at = lambda side: ch.has(f"{side}{way}")
    at_motor = at("reducer.input_") and (ch.setting.rig.loop == MOTOR or not at("load."))
    dual = ch.setting.rig.loop == DUAL and way == driven.ANGLE and at("load.")
    first, second = SENSORS[DUAL if dual else MOTOR if at_motor else LOAD]
    return f"{first}angle", f"{second}speed"


def makes_its_speed(ch: Channels) -> bool:
    """Whether a controller's speed may be its own work, as late as its differences and filters make it: no other is in the log."""
    if not needs_speed(ch):
        return False
    speed = seen_by_controller(ch)[1]
    return not ch.has(speed) or counts(speed, ch)[1] > 0 or driven.OWN_SPEED in ch.run.memory.get(driven.ACTS, ())


def needs_speed(ch: Channels) -> bool:
    """Whether a controller of angle acts on a speed, too."""
    return driven.of(ch) == driven.ANGLE and ch.setting.value(ch.prefix + "controller.speed_gain", {}) > 0.0


def simulate(values: dict, ch: Channels) -> dict[str, np.ndarray]:
    """All signals of the drive at the instants of the run's grid; remembered, for all channels ask for the same.

    A value that is what the drive has anyway makes no other: looks ask for many that differ from the base in nothing else.
    """
    known = drive.nominal(ch)
    key = tuple(sorted((name, value) for name, value in values.items() if known.get(name) != value and matters(name, ch)))
    most = min(RULES.residuals.wholes_remembered, max(1, RULES.residuals.motions_remembered // len(grid(ch).time)))
    return memory.kept(ch.memory.setdefault(WHOLE, {}), key, lambda: _simulated(values, ch, grid(ch)), most)


def matters(name: str, ch: Channels) -> bool:
    """Whether a value changes the motion itself: a component's, or a sensor's that the controller sees."""
    known = ch.memory.setdefault("matters", {})
    if name not in known:
        known[name] = _matters(name, ch)
    return known[name]


def _matters(name: str, ch: Channels) -> bool:
    if name.startswith("recorder."):
        return name in (*MOVING, driven.NOISE, driven.STEPS)
    if of := free_law.channel(name) if name.startswith(free_law.PREFIX) else "":
        return of in seen_by_controller(ch)[:1]
    if name.startswith("sensor."):
        return name.removeprefix("sensor.").rpartition(".")[0] in (*seen_by_controller(ch), *driven.inputs(ch))
    return True


def plain(values: dict, ch: Channels) -> dict[str, np.ndarray]:
    """All signals of the drive itself at the instants of the run's grid: nothing is said of a recorder, nor when a controller ticked.

    As FMUs that take turns make them: a controller's acts hold from the beginning of the step in which they fall, and a drive is
    where it went, wherever that was measured.
    """
    count = len(grid(ch).time)
    here = replace(grid(ch), places=np.full(count, np.nan), acts=np.ones(count))
    return _simulated({n: v for n, v in values.items() if not n.startswith("recorder.")}, ch, here, float(here.dt[0]))


def carried_in(values: dict, ch: Channels) -> tuple[float, float, int]:
    """Stiffness and damping of the output shaft and parts of a step with which a run is simulated."""
    fastest = ch.run.memory.get(FASTEST, np.inf)
    return stable(
        drive.law("reducer", values, ch), drive.law("load", values, ch), grid(ch).longest, fastest, ch.setting.shaft_step
    )


def _simulated(values: dict, ch: Channels, here: Grid, ticked: float | None = None) -> dict[str, np.ndarray]:
    """ticked: how long before the first row the controller did; as the steps of its logged command tell.

    A controller with a period acts at its own instants; one that acts oftener than the simulation has steps does so all the time,
    half its period late.
    """
    told = here
    pc, pm, pr, pl = (drive.law(part, values, ch) for part in PARTS)
    stiffness, damping, parts = carried_in(values, ch)
    late, period = values.get(HOLD, 0.0), pc.sample_period
    by_rows = here.acts.min() == 0.0
    if driven.row_by_row(ch):  # where a grid does not say which rows these are, it acts as often
        late, period = 0.0, 0.0 if by_rows else float(np.median(np.diff(ch.run.time)))
    if 0.0 < period <= here.usual:
        late, period = late + 0.5 * period, 0.0
    if ticked is None:
        ticked = ticks(period, ch) if period > 0.0 else 0.0
        if period > 0.0 and period != ch.setting.value(ch.prefix + "controller.sample_period", {}):
            here = refined(ch, period)
    stepped = _stepped(values, period or max(2.0 * late, here.usual), ch, by_rows)
    pc = pc._replace(command_delay=pc.command_delay + late, sample_period=period)
    pr = pr._replace(shaft_stiffness=stiffness, shaft_damping=damping)
    if driven.of(ch) == driven.SPEED:
        pc = pc._replace(angle_gain=0.0)
    seen, (at, starts) = seen_by_controller(ch), begins(values, ch, here)
    sensors = [ch.sensor(name, values) for name in seen] or [None, None]
    slow = values.get(FILTER, 0.0) - (0.0 if by_rows else 0.5 * stepped[2])  # of which a difference is half of itself late
    if slow > 0.0:
        speed = sensors[1] or laws.no_sensor()
        sensors[1] = speed._replace(lag_time=speed.lag_time + slow)
    out = np.empty((len(ROWS), len(here.time)))
    place, over, knots, heights, of = free_law.of(values)
    if of in seen[:1]:
        place = free_law.IN_LOOP
    asked, then, supply = here.asked, here.ahead, here.supply
    if driven.NOISE in values or any(ch.sensor(name, values) is not None for name in driven.inputs(ch)):
        volts, supply = driven.asked(stamps(ch), values, ch), driven.supply(here.time, stamps(ch), values, ch)
        asked, then = volts(here.time), volts(ahead(here.time, here.dt))
    ch.setting.kernels.closed(
        pc, pm, pr, pl, *(laws.no_sensor() if p is None else p for p in sensors), float(any(p is not None for p in sensors)),
        float(sum(name.startswith("reducer.") for name in seen)), float(bool(seen)), here.powered, supply, asked, then, here.places,
        float(driven.of_motor(ch)), here.acts, here.dt, parts, ticked, stepped, at, starts, place, over, knots, heights, out,
    )  # fmt: skip
    rows = dict(zip(ROWS, out if here is told else (np.interp(told.time, here.time, x) for x in out)))
    if supply.any():
        rows[DUTY] = rows["voltage"] / np.interp(told.time, here.time, supply)
    return rows | ({SUPPLY: supplied(pm, rows["voltage"], rows["current"])} if ch.has("motor.supply_voltage") else {})


def _stepped(values: dict, period: float, ch: Channels, by_rows: bool) -> np.ndarray:
    """What a controller is told in counts, and gives in steps, and whether its command is logged at once; see loops.closed. period: over which it makes its own speed, s."""
    found = np.zeros(5)
    found[4] = float(driven.AT_ONCE in ch.run.memory.get(driven.ACTS, ()))
    if by_rows and makes_its_speed(ch):  # the difference from row to row
        found[2] = 1e-9
    if (zero := values.get(driven.STEPS)) is None:
        return found
    angle, command = seen_by_controller(ch)[0], commanded(ch)
    gears = ch.setting.value("reducer.gear_ratio", values) if angle.startswith("reducer") else 1.0
    found[:2] = counts(angle, ch)[0] / gears if ch.has(angle) else 0.0, zero
    found[2] = found[2] or (period if makes_its_speed(ch) else 0.0)
    found[3] = least_step(command, ch) if command else 0.0
    return found


def begin(values: dict, ch: Channels, row: int = 0) -> tuple[np.ndarray, float]:
    """Angle and speed of both shafts as a run begins: as measured, the shaft wound up by what the load takes at rest, N.m.

    Or behind a gap, which ended with this row. Where the motor's shaft alone is measured it is the load that is elsewhere by that.
    """
    pr, pl = drive.law("reducer", values, ch), drive.law("load", values, ch)
    stiffness, damping, _ = carried_in(values, ch)
    pr = pr._replace(shaft_stiffness=stiffness, shaft_damping=damping)
    angle, turning, speed = _as_measured(row, values, ch)
    if driven.of(ch) == driven.ANGLE and not ch.has("load.angle"):  # counted from anywhere
        angle += zero(values, ch)
    at_motor, half, wound = not ch.has("load.angle") and ch.has("reducer.input_angle"), 0.5 * pr.backlash, np.empty(1)
    at, torque = angle + np.array([-half, 0.0, half]), np.empty(3)
    ch.setting.kernels.load_torque(pl, at, np.full(3, speed), np.zeros(3), torque)
    if at_motor and torque[0] < 0.0 < torque[2]:  # it hangs between the flanks
        load = angle - half * (torque[0] + torque[2]) / (torque[2] - torque[0])
        return np.array([angle * pr.gear_ratio, turning * pr.gear_ratio, load, speed]), 0.0
    ch.setting.kernels.windup(pr, np.array([angle * pr.gear_ratio]), torque[1:2], wound)
    motor = angle if at_motor else angle + wound[0]
    return np.array([motor * pr.gear_ratio, turning * pr.gear_ratio, motor - wound[0], speed]), float(torque[1])


def begins(values: dict, ch: Channels, here: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Samples of a run's grid at which the shafts are put where they were measured, and where: the first, and those behind gaps.

    What a set-point did in a gap nobody knows, and a shaft that locks itself stays for long where that left it.
    """
    time = ch.run.time - ch.run.time[0]
    rows = _anew(ch)
    rows = rows[time[rows] <= here.time[-1]]
    places = np.searchsorted(here.time, time[rows] - 1e-9)
    return places, np.stack([begin(values, ch, int(row))[0] for row in rows])


def _anew(ch: Channels) -> np.ndarray:
    """Rows with which a run begins: the first, and those behind gaps, but where the set-point went on through the gap as it came.

    Where lines through the rows before and behind a gap meet across it, the set-point in it is known to a quarter of what they miss:
    to what makes the voltage by `formulas` of it another, no more is asked of the controlled angle anywhere.
    """
    if "anew" in ch.memory:
        return ch.memory["anew"]
    time, wanted = ch.run.time, driven.wanted(ch)
    gaps, found = np.flatnonzero(ch.run.behind_gaps), [0]
    most = 4.0 * RULES.residuals.formulas * driven.usual(ch)
    for row in map(int, gaps):
        last = row - 1
        if last >= 1 and row + 1 < len(time) and last not in gaps and row + 1 not in gaps:
            slopes = np.array([wanted[last] - wanted[last - 1], wanted[row + 1] - wanted[row]])
            slopes /= np.array([time[last] - time[last - 1], time[row + 1] - time[row]])
            if np.max(abs(wanted[row] - wanted[last] - (time[row] - time[last]) * slopes)) <= most:
                continue
        found.append(row)
    ch.memory["anew"] = np.array(found)
    return ch.memory["anew"]


def _as_measured(row: int, values: dict, ch: Channels) -> tuple[float, float, float]:
    """Angle of the load, and speed of the motor at it and of the load, at the first row of a run, or behind a gap.

    Of straight lines through the rows after it alone: an average about that row would have rows from before it, as if the shaft had
    stood there. Where both speeds are measured each shaft has its own: a load swings behind a gear that holds.
    """
    gears = ch.setting.value("reducer.gear_ratio", values)
    known = ch.memory.setdefault("as measured", {})
    if (row, gears) in known:
        return known[row, gears]
    last = min(row + max(ch.smoothing, RULES.residuals.windows[0]), len(ch.run))
    others = np.flatnonzero(ch.run.behind_gaps[row + 1 : last])
    rows = np.arange(row, row + 1 + others[0] if len(others) else last)
    since = ch.run.time[rows] - ch.run.time[row]

    def line(x: np.ndarray) -> np.ndarray:
        return np.append(np.polynomial.polynomial.polyfit(since, x[rows], min(1, len(rows) - 1)), 0.0)[:2]

    if ch.has("load.angle"):
        angle, rate = line(ch.raw("load.angle"))
    elif ch.has("reducer.input_angle"):
        angle, rate = line(ch.raw("reducer.input_angle")) / gears
    else:
        angle, rate = line(drive.both({}, ch)[1].angle)
    first, second = drive.both({}, ch)
    shafts = ("reducer.input_speed", gears, first), ("load.speed", 1.0, second)
    rates = [(line(ch.raw(name))[0] / by, shaft.still / by) for name, by, shaft in shafts if ch.has(name)] or [
        (rate, second.still)
    ]
    # a shaft at rest begins at rest, whatever noise its speed has
    motor, load = (float(rate) if abs(rate) > still else 0.0 for rate, still in (rates[0], rates[-1]))
    known[row, gears] = float(angle), motor, load
    return known[row, gears]


def channel(name: str, values: dict, ch: Channels) -> Compared:
    """One measured channel against what sensor and recorder make of the simulated one."""
    return _compared(name, values, ch, lateness(name, values, ch))


def lateness(name: str, values: dict, ch: Channels) -> float:
    """How much later than in the first run a channel is read in this one, s.

    A recorder begins at any instant between two messages, so that how old they are in its rows belongs to a run. It is what fits
    best with all else as it is, and never more than a message takes.
    """
    if ch.run is (ch.beside or (ch.run,))[0]:
        return 0.0
    if (kept := ch.memory.get(LATE)) is not None:
        return kept[name]
    step = float(np.median(np.diff(ch.run.time)))
    most, apart = step * period(name, ch)[0], RULES.residuals.rate_rows * step
    now, measured, good = _compared(name, values, ch, 0.0)
    good = good & ch.taken(ch.good(name))
    rate = ((_compared(name, values, ch, apart)[0] - now) / apart)[good]
    if not (size := float(rate @ rate)) or not np.isfinite(size):
        return 0.0
    found = float(np.clip((measured - now)[good] @ rate / size, -most, most))
    now = _compared(name, values, ch, found)[0]
    return float(np.clip(found + (measured - now)[good] @ rate / size, -most, most))


def _compared(name: str, values: dict, ch: Channels, late: float) -> Compared:
    """A channel that is read so much later than in the first run, s."""
    simulated, measured = read(name, values, ch, late=late), ch.taken(ch.raw(name))
    good, before = _asked(name, ch)
    if before is not None:
        return simulated - read(name, values, ch, before, late), measured - ch.raw(name)[before], good
    if name == "reducer.input_angle":
        ratio = ch.setting.value("reducer.gear_ratio", values)
        if ch.has("load.angle"):  # what the gear winds up; where both are is the other angle's comparison
            simulated = simulated / ratio - read("load.angle", values, ch, late=lateness("load.angle", values, ch))
            measured = measured / ratio - ch.taken(ch.raw("load.angle"))
        trusted = good & ch.taken(ch.good(name))
        if trusted.any():  # where the encoders' zeros lie is nobody's fault
            simulated = simulated - np.mean((simulated - measured)[trusted])
    if SHOWN[name] == SUPPLY:  # its voltage without load is nobody's fault
        simulated = drive.level(simulated, measured, good & ch.taken(ch.good(name)), ch.taken(ch.run.time))
    return simulated, measured, good


def _asked(name: str, ch: Channels) -> tuple[np.ndarray, np.ndarray | None]:
    """Which rows of a channel are compared, not to be written to: the same whatever is simulated. And `earlier`, where that is asked for."""
    key = "asked", name
    if key not in ch.memory:
        good, before = ch.taken(settled(ch) & ~over_lost_rows(name, ch) & told(name, ch)), None
        if driven.by_change(name, ch):
            before = earlier(name, ch)
            good = good & (before >= 0) & (settled(ch) & told(name, ch) & ch.good(name))[before]
        elif name == "reducer.input_angle" and ch.has("load.angle"):
            good = good & ch.taken(ch.good("load.angle") & told("load.angle", ch))
        good.flags.writeable = False
        ch.memory[key] = good, before
    return ch.memory[key]


def earlier(name: str, ch: Channels) -> np.ndarray:
    """Of each row compared: the one from which on an angle's change is compared; below 0 where there is none."""
    return ch.taken(np.arange(len(ch.run))) - driven.rows_of_change(name, ch)


def settled(ch: Channels) -> np.ndarray:
    """Rows away from the start of the run and from gaps, where nobody knows what the drive did before; and from jumps of a set-point.

    When within a row it jumped nobody knows, nor which of the controller's next acts was the first to see it.
    """
    if "settled" not in ch.memory:
        time, rules = ch.run.time, RULES.residuals
        begins = time[_anew(ch)]
        since = time - begins[np.searchsorted(begins, time, side="right") - 1]
        late = ch.setting.value(ch.prefix + "controller.sample_period", {}) + 2.0 * float(np.median(np.diff(time)))
        reached = about(driven.jumped(ch), time, late)
        ch.memory["settled"] = (since >= min(rules.settling, rules.settling_share * (time[-1] - time[0]))) & ~reached
    return ch.memory["settled"]


def along(variable: str, rows: dict[str, np.ndarray], ch: Channels) -> np.ndarray:
    """A free law's variable at the instants of the grid of a simulation."""
    if variable == "time":
        return grid(ch).time
    if variable == "position":
        return turned("input_angle", rows, ch) % (2.0 * np.pi)
    return turned("angle", rows, ch) if variable == "output position" else rows[VARIED[variable]]


def turned(which: str, rows: dict[str, np.ndarray], ch: Channels) -> np.ndarray:
    """The place of a shaft in a simulation: of one that no controller holds as the load was measured, or the motor."""
    if driven.of(ch) == driven.ANGLE:
        return rows[which]
    ratio = ch.setting.value("reducer.gear_ratio", {})
    there = rows["input_angle"] / ratio if driven.of_motor(ch) else rows["angle"]
    return rows[which] + (grid(ch).places - there) * (ratio if which != "angle" else 1.0)


def _freely(name: str, x: np.ndarray, when: np.ndarray, values: dict, ch: Channels) -> np.ndarray:
    """A reading at these instants, with the free law that the values hold of it."""
    law = free_law.of(values)
    if law.channel != name:
        return x
    at = np.interp(when, grid(ch).time, along(free_law.VARIABLES[law.over - 1], simulate(values, ch), ch))
    return x + np.interp(at, law.knots, law.heights)


def read(name: str, values: dict, ch: Channels, at: np.ndarray | None = None, late: float = 0.0) -> np.ndarray:
    """What stands in the rows of a channel: the simulated signal behind its sensor and its recorder.

    at: rows; those that are taken. late: s, read so much later than in other runs.
    """
    here, rows = grid(ch), simulate(values, ch)
    of = lambda key: values.get(f"recorder.{name}.{key}", 0.0)
    sent = ch.run.time - ch.run.time[0] - age(name, ch) - of("shift") - late
    when = ch.taken(sent) if at is None else sent[at]
    if over := counts(name, ch)[1]:
        x = _freely(name, differences(rows[TURNS[name]], here.time, sent, over, ch), when, values, ch)
        return drive.sensed(name, x, ch.taken_steps(), values, ch)
    x = drive.sensed(name, _freely(name, rows[SHOWN[name]], here.time, values, ch), here.dt, values, ch)
    if late := of("filter"):
        lag, filtered = laws.no_sensor()._replace(lag_time=late), np.empty(len(x))
        ch.setting.kernels.read(lag, x, here.dt, filtered)
        x = filtered
    if name in TURNS:
        for order in RULES.residuals.ripples:
            a, b = of(f"ripple_cos_{order}"), of(f"ripple_sin_{order}")
            if a or b:
                cos, sin = _waves(TURNS[name], order, rows, ch)
                x = x * (1.0 + a * cos + b * sin)
    if zero := of("zero"):
        x = x + zero
    window = of("window")
    if window <= RULES.residuals.shortest_mean * here.dt[-1]:
        return np.interp(when - 0.5 * window, here.time, x)
    return mean_rate(integral(x, here.dt), here.time, when - window, when)


def _waves(turns: str, order: int, rows: dict[str, np.ndarray], ch: Channels) -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine of so many times a simulated angle, kept beside it: a fit asks for them far oftener than it moves the drive."""
    names = f"cosine of {order} {turns}", f"sine of {order} {turns}"
    if names[1] in rows:
        return rows[names[0]], rows[names[1]]
    if order % 2 == 0:  # twice an angle, which is cheaper than an angle
        cos, sin = _waves(turns, order // 2, rows, ch)
        found = (cos - sin) * (cos + sin), 2.0 * sin * cos
    else:
        angle = order * turned(turns, rows, ch)
        found = np.cos(angle), np.sin(angle)
    if rows[turns].size * RULES.residuals.wholes_remembered <= RULES.residuals.motions_remembered:
        rows.update(zip(names, found))
    return found


def differences(angle: np.ndarray, time: np.ndarray, sent: np.ndarray, rows: int, ch: Channels) -> np.ndarray:
    """A speed made of an angle at these times: the difference over so many rows back, over as many as there are at the start.

    sent: when it was, of each row, s.
    """
    last = np.maximum(ch.taken(np.arange(len(ch.run))), 1)
    until = sent[last]
    return mean_rate(angle, time, until - (ch.run.time[last] - ch.run.time[np.maximum(last - rows, 0)]), until)
