"""Parts of a few lines: functions, generators and classes, against closed forms."""

import math

import numpy as np
import pytest

from selflock import master, part
from selflock.master.dump import save

PLANT = {"i": master.Component(part="small_parts:Integrator")}  # dy/dt = u


@part(inputs={"y": "", "target": "m"}, outputs={"u": ""}, parameters={"gain": "1/s"})
def pull(t, target, y, gain=2, on=True):
    """Towards the target."""
    return gain * (target - y) if on else 0.0


@part(inputs={"y": ""}, outputs={"u": "", "sum": ""})
def adding(t, y, gain=1.0):
    total, last = 0.0, t
    while True:
        total += y * (t - last)
        last = t
        t, y = yield {"sum": total, "u": -gain * y}


@part(inputs={"y": ""}, outputs={"u": "", "sum": ""})
class Adding:
    def __init__(self, gain=1.0):
        self.gain, self.total, self.last = gain, 0.0, None

    def __call__(self, t, y):
        self.total += y * (t - (t if self.last is None else self.last))
        self.last = t
        return -self.gain * y, self.total


def loop(made, **more):
    """An integrator and what acts on it."""
    own = {"i": master.Component(part="small_parts:Integrator"), "c": master.Component(part=made, **more)}
    wires = {"i.u": master.Connection("c.u"), "c.y": master.Connection("i.y")}
    return master.System(components=own, connections=wires, run=master.Run(stop=1.0, step=0.125), allow_code=True)


def test_a_function_closes_a_loop():
    """y' = k (r - y), u held over a step: y_n = r (1 - (1 - k h)^n); under Jacobi and Gauss-Seidel c comes after i."""
    system = loop(pull, start={"target": 3.0, "gain": 1.5})
    table = master.run(system).table
    steps = np.arange(9)
    assert table["i.y"].to_numpy() == pytest.approx(3.0 * (1.0 - (1.0 - 1.5 * 0.125) ** steps))
    assert table["c.u"].to_numpy() == pytest.approx(1.5 * (3.0 - table["i.y"].to_numpy()))
    assert pull.__doc__ == "Towards the target." and pull.function(0.0, 3.0, 1.0) == 4.0
    assert (master.run(system, {"c.on": False}).table["i.y"] == 0.0).all()
    units = {v.name: v.unit for v in pull.described}
    assert units == {"gain": "1/s", "on": "", "target": "m", "y": "", "u": ""}


def test_time_is_that_of_the_end_of_a_step():
    @part(inputs={}, outputs={"u": ""})
    def clock(t):
        return math.sin(t)

    system = master.System(components={"c": master.Component(part=clock)}, run=master.Run(start=1.0, stop=2.0, step=0.25))
    table = master.run(system).table
    assert np.array_equal(table["c.u"], [math.sin(t) for t in table["time"]])


@pytest.mark.parametrize("made", [adding, Adding])
def test_one_that_remembers_begins_once(made):
    """∫ y dt by the right rectangles, from the start on, however often the start is asked for."""
    system = loop(made)
    kept = {}
    for _ in range(2):  # the second time reset
        with master.session(system, {"c.y": 0.0, "c.gain": 2.0}) as s:
            assert s["c.sum"] == 0.0 and s["c.u"] == 0.0
        system.components["i"].start = {}
        table = master.run(system, {"c.gain": -1.0}, keep=kept).table
        assert table["c.sum"].to_numpy() == pytest.approx(np.concatenate([[0.0], np.cumsum(0.125 * table["i.y"][1:])]))
    for one in kept.values():
        one.close()


def test_a_class_goes_back_and_a_generator_says_that_it_cannot():
    def pushed(made):
        system = loop(made)
        system.connections["i.u"] = master.Connection("c.u", -1.0, 1.0)
        return system

    whole = master.run(pushed(Adding)).table
    with master.session(pushed(Adding)) as s:
        s.step(until=0.5)
        here = s.snapshot()
        for _ in range(2):
            s.step(until=1.0)
            assert s.table.equals(whole)
            s.restore(here)
    assert whole["c.sum"].iloc[-1] > 0.1 and whole.equals(master.run(pushed(adding)).table)
    with master.session(pushed(adding)) as s, pytest.raises(master.SessionError, match="c cannot roll back"):
        s.snapshot()


def test_a_gain_is_turned_while_it_runs():
    with master.session(loop(pull), {"c.target": 1.0}) as s:
        s["c.gain"] = 0.0
        s.step()
        s["c.gain"] = 8.0
        s.step()
        s.step()
        assert s.table["c.u"].tolist() == [0.0, 0.0, 8.0, 0.0]
        here = s.snapshot()
        for gain in (4.0, 2.0):
            s.restore(here)
            s["c.gain"], s["c.target"] = gain, 3.0
            s.step()
            assert s["c.u"] == gain * (3.0 - s["i.y"]) == 2.0 * gain


def test_a_generator_that_returns_ends_the_run():
    @part(inputs={}, outputs={"x": ""})
    def brief(t):
        while t < 0.5:
            t = yield t

    result = master.run(master.System(components={"b": master.Component(part=brief)}, run=master.Run(stop=1.0, step=0.125)))
    assert result.ended == {"b": 0.5} and result.table["time"].iloc[-1] == 0.5


@pytest.mark.parametrize("held, between", [(False, [0.0, 0.5, 1.0, 1.5, 2.0]), (True, [0.0, 0.0, 1.0, 1.0, 2.0])])
def test_between_long_steps_it_is_held_or_on_a_line(held, between):
    @part(inputs={}, outputs={"x": ""}, held=held)
    def slow(t):
        return t

    own = {"s": master.Component(part=slow, step=1.0)}
    assert master.run(master.System(components=own, run=master.Run(stop=2.0, step=0.5))).table["s.x"].tolist() == between


@pytest.mark.parametrize(
    "answer, words",
    [
        (lambda: 1 / 0, ("c answered ZeroDivisionError (division by zero)", "test_function.py, line")),
        (lambda: None, ("c answered None, where u is wanted,",)),
        (lambda: (1.0, 2.0), ("(1.0, 2.0)",)),
        (lambda: {"v": 1.0}, ("{'v': 1.0}",)),
        (lambda: "1", ("'1'",)),
        (lambda: float("nan"), ("c.u", "nan")),
    ],
)
def test_what_a_function_may_not_answer(answer, words):
    @part(inputs={"y": ""}, outputs={"u": ""})
    def c(t, y):
        return answer() if t > 0.3 else np.float64(1.0)

    with pytest.raises(master.PartFailed) as failed:
        master.run(loop(c))
    assert all(word in str(failed.value) for word in words), str(failed.value)
    assert failed.value.result.table["i.y"].iloc[2] == 0.25


def bare():
    return 1.0


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: part(bare), "@selflock.part\\(inputs="),
        (lambda: part(["y"], {"u": ""}), "inputs is a dictionary"),
        (lambda: part({}, {}), "without outputs"),
        (lambda: part({"u": ""}, {"u": ""}), "u cannot go in and come out"),
        (lambda: part({}, {"u": ""})(bare), "first argument is the time"),
        (lambda: part({"y": ""}, {"u": ""})(lambda t, x=1.0: x), "takes no y"),
        (lambda: part({}, {"u": ""})(lambda t, x: x), "x is none of the inputs"),
        (lambda: part({}, {"u": ""})(lambda t, *x: x), "x is none of the inputs"),
        (lambda: part({}, {"u": ""}, {"k": "m"})(lambda t: t), "no argument k"),
    ],
)
def test_slips_are_told_where_the_function_is_written(make, words):
    with pytest.raises(master.DescriptionError, match=words):
        make()


def test_classes_are_parts_in_python_alone(tmp_path):
    import small_parts

    own = {"g": master.Component(part=small_parts.Gain, start={"u": 2.0})}
    system = master.System(components=own, run=master.Run(stop=1.0, step=0.5))
    assert master.run(system).table["g.y"].iloc[-1] == 2.0  # nobody had to allow it
    again = master.load(save(system, tmp_path / "x.toml"), allow_code=True)
    assert again.components["g"].part == "small_parts:Gain"
    with pytest.raises(master.DescriptionError, match="Nothing of it was run"):
        master.run(tmp_path / "x.toml")
    system.components["g"] = master.Component(part=float)
    with pytest.raises(master.DescriptionError, match="part = <class 'float'>"):
        master.run(system)

    @part(inputs={}, outputs={"u": ""})
    def local(t):
        return t

    with pytest.raises(master.ResultError, match="which a file cannot name"):
        save(master.System(components={"l": master.Component(part=local)}), tmp_path / "y.toml")
