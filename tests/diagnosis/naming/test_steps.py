"""What steps miss of a model, and what of it is taken off the log before rivals are held against it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.naming import steps
from selflock.diagnosis.naming.extended import Extended, Extending, Vanishing
from selflock.diagnosis.naming.guesses import number
from selflock.diagnosis.naming.places import IN, Insert, Place
from selflock.diagnosis.naming.round import Rivalled
from selflock.diagnosis.naming.steps import (
    _vanishing,
    around,
    fine_enough,
    in_own_steps,
    in_vanishing,
    released,
    stepped,
    widened,
)

GIVEN = 0.1  # s, the rig's step
LAW = Insert("law", Place(IN, "b.drawn"), "proportional", over="b.v")
TIME = np.arange(50.0)
TRUTH = np.sin(TIME)


class Played(Extended):
    """A system whose output errs by a share of its step, and by more of it where a law is in it."""

    outputs = ("x",)

    def __init__(self, step):
        self.step, self.inserts, self.parts, self.kept = step, (), SimpleNamespace(step=step), {}
        self.rounded, self.rounding = {}, {}
        self.logged = [SimpleNamespace(signals={"x": TRUTH})]

    def extend(self, inserts):
        self.inserts = tuple(inserts)

    def spread(self, name):
        return 1.0

    def trusted(self, name, which):
        return [np.ones(len(TIME), bool) for _ in which]

    def forget(self): ...

    def close(self): ...


class Model(Extending):
    """measured - simulated, with the numbers that are right."""

    def unrounded(self, values, which=None):
        h, c = self.played.step, 3.0 if self.played.inserts else 0.4
        simulated = TRUTH + c * (h + 0.2 * h**2) * np.cos(TIME)
        return {"x": [self.runs[0].signals["x"] - simulated]}


class Work:
    given_step, finest = GIVEN, GIVEN / 8.0
    numbers = inserts = ()

    def __init__(self, step, sampled=frozenset()):
        self.step, self.played, self.others = step, Played(step), sampled
        self.parts = self.played.parts

    def in_steps(self, factor):
        return Work(self.step * factor, self.others)

    def played_on(self, parts, runs, numbers, logged=None):
        return Played(parts.step)


def problem(step):
    run = MeasuredRun("log.csv", "", np.arange(len(TIME)), TIME, {"x": TRUTH.copy()})
    found = Model(None, [run], (), [0], [])
    vars(found)["played"], vars(found)["trusted"] = Played(step), {"x": [np.ones(len(TIME), bool)]}
    return found


@pytest.mark.parametrize("halved", [1, 3])
def test_what_is_left_in_steps_that_vanish_is_of_second_order(halved):
    near = problem(step := GIVEN / 2.0**halved)
    (left,) = _vanishing(Work(step), near, near, {})["x"]
    assert left == pytest.approx(0.4 * 0.2 * 2.0 * step**2 * np.cos(TIME), abs=1e-12)


def test_rivals_are_held_against_a_log_that_the_steps_have_left_nothing_in():
    near = problem(GIVEN / 8.0)
    own = in_own_steps(Work(GIVEN / 8.0), near, np.zeros(0))
    assert own.played.step == pytest.approx(GIVEN)
    assert abs(own.errors({})["x"][0]).max() < 0.4 * GIVEN / 100.0  # of 0.04 before


@pytest.mark.parametrize(("times", "step"), [(1.0, GIVEN), (2.0, GIVEN / 2.0), (4.0, GIVEN / 4.0), (100.0, GIVEN / 8.0)])
def test_where_the_rigs_steps_make_another_system_the_longest_are_taken_that_do_not(monkeypatch, times, step):
    """A house moved by 11 % of its spread: all was looked at in an eighth of its steps, for half a minute of its 143 s."""
    found = Model.unrounded
    near = problem(GIVEN / 8.0)
    errors = lambda self, values, which=None: {"x": [2.5 * times * found(self, values)["x"][0]]}
    monkeypatch.setattr(Model, "unrounded", errors)
    assert in_own_steps(Work(GIVEN / 8.0), near, np.zeros(0)).played.step == pytest.approx(step)


def test_a_fit_in_steps_that_vanish_leaves_what_half_the_step_changed_once_more(monkeypatch):
    told = lambda step: {"x": [np.array([2.0 + 3.0 * step])]}
    monkeypatch.setattr(Extending, "unrounded", lambda self, values, which=None: told(self.units["step"]))
    doubled = Extending(None, [], (), [0], [], units={"step": 0.2})
    one = Vanishing(None, [], (), [0], [], units={"step": 0.1}, doubled=doubled)
    assert one.unrounded({})["x"][0] == pytest.approx([2.0])


@pytest.mark.parametrize(("halved", "begun"), [(3, 1.0), (3, 1.9), (2, 1.0)])
def test_numbers_made_up_for_what_the_finest_steps_miss_and_what_is_taken_off_is_beside_those_of_vanishing_ones(
    monkeypatch, rng, halved, begun
):
    """A house's limit of 1.02 times the noise where no steps missed anything left 1.7 beside what was taken off for eighths of them."""
    near, true, noise = problem(step := GIVEN / 2.0**halved), 2.0, 1e-3
    simulated = lambda self, values: values["a"] * (1.0 + 5.0 * self.played.step) * np.cos(TIME)
    left = lambda self, values, which=None: {"x": [self.runs[0].signals["x"] - simulated(self, values)]}
    monkeypatch.setattr(Extending, "unrounded", left)
    run = replace(near.runs[0], signals={"x": true * np.cos(TIME) + noise * rng.standard_normal(len(TIME))})
    model = Extending(None, [run], (number("a", 1.0, 0.0, 4.0),), [0], [np.ones(len(TIME), bool)], units={"x": 1.0})
    vars(model)["played"] = near.played
    places = np.array([model.numbers[0].place(true / (1.0 + 5.0 * step))])  # where it fits in these steps
    found = model.values(in_vanishing(Work(step), model, places, {"a": begun}))["a"]
    if halved == 3:
        assert found == pytest.approx(true, abs=15.0 * noise)  # 50 samples, errors of 2 e1 - e2: five standard errors are 1.6e-3
    else:  # finer ones were not asked for
        assert found == pytest.approx(true / (1.0 + 5.0 * step))


def test_what_steps_change_of_a_strong_law_is_taken_off_as_it_is_there():
    near = problem(GIVEN / 8.0)
    work = Work(GIVEN / 8.0)
    own = in_own_steps(work, near, np.zeros(0))
    rival = SimpleNamespace(problem=near, values={}, guess=SimpleNamespace(inserts=(LAW,)))
    anew = around(work, near, own, rival, {"x": 0.01})
    anew.played.extend((LAW,))
    assert abs(anew.errors({})["x"][0]).max() < 3.0 * GIVEN / 100.0  # of 0.26 beside the log of the base
    assert near.played.inserts == own.played.inserts == ()
    assert around(work, near, own, rival, {"x": 10.0}) is None  # beside such a noise it is nothing
    assert around(work, near, own, rival, {"x": 0.01}, anew) is None  # that log was told for just this


@pytest.mark.parametrize(
    ("sampled", "moved", "left", "taken"),
    [(set(), 1.0, 2.0, 8), (set(), 0.01, 0.5, 1), ({"controller"}, 1.0, 2.0, 1), ({"controller"}, 1.0, 0.5, 8)],
)
def test_finer_steps_are_taken_where_they_move_the_model_whatever_is_missing(monkeypatch, sampled, moved, left, taken):
    """Beside a scale of a sensor they left no less, by chance, and what steps missed was named a lag of it."""
    near, work = problem(GIVEN), Work(GIVEN, frozenset(sampled))
    monkeypatch.setattr(Model, "values", lambda self, places: {})
    monkeypatch.setattr(Model, "misfit", lambda self, places: None)
    monkeypatch.setattr(Model, "loss", lambda self, misfit: left ** np.log2(GIVEN / self.played.step))
    fit = lambda other, places, *_: SimpleNamespace(places=places, loss=other.loss(None))
    monkeypatch.setattr(steps, "fit_from", fit)
    monkeypatch.setattr(steps, "_moved", lambda *_: moved)
    found, _, _ = fine_enough(work, near, np.zeros(0))
    assert found.step == pytest.approx(GIVEN / taken)


@pytest.mark.parametrize(("finer", "rough"), [(True, False), (False, False), (True, True)])
def test_steps_are_asked_of_a_model_with_a_rival_and_the_system_is_as_it_was(monkeypatch, finer, rough):
    """What finer steps leave less of goes under beside something strong that is missing.

    A rival that was fitted roughly is fitted first: in half the steps it was, and what that changed was taken for what steps do.
    """
    near, work = problem(GIVEN), Work(GIVEN)
    work.with_also, wider = lambda guess: wider, SimpleNamespace(inserts=(LAW,))
    other, model = SimpleNamespace(), SimpleNamespace(values=lambda places: {"a": float(places[0])})
    asked = []

    def fine(work, near, places):
        asked.append((work, near.played.inserts, float(places[0])))
        return (other, model, np.array([0.7])) if finer else (work, near, places)

    monkeypatch.setattr(steps, "fine_enough", fine)
    monkeypatch.setattr(steps, "fit_from", lambda *_: SimpleNamespace(places=np.array([0.3])))
    rival = SimpleNamespace(guess=None, problem=near, end=SimpleNamespace(places=np.array([0.2])), rough=rough)
    assert stepped(work, near, rival) == ((other, model, {"a": 0.7}) if finer else None)
    assert asked == [(wider, (LAW,), 0.3 if rough else 0.2)] and near.played.inserts == ()


@pytest.mark.parametrize(
    ("kept", "left", "taken"), [(True, 0.9, True), (True, 0.97, False), (True, 2.0, False), (False, 0.5, False)]
)
@pytest.mark.parametrize("finer", [True, False])
def test_what_computes_all_the_time_takes_finer_steps_where_that_leaves_less_beside_what_explains_most(
    monkeypatch, kept, left, taken, finer
):
    """A house's thermostat kept the rig's step, which a base without a square root could not tell: its thermometer was 5 % faster."""
    work, base = SimpleNamespace(keep=frozenset({"thermostat"} if kept else ())), (SimpleNamespace(), None)
    rival = SimpleNamespace(guess=None, problem="own", values={})
    work.with_also = lambda guess: SimpleNamespace(inserts=())
    mine, other = (SimpleNamespace(inserts=()), "kept", {}), (SimpleNamespace(inserts=()), "all", {})
    monkeypatch.setattr(steps, "stepped", lambda one, near, rival: (mine if finer else None) if one is work else other)
    monkeypatch.setattr(steps, "_sizes", lambda problem, inserts, values: {"x": left if problem == "all" else 1.0, "y": 1.0})
    assert released(work, None, base, rival) is (other if taken else mine if finer else None)


@pytest.mark.parametrize("bent", [False, True])
def test_who_won_in_the_rigs_steps_is_fitted_in_finer_ones_with_the_slopes_that_it_has(monkeypatch, bent):
    """Slopes simulated in eighths of a house's steps took 9 s of each cause, which is fitted from where it ended."""
    near, own, fits, simulated = problem(GIVEN / 8.0), problem(GIVEN), [], []
    word = "law.l" if bent else "law.a"
    guess = SimpleNamespace(numbers=(number(word, 0.0, 0.0, 1.0),))
    own.numbers = guess.numbers
    end = SimpleNamespace(places=np.array([0.2]), jacobian=np.array([[1.0], [2.0]]))
    winner = Rivalled(guess, own, end, None, None)
    work = Work(GIVEN / 8.0)
    work.inserts = (LAW,)
    monkeypatch.setattr(steps, "fit_from", lambda *given: fits.append(given) or SimpleNamespace(places=np.array([0.3])))
    monkeypatch.setattr(Model, "misfit", lambda self, places: simulated.append(self.played.step) or places * np.ones(2))
    found, places = widened(near, winner, work)
    _, start, *_, sloped, known = fits[0]
    assert places == [0.3] and start == [0.2] and found.played is near.played and near.played.inserts == (LAW,)
    assert known is None if bent else known[word].tolist() == [1.0, 2.0]
    sloped(found.misfit, found.free)(np.array([0.3]), np.ones(2))
    assert set(simulated) == {GIVEN / 4.0}  # and not in those of the fit
