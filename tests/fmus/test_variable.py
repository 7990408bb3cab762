"""The one record for a variable: what follows from what is said, and which values it takes."""

import math

import pytest

from selflock.fmus.variable import Variable

LENGTH = Variable("length", "m", 1.0, minimum=0.5, maximum=2.0, causality="parameter")


@pytest.mark.parametrize("start, type_", [(1.0, "Real"), (1, "Integer"), (True, "Boolean"), ("a", "String"), (None, "Real")])
def test_the_type_is_that_of_the_start_value(start, type_):
    assert Variable("x", start=start).type == type_
    assert Variable("x", start=start, type="Real").type == "Real"


def test_the_variability_follows_from_type_and_causality():
    assert LENGTH.variability == "fixed"
    assert Variable("x", start=1.0, causality="output").variability == "continuous"
    assert Variable("x", start=True, causality="output").variability == "discrete"
    assert Variable("x", start=1.0, causality="parameter", variability="tunable").variability == "tunable"


def test_bounds_as_numbers():
    assert (LENGTH.low, LENGTH.high) == (0.5, 2.0)
    assert (Variable("x").low, Variable("x").high) == (-math.inf, math.inf)


@pytest.mark.parametrize("value, why", [
    (0.4, "is outside its range: it must be at least 0.5 m and at most 2 m"),
    (math.nan, "is not a finite number"),
    (-math.inf, "is not a finite number"),
    ("long", "is not a number"),
    (True, "is not a number"),
])  # fmt: skip
def test_a_value_that_is_not_fit_is_told_why(value, why):
    with pytest.raises(ValueError) as told:
        LENGTH.taken(value)
    assert str(told.value) == why


def test_text_is_taken_as_the_type_wants_it():
    assert LENGTH.taken("1.5") == 1.5
    count = Variable("count", start=3)
    assert count.taken("4") == 4 and isinstance(count.taken(4.0), int)
    assert Variable("on", start=False).taken("True") is True
    assert Variable("word", start="").taken(3) == "3"
    for one, value in ((count, "2.5"), (count, "inf"), (Variable("on", start=False), "perhaps")):
        with pytest.raises(ValueError):
            one.taken(value)


def test_the_old_order_of_a_part_s_variable_is_named():
    with pytest.raises(ValueError, match='causality="input"'):
        Variable("force", "input", "Real", "N")
