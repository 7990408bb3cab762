"""Corrections: each law against a formula written otherwise, paths against their limits, the FMU and the compiled part against the law."""

import math

import numpy as np
import pytest

from selflock.diagnosis.naming.part import CompiledCorrection
from selflock.fmus.build import pack, sources_of
from selflock.fmus.correction import law
from selflock.fmus.correction.fmu import FACES, name

STEP = 0.1
NUMBERS = {"a": 2.0, "n": 1.5, "w": 0.5, "b": 0.4, "v": 0.3, "phase": 0.2, "l": 0.25, "T": 0.35, "d": 0.6, "r": 1.5, "q": 0.5,
           "low": -0.6, "high": 0.4, "x1": -1.0, "y1": 3.0, "x2": 0.0, "y2": 1.0, "x3": 2.0, "y3": 2.0}  # fmt: skip
FORMULAS = {
    "constant": lambda x: 2.0,
    "proportional": lambda x: 2.0 * x,
    "quadratic": lambda x: 2.0 * x**2,
    "drag": lambda x: 2.0 * x * math.sqrt(x * x),
    "cubic": lambda x: 2.0 * x**3,
    "power": lambda x: 2.0 * x / math.sqrt(abs(x)) * abs(x) if x else 0.0,
    "square root": lambda x: 2.0 * x / math.sqrt(abs(x)) if x else 0.0,
    "Coulomb": lambda x: 2.0 * (math.exp(4.0 * x) - 1.0) / (math.exp(4.0 * x) + 1.0),
    "Stribeck": lambda x: (2.0 + 0.4 / math.exp((x / 0.3) ** 2)) * (1.0 - 2.0 / (math.exp(4.0 * x) + 1.0)),
    "sine": lambda x: 2.0 * (math.sin(1.5 * x) * math.cos(0.2) + math.cos(1.5 * x) * math.sin(0.2)),
    "dead band": lambda x: 2.0 * (x - min(max(x, -0.5), 0.5)),
    "limit": lambda x: 2.0 * (max(x, 0.25) - 0.25),
    "limit below": lambda x: 2.0 * (min(x, 0.25) - 0.25),
}


def words(kind):
    return [f"{axis}{k + 1}" for k in range(3) for axis in "xy"] if kind == "table" else law.BY_NAME[kind].numbers


def vector(kind, **more):
    p = [0.0] * law.SIZE
    p[law.LAW], p[law.UNTIL], p[law.COUNT] = law.BY_NAME[kind].code, 1e300, 3
    for k, word in enumerate(words(kind)):
        p[law.FIRST + k] = more.get(word, NUMBERS[word])
    return p


def played(kind, x, signal=None, beside=None, over=law.VALUE, multiplies=0.0, since=0.0, until=1e300, step=STEP, **more):
    """The law over a row of values, step by step."""
    p = vector(kind, **more)
    p[law.OVER], p[law.MULTIPLIES], p[law.SINCE], p[law.UNTIL] = over, multiplies, since, until
    m = law.start(p)
    signal = np.zeros(len(x)) if signal is None else signal
    beside = np.zeros(len(x)) if beside is None else beside
    return np.array([law.step(p, m, float(s), float(one), float(other), step) for s, one, other in zip(signal, x, beside)])


@pytest.mark.parametrize("kind", FORMULAS)
def test_a_law_is_its_formula(kind):
    for x in (-1.7, -0.3, 0.0, 0.1, 0.4, 2.2):
        assert law.still(vector(kind), x) == pytest.approx(FORMULAS[kind](x), abs=1e-12)


def test_a_law_goes_with_two_variables():
    x, w = np.array([-1.5, 0.2, 2.0]), np.array([4.0, -0.25, 9.0])
    assert played("cubic", x, beside=w, over=law.DIFFERENCE, a=2.0) == pytest.approx(2.0 * (x - w) ** 3)
    assert played("proportional", x, beside=w, over=law.PRODUCT, a=2.0) == pytest.approx(2.0 * x * w)
    assert played("proportional", x, beside=w, over=law.ROOTED, a=2.0) == pytest.approx([-6.0, -0.2, 12.0])


def test_a_table_is_straight_and_stays_beyond_its_points():
    p = vector("table")
    assert [law.table(p, x) for x in (-2.0, -1.0, -0.5, 0.0, 1.0, 3.0)] == pytest.approx([3.0, 3.0, 2.0, 1.0, 1.5, 2.0])
    assert law.whole(p) and not law.whole(vector("table", x2=-1.0))


def test_times_the_signal_and_between_two_times():
    ones = np.ones(6)
    assert played("proportional", 0.5 * ones, 3.0 * ones, multiplies=1.0) == pytest.approx(6.0 * ones)
    # from 0.15 s to 0.3 s: of the step from 0.1 s on the second half
    assert played("constant", ones, since=0.15, until=0.3) == pytest.approx([0.0, 1.0, 2.0, 0.0, 0.0, 0.0])


def test_what_of_x_is_taken():
    time = STEP * np.arange(50)
    assert played("proportional", 3.0 * time, over=law.RATE)[1:] == pytest.approx(6.0)
    assert played("proportional", np.ones(50), over=law.INTEGRAL) == pytest.approx(2.0 * time)
    turns = np.concatenate([np.arange(10.0), 9.0 - np.arange(1.0, 10.0)])
    found = played("proportional", turns, over=law.SINCE_TURN)
    assert found[18] == pytest.approx(2.0 * 0.8, abs=2.0 * STEP + 1e-9)


def test_dahl_turns_on_its_own_length_and_ends_at_its_amplitude():
    up = played("Dahl", np.arange(0.0, 10.0, 0.01))
    assert up[1 + 50] == pytest.approx(2.0 * (1.0 - math.exp(-1.0)), rel=0.03) and up[-1] == pytest.approx(2.0)
    # LuGre without Stribeck's part, and Bouc-Wen with n = 1 and b = 1/2 while it is loaded, are Dahl
    assert played("LuGre", np.arange(0.0, 10.0, 0.01), b=0.0) == pytest.approx(up)
    assert played("Bouc-Wen", np.arange(0.0, 10.0, 0.01), b=0.5, n=1.0) == pytest.approx(up, abs=1e-3)


def test_one_more_state_and_the_paths():
    ones = np.ones(40)
    time = STEP * np.arange(40)
    stepped = np.concatenate([[0.0], ones[1:]])
    state = played("first order", stepped, d=0.0)  # its mean over a step, nearly
    assert state[1:] == pytest.approx(2.0 * (1.0 - np.exp(-(time[1:] - 0.5 * STEP) / 0.35)), abs=0.02)
    begun = played("first order", ones, d=-0.8) - played("first order", ones, d=0.0)  # where it begins dies away
    assert begun == pytest.approx(-1.6 * np.exp(-(time + 0.5 * STEP) / 0.35), abs=0.02)
    lag = played("lag", ones, stepped)
    assert lag[1:] == pytest.approx(1.0 - np.exp(-time[1:] / 0.35))
    ramp = time
    assert played("delay", ones, ramp, T=0.25)[3:] == pytest.approx(ramp[3:] - 0.25)
    assert played("rate limit", ones, stepped)[1:5] == pytest.approx(np.minimum(1.0, 1.5 * time[1:5]))
    s = np.array([-2.0, -0.3, 0.2, 0.9])
    assert played("saturation", s, s) == pytest.approx([-0.6, -0.3, 0.2, 0.4])
    assert played("dead zone", s, s) == pytest.approx([-1.5, 0.0, 0.0, 0.4])
    assert played("quantisation", s, s) == pytest.approx([-2.0, -0.5, 0.0, 1.0])
    assert played("sign", s, s) == pytest.approx(-s) and played("scale", s, s) == pytest.approx(2.0 * s)
    assert math.isnan(played("delay", s, s, T=1e3)[-1])  # longer ago than it remembers


@pytest.mark.parametrize("kind", law.BY_NAME)
def test_the_compiled_part_and_the_slave_are_the_law(kind, rng):
    x, w, signal = rng.uniform(-1.0, 1.0, (3, 60))
    numbers = dict(zip(words(kind), vector(kind)[law.FIRST :]))
    plain = played(kind, x, signal, w, over=law.DIFFERENCE)
    part = CompiledCorrection("one", kind, taken=law.DIFFERENCE, points=3 if kind == "table" else 0)
    part.bind(["signal", "x", "beside"], ["corrected"])
    slave = FACES[kind](instance_name="one", resources="")
    slave._set(slave._place["taken"], law.DIFFERENCE, "Integer")
    for word, value in numbers.items():
        part.set(word, value)
        slave._set(slave._place[word], value, "Real")
    if kind == "table":
        slave._set(slave._place["points"], 3, "Integer")
    slave.set_real([0, 1, 2], [float(signal[0]), float(x[0]), float(w[0])])
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    found = []
    for k in range(len(x)):
        part.u[:] = signal[k], x[k], w[k]
        part.cycle(k * STEP, STEP)
        slave.set_real([0, 1, 2], [float(signal[k]), float(x[k]), float(w[k])])
        assert slave.do_step(k * STEP, STEP)
        found.append((part.y[0], slave.value("corrected")))
    assert np.array(found) == pytest.approx(np.stack([plain, plain], 1), rel=1e-12, abs=1e-12)


def test_a_state_that_is_restored_keeps_what_the_part_is_given(rng):
    """A loop nudges what a part is given, and restores the part: with what it was given before nothing was nudged."""
    part = CompiledCorrection("one", "proportional")
    part.bind(["signal", "x"], ["corrected"])
    part.set("a", 2.0)
    part.u[:] = rng.uniform(-1.0, 1.0, 2)
    part.cycle(0.0, STEP)
    state, (signal, x) = part.save(), rng.uniform(-1.0, 1.0, 2)
    part.u[:] = signal, x
    part.restore(state)
    assert list(part.u) == [signal, x]
    part.cycle(STEP, STEP)
    assert part.y[0] == pytest.approx(signal + 2.0 * x)


@pytest.mark.slow
def test_the_fmu_is_valid_and_refuses_a_table_that_falls(tmp_path):
    from fmpy.validation import validate_fmu

    from selflock.fmus.errors import BuildError

    face = FACES["table"]
    path = pack(face, sources_of(face), tmp_path / "Correction.fmu", {"points": 3, "x3": 5.0, "y3": 1.0})
    assert validate_fmu(str(path)) == [] and name(law.BY_NAME["table"]) == "TableCorrection"
    with pytest.raises(BuildError, match="rise"):
        pack(face, sources_of(face), tmp_path / "no.fmu", {"points": 2, "x1": 3.0, "x2": 1.0})
