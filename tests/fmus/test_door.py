"""The short way of a step (loader/door.c): the same numbers and words as the long way, whatever else is called in between."""

import sys
from contextlib import nullcontext
from math import nan
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from selflock.fmus.controller.fmu import Controller
from selflock.fmus.load.fmu import Load
from selflock.fmus.motor.fmu import Motor
from selflock.fmus.reducer.fmu import Reducer
from selflock.master import twin

H = 1e-3  # s


class Plain:
    """The slave itself, called as pythonfmu calls it."""

    def __init__(self, kind):
        self.slave = kind(instance_name="it", resources="")
        self.slave.setup_experiment()
        self.slave.enter_initialization_mode()
        self.slave.exit_initialization_mode()
        self.saved = None

    def call(self, what, *given):
        slave = self.slave
        if what == "set":
            slave.set_real([given[0]], [given[1]])
        elif what == "get":
            return slave.get_real(list(given))
        elif what == "told":
            return slave.get_boolean(list(given))
        elif what == "step":
            return slave.do_step(*given)
        elif what == "save":
            self.saved = slave._get_fmu_state()
        elif what == "restore":
            slave._set_fmu_state(self.saved)
        return True


class Packed:
    """The FMU in a host."""

    def __init__(self, it):
        self.it, self.saved = it.begin(), None

    def call(self, what, *given):
        raw = self.it.raw
        try:
            if what == "set":
                raw.setReal([given[0]], [given[1]])
            elif what == "get":
                return raw.getReal(list(given))
            elif what == "told":
                return [bool(one) for one in raw.getBoolean(list(given))]
            elif what == "step":
                raw.doStep(currentCommunicationPoint=given[0], communicationStepSize=given[1])
            elif what == "save":
                self.saved = raw.getFMUState()
            elif what == "restore":
                raw.setFMUState(self.saved)
        except FMICallException:
            return False
        return True


@pytest.mark.parametrize("laws", [nullcontext, twin.offered], ids=["plain", "compiled"])
@pytest.mark.parametrize("kind, name", [(Motor, "Motor"), (Controller, "Controller"), (Load, "Load"), (Reducer, "Reducer")])
def test_any_order_of_calls_gives_the_slave_s_own_numbers(instance, rng, kind, name, laws):
    """Sets, gets of all numbers, steps, states and tuning drawn at random; at the end a value that is none."""
    with laws():
        _compare(instance, rng, kind, name)


def _compare(instance, rng, kind, name):
    plain, packed = Plain(kind), Packed(instance(name))
    count, last = len(kind.inputs), len(kind.inputs) + len(kind.outputs)
    reals = [place for place, row in enumerate(kind._table) if row.type == "Real"]
    inputs = [place for place in range(count) if kind._table[place].type == "Real"]
    booleans = [place for place in range(count, last) if kind._table[place].type == "Boolean"]
    tuned = [place for place, row in enumerate(kind._table) if row.variability == "tunable" and row.type == "Real"]
    calls, time = [("save",)], 0.0
    for _ in range(300):
        what = rng.choice(
            ["set", "step", "step", "get", "values", "save", "restore", "tune"], p=[0.3, 0.2, 0.2, 0.1, 0.08, 0.04, 0.04, 0.04]
        )
        if what == "set":
            calls.append(("set", int(rng.choice(inputs)), float(rng.normal())))
        elif what == "step":
            calls.append(("step", time, H))
            time += H
        elif what == "get":
            calls.append(("get", *(int(place) for place in rng.choice(last, 2)), reals[0]))
        elif what == "values":
            calls += [("get", *reals), ("told", *booleans)] if booleans else [("get", *reals)]
        elif what == "tune" and tuned:
            place = int(rng.choice(tuned))
            calls.append(("set", place, float(kind._table[place].start) * (1 + 0.01 * rng.random())))
        elif what in ("save", "restore"):
            calls.append((what,))
    known = {place for place in range(last) if kind._table[place].type == "Real"}
    calls = [call for call in calls if call[0] != "get" or {*call[1:]} <= known | set(reals)]
    calls += [("set", inputs[0], nan), ("step", time, H), ("get", *reals), ("restore",), ("step", time, H), ("get", *reals)]
    for k, call in enumerate(calls):
        assert plain.call(*call) == packed.call(*call) or "restore" in call or "set" in call, (k, call)


def test_a_plain_step_calls_nothing_but_the_law(instance):
    it = instance("Motor").begin()
    it.step(0.0, H, voltage=1.0)
    seen = []

    def count(frame, event, argument):
        if event == "call":
            seen.append(Path(frame.f_code.co_filename).stem)

    sys.setprofile(count)
    try:
        for k in range(1, 11):
            it.raw.setReal([0, 1], [1.0 * k, 2.0])
            it.raw.doStep(currentCommunicationPoint=k * H, communicationStepSize=H)
            it.raw.getReal([2, 3])
    finally:
        sys.setprofile(None)
    assert "slave" not in seen and seen.count("dc") == 10 * (seen.count("dc") // 10) > 0


def test_a_step_that_fails_says_why_once(instance):
    it = instance("Motor").begin()
    for k in range(5):
        it.step(k * H, H, voltage=1.0, speed=2.0)
    with pytest.raises(FMICallException):
        it.step(5 * H, H, voltage=1e308, speed=1e308)
    assert len(it.said) == 1 and "the step from t = 0.005 s of 0.001 s failed" in it.said[0] and "voltage = 1e+308" in it.said[0]


def test_instances_have_doors_of_their_own(instance):
    """Two at once, one reset and begun again: each goes on from its own state."""
    one, other, alone = (instance("Motor").begin() for _ in range(3))
    for k in range(10):
        one.step(k * H, H, voltage=5.0)
        other.step(k * H, H, voltage=-3.0)
        alone.step(k * H, H, voltage=-3.0)
    one.raw.reset()
    one.begin()
    for k in range(10):
        one.step(k * H, H, voltage=-3.0)
    assert one.get("current") == other.get("current") == alone.get("current") != 0.0
