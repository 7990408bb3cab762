"""What belongs to a run: found where it fits best, freed for each run, judged on blocks that its fit did not see."""

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.residuals import phase
from selflock.diagnosis.search.fit import fit, jacobian
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.linear import Linear
from selflock.diagnosis.search.phases import best
from selflock.diagnosis.search.screen import Direction
from selflock.fmus.effect import ORDER, PHASE

BLOCKS, SAMPLES, RUNS = 20, 50, 4
OF = np.repeat(np.arange(RUNS), BLOCKS // RUNS)
PLACE = np.linspace(0.0, 60.0, BLOCKS * SAMPLES).reshape(BLOCKS, SAMPLES)


def run(number):
    return SimpleNamespace(key=f"/some.where/log.{number}.csv:1")


def wave(truth):
    """Columns of a wave and what waves with these phases, one for each run, leave."""
    columns = np.stack([np.cos(PLACE), -np.sin(PLACE)], -1)
    return columns, -0.4 * np.cos(PLACE + truth[OF][:, None])


def test_a_value_of_one_run_is_that_run_s_alone():
    values = {phase.name(run(1), "front_motor.cogging_phase"): 1.0, "front_motor.cogging_phase": 2.0}
    assert [phase.own(values, run(i)) for i in (0, 1)] == [{}, {"front_motor.cogging_phase": 1.0}]
    assert {phase.parameter(name) for name in values} == {"front_motor.cogging_phase"}


def test_the_best_phase_of_each_run_is_found_in_a_few_places(rng):
    """The loss of a linear law has two harmonics: no place between those that are tried is missed, but for the half degree."""
    truth, runs = rng.uniform(-np.pi, np.pi, RUNS), [run(i) for i in range(RUNS)]
    asked = []

    def loss(values):
        asked.append(values)
        own = np.array([values[phase.name(r, "motor.wave_phase")] for r in runs])
        return (2.0 + np.cos(own - truth - np.pi)) ** 2

    found = best(loss, {}, runs, "motor.wave_phase")
    off = np.angle(np.exp(1j * (np.array([found[phase.name(r, "motor.wave_phase")] for r in runs]) - truth)))
    assert abs(off).max() < np.radians(0.3) and len(asked) < 10


def test_numbers_of_single_runs_are_moved_together_for_their_slopes(rng):
    places, asked = np.arange(6), []
    free = tuple(Free(f"run.{i}.a.phase", 0.0, -9.0, 9.0, role=PHASE, part=(2 * i, 2 * i + 2)) for i in range(3))
    more = Free("run.0.b.phase", 0.0, -9.0, 9.0, role=PHASE, part=(0, 2))  # another wave of the first run

    def misfit(values):
        asked.append(values)
        own = np.repeat([values[p.name] for p in free], 2)
        return np.sin(own + places) + np.where(places < 2, values[more.name], 0.0)

    values = {p.name: rng.uniform(-1.0, 1.0) for p in (*free, more)}
    at = misfit(values)
    found = jacobian(misfit, {}, (*free, more), values, at)
    assert len(asked) == 3
    own = np.repeat([values[p.name] for p in free], 2)
    expected = np.zeros((6, 4))
    expected[places, places // 2] = np.cos(own + places)
    expected[:2, 3] = 1.0
    np.testing.assert_allclose(found, expected, atol=1e-3)


@pytest.mark.parametrize("own", [True, False])
def test_a_wave_shows_at_first_look_where_each_run_has_its_own_phase(own, rng):
    columns, left = wave(np.arange(RUNS) * np.pi / 2)  # a common phase gains nothing
    left = left + 0.5 * rng.standard_normal(left.shape)
    free = Free("a.size", 0.0, -1.0, 1.0), Free("a.phase", 0.0, -6.3, 6.3, role=PHASE, of_run=own)
    way = Direction(Hypothesis("a", "wave", free), {}, free[:1], columns, phase="a.phase", of_run=own)
    base = rng.standard_normal((BLOCKS, SAMPLES, 1))
    linear = Linear(base, np.ones((BLOCKS, SAMPLES)), np.arange(BLOCKS) % 5, OF)
    linear.look(way, linear.draws(left))
    held = 0.5 * 0.4**2 * BLOCKS * SAMPLES  # the wave's energy; its gain has a deviation of 0.11 of it, 2 * 0.5 * sqrt(held)
    assert way.gain > 0.4 * held if own else way.gain < 0.2 * held
    if own:
        start = way.start()
        assert start["a.size"] == pytest.approx(0.4, abs=0.12)
        assert abs(np.angle(np.exp(1j * start["a.phase"]))) < 0.6


def test_phases_of_runs_are_paid_for_on_blocks_not_seen(rng):
    """In noise a wave of five numbers gains nothing on average, and chance finds as much as it does: at 10 % once in ten."""
    columns, _ = wave(np.zeros(RUNS))
    free = Free("a.size", 0.0, -1.0, 1.0), Free("a.phase", 0.0, -6.3, 6.3, role=PHASE, of_run=True)
    way = Direction(Hypothesis("a", "wave", free), {}, free[:1], columns, phase="a.phase", of_run=True)
    linear = Linear(np.zeros((BLOCKS, SAMPLES, 0)), np.ones((BLOCKS, SAMPLES)), np.arange(BLOCKS) % 5, OF)
    gains, called = [], 0
    for _ in range(100):
        noise = rng.standard_normal((BLOCKS, SAMPLES))
        chance = linear.chance([way], noise, 49, rng)
        linear.look(way, linear.draws(noise))
        gains.append(way.gain)
        called += (1 + (chance >= way.gain).sum()) / 50 <= 0.1
    assert np.mean(gains) < 0.0 and called <= 25  # 10 expected, five standard deviations


def test_who_is_counted_from_anywhere():
    ch = lambda *names: SimpleNamespace(has=lambda name: name in names)
    assert phase.relative(ch("motor.current", "reducer.input_speed"), "motor", "input")
    assert phase.relative(ch("motor.current", "reducer.input_angle", "load.angle"), "reducer", "input")
    assert not phase.relative(ch("motor.current", "reducer.input_angle", "load.angle"), "reducer", "output")
    assert not phase.relative(ch("motor.current", "load.angle"), "motor", "input")
    assert phase.relative(ch("motor.voltage", "load.angle"), "motor", "input")  # simulated from its voltage it counts from 0


def test_waves_of_many_turns_are_fitted_by_what_shifts_their_end(rng):
    """A thousandth of a wave too few in a turn is far off after 300 turns, where steps as long as a usual number's see nothing."""
    turns, order, phase = 300.0, 4.0 + rng.uniform(2e-4, 6e-4), rng.uniform(-0.5, 0.5)
    angle = np.linspace(0.0, 2.0 * np.pi * turns, 20_000)
    waves = [
        Free("a.order", 4.0, 1.0, 60.0, role=ORDER, length=1.0 / (2.0 * np.pi * turns)),
        Free("a.phase", 0.0, -3.0, 3.0, role=PHASE),
    ]
    misfit = lambda values: np.sin(order * angle + phase) - np.sin(values["a.order"] * angle + values["a.phase"])
    found = fit(misfit, {}, waves, {"a.order": 4.0, "a.phase": 0.0}, np.ones(len(angle), bool), np.inf, by_channel=True)
    assert found.values["a.order"] == pytest.approx(order, abs=1e-6)
