"""Free curves beside each other, and where one is the answer instead of laws that were named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rivals import ARRANGED, a_law, cause, free_curve

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.naming import asked as asked_module
from selflock.diagnosis.naming import instead as instead_module
from selflock.diagnosis.naming import looks as looks_module
from selflock.diagnosis.naming import scene as scene_module
from selflock.diagnosis.naming.bent import bent
from selflock.diagnosis.naming.contest import Contest
from selflock.diagnosis.naming.guesses import EVENT, KINDS, LAW, Trial
from selflock.diagnosis.naming.looks import Looks
from selflock.diagnosis.naming.order import curves_beside, nearest, only_beside
from selflock.diagnosis.naming.places import IN, Place
from selflock.diagnosis.naming.round import Round
from selflock.diagnosis.naming.run import Search
from selflock.diagnosis.naming.scene import Scene
from selflock.diagnosis.naming.whole import Whole
from selflock.diagnosis.naming.work import Work
from selflock.diagnosis.search.candidate import Candidate
from selflock.fmus.correction.law import VALUE


def test_of_curves_over_what_tells_the_same_that_over_a_state_comes_first():
    """A ripple of a tank's level was a curve over its flow, which is computed of that; finer ones differ by where their points lie."""
    known = {
        "a.level": SimpleNamespace(causality="output", initial="exact"),
        "a.flow": SimpleNamespace(causality="output", initial=""),
    }
    parts = SimpleNamespace(variables=known, owner=lambda name: "a")
    flow, level = free_curve("a.u", "a.flow", 0.1), free_curve("a.u", "a.level", 0.1005, points=6)
    assert nearest([flow, level], 0.0, lambda guess: (False, False), parts) is level
    assert curves_beside(level, [flow, level], 0.0, 1.0) == [flow]


def test_a_curve_that_does_as_well_elsewhere_stands_beside_it_and_not_a_finer_one_of_its_own():
    """Steps over a coil's current were answered by a curve at the other of its two voltages, and the right one was not told."""
    first, other, finer = free_curve("first.u"), free_curve("first.back", points=6), free_curve("first.u", points=4)
    again, worse, over = (
        free_curve("first.back", points=3, loss=0.101),
        free_curve("first.w", loss=0.3),
        free_curve("first.u", "t"),
    )
    assert curves_beside(first, [first, other, finer, again, worse, over, cause("law", 1.0)], 0.0, 1.0) == [other, over]
    other.candidate.doubt = "chance finds as much"
    assert curves_beside(first, [first, other], 0.0, 1.0) == []


@pytest.mark.parametrize(
    ("second", "left_by_curve", "instead"),
    [
        ("limit", 1.2, True),
        ("limit", 1.99, False),
        ("Coulomb", 1.2, False),
        ("Coulomb", 0.9, True),
        (None, 1.02, False),
        ("cubic", 1.2, True),
        ("cubic", 1.99, False),
        ("Dahl", 1.2, False),
        ("elsewhere", 1.2, False),
        ("of another", 1.2, False),
    ],
)
def test_a_law_that_must_be_there_twice_is_none_where_a_curve_leaves_less_than_it_does_once(
    monkeypatch, second, left_by_curve, instead
):
    """A bump over a level was `explained`, by two limits of that level at one place, or by a limit and a cubic that takes it off."""
    named, amounts = [], {"limit": 2.0, "cubic": -1.0, "Coulomb": 1.0}
    for law in ("limit", second) if second else ("limit",):
        rival = cause(law, 1.0)
        known = law if law in amounts or law == "Dahl" else "cubic"
        place = Place(IN, "first.w") if law == "elsewhere" else rival.guess.place
        over = "first.y" if law == "of another" else "first.x"
        one = replace(rival.guess.inserts[0], name=law, law=known, place=place, over=over)
        rival.guess = replace(rival.guess, law=known, inserts=(one,))
        named.append(rival)
    curve = free_curve("first.u")
    curve.problem = SimpleNamespace(fixed={})
    whole = lambda left: Whole(None, None, {}, None, {"x": left}, {})
    of_law = lambda work: work.inserts[0].law != "table"
    x = np.linspace(0.0, 2.0, 50)
    series = {"time": [x], "first.x": [x], "first.y": [np.sin(9.0 * x)]}
    played = SimpleNamespace(extend=lambda inserts: None, series=lambda settings, which: series)
    values = {f"{law}.a": amount for law, amount in amounts.items()} | {"Coulomb.w": 0.1, "limit.l": 1.0, "of another.a": -1.0}
    monkeypatch.setattr(instead_module, "beyond_steps", lambda *_: True)
    monkeypatch.setattr(instead_module, "fitted", lambda work, *_: whole(2.0 if of_law(work) else left_by_curve))
    work = Work(None, None, [], (), {1}, [], "", None, played, 1.0)
    monkeypatch.setattr(Work, "which", [0])
    base = Candidate(curve.guess.hypothesis, (), None, np.ones((4, 1)))
    rounds = [Round(base, [curve, rival], rival, curve=curve) for rival in named]
    best = replace(whole(1.0), problem=SimpleNamespace(settings=lambda values: [values]), values=values)
    found = Search(work, None, whole(9.0), best, rounds, [], work, lambda: False)
    instead_module.curve_instead(found)
    assert [outcome.winner for outcome in found.named] == ([curve] if instead else named)
    assert found.best.held == {"x": left_by_curve if instead else 1.0}


@pytest.mark.parametrize(
    ("left", "blocks", "beyond", "named"),
    [(1.02, 0.1, True, True), (1.2, 0.1, True, False), (1.02, 0.2, True, False), (1.2, 0.1, False, True)],
)
def test_a_law_of_more_numbers_that_does_as_well_as_the_curve_is_its_name(monkeypatch, left, blocks, beyond, named):
    """Stribeck was `unknown`: Coulomb went before it, of fewer numbers and no worse on unseen blocks, and the curve left less than that."""
    first, name, elsewhere = cause("Coulomb", 1.0), cause("Stribeck", 1.0, loss=blocks), cause("far", 1.0, "first.w")
    curve = free_curve("first.u")
    curve.problem = SimpleNamespace(fixed={})
    whole = lambda of: Whole(None, None, {}, None, {"x": {"Coulomb": 2.0, "Stribeck": left, "far": 0.5, "curve": 1.0}[of]}, {})
    monkeypatch.setattr(instead_module, "beyond_steps", lambda *_: True)
    monkeypatch.setattr(asked_module, "beyond_steps", lambda *_: beyond)  # what its name leaves more
    monkeypatch.setattr(instead_module, "fitted", lambda work, *_: whole(work.inserts[0].name))
    work = Work(None, None, [], (), {1}, [], "", None, None, 1.0)
    base = Candidate(curve.guess.hypothesis, (), None, np.ones((4, 1)))
    round_of = Round(base, [curve, first], first, order=[first, name, elsewhere], curve=curve)
    found = Search(work, None, whole("Coulomb"), whole("Coulomb"), [round_of], [], work, lambda: False)
    instead_module.curve_instead(found)
    assert [outcome.winner for outcome in found.named] == [name if named else curve]
    assert found.best.held == whole("Stribeck" if named else "curve").held
    assert found.work.inserts == (name if named else curve).guess.inserts


def judging(left):
    """A contest in which a curve leaves so many times the noise, and what it fitted: a limit and an overflow that take much."""
    contest = Contest(SimpleNamespace(loss=lambda misfit: 1.0), np.zeros(0), "c", lambda what, share: None)
    contest.arranged, contest.base = ARRANGED, SimpleNamespace(misfit=np.ones(1))
    contest.noise = {"x": 1.0}
    made = lambda rival, loss, times: SimpleNamespace(
        guess=rival.guess, values={}, rough=True, end=SimpleNamespace(loss=loss, misfit=np.array([times]))
    )
    limit, overflow = (made(cause(name, 1.0), 0.3, 2.0) for name in ("limit", "overflow"))
    for rival in (limit, overflow):
        rival.guess = replace(rival.guess, law=rival.guess.label)
    return contest, [limit, overflow, made(free_curve("first.u"), 0.1, left)]


@pytest.mark.parametrize(("left", "more"), [(1.1, False), (1.3, True)])
def test_where_a_curve_leaves_nothing_nothing_else_is_asked_for(left, more):
    """A bump in a house of six FMUs was looked for among rates, pairs, and a surplus that goes on to five others, for minutes."""
    contest, found = judging(left)
    assert contest._wanting(Round(None, found)) == more
    assert [rival.guess.law for rival in bent(contest, found)] == (["limit", "overflow"] if more else ["limit"])


def test_beside_a_first_cause_only_laws_of_such_a_curves_variable_at_its_place_are_looked_at(monkeypatch, rng):
    """A bump over a house's wall: beside a limit of it frictions of a thermometer and events were fitted for 77 s; it is a curve."""
    place, time = Place(IN, "tank.u"), np.arange(100.0)
    level = 1.0 + rng.random(100)
    series = {
        "time": [time],
        "tank.level": [level],
        "tank.flow": [level**0.5],
        "tank.u": [rng.random(100)],
        "far": [rng.random(100)],
    }
    known = {n: SimpleNamespace(causality="output" if n != "tank.u" else "input", type="Real") for n in series if n != "time"}
    parts = SimpleNamespace(variables=known, links={}, owner=lambda name: name.partition(".")[0])
    monkeypatch.setattr(
        scene_module, "quantities", lambda parts, component, names: (["tank.level", "tank.flow", "tank.u"], ["far"])
    )
    of = lambda only: Scene(parts, None, series, "c", only=only)
    assert of((place, "tank.flow")).places == [place]
    assert list(of((place, "tank.flow")).variables(place)) == [("tank.level", VALUE)]  # which tells the flow
    assert list(of((place, "far")).variables(place)) == [("far", VALUE)]
    assert len(list(of(None).variables(place))) > 3
    monkeypatch.setattr(Looks, "_overs", lambda self, place: [])
    monkeypatch.setattr(looks_module, "Responses", lambda *_: None)
    base = SimpleNamespace(misfit=np.zeros(1))
    still = SimpleNamespace(places=[place], spread=lambda place: 1.0, only=(place, "far"))
    linear, put = SimpleNamespace(draws=lambda misfit: None), SimpleNamespace(put=lambda misfit: misfit)
    asked = []
    monkeypatch.setattr(Looks, "_curve", lambda *_: None)
    monkeypatch.setattr(Looks, "_column", lambda self, trial, whole=True: asked.append(trial))
    monkeypatch.setattr(looks_module.g, "sines", lambda *_: ["sine"])
    monkeypatch.setattr(looks_module.g, "with_state", lambda *_: ["Dahl"])
    looks = Looks(None, base, {}, put, linear, still, (), set(), list(KINDS), lambda *_: None)
    assert looks.kinds == [LAW]  # no path, parameter or event
    looks._laws(place, "far", VALUE, False)
    assert asked == ["sine"]  # of what remembers no curve leaves as little


@pytest.mark.parametrize(("finer", "curves"), [(True, 2), (False, 1)])
def test_what_a_curve_leaves_is_asked_of_it_fitted_on_its_own_and_with_all_its_points(monkeypatch, finer, curves):
    contest, found = judging(1.3)
    anew = lambda left: SimpleNamespace(
        guess=found[-1].guess, values={}, rough=False, end=SimpleNamespace(loss=0.1, misfit=np.array([left]))
    )
    fits = [anew(1.3 if finer else 1.0), anew(1.0)]
    contest.looks = SimpleNamespace(finer=lambda guess, values, end: (guess, {}))
    monkeypatch.setattr(Contest, "fit", lambda self, guess, start: fits.pop(0))
    before = len(found)
    contest._as_curve(found)
    assert len(found) == before + curves and len(fits) == 2 - curves
    contest._as_curve(found[:2])
    assert len(fits) == 2 - curves  # of what has a name nothing is asked there


@pytest.mark.parametrize("tells", [True, False])
def test_what_does_not_as_well_as_a_curve_that_leaves_nothing_is_no_cause_but_a_law_of_it_there(tells):
    """Beside steps over a house's wall an event of it was believed first, and with three overflows fitted to all that teaches."""
    event, limit, other = (
        cause("event", 1.0, loss=0.4),
        cause("limit", 1.0, loss=0.5),
        cause("of another", 1.0, over="first.y", loss=0.5),
    )
    alike, surplus = cause("alike", 1.0, "first.w", loss=0.15), cause("overflow", 1.0, loss=0.5)
    event.guess = replace(event.guess, kind=EVENT)
    surplus.guess = replace(surplus.guess, inserts=surplus.guess.inserts * 2)
    order = [alike, event, other, surplus, limit]
    curve, base = free_curve("first.u"), Candidate(None, (), None, np.ones((4, 1)))
    only = (curve.guess.place, "first.x") if tells else None
    outcome = Round(base, [curve, *order], event, list(order), curve=curve, only=only)
    only_beside(outcome)
    assert outcome.order == ([alike, limit] if tells else order)
    assert outcome.winner is (alike if tells else event) and bool(event.candidate.doubt) == tells
    outcome.order = [surplus]
    only_beside(outcome)
    assert outcome.winner is (None if tells else event)


@pytest.mark.parametrize(("only", "curves"), [(None, 2), ("first.x", 0)])
def test_no_curve_is_fitted_again_where_one_told_of_what_and_where_something_is_missing(monkeypatch, only, curves):
    table, kept = free_curve("first.u").guess.inserts[0], []
    looks = SimpleNamespace(
        scene=SimpleNamespace(only=only), tables=[], paths={}, _hats=lambda table: np.ones((3, 2)),
        _keep=lambda guess, *_: kept.append("law"), _keep_curve=lambda *_: kept.append("curve"),
    )  # fmt: skip
    law = SimpleNamespace(law="cubic", free=())
    monkeypatch.setattr(looks_module.g, "curve", lambda *_: (table, np.arange(2.0)))
    monkeypatch.setattr(looks_module.g, "laws", lambda *_: [(law, {}, (), np.ones(2))])
    monkeypatch.setattr(looks_module.g, "coarser", lambda *_: [(table, np.ones((2, 2)))] * 2)
    Looks._curve(looks, table.place, "first.x", VALUE, False)
    assert kept == ["law"] + ["curve"] * curves


@pytest.mark.parametrize(("most", "looked"), [(np.inf, ["path", "edge", "law"]), (2, ["path", "law"]), (1, [])])
def test_what_has_more_numbers_than_a_name_that_leaves_noise_is_not_looked_at(monkeypatch, most, looked):
    """A house's cause that had finer steps taken leaves noise in them: all others were looked at all the same, for 14 s and more."""
    of_two, of_three = (a_law("limit", "first.u", "first.x", count) for count in (2, 3))
    asked = []
    looks = SimpleNamespace(
        most=most, base=SimpleNamespace(misfit=np.zeros(2)), arranged=SimpleNamespace(block=np.zeros(2), put=lambda columns: columns[None]),
        problem=SimpleNamespace(which=[0], runs=[MeasuredRun("log.csv", "", np.arange(9), np.arange(9.0), {})]), scene=SimpleNamespace(prefix="c"),
        linear=SimpleNamespace(look=lambda way, drawn: asked.append("law")), drawn=None, ways=[],
    )  # fmt: skip
    looks._wanted = lambda guess: Looks._wanted(looks, guess)
    looks._keep = lambda *_: asked.append("path")
    looks._misfit = lambda guess, at: (asked.append("edge") if guess.kind == EVENT else None) or np.ones(2)
    shift = replace(of_three.inserts[0], law="constant"), 1.0, "added"
    monkeypatch.setattr(looks_module.g, "events", lambda *_: [(0, replace(of_three, kind=EVENT), 0, 1)])
    Looks._column(looks, Trial(of_two, {}, ("c.0",)))
    Looks._events(looks, of_three.place, shift)
    Looks._keep(looks, of_two, {}, of_two.free, np.ones((2, 2)))
    assert list(dict.fromkeys(asked)) == looked
