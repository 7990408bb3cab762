"""What else is fitted beside what does best: the same elsewhere, of fewer numbers, of what its FMU has."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from rivals import a_law, asked, fits, looks

from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.naming import near
from selflock.diagnosis.naming.guesses import CURVE, LAW, PARAMETER, PATH, Guess
from selflock.diagnosis.naming.places import IN, Insert, Place


def test_the_best_law_and_the_best_curve_are_also_fitted_where_the_look_sees_as_much_of_the_same_quantity():
    """A ripple of a position was a curve at what a controller wants: where it acts, nearer to the state, it was not fitted."""
    parts = SimpleNamespace(
        links={"controller.x": SimpleNamespace(source="body", output="x")},
        variables={},
        owner=lambda name: name.partition(".")[0],
    )
    at = [
        ("controller.u", "controller.x", 9.0),
        ("body.force", "body.x", 8.9),
        ("body.force", "body.v", 8.9),
        ("far.u", "body.x", 7.0),
    ]
    ways = [(gain, a_law("table", place, over, kind=kind)) for kind in (CURVE, LAW) for place, over, gain in at]
    curves = [guess for _, guess in ways if guess.kind == CURVE]
    assert asked(curves[:1], None, looks(ways[:4], parts)) == ["curve of body.x on body.force"]
    best = ways[4][1]
    told = asked([best], best, looks(ways[4:], parts))
    assert "table of body.x on body.force" in told and "table of body.x on far.u" not in told
    away = lambda guess: ("controller" in str(guess.place), False)
    both = fits(curves[0], curves[1])
    scene = SimpleNamespace(parts=parts, one_thing=lambda a, b: a == b)
    assert near.refined(both, scene, away) == both and near.refined(fits(best), scene, away) == []
    told = [*both, *fits(a_law("table", "body.force", "body.v", kind=CURVE), a_law("table", "far.u", "body.v", kind=CURVE))]
    scene.one_thing = lambda a, b: True
    assert near.refined(told, scene, away) == told[:3]
    same = lambda guess, values, end, other: (guess.place, other.over)
    for rival in told:
        rival.values, rival.end = {}, None
    over = near.told_over(told[1:], SimpleNamespace(scene=scene, told_over=same), away)
    assert list(over) == [(curves[1].place, "body.v")]  # each variable once, where the best acts
    elsewhere, worse = fits(
        *(
            replace(curves[1], label=name, inserts=(Insert("c", Place(IN, name), "table", over="body.x"),))
            for name in ("far.u", "far.v")
        )
    )
    worse.candidate.errors = np.full(2, 1.1)
    assert near.refined([*both, elsewhere, worse], scene, away) == [*both, elsewhere]


def test_the_best_law_is_also_fitted_of_what_its_fmu_has():
    """A slow loss of a wall was named as one of the body behind it: that of the wall, which does as well, was never fitted."""
    parts = SimpleNamespace(
        links={}, owner=lambda name: name.partition(".")[0], variables={"wall.u", "wall.x", "load.u", "load.x"}
    )
    at = [("wall.u", "load.x", 9.0), ("wall.u", "wall.x", 8.5), ("load.u", "load.x", 8.4), ("load.u", "load.u", 7.0)]
    ways = [(gain, a_law("first order", place, over)) for place, over, gain in at] + [(9.5, a_law("cubic", "wall.u", "wall.x"))]
    first, second, *_ = (guess for _, guess in ways)
    both = {"first order of wall.x on wall.u", "first order of load.x on load.u"}
    assert set(asked([first], first, looks(ways, parts))) == both
    assert asked([first, second], first, looks(ways, parts)) == ["first order of load.x on load.u"]
    assert asked([], None, looks(ways, parts)) == []


def test_of_what_its_fmu_has_that_before_what_moves_is_fitted_first():
    """Of a speed before a controller's three inputs and before the body that moves, all alike, the last was not fitted."""
    known = {f"controller.{name}" for name in ("u", "x", "v")} | {"body.force", "body.v"}
    parts = SimpleNamespace(links={}, owner=lambda name: name.partition(".")[0], variables=known)
    at = [(9.0 - 0.01 * k, f"controller.{place}", f"controller.{over}") for k, (place, over) in enumerate(product("uxv", "xvu"))]
    ways = [(gain, a_law("first order", place, over)) for gain, place, over in [*at, (8.5, "body.force", "body.v")]]
    first = ways[0][1]
    assert "first order of body.v on body.force" in asked([first], first, looks(ways, parts))


def test_what_would_be_believed_is_asked_for_elsewhere_though_another_of_more_numbers_fits_best():
    """A drag of an oscillator stood behind its Stribeck; before the controller alone it was fitted, and named there."""
    ways = [
        (9.0, a_law("Stribeck", "c.u", "o.x", 4)),
        (8.0, a_law("drag", "c.u", "o.x", 1)),
        (7.9, a_law("drag", "o.force", "o.x", 1)),
    ]
    best, first, other = (guess for _, guess in ways)
    assert asked([best, first], first, looks(ways)) == [other.label]
    assert asked([best, first], best, looks(ways)) == []


def test_numbers_of_fmus_that_look_as_good_as_the_first_are_held_against_it():
    """A controller's gain was a scale of its speed: three other numbers of FMUs looked better, and it was never fitted."""
    scale = Guess(PATH, "scale", "scale on c.speed", (Insert("k", Place(IN, "c.speed"), "scale"),), ())
    number = lambda name: Guess(PARAMETER, "parameter", name, (), ())
    ways = [(3.0, scale), (9.0, number("a.mass")), (3.0, number("c.soft")), (1.0, number("c.stiff"))]
    assert asked([scale, ways[1][1]], scale, looks(ways)) == ["c.soft"]


def test_what_the_look_cannot_tell_from_the_first_is_held_against_it_whatever_its_gain():
    """A gain so far off that a linear look ends at its range sees a loss; the scale of its input, which it is, has no such end."""
    scale = Guess(PATH, "scale", "scale on c.speed", (Insert("k", Place(IN, "c.speed"), "scale"),), ())
    number = lambda name, count=0: Guess(PARAMETER, "parameter", name, (), (Number(name, name, 0.0, -1.0, 1.0),) * count)
    look = looks([(3.0, scale), (-1.0, number("c.soft")), (0.5, number("c.stiff")), (1.0, number("a.mass", 1))])
    first, same, near_it, more = (way for way, _ in look.ways)
    look.of[id(same)] = -look.of[id(first)]
    look.of[id(more)] = look.of[id(first)]  # of more numbers it is no other name
    look.of[id(near_it)] = np.array([0.9, 0.0, np.sqrt(0.19), 0.0])
    assert asked([scale], scale, look) == ["c.soft"]


def test_the_best_law_is_held_against_those_of_fewer_numbers_over_its_variable():
    """A leak: a dead band that ends at 0, and three laws more, look better than what is in proportion."""
    of = [("dead band", 2, "b.v"), ("power", 2, "b.v"), ("proportional", 1, "b.v"), ("cubic", 1, "b.v"), ("cubic", 1, "b.left")]
    guesses = [a_law(name, "b.drawn", over, count) for name, count, over in of]
    look = looks(list(zip((9.0, 8.0, 5.0, 6.0, 5.2), guesses)))
    told = lambda *found: [label.partition(" on ")[0] for label in asked(found, None, look)]
    assert sorted(told(guesses[0])) == ["cubic of b.v", "proportional of b.v"]
    assert told(guesses[0], guesses[3]) == ["proportional of b.v"]
    assert told(guesses[3]) == told() == []


@pytest.mark.parametrize(
    ("law", "curve", "left", "asked"),
    [("limit", 3.0, True, True), ("limit", 0.9, True, False), ("limit", 3.0, False, False), ("Dahl", 3.0, True, False)],
)
def test_a_curve_that_leaves_more_than_a_law_of_its_own_variable_is_begun_as_that(law, curve, left, asked):
    """Two limits at one place were `explained`: the curve that both are had been fitted in another valley alone."""
    guesses = (
        a_law(law, "load.u", "load.x"),
        a_law("table", "load.u", "load.x", kind=CURVE),
        a_law("table", "u", "x", kind=CURVE),
    )
    found = [
        SimpleNamespace(guess=guess, values={}, end=SimpleNamespace(loss=loss)) for guess, loss in zip(guesses, (1.0, curve, 0.5))
    ]
    looks = SimpleNamespace(as_curve=lambda guess, values, end: guess.label)
    assert list(near.as_curve(found, looks, lambda rival: left)) == ([guesses[0].label] if asked else [])
    assert list(near.as_curve(found[1:], looks, lambda rival: left)) == list(near.as_curve([], looks, None)) == []
