"""Loops over a log around the laws: one component on its measured inputs, or a whole drive.

Plain functions, compiled together with the laws (kernels.py). Times: sample i is at t[i]; a voltage or command of
sample i is held until t[i + 1]. Arrays are float64, SI.
"""

from math import floor, pi

from selflock.fmus.controller import pd
from selflock.fmus.load import load
from selflock.fmus.motor import dc
from selflock.fmus.reducer import flow, law, shaft, wedge
from selflock.fmus.sensor import sensor


def read(p, value, dt, reading):
    """What a sensor, settled at the start, makes of values held over each step."""
    s = sensor.start(p, value[0])
    for i in range(len(value)):
        s, out = sensor.advance(p, s, value[i], dt[i])
        reading[i] = out.reading if s.filtered - s.filtered == 0.0 else s.filtered  # what breaks down has no steps


def read_anew(p, value, dt, begins, reading):
    """The same over stretches of rows, settled at the start of each; begins: the first row of each, the log's first one first."""
    for n in range(len(begins)):
        last = begins[n + 1] if n + 1 < len(begins) else len(value)
        read(p, value[begins[n] : last], dt[begins[n] : last], reading[begins[n] : last])


def undo(p, reading, value):
    """The values of which a sensor without lag and steps makes these readings."""
    for i in range(len(reading)):
        value[i] = sensor.undone(p, reading[i])


def averaged(x, weights, mean):
    """Averages of x over windows of 2 len(weights) - 1 samples; weights: of the middle, then of what lies ever farther to both sides.

    Over pieces that stay in the processor's nearest memory, what lies farthest first.
    """
    reach = len(weights) - 1
    for first in range(0, len(mean), 1024):
        out = mean[first : first + 1024]
        n = len(out)
        middle, weight = x[first + reach : first + reach + n], weights[0]
        for i in range(n):
            out[i] = middle[i] * weight
        for away in range(reach, 0, -1):
            weight = weights[away]
            before = x[first + reach - away : first + reach - away + n]
            behind = x[first + reach + away : first + reach + away + n]
            for i in range(n):
                out[i] += (before[i] + behind[i]) * weight


def motor(p, voltage, speed, dt, current, torque):
    """Current and torque on measured voltage and speed (the mean of the speeds at both ends of a step)."""
    s = dc.start(p)
    for i in range(1, len(dt)):
        s, out = dc.advance(p, s, voltage[i - 1], 0.5 * (speed[i - 1] + speed[i]), dt[i])
        current[i] = out.current
        torque[i] = out.torque
    current[0] = current[1]
    torque[0] = torque[1]


def motor_further(p, state, voltage, speed, dt, current, torque):
    """The same of a piece of a log, from `state` on, which is that of its first sample, and is put to that of the last; NaN: at rest."""
    s = dc.start(p) if state[0] != state[0] else dc.State(state[0], state[1], state[2], state[3])
    for i in range(1, len(dt)):
        s, out = dc.advance(p, s, voltage[i - 1], 0.5 * (speed[i - 1] + speed[i]), dt[i])
        current[i] = out.current
        torque[i] = out.torque
    state[0], state[1], state[2], state[3] = s.current, s.angle, s.heat, s.effects


def shaft_torque(p, current, speed, angle, dt, constant, beside):
    """Torque per current, and beside it, at a measured current of a motor that is cold at first."""
    s = dc.State(current[0], angle[0], 0.0, 1.0)
    for i in range(len(dt)):
        s, _ = dc.follow(p, s, current[i], speed[i], angle[i], dt[i])
        constant[i], beside[i] = dc.torque_law(p, dc.Condition(0.0, speed[i], current[i], angle[i], s.heat))


def load_torque(p, angle, speed, acceleration, torque):
    """Torque that the load takes for a motion."""
    for i in range(len(angle)):
        torque[i] = load.driving_torque(p, load.State(angle[i], speed[i]), acceleration[i])


def gear(p, angle, speed, output_angle, output_speed, dt, torque):
    """Torque of the gear at its input shaft for imposed motions, those of the start of each step."""
    s = shaft.start(p, angle[0], speed[0], output_angle[0], output_speed[0])
    for i in range(len(dt)):
        s, out = shaft.impose(p, s, angle[i], speed[i], output_angle[i], output_speed[i], dt[i])
        torque[i] = out.input_torque


def windup(p, input_angle, output_torque, wound):
    """Wind-up of spring and play under an output torque, on the flank that carries it, or the one touched last."""
    side = 0.0
    for i in range(len(input_angle)):
        side = law.flank(output_torque[i], side)
        x = law.Condition(1.0, 0.0, input_angle[i], 0.0, output_torque[i], 0.0, 0.0, 0.0)
        wound[i] = law.wound_up(p, x, side)


def controller(p, angle_setpoint, speed_setpoint, angle, speed, motor_speed, output_torque, dt, voltage):
    """Command on measured angles. The command of sample i is that of the inputs of sample i."""
    s = pd.start(p, angle_setpoint[0], speed_setpoint[0], angle[0], speed[0], motor_speed[0], output_torque[0])
    for i in range(len(dt)):
        h = dt[i] if i > 0 else 0.0  # the first sample is at the start
        s, out = pd.advance(p, s, angle_setpoint[i], speed_setpoint[i], angle[i], speed[i], motor_speed[i], output_torque[i], h)
        voltage[i] = out.voltage


def _pull(p, l, torque, damping, h):
    """Acceleration of the load, rad/s2, under this torque on it: its dampers are told the speed at the end of half of h, s."""
    inertia = load.moment_of_inertia(p, l)
    return (torque - load.driving_torque(p, l, 0.0)) / (inertia + 0.5 * h * (damping + p.damping))


def _rests(pr, pl, g, l):
    """What the output shaft delivers as a run begins, N.m, and the load's acceleration, rad/s2."""
    _, go = shaft.advance(pr, g, 0.0, l.angle, l.speed, 0.0)
    return go.output_torque, _pull(pl, l, go.output_torque, 0.0, 0.0)


def _together(pm, pr, pl, t, m, g, l, pull, rise, voltage, beside, pace, known):
    """Motor, gear and load after a step of the motor's pace, h, s, under a held voltage, V, and a torque beside F at the motor's shaft, N.m.

    The load takes the step as Verlet's method has it, half a kick, the way, half a kick: its angle is known to the end of the step
    before the gear takes it, and what swings undamped neither grows nor fades (Hairer, Lubich, Wanner, Geometric numerical
    integration, 2006, ch. I). The gear is exact for a load that turns evenly, the motor for an even speed: that in the middle of
    the step, as its last rise, rad/s2, has it. What the gear is given is the mean torque. So all is of second order in h.
    t: tangent of the gear's wedge. pull: the load's acceleration, rad/s2. known: the gear's response of the step before. Returns the same anew, and the output of
    the motor and the output torque, N.m.
    """
    h, turned, before = pace.dt, g.speed, m
    middle = turned + 0.5 * h * rise if turned != 0.0 else 0.0
    moved = l.speed + 0.5 * h * pull
    m, mo = dc.paced(pm, m, voltage, middle, pace)
    motor_torque = dc.mean_torque(pm, before, m, voltage, middle, pace) - beside
    g, go, known = shaft.advance_on(pr, g, t, motor_torque, l.angle, moved, h, known)
    delivered = go.output_torque
    damping = pr.shaft_damping if delivered != 0.0 else 0.0
    l = load.State(l.angle + h * moved, moved)
    pull = _pull(pl, l, delivered, damping, h)
    delivered -= damping * 0.5 * h * pull  # its damper was told the speed in the middle of the step
    l = load.State(l.angle, moved + 0.5 * h * pull)
    return m, g, l, pull, (g.speed - turned) / h, mo, delivered, known


def whole(pc, pm, pr, pl, closed, powered, supply, voltage, angle_setpoint, speed_setpoint, dt, parts, start, out):
    """A drive from its voltage, or with closed > 0 from its set-points; its components take turns, as FMUs in their places do.

    start: angle and speed of the input shaft, angle and speed of the load. With supply above 0 the controller's
    command is a duty. Where powered is 0 the motor is open.
    out rows: voltage, current, motor torque, input angle, input speed, output torque, load angle, load speed.
    """
    angle, speed = start[2], start[3]
    c = pd.start(pc, angle_setpoint[0], speed_setpoint[0], angle, speed, start[1], 0.0)
    m = dc.start(pm)
    g = shaft.start(pr, start[0], start[1], angle, speed)
    l = load.State(angle, speed)
    delivered = u = 0.0
    pace, known, t = dc.pace(pm, dt[0] / parts), flow.NONE, wedge.wedge_tangent(pr.gear_ratio, pr.wedge_angle)
    for i in range(len(dt)):
        if i > 0:
            h = dt[i] / parts
            if h != pace.dt:
                pace = dc.pace(pm, h)
            for _ in range(parts):
                m, mo = dc.paced(pm, m, u, g.speed, pace)
                g, go, known = shaft.advance_on(pr, g, t, mo.torque, l.angle, l.speed, h, known)
                delivered = go.output_torque
                l, lo = load.advance(pl, l, delivered, h)
            out[1, i] = mo.current
            out[2, i] = mo.torque
        u = voltage[i]
        if closed > 0.0:
            c, co = pd.advance(pc, c, angle_setpoint[i], speed_setpoint[i], l.angle, l.speed, g.speed, delivered, dt[i])
            u = co.voltage
            if supply[i] > 0.0:  # the controller commands a duty
                u *= supply[i]
        if powered[i] == 0.0:
            u = pm.voltage_constant * g.speed  # no current flows
        out[0, i] = u
        out[3, i] = g.angle
        out[4, i] = g.speed
        out[5, i] = delivered
        out[6, i] = l.angle
        out[7, i] = l.speed


def _straight(knots, heights, x):
    """A function that is straight between knots, constant beyond the first and the last."""
    last = len(knots) - 1
    if x <= knots[0]:
        return heights[0]
    if x >= knots[last]:
        return heights[last]
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        if x < knots[middle]:
            high = middle
        else:
            low = middle
    return heights[low] + (heights[high] - heights[low]) * (x - knots[low]) / (knots[high] - knots[low])


def _met(over, g, l, delivered, time, current):
    """The variable of a free law, by its number in free_law.VARIABLES."""
    if over == 1:
        return g.speed
    if over == 2:
        return delivered
    if over == 3:
        return g.angle - 2.0 * pi * floor(g.angle / (2.0 * pi))
    if over == 4:
        return l.angle
    if over == 5:
        return time
    return current


def _counted(stepped, angle):
    """An angle of the load as an encoder counts it."""
    count, zero = stepped[0], stepped[1]
    return count * (floor(angle / count + zero) + 0.5 - zero) if count > 0.0 else angle


def _in_steps(command, least):
    """A command in steps."""
    return least * floor(command / least + 0.5) if least > 0.0 else command


def closed(
    pc, pm, pr, pl, pa, ps, sensed, at_motor, looped, powered, supply, asked, ahead, turned, behind, acts, dt, parts, ticked, stepped, at,
    starts, place, over, knots, heights, out,
):  # fmt: skip
    """A drive from its set-points with the loop closed; the controller acts as its period says, or all the time.

    With looped = 0 it is driven by a voltage, in the place of the set-point of angle in asked and ahead. turned: angle of the load
    at the samples as it was measured, which no controller holds, else no number: waves and weights are met there, both shafts are
    turned as one, and rows of `out` go on as if they were not. behind > 0: it is the input shaft's, seen through the gear's ratio.

    One that acts all the time is asked at every sample, and what it does until the next is what it makes of the middle of the step,
    as speeds and accelerations foretell it. asked, ahead: set-points of angle and speed at the samples, and in the middle of the
    step behind each.
    pa, ps: sensors of angle and speed before the controller, which count with sensed > 0. at_motor: how many of
    these are the input shaft's, seen through the gear's ratio: 0, 1, which is that of speed, or 2. supply: V; where it is above 0 the
    controller commands a duty of it. ticked: s since it acted last, of one with a period. at: samples at which the shafts are put where they were measured, 0 first, each with
    its row of starts, as `start` in `whole`; heat and wear go on. acts: 0 at samples at which the controller is told nothing new;
    where there are any it acts at the others alone. stepped: the count in which the controller is told the angle, rad of the load,
    where the zero of these lies, s over which it makes its speed of them, and the step of its command; 0 for none; and whether its
    command is told as its law alone makes it, whatever then becomes of that, and however late. place, over, knots, heights: of a free law (free_law), with place 0
    none. powered and rows of out as in `whole`.
    """
    ratio, since, push = pr.gear_ratio, 0.0, 0.0
    count, made, least = stepped[0], stepped[2], stepped[3]
    start, put = starts[0], 1
    m, g = dc.start(pm), shaft.start(pr, start[0], start[1], start[2], start[3])
    m = dc.State(m.current, start[0], m.heat, m.effects)  # waves over the rotor go with the angle that is measured
    l = load.State(start[2], start[3])
    angle = start[0] / ratio if at_motor > 1.0 else start[2]
    speed = start[1] / ratio if at_motor > 0.0 else start[3]
    if place == 4:
        push = _straight(knots, heights, _met(over, g, l, 0.0, since, m.current))
        angle += push / ratio if at_motor > 1.0 else push
    sa, ss = sensor.start(pa, angle), sensor.start(ps, speed)
    if sensed > 0.0:
        angle, speed = sensor.exact(pa, angle), sensor.exact(ps, speed)
    c = pd.after(
        pd.start(pc, asked[0, 0], asked[1, 0], angle, speed, start[1], 0.0), ticked - dt[0]
    )  # at the first sample it is so long ago
    period = pd.sample_period(pc, pd.Condition(0.0))
    held = period > 0.0 and pd.command_delay(pc, pd.Condition(0.0)) == 0.0 or acts.min() == 0.0
    told = asked[0, 0], asked[1, 0], angle, speed, g.speed, 0.0
    u = written = c.command
    delivered, pull = _rests(pr, pl, g, l)
    current = torque = rise = strayed = 0.0
    last, made_of, aged = speed, start[0] / ratio if at_motor == 1.0 else _counted(stepped, angle), ticked - dt[0]
    pace, known, t = dc.pace(pm, dt[0] / parts), flow.NONE, wedge.wedge_tangent(pr.gear_ratio, pr.wedge_angle)
    for i in range(len(dt)):
        if i > 0:
            if dt[i] / parts != pace.dt:
                pace = dc.pace(pm, dt[i] / parts)
            for _ in range(parts):
                given, beside = u, 0.0
                if place > 0:
                    push = _straight(knots, heights, _met(over, g, l, delivered, since, m.current))
                    if place == 1:
                        beside = push
                    elif place == 2:  # as friction: against the motion, and none at rest
                        beside = push if g.speed > 0.0 else -push if g.speed < 0.0 else 0.0
                    elif place == 3:
                        given = u - push
                m, g, l, pull, rise, mo, delivered, known = _together(
                    pm, pr, pl, t, m, g, l, pull, rise, given, beside, pace, known
                )
            current, torque, since = mo.current, mo.torque, since + dt[i]
        anew = put < len(at) and at[put] == i
        if anew:
            g = shaft.State(starts[put, 0], starts[put, 1], g.effects, g.time, g.heat, g.distance)
            l = load.State(starts[put, 2], starts[put, 3])
            delivered, pull = _rests(pr, pl, g, l)
            rise = 0.0
            put += 1
        if turned[i] == turned[i]:
            by = turned[i] - (g.angle / ratio if behind > 0.0 else l.angle)
            m = dc.State(m.current, m.angle + by * ratio, m.heat, m.effects)
            g = shaft.State(g.angle + by * ratio, g.speed, g.effects, g.time, g.heat, g.distance)
            l = load.State(l.angle + by, l.speed)
            strayed -= by
        angle, turns, gained = l.angle, l.speed, pull
        if at_motor > 1.0:
            angle, turns, gained = g.angle / ratio, g.speed / ratio, rise / ratio
        speed, sped = (g.speed / ratio, rise / ratio) if at_motor > 0.0 else (turns, gained)
        if looped == 0.0:
            out[0, i], u = asked[0, i], ahead[0, i]
        else:
            if place == 4:  # the angle's own reading, of whichever shaft
                push = _straight(knots, heights, _met(over, g, l, delivered, since, current))
                angle += push / ratio if at_motor > 1.0 else push
            half = 0.5 * dt[i + 1] if i + 1 < len(dt) else 0.0
            later, faster = angle + half * (turns + 0.5 * half * gained), speed + half * sped
            if count > 0.0:
                angle, later = _counted(stepped, angle), _counted(stepped, later)
            if made > 0.0:
                aged += dt[i]
                turned_to = g.angle / ratio if at_motor == 1.0 else angle
                if anew:
                    last, made_of, aged = speed, turned_to, 0.0
                elif acts[i] > 0.0 and aged >= made * (1.0 - 1e-9):
                    last, made_of, aged = (turned_to - made_of) / aged, turned_to, 0.0
                speed = faster = last
            if anew and sensed > 0.0:
                sa, ss = sensor.start(pa, angle), sensor.start(ps, speed)
            if sensed > 0.0:
                sa, seen = sensor.advance(pa, sa, angle, dt[i])
                angle = seen.reading
                ss, seen = sensor.advance(ps, ss, speed, dt[i])
                speed = seen.reading
                _, seen = sensor.advance(pa, sa, later, half)
                later = seen.reading
                _, seen = sensor.advance(ps, ss, faster, half)
                faster = seen.reading
            if acts[i] > 0.0:
                told = asked[0, i], asked[1, i], angle, speed, g.speed, delivered
            acted = c.since + dt[i]
            c, co = pd.advance(pc, c, told[0], told[1], told[2], told[3], told[4], told[5], dt[i])
            if stepped[4] > 0.0 and (period <= 0.0 or i == 0 or c.since < acted - 0.5 * period):
                written = pd.asked(pc, c, told[0], told[1], told[2], told[3], told[5])
            volts, later_volts = 1.0, 1.0
            if supply[i] > 0.0:
                volts = supply[i]
                later_volts = 0.5 * (volts + supply[min(i + 1, len(dt) - 1)])
            out[0, i] = _in_steps(written if stepped[4] > 0.0 else co.voltage, least) * volts
            if not held:
                _, co = pd.advance(pc, c, ahead[0, i], ahead[1, i], later, faster, g.speed + half * rise, delivered, half)
            u = _in_steps(co.voltage, least) * later_volts
        if powered[i] == 0.0:
            out[0, i] = u = pm.voltage_constant * g.speed  # no current flows
        out[1, i] = current
        out[2, i] = torque
        out[3, i] = g.angle + strayed * ratio
        out[4, i] = g.speed
        out[5, i] = delivered
        out[6, i] = l.angle + strayed
        out[7, i] = l.speed
