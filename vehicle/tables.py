"""The vehicle's variables as plain tables; sources of the numbers: docs/robot.md.

The start values are those of the study's robot. Masses and torques are those of one side; the planar model
counts them `SIDES` times. Contact values belong to a planar segment, that is to the left and the right one together.
Only the standard library is needed here: the FMU reads these tables also where pymunk is missing.
"""

from __future__ import annotations

from ..fmus.variable import Variable

SIDES = 2

_PARAMETERS = (
    # name, unit, start, least, greatest, description
    ("wheelbase", "m", 0.45, 0.05, 5.0, "distance of the front and the rear hinge"),
    ("holder_length", "m", 0.30, 0.05, 3.0, "distance of a holder's hinge and its idler's axis"),
    ("rail_height", "m", 0.002, 0.0, 0.05, "how far a holder's rails between sprocket and idler stand out beyond their circles"),
    ("shoe_height", "m", 0.012, 0.002, 0.1, "from the track's pitch line to the outer face of its shoes"),
    ("belly_height", "m", -0.035, -1.0, 1.0, "underside of the chassis above the line of the hinges"),
    ("chassis_mass", "kg", 14.0, 0.1, 1000.0, "chassis with motors, gears, battery and load"),
    ("chassis_inertia", "kg.m2", 0.35, 1e-4, 1000.0, "chassis about its centre of mass"),
    ("chassis_center_x", "m", 0.0, -2.0, 2.0, "centre of mass of the chassis in front of the middle between the hinges"),
    ("chassis_center_y", "m", 0.03, -1.0, 1.0, "centre of mass of the chassis above the line of the hinges"),
    ("holder_mass", "kg", 0.9, 1e-3, 100.0, "structure of one holder"),
    ("holder_center", "m", 0.11, 0.0, 3.0, "centre of mass of a holder's structure in front of its hinge"),
    ("idler_mass", "kg", 0.15, 0.0, 100.0, "idler of one holder"),
    ("sprocket_mass", "kg", 0.30, 1e-3, 100.0, "sprocket of one holder"),
    ("segment_mass", "kg", 0.015, 1e-4, 10.0, "one segment of a track"),
    ("ground_stiffness", "N/m", 8e4, 1.0, 1e9, "k of eq 23 (N/m^e)"),
    ("ground_exponent", "", 1.3, 1.0, 3.0, "e of eq 23"),
    ("ground_damping", "N.s/m", 30.0, 0.0, 1e6, "c_max of eq 24"),
    ("ground_depth", "m", 1e-3, 1e-6, 0.1, "h of eq 24: penetration from which damping is full"),
    ("ground_friction", "", 0.8, 0.0, 10.0, "Coulomb friction of track and ground"),
    ("bristle_stiffness", "N/m", 4e4, 1.0, 1e9, "tangential spring of a segment on the ground before it slips"),
    ("bristle_damping", "N.s/m", 60.0, 0.0, 1e6, "tangential damper beside that spring"),
    ("guide_stiffness", "N/m", 2e5, 1.0, 1e9, "segment against the guide of its holder"),
    ("guide_damping", "N.s/m", 30.0, 0.0, 1e6, "damper beside that spring"),
    ("tooth_stiffness", "N/m", 5e4, 1.0, 1e9, "segment against the sprocket's tooth, along the pitch circle"),
    ("tooth_damping", "N.s/m", 60.0, 0.0, 1e6, "damper beside that spring"),
    ("track_tension", "N", 20.0, 0.0, 1e5, "tension a track is mounted with"),
    ("front_start_angle", "rad", 0.0, -7.0, 7.0, "front holder at the start"),
    ("rear_start_angle", "rad", 0.0, -7.0, 7.0, "rear holder at the start"),
    ("start_x", "m", 0.0, -900.0, 900.0, "middle between the hinges at the start"),
    ("settling_time", "s", 1.0, 0.0, 60.0, "time the robot is given on the ground before the start, holders held; 0: none"),
    ("holding_stiffness", "N.m/rad", 2e4, 1.0, 1e7, "shaft that holds each drive while the robot settles, one side"),
    ("inner_step", "s", 1e-3 / 3.0, 1e-6, 5e-3, "longest inner step; shorter where a segment's springs ask for it"),
    ("gravity", "m/s2", 9.81, 0.0, 100.0, "acceleration of gravity"),
    ("segments", "", 36, 12, 400, "segments of a track, an even number so that straight runs are whole pitches"),
    ("teeth", "", 12, 6, 100, "teeth of a sprocket, an even number"),
    ("iterations", "", 10, 1, 200, "iterations of pymunk's joint solver in a step"),
    ("driven_sprockets", "", False, None, None, "sprockets turned by their torques instead of at an imposed speed"),
    ("track", "", "segmented", None, None, "segmented: bodies pinned to a loop; belt: contact slides along the outline"),
    ("ground", "", "flat", None, None, "flat, slope:30, step:0.1, stairs:0.17,0.29,4, polyline:0,0;1,0.1;…"),
)
PARAMETERS = tuple(
    Variable(name, unit, start, text, least, greatest, causality="parameter")
    for name, unit, start, least, greatest, text in _PARAMETERS
)
_INPUTS = (
    # name, unit, start, description
    ("front_torque", "N.m", 0.0, "torque of one side's front holder drive on its holder, reaction on the chassis"),
    ("rear_torque", "N.m", 0.0, "torque of one side's rear holder drive on its holder, reaction on the chassis"),
    ("front_sprocket_torque", "N.m", 0.0, "torque of one side's front sprocket drive, with driven_sprockets"),
    ("rear_sprocket_torque", "N.m", 0.0, "torque of one side's rear sprocket drive, with driven_sprockets"),
    ("sprocket_speed", "rad/s", -2.0, "imposed speed of both sprockets relative to the chassis; negative drives forward"),
)
INPUTS = tuple(Variable(*row, causality="input") for row in _INPUTS)
TELLS = {
    "angle": ("rad", "angle of the {} relative to the chassis, counter-clockwise positive, 0: forward"),
    "speed": ("rad/s", "speed of the {} relative to the chassis"),
    "pressure_x": ("m", "centre of pressure of the {} track in front of its hinge, along the ground; 0 when lifted"),
    "ground_normal": ("N", "normal force of the ground on the {}, both sides"),
    "ground_tangent": ("N", "force of the ground along itself on the {} tracks, both sides, forward positive"),
    "gravity_moment": ("N.m", "drive torque of one side that balances the weight of {} holder, idler and track about the hinge"),
    "x": ("m", "middle between the hinges, forward"),
    "y": ("m", "middle between the hinges, upward"),
    "pitch": ("rad", "pitch of the chassis, nose up positive"),
    "vx": ("m/s", "speed of the middle between the hinges, forward"),
    "vy": ("m/s", "speed of the middle between the hinges, upward"),
    "pitch_rate": ("rad/s", "rate of the pitch"),
}
OUTPUTS = tuple(
    """
    front_angle front_speed rear_angle rear_speed
    front_sprocket_angle front_sprocket_speed rear_sprocket_angle rear_sprocket_speed
    chassis_x chassis_y chassis_pitch chassis_vx chassis_vy chassis_pitch_rate
    front_pressure_x rear_pressure_x front_ground_normal rear_ground_normal front_ground_tangent rear_ground_tangent
    front_gravity_moment rear_gravity_moment chassis_ground_normal
""".split()
)


def derivative_of(output: str) -> str:
    """The output whose time derivative this one is; "" where there is none."""
    for rate, value in (("_speed", "_angle"), ("_vx", "_x"), ("_vy", "_y"), ("_pitch_rate", "_pitch")):
        if output.endswith(rate):
            return output.removesuffix(rate) + value
    return ""


def output(name: str) -> Variable:
    """An output, described by the end of its name."""
    end = max((end for end in TELLS if name.endswith("_" + end)), key=len)
    what = name[: -len(end) - 1].replace("_", " ")
    if end in ("angle", "speed") and "sprocket" not in what:
        what += " holder"
    unit, text = TELLS[end]
    return Variable(name, unit, 0.0, text.format(what), depends_on=(), causality="output", derivative_of=derivative_of(name))
