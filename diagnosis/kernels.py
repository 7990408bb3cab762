"""Loops over a log, compiled around the laws: one component on its measured inputs, or a whole drive.

Times: sample i is at t[i]; a voltage or command of sample i is held until t[i + 1]. Arrays are float64, SI.
"""

from __future__ import annotations

from functools import cache
from math import cos, exp
from types import SimpleNamespace

from numba import njit

from .laws import MODULES, compiled


@cache
def kernels() -> SimpleNamespace:
    """All kernels, compiled on first use."""
    return SimpleNamespace(lag=_lag, **_electric(), **_gear(), **_control(), **_whole())


@njit(nogil=True)
def _lag(x, dt, time, y):
    """First-order lag of values held over each step, settled at the start, as fmus.sensor has it."""
    y[0] = x[0]
    for i in range(1, len(x)):
        y[i] = x[i] - (x[i] - y[i - 1]) * exp(-dt[i] / time)


def _electric() -> dict:
    dc = compiled(MODULES["motor"])
    start, advance, Condition = dc.start, dc.advance, dc.Condition
    added_resistance, weakening, added_torque = dc.added_resistance, dc.weakening, dc.added_torque

    @njit(nogil=True)
    def motor(p, voltage, speed, dt, current, torque):
        """Current and torque on measured voltage and speed (the mean of the speeds at both ends of a step)."""
        s = start(p)
        for i in range(1, len(dt)):
            s, out = advance(p, s, voltage[i - 1], 0.5 * (speed[i - 1] + speed[i]), dt[i])
            current[i] = out.current
            torque[i] = out.torque
        current[0] = current[1]
        torque[0] = torque[1]

    @njit(nogil=True)
    def shaft_torque(p, current, speed, angle, dt, torque):
        """Torque of a measured current; the copper loss warms as in the motor's law."""
        heat = 0.0
        for i in range(len(dt)):
            x = Condition(0.0, speed[i], current[i], angle[i], heat)
            loss = (p.resistance + added_resistance(p, x)) * current[i] * current[i]
            if p.thermal_time > 0.0:
                heat = loss - (loss - heat) * exp(-dt[i] / p.thermal_time)
            torque[i] = p.torque_constant / (1.0 + weakening(p, x)) * current[i] + added_torque(p, x)

    return {"motor": motor, "shaft_torque": shaft_torque}


def _gear() -> dict:
    shaft, load = compiled(MODULES["reducer"]), compiled(MODULES["load"])
    start, impose = shaft.start, shaft.impose
    moment_of_inertia, gravity_moment, tilt, LoadState = (
        load.moment_of_inertia,
        load.gravity_moment,
        load.tilt,
        load.State,
    )

    @njit(nogil=True)
    def load_torque(p, angle, speed, acceleration, torque):
        """Torque that the load takes for a motion."""
        for i in range(len(angle)):
            s = LoadState(angle[i], speed[i])
            torque[i] = (
                moment_of_inertia(p, s) * acceleration[i]
                + gravity_moment(p, s) * cos(angle[i] + p.arm_angle + tilt(p, s))
                + p.damping * speed[i]
                + p.constant_torque
            )

    @njit(nogil=True)
    def gear(p, angle, speed, output_angle, output_speed, dt, torque):
        """Torque of the gear at its input shaft for imposed motions, those of the start of each step."""
        s = start(p, angle[0], speed[0], output_angle[0], output_speed[0])
        for i in range(len(dt)):
            s, out = impose(p, s, angle[i], speed[i], output_angle[i], output_speed[i], dt[i])
            torque[i] = out.input_torque

    @njit(nogil=True)
    def twist(p, input_angle, output_torque, output_angle):
        """Angle of the load behind spring and play: the flank that carries the torque, or the one touched last."""
        stiffness = 1.0 / (1.0 / p.shaft_stiffness + p.compliance)
        side = 0.0
        for i in range(len(input_angle)):
            if output_torque[i] > 0.0:
                side = 0.5 * p.backlash
            elif output_torque[i] < 0.0:
                side = -0.5 * p.backlash
            output_angle[i] = input_angle[i] / p.gear_ratio - output_torque[i] / stiffness - side

    return {"load_torque": load_torque, "gear": gear, "twist": twist}


def _control() -> dict:
    pd = compiled(MODULES["controller"])
    start, advance = pd.start, pd.advance

    @njit(nogil=True)
    def controller(p, angle_setpoint, speed_setpoint, angle, speed, motor_speed, output_torque, dt, voltage):
        """Command on measured angles. The command of sample i is that of the inputs of sample i."""
        s = start(p, angle_setpoint[0], speed_setpoint[0], angle[0], speed[0], motor_speed[0], output_torque[0])
        for i in range(len(dt)):
            h = dt[i] if i > 0 else 0.0  # the first sample is at the start
            s, out = advance(
                p, s, angle_setpoint[i], speed_setpoint[i], angle[i], speed[i], motor_speed[i], output_torque[i], h
            )
            voltage[i] = out.voltage

    return {"controller": controller}


def _whole() -> dict:
    pd, dc = compiled(MODULES["controller"]), compiled(MODULES["motor"])
    shaft, load = compiled(MODULES["reducer"]), compiled(MODULES["load"])
    control_start, control = pd.start, pd.advance
    motor_start, motor = dc.start, dc.advance
    gear_start, gear = shaft.start, shaft.advance
    LoadState, load_advance = load.State, load.advance

    @njit(nogil=True)
    def whole(pc, pm, pr, pl, closed, powered, supply, voltage, angle_setpoint, speed_setpoint, dt, parts, start, out):
        """A drive from its voltage, or with closed > 0 from its set-points.

        start: angle and speed of the input shaft, angle and speed of the load. With supply above 0 the controller's
        command is a duty. Where powered is 0 the motor is open.
        out rows: voltage, current, motor torque, input angle, input speed, output torque, load angle, load speed.
        """
        angle, speed = start[2], start[3]
        c = control_start(pc, angle_setpoint[0], speed_setpoint[0], angle, speed, start[1], 0.0)
        m = motor_start(pm)
        g = gear_start(pr, start[0], start[1], angle, speed)
        l = LoadState(angle, speed)
        delivered = u = 0.0
        for i in range(len(dt)):
            if i > 0:
                h = dt[i] / parts
                for _ in range(parts):
                    m, mo = motor(pm, m, u, g.speed, h)
                    g, go = gear(pr, g, mo.torque, l.angle, l.speed, h)
                    delivered = go.output_torque
                    l, lo = load_advance(pl, l, delivered, h)
                out[1, i] = mo.current
                out[2, i] = mo.torque
            u = voltage[i]
            if closed > 0.0:
                c, co = control(
                    pc, c, angle_setpoint[i], speed_setpoint[i], l.angle, l.speed, g.speed, delivered, dt[i]
                )
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

    return {"whole": whole}
