"""The hidden drive as data: everything that can be hidden is a field of `Drive` whose default switches it off.

SI units; angles in rad, load angle 0 = arm hanging down. What the fields do is in physics.py.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .physics import simulate as simulate

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
    "supply",
    "output_torque",
)
SENSED = ("current", "motor_angle", "motor_speed", "angle", "speed")  # channels that can carry a sensor's error


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
    dent: float = 0.0  # N.m of friction on the load, in one place
    dent_angle: float = 0.0  # rad
    dent_width: float = 0.2  # rad
    tooth: float = 0.0  # N.m at the motor's shaft, against positive motion, where a damaged tooth meshes
    tooth_place: float = 0.0  # rad of the gear's output, where it begins to mesh
    tooth_length: float = 0.3  # rad over which it meshes
    loosened: float = 0.0  # relative change of friction from one moment on
    loosened_time: float = 6.0  # s
    current_curve: float = 0.0  # 1/A: what a current sensor shows too little, relative, per ampere
    eccentricity: float = 0.0  # rad, of the load's encoder, once per turn
    eccentricity_phase: float = 0.0
    # nature's forms, of which no data sheet tells: FORMS in forms.py
    bristle_form: int = 0  # 0 Dahl, 1 LuGre, 2 elasto-plastic
    stribeck_form: int = 0  # 0 Lorentzian, 1 hyperbolic secant
    viscous_form: int = 0  # 0 a little less at speed (oil thins), 1 a little more (oil is churned)
    contact_form: int = 0  # of a play: 0 spring and damper, 1 damped with depth
    armature_form: int = 0  # 0 inductance, brushes' voltage rounded; 1 quasi-static, brushes' voltage sharp
    commutation: float = 0.0  # relative ripple of flux under the brushes
    segments: float = 11.0  # of the commutator
    chopper: float = 0.0  # s, period of a pulse-width modulation; 0: its mean
    # sensors: bias, scale error, lag and step of each channel in SENSED
    bias: tuple = (0.0,) * 5
    scale: tuple = (0.0,) * 5
    lag: tuple = (0.0,) * 5
    step: tuple = (0.0,) * 5  # seen by the controller; the recorder rounds after its noise
