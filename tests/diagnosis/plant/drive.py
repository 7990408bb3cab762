"""The physics of the hidden drive: PD controller, DC motor, wedge gear with bristle friction, load on an arm.

Semi-implicit Euler in steps of at most 50 µs. Everything that can be hidden is a field of `Drive`
whose default switches it off. SI units; angles in rad, load angle 0 = arm hanging down.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

CHANNELS = (
    "setpoint_angle",
    "setpoint_speed",
    "voltage",
    "current",
    "motor_angle",
    "motor_speed",
    "angle",
    "speed",
    "ambient",
    "motor_torque",
)
SENSED = ("current", "motor_angle", "motor_speed", "angle", "speed")  # channels that can carry a sensor's error
GRAVITY = 9.81


class Drive(NamedTuple):
    """The nominal drive first, then everything that can be hidden, off by default."""

    # motor
    resistance: float = 2.0  # ohm
    inductance: float = 5e-4  # H
    voltage_constant: float = 0.05  # V.s/rad
    torque_constant: float = 0.05  # N.m/A
    # gear; torques of the wedge are reduced to its two shafts
    gear_ratio: float = 50.0
    wedge_angle: float = math.atan(0.02)
    friction: float = 0.012
    shaft_inertia: float = 8e-5  # kg.m2, rotor included
    shaft_stiffness: float = 3000.0  # N.m/rad, output side
    shaft_damping: float = 15.0  # N.m.s/rad
    bristle: float = 1e-3  # rad of the motor's shaft over which friction turns round
    # load
    mass: float = 2.0  # kg
    arm: float = 0.25  # m, from the axis to the centre of mass
    load_inertia: float = 0.02  # kg.m2, about the axis, beside mass and arm
    tilt: float = 0.0  # rad, of the bench's frame
    constant_torque: float = 0.0  # N.m against positive motion, as of a weight on a pulley
    # controller
    angle_gain: float = 100.0  # V/rad
    speed_gain: float = 8.0  # V.s/rad
    voltage_min: float = -24.0  # V
    voltage_max: float = 24.0  # V
    # hidden in the gear
    stribeck: float = 0.0  # (static - kinetic)/kinetic friction
    stribeck_speed: float = 10.0  # rad/s of the motor's shaft
    viscous: float = 0.0  # N.m.s/rad, motor's shaft
    asymmetry: float = 0.0  # relative difference of friction forward and backward, halved
    load_driving: float = 0.0  # relative rise of friction per reference load, driving
    load_backdriving: float = 0.0  # the same, back-driving
    preload: float = 0.0  # N.m
    ripple: float = 0.0  # relative amplitude of friction over a turn
    ripple_order: float = 1.0  # per turn of the output shaft
    ripple_phase: float = 0.0
    backlash: float = 0.0  # rad, whole play, output side
    compliance: float = 0.0  # rad/(N.m), beside 1/shaft_stiffness
    warm_up: float = 0.0  # relative friction above the warm one at the start
    warm_up_time: float = 10.0  # s
    wear: float = 0.0  # relative change of friction per `wear_distance`
    wear_distance: float = 500.0  # rad of the motor's shaft
    # hidden in the motor
    heating: float = 0.0  # K/W, winding above its surroundings
    heating_time: float = 8.0  # s
    saturation_current: float = 1e9  # A at which torque per ampere has fallen to a half
    brush_drop: float = 0.0  # V
    cogging: float = 0.0  # N.m
    cogging_order: float = 7.0  # per turn of the rotor
    supply_voltage: float = 24.0  # V
    supply_resistance: float = 0.0  # ohm
    # hidden in the controller
    delay: float = 0.0  # s
    dead_zone: float = 0.0  # V
    sampling: float = 0.0  # s; 0: at every row of the log
    # outside the vocabulary
    ambient_friction: float = 0.0  # relative change of friction per 10 K of the room
    disturbance: float = 0.0  # N.m on the load, periodic in time
    disturbance_frequency: float = 2.3  # Hz
    end_stop: float = 1e9  # rad, where a rubber buffer begins
    end_stop_stiffness: float = 0.0  # N.m/rad
    # sensors: bias, scale error, lag and step of each channel in SENSED
    bias: tuple = (0.0,) * 5
    scale: tuple = (0.0,) * 5
    lag: tuple = (0.0,) * 5
    step: tuple = (0.0,) * 5  # seen by the controller; the recorder rounds after its noise


@njit(cache=True)
def _friction(d, omega, torque, travel, position, time, ambient):
    """Friction coefficient of the wedge: Lorentzian Stribeck, powers of load, hyperbolic warm-up."""
    mu = d.friction * (1.0 + d.stribeck / (1.0 + (omega / d.stribeck_speed) ** 2))
    mu *= 1.0 + d.asymmetry * math.tanh(omega / 0.05)
    level = (abs(torque) / 5.0) ** 0.9
    driving = 0.5 + 0.5 * math.tanh(torque * omega / 0.05)
    mu *= 1.0 + level * (d.load_driving * driving + d.load_backdriving * (1.0 - driving))
    turn = d.ripple_order * position + d.ripple_phase
    mu *= 1.0 + d.ripple * (math.sin(turn) + 0.15 * math.sin(2.0 * turn))
    mu *= 1.0 + d.warm_up / (1.0 + time / d.warm_up_time) ** 2
    mu *= 1.0 + d.wear * (travel / d.wear_distance) ** 0.9
    mu *= 1.0 + d.ambient_friction * (ambient - 22.0) / 10.0
    return max(mu, 0.0)


@njit(cache=True)
def _round(value, step):
    return value if step <= 0.0 else step * math.floor(value / step + 0.5)


@njit(cache=True)
def simulate(d, angle_setpoint, speed_setpoint, ambient, h, fine, start):
    """Rows of CHANNELS at every h seconds; `fine` steps between two rows; starts at rest at load angle `start`."""
    n = len(angle_setpoint)
    out = np.empty((n, 10))
    dt = h / fine
    tan, sin, cos = math.tan(d.wedge_angle), math.sin(d.wedge_angle), math.cos(d.wedge_angle)
    stiffness = 1.0 / (1.0 / d.shaft_stiffness + d.compliance)
    inertia = d.load_inertia + d.mass * d.arm**2
    weight = d.mass * GRAVITY * d.arm
    hung = weight * math.sin(start + d.tilt) + d.constant_torque
    q, qd, omega, z, current = start, 0.0, 0.0, 0.0, 0.0
    theta = d.gear_ratio * (start + hung / stiffness + 0.5 * d.backlash * np.sign(hung))
    torque, drive, winding, housing, travel = 0.0, 0.0, 0.0, 0.0, 0.0
    command, since = 0.0, 1e9
    late = np.zeros(int(d.delay / dt) + 1)
    slot = 0
    filtered = np.array([0.0, theta, 0.0, q, 0.0])
    reading = np.zeros(5)
    for k in range(n):
        true = (current, theta, omega, q, qd)
        for j in range(5):
            # a first-order lag, exact over a held sample, then scale and bias
            filtered[j] += (true[j] - filtered[j]) * (1.0 if d.lag[j] <= 0.0 else 1.0 - math.exp(-h / d.lag[j]))
            reading[j] = filtered[j] * (1.0 + d.scale[j]) + d.bias[j]
        since += h
        if since >= d.sampling - 1e-9:
            since = 0.0
            command = d.angle_gain * (angle_setpoint[k] - _round(reading[3], d.step[3]))
            command += d.speed_gain * (speed_setpoint[k] - _round(reading[4], d.step[4]))
            command = min(max(command, d.voltage_min), d.voltage_max)
            command = math.copysign(max(abs(command) - d.dead_zone, 0.0), command)
        out[k, 0], out[k, 1] = angle_setpoint[k], speed_setpoint[k]
        for j in range(5):
            out[k, 3 + j] = reading[j]
        out[k, 8] = ambient[k]
        out[k, 9] = drive
        for i in range(fine):
            time = (k + i / fine) * h
            late[slot] = command
            slot = (slot + 1) % len(late)
            voltage = late[slot]
            if i == 0:
                out[k, 2] = voltage  # what acts, not what was computed
            # supply, brushes, winding (two thermal masses), armature
            voltage *= 1.0 - d.supply_resistance * max(voltage * current, 0.0) / d.supply_voltage**2
            voltage -= d.brush_drop * math.tanh(current / 0.03)
            heat = d.resistance * current**2 * d.heating
            winding += dt * (0.8 * heat - winding) / d.heating_time
            housing += dt * (0.2 * heat - housing) / (6.0 * d.heating_time)
            resistance = d.resistance * (1.0 + 0.0039 * (winding + housing))
            flux = 1.0 / (1.0 + (current / d.saturation_current) ** 2)
            pull = dt / d.inductance
            current = (current + pull * (voltage - d.voltage_constant * flux * omega)) / (1.0 + pull * resistance)
            drive = d.torque_constant * flux * current - d.cogging * math.sin(d.cogging_order * theta)
            # shaft: spring with play
            twist = theta / d.gear_ratio - q
            play = min(max(twist, -0.5 * d.backlash), 0.5 * d.backlash)
            torque = stiffness * (twist - play)
            if twist != play or d.backlash == 0.0:
                torque += d.shaft_damping * (omega / d.gear_ratio - qd)
            # bristle friction on the wedge, its normal force with a rounded preload
            mu = _friction(d, omega, torque, travel, theta / d.gear_ratio, time, ambient[k])
            bent = z + (math.copysign(1.0, omega) - z) * (1.0 - math.exp(-abs(omega) * dt / d.bristle))
            rate = (bent - z) / dt
            z = bent
            grip = mu * min(max(z + 4e-4 * rate, -1.0), 1.0)
            normal = torque / (cos - grip * math.copysign(sin, torque))
            press = abs(normal) if d.preload == 0.0 else (normal**6 + d.preload**6) ** (1.0 / 6.0)
            load = torque * tan + grip * press / cos
            load += d.viscous * omega * (1.0 + (omega / 40.0) ** 2) ** -0.05
            omega += dt / d.shaft_inertia * (drive - load)
            theta += dt * omega
            travel += dt * abs(omega)
            # load
            outside = d.disturbance * math.sin(2.0 * math.pi * d.disturbance_frequency * time)
            over = abs(q) - d.end_stop
            if over > 0.0:
                outside -= math.copysign(d.end_stop_stiffness * over**1.2, q)
            qd += dt / inertia * (torque + outside - d.constant_torque - weight * math.sin(q + d.tilt))
            q += dt * qd
        if not abs(q) < 50.0:
            out[k + 1 :] = np.nan
            return out
    return out
