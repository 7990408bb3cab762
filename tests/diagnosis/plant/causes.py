"""What can be hidden in the plant: every row of the vocabulary, a wrong parameter, and things outside it.

A cause is drawn by a random generator (its kind of shape) and then asked for at a strength: 1 is a
middling case, 0 nothing. The plant's laws are not the product's, so only what has the same meaning in
both is given as `parameters` to be found again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .drive import SENSED, Drive

Draw = Callable[[np.random.Generator, Drive], Callable[[float], dict]]


@dataclass(frozen=True)
class Cause:
    """One thing to hide. `change(strength)` gives the fields of `Drive` that it sets."""

    component: str
    effect: str
    change: Callable[[float], dict]
    what: str = ""  # a parameter's or a channel's name, where the effect has one
    depends_on: tuple[str, ...] = ()  # for `unknown`: channels that the remainder must be seen to depend on
    extent: tuple[float, float] = (0.02, 12.0)  # strengths that make sense
    parameters: Callable[[float], dict] = field(default=lambda strength: {})  # of the product's effect, to be found

    @property
    def name(self) -> str:
        return f"{self.component}.{self.effect}"


def _sign(rng):
    return rng.choice((-1.0, 1.0))


def _stribeck(rng, d):
    speed = np.exp(rng.uniform(np.log(5.0), np.log(20.0)))
    return Cause("reducer", "stribeck", lambda s: dict(stribeck=0.6 * s, stribeck_speed=speed), extent=(0.02, 2.5))


def _viscous(rng, d):
    return Cause("reducer", "viscous", lambda s: dict(viscous=3e-4 * s))


def _asymmetric(rng, d):
    sign = _sign(rng)
    return Cause("reducer", "asymmetric", lambda s: dict(asymmetry=0.2 * sign * s), extent=(0.02, 3.0))


def _load_dependent(rng, d):
    more, less = rng.uniform(0.4, 0.8), rng.uniform(-0.4, 0.1)
    if rng.random() < 0.5:
        more, less = less, more
    return Cause(
        "reducer", "load_dependent", lambda s: dict(load_driving=more * s, load_backdriving=less * s), extent=(0.02, 2.0)
    )


def _preload(rng, d):
    return Cause(
        "reducer", "preload", lambda s: dict(preload=1.5 * s), extent=(0.1, 3.0), parameters=lambda s: dict(preload=1.5 * s)
    )


def _ripple(rng, d):
    order = d.gear_ratio * rng.choice((1.0, 2.0))
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return Cause("reducer", "ripple", lambda s: dict(ripple=0.3 * s, ripple_order=order, ripple_phase=phase), extent=(0.02, 3.0))


def _backlash(rng, d):
    return Cause(
        "reducer",
        "backlash",
        lambda s: dict(backlash=0.015 * s),
        extent=(0.02, 4.0),
        parameters=lambda s: dict(backlash=0.015 * s),
    )


def _compliance(rng, d):
    return Cause(
        "reducer",
        "compliance",
        lambda s: dict(compliance=1e-3 * s),
        extent=(0.05, 6.0),
        parameters=lambda s: dict(compliance=1e-3 * s),
    )


def _warm_up(rng, d):
    time = rng.uniform(3.0, 8.0)
    return Cause("reducer", "warm_up", lambda s: dict(warm_up=0.6 * s, warm_up_time=time), extent=(0.02, 3.0))


def _wear(rng, d):
    sign = _sign(rng)
    return Cause(
        "reducer", "wear", lambda s: dict(wear=0.4 * sign * s, wear_distance=400.0), extent=(0.02, 1.2 if sign < 0 else 4.0)
    )


def _winding_heating(rng, d):
    time = rng.uniform(4.0, 10.0)
    return Cause("motor", "winding_heating", lambda s: dict(heating=12.0 * s, heating_time=time), extent=(0.02, 6.0))


def _torque_constant(rng, d):
    return Cause("motor", "torque_constant", lambda s: dict(saturation_current=8.0 / np.sqrt(max(s, 1e-9))), extent=(0.02, 5.0))


def _brush_drop(rng, d):
    return Cause(
        "motor",
        "brush_drop",
        lambda s: dict(brush_drop=0.6 * s),
        extent=(0.02, 3.0),
        parameters=lambda s: dict(brush_drop=0.6 * s),
    )


def _cogging(rng, d):
    order = float(rng.choice((5, 7, 9, 12)))
    return Cause("motor", "cogging", lambda s: dict(cogging=0.008 * s, cogging_order=order), extent=(0.02, 4.0))


def _supply_sag(rng, d):
    return Cause("motor", "supply_sag", lambda s: dict(supply_resistance=1.5 * s), extent=(0.02, 4.0))


def _delay(rng, d):
    return Cause(
        "controller", "delay", lambda s: dict(delay=0.008 * s), extent=(0.1, 1.6), parameters=lambda s: dict(delay=0.008 * s)
    )


def _dead_zone(rng, d):
    return Cause(
        "controller",
        "dead_zone",
        lambda s: dict(dead_zone=0.6 * s),
        extent=(0.05, 3.0),
        parameters=lambda s: dict(dead_zone=0.6 * s),
    )


def _saturation(rng, d):
    def change(s):
        limit = 14.0 / (1.0 + s)
        return dict(voltage_max=limit, voltage_min=-limit)

    return Cause("controller", "saturation", change, extent=(0.3, 1.6))


def _sampling(rng, d):
    period = rng.choice((8, 12, 16, 20)) * 1e-3
    return Cause(
        "controller", "sampling", lambda s: dict(sampling=period), extent=(1.0, 1.0), parameters=lambda s: dict(sampling=period)
    )


def _at(channel, value):
    values = [0.0] * len(SENSED)
    values[SENSED.index(channel)] = float(value)
    return tuple(values)


def _sensor(effect, typical, extent, both=True):
    def draw(rng, d):
        channel = rng.choice(list(typical))
        sign = _sign(rng) if both else 1.0
        field_name = "step" if effect == "quantisation" else effect
        return Cause(
            "sensor",
            effect,
            lambda s: {field_name: _at(channel, sign * s * typical[channel])},
            what=str(channel),
            extent=extent,
            parameters=lambda s: {effect: sign * s * typical[channel]},
        )

    return draw


_bias = _sensor("bias", {"current": 0.2, "motor_speed": 1.0, "speed": 0.03}, (0.05, 6.0))
_scale = _sensor("scale", {"current": 0.1, "motor_speed": 0.05}, (0.05, 4.0))
_lag = _sensor("lag", {"current": 0.015, "motor_speed": 0.015}, (0.1, 4.0), both=False)
_quantisation = _sensor("quantisation", {"current": 0.3, "angle": 0.01}, (0.1, 4.0), both=False)


def _load(effect, fields, extent=(0.02, 3.0)):
    def draw(rng, d):
        sign = _sign(rng)
        return Cause("load", effect, lambda s: fields(d, sign * s), extent=extent)

    return draw


_mass = _load("mass", lambda d, s: dict(mass=d.mass * (1.0 + 0.2 * s)))
_centre_of_mass = _load("centre_of_mass", lambda d, s: dict(arm=d.arm * (1.0 + 0.15 * s)))
_inertia = _load("inertia", lambda d, s: dict(load_inertia=max(d.load_inertia + 0.05 * abs(s), 0.0)), extent=(0.1, 8.0))
_tilt = _load("tilt", lambda d, s: dict(tilt=0.08 * s))


def _parameter(rng, d):
    """A data sheet's value that is just not so; the names are those of the product's components."""
    component, name = (
        ("motor", "resistance"),
        ("motor", "voltage_constant"),
        ("reducer", "friction_kinetic"),
        ("reducer", "shaft_inertia"),
        ("controller", "angle_gain"),
        ("controller", "speed_gain"),
    )[rng.integers(6)]
    field_name = {"friction_kinetic": "friction"}.get(name, name)
    size = _sign(rng) * {"shaft_inertia": 0.5}.get(name, 0.2)
    value = getattr(d, field_name)
    return Cause(
        component,
        "parameter",
        lambda s: {field_name: value * (1.0 + size * s)},
        what=name,
        extent=(0.02, 3.0),
        parameters=lambda s: {name: value * (1.0 + size * s)},
    )


def _ambient(rng, d):
    sign = _sign(rng)
    return Cause(
        "-",
        "unknown",
        lambda s: dict(ambient_friction=0.8 * sign * s),
        what="ambient",
        depends_on=("room.temperature",),
        extent=(0.02, 1.2),
    )


def _disturbance(rng, d):
    frequency = rng.uniform(1.0, 6.0)
    return Cause(
        "-",
        "unknown",
        lambda s: dict(disturbance=0.5 * s, disturbance_frequency=frequency),
        what="disturbance",
        depends_on=("time", "frequency"),
        extent=(0.02, 4.0),
    )


def _end_stop(rng, d):
    return Cause(
        "-",
        "unknown",
        lambda s: dict(end_stop=0.6, end_stop_stiffness=3.0 * s),
        what="end_stop",
        depends_on=("angle", "position"),
        extent=(0.02, 4.0),
    )


DRAWS: dict[str, Draw] = {
    "reducer.stribeck": _stribeck,
    "reducer.viscous": _viscous,
    "reducer.asymmetric": _asymmetric,
    "reducer.load_dependent": _load_dependent,
    "reducer.preload": _preload,
    "reducer.ripple": _ripple,
    "reducer.backlash": _backlash,
    "reducer.compliance": _compliance,
    "reducer.warm_up": _warm_up,
    "reducer.wear": _wear,
    "motor.winding_heating": _winding_heating,
    "motor.torque_constant": _torque_constant,
    "motor.brush_drop": _brush_drop,
    "motor.cogging": _cogging,
    "motor.supply_sag": _supply_sag,
    "controller.delay": _delay,
    "controller.dead_zone": _dead_zone,
    "controller.saturation": _saturation,
    "controller.sampling": _sampling,
    "sensor.bias": _bias,
    "sensor.scale": _scale,
    "sensor.lag": _lag,
    "sensor.quantisation": _quantisation,
    "load.mass": _mass,
    "load.centre_of_mass": _centre_of_mass,
    "load.inertia": _inertia,
    "load.tilt": _tilt,
    "parameter": _parameter,
    "unknown.ambient": _ambient,
    "unknown.disturbance": _disturbance,
    "unknown.end_stop": _end_stop,
}
VOCABULARY = tuple(name for name in DRAWS if not name.startswith(("unknown", "parameter")))
OUTSIDE = tuple(name for name in DRAWS if name.startswith("unknown"))
