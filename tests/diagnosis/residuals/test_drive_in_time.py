"""The whole drive's simulation beside solutions that share nothing with it: closed forms, and an integrator of differential equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from selflock.diagnosis.residuals import free_law, laws
from selflock.diagnosis.residuals.forward import stable
from selflock.diagnosis.residuals.kernels import kernels

R, L, K, RATIO, J, STIFF, DAMP, LOAD, GRAVITY, ANGLE_GAIN, SPEED_GAIN = (
    2.0,
    1e-3,
    0.05,
    30.0,
    8e-5,
    800.0,
    1.5,
    0.1,
    3.0,
    60.0,
    4.0,
)


def parameters(**more):
    """Of controller, motor, gear and load: a spur gear without friction, an arm that hangs."""
    values = {
        "controller.angle_gain": ANGLE_GAIN, "controller.speed_gain": SPEED_GAIN, "controller.release_time": 1e9,
        "controller.voltage_min": -1e3, "controller.voltage_max": 1e3, "motor.resistance": R, "motor.inductance": L,
        "motor.voltage_constant": K, "motor.torque_constant": K, "reducer.gear_ratio": RATIO, "reducer.friction_kinetic": 0.0,
        "reducer.friction_static": 0.0, "reducer.preload": 0.0, "reducer.shaft_inertia": J, "reducer.shaft_stiffness": STIFF,
        "reducer.shaft_damping": DAMP, "load.inertia": LOAD, "load.mass": GRAVITY / 9.81, "load.arm": 1.0,
        "load.arm_angle": -np.pi / 2,
    }  # fmt: skip
    values["load.inertia"] -= values["load.mass"]
    values |= {name.replace("__", "."): value for name, value in more.items()}
    return [laws.parameters(part, part, values) for part in laws.COMPONENTS]


def wanted(t):
    """Set-points of angle and speed."""
    return np.stack([0.4 * np.sin(5.0 * t) ** 3, 6.0 * np.sin(5.0 * t) ** 2 * np.cos(5.0 * t)])


def nowhere(t):
    """Where a load was measured that was not."""
    return np.full(len(t), np.nan)


def simulated(step, last, p, ticked=0.0, looped=1.0, given=wanted, turned=nowhere, supply=np.zeros_like, behind=0.0, sensors=0):
    """Rows of the compiled simulation, from rest at 0, its steps in one part."""
    time = step * np.arange(round(last / step) + 1)
    dt, out, off, nothing = np.full(len(time), step), np.empty((8, len(time))), laws.no_sensor(), free_law.none()
    kernels().closed(
        *p, off, off, 0.0, float(sensors), looped, np.ones(len(time)), supply(time), given(time), given(time + 0.5 * step), turned(time), behind, np.ones(len(time)), dt, 1, ticked, np.zeros(5),
        np.zeros(1, int),
        np.zeros((1, 4)), nothing.place, nothing.over, nothing.knots, nothing.heights, out,
    )  # fmt: skip
    return time, out


def volts(t):
    """Of an open loop, in the place of the set-points."""
    return np.stack([8.0 * np.sin(7.0 * t) ** 3, 0.0 * t])


def sagging(t):
    """A supply that falls and swings, V."""
    return 12.0 - 3.0 * t + np.sin(20.0 * t)


def solved(last, period=0.0, driven=None, supply=np.ones_like, sensors=0):
    """Current, input speed, output angle and speed by an integrator; the command from act to act of a controller with a period.

    sensors: how many of the controller's are at the motor, that of speed first.
    """

    def asks(t, x):
        asked, rate = wanted(t)
        seen, fast = x[1] / RATIO if sensors > 1 else x[3], x[2] / RATIO if sensors > 0 else x[4]
        return ANGLE_GAIN * (asked - seen) + SPEED_GAIN * (rate - fast)

    def rates(t, x, held):
        i, angle, speed, out, turned = x
        command = asks(t, x) if held is None else held
        command = supply(t) * (command if driven is None else driven(t)[0])
        torque = STIFF * (angle / RATIO - out) + DAMP * (speed / RATIO - turned)
        return [
            (command - R * i - K * speed) / L,
            speed,
            (K * i - torque / RATIO) / J,
            turned,
            (torque - GRAVITY * np.sin(out)) / LOAD,
        ]

    if period == 0.0:
        found = solve_ivp(
            rates, (0.0, last), np.zeros(5), args=(None,), method="DOP853", rtol=1e-10, atol=1e-12, dense_output=True
        )
        return found.sol(np.linspace(0.0, last, 41)[1:])
    x, rows = np.zeros(5), []
    for n in range(round(last / period)):
        command = asks(n * period, x)
        x = solve_ivp(rates, (n * period, (n + 1) * period), x, args=(command,), method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        rows.append(x)
    return np.array(rows).T


@pytest.mark.slow
@pytest.mark.parametrize("duty", [False, True], ids=["voltage", "duty"])
@pytest.mark.alike
@pytest.mark.parametrize("period", [0.0, 0.008], ids=["continuous", "sampled"])
@pytest.mark.parametrize("sensors", [0, 1, 2], ids=["load", "dual", "motor"])
def test_a_loop_is_of_second_order_in_its_step(sensors, period, duty):
    """Half the step leaves a quarter of the error, of every signal: of a first order it would be half. A duty counts times its supply."""
    share = 1.0 / 12.0 if duty else 1.0
    gains = {"controller__angle_gain": share * ANGLE_GAIN, "controller__speed_gain": share * SPEED_GAIN}
    last, p, off = 0.4, parameters(controller__sample_period=period, **gains), []
    truth = solved(last, period, supply=lambda t: share * sagging(t) if duty else np.ones_like(t), sensors=sensors)
    for step in (1e-3, 5e-4, 2.5e-4):
        time, out = simulated(step, last, p, supply=sagging if duty else np.zeros_like, sensors=sensors)
        at = np.searchsorted(time, np.arange(1, truth.shape[1] + 1) * last / truth.shape[1] - 1e-9)
        off.append(np.sqrt(np.mean((out[[1, 3, 4, 6, 7]][:, at] - truth) ** 2, axis=1)))
    size = np.sqrt(np.mean(truth**2, axis=1))
    assert np.all(off[1] / off[0] < 0.35) and np.all(off[2] / off[1] < 0.35), off
    assert np.all(off[1] < 2e-3 * size), off[1] / size


@pytest.mark.slow
def test_an_open_loop_is_of_second_order_in_its_step():
    """As a loop that is closed: driven by its voltage, which a step has as in its middle."""
    last, p, off = 0.4, parameters(), []
    truth = solved(last, driven=volts)
    for step in (1e-3, 5e-4, 2.5e-4):
        time, out = simulated(step, last, p, looped=0.0, given=volts)
        at = np.searchsorted(time, np.arange(1, truth.shape[1] + 1) * last / truth.shape[1] - 1e-9)
        off.append(np.sqrt(np.mean((out[[1, 3, 4, 6, 7]][:, at] - truth) ** 2, axis=1)))
    size = np.sqrt(np.mean(truth**2, axis=1))
    assert np.all(off[1] / off[0] < 0.35) and np.all(off[2] / off[1] < 0.35), off
    assert np.all(off[1] < 2e-3 * size), off[1] / size


def test_a_drive_that_meets_no_place_goes_as_it_goes_wherever_it_was_measured(rng):
    """Both shafts are turned as one: without a wave or a weight nothing but the last digits of the rows is another."""
    p, strays = parameters(load__gravity=0.0), rng.uniform(-3.0, 3.0)
    _, alone = simulated(5e-4, 0.4, p, looped=0.0, given=volts)
    _, told = simulated(5e-4, 0.4, p, looped=0.0, given=volts, turned=lambda t: strays * np.sin(3.0 * t))
    assert np.max(abs(told - alone)) < 1e-9 * np.max(abs(alone))


def test_a_weight_on_an_arm_pulls_where_the_arm_was_measured(rng):
    """Held by no voltage, a drive accelerates by the weight at the measured angle alone: m g d sin(angle) over all inertia."""
    angle, last = rng.uniform(0.2, 1.3), 0.02
    p = parameters(motor__torque_constant=0.0, motor__voltage_constant=0.0, reducer__shaft_damping=50.0)
    nothing = lambda t: np.zeros((2, len(t)))
    time, out = simulated(5e-4, last, p, looped=0.0, given=nothing, turned=lambda t: np.full(len(t), angle))
    half = len(time) // 2
    rate = (out[7, -1] - out[7, half]) / (time[-1] - time[half])
    assert rate == pytest.approx(-GRAVITY * np.sin(angle) / (LOAD + J * RATIO**2), rel=0.02)


def test_a_weight_behind_a_play_pulls_where_the_load_is_and_not_where_its_motor_is(rng):
    """Of an arm of which the motor's shaft alone was measured: told where that was a drive goes as it went, in its play and beyond."""
    p, last = parameters(reducer__backlash=rng.uniform(0.05, 0.2), reducer__shaft_damping=5.0), 1.2
    time, alone = simulated(2.5e-4, last, p, looped=0.0, given=volts)
    motor, load = alone[3] / RATIO, alone[6]
    assert np.ptp(motor - load) > 0.9 * p[2].backlash
    told = lambda angle, **more: simulated(2.5e-4, last, p, looped=0.0, given=volts, turned=lambda t: angle, **more)[1]
    off = lambda one: np.max(abs(one[7] - alone[7])) / np.max(abs(alone[7]))
    assert off(told(load)) < 1e-6 and off(told(motor, behind=1.0)) < 1e-6
    assert off(told(motor)) > 1e-3  # as if there were no play between them


def test_a_shaft_that_swings_undamped_neither_grows_nor_fades():
    """Two inertias on a spring: angle = A cos(w t), w^2 = k (1/J_out + 1/(J r^2)), for a hundred waves."""
    p = parameters(
        motor__torque_constant=0.0, motor__voltage_constant=0.0, reducer__shaft_damping=0.0, load__gravity=0.0,
        controller__angle_gain=0.0, controller__speed_gain=0.0,
    )  # fmt: skip
    step, behind = 5e-4, J * RATIO**2
    pulsation = np.sqrt(STIFF * (1.0 / LOAD + 1.0 / behind))
    stiffness, damping, parts = stable(p[2], p[3], step)
    assert (stiffness, damping) == (STIFF, 0.0)
    time = step * np.arange(round(100 * 2.0 * np.pi / pulsation / step))
    zero, out, wound, off, nothing = np.zeros((2, len(time))), np.empty((8, len(time))), 0.01, laws.no_sensor(), free_law.none()
    share = LOAD / (LOAD + behind)  # of the wind-up at the input
    start = np.array([share * wound * RATIO, 0.0, -(1.0 - share) * wound, 0.0])
    kernels().closed(
        *p, off, off, 0.0, 0.0, 1.0, np.ones(len(time)), zero[0], zero, zero, nowhere(time), 0.0, np.ones(len(time)), np.full(len(time), step), parts, 0.0, np.zeros(5),
        np.zeros(1, int), start[None], nothing.place, nothing.over, nothing.knots, nothing.heights, out,
    )  # fmt: skip
    twist = out[3] / RATIO - out[6]
    assert np.max(abs(twist[-100:])) == pytest.approx(wound, rel=1e-2)
    last = slice(len(time) // 2, None)  # and in step with the closed form
    assert np.max(abs(twist - wound * np.cos(pulsation * time))[last]) < 2.0 * wound * pulsation * time[-1] * 0.1**2 / 24.0


def test_damping_of_a_shaft_is_as_the_rig_says(rng):
    """However little: 'raised to what is stable' was up to ten times what a worm had."""
    damping = float(10.0 ** rng.uniform(-3.0, 0.0))
    p = parameters(reducer__shaft_damping=damping)
    assert stable(p[2], p[3], 5e-4)[1] == damping
