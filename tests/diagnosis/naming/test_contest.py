"""What of a contest can be asked without a contest: what its base tells, and what goes before an event."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rivals import ARRANGED, a_law, asked, cause, looks

from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.naming import asked as asked_module
from selflock.diagnosis.naming import contest as contest_module
from selflock.diagnosis.naming import near, run
from selflock.diagnosis.naming import order as order_module
from selflock.diagnosis.naming.arranged import Arranged, determined
from selflock.diagnosis.naming.asked import confirmed
from selflock.diagnosis.naming.bent import bent
from selflock.diagnosis.naming.chosen import fewest_first
from selflock.diagnosis.naming.contest import Contest
from selflock.diagnosis.naming.guesses import CURVE, DERIVED, EVENT, FAR, LAW, PARAMETER, PATH, Guess
from selflock.diagnosis.naming.order import nearest
from selflock.diagnosis.naming.places import IN, Insert, Place
from selflock.diagnosis.naming.relatives import relatives
from selflock.diagnosis.naming.round import Round
from selflock.diagnosis.naming.run import Search, _needed
from selflock.diagnosis.naming.whole import Whole
from selflock.diagnosis.naming.work import Work
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.hypotheses import Free
from selflock.diagnosis.search.linear import Linear
from selflock.diagnosis.search.screen import Direction

BLOCKS, SAMPLES = 35, 29


def test_numbers_that_make_up_for_each_other_are_no_step_without_end_on_unseen_blocks(rng):
    """Two gains in a row: only their product is told. No step of a base may lose more than chance can: a share of the errors."""
    slopes = rng.standard_normal((BLOCKS * SAMPLES, 3))
    slopes[:, 2] = -0.7 * slopes[:, 0] * (1.0 + 1e-7 * rng.standard_normal(len(slopes)))
    errors, ones = rng.standard_normal((BLOCKS, SAMPLES)), np.ones(BLOCKS * SAMPLES)
    columns = determined(slopes, ones)
    assert columns.shape == (BLOCKS * SAMPLES, 2)
    assert columns.T @ columns == pytest.approx(np.eye(2), abs=1e-9)  # each moves the misfit as much
    assert np.linalg.lstsq(columns, slopes[:, :2], rcond=None)[1] == pytest.approx(0.0, abs=1e-9)  # nothing told is lost
    linear = Linear(columns.reshape(BLOCKS, SAMPLES, 2), np.ones((BLOCKS, SAMPLES)), np.arange(BLOCKS) % 5)
    assert abs(linear.draws(errors).without[0]) < 0.2 * (errors**2).sum()


@pytest.mark.parametrize("makes_up", [True, False])
def test_beside_an_amplitude_at_the_end_of_its_range_the_base_is_fitted_again(rng, makes_up):
    """A curve over the position, nearly a stiffness, which is free: the base made up for a height that it may not have.

    Its gain was -1e6, and it was never fitted. It can take off a hundredth of what is missing, and no look may see it lose.
    """
    base, missing = rng.standard_normal((2, BLOCKS, SAMPLES, 1))
    ones = np.ones((BLOCKS, SAMPLES))
    linear = Linear(base, ones, np.arange(BLOCKS) % 5, makes_up=makes_up)
    way = Direction(None, {}, (Free("c", 0.0, -10.0, 10.0),), base + 1e-3 * missing)
    errors = missing[..., 0] + 0.01 * rng.standard_normal((BLOCKS, SAMPLES))
    linear.look(way, linear.draws(errors))
    assert (0.0 < way.gain < 0.05 * (errors**2).sum()) == makes_up
    assert (way.gain < -10.0 * (errors**2).sum()) != makes_up


def test_where_a_run_begins_says_nothing_of_what_goes_on(rng):
    """An offset of a set-point moves where a run must have begun, which its first block alone tells: the look saw a loss in it.

    What that block has for itself is fitted in it again, so that it makes no difference how far off it was.
    """
    base, column, begin = rng.standard_normal((3, BLOCKS, SAMPLES, 1))
    begin[1:] = 0.0
    errors = column[..., 0] + 0.1 * rng.standard_normal((BLOCKS, SAMPLES))
    gains = []
    for off in (0.0, 20.0):
        way = Direction(None, {}, (Free("c", 0.0, -10.0, 10.0),), column - off * begin)
        linear = Linear(base, np.ones((BLOCKS, SAMPLES)), np.arange(BLOCKS) % 5, makes_up=True, own=begin)
        linear.look(way, linear.draws(errors))
        gains.append(way.gain)
        assert way.amounts[0] == pytest.approx(-1.0, abs=0.05)
    assert gains[1] == pytest.approx(gains[0], rel=1e-3) and gains[0] > 0.9 * (errors**2).sum()
    linear = Linear(base, np.ones((BLOCKS, SAMPLES)), np.arange(BLOCKS) % 5, makes_up=True)
    linear.look(way, linear.draws(errors))
    assert way.gain < 0.8 * gains[0]


def test_where_nothing_is_free_nothing_is_determined():
    assert determined(np.zeros((9, 0)), np.ones(9)).shape == (9, 0)
    assert determined(np.zeros((9, 2)), np.ones(9)).shape == (9, 0)  # as of start values, which a block alone tells


@pytest.mark.parametrize(("left_by_law", "first"), [(0.95, False), (0.3, True)])
def test_before_an_event_goes_what_leaves_less_of_other_runs_than_the_event_does(left_by_law, first):
    """A lid that was open: beside the event the base is right in other runs, and a law that half makes up for it is not."""
    rival = lambda kind, mean: SimpleNamespace(
        guess=SimpleNamespace(kind=kind), candidate=SimpleNamespace(errors=np.full(4, mean)), values={}
    )
    event, law, far = rival(EVENT, 0.1), rival(LAW, 0.4), rival(LAW, 0.8)
    left = {id(event): 0.5, id(law): left_by_law, id(far): 0.0}
    outcome = SimpleNamespace(order=[event, law, far], base=SimpleNamespace(errors=np.ones(4)))
    whole = lambda one: Whole(None, None, {}, None, {"x": left[id(one)]}, {})
    assert confirmed(outcome, SimpleNamespace(judges={1}), whole) == ([law] if first else [])
    assert confirmed(outcome, SimpleNamespace(judges=set()), whole) == []  # nothing judges


def test_the_laws_that_the_best_curve_may_be_are_fitted_also_where_others_look_better(monkeypatch):
    """Of what multiplies, too: a curve over the right variable stood first, and a law of another one was named."""

    def way(kind, law, over, place, gain):
        insert = Insert("c", Place(IN, place), law, True, over)
        guess = Guess(kind, law, f"{law} of {over} times {place}", (insert,), ())
        return Direction(guess.hypothesis, {}, (), np.zeros((1, 1, 0)), gain), guess

    ways = [way(CURVE, "table", "air", "heater.command", 100.0), way(LAW, "limit", "air", "heater.command", 50.0)]
    ways += [way(LAW, name, "body", f"{name}.u", 90.0) for name in ("limit", "cubic", "power")]
    asked = []
    contest = Contest(SimpleNamespace(loss=lambda misfit: 1.0), np.zeros(0), "c", lambda what, share: None)
    contest.scene = SimpleNamespace(parts=SimpleNamespace(links={}))
    contest.looks = SimpleNamespace(ways=ways, gains=dict, scene=contest.scene)
    contest.values, contest.base, contest.most = {}, SimpleNamespace(misfit=None), 0.0
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start, way=None: asked.append(guess.label))
    assert contest._fits(DERIVED) == []
    assert "limit of air times heater.command" in asked and len(asked) == len(ways)


@pytest.mark.parametrize(("without_first", "beyond", "stays"), [(1.02, True, False), (1.5, True, True), (1.5, False, False)])
def test_what_a_later_cause_makes_unnecessary_goes(monkeypatch, without_first, beyond, stays):
    """An offset was named that stood for part of a leak, and the leak second, beside which it does nothing."""
    first, second = cause("first", 1.0), cause("second", 1.0)
    played = SimpleNamespace(extend=lambda inserts: None)
    work = Work(None, None, [], (), {1}, [], "", None, played, 1.0)
    both = replace(
        work,
        inserts=(*first.guess.inserts, *second.guess.inserts),
        found=[first.guess.numbers, second.guess.numbers],
    )
    left = {("first", "second"): 1.0, ("second",): without_first}
    whole = lambda work, *_: Whole(None, None, {}, None, {"x": left[tuple(one.name for one in work.inserts)]}, {})
    monkeypatch.setattr(run, "fitted", whole)
    monkeypatch.setattr(asked_module, "beyond_steps", lambda *_: beyond)  # what steps miss
    monkeypatch.setattr(run, "without", lambda near, numbers, inserts: SimpleNamespace(numbers=tuple(numbers), free=numbers))
    monkeypatch.setattr(run, "fit_from", lambda near, places, *_: SimpleNamespace(places=places))
    rounds = [Round(None, [], winner) for winner in (first, second)]
    search = Search(both, None, None, whole(both), rounds, [], work, lambda: False)
    heads = SimpleNamespace(fixed={}, numbers=(*first.guess.numbers, *second.guess.numbers), free=())
    heads, places = _needed(search, heads, np.zeros(2))
    assert [outcome.winner for outcome in search.named] == ([first, second] if stays else [second])
    assert [one.name for one in search.work.inserts] == (["first", "second"] if stays else ["second"])
    assert [n.name for n in heads.numbers] == (["first.a", "second.a"] if stays else ["second.a"])
    assert len(places) == len(search.work.found) == 1 + stays


def test_where_a_laws_own_state_begins_is_another_number_in_each_run_and_none_of_the_law():
    """One that began elsewhere than the law took it to, in a log that begins in motion, was named as one of another variable."""
    numbers = [Number(f"c.{word}", f"c.{word}", 1.0, 0.0, 2.0) for word in ("a", "T")]
    numbers += [Number("c.d of two", "c.d", 0.0, -1.0, 1.0, run=0), Number("c.d of three", "c.d", 0.0, -1.0, 1.0, run=1)]
    insert = Insert("c", Place(IN, "body.u"), "first order", over="body.x")
    guess = Guess(LAW, "first order", "first order of body.x on body.u", (insert,), tuple(numbers))
    runs = [SimpleNamespace(log=name, name="") for name in ("one", "two", "three")]
    wider = Work(None, None, runs, (), {0}, [], "", None, None, 1.0).with_also(guess)
    (found,) = wider.found
    assert [(n.name, n.run) for n in found] == [
        ("c.a", None), ("c.T", None), ("c.d of two", 1), ("c.d of three", 2), ("c.d of one", 0)
    ]  # fmt: skip
    assert guess.count == 2 and wider.but_for(guess).found == []


def test_of_what_does_as_well_a_law_of_its_own_fmu_comes_first():
    """A loss of a chamber over its own temperature was named as one of the heater before it, which does not know of that."""
    contest = Contest(None, np.zeros(0), "c", lambda what, share: None)
    owner = lambda name: name.partition(".")[0]
    contest.scene = SimpleNamespace(parts=SimpleNamespace(owner=owner, variables={"first.u", "first.x", "second.x"}))
    there, here = cause("there", 1.0, over="second.x", loss=0.1), cause("here", 1.0, loss=0.1005)
    log, far = cause("log", 1.0, over="a column", loss=0.1004), cause("far", 1.0, loss=0.5)
    assert order_module.ordered([there, log, here, far], 0.0, 1.0, contest._far) == [here, there, log, far]


def test_of_what_does_as_well_a_law_before_a_state_comes_before_one_of_what_only_computes():
    """A drag of an oscillator was named at its controller's input: the controller makes a force of it by a factor."""
    contest = Contest(None, np.zeros(0), "c", lambda what, share: None, sampled=frozenset({"controller"}))
    owner = lambda name: name.partition(".")[0]
    known = {name: SimpleNamespace(causality="input") for name in ("first.u", "first.x", "controller.x")}
    contest.scene = SimpleNamespace(parts=SimpleNamespace(owner=owner, variables=known))
    computed, moved = cause("computed", 1.0, "controller.u", "controller.x", 0.1), cause("moved", 1.0, loss=0.1005)
    far = cause("far", 1.0, loss=0.5)
    assert order_module.ordered([computed, moved, far], 0.0, 1.0, contest._far) == [moved, computed, far]
    assert nearest([computed, moved], 0.0, contest._far, contest.scene.parts) is moved


def test_stribeck_is_fitted_from_the_coulomb_law_that_fits():
    """Its own look is of few points, and its fit ended where it left twice as much as the truth: a dead band was named."""
    w, a = Number("c.w", "c.w", 0.1, 0.01, 5.0), Number("c.a", "c.a", 0.0, -3.0, 3.0)
    coulomb = Guess(LAW, "Coulomb", "", (Insert("c", Place(IN, "coil.u"), "Coulomb", over="coil.i"),), (a, w))
    made = list(relatives(coulomb, {"c.a": -0.2, "c.w": 0.08, "base": 7.0}))
    for guess, at in made:
        assert guess.label == "Stribeck of coil.i on coil.u" and {n.name for n in guess.numbers} == {"c.a", "c.b", "c.v", "c.w"}
        assert at["c.a"] == -0.2 and at["c.w"] == 0.08 and at["c.b"] == 0.0 and at["base"] == 7.0 and at["c.v"] > 0.08
    begun = [0.08, *(at["c.v"] for _, at in made)]  # whose width, where it turns round in a step, says little of the other
    assert all(1.0 < b / a < 3.2 for a, b in zip(begun, begun[1:])) and begun[-1] == 5.0
    assert list(relatives(replace(coulomb, law="cubic"), {})) == []


@pytest.mark.parametrize(("name", "end", "other"), [("limit", "high", ("low", -FAR)), ("limit below", "low", ("high", FAR))])
def test_a_limit_of_a_signal_itself_is_asked_as_the_saturation_that_it_may_be(name, end, other):
    """It leaves the same with a number more, and a look sees it where it does not see a saturation."""
    a, l = Number("c.a", "c.a", 0.0, -3.0, 3.0), Number("c.l", "c.l", 0.2, -1.0, 2.0)
    insert = Insert("c", Place(IN, "element.u"), name, over="element.u")
    ((made, at),) = relatives(Guess(LAW, name, "", (insert,), (a, l)), {"c.a": -0.98, "c.l": 0.7, "base": 7.0})
    assert (made.kind, made.law, made.count) == (PATH, f"saturation ({end})", 1) and at == {f"c.{end}": 0.7, "base": 7.0}
    assert made.inserts[0].fixed == (other,) and (made.numbers[0].low, made.numbers[0].high) == (-1.0, 2.0)
    for elsewhere in (replace(insert, over="wall.x"), replace(insert, multiplies=True), replace(insert, taken=1)):
        assert not list(relatives(Guess(LAW, name, "", (elsewhere,), (a, l)), {"c.a": -0.98, "c.l": 0.7}))


@pytest.mark.parametrize(("seen", "place"), [(-3.0, 0.0), (1e9, 1.0), (0.1, 0.5)])
def test_a_fit_starts_within_the_range_of_a_number_by_decades_whatever_the_look_says(monkeypatch, seen, place):
    """A linear look knows no ends of ranges: below one of decades there is no place, and the naming ended."""
    slow = Number("c.T", "c.T", 0.1, 1e-3, 10.0)
    assert slow.by_decades
    guess = Guess(LAW, "first order", "", (Insert("c", Place(IN, "body.u"), "first order", over="body.x"),), (slow,))
    places = []
    problem = SimpleNamespace(free=(slow,), misfit=places.append, loss=lambda misfit: 1.0)
    contest = Contest(problem, np.zeros(0), "c", lambda what, share: None)
    contest.looks = SimpleNamespace(trial=lambda guess: problem)
    contest.values, contest.base = {}, SimpleNamespace(misfit=None)
    monkeypatch.setattr(contest_module, "fit_from", lambda *_: SimpleNamespace(misfit=None, loss=np.inf))
    assert contest.fit(guess, {"c.T": seen}) is None
    assert places[0] == pytest.approx([place], abs=1e-9)


def test_where_the_look_errs_laws_of_one_number_are_simulated_before_they_are_taken_for_something_else():
    """A leak of the upper tank was not told beside the lower one's gain: what the look has errs by more than is left beside the base."""
    first = Guess(PARAMETER, "parameter", "lower.gain", (), (Number("lower.gain", "lower.gain", 1.0, 0.5, 2.0),))
    leak, loss = (a_law(name, "upper.u", "upper.x", 1) for name in ("square root", "cubic"))
    more, curve = a_law("power", "upper.u", "upper.x", 2), a_law("table", "upper.u", "upper.x", 1, CURVE)
    look = looks([(9.0, first), (-1.0, leak), (1.0, loss), (1.0, more), (1.0, curve)])
    (seen, _), *others = look.ways
    assert asked([first], first, look) == []
    as_it_is = {id(way): Direction(None, {}, (), np.zeros((1, 1, 0)), gain=5.0) for way, _ in others}
    for (way, guess), unit in zip(others, np.eye(5)[1:]):
        look.of[id(as_it_is[id(way)])] = unit if guess is loss else -look.of[id(seen)]
    look.simulated = lambda way, guess: as_it_is.get(id(way))
    assert asked([first], first, look) == ["square root of upper.x on upper.u"]
    look.of[id(as_it_is[id(others[0][0])])] = 0.1 * np.ones(5)
    assert asked([first], first, look) == []


@pytest.mark.parametrize(("loss", "unseen", "again"), [(2.0, 0.5, True), (0.9, 0.5, False), (2.0, 0.9, False)])
def test_a_fit_that_ended_beyond_its_start_is_made_again_where_unseen_blocks_say_that_there_is_one(
    monkeypatch, loss, unseen, again
):
    """The scale of a tank's inflow ended at twice the base's loss by slopes that the look had, and was not told beside its gain."""
    rival = lambda name, loss, errors: SimpleNamespace(
        guess=cause(name, 1.0).guess, end=SimpleNamespace(loss=loss), candidate=SimpleNamespace(errors=np.full(4, errors)),
        rough=True, values={},
    )  # fmt: skip
    found = [*(rival(f"best {k}", 0.4, 0.4) for k in range(12)), rival("lost", loss, unseen)]
    contest = Contest(SimpleNamespace(loss=lambda misfit: 1.0), np.zeros(0), "c", lambda what, share: None)
    contest.scene = SimpleNamespace(parts=SimpleNamespace(owner=lambda name: name.partition(".")[0], variables={}))
    contest.looks, contest.base = SimpleNamespace(gains=dict), SimpleNamespace(misfit=None)
    contest.losses, contest.most, asked = np.ones((4, 1)), 0.0, []
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start, way=None: asked.append(guess.label))
    contest._polished(found, 0.5)
    assert ("lost" in asked) == again and "best 0" in asked


def test_each_that_comes_near_the_best_is_judged_beside_what_the_steps_change_of_itself(monkeypatch):
    """A law of a level, which is read in the middle of a step, stood before the gain of what was held for it."""
    best, held, far = (cause(name, 1.0, loss=loss) for name, loss in (("best", 0.1), ("held", 0.11), ("far", 0.5)))
    own, its = (SimpleNamespace(played=name) for name in ("own", "its"))
    own.played, its.played = (SimpleNamespace(extend=lambda inserts: None) for _ in range(2))
    contest = Contest(own, np.zeros(0), "c", lambda what, share: None, told=lambda rival, *_: its if rival is held else None)
    monkeypatch.setattr(Contest, "played", property(lambda self: self.problem.played))
    contest.looks, contest.scene, contest.noise = SimpleNamespace(problem=own), SimpleNamespace(played=own.played), {}
    contest.inserts, contest.arranged = (), ARRANGED
    fitted = []
    anew = cause("held", 1.0, loss=0.09)
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start, begun=None: fitted.append((guess.label, self.problem)) or anew)
    monkeypatch.setattr(contest_module, "distinct", lambda rivals: sorted(rivals, key=lambda r: r.candidate.errors.mean()))
    outcome = Round(SimpleNamespace(errors=np.ones(4)), [best, held, far])
    contest._near_best(outcome)
    assert fitted == [("held", its)] and outcome.fitted == [anew, best, far]
    assert contest.problem is contest.looks.problem is own and contest.scene.played is own.played


@pytest.mark.parametrize(("moves", "fits"), [(1, 1), (2, 2), (9, RULES.naming.retold)])
def test_what_steps_miss_of_a_rival_is_taken_off_anew_for_as_long_as_that_moves_it(monkeypatch, moves, fits):
    """A lag of a house's command left 2.9 times the noise beside what its first fit missed, and 1.06 beside what its third did."""
    own, *others = (SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None), number=k) for k in range(12))
    ends = [cause("lag", 1.0) for _ in range(12)]
    for k, end in enumerate(ends):
        end.values = {"T": float(k)}

    def told(rival, noise, last=own):
        assert rival is ends[last.number] and rival.values == {"T": float(last.number)}
        return others[last.number] if last.number < moves else None

    contest, starts = Contest(own, np.zeros(0), "c", lambda what, share: None, told=told), []
    monkeypatch.setattr(Contest, "played", property(lambda self: self.problem.played))
    contest.looks, contest.scene, contest.noise, contest.inserts = SimpleNamespace(), SimpleNamespace(), {}, ()
    contest.arranged = ARRANGED
    fit = lambda self, guess, start, begun=None: starts.append(start["T"]) or ends[self.problem.number]
    monkeypatch.setattr(Contest, "fit", fit)
    assert contest._retold(ends[0]) is ends[fits] and starts == list(range(fits))
    assert contest._retold(ends[fits]) is ends[fits] and len(starts) == fits and contest.problem is own


def test_beside_another_log_slopes_of_its_own_are_asked_for_where_those_before_lead_nowhere(monkeypatch):
    """A curve in a house left 2.5 times its noise, and 7 beside what steps missed of it: its slopes were those of another place."""
    own, told = (SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None)) for _ in range(2))
    first, lost, right = (cause("curve", 1.0, loss=loss) for loss in (0.1, 0.3, 0.05))
    contest = Contest(own, np.zeros(0), "c", lambda what, share: None, told=lambda rival, noise, *last: None if last else told)
    monkeypatch.setattr(Contest, "played", property(lambda self: self.problem.played))
    contest.looks, contest.scene, contest.noise, contest.inserts = SimpleNamespace(), SimpleNamespace(), {}, ()
    contest.arranged = ARRANGED
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start, begun=None: lost if begun else right)
    assert contest._retold(first) is right


@pytest.mark.parametrize(("told", "wanting"), [(None, True), (2.0, True), (1.0, False)])
def test_nothing_more_is_wanted_where_the_best_leaves_no_more_than_what_the_steps_miss(monkeypatch, told, wanting):
    """A cubic in a house of six FMUs had its rates, integrals and pairs of variables asked for what its steps had left."""
    own = SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None))
    contest = Contest(
        own, np.zeros(0), "c", lambda what, share: None, told=told and (lambda rival, noise, last=None: None if last else own)
    )
    monkeypatch.setattr(Contest, "played", property(lambda self: self.problem.played))
    contest.looks, contest.scene, contest.noise = SimpleNamespace(), SimpleNamespace(), {}
    contest.arranged, contest.base = ARRANGED, SimpleNamespace(misfit=np.ones(1))
    contest.inserts = ()
    ends = lambda left: SimpleNamespace(
        guess=cause("best", 1.0).guess, end=SimpleNamespace(loss=left, misfit=np.array([left])), values={}
    )
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start, begun=None: ends(told))
    contest.noise = {"x": 1.0}
    outcome = Round(None, [ends(1.5)])
    assert contest._wanting(outcome) == wanting


@pytest.mark.parametrize(
    ("loss", "leaves", "asks", "anew"),
    [(0.05, 2.0, True, True), (0.05, 1.0, True, False), (0.3, 2.0, True, False), (0.05, 2.0, False, False)],
)
def test_what_takes_off_most_and_leaves_something_is_asked_for_other_steps_before_all_is_fitted(
    monkeypatch, loss, leaves, asks, anew
):
    """Beside a strong power law finer steps left no less of a house, and all was looked for and fitted before they were asked again."""
    own = SimpleNamespace(loss=lambda misfit: 1.0)
    contest = Contest(own, np.zeros(0), "c", lambda what, share: None, steps=lambda rival: "finer" if asks else None)
    monkeypatch.setattr(Contest, "played", property(lambda self: None))
    contest.arranged, contest.base = ARRANGED, SimpleNamespace(misfit=np.ones(1))
    contest.scene, contest.noise = SimpleNamespace(), {"x": 1.0}
    best = SimpleNamespace(guess=cause("best", 1.0).guess, end=SimpleNamespace(loss=loss, misfit=np.array([leaves])))
    assert contest._elsewhere(best, 0.9) == anew
    assert contest.other == ("finer" if anew else None)
    assert not contest._elsewhere(None, 0.9)


@pytest.mark.parametrize(("left", "fitted"), [(1.0, []), (2.0, ["limit", "overflow"])])
def test_limits_are_fitted_from_all_heights_but_where_fewer_numbers_leave_no_more_than_noise(monkeypatch, left, fitted):
    """Six overflows were fitted from four heights each beside a cubic that left nothing, a seventh of the time."""
    ends = lambda name, count, loss: SimpleNamespace(
        guess=SimpleNamespace(law=name, kind=LAW, count=count), values={}, rough=True, end=SimpleNamespace(loss=loss, misfit=np.array([3.0]))
    )  # fmt: skip
    contest = Contest(SimpleNamespace(loss=lambda misfit: 1.0), np.zeros(0), "c", lambda what, share: None)
    contest.arranged, contest.base = ARRANGED, SimpleNamespace(misfit=np.ones(1))
    contest.noise = {"x": 1.0}
    own = SimpleNamespace(
        guess=SimpleNamespace(law="cubic", kind=LAW, count=1), rough=False, end=SimpleNamespace(loss=0.1, misfit=np.array([left]))
    )
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start: own if guess.count == 1 else None)
    found = [
        ends("cubic", 1, 0.1),
        ends("limit", 2, 0.4),
        ends("power", 2, 0.2),
        ends("overflow", 3, 0.5),
        ends("overflow", 3, 0.99),
    ]
    assert [rival.guess.law for rival in bent(contest, found)] == fitted and found[0] is own


@pytest.mark.parametrize(("left", "asked"), [(1.0, [2, 2]), (2.0, [2, 2, 3, 3])])
def test_of_limits_those_of_fewest_numbers_are_asked_first_and_others_where_they_leave_something(left, asked):
    """Nine overflows of a house's radiator were fitted from four heights each beside a limit that left nothing: no answer after 500 s."""
    rivals, fitted = [SimpleNamespace(guess=SimpleNamespace(count=count)) for count in (3, 2, 3, 2)], []
    fits = lambda rival: fitted.append(rival.guess.count) or [rival]
    found = fewest_first(rivals, fits, lambda one: left > 1.08)
    assert fitted == asked == [one.guess.count for one in found]


@pytest.mark.parametrize(("retold", "stands"), [(0.08, False), (0.3, True)])
def test_a_winner_stands_where_it_is_first_also_on_logs_that_are_told_anew(monkeypatch, retold, stands):
    """All was looked for anew where its cause had other steps taken; what had not come near it, or was refused, stays where it was."""
    losses = (("won", 0.1), ("held", 0.11), ("far", 0.5), ("refused", 0.05))
    won, held, far, refused = (cause(name, 1.0, loss=loss) for name, loss in losses)
    refused.candidate.doubt = "it does not lower the error of what judges"
    own = SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None))
    won.end.loss = held.end.loss = 1.0
    contest = Contest(None, np.zeros(0), "c", lambda what, share: None)
    monkeypatch.setattr(Contest, "played", property(lambda self: self.problem.played))
    contest.looks, contest.scene, contest.noise, contest.inserts = SimpleNamespace(), SimpleNamespace(), {}, ()
    contest.arranged = ARRANGED
    fitted = []
    anew = lambda guess: cause(guess.label, 1.0, loss={"won": 0.12, "held": retold}[guess.label])
    monkeypatch.setattr(
        Contest, "fit", lambda self, guess, start, begun=None: fitted.append((guess.label, self.problem)) or anew(guess)
    )
    monkeypatch.setattr(order_module, "ordered", lambda real, *_: sorted(real, key=lambda r: r.candidate.errors.mean()))
    monkeypatch.setattr(Contest, "more", lambda self, rival: True)  # so that others are fitted as well
    outcome = Round(SimpleNamespace(errors=np.ones(4)), [refused, won, held, far], won, [refused, won, held, far])
    assert contest.stands(outcome, lambda *_: None, own) == stands
    assert fitted == [("won", own), ("held", own)] and contest.problem is own
    assert outcome.winner is won and outcome.fitted == [refused, won, held, far]


def test_a_law_of_a_shape_is_fitted_with_that_which_it_has_where_it_fitted_better():
    """Stribeck of an oscillator's speed ended at twice the loss that it had at its controller's input, which was named."""
    parts = SimpleNamespace(
        links={"controller.x": SimpleNamespace(source="body", output="x")},
        variables={},
        owner=lambda name: name.partition(".")[0],
    )

    def fitted(place, over, loss, width, law="Stribeck"):
        guess = a_law(law, place, over)
        guess = replace(guess, numbers=tuple(Number(f"c.{w}", f"c.{w}", 0.1, -9.0, 9.0) for w in ("a", "b", "w", "v")))
        return SimpleNamespace(
            guess=guess, end=SimpleNamespace(loss=loss), values={"c.a": 1.0, "c.b": 2.0, "c.w": width, "c.v": 5.0}
        )

    far, here = fitted("controller.u", "controller.x", 19.0, 0.3), fitted("body.force", "body.x", 38.0, 0.2)
    look, asked = looks([], parts), []
    look.shaped = lambda *one: asked.append(one) or (one[0] is here.guess and ("way", here.guess)) or None
    others = [
        fitted("body.force", "body.v", 60.0, 0.2),
        fitted("body.u", "body.x", 19.1, 0.2),
        fitted("body.x", "body.x", 50.0, 1.0, "cubic"),
    ]
    assert near.carried([here, far, *others], look) == [("way", here.guess)]
    assert asked == [(here.guess, {"c.w": 0.3, "c.v": 5.0}, ("c.a", "c.b"))]


def test_beside_what_breaks_off_nothing_is_looked_for(monkeypatch):
    """What was found in the rig's steps ran away in finer ones, and the naming ended with an assertion."""
    found = SimpleNamespace(named=[], outcomes=[SimpleNamespace(winner=None)])
    breaks = SimpleNamespace(errors=lambda values: None, values=lambda places: {})
    for name, instead in {
        "_begun": found,
        "in_own_steps": breaks,
        "Contest": None,
        "one_alone": None,
        "curve_instead": None,
        "_number_first": found,
    }.items():
        monkeypatch.setattr(run, name, lambda *_, instead=instead: instead)
    asked = SimpleNamespace(tell=None, kinds=(), enough=lambda: False)
    assert run._rounds(asked, None, SimpleNamespace(numbers=()), np.zeros(0)) is found


def test_noise_is_no_more_than_what_explains_a_base_leaves_from_sample_to_sample(rng):
    """What a house's base lacked changed 3.7 times as fast as its noise: a square root that left 2.4 times of it was taken to leave nothing."""
    noise = 0.01 * rng.standard_normal((2, 2000))
    problem = SimpleNamespace(units={"x": 0.05, "y": 0.02}, played=SimpleNamespace(outputs=["x", "y"], spread=lambda name: 1.0))
    arranged = Arranged.__new__(Arranged)
    arranged.problem, arranged.output = problem, np.repeat([0, 1], 2000)
    misfit = np.concatenate([(noise[0] + 0.05 * np.sin(np.arange(2000) / 100.0)) / 0.05, noise[1] / 0.02])
    found = arranged.quieter({"x": 0.04, "y": 0.005}, misfit)
    assert found == pytest.approx([0.01 / 0.05, 0.005 / 0.02], rel=0.1)
    still = arranged.quieter({"x": 0.04, "y": 0.005}, 0.0 * misfit)
    assert still == pytest.approx([RULES.pipeline.fine / 0.05, RULES.pipeline.fine / 0.02])


def test_what_leaves_noise_alone_leaves_no_more_than_noise(rng):
    """A house's radiator's rate, all that was missing, left 1.10 times a noise that was told by a median: all was looked at thrice more."""
    problem = SimpleNamespace(
        units=dict.fromkeys("xyz", 1.0), played=SimpleNamespace(outputs=["x", "y", "z"], spread=lambda name: 1.0)
    )
    arranged, above = Arranged.__new__(Arranged), []
    arranged.problem, arranged.output = problem, np.repeat([0, 1, 2], 500)
    for _ in range(200):
        misfit = rng.standard_normal(1500)
        left = arranged.deviations(misfit) / arranged.quieter(dict.fromkeys("xyz", 5.0), misfit)
        above.append((left > RULES.search.clean).any())
    assert np.mean(above) < 0.04  # told by a median one in six
