"""Faults on purpose."""

import math
import random
from decimal import Decimal

import numpy as np
import pytest

from selflock import master


def table(system, *faults, **run):
    """A ramp y = t through a gain, with faults."""
    parts = {"i": ("Integrator", {"u": 1.0}), "g": "Gain"}
    description = system(parts, {"g.u": "i.y"}, stop=1.0, step=0.01, record=["i.y", "g.y"], **run)
    description.faults = [master.Fault(**fault) for fault in faults]
    return master.run(description).table.set_index("time")


def at(table, name, *times):
    return [table[name].iloc[round(t / 0.01)] for t in times]


def test_stuck(system):
    got = table(system, dict(variable="i.y", kind="stuck", start=0.3, stop=0.6))
    assert at(got, "g.y", 0.2, 0.3, 0.5, 0.7) == pytest.approx([0.2, 0.3, 0.3, 0.7])
    got = table(system, dict(variable="i.y", kind="stuck", start=0.3, value=5.0))
    assert at(got, "i.y", 0.2, 0.3, 1.0) == pytest.approx([0.2, 5.0, 5.0])


def test_a_fault_on_an_input_is_seen_by_that_part_alone(system):
    got = table(system, dict(variable="g.u", kind="offset", value=2.0, start=0.3, stop=0.6))
    assert at(got, "i.y", 0.2, 0.5) == pytest.approx([0.2, 0.5])
    assert at(got, "g.y", 0.2, 0.5, 0.8) == pytest.approx([0.2, 2.5, 0.8])


def test_a_fault_on_an_input_that_is_held_goes_by(system):
    """An offset grew with every step, and stayed behind its window."""
    description = system({"g": ("Gain", {"u": 1.0})}, stop=0.5, step=0.1, record=["g.*"])
    description.faults = [master.Fault("g.u", "offset", 0.1, stop=0.3, value=1.0)]
    assert master.run(description).table["g.y"].tolist() == [1.0, 1.0, 2.0, 2.0, 1.0, 1.0]
    description.components["g"].step = 0.05
    assert master.run(description).table["g.y"].tolist() == [1.0, 1.0, 2.0, 2.0, 1.0, 1.0]
    with master.session(description) as s:
        s.step(until=0.2)
        s["g.u"] = 3.0
        assert s["g.u"] == 3.0
        s.step(until=0.5)
    assert s.table["g.y"].tolist() == [1.0, 1.0, 2.0, 4.0, 3.0, 3.0]


def test_drop_out(system):
    got = table(system, dict(variable="i.y", kind="drop-out", start=0.3, stop=0.6))
    assert at(got, "g.y", 0.2, 0.5, 0.8) == pytest.approx([0.2, 0.0, 0.8])


def test_delay(system):
    got = table(system, dict(variable="i.y", kind="delay", delay=0.105, start=0.3))
    assert at(got, "g.y", 0.2, 0.3, 0.9) == pytest.approx([0.2, 0.195, 0.795])


def test_noise_repeats_with_its_seed(system):
    fault = dict(variable="i.y", kind="noise", deviation=0.1, start=0.0)
    one, again, other = (table(system, fault | {"seed": seed})["i.y"] for seed in (1, 1, 2))
    assert one.equals(again) and not one.equals(other)
    noise = one - one.index
    assert abs(noise.mean()) < 0.04 and noise.std() == pytest.approx(0.1, rel=0.3)


def test_a_source_of_time_can_fail_too(system):
    description = system({"c": "Clock", "l": ("Listener", {"w": 0.0})}, {"l.u": "c.angle"}, stop=1.0, step=0.1)
    description.faults = [master.Fault("c.angle", "offset", 0.0, value=10.0)]
    assert np.allclose(master.run(description).table["c.angle"], 10 + np.sin(np.arange(11) * 0.1))


def test_a_tunable_parameter_is_put_back(system, monkeypatch):
    import small_parts

    gain = small_parts.real("gain", "parameter", "", 1.0, variability="tunable")
    monkeypatch.setattr(small_parts.Gain, "described", (gain, *small_parts.Gain.described[1:]))
    got = table(system, dict(variable="g.gain", kind="stuck", value=-1.0, start=0.3, stop=0.6))
    assert at(got, "g.y", 0.2, 0.5, 0.8) == pytest.approx([0.2, -0.5, 0.8])


@pytest.mark.parametrize(
    "fault, words",
    [
        (dict(variable="i.z", kind="stuck"), ["i has no variable z"]),
        (dict(variable="i.y", kind="offset"), ["needs the value"]),
        (dict(variable="i.y", kind="delay"), ["a delay above zero"]),
        (dict(variable="i.y", kind="noise", deviation=1.0), ["seed"]),
        (dict(variable="i.y", kind="noise", seed=1), ["deviation above zero"]),
        (dict(variable="i.y", kind="stuck", stop=0.1), ["after its start"]),
        (dict(variable="g.gain", kind="stuck", value=1.0), ["tunable"]),
    ],
)
def test_checks(system, refused, fault, words):
    refused(lambda: table(system, {"start": 0.5, **fault}), *words)


FROM_THE_START = [
    ("i.y", dict(kind="offset", value=2.0), 2.0),
    ("i.y", dict(kind="stuck", value=7.0), 7.0),
    ("i.y", dict(kind="drop-out"), 0.0),
    ("i.y", dict(kind="noise", deviation=1.0, seed=3), random.Random(3).gauss(0.0, 1.0)),
    ("c.u", dict(kind="offset", value=2.0), 2.0),
    ("l.angle", dict(kind="offset", value=2.0), 2.0),
]


@pytest.mark.parametrize("variable, fault, seen", FROM_THE_START)
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_a_fault_from_the_start_on_is_in_the_first_row_of_all_who_listen(system, variable, fault, seen, algorithm):
    """The initial values were settled without it: who listened gave a right value at first."""
    parts = {"i": ("Integrator", {"u": 0.0}), "l": "Clock", "c": ("Gain", {"gain": 3.0}), "d": ("Gain", {"gain": 2.0})}
    source = "l.angle" if variable == "l.angle" else "i.y"
    made = system(parts, {"c.u": source, "d.u": "c.y"}, stop=0.01, step=0.001, algorithm=algorithm, record=["*"])
    made.faults = [master.Fault(variable, start=0.0, **fault)]
    first = master.run(made).table.iloc[0]
    assert first[["c.u", "c.y", "d.y"]].tolist() == pytest.approx([seen, 3.0 * seen, 6.0 * seen], rel=1e-12)
    assert first[source] == (seen if variable == source else 0.0)  # the same draw of a noise, too


def test_an_input_that_nothing_feeds_is_wrong_from_the_first_row_and_right_afterwards(system):
    made = system({"g": ("Gain", {"u": 1.0})}, stop=0.4, step=0.1, record=["g.*"])
    made.faults = [
        master.Fault("g.u", "offset", 0.0, stop=0.2, value=1.0),
        master.Fault("g.u", "offset", 0.0, stop=0.3, value=4.0),
    ]
    assert master.run(made).table["g.y"].tolist() == [6.0, 6.0, 6.0, 5.0, 1.0]


def test_a_parameter_that_is_wrong_from_the_start_is_so_in_the_first_row(system, monkeypatch):
    import small_parts

    gain = small_parts.real("gain", "parameter", "", 1.0, variability="tunable")
    monkeypatch.setattr(small_parts.Gain, "described", (gain, *small_parts.Gain.described[1:]))
    made = system({"g": ("Gain", {"u": 1.0})}, stop=0.3, step=0.1, record=["g.y"])
    made.faults = [master.Fault("g.gain", "stuck", 0.0, stop=0.2, value=-1.0)]
    assert master.run(made).table["g.y"].tolist() == [-1.0, -1.0, -1.0, 1.0]


@pytest.mark.parametrize("kind, first", [("offset", (0.8, 1.6)), ("stuck", (1.0, 2.0))])
def test_an_algebraic_loop_begins_with_the_fault_in_it(system, kind, first):
    """A loop whose gain is 4, which no passing on of values solves."""
    parts = {"a": ("Gain", {"gain": 2.0}), "b": ("Gain", {"gain": -2.0})}
    made = system(parts, {"a.u": "b.y", "b.u": "a.y"}, stop=0.1, step=0.1, record=["*"])
    made.faults = [master.Fault("b.y", kind, 0.0, value=4.0 if kind == "offset" else 1.0)]
    table = master.run(made).table  # offset: y = 4 - 2 · 2 y, y = 0.8
    assert table[["b.y", "a.y"]].iloc[0].tolist() == pytest.approx(first)


@pytest.mark.parametrize("start, step", [(0.0, 0.1), (0.1, 0.001), (1.7, 0.01), (1000.1, 0.003)])
@pytest.mark.parametrize("variable", ["i.y", "g.gain"])
def test_windows_begin_and_end_at_the_step_that_they_name(system, monkeypatch, start, step, variable):
    """A window for each step; sums of steps miss the numbers that are written by their last bit."""
    import small_parts

    gain = small_parts.real("gain", "parameter", "", 0.0, variability="tunable")
    monkeypatch.setattr(small_parts.Gain, "described", (gain, *small_parts.Gain.described[1:]))
    parts, count = {"i": ("Integrator", {"u": 0.0}), "g": ("Gain", {"u": 1.0, "gain": 0.0})}, 200
    times = [float(Decimal(str(start)) + k * Decimal(str(step))) for k in range(count + 1)]
    made = system(parts, start=start, step=step, stop=times[-1], record=["i.y", "g.y"])
    made.faults = [master.Fault(variable, "stuck", times[k], stop=times[k + 1], value=k + 1.0) for k in range(count)]
    table = master.run(made).table
    expected = [*range(1, count + 1), 0] if variable == "i.y" else [1, *range(1, count + 1)]  # it is set before a step
    assert table["i.y" if variable == "i.y" else "g.y"].tolist() == expected


@pytest.mark.parametrize(
    "fault, words",
    [
        (dict(variable="i.y", kind="offset", value=math.nan), ["[[faults]] i.y: its value = nan is no number"]),
        (dict(variable="i.y", kind="drop-out", value=math.inf), ["its value = inf is no number"]),
        (dict(variable="i.y", kind="stuck", deviation=3.0), ["deviation is nothing of the kind stuck, which knows value"]),
        (dict(variable="i.y", kind="delay", delay=0.1, value=0.0), ["value is nothing of the kind delay, which knows delay"]),
        (dict(variable="i.y", kind="offset", value=1.0, seed=0), ["seed is nothing of the kind offset"]),
    ],
)
def test_what_is_said_of_a_fault_is_of_its_kind_and_a_number(system, refused, fault, words):
    refused(lambda: table(system, {"start": 0.5, **fault}), *words)


@pytest.mark.parametrize(
    "window, words",
    [
        ((5.0, math.inf), "i.y, stuck: it begins at 5 s, after the end of the run at 1 s, and is not seen"),
        ((-2.0, 0.0), "i.y, stuck: it ends at 0 s, before the run begins at 0 s, and is not seen"),
        ((0.5, 9.0), None),
    ],
)
def test_a_window_beside_the_run_is_noted(system, window, words):
    made = system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=0.1)
    made.faults = [master.Fault("i.y", "stuck", *window)]
    notes = master.run(made).notes
    assert len(notes) == (words is not None) and all(words in note for note in notes)
