"""Drives of the robot that misbehave, as parts in the place of their FMUs: formulas and integration of their own.

The gear is a wedge with bristle friction on an elastic shaft, the motor a winding, both in semi-implicit Euler steps
of 10 µs; the controller is a few lines of arithmetic. What a part has besides its data sheet is an option of the system.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from selflock.master import face
from selflock.master.face import Variable

FINE = 1e-5  # s


class Part(face.Part):
    """Variables as attributes; `advance` moves them on by one step."""

    can_roll_back = True
    inputs_: tuple[str, ...] = ()
    outputs_: tuple[str, ...] = ()

    def __init__(self, name: str, **sheet):
        self.name, self.sheet, self.log = name, sheet, []
        self.state = np.zeros(8)
        self.values = dict.fromkeys((*self.inputs_, *self.outputs_), 0.0)
        self.variables = {n: Variable(n, start=0.0, causality="input") for n in self.inputs_}
        self.variables |= {n: Variable(n, start=0.0, depends_on=(), causality="output") for n in self.outputs_}

    def bind(self, inputs, outputs):
        self._inputs, self._outputs = list(inputs), list(outputs)
        self.u, self.y = np.zeros(len(inputs)), np.zeros(len(outputs))

    def set(self, name, value):
        self.values[name] = float(value)

    def get(self, name):
        return self.values[name]

    def write(self):
        self.values.update(zip(self._inputs, self.u.tolist()))

    def read(self):
        self.y[:] = [self.values[name] for name in self._outputs]

    def step(self, time, size):
        v = self.values
        found = self.advance(*(v[name] for name in self.inputs_), size)
        v.update(zip(self.outputs_, found))

    def save(self):
        return self.state.copy(), dict(self.values)

    def restore(self, saved):
        self.state, self.values = saved[0].copy(), dict(saved[1])


class Gear(Part):
    """Bristle friction; sheet: ratio, friction, inertia, stiffness, damping; misbehaviour: viscous, asymmetry, stribeck."""

    inputs_ = ("motor_torque", "output_angle", "output_speed", "imposed_angle", "imposed_speed")
    outputs_ = ("input_angle", "input_speed", "output_torque")

    def advance(self, motor_torque, output_angle, output_speed, _angle, _speed, size):
        s = self.sheet
        return _gear(
            self.state,
            motor_torque,
            output_angle,
            output_speed,
            size,
            50.0,
            s.get("friction", 0.01),
            2e-5,
            2e4,
            3.0,
            s.get("viscous", 0.0),
            s.get("asymmetry", 0.0),
            s.get("stribeck", 0.0),
        )


@njit(cache=True)
def _gear(s, motor_torque, q, qd, size, ratio, friction, inertia, stiffness, damping, viscous, asymmetry, stribeck):
    n = max(1, round(size / FINE))
    dt = size / n
    slope = 1.0 / ratio
    cos, sin = 1.0 / math.sqrt(1.0 + slope**2), slope / math.sqrt(1.0 + slope**2)
    theta, omega, bristle, torque = s[0], s[1], s[2], 0.0
    for _ in range(n):
        torque = stiffness * (theta / ratio - q) + damping * (omega / ratio - qd)
        turned = math.copysign(1.0, omega) + (bristle - math.copysign(1.0, omega)) * math.exp(-abs(omega) * dt / 1e-3)
        grip = turned + 4e-4 * (turned - bristle) / dt
        bristle = turned
        mu = friction * (1.0 + asymmetry * math.tanh(omega / 0.05)) * (1.0 + stribeck / (1.0 + (omega / 8.0) ** 2))
        mu *= min(max(grip, -1.0), 1.0)
        normal = torque / (cos - mu * math.copysign(sin, torque))
        load = torque * slope + mu * abs(normal) / cos + viscous * omega
        omega += dt * (motor_torque - load) / inertia
        theta += dt * omega
        q += dt * qd
    s[0], s[1], s[2] = theta, omega, bristle
    return theta, omega, torque


class Motor(Part):
    """A winding; misbehaviour: a drop of voltage at the brushes, torque per ampere that falls with the current,
    heating, another resistance than the data sheet's."""

    inputs_ = ("voltage", "speed")
    outputs_ = ("current", "torque")

    def advance(self, voltage, speed, size):
        s = self.sheet
        return _motor(
            self.state,
            voltage,
            speed,
            size,
            s.get("resistance", 0.299),
            8.23e-5,
            0.0302,
            s.get("brush_drop", 0.0),
            s.get("half_current", 1e9),
            s.get("heating", 0.0),
            s.get("heating_time", 4.0),
        )


@njit(cache=True)
def _motor(s, voltage, speed, size, resistance, inductance, constant, drop, half_current, heating, heating_time):
    n = max(1, round(size / FINE))
    dt = size / n
    i, warm = s[0], s[1]
    for _ in range(n):
        flux = 1.0 / (1.0 + (i / half_current) ** 2)
        hot = resistance * (1.0 + 0.0039 * warm)
        warm += dt * (heating * hot * i * i - warm) / heating_time
        driven = voltage - drop * math.tanh(i / 0.05) - constant * flux * speed
        i = (i + dt / inductance * driven) / (1.0 + dt / inductance * hot)
    s[0], s[1] = i, warm
    return i, constant * flux * i


class Controller(Part):
    """Two gains, a limit, and letting go at rest as far as the gear's friction holds; misbehaviour: a lower limit, a dead zone."""

    inputs_ = ("angle_setpoint", "speed_setpoint", "angle", "speed", "motor_speed", "output_torque")
    outputs_ = ("voltage",)

    def advance(self, wanted_angle, wanted_speed, angle, speed, motor_speed, load, size):
        limit, dead = self.sheet.get("limit", 24.0), self.sheet.get("dead_zone", 0.0)
        asked = 2000.0 * (wanted_angle - angle) + 8.0 * (wanted_speed - speed)
        asked = math.copysign(min(max(abs(asked) - dead, 0.0), limit), asked)
        still = wanted_speed == 0.0 and (self.state[0] > 0.0 or abs(motor_speed) <= 0.25 and abs(speed) <= 0.005)
        self.state[0] = min(self.state[0] + size, 0.3) if still else 0.0
        alpha, phi = math.atan(1.0 / 50.0), math.atan(0.01)
        easy, hard = load * math.tan(alpha - phi), load * math.tan(alpha + phi)
        hold = 0.299 / 0.0302 * (easy + 0.02 * (hard - easy))
        return (hold + (asked - hold) * (1.0 - self.state[0] / 0.3),)
