"""The physics of the hidden drive: PD controller, DC motor, wedge gear with bristle friction, load on an arm.

Semi-implicit Euler in steps of at most 50 µs. Friction, contact and armature have several forms, none of them the
product's; each is a function of its own, so that its limits can be tested. `d` is a `Drive`.

    bristle     Dahl (1968); LuGre, Canudas de Wit et al. (1995); elasto-plastic, Dupont et al. (2002)
    contact     spring and damper; a damper that takes hold over a depth, as in ADAMS' IMPACT function (Ryan 1990)
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

GRAVITY = 9.81
DEPTH = 0.02  # of the play, over which the damper of its flanks takes hold
BREAKAWAY = 0.7  # share of the largest friction up to which an elasto-plastic bristle only bends


@njit(cache=True)
def friction(d, omega, torque, travel, position, time, ambient):
    """Friction coefficient of the wedge: Stribeck, powers of load, hyperbolic warm-up."""
    if d.stribeck_form == 0:
        mu = d.friction * (1.0 + d.stribeck / (1.0 + (omega / d.stribeck_speed) ** 2))
    else:
        mu = d.friction * (1.0 + d.stribeck / math.cosh(min(abs(omega / d.stribeck_speed), 300.0)))
    mu *= 1.0 + d.asymmetry * math.tanh(omega / 0.05)
    level = (abs(torque) / 5.0) ** 0.9
    driving = 0.5 + 0.5 * math.tanh(torque * omega / 0.05)
    mu *= 1.0 + level * (d.load_driving * driving + d.load_backdriving * (1.0 - driving))
    turn = d.ripple_order * position + d.ripple_phase
    mu *= 1.0 + d.ripple * (math.sin(turn) + 0.15 * math.sin(2.0 * turn))
    mu *= 1.0 + d.warm_up / (1.0 + time / d.warm_up_time) ** 2
    mu *= 1.0 + d.wear * (travel / d.wear_distance) ** 0.9
    mu *= 1.0 + d.ambient_friction * (ambient - 22.0) / 10.0
    if time > d.loosened_time:
        mu *= 1.0 + d.loosened
    return max(mu, 0.0)


@njit(cache=True)
def viscous(d, omega):
    """Torque of the oil on the motor's shaft."""
    if d.viscous_form == 0:
        return d.viscous * omega * (1.0 + (omega / 40.0) ** 2) ** -0.05
    return d.viscous * omega * (1.0 + 0.1 * math.tanh(abs(omega) / 40.0))


@njit(cache=True)
def bristle(d, z, omega, mu, dt):
    """The bristle's new bend and the coefficient with which it grips: mu · sign(omega) once it slides.

    The bend is relative to the largest in Dahl's and in the elasto-plastic form. In LuGre's it is a coefficient itself,
    which follows a changing mu only as the shaft moves on.
    """
    sign = math.copysign(1.0, omega)
    if d.bristle_form == 0:
        bent = z + (sign - z) * (1.0 - math.exp(-abs(omega) * dt / d.bristle))
    elif d.bristle_form == 1:
        most = max(mu, 1e-9)
        bent = z + (sign * most - z) * (1.0 - math.exp(-abs(omega) * dt * d.friction / (d.bristle * most)))
        reach = max(most, abs(bent))
        return bent, min(max(bent + 4e-4 * (bent - z) / dt, -reach), reach)
    else:
        slides = 0.0
        if z * sign > BREAKAWAY:
            slides = 0.5 - 0.5 * math.cos(math.pi * min((abs(z) - BREAKAWAY) / (1.0 - BREAKAWAY), 1.0))
        moved = omega * dt / d.bristle
        bent = min(max((z + moved) / (1.0 + slides * abs(moved)), -1.0), 1.0)
    rate = (bent - z) / dt
    return bent, mu * min(max(bent + 4e-4 * rate, -1.0), 1.0)


@njit(cache=True)
def contact(d, stiffness, twist, rate):
    """Torque of the output shaft, wound up by `twist` at `rate`, behind its play."""
    play = min(max(twist, -0.5 * d.backlash), 0.5 * d.backlash)
    torque = stiffness * (twist - play)
    if d.contact_form == 1 and d.backlash > 0.0:
        deep = min(abs(twist - play) / (DEPTH * d.backlash), 1.0)
        damped = torque + d.shaft_damping * (3.0 - 2.0 * deep) * deep * deep * rate
        return damped if damped * torque > 0.0 else 0.0  # no pull at the end of a touch
    if twist != play or d.backlash == 0.0:
        torque += d.shaft_damping * rate
    return torque


@njit(cache=True)
def chopped(d, voltage, time, dt):
    """Mean voltage over a step behind a pulse-width modulation, whose pulse stands in the middle of its period."""
    if d.chopper <= 0.0:
        return voltage
    phase = time / d.chopper
    phase -= math.floor(phase + 1e-6)
    half = 0.5 * min(abs(voltage) / d.supply_voltage, 1.0)
    on = max(min(phase + dt / d.chopper, 0.5 + half) - max(phase, 0.5 - half), 0.0)
    return math.copysign(d.supply_voltage * on * d.chopper / dt, voltage)


@njit(cache=True)
def armature(d, voltage, current, omega, theta, resistance, dt):
    """The new current, and the flux relative to the data sheet's, which makes both torque and back-EMF."""
    flux = 1.0 / (1.0 + (current / d.saturation_current) ** 2)
    if d.commutation > 0.0:
        flux *= 1.0 + d.commutation * math.cos(2.0 * d.segments * theta)
    if d.armature_form == 1:
        driving = voltage - d.voltage_constant * flux * omega
        return math.copysign(max(abs(driving) - d.brush_drop, 0.0) / resistance, driving), flux
    voltage -= d.brush_drop * math.tanh(current / 0.03)
    pull = dt / d.inductance
    return (current + pull * (voltage - d.voltage_constant * flux * omega)) / (1.0 + pull * resistance), flux


@njit(cache=True)
def _round(value, step):
    return value if step <= 0.0 else step * math.floor(value / step + 0.5)


@njit(cache=True)
def simulate(d, angle_setpoint, speed_setpoint, ambient, h, fine, start, ticks=1):
    """Rows of CHANNELS at every h seconds; `fine` steps between two rows; starts at rest at load angle `start`.

    The controller may act `ticks` times between two rows; `fine` is a multiple of that.
    """
    n = len(angle_setpoint)
    out = np.empty((n, 12))
    dt, tick, every = h / fine, h / ticks, fine // ticks
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
        for i in range(fine):
            time = (k + i / fine) * h
            if i % every == 0:
                shown = current * (1.0 - d.current_curve * abs(current))
                true = (shown, theta, omega, q + d.eccentricity * math.sin(q + d.eccentricity_phase), qd)
                for j in range(5):
                    # a first-order lag, exact over a held sample, then scale and bias
                    filtered[j] += (true[j] - filtered[j]) * (1.0 if d.lag[j] <= 0.0 else 1.0 - math.exp(-tick / d.lag[j]))
                    reading[j] = filtered[j] * (1.0 + d.scale[j]) + d.bias[j]
                since += tick
                if since >= d.sampling - 1e-9:
                    since = 0.0
                    command = d.angle_gain * (angle_setpoint[k] - _round(reading[3], d.step[3]))
                    command += d.speed_gain * (speed_setpoint[k] - _round(reading[4], d.step[4]))
                    command = min(max(command, d.voltage_min), d.voltage_max)
                    command = math.copysign(max(abs(command) - d.dead_zone, 0.0), command)
            late[slot] = command
            slot = (slot + 1) % len(late)
            voltage = late[slot]
            left = 1.0 - d.supply_resistance * max(voltage * current, 0.0) / d.supply_voltage**2
            if i == 0:
                out[k, 0], out[k, 1] = angle_setpoint[k], speed_setpoint[k]
                out[k, 2] = voltage  # what acts, not what was computed
                for j in range(5):
                    out[k, 3 + j] = reading[j]
                out[k, 8], out[k, 9], out[k, 10], out[k, 11] = ambient[k], drive, d.supply_voltage * left, torque
            # supply, winding (two thermal masses), armature
            voltage = chopped(d, voltage, time, dt) * left
            heat = d.resistance * current**2 * d.heating
            winding += dt * (0.8 * heat - winding) / d.heating_time
            housing += dt * (0.2 * heat - housing) / (6.0 * d.heating_time)
            resistance = d.resistance * (1.0 + 0.0039 * (winding + housing))
            current, flux = armature(d, voltage, current, omega, theta, resistance, dt)
            drive = d.torque_constant * flux * current - d.cogging * math.sin(d.cogging_order * theta)
            torque = contact(d, stiffness, theta / d.gear_ratio - q, omega / d.gear_ratio - qd)
            # bristle friction on the wedge, its normal force with a rounded preload
            mu = friction(d, omega, torque, travel, theta / d.gear_ratio, time, ambient[k])
            z, grip = bristle(d, z, omega, mu, dt)
            normal = torque / (cos - grip * math.copysign(sin, torque))
            press = abs(normal) if d.preload == 0.0 else (normal**6 + d.preload**6) ** (1.0 / 6.0)
            load = torque * tan + grip * press / cos
            load += viscous(d, omega)
            along = theta / d.gear_ratio - d.tooth_place
            if d.tooth != 0.0 and 0.0 < along < d.tooth_length:
                load += d.tooth * math.sin(math.pi * along / d.tooth_length) ** 2
            omega += dt / d.shaft_inertia * (drive - load)
            theta += dt * omega
            travel += dt * abs(omega)
            # load
            outside = d.disturbance * math.sin(2.0 * math.pi * d.disturbance_frequency * time)
            over = abs(q) - d.end_stop
            if over > 0.0:
                outside -= math.copysign(d.end_stop_stiffness * over**1.2, q)
            if d.dent > 0.0:
                outside -= d.dent * math.exp(-(((q - d.dent_angle) / d.dent_width) ** 2)) * math.tanh(qd / 0.02)
            qd += dt / inertia * (torque + outside - d.constant_torque - weight * math.sin(q + d.tilt))
            q += dt * qd
        if not abs(q) < 50.0:
            out[k + 1 :] = np.nan
            return out
    return out
