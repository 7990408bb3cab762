"""Values that no data sheet says: found from several starts, and told where the log does not tell them."""

import numpy as np
import pytest

from selflock.diagnosis.search.fit import Fit, fit
from selflock.diagnosis.search.hypotheses import Free
from selflock.diagnosis.search.starts import Ending, collinear, correlated, starts, told

ROWS = np.ones(400, bool)
BLOCKS = np.repeat(np.arange(20), 20)


def fitted(misfit, free, start):
    return fit(misfit, {}, free, start, ROWS, 1e3)


def test_starts_are_the_values_given_and_places_of_the_ranges():
    free = Free("a", 0.0, 0.0, 10.0), Free("b", 0.0, -4.0, 8.0), Free("c", 1.0, 1.0, 1000.0)
    given, *places = starts(free, {"a": 0.0, "b": 3.0, "c": 1.0})
    assert given == pytest.approx({"a": 0.2, "b": 3.0, "c": 19.98})
    assert [p["a"] for p in places] == pytest.approx([5.0, 10.0**-1.666667, 10.0**-0.333333], rel=1e-4)
    assert [p["b"] for p in places] == pytest.approx([2.0, 0.0, 4.0])
    assert [p["c"] for p in places] == pytest.approx([500.5, 10.0, 100.0])


@pytest.mark.parametrize("start", [0.0, 1e-9, 1.0, 10.0])
def test_a_fit_arrives_from_every_start(start, rng):
    x = rng.standard_normal(400)
    free = (Free("a", start, 0.0, 10.0),)
    for place in starts(free, {"a": start}):
        assert fitted(lambda v: (2.0 - v["a"]) * x, free, place).values["a"] == pytest.approx(2.0, rel=1e-4)


def test_values_that_the_log_cannot_tell_apart_are_named(rng):
    x, y, z = rng.standard_normal((3, 400))
    free = tuple(Free(name, 0.1, -10.0, 10.0) for name in "abc")
    misfit = lambda v: x + y - (v["a"] + v["b"]) * x - v["c"] * y + 1e-3 * v["b"] * z
    found = fitted(misfit, free, {name: 0.1 for name in "abc"})
    assert collinear(found, ROWS) == {"a": ["b"], "b": ["a"]}
    sentences = [s for one in told(found, free, [], ROWS, BLOCKS) for s in one.sentences()]
    assert sentences == ["a cannot be told from b in this log", "b cannot be told from a in this log"]


def test_a_value_that_wants_to_leave_its_range_is_told(rng):
    x, noise = rng.standard_normal((2, 400))
    free = (Free("a", 0.5, 0.0, 1.0), Free("b", 0.5, 0.0, 1.0))
    found = fitted(lambda v: (1.5 - v["a"]) * x + (0.4 - v["b"]) * x[::-1] + 0.01 * noise, free, {"a": 0.5, "b": 0.5})
    at = {one.name: one.at_bound for one in told(found, free, [], ROWS, BLOCKS)}
    assert at == {"a": True, "b": False}


def test_a_value_without_influence_may_be_anything(rng):
    x = rng.standard_normal(400)
    free = (Free("a", 0.5, 0.0, 1.0), Free("b", 0.5, 0.0, 1.0))
    _, b = told(fitted(lambda v: (0.3 - v["a"]) * x, free, {"a": 0.5, "b": 0.5}), free, [], ROWS, BLOCKS)
    assert (b.low, b.high) == (0.0, 1.0) and not b.at_bound and not b.collinear_with


def test_starts_that_end_elsewhere_are_told(rng):
    x, noise = rng.standard_normal((2, 400))
    free = (Free("a", 1.0, 0.0, 10.0),)
    misfit = lambda v: x * np.sin(v["a"]) * (1.0 + 0.1 * v["a"]) + 0.01 * noise
    endings = []
    for start in (0.1, 2.6, 6.0):
        found = fitted(misfit, free, {"a": start})
        endings.append(Ending({"a": start}, found.values, float((found.misfit**2).sum())))
    best = min(endings, key=lambda e: e.loss)
    (one,) = told(fitted(misfit, free, best.end), free, endings, ROWS, BLOCKS)
    assert {way["start"] for way in one.elsewhere} == {0.1, 2.6, 6.0} - {e.start["a"] for e in endings if e is best}
    assert one.row()["elsewhere"] == one.elsewhere and "from other starts" in one.sentences()[0]


def test_values_that_hang_together_are_told_in_pairs_with_their_sign(rng):
    """Columns that are alike by c make a correlation of -c; what the log does not feel hangs with nothing."""
    x, y = np.linalg.qr(rng.standard_normal((400, 2)))[0].T
    columns = np.stack([x, 0.9 * x + np.sqrt(1.0 - 0.81) * y, -x + 1e-3 * y, np.zeros(400)], 1)
    free = tuple(Free(name, 0.0, -10.0, 10.0) for name in "abcd")
    for kept, pairs in (((0, 1, 3), [("a", "b", -0.9)]), ((0, 2), [("a", "c", 1.0)]), ((3,), [])):
        some = tuple(free[i] for i in kept)
        told = correlated(Fit(some, {p.name: 0.0 for p in some}, y, columns[:, kept], np.ones(400)), ROWS)
        assert [(one["first"], one["second"]) for one in told] == [pair[:2] for pair in pairs]
        assert [one["correlation"] for one in told] == pytest.approx([pair[2] for pair in pairs], abs=1e-2)
