"""Nature's forms in the hidden plant: closed forms, limits, energy, convergence with the step."""

import math

import numpy as np
import pytest

from .plant import bench, recordings
from .plant.drive import CHANNELS, Drive, simulate
from .plant.forms import FORMS, PERIODS, nature
from .plant.physics import BREAKAWAY, DEPTH, armature, bristle, chopped, contact, friction, viscous
from .plant.recorder import DENSE, FINE, NOISE

BRISTLES = range(len(FORMS["bristle_form"]))


def _slide(d, moves, mu, dt=1e-5):
    """Grip at each step of a motion."""
    z, grips = 0.0, []
    for move, m in zip(moves, np.broadcast_to(mu, len(moves))):
        z, grip = bristle(d, z, move / dt, m, dt)
        grips.append(grip)
    return np.array(grips)


@pytest.mark.parametrize("form", BRISTLES)
def test_what_slides_grips_with_its_coefficient(form, rng):
    d, mu, sign = Drive(bristle_form=form), rng.uniform(0.005, 0.03), rng.choice((-1.0, 1.0))
    moves = np.full(4000, sign * d.bristle * 0.01)
    assert _slide(d, moves, mu)[-1] == pytest.approx(sign * mu, rel=1e-6)


@pytest.mark.alike
@pytest.mark.parametrize("form", BRISTLES)
def test_friction_never_gives_back_more_than_was_put_in(form, rng):
    """From an unbent bristle on, whatever the motion; a step of the explicit sum may be off by its own size."""
    d, mu = Drive(bristle_form=form), 0.012
    moves = np.convolve(rng.standard_normal(20_000), np.ones(50) / 50, "same") * 0.2 * d.bristle
    work = np.cumsum(_slide(d, moves, mu) * moves)
    assert work.min() > -mu * abs(moves).max()
    assert work[-1] > 0.1 * mu * abs(moves).sum()


def test_lugre_with_a_coefficient_that_stays_is_dahls(rng):
    moves = np.convolve(rng.standard_normal(3000), np.ones(50) / 50, "same") * 0.1 * Drive().bristle
    dahl, lugre = (_slide(Drive(bristle_form=form), moves, Drive().friction) for form in (0, 1))
    assert np.allclose(dahl, lugre, rtol=1e-9, atol=1e-15)


def test_lugres_friction_follows_its_coefficient_only_with_motion():
    d = Drive(bristle_form=1)
    moves = np.concatenate([np.full(3000, 0.01 * d.bristle), np.zeros(10), np.full(3000, 0.01 * d.bristle)])
    grips = _slide(d, moves, np.where(np.arange(6010) < 3000, 0.012, 0.02))
    assert grips[3005] == pytest.approx(0.012, rel=1e-6) and grips[-1] == pytest.approx(0.02, rel=1e-6)


@pytest.mark.slow
def test_an_elasto_plastic_bristle_only_bends_below_its_breakaway(rng):
    """Rocked about a bend it does not creep; Dahl's does (Dupont et al. 2002)."""
    angle = 1e-3 * BREAKAWAY * np.sin(np.linspace(0.0, 2 * math.pi * rng.integers(3, 20), 20_001)) * 0.99
    moves = np.append(np.diff(angle), 0.0)  # at rest in the end
    ends = [_slide(Drive(bristle_form=form), moves, 0.012)[-1] for form in (2, 0)]
    assert abs(ends[0]) < 1e-9 < abs(ends[1])


def test_stribecks_forms_agree_at_rest_and_at_speed():
    for form in (0, 1):
        d = Drive(stribeck=0.5, stribeck_form=form)
        at = lambda omega, d=d: friction(d, omega, 0.0, 0.0, 0.0, 0.0, 22.0) / d.friction
        assert at(0.0) == pytest.approx(1.5) and at(1e5) == pytest.approx(1.0) and 1.2 < at(d.stribeck_speed) < 1.35


def test_oil_is_viscous_at_low_speed_and_a_little_else_above(rng):
    for form, sign in ((0, -1.0), (1, 1.0)):
        d = Drive(viscous=3e-4, viscous_form=form)
        assert viscous(d, 0.01) == pytest.approx(3e-6, rel=1e-4)
        assert 0.0 < sign * (viscous(d, 100.0) / 0.03 - 1.0) < 0.15
        omega = rng.uniform(1.0, 200.0)
        assert viscous(d, -omega) == -viscous(d, omega)


@pytest.mark.parametrize("form", [0, 1])
def test_a_pressed_flank_carries_the_springs_torque(form, rng):
    d, twist = Drive(backlash=0.02, contact_form=form), rng.uniform(0.011, 0.05)
    assert contact(d, 3000.0, twist, 0.0) == pytest.approx(3000.0 * (twist - 0.01))
    assert contact(d, 3000.0, -twist, 0.0) == -contact(d, 3000.0, twist, 0.0)
    assert contact(d, 3000.0, rng.uniform(-0.0099, 0.0099), rng.uniform(-5.0, 5.0)) == 0.0


def _bounce(d, stiffness, inertia, speed, dt=1e-7):
    """Speed after an impact on the flank, relative to that before."""
    x, v = 0.5 * d.backlash, speed
    while True:
        v -= dt * contact(d, stiffness, x, v) / inertia
        x += dt * v
        if x < 0.5 * d.backlash:
            return -v / speed


@pytest.mark.slow
def test_restitution_of_both_contacts(rng):
    """exp(-pi zeta/sqrt(1 - zeta²)) of a spring and damper; of little damping that grows with depth, what it takes on the undamped way."""
    inertia, stiffness = 0.1, 3000.0
    linear = Drive(backlash=0.02, shaft_damping=rng.uniform(1.0, 8.0))
    zeta = linear.shaft_damping / (2.0 * math.sqrt(stiffness * inertia))
    told = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    assert _bounce(linear, stiffness, inertia, rng.uniform(0.1, 2.0)) == pytest.approx(told, rel=2e-3)
    deep, speed = Drive(backlash=0.02, shaft_damping=0.05, contact_form=1), rng.uniform(0.3, 2.0)
    farthest = speed * math.sqrt(inertia / stiffness)
    x = np.linspace(0.0, farthest, 20_001)
    depth = np.minimum(x / (DEPTH * deep.backlash), 1.0)
    damped = deep.shaft_damping * (3.0 - 2.0 * depth) * depth**2 * speed * np.sqrt(1.0 - (x / farthest) ** 2)
    lost = 2.0 * np.trapezoid(damped, x) / (0.5 * inertia * speed**2)
    assert 1.0 - _bounce(deep, stiffness, inertia, speed) ** 2 == pytest.approx(lost, rel=0.03, abs=2e-5)


@pytest.mark.parametrize("form", [0, 1])
def test_a_play_that_vanishes_leaves_the_shafts_spring_and_damper(form, rng):
    """Else a play of next to nothing would hide another cause: a damper that is gone."""
    d, rate = Drive(backlash=1e-8, contact_form=form), rng.uniform(-0.01, 0.01)
    twist = rng.uniform(1e-4, 1e-2) * rng.choice((-1.0, 1.0))
    assert contact(d, 3000.0, twist, rate) == pytest.approx(3000.0 * twist + d.shaft_damping * rate, rel=1e-4)


@pytest.mark.parametrize("form", [0, 1])
def test_a_steady_armature_obeys_ohm_behind_its_brushes(form, rng):
    d = Drive(armature_form=form, brush_drop=0.6)
    voltage, omega, current = rng.uniform(5.0, 20.0) * rng.choice((-1.0, 1.0)), rng.uniform(-50.0, 50.0), 0.0
    for _ in range(4000):
        current, flux = armature(d, voltage, current, omega, 0.0, 2.0, 2.5e-5)
    driving = voltage - d.voltage_constant * omega
    assert current == pytest.approx(math.copysign(abs(driving) - 0.6, driving) / 2.0, rel=1e-6) and flux == pytest.approx(1.0)
    power = d.torque_constant * flux * current * omega  # what the rotor gets is what the winding does not lose
    assert voltage * current == pytest.approx(2.0 * current**2 + 0.6 * abs(current) + power, rel=1e-6)


def test_the_current_rises_with_the_windings_time():
    d, current = Drive(inductance=2e-3), 0.0
    for _ in range(1000):
        current, _ = armature(d, 10.0, current, 0.0, 0.0, 2.0, 1e-6)
    assert current == pytest.approx(5.0 * (1.0 - math.exp(-1.0)), rel=2e-3)  # 1 ms is one time constant


def test_commutation_is_gone_over_a_turn(rng):
    d = Drive(commutation=0.01, segments=float(rng.choice((7, 9, 11, 13))))
    flux = [armature(d, 1.0, 0.0, 0.0, theta, 2.0, 1e-5)[1] for theta in np.arange(3600) * 2 * math.pi / 3600]
    assert np.mean(flux) == pytest.approx(1.0, abs=1e-9) and np.ptp(flux) == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize("period", PERIODS)
def test_a_chopped_voltage_has_its_mean_and_knows_two_levels(period, rng):
    d, dt = Drive(chopper=period), 2.5e-5
    voltage, first = rng.uniform(-24.0, 24.0), int(rng.integers(10**6)) * period
    steps = round(period / dt)
    found = np.array([chopped(d, voltage, first + i * dt, dt) for i in range(steps)])
    assert found.mean() == pytest.approx(voltage, rel=1e-6)
    assert np.sum((abs(found) > 1e-6) & (abs(found) < 24.0 - 1e-6)) <= 2  # the steps in which an edge falls


@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_the_wedges_torque_is_that_of_every_form(speed, rng):
    """A constant load: F = P tan(alpha ± phi), as of the plainest forms."""
    _, drive = nature(rng, Drive(mass=0.0, load_inertia=0.1, constant_torque=4.0))
    n = int(1.6 / DENSE)
    rows = simulate(drive, speed * np.arange(n) * DENSE, np.full(n, speed), np.full(n, 22.0), DENSE, FINE, 0.0, FINE)
    torque = rows[n // 2 :, CHANNELS.index("motor_torque")].mean()
    phi = math.copysign(math.atan(drive.friction), speed)
    assert torque == pytest.approx(4.0 * math.tan(drive.wedge_angle + phi), rel=0.01, abs=3e-4)


@pytest.mark.alike
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_half_the_step_changes_nothing_that_the_best_recorder_shows(seed):
    rng = np.random.default_rng(seed)
    _, drive = nature(rng, bench.nominal(rng))
    drive = drive._replace(sampling=0.001, backlash=0.01 * (seed % 2))  # both halves of a step have these controllers
    plan = bench.motion(rng, 4.0, DENSE)
    coarse, fine = (simulate(drive, plan.angle, plan.speed, plan.ambient, DENSE, n * FINE, plan.start, FINE) for n in (1, 2))
    for channel in ("current", "motor_speed", "speed"):
        place = CHANNELS.index(channel)
        off = np.std(coarse[:, place] - fine[:, place])
        assert off < NOISE[channel], (channel, off)


@pytest.mark.slow
def test_forms_alone_are_no_cause():
    """Of drawn drives the plainest forms leave hardly more than the noise."""
    found = [recordings.hide([], seed, duration=10.0).forms for seed in range(20_000, 20_006)]
    assert max(found) < 1.3, found
