"""A step of any law with any accepted values ends after a bounded number of lines of Python: counted, not timed."""

import math
import random
import sys
from math import inf

import pytest

from selflock.fmus.controller.fmu import Controller
from selflock.fmus.load import load
from selflock.fmus.load.fmu import Load
from selflock.fmus.motor.fmu import Motor
from selflock.fmus.reducer import travel
from selflock.fmus.reducer.fmu import Reducer
from selflock.fmus.sensor.fmu import Sensor

# What the budgets come to: a part of the load is 14 lines; a piece of the reducer 200, its law with all effects 250, and a
# round of looking for an event 30, of which ROUNDS - 1 are free.
LINES = {Motor: 500, Controller: 500, Sensor: 500, Load: 20 * load.MOST, Reducer: (450 + 30 * travel.ROUNDS) * travel.PIECES}
STEPS = {Motor: 300, Controller: 300, Sensor: 300, Load: 500, Reducer: 150}


class TooLong(BaseException):
    pass


def lines(step, most):
    """What step() returns or raises, and how many lines of the laws it ran; TooLong beyond `most`."""
    count = 0

    def trace(frame, event, argument):
        nonlocal count
        count += event == "line"
        if count > most:
            raise TooLong
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        return step()
    except (ArithmeticError, ValueError):  # beyond a float's range: the face tells it
        return None
    finally:
        sys.settrace(before)


def anything(draw, low=-inf, high=inf):
    """A number of any size that a variable with these bounds accepts, often one at its end."""
    size = 10.0 ** draw.choice([draw.uniform(-3, 3), draw.uniform(-3, 3), draw.uniform(-12, 12), draw.uniform(-300, 300)])
    value = draw.choice([0.0, size, size, -size])
    return min(max(value, -1e308 if low is None else low), 1e308 if high is None else high)


def drawn(face, draw):
    """Accepted parameters of a face: most as they are, some anything; its effects are on now and then."""
    while True:
        values = {row.name: float(row.start) for row in face.parameters}
        for row in draw.sample(face.parameters, draw.randint(0, min(6, len(face.parameters)))):
            values[row.name] = draw.choice([0.0, 1.0]) if row.type == "Boolean" else anything(draw, row.minimum, row.maximum)
        if face is Load:
            values["mass"] = anything(draw, 0.0)  # without one there is nothing to cut
        p = face.law.Parameters(*(values[name] for name in face.law.Parameters._fields))
        try:
            unfit = face.check(_Bare(), p) or any(effect.check(p) for effect in face.law.EFFECTS)
        except (ArithmeticError, ValueError):
            continue
        if not unfit:
            return p


class _Bare:
    """Stands for the face in its check."""

    def value(self, name):
        return 0.0


@pytest.mark.parametrize("face", LINES, ids=lambda face: face.__name__)
@pytest.mark.slow
def test_every_step_ends(face):
    draw = random.Random(17)
    sound = 0
    for _ in range(STEPS[face]):
        p = drawn(face, draw)
        inputs = [anything(draw) for _ in face.inputs]
        if face is Reducer:
            inputs = [inputs[0], *inputs[3:]]  # dynamic mode
        law, dt = face.law, 10.0 ** draw.uniform(-6.0, 3.0)

        def step():
            state = law.start(p, 0.0, anything(draw), *inputs[1:]) if face is Reducer else begin(law, p, inputs)
            for _ in range(2):
                state, out = law.advance(p, state, *inputs, dt)
            return out

        out = lines(step, 2 * LINES[face])
        sound += out is not None and math.isfinite(sum(out))
    assert sound > 0.3 * STEPS[face]  # most are no matter for a refusal


def begin(law, p, inputs):
    return law.start(p, *inputs) if law.start.__code__.co_argcount > 1 else law.start(p)


@pytest.mark.parametrize(
    "values, dt, named",
    [
        ({"shaft_stiffness": 1e12, "shaft_damping": 0.0, "output_speed": 0.3}, 1.0, "shaft_stiffness = 1e+12 N.m/rad"),
        ({"output_ripple_torque": 1e-3}, 1.0, "try a step of 0.1 s or less"),
    ],
)
def test_a_reducer_says_what_asks_for_too_many_pieces(instance, values, dt, named):
    from fmpy.fmi1 import FMICallException

    it = instance("Reducer").begin(friction_kinetic=0.01, initial_speed=100.0, **values)
    with pytest.raises(FMICallException):
        it.step(0.0, dt, motor_torque=0.1)
    assert named in " ".join(it.said) and str(travel.PIECES) in " ".join(it.said)


def test_pieces_whose_events_are_hard_to_find_count_more():
    """An output shaft that jumps between its flanks: six roots a piece, each of up to 80 rounds."""
    shaft = Reducer.law
    p = shaft.Parameters(gear_ratio=164.5, shaft_inertia=1.8e-235, backlash=5.25, output_ripple_torque=-25.0)
    state = shaft.relaxed(p, 0.0, 0.0, 0.23, -0.098)
    state, _ = lines(lambda: shaft.advance(p, state, 0.0, 0.23, -0.098, 0.047), LINES[Reducer])
    assert math.isnan(state.speed)
