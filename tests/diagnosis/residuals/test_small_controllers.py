"""A small controller that acts once a row: what it sets is held, its speed is a difference, its command perhaps a duty of a battery."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.residuals import driven, whole
from selflock.diagnosis.residuals.closing import answers_its_rows
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.stepping import of_steps
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.instants import place_acts, place_acts_again, place_again
from selflock.diagnosis.search.problem import Problem

from .test_row_by_row import COUNT, DAMPS, DRIVE, GAIN, INERTIA, RATIO, ROTOR, K, R

ROW, STEP, SUPPLY, LEAST = 0.02, 5e-4, 12.0, 12.0 / 4095
LASTS = 4.0  # s


def loop(duty):
    """What a rig says of the controller: gains in V, or of a duty."""
    one = SUPPLY if duty else 1.0
    limits = {"controller.voltage_max": SUPPLY / one, "controller.voltage_min": -SUPPLY / one}
    return limits | {"controller.angle_gain": GAIN / one, "controller.speed_gain": DAMPS / one, "controller.release_time": 1e6}


def battery(t):
    """V; it falls by a third of its voltage."""
    return SUPPLY * (1.0 - 0.08 * t)


def simulated(wanted, closed=True, row=ROW, duty=False, counted=True, late=0, dead=0.0, told=True, sag=0.0):
    """Rows of a stiff drive without friction: command, angle of the load, its set-point, supply, at each act.

    wanted: of the time, s; a set-point, or a voltage that is held from row to row. row: s between two acts; rows are ROW apart.
    late: STEPs after which a command reaches the motor. dead: V of it that get lost on the way, or in the controller where its
    command is not told before. sag: Ohm of a supply that a chopper without a capacitor loads with the motor's current while it is on.
    """
    acts, parts = round(LASTS / row), round(row / STEP)
    inertia = ROTOR + INERTIA / RATIO**2
    rate = K * K / R / inertia
    angle = speed = before = u = 0.0
    table, waiting = np.zeros((acts, 4)), [0.0] * late
    for act in range(acts):
        now, supply = act * row, battery(act * row) if duty else SUPPLY
        asked = wanted(now)
        seen = COUNT * np.floor(angle / COUNT) if counted else angle
        if closed:
            u = GAIN * (asked - seen) - DAMPS * (seen - before) / row
            u = LEAST * np.round(min(max(u, -SUPPLY), SUPPLY) / LEAST)
            before = seen
        else:
            u = asked
        acted = np.copysign(max(abs(u) - dead, 0.0), u)
        command = (u if told else acted) / SUPPLY if duty else u if told else acted
        table[act] = command, angle, asked, supply
        for _ in range(parts):
            waiting.append(acted / SUPPLY if duty else acted)
            volts = waiting.pop(0) * (supply if duty else 1.0)
            last, fastest = speed, volts / K / RATIO
            slower = rate / (1.0 + sag * abs(volts) / SUPPLY / R)
            speed = fastest + (speed - fastest) * np.exp(-slower * STEP)
            angle += STEP * fastest - (speed - last) / slower
    return table[:: round(ROW / row)].T


def asked_of(rng, table, closed, duty=False, **told):
    """The problem of such a log. told: more that the rig says of the motor."""
    u, angle, wanted, supply = table
    time = ROW * np.arange(len(u))
    signals = {
        "motor.duty" if duty else "controller.voltage": u,
        "load.angle": COUNT * np.floor(angle / COUNT),
    }
    if closed:
        signals |= {"controller.angle_setpoint": wanted, "controller.speed_setpoint": np.zeros(len(u))}
    if duty:
        signals["motor.supply_voltage"] = supply + 0.01 * rng.standard_normal(len(u))
    columns = tuple(LogColumn(name, name) for name in signals)
    given = DRIVE | (loop(duty) if closed else {}) | {f"motor.{name}": value for name, value in told.items()}
    rig = Rig(Path("rig.toml"), "bot", "forward", columns, given, time=LogColumn("time", "time"), simulate=whole.WHOLE)
    run = MeasuredRun("log.csv", "", np.arange(len(u)), time, signals)
    check([run], rig)

    def anew():
        bench = DriveExperiment(rig, [run])
        return Problem.of(bench, np.ones(bench.layout.count, bool))

    return anew


def steps(rng, size):
    """Levels of half a second, which small drives are asked for."""
    heights = size * rng.uniform(0.5, 1.0, 20) * (-1.0) ** np.arange(20)  # to and fro, so that no draw hardly moves
    return lambda t: float(heights[int(t / 0.47)])


@pytest.mark.slow
@pytest.mark.in_turn
@pytest.mark.parametrize("duty", [False, True], ids=["voltage", "duty"])
def test_a_controller_that_acts_row_by_row_is_found(rng, duty):
    """And the drive is then right to its noise, on a battery that falls by a third; that between rows nothing acts is no fault of it."""
    excess = lambda problem: problem.excess(problem.fit(problem.base_free, problem.nominal).values).max()
    for _ in range(8):  # of one draw in seven a lag of the controller makes up for it
        anew = asked_of(rng, simulated(steps(rng, 1.5), duty=duty), True, duty)
        if excess(first := anew().with_noise()) > RULES.search.sound:
            break
    assert excess(first) > RULES.search.sound
    assert place_acts(first.experiment, anew(), anew)
    found = anew().with_noise()
    assert driven.row_by_row(found.experiment.channels[0, ""])
    values = found.fit(found.base_free, found.nominal).values
    assert found.excess(values).max() < 1.3, found.excess(values)  # some 200 rows tell no noise to a tenth


@pytest.mark.parametrize("duty", [False, True], ids=["voltage", "duty"])
def test_a_command_tells_whether_it_answers_its_own_row(rng, duty):
    """However late the motor gets it; not where the controller acted since, or saw the angle itself, not its counts."""
    ask = lambda table: answers_its_rows(asked_of(rng, table, True, duty)().experiment.channels[0, ""])
    wanted = steps(rng, 1.5)
    assert ask(simulated(wanted, duty=duty))
    assert ask(simulated(wanted, duty=duty, late=int(rng.integers(1, 60))))
    assert not ask(simulated(wanted, duty=duty, row=ROW / 4.0))
    assert not ask(simulated(wanted, duty=duty, counted=False))


@pytest.mark.slow
@pytest.mark.in_turn
def test_what_acts_late_behind_the_logged_command_is_a_delay_of_it(rng):
    """As long as it is, and the command itself is not read late: in no way of acting is such a drive right without it."""
    late = int(rng.integers(30, 56))
    anew = asked_of(rng, simulated(steps(rng, 1.5), late=late), True)
    assert place_acts(anew().experiment, anew(), anew)
    found = anew().with_noise()
    delays = np.array([0.0, late * STEP - 1.5 * ROW, late * STEP, late * STEP + 1.5 * ROW])
    fits = [found.fit(found.base_free, found.nominal | {"controller.command_delay": max(delay, 0.0)}) for delay in delays]
    assert np.argmin([(fit.misfit[found.rows] ** 2).sum() for fit in fits]) == 2
    assert driven.AT_ONCE in found.experiment.channels[0, ""].run.memory[driven.ACTS]


@pytest.mark.slow
@pytest.mark.in_turn
@pytest.mark.parametrize("told", [True, False], ids=["behind", "before"])
def test_what_a_power_stage_loses_is_not_in_the_command_that_a_controller_writes(rng, told):
    """Unless it is the controller that loses it; each is as large as it is, of one that acts between rows."""
    dead = rng.uniform(0.8, 1.6)
    anew = asked_of(rng, simulated(steps(rng, 1.5), row=ROW / 4.0, dead=dead, told=told), True)
    assert place_acts(anew().experiment, anew(), anew) or not told
    assert (driven.AT_ONCE in anew().experiment.channels[0, ""].run.memory[driven.ACTS]) == told
    found = anew().with_noise()
    fits = [found.fit(found.base_free, found.nominal | {"controller.dead_zone": size * dead}) for size in (0.0, 0.5, 1.0, 1.5)]
    assert np.argmin([(fit.misfit[found.rows] ** 2).sum() for fit in fits]) == 2


def test_what_a_table_gives_an_open_loop_is_held(rng):
    """From its row to the next, where that was found; else it goes straight."""
    heights = rng.normal(0.0, 4.0, round(LASTS / ROW) + 1)
    anew = asked_of(rng, simulated(lambda t: float(heights[int(t / ROW + 0.5)]), closed=False), False)
    ch = anew().experiment.channels[0, ""]
    rows = rng.choice(np.arange(len(ch.run) - 1), 20, replace=False)
    share = rng.uniform(0.1, 0.9, 20)
    volts = lambda: driven.asked(ch.run.time, {}, ch)(ch.run.time[rows] + share * ROW)[0]
    assert volts() == pytest.approx((1.0 - share) * heights[rows] + share * heights[rows + 1])
    ch.run.memory[driven.ACTS] = frozenset({driven.BY_ROWS})
    assert volts() == pytest.approx(heights[rows])


@pytest.mark.slow
@pytest.mark.in_turn
def test_whether_a_voltage_is_held_is_asked_again_of_the_drive_with_its_cause(rng):
    """A sag behind a table of duties, taken to go straight from row to row: with it the voltage is held, and that is the end of it."""
    heights = rng.uniform(-SUPPLY, SUPPLY, round(LASTS / ROW) + 1)
    sag = rng.uniform(0.4, 0.8) * R
    table = simulated(lambda t: float(heights[int(t / ROW + 0.5)]), closed=False, sag=sag)
    anew = asked_of(rng, table, False, supply_voltage=SUPPLY, supply_driver=0.0)
    problem = anew().with_noise()
    free = next(h for h in problem.hypotheses if h.label == "motor supply_sag").free[:1]
    fits = [problem.fit((*problem.base_free, *free), problem.nominal | {free[0].name: of * sag}) for of in (0.5, 1.0)]
    assert place_acts_again(problem.experiment, problem, fits, 0.0, anew) is None  # where jumps, placed again, leave less
    assert not driven.row_by_row(problem.experiment.channels[0, ""])
    found, fitted = place_again(problem.experiment, problem, fits, fits, anew)
    assert driven.row_by_row(found.experiment.channels[0, ""])
    assert fitted.values["motor.supply_resistance"] == pytest.approx(sag, rel=0.03)
    assert found.loss(found.misfit(fitted.values)) < 0.5 * min(problem.loss(fit.misfit) for fit in fits)
    assert place_again(found.experiment, found, [fitted], [fitted], anew) is None
    assert driven.row_by_row(found.experiment.channels[0, ""])


@pytest.mark.slow
@pytest.mark.in_turn
def test_counts_in_a_loop_are_noise_of_what_follows_them(rng):
    """A controller of a coarse encoder moves its drive by what it makes of counts: what that is the command tells, and nothing where it saw none."""
    wave = rng.uniform(2.0, 4.0)
    of = {}
    for counted in (True, False):
        anew = asked_of(rng, simulated(lambda t: 1.5 * np.sin(wave * t), counted=counted), True)
        place_acts(anew().experiment, anew(), anew)
        found = anew().with_noise()
        values = found.absolute(found.fit(found.base_free, found.nominal).values)
        command = next(r for r in found.experiment.residuals if r.output == "controller.voltage")
        of[counted] = of_steps(found.experiment, command, values)[1]
    assert of[True] > 1.3 * of[False] > 0.0, of
