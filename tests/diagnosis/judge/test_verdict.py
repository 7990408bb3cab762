"""When causes are believed and when dropped, and of which comparison the error is told then."""

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.judge import verdict
from selflock.diagnosis.judge.depends import Dependence
from selflock.diagnosis.judge.verdict import Judge, Judgement, _ahead, _beyond_noise
from selflock.diagnosis.residuals.mending import Mending
from selflock.diagnosis.search.hypotheses import Hypothesis
from selflock.diagnosis.search.selection import Selection
from selflock.diagnosis.search.step import Step

BINS = 50


@pytest.mark.parametrize("sizes, shares, told", [
    ((1.2, 1.4, 20.0), (1.0, 1.0, 1.0), "motor"), ((1.2, 3.0, 20.0), (1.0, 1.0, 0.02), "motor"), ((2.0, 1.4, 1.1), (1.0, 1.0, 1.0), "gear"),
    ((1.2, 1.1, 1.2), (1.0, 1.0, 1.0), "gear"),
])  # fmt: skip
def test_the_error_is_that_of_the_comparison_that_is_off_most(sizes, shares, told, rng):
    """However few of its bins have samples; the gear's where none is off."""
    judge, outcome = left_alone(sizes, shares, rng)
    assert judge._most_off(outcome).name == told


def test_where_nothing_beat_chance_what_is_left_of_the_noise_is_noise(rng):
    """That of what a comparison reads is part of it."""
    _, outcome = left_alone((1.0, 1.1, 1.3), (1.0, 1.0, 1.0), rng)
    left = [Dependence("acceleration", name, 0.1, 0.01) for name in ("gear", "controller", "motor")]
    assert [d.residual for d in _beyond_noise(left, outcome.problem, outcome.base)] == ["motor"]


def left_alone(sizes, shares, rng):
    """A judge, and an outcome without causes whose residuals are off by so many times their noise, in a share of their bins."""
    residuals = [SimpleNamespace(name=name, kind=name) for name in ("gear", "controller", "motor")]
    present = np.concatenate([np.arange(30 * BINS).reshape(30, BINS) % round(1 / share) == 0 for share in shares], axis=1)
    misfit = np.repeat(sizes, BINS) * rng.choice([-1.0, 1.0], (30, 3 * BINS)) * present
    place = lambda residual: slice(residuals.index(residual) * BINS, (residuals.index(residual) + 1) * BINS)
    experiment = SimpleNamespace(residuals=residuals, slice=place)
    problem = SimpleNamespace(experiment=experiment, present=present, shape=misfit.shape)
    judge = Judge(experiment, None, None, [], rng)
    return judge, SimpleNamespace(problem=problem, base=SimpleNamespace(misfit=misfit.ravel()))


@pytest.mark.parametrize("named, free, over, believed", [
    (1.2, 1.1, "load", True),  # of 10 both leave as good as nothing
    (3.0, 1.0, "load", False),  # a law over another variable does more
    (3.0, 1.0, "speed", True),  # one of the cause's own bends as nature's formula does
    (5.0, 1.0, "speed", False),  # but the cause must explain much of it
    (1.0, 4.0, "load", True),
])  # fmt: skip
def test_a_free_law_in_the_drive_speaks_against_a_cause_where_it_does_more(named, free, over, believed, rng):
    left = lambda level: SimpleNamespace(
        losses=(x := level * rng.uniform(0.9, 1.1, (30, 1))),
        errors=x.sum(1),
        fit=SimpleNamespace(by_channel=True),
        complete=False,
    )
    cause = SimpleNamespace(hypothesis=SimpleNamespace(shown_over="speed"))
    outcome = SimpleNamespace(stages=[SimpleNamespace(base=left(10.0), chance_level=0.01)], standing=left(named), causes=[cause])
    law = left(free)
    law.hypothesis = SimpleNamespace(effect=f"free torque over {over}", shown_over=over)
    assert (_ahead(law, outcome) == "") == believed
    cause.hypothesis = Hypothesis("load", "parameter", ())  # a nominal value bends over nothing, and none is its own
    assert (_ahead(law, outcome) == "") == (believed and over != "speed")


def _goes_with(*variables):
    return [Dependence(name, "gear", share, 0.01) for name, share in zip(variables, (0.8, 0.5, 0.2))]


@pytest.mark.parametrize("missing, left, closed, reading, stands", [
    (("output position", "load"), ("output position", "acceleration"), 0.8, "current", True),
    (("output position", "load"), ("output position",), 0.95, "current", False),  # close to all of it
    (("output position", "load"), ("acceleration", "output position"), 0.8, "current", False),  # most goes with something else now
    (("load", "output position"), ("load", "output position"), 0.8, "current", False),  # friction does so, too
    (("output position", "load"), ("output position",), 0.8, "angle", False),  # held under a load it goes with itself
    ((), ("output position",), 0.8, "current", False),
])  # fmt: skip
def test_what_stands_in_the_way_is_no_cause_that_leaves_it_there(missing, left, closed, reading, stands):
    found = SimpleNamespace(gain=SimpleNamespace(closed=closed), left=_goes_with(*left))
    experiment = SimpleNamespace(residuals=[SimpleNamespace(name="gear", reading=reading)])
    assert Judge(experiment, None, None, [], None)._stands_there(found, _goes_with(*missing)) == stands


@pytest.mark.parametrize("effect, samples_in_a_bin, shows", [(0.05, 50, False), (1.0, 50, True), (0.05, 1, True)])
def test_what_averages_alone_show_is_no_cause(effect, samples_in_a_bin, shows, rng):
    """An effect of a twentieth of the noise; where bins are samples the error's drop has been asked for already."""
    n, noise = 5000, rng.standard_normal(5000)
    gear = SimpleNamespace(prefix="", uses=lambda name: True)
    layout = SimpleNamespace(per_bin=samples_in_a_bin, block=lambda run: np.arange(n) // 500)
    experiment = SimpleNamespace(
        layout=layout,
        residuals=[gear],
        compare=lambda residual, values: [(np.full(n, values["amount"]), effect + noise, np.ones(n, bool))],
        channels={(0, ""): SimpleNamespace(take=None)},
    )
    problem = SimpleNamespace(experiment=experiment, train=np.ones(10, bool), absolute=dict, by_channel=False)
    base, fit = (SimpleNamespace(values={"amount": amount}) for amount in (0.0, effect))
    assert Step._shows(SimpleNamespace(problem=problem, base=base), SimpleNamespace(fitted=fit)) == shows


@pytest.mark.parametrize("off, closed, left, believed", [
    ((1.0, 2.4), 0.2, 1.2, False),
    ((1.0, 2.4), 0.9, 1.2, True),  # nature's formula is not the cause's
    ((1.0, 1.2), 0.2, 1.2, True),  # as good as noise is left
    ((1.0, 1.2), 0.2, 1.4, False),  # in each channel, but not in that which it mends most
    ((1.0, 1.2), 0.9, 1.4, True),
])  # fmt: skip
@pytest.mark.parametrize("causes", [1, 0])
def test_what_closes_little_is_not_all_where_the_rest_goes_with_nothing(monkeypatch, off, closed, left, believed, causes):
    """Of a whole drive: a dent was a preload. Where no cause is named there is none to doubt."""
    judge = Judge(SimpleNamespace(by_channel=True, residuals=[]), None, None, [], None)
    monkeypatch.setattr(verdict, "excess", lambda *_: np.array(off))
    gain = SimpleNamespace(closed=closed, after=0.1 * left, noise_floor=0.1)
    outcome = Selection(None, [], [SimpleNamespace(drop=0.5)] * causes, [], None, None, None)
    found = Judgement(outcome, SimpleNamespace(before={}, after={}), gain, [])
    doubted = judge._far_off(found) and bool(judge._doubted(found, [], False))
    assert doubted == (bool(causes) and not believed)


@pytest.mark.parametrize("before, after, floor, stays", [
    (1.0, 0.9, 0.1, True), (1.0, 1.03, 0.1, False), (1.0, 0.995, 0.1, False),
    (1.0, 1.0, 0.99, True),  # no error there that could tell
])  # fmt: skip
def test_the_last_of_several_causes_must_lower_the_error_of_the_data_that_judge(monkeypatch, before, after, floor, stays):
    """In the comparison that it mended most on the data that taught."""
    first, last, without = object(), object(), SimpleNamespace(values={"last": 0.0}, free=())
    as_they_are = lambda experiment, values, free, seen=None: values
    problem = SimpleNamespace(with_these=lambda causes, fitted: without, absolute=dict, settled=as_they_are)
    experiment = SimpleNamespace(residuals=["gear", "motor"])
    told = {"gear": (before, after, floor), "motor": None}
    monkeypatch.setattr(Mending, "improvement", property(lambda self: {"gear": 0.1, "motor": 0.05}[self.residual]))
    monkeypatch.setattr(Mending, "levels", lambda self: told[self.residual])
    kept = [SimpleNamespace(winner="the first alone"), SimpleNamespace(winner="both")]
    final = SimpleNamespace(values={"last": 1.0}, free=())
    fewer = Judge(experiment, None, None, [], None)._refuted(Selection(problem, [], [first, last], kept, final, None, problem))
    if stays:
        assert fewer is None
    else:
        assert (fewer.causes, fewer.kept, fewer.final) == ([first], kept[:1], without)
        assert fewer.standing == "the first alone"
