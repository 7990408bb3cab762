"""Tables as an ideal study would give them, from closed forms alone: every claim holds on them."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from selflock.study.claims import Curves, Facts, Runs
from selflock.study.turns import FRONT, REAR, motion

FACTS = Facts(gear_ratio=50.0, resistance=0.3, torque_constant=0.03, sprocket_radius=0.07)
TIME = np.linspace(0, 10, 10001)
REAR_MOTION = np.array([motion(REAR, t) for t in TIME])
FRONT_MOTION = np.array([motion(FRONT, t) for t in TIME])
RELEASE = 0.15  # s


def output_torque(mode: str) -> np.ndarray:
    """P in N.m: -10 in A, the holder's weight while lifted, a landing, 7 in B, 12 falling with the cosine when raising."""
    angle = REAR_MOTION[:, 0]
    weight = 1.8 * np.cos(angle)
    landing = 9.0 if mode == "kinematic" else 7.0
    P = np.select(
        [TIME < 2.0, TIME < 3.9, TIME < 4.0, TIME < 6.0],
        [
            np.full_like(TIME, -10.0),
            weight + (-10.0 - weight) * np.exp(-np.clip(TIME - 2.0, 0, None) / 0.03),
            -1.8 + (7.0 + landing + 1.8) * np.clip((TIME - 3.9) / 0.1, 0, 1),
            7.0 + landing * np.exp(-np.clip(TIME - 4.0, 0, None) / 0.1),
        ],
        12.0 * np.cos(angle - math.pi) + (7.0 - 12.0) * np.exp(-np.clip(TIME - 6.0, 0, None) / 0.03),
    )
    return P + 0.002 * np.sin(40 * TIME)  # segments passing


def table(mode: str, mu: float) -> pd.DataFrame:
    P, angle, speed = output_torque(mode), REAR_MOTION[:, 0], REAR_MOTION[:, 1] * FACTS.gear_ratio
    up, down = (math.tan(FACTS.alpha + sign * math.atan(mu)) for sign in (1, -1))
    held = P * max(down, 0.0) if mu != 0.02 else 0.0 * P
    sliding = np.where(P * speed > 0, P * up, P * down)
    F = np.where(speed == 0, held, sliding)
    if mode == "dynamic" and mu > 0:
        for start, stop in ((4.0, 6.0), (8.0, 10.01)):
            rest = (TIME >= start) & (TIME < stop)
            at_stop = P[rest][0] * up
            F[rest] = held[rest] + (at_stop - held[rest][0]) * np.exp(-(TIME[rest] - start) / RELEASE)
    current = F / FACTS.torque_constant
    electric = (FACTS.torque_constant * speed + FACTS.resistance * current) * current
    return pd.DataFrame(
        {
            "time": TIME,
            "rear_reducer.input_torque": F,
            "rear_reducer.output_torque": P,
            "rear_reducer.input_speed": speed,
            "rear_reducer.output_power": P * REAR_MOTION[:, 1],
            "rear_motor.torque": F,
            "rear_motor.electric_power": electric,
            "rear_motor.mechanical_power": F * speed,
            "robot.rear_angle": angle,
            "robot.front_angle": FRONT_MOTION[:, 0],
            "robot.rear_pressure_x": np.where(TIME < 2.2, 0.1, 0.01),
            "robot.rear_ground_normal": np.full_like(TIME, 90.0),
            "robot.rear_gravity_moment": 1.8 * np.cos(angle),
        }
    )


def ideal() -> Runs:
    runs = Runs(FACTS)
    for mu in (0.0, 0.01, 0.02, 0.03):
        runs.kinematic[mu] = Curves(table("kinematic", mu))
        runs.dynamic[mu] = Curves(table("dynamic", mu))
    runs.standstill = Curves(table("kinematic", 0.0))
    runs.contact = {("ground_stiffness", factor): Curves(table("kinematic", 0.0)) for factor in (0.7, 1.3)}
    runs.sweep = {mu: Curves(table("dynamic", mu)) for mu in (0.0, 0.01, 0.02, 0.025, 0.03, 0.06)}
    return runs
