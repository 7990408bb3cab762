"""Waves by two names: which of them is the cause, and which is said beside it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.search.candidate import Candidate, harmonic, one_wave, order_of, simplest
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.fmus.effect import AMPLITUDE, ORDER


def wave(of: str, unit: str, order: float, left: float, gears: float = 1.0, more: int = 0) -> Candidate:
    """A fitted wave of so many in a turn of a shaft that turns once in `gears` turns of the input shaft; left: its errors."""
    amount = Free(f"{of}.amount", 0.0, -1.0, 1.0, unit, role=AMPLITUDE)
    turns = Free(f"{of}.order", 1.0, 1.0, 200.0, role=ORDER, length=0.003 * gears, gears=gears)
    others = tuple(Free(f"{of}.{i}", 0.0, -1.0, 1.0) for i in range(more))
    component, effect = of.split(".")
    found = SimpleNamespace(values={amount.name: 0.1, turns.name: order}, by_channel=True)
    errors = left * np.array([[0.9], [1.0], [1.1], [1.0]])
    return Candidate(Hypothesis(component, effect, (amount, turns, *others)), (amount, turns), found, errors)


def test_waves_are_counted_over_either_shaft(rng):
    gears, order = float(rng.uniform(5.0, 80.0)), float(rng.integers(2, 12))
    cogging, ripple = wave("motor.cogging", "N.m", order, 1.0), wave("reducer.ripple", "N.m", order * gears, 1.0, gears)
    assert order_of(cogging, ripple) == {"reducer.ripple.order": pytest.approx(order * gears)}
    assert order_of(ripple, cogging) == {"motor.cogging.order": pytest.approx(order)}
    assert not order_of(cogging, wave("reducer.ripple", "N.m", order, 1.0, gears))
    assert not order_of(cogging, wave("motor.cogging", "N.m", order + 1.0, 1.0))


def test_of_one_wave_the_law_that_is_nothing_else_is_the_cause_though_its_fit_ended_sooner():
    """Of a ripple that has other numbers, too, cogging is the special case; where the logs tell them apart they decide."""
    ripple, cogging = wave("reducer.ripple", "N.m", 64.0, 1.0, 16.0, more=6), wave("motor.cogging", "N.m", 4.0, 1.05)
    other = wave("motor.cogging", "N.m", 5.0, 1.05)
    of_friction = wave("reducer.friction", "", 64.0, 1.0, 16.0, more=6)
    same, apart = (lambda a, b: True), (lambda a, b: False)
    assert simplest([ripple, cogging], [], 0.0, same) is cogging and one_wave(ripple, cogging, same)
    assert simplest([ripple, cogging], [], 0.0, apart) is ripple and not one_wave(ripple, cogging, apart)
    assert simplest([ripple, other], [], 0.0, same) is ripple
    assert simplest([of_friction, cogging], [], 0.0, same) is of_friction


@pytest.mark.parametrize(
    ("order", "share", "one_cause"), [(4.0, 0.4, True), (4.0, 0.6, False), (6.0, 0.3, True), (5.0, 0.1, False)]
)
def test_a_weaker_wave_of_several_times_as_many_is_the_harmonic_of_a_cause(order, share, one_cause):
    """At most as strong as of a jump that comes back with the first, whose second harmonic has half of it, and its third a third."""
    ripple, cogging = wave("reducer.ripple", "", 2.0, 1.0), wave("motor.cogging", "N.m", order, 1.0)
    cogging.fitted.values |= ripple.fitted.values
    does = lambda amounts: share if amounts[0].name == "motor.cogging.amount" else 1.0
    assert harmonic(cogging, [ripple.hypothesis], does) is one_cause
    assert not harmonic(cogging, [], does)
