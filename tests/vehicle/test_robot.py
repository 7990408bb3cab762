"""The robot against closed forms: fall, weight, slopes, torques, speeds, climbing; both kinds of track."""

import math

import numpy as np
import pytest

from selflock.vehicle import Robot
from selflock.vehicle.model import Model
from selflock.vehicle.parameters import VARIABLES
from selflock.vehicle.tables import SIDES

TRACKS = ("segmented", "belt")
G = 9.81


def weight(robot: Robot) -> float:
    of_one_side = (
        robot.get("holder_mass")
        + robot.get("idler_mass")
        + robot.get("sprocket_mass")
        + robot.get("segments") * robot.get("segment_mass")
    )
    return G * (robot.get("chassis_mass") + 2 * SIDES * of_one_side)


def placed(lift: float = 0.0, **settings) -> Model:
    """A model as it is placed on the ground, lifted, without settling."""
    values = {v.name: v.start for v in VARIABLES.values() if v.causality in ("parameter", "input")} | settings
    model = Model(values)
    model.settle(0.0)
    for body in model.bodies:
        body.position += (0.0, lift)
    return model


def momentum(model: Model) -> np.ndarray:
    """Linear momentum and angular momentum about the origin."""
    return sum(
        np.array(
            [
                b.mass * b.velocity.x,
                b.mass * b.velocity.y,
                b.mass * (b.position.x * b.velocity.y - b.position.y * b.velocity.x) + b.moment * b.angular_velocity,
            ]
        )
        for b in model.bodies
    )


def energy(model: Model) -> float:
    return sum(
        0.5 * b.mass * b.velocity.length**2 + 0.5 * b.moment * b.angular_velocity**2 + b.mass * G * b.position.y
        for b in model.bodies
    )


@pytest.mark.parametrize("track", TRACKS)
def test_free_fall_keeps_momentum_whatever_the_drives_do(track):
    """Guide, teeth and drives are internal: they change neither the fall nor the angular momentum about the centre of mass."""
    model = placed(lift=5.0, track=track)
    mass = sum(b.mass for b in model.bodies)
    model.inputs[:2] = 0.7, -0.4
    start = sum(b.mass * np.array(b.position) for b in model.bodies) / mass
    before = momentum(model)
    for _ in range(200):
        model.advance(1e-3)
    now = momentum(model) - before
    assert model.bodies[1].angular_velocity != 0.0
    assert now[0] == pytest.approx(0.0, abs=1e-9 * mass)
    assert now[1] == pytest.approx(-mass * G * 0.2, rel=1e-9)
    end = sum(b.mass * np.array(b.position) for b in model.bodies) / mass
    assert end[1] - start[1] == pytest.approx(-0.5 * G * 0.04, rel=3e-3)  # first order in the inner step
    about_centre = now[2] - mass * end[0] * (-G * 0.2)
    assert about_centre == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("track", TRACKS)
def test_a_dropped_robot_loses_energy_and_never_gains(track):
    model = placed(lift=0.03, track=track, sprocket_speed=0.0)
    levels = []
    for _ in range(400):
        model.advance(1e-3)
        levels.append(energy(model))
    drop = weight(Robot(track=track)) * 0.03
    assert max(levels) < levels[0] + 0.02 * drop
    assert levels[-1] < levels[0] - 0.5 * drop


@pytest.mark.parametrize("track", TRACKS)
def test_standing_still_the_ground_carries_the_weight(track, run):
    robot = Robot(track=track, sprocket_speed=0.0)
    told = run(robot, 0.3)
    normal = (told["front_ground_normal"] + told["rear_ground_normal"])[-50:]
    assert np.mean(normal) == pytest.approx(weight(robot), rel=2e-3)
    assert np.std(normal) < 1e-3 * weight(robot)
    assert abs(told["front_ground_tangent"] + told["rear_ground_tangent"])[-1] < 0.01 * weight(robot)
    assert np.std(told["rear_torque"][-50:]) < 5e-3 * abs(told["rear_torque"][-1])


@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("rear", [0.0, math.pi])
def test_a_holders_torque_balances_its_weight_and_the_ground(track, rear, run):
    """Moments about the hinge: drive = gravity moment - normal force x centre of pressure, for one side."""
    told = run(Robot(track=track, sprocket_speed=0.0, rear_start_angle=rear), 0.3, rear=rear)
    expected = told["rear_gravity_moment"] - told["rear_ground_normal"] * told["rear_pressure_x"] / SIDES
    assert told["rear_torque"][-1] == pytest.approx(expected[-1], rel=0.03)


@pytest.mark.parametrize("track", TRACKS)
def test_a_lifted_holder_needs_its_gravity_moment(track, run):
    robot = Robot(track=track, rear_start_angle=1.0)
    told = run(robot, 0.5, rear=1.0)
    arm = sum(
        robot.get(m) * x
        for m, x in (
            ("holder_mass", robot.get("holder_center")),
            ("idler_mass", robot.get("holder_length")),
            ("segment_mass", robot.get("segments") * 0.5 * robot.get("holder_length")),
        )
    )
    pitch = told["chassis_pitch"][-1]
    assert told["rear_gravity_moment"][-1] == pytest.approx(G * arm * math.cos(1.0 + pitch), rel=0.01)
    assert np.mean(told["rear_torque"][-300:]) == pytest.approx(told["rear_gravity_moment"][-1], rel=0.05)
    assert abs(told["rear_pressure_x"][-1]) < 0.01


@pytest.mark.slow
def test_stiffer_or_lighter_segments_are_stepped_as_finely_as_they_ask(rng, run):
    """By itself, so that a quarter of that step gives the same torque: 2.5 % of it, and half a percent more of ripple, at most."""
    drawn = {
        "guide_stiffness": 2e5 * 10 ** rng.uniform(0, 1),
        "guide_damping": 30.0 * 10 ** rng.uniform(-0.5, 0.5),
        "ground_damping": 30.0 * 10 ** rng.uniform(-0.5, 0.5),
        "segment_mass": 0.015 * 10 ** rng.uniform(-0.6, 0.6),
        "bristle_stiffness": 4e4 * 10 ** rng.uniform(-0.5, 0.8),
        "bristle_damping": 60.0 * 10 ** rng.uniform(-0.5, 0.5),
    }
    robot = Robot(**drawn, inner_step=1e-3)
    step = robot.model.inner
    usual, fine = (run(one, 0.5)["rear_torque"][-300:] for one in (robot, Robot(**drawn, inner_step=step / 4.0)))
    assert np.mean(usual) == pytest.approx(np.mean(fine), rel=0.025)
    assert np.std(usual) < np.std(fine) + 0.005 * abs(np.mean(fine))


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("track", TRACKS)
def test_on_a_slope_it_stands_without_creep_or_slides_as_coulomb_says(track, run):
    slope = math.radians(25.0)
    settled = Robot(track=track, ground="slope:25", sprocket_speed=0.0, ground_friction=0.6, settling_time=2.0)
    stands = run(settled, 1.0)
    assert np.ptp(stands["chassis_x"][200:]) < 1e-6
    assert stands["front_ground_tangent"][-1] + stands["rear_ground_tangent"][-1] == pytest.approx(
        weight(Robot()) * math.sin(slope), rel=5e-3
    )
    slides = run(Robot(track=track, ground="slope:25", sprocket_speed=0.0, ground_friction=0.3, settling_time=0.3), 0.5)
    rate = (slides["chassis_vx"][-1] - slides["chassis_vx"][0]) / 0.499
    assert rate == pytest.approx(-G * (math.sin(slope) - 0.3 * math.cos(slope)) * math.cos(slope), rel=0.02)


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("track", TRACKS)
def test_driven_sprockets_carry_the_downhill_force(track, run):
    robot = Robot(track=track, ground="slope:15", driven_sprockets=True)

    def brake(y):
        return [-5.0 * y[f"{end}_sprocket_angle"] - 0.3 * y[f"{end}_sprocket_speed"] for end in ("front", "rear")]

    told = run(robot, 1.0, sprockets=brake)
    torque = SIDES * (told["front_sprocket_torque"] + told["rear_sprocket_torque"])[-1]
    assert abs(told["chassis_vx"][-1]) < 1e-3
    # the track's force acts on the pitch line; uphill is a turn against the clock
    assert torque == pytest.approx(-weight(robot) * math.sin(math.radians(15.0)) * robot.model.geometry.belt_radius, rel=0.05)


@pytest.mark.parametrize("track", TRACKS)
def test_it_moves_as_fast_as_its_track(track, run):
    robot = Robot(track=track, sprocket_speed=-3.0)
    told = run(robot, 1.0)
    assert np.mean(told["chassis_vx"]) == pytest.approx(3.0 * robot.model.geometry.belt_radius, rel=0.01)
    assert told["front_sprocket_angle"][-1] == pytest.approx(-3.0, rel=1e-9)
    assert told["chassis_x"][0] == pytest.approx(0.0, abs=0.01)  # at its start it is where it was told to be


@pytest.mark.alike
@pytest.mark.parametrize("front, rear", [(0.0, 0.0), (0.0, math.pi), (-0.7, math.pi + 0.7)])
def test_belt_and_segments_need_the_same_torques(front, rear, run):
    means = []
    for track in TRACKS:
        told = run(
            Robot(track=track, front_start_angle=front, rear_start_angle=rear, settling_time=1.5), 0.79, front=front, rear=rear
        )
        means.append(np.mean(told["rear_torque"]))
    assert means[1] == pytest.approx(means[0], rel=0.08)


@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("ground, front, height", [("step:0.1,0.7", 0.6, 0.1), ("slope:30,0.7", 0.0, 0.2)])
@pytest.mark.slow
def test_it_climbs(track, ground, front, height, run):
    told = run(Robot(track=track, ground=ground, front_start_angle=front, sprocket_speed=-8.0), 3.5, front=front)
    assert told["chassis_y"][-1] > height + 0.05  # the hinges stand 0.06 m above the ground they are on
    assert np.all(np.abs(told["chassis_pitch"]) < 0.7)


@pytest.mark.slow
def test_contact_values_hardly_matter(run):
    """The study's remark that results are not sensitive to the contact parameters: k, c_max and h by 30 %."""
    base = np.mean(run(Robot(track="belt", rear_start_angle=math.pi), 0.5, rear=math.pi)["rear_torque"])
    for name in ("ground_stiffness", "ground_damping", "ground_depth"):
        for factor in (0.7, 1.3):
            robot = Robot(track="belt", rear_start_angle=math.pi, **{name: factor * VARIABLES[name].start})
            assert np.mean(run(robot, 0.5, rear=math.pi)["rear_torque"]) == pytest.approx(base, rel=0.03)
