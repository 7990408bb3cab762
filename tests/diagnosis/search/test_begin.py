"""Where fits of a whole drive begin: a linear look ends where the drive is linear, and from far beyond that no fit comes back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.whole import FILTER
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.look import as_read
from selflock.diagnosis.search.problem import Problem
from selflock.diagnosis.search.screen import Direction
from selflock.diagnosis.search.step import Step

from ..residuals import test_small_controllers as small
from ..residuals.test_row_by_row import K, R
from ..residuals.test_small_controllers import DRIVE, asked_of, simulated, steps

RESISTANCE = "motor.resistance"


@pytest.fixture
def step(rng, monkeypatch):
    """Of a drive whose motor has more resistance than its rig says."""
    monkeypatch.setitem(DRIVE, RESISTANCE, rng.uniform(0.6, 0.8) * R)
    problem = asked_of(rng, simulated(steps(rng, 1.5)), True)().with_noise()
    return Step(problem, problem.fit(problem.base_free, problem.nominal), [], RULES.search.clean, np.inf, lambda *_: None)


def way(step, name, amount):
    """Of acting of one number, as a look may have found it."""
    found = next(h for h in step.open if [p.name for p in h.free] == [name])
    return Direction(found, {}, found.free, np.ones((1, 1, 1)), amounts=np.array([amount]))


def left(step, start):
    return step.problem.loss(step.problem.misfit({**step.base.values, **start}))


@pytest.mark.slow
def test_a_fit_begins_with_as_much_as_leaves_no_more_than_nothing_does(step, rng):
    """Of the cause, ten to a hundred times too much of which the look promised; of another what leaves no more, or what the look saw."""
    right, wrong = way(step, RESISTANCE, rng.uniform(10.0, 100.0) * R), way(step, "load.damping", rng.uniform(10.0, 100.0))
    assert left(step, right.start()) > step.problem.loss(step.base.misfit) > left(step, step._start(right))
    assert DRIVE[RESISTANCE] < step._start(right)[RESISTANCE] < 4.0 * R
    begun, seen = step._start(wrong)["load.damping"], wrong.little()["load.damping"]
    assert 0.0 < begun < 0.01 * wrong.start()["load.damping"] and (begun <= seen or step._tried(wrong)[1] <= 1.0)


@pytest.mark.slow
def test_what_is_fitted_is_told_by_what_is_left_where_it_begins(step, rng):
    """And not by what a linear look sees in it: of two ways, and of two hypotheses, the other one promises more."""
    # a tenth of what is missing: the base's recorder may have made up for all but a fifth, and half may leave as much as nothing does
    amounts = rng.uniform(0.03, 0.04) * R * np.array([0.001, 1.0])
    small, right, wrong = way(step, RESISTANCE, amounts[0]), way(step, RESISTANCE, amounts[1]), way(step, "load.damping", -1.0)
    for one, gain in ((small, 2.0), (right, 1.0), (wrong, 3.0)):
        one.gain = gain
    assert step._best_begun([small, right]) == [right, small]
    chosen, first = step._entered([], [[wrong], [small, right]], lambda ways: False)
    assert [ways[0].hypothesis for ways in chosen][0] is right.hypothesis and RESISTANCE in first


@pytest.mark.slow
def test_a_cause_of_which_there_is_nothing_is_none_whatever_it_frees_beside(step):
    """A damping that ended at 0 beside the resistance that it freed; the same fit is a resistance that freed a damping."""
    (r,), (d,) = way(step, RESISTANCE, 0.3 * R).free, way(step, "load.damping", 0.0).free
    fitted = step.problem.fit((*step.base.free, r), {**step.base.values, r.name: R})
    fitted.values[d.name] = d.nominal
    of = lambda own, beside: Candidate(step.open[0], (own, replace(beside, companion=True)), fitted, step.losses)
    assert step._does_without(of(d, r)) and not step._does_without(of(r, d))


@pytest.mark.slow
def test_what_is_far_behind_one_fitted_to_its_end_is_fitted_no_further(step, rng, monkeypatch):
    """Though it is not among first fits: what is fitted anyway, as a wave is, has none. The others leave nearly all that there is.

    But where a fit to its end takes from the best of these what it took from the other, it may of any: a tilt was given up beside
    the bias of a sensor, which is the same law, and was no longer read as the recorder read.
    """
    right, wrong = way(step, RESISTANCE, 0.35 * R), way(step, "load.damping", 0.0)
    (r,), base = right.free, step.base
    first = {"load.damping": step.problem.fit((*base.free, *wrong.free), base.values | wrong.start(), effort=4)}
    others = [replace(right, hypothesis=replace(right.hypothesis, effect=label)) for label in ("second", "behind")]
    for one, amount in zip(others, (0.03, rng.uniform(0.01, 0.02))):
        begin = {**base.values, r.name: r.nominal + amount * R}
        first[one.hypothesis.label] = step.problem.fit((*base.free, r), begin, effort=1)
    second, behind = (one.hypothesis.label for one in others)
    loss = lambda fitted: step.problem.loss(fitted.misfit)
    losses = [*map(loss, (first[second], first[behind], base))]
    assert max(losses) < RULES.search.behind * min(losses)
    monkeypatch.setattr("selflock.diagnosis.search.step.arrived", lambda problem, candidates, fitted: candidates)

    def asked(*ways):
        monkeypatch.setattr(step, "_entered", lambda *_: ([[one] for one in ways], first))
        return {c.hypothesis.label: c.fit for c in step._fits([*ways]) if c.fit}

    for best in (wrong, others[0]):
        found, label = asked(right, best, others[1]), best.hypothesis.label
        end, brought = loss(found[right.hypothesis.label]), max(1.0, loss(first[label]) / loss(found[label]))
        # a base that fits well is not far behind
        assert end < losses[0] and (found[behind] is first[behind]) == (losses[1] > RULES.search.near_best * brought * end)
    assert asked(others[1])[behind] is not first[behind]


def in_open_loop(rng, monkeypatch, seconds, early):
    """Asks of a drive whose voltage constant is off, under steps of a voltage, until just after so many seconds as small as `early`."""
    heights = 6.0 * rng.uniform(0.5, 1.0, 120) * (-1.0) ** np.arange(120)
    monkeypatch.setattr(small, "LASTS", 1.8 * seconds)
    monkeypatch.setitem(DRIVE, "motor.voltage_constant", rng.uniform(0.6, 0.9) * K)
    volts = lambda t: (early if t < 1.1 * seconds else 1.0) * float(heights[int(t / 0.47)])
    return asked_of(rng, simulated(volts, closed=False), False)


@pytest.mark.slow
@pytest.mark.parametrize("late", [False, True])
def test_a_first_look_sees_what_acts_after_its_first_seconds(rng, monkeypatch, late):
    """Where a drive stands still in these all of its error is in the others: the look is at them, too."""
    problem = in_open_loop(rng, monkeypatch, RULES.residuals.whole_glance, 0.0 if late else 1.0)().with_noise()
    base = problem.fit(problem.base_free, problem.nominal)
    moved = lambda of: np.abs(of.misfit(base.values | {RESISTANCE: 1.1 * R}) - of.misfit(base.values)).sum()
    first, every, near = problem.glance(False), problem.glance(True), problem.near(base)
    assert (moved(first) == 0.0) == late and 0.0 < moved(near) == moved(every if late else first)


@pytest.mark.slow
@pytest.mark.parametrize("late", [False, True])
def test_what_acts_after_the_seconds_that_are_fitted_is_fitted_on_more(rng, monkeypatch, late):
    """A drive that creeps for as long: it was `unknown`, whatever the rest of its log shows."""
    seconds = RULES.residuals.whole_fits
    every = in_open_loop(rng, monkeypatch, seconds, 0.01 if late else 1.0)().experiment
    fitted = DriveExperiment(every.rig, every.original, sampled=True)
    problem = Problem.of(fitted, np.ones(fitted.layout.count, bool)).with_noise()
    longer = problem.longer(problem.fit(problem.base_free, problem.nominal))
    assert (longer is not None) == late
    if longer:
        excess = longer.excess(longer.nominal).max()
        assert longer.experiment.seconds == 2.0 * seconds and excess > 2.0 * problem.excess(problem.nominal).max()
        assert longer.glance(True).experiment.seconds == 2.0 * seconds


@pytest.mark.slow
def test_ways_begin_as_the_log_was_read_where_a_filter_stands_for_what_is_missing(step, rng):
    """Beside a filter in the loop that is none a cause may leave more than the base: without it, it begins where it is."""

    def beside(late):
        values = step.base.values | {FILTER: late}
        base = replace(step.base, values=values, misfit=step.problem.misfit(values))
        return Step(step.problem, base, [], RULES.search.clean, np.inf, lambda *_: None)

    missing = R - DRIVE[RESISTANCE]
    plain, astray = beside(0.0), beside(rng.uniform(0.02, 0.05))
    assert as_read(plain._views[False], plain.base, [way(plain, RESISTANCE, missing)]) is None
    right = way(astray, RESISTANCE, missing)
    best, start, share = as_read(astray._views[False], astray.base, [right])
    without = astray._views[False].left({FILTER: 0.0} | right.start())
    assert best is right and start[FILTER] == 0.0 and start[RESISTANCE] == pytest.approx(R) and share <= without
    assert astray._best_begun([right]) == [right] and astray._tried(right)[1] <= max(share, 1.0)
    if share < RULES.search.unfiltered:  # beside the filter next to nothing is gained
        assert astray._tried(right) == (start, share)
