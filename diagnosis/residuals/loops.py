"""Loops over a log around the laws: one component on its measured inputs, or a whole drive.

Plain functions, compiled together with the laws (kernels.py). Times: sample i is at t[i]; a voltage or command of
sample i is held until t[i + 1]. Arrays are float64, SI.
"""

from selflock.fmus.controller import pd
from selflock.fmus.load import load
from selflock.fmus.motor import dc
from selflock.fmus.reducer import law, shaft
from selflock.fmus.sensor import sensor


def read(p, value, dt, reading):
    """What a sensor, settled at the start, makes of values held over each step."""
    s = sensor.start(p, value[0])
    for i in range(len(value)):
        s, out = sensor.advance(p, s, value[i], dt[i])
        reading[i] = out.reading if s.filtered - s.filtered == 0.0 else s.filtered  # what breaks down has no steps


def undo(p, reading, value):
    """The values of which a sensor without lag and steps makes these readings."""
    for i in range(len(reading)):
        value[i] = sensor.undone(p, reading[i])


def motor(p, voltage, speed, dt, current, torque):
    """Current and torque on measured voltage and speed (the mean of the speeds at both ends of a step)."""
    s = dc.start(p)
    for i in range(1, len(dt)):
        s, out = dc.advance(p, s, voltage[i - 1], 0.5 * (speed[i - 1] + speed[i]), dt[i])
        current[i] = out.current
        torque[i] = out.torque
    current[0] = current[1]
    torque[0] = torque[1]


def shaft_torque(p, current, speed, angle, dt, torque):
    """Torque of a measured current of a motor that is cold at first."""
    s = dc.State(current[0], angle[0], 0.0, 1.0)
    for i in range(len(dt)):
        s, torque[i] = dc.follow(p, s, current[i], speed[i], angle[i], dt[i])


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


def whole(pc, pm, pr, pl, closed, powered, supply, voltage, angle_setpoint, speed_setpoint, dt, parts, start, out):
    """A drive from its voltage, or with closed > 0 from its set-points.

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
    for i in range(len(dt)):
        if i > 0:
            h = dt[i] / parts
            for _ in range(parts):
                m, mo = dc.advance(pm, m, u, g.speed, h)
                g, go = shaft.advance(pr, g, mo.torque, l.angle, l.speed, h)
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
