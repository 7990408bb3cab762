"""What a contest does not fit, or ask for: what could not be believed beside what it has."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rivals import ARRANGED, cause

from selflock.diagnosis.calibration.fit import End
from selflock.diagnosis.naming import asked as asked_module
from selflock.diagnosis.naming import bent as bent_module
from selflock.diagnosis.naming import contest as contest_module
from selflock.diagnosis.naming import whole
from selflock.diagnosis.naming.asked import beyond_steps
from selflock.diagnosis.naming.bent import begins_low, from_brims
from selflock.diagnosis.naming.contest import Contest
from selflock.diagnosis.naming.guesses import CURVE, LAW, number
from selflock.diagnosis.naming.order import leading
from selflock.diagnosis.naming.round import Rivalled, Round
from selflock.diagnosis.naming.run import _ends_beyond
from selflock.diagnosis.naming.whole import Whole
from selflock.diagnosis.search.candidate import Candidate


def weighed(**options):
    """A contest whose base leaves a loss of 1, of two outputs whose noise is 1; rivals of it by what they leave."""
    contest = Contest(SimpleNamespace(loss=lambda misfit: 1.0), np.zeros(0), "c", lambda what, share: None, **options)
    contest.arranged, contest.base = ARRANGED, SimpleNamespace(misfit=np.ones(2))
    contest.noise, contest.scene = {"x": 1.0, "y": 1.0}, SimpleNamespace()
    return contest


def rival(count=1, loss=0.1, left=(2.0, 2.0), kind=LAW, law="cubic", rough=False):
    guess = SimpleNamespace(law=law, kind=kind, count=count, label=f"{law} of {count}", plain=True)
    end, candidate = SimpleNamespace(loss=loss, misfit=np.array(left)), SimpleNamespace(errors=np.full(2, loss))
    return SimpleNamespace(guess=guess, values={}, rough=rough, end=end, candidate=candidate)


@pytest.mark.parametrize(
    ("left", "kind", "fits"),
    [((1.0, 1.005), LAW, [1, 2]), ((1.0, 1.05), LAW, [1, 2, 3]), ((0.9, 1.2), LAW, [1, 2, 3]), ((1.0, 1.0), CURVE, [1, 2, 3])],
)
def test_what_has_more_numbers_is_not_fitted_where_none_could_leave_enough_less(monkeypatch, left, kind, fits):
    """Beside a Dahl friction that left a house its noise LuGre and Bouc-Wen were fitted at four places, and six overflows."""
    contest = weighed()
    monkeypatch.setattr(Contest, "_fit_anew", lambda self, guess, start, *_: rival(guess.count))
    contest.more(rival(2, left=left, kind=kind))
    guess = lambda count, kind=LAW: SimpleNamespace(label=str(count), kind=kind, count=count)
    assert [count for count in (1, 2, 3) if contest.fit(guess(count), {})] == fits
    assert contest.fit(guess(9, CURVE), {})  # what is no name is asked for all the same


def test_a_fit_that_was_made_is_not_made_again(monkeypatch):
    contest, count = weighed(), []
    monkeypatch.setattr(Contest, "_fit_anew", lambda self, guess, start, *_: count.append(start) or rival(len(count)))
    guess, way = SimpleNamespace(label="a", kind=LAW, count=1), object()
    first = contest.fit(guess, {"a": 1.0}, way)
    assert contest.fit(guess, {"a": 1.0}, way) is first and len(count) == 1
    contest.fit(guess, {"a": 1.0})  # with slopes of its own
    contest.fit(guess, {"a": 2.0}, way)
    contest.problem = SimpleNamespace(loss=lambda misfit: 1.0)  # on another log
    contest.fit(guess, {"a": 1.0}, way)
    assert len(count) == 4


@pytest.mark.parametrize(("left", "wanting"), [(1.0, False), (1.5, True)])
def test_nothing_more_is_wanted_where_another_than_the_best_leaves_nothing_as_its_own_log_is_told(monkeypatch, left, wanting):
    """The best of a house's frictions left something where what steps miss was taken off; the second, which was right, did not."""
    contest, first, second = weighed(), rival(3, 0.1, (1.5, 1.5), law="Bouc-Wen"), rival(2, 0.11, law="Dahl")
    told = {id(second): rival(2, 0.05, (left, left))}
    monkeypatch.setattr(Contest, "_retold", lambda self, one: told.get(id(one), one))
    assert contest.more(second) == wanting
    assert contest._wanting(Round(None, [first, second])) == wanting


@pytest.mark.parametrize(
    ("loss", "curve", "heights"), [(0.4, None, 3), (0.6, None, 1), (0.52, None, 3), (0.52, "elsewhere", 1), (0.52, "here", 3)]
)
def test_a_limit_is_begun_from_other_heights_where_it_is_in_reach_of_the_best(monkeypatch, loss, curve, heights):
    """Six overflows of a house were fitted from four heights each, which took a quarter of what the best did.

    So were four limits beside a curve of its wall that left nothing, of which they took a quarter, too.
    """
    contest, limit = weighed(), rival(2, 0.7, law="limit", rough=True)
    contest.most, limit.guess.goes = 0.9, "here"
    tells = None if curve is None else rival(17, 0.0, kind=CURVE)
    if tells is not None:
        tells.guess.goes = curve
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start: rival(2, loss, law="limit"))
    monkeypatch.setattr(bent_module.g, "brims", lambda scene, guess: [{"l": 0.1}, {"l": 0.2}])
    contest.values = {}
    assert len(from_brims(contest, limit, tells)) == heights


def test_other_steps_are_asked_for_once_beside_each_and_not_where_a_name_leaves_nothing(monkeypatch):
    count = []
    monkeypatch.setattr(Contest, "played", property(lambda self: None))
    contest = weighed(steps=lambda rival: count.append(rival.guess.label))
    for one in (rival(1), rival(1), rival(2)):
        assert not contest._elsewhere(one, 0.5)
    assert count == ["cubic of 1", "cubic of 2"]
    assert not contest.more(rival(3, left=(1.0, 1.0))) and not contest._elsewhere(rival(4), 0.0) and len(count) == 2


@pytest.mark.parametrize(("left", "asked"), [((5.0, 1.0), True), ((5.0, 9.0), False)])
def test_steps_are_asked_for_beside_what_leaves_least_over_the_noise_whatever_the_units(monkeypatch, left, asked):
    """A dead zone took a house's wall from 10.7 times its noise to 1.2, and a Dahl friction that made up for its steps 60 % of the loss."""
    count = []
    monkeypatch.setattr(Contest, "played", property(lambda self: None))
    contest = weighed(steps=lambda rival: count.append(rival.guess.label))
    contest.base = SimpleNamespace(misfit=np.array([5.0, 10.0]))
    contest._elsewhere(rival(1, loss=0.7, left=left), 0.5)
    assert bool(count) == asked


@pytest.mark.parametrize(("loss", "asked"), [(0.16, True), (0.4, False)])
def test_steps_are_asked_for_beside_what_acts_on_what_moves_where_it_does_nearly_as_well(loss, asked):
    """A friction that turned round within a step of its controller was named at the controller's reading of it: it asks for no finer steps."""
    read, worse = rival(4, 0.14, law="read"), rival(2, 0.2, law="read")
    moving, less = rival(4, loss), rival(4, loss + 0.01)
    curve, quiet = rival(17, 0.1, kind=CURVE), rival(1, 0.3, (1.0, 1.0), law="read")
    before = lambda guess: (False, guess.law == "read")
    found = leading(
        [curve, less, worse, quiet, read, moving], lambda r: 1.0 - r.end.loss, lambda r: float(r.end.misfit.max()), before
    )
    assert found == ([read, quiet, moving] if asked else [read, quiet])
    assert leading([curve], lambda r: 1.0 - r.end.loss, lambda r: 0.0, before) == []


@pytest.mark.parametrize(("values", "beyond"), [({"a": 0.6}, True), ({"a": 0.501}, False), ({}, True), ({"a": 9.0}, True)])
def test_a_fit_to_all_that_ended_far_beyond_the_searchs_own_is_made_again_from_there(values, beyond):
    """A limit of a house began where coarser steps had it, and ended at a third more than its noise: a curve was the answer."""
    near = SimpleNamespace(
        free=[number("a", 0.0, 0.0, 1.0)], misfit=lambda at: at - 0.5, loss=lambda misfit: 1.0 + 100.0 * misfit @ misfit
    )
    assert _ends_beyond(near, values, np.array([0.5])) == beyond


@pytest.mark.parametrize(("laws", "learns"), [(["cubic.a"], True), (["limit.a", "limit.l"], False)])
def test_what_is_bent_is_fitted_to_all_with_slopes_of_its_own(monkeypatch, laws, learns):
    asked = []
    problem = SimpleNamespace(numbers=(), free=(), fixed={}, values=lambda places: {})
    found = [[number(name, 0.0, 0.0, 1.0) for name in laws]]
    work = SimpleNamespace(problem=lambda: problem, found=found, judges=(), step=1.0, given_step=1.0)
    monkeypatch.setattr(whole, "in_units", lambda *given: asked.append(given[-1] is not None) or SimpleNamespace(places=()))
    monkeypatch.setattr(whole, "own", lambda *given: {})
    monkeypatch.setattr(whole, "measured", lambda *given: None)
    whole.fitted(work, {}, {})
    assert asked == [learns]


def test_what_steps_miss_is_taken_off_first_where_other_steps_had_been_asked_for(monkeypatch):
    """A limit of a house fitted beside what the base's steps missed ended in another valley, and three times all began anew."""
    seen = []
    own = SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None))
    known = Rivalled(
        SimpleNamespace(label="limit"),
        SimpleNamespace(free=[number("l", 0.0, 0.0, 1.0)]),
        End(None, np.array([0.3]), 1.0),
        None,
        None,
    )
    known.problem.values = lambda places: {"l": float(places[0])}
    contest = weighed(told=lambda rival, noise, *last: seen.append(rival.values["l"]))
    contest.problem, contest.inserts = own, ()
    monkeypatch.setattr(Contest, "played", property(lambda self: own.played))
    assert contest._retold(known, {"l": 0.6}) is known and seen == [0.6] and known.values == {"l": 0.3}


@pytest.mark.parametrize(("law", "rough", "learns"), [("cubic", False, True), ("cubic", True, False), ("limit", False, False)])
def test_beside_another_log_a_fit_has_the_slopes_that_it_had_but_of_what_is_bent(monkeypatch, law, rough, learns):
    """Simulated anew at each of its steps they took a sixth of all time of a house."""
    contest, asked = weighed(), []
    numbers = (number("a", 0.0, 0.0, 1.0), *((number("c.l", 0.0, 0.0, 1.0),) if law == "limit" else ()))
    slopes = np.arange(2.0 * len(numbers)).reshape(2, -1)
    problem = SimpleNamespace(free=numbers, misfit=lambda places: np.ones(2), loss=lambda misfit: 0.5)
    contest.looks, contest.values = SimpleNamespace(trial=lambda guess: problem), {}
    guess = SimpleNamespace(law=law, kind=LAW, label=law, count=len(numbers), numbers=numbers)
    begun = Rivalled(guess, problem, SimpleNamespace(jacobian=slopes), None, None, rough)
    monkeypatch.setattr(contest_module, "fit_from", lambda *given: asked.append(given[-1]) or SimpleNamespace(misfit=None))
    assert contest.fit(guess, {}, begun=begun) is None
    if learns:
        assert asked[0]["a"].tolist() == [0.0, 1.0]
    else:
        assert asked == [None]


def test_what_steps_miss_of_a_rival_is_asked_beside_the_noise_that_it_leaves(monkeypatch):
    """A sensor cut off for half of its rows changed 4 times as fast as its noise: of its right name nothing was taken off.

    That left 1.10 times the noise, and what multiplies and goes with two variables was looked for, for 400 s.
    """
    asked, own = [], SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None))
    contest = weighed(told=lambda rival, noise, *last: asked.append(noise))
    contest.problem, contest.inserts, contest.noise = own, (), {"x": 4.0}
    contest.arranged = SimpleNamespace(noise=lambda noise, misfit: {"x": min(noise["x"], float(misfit[0]))})
    monkeypatch.setattr(Contest, "played", property(lambda self: own.played))
    contest._retold(rival(left=(1.0, 1.0)))
    assert asked == [{"x": 1.0}]


def test_of_what_steps_still_miss_a_curve_that_makes_up_for_it_is_no_answer(monkeypatch):
    """A limit of a house left 1.25 times its noise in the finest steps, and 1.0 where nothing was missed; a curve 1.1 and 1.0."""
    asked = []
    sizes = lambda work, vanishing: {"x": {"curve": 1.1, "limit": 1.25}[work.name] if not vanishing else 1.0 + work.beyond}

    def fit(work, values, fixed, vanishing=False):
        asked.append((work.name, vanishing))
        return Whole(None, None, {}, None, sizes(work, vanishing), {})

    monkeypatch.setattr(asked_module, "fitted", fit)
    monkeypatch.setattr(asked_module, "missed", lambda work, whole: {"x": 0.3})
    models = lambda step, beyond: [
        (
            SimpleNamespace(name=name, step=step, finest=0.125, beyond=more),
            Whole(SimpleNamespace(fixed={}), None, {}, None, {"x": left}, {}),
        )
        for name, left, more in (("curve", 1.1, 0.0), ("limit", 1.25, beyond))
    ]
    assert not beyond_steps(*models(0.125, 0.01)) and asked == [("curve", True), ("limit", True)]
    assert beyond_steps(*models(0.125, 0.2))
    assert beyond_steps(*models(0.25, 0.01)) and len(asked) == 4  # finer ones were not asked for


@pytest.mark.parametrize(("missed", "fits"), [({"x": 0.3}, 0), ({"x": 9.0}, 2), (None, 2)])
def test_what_steps_miss_is_asked_only_where_it_could_be_all_that_a_curve_leaves_less(monkeypatch, missed, fits):
    """A curve left a house's wall 1.3 times its noise and a limit 18 times: both were fitted once more in steps that vanish."""
    asked, left = [], {"curve": 1.3, "limit": 18.0}
    whole = lambda name: Whole(SimpleNamespace(fixed={}), None, {}, None, {"x": left[name]}, {})
    monkeypatch.setattr(asked_module, "fitted", lambda work, *_, vanishing: asked.append(work.name) or whole(work.name))
    monkeypatch.setattr(asked_module, "missed", lambda work, whole: missed)
    model = lambda name: (SimpleNamespace(name=name, step=0.125, finest=0.125), whole(name))
    assert beyond_steps(model("curve"), model("limit")) and len(asked) == fits


@pytest.mark.parametrize(("left", "first"), [(1.0, "limit"), (1.5, "overflow")])
def test_what_is_believed_stands_beside_what_steps_miss_where_it_leaves_no_more_than_noise(monkeypatch, rng, left, first):
    """Beside a house's limit, which left 1.02 times the noise, its overflow, fitted anew, left 3 % less: all was looked for anew."""
    limit, overflow = cause("limit", 1.0, loss=0.2), cause("overflow", 1.0, loss=0.9)
    overflow.guess = replace(overflow.guess, numbers=overflow.guess.numbers * 2)
    better = {"limit": 0.2, "overflow": 0.17}

    def anew(self, guess, start, *_):
        made = cause(guess.label, 1.0, loss=better[guess.label])
        candidate = Candidate(guess.hypothesis, guess.free, None, np.full((4, 1), better[guess.label]))
        end = SimpleNamespace(loss=better[guess.label], misfit=np.full(2, left) + 0.01 * rng.random(2))
        return SimpleNamespace(guess=guess, candidate=candidate, values=made.values, end=end, rough=False)

    monkeypatch.setattr(Contest, "_fit_anew", anew)
    monkeypatch.setattr(Contest, "played", property(lambda self: SimpleNamespace(extend=lambda inserts: None)))
    monkeypatch.setattr(Contest, "_far", lambda self, guess: (False, False))
    contest = weighed()
    contest.inserts, contest.looks, contest.values = (), SimpleNamespace(), {}
    base = Candidate(None, (), None, np.full((4, 1), 9.0))
    outcome = Round(base, [limit, overflow], limit, [limit, overflow])
    told = lambda rival, noise, *last: None if last else SimpleNamespace(loss=lambda misfit: 1.0)
    assert contest.stands(outcome, told, contest.problem) == (first == "limit")


@pytest.mark.parametrize(("left", "begun"), [((1.0,), [2.0]), ((2.0, 1.0), [2.0, 3.0]), ((2.0, 2.0), [2.0, 3.0])])
def test_beside_what_had_other_steps_taken_all_begins_with_that(monkeypatch, left, begun):
    """A lag of a house's command was found in finer steps, and looked for anew in the rig's own behind all that looked better.

    A limit that fits in finer steps may swing in the rig's own: it is begun where it was found in these as well.
    """
    values = {"T": 2.0}, {"T": 3.0}
    contest, fitted = weighed(before=(SimpleNamespace(label="lag", kind=LAW, count=1, law="lag"), values)), []
    leaves = lambda: left[len(fitted) - 1]
    fit = lambda self, guess, start: fitted.append(start) or rival(1, left=(leaves(), leaves()))
    monkeypatch.setattr(Contest, "fit", fit)
    monkeypatch.setattr(Contest, "_afresh", lambda self, laws: [])
    monkeypatch.setattr(Contest, "_fits", lambda self, stage: [])
    contest.values, contest.looks = (
        {"T": 0.0, "rate": 1.0},
        SimpleNamespace(ways=[], first=lambda: None, further=lambda: None, pairs=lambda: None),
    )
    contest._stages(outcome := Round(None, []))
    assert fitted == [{"T": T, "rate": 1.0} for T in begun] and len(outcome.fitted) == 1
    assert contest.numbers == (1 if left[-1] == 1.0 else np.inf)


def test_a_second_law_beside_a_part_of_a_curve_has_one_look(monkeypatch):
    """Rates, pairs, and curves at that place: they leave what the first round's curve did, and no name comes of them."""
    contest, looked = weighed(only=("here", "x")), []
    monkeypatch.setattr(Contest, "_afresh", lambda self, laws: [])
    monkeypatch.setattr(Contest, "_fits", lambda self, stage: looked.append(stage) or [rival(1, left=(3.0, 3.0))])
    more = lambda: looked.append("more")
    contest.looks = SimpleNamespace(ways=[], first=lambda: None, further=more, pairs=more)
    contest._stages(outcome := Round(None, []))
    assert looked == [0] and len(outcome.fitted) == 1


def test_where_and_of_what_something_is_missing_is_known_in_all_later_rounds(monkeypatch):
    """Beside a second law the first was needed no more, and for a third all was looked at once again: 55 s of a ripple's 121."""
    contest = weighed(only=("here", "x"))
    contest.problem.values = lambda places: {}
    contest.arranged = SimpleNamespace(begins=lambda *_: set(), errors=lambda misfit: misfit, names=[])
    base = SimpleNamespace(misfit=np.ones(2), jacobian=np.ones((2, 0)), places=np.zeros(0))
    monkeypatch.setattr(Contest, "played", property(lambda self: SimpleNamespace(inserts=())))
    monkeypatch.setattr(Contest, "_held_out", lambda *_: np.ones(2))
    monkeypatch.setattr(Contest, "_candidate", lambda *_: SimpleNamespace(losses=np.ones((4, 1))))
    monkeypatch.setattr(contest_module, "in_units", lambda *_: base)
    monkeypatch.setattr(contest_module, "over_noise", lambda *_: ({"x": 1.0}, {"x": 1.0}))
    assert contest.play(None).only == ("here", "x")


@pytest.mark.parametrize(("law", "place", "low"), [("overflow", 0.3, False), ("overflow", 0.05, True), ("limit", 0.05, False)])
def test_an_overflow_whose_limit_is_not_told_from_the_lowest_value_is_none(law, place, low):
    """Two laws in proportion, at a motor's voltage and its converter's, made up a loss that goes with the square of its current."""
    numbers = [SimpleNamespace(name=f"c{end}") for end in (".a", ".l", "_on.a")]
    fitted = SimpleNamespace(covariance=lambda rows, blocks: np.diag([1e-4, 0.03**2, 1e-4]))
    rival = SimpleNamespace(
        guess=SimpleNamespace(law=law, numbers=numbers), problem=SimpleNamespace(free=numbers), block=np.zeros(9),
        end=SimpleNamespace(places=np.array([0.6, place, 0.4])), candidate=SimpleNamespace(fitted=fitted),
    )  # fmt: skip
    assert begins_low(rival) is low
