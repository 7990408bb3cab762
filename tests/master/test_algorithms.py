"""Coupling against closed forms: orders of convergence, own steps, time."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from selflock import master

TWO_MASSES = {"a.force": "s.force", "b.force": "s.reaction", "s.v1": "a.v", "s.v2": "b.v"}


def two_masses(system, **run):
    """Two masses on springs to the wall, a spring between them that a third part integrates."""
    return system(
        {
            "a": ("Mass", {"stiffness": 2.0, "damping": 0.1, "v0": 1.0}),
            "b": ("Mass", {"mass": 2.0, "stiffness": 1.0}),
            "s": ("Spring", {"stiffness": 3.0, "length": 1.0}),
        },
        TWO_MASSES,
        stop=2.0,
        **run,
    )


def exact(time):
    """The same as one linear system: x1, v1, x2, v2, length."""
    a = np.array([[0, 1, 0, 0, 0], [-2, -0.1, 0, 0, 3], [0, 0, 0, 1, 0], [0, 0, -0.5, 0, -1.5], [0, -1, 0, 1, 0]])
    return expm(a * time) @ [0, 1.0, 0, 0, 1.0]


def error(table):
    last = table.iloc[-1]
    return float(np.abs(last[["a.x", "a.v", "b.x", "b.v"]].to_numpy() - exact(last["time"])[:4]).max())


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
@pytest.mark.slow
def test_converges_to_the_monolithic_solution_with_first_order(system, algorithm):
    errors = [error(master.run(two_masses(system, step=h, algorithm=algorithm)).table) for h in (0.02, 0.01, 0.005)]
    orders = np.diff(np.log2(errors)) * -1
    assert orders == pytest.approx([1.0, 1.0], abs=0.1)


def test_gauss_seidel_beats_jacobi_on_an_oscillator(system):
    errors = {name: error(master.run(two_masses(system, step=0.01, algorithm=name)).table) for name in ("jacobi", "gauss-seidel")}
    assert errors["gauss-seidel"] < errors["jacobi"]


def test_jacobi_does_not_depend_on_the_order(system):
    tables = [
        master.run(two_masses(system, step=0.01, algorithm="jacobi", order=order)).table
        for order in (["a", "b", "s"], ["s", "b", "a"])
    ]
    assert tables[0].equals(tables[1])


def test_a_smaller_step_of_one_part_still_converges(system):
    errors = []
    for h in (0.02, 0.01, 0.005):
        description = two_masses(system, step=h)
        description.components["s"].step = h / 4
        errors.append(error(master.run(description).table))
    assert np.diff(np.log2(errors)) * -1 == pytest.approx([1.0, 1.0], abs=0.15)


def test_a_larger_step_of_one_part_still_converges(system):
    errors = []
    for h in (0.02, 0.01, 0.005):
        description = two_masses(system, step=h)
        description.components["b"].step = 2 * h
        errors.append(error(master.run(description).table))
    assert np.diff(np.log2(errors)) * -1 == pytest.approx([1.0, 1.0], abs=0.2)


def heard(description):
    """What the Listener `l` got at its steps: rows of time, size, u, w."""
    got = {}
    master.run(description, observe=lambda time, parts: got.update(rows=parts["l"].heard))
    return np.array(got["rows"])


def test_inputs_of_small_steps_are_interpolated_where_the_source_went_first(system):
    def ramp(order, algorithm="gauss-seidel"):
        parts = {"i": ("Integrator", {"u": 1.0}), "l": ("Listener", {"w": 0.0}, {"step": 0.025})}
        return heard(system(parts, {"l.u": "i.y"}, stop=0.3, step=0.1, order=order, algorithm=algorithm))

    rows = ramp(["i", "l"])
    assert rows[:, 2] == pytest.approx(rows[:, 0] + rows[:, 1])  # y = t, as it is at the end of each small step
    for rows in (ramp(["l", "i"]), ramp(["i", "l"], "jacobi")):
        assert rows[:, 2] == pytest.approx(np.floor(rows[:, 0] / 0.1 + 1e-9) * 0.1)  # held at the macro step's start


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_feedback_to_small_steps_is_carried_on_by_its_derivative(system, algorithm):
    parts = {"l": ("Listener", {}, {"step": 0.025}), "w": "Wheel"}
    ends = {"l.u": "w.angle", "l.w": "w.speed"}
    rows = heard(system(parts, ends, stop=0.3, step=0.1, algorithm=algorithm, record=["w.angle"]))
    assert rows[:, 2] == pytest.approx(2.0 * rows[:, 0])
    assert rows[:, 3] == pytest.approx(2.0)


@pytest.mark.parametrize("samples", [True, False])
def test_what_a_sampled_controller_gives_is_there_as_its_step_begins(system, samples):
    """As it is where all take its step; held until its end, as FMI's outputs are, it would act a period late."""
    parts = {
        "g": ("Gain", {"gain": 2.0}, {"step": 0.4, "samples": samples}),
        "i": ("Integrator", {"u": 1.0}),
        "l": ("Listener", {"w": 0.0}),
    }
    made = system(parts, {"g.u": "i.y", "l.u": "g.y"}, stop=1.2, step=0.1, order=["g", "i", "l"], hold_outputs=not samples)
    rows = heard(made)
    since = 0.4 * np.floor(rows[:, 0] / 0.4 + 1e-9)
    late = np.where(np.arange(12) % 4 == 3, since, since - 0.4)
    assert rows[:, 2] == pytest.approx(2.0 * (since if samples else np.maximum(late, 0.0)))


def test_outputs_of_large_steps_are_shown_on_a_line(system):
    description = system(
        {"i": ("Integrator", {"u": 1.0}, {"step": 0.4}), "l": ("Listener", {"w": 0.0})}, {"l.u": "i.y"}, stop=1.2, step=0.1
    )
    rows = heard(description)
    assert rows[:, 2] == pytest.approx(rows[:, 0] + 0.1)
    table = master.run(description).table
    assert table["i.y"].to_numpy() == pytest.approx(table["time"].to_numpy())


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_functions_of_time_are_evaluated_where_the_listener_steps(system, algorithm):
    parts = {"c": "Clock", "l": ("Listener", {"w": 0.0}, {"step": 0.02}), "m": ("Listener", {"w": 0.0})}
    description = system(parts, {"l.u": "c.angle", "m.u": "c.angle"}, stop=1.0, step=0.1, algorithm=algorithm)
    rows = heard(description)
    assert rows[:, 2] == pytest.approx(np.sin(rows[:, 0]), abs=1e-15)
    table = master.run(description).table
    assert table["c.angle"].to_numpy() == pytest.approx(np.sin(table["time"].to_numpy()), abs=1e-15)


def test_time_does_not_drift(system):
    description = system({"l": ("Listener", {"u": 0.0, "w": 0.0})}, stop=1000.0, step=0.1, interval=1.0)
    table = master.run(description).table
    assert table["time"].iloc[-1] == 1000.0
    assert len(table) == 1001
    assert np.abs(table["time"] - np.arange(1001)).max() < 1e-12


def test_factor_and_offset(system):
    description = system({"l": ("Listener", {"w": 0.0}), "g": ("Gain", {"u": 3.0})}, stop=0.1, step=0.1)
    description.connections["l.u"] = master.Connection("g.y", factor=2.0, offset=1.0)
    assert heard(description)[0, 2] == 7.0


def test_every_type_travels(system):
    ends = {"b.flag": "a.flag_out", "b.count": "a.count_out", "b.word": "a.word_out"}
    table = master.run(
        system({"a": ("Types", {"flag": True, "count": 1, "word": "x"}), "b": "Types"}, ends, stop=0.3, step=0.1)
    ).table
    assert [str(table[f"b.{n}"].dtype) for n in ("flag_out", "count_out")] == ["bool", "int64"]
    assert table["a.word_out"].to_list() == ["a", "xb", "xb", "xb"]
    assert table["b.word_out"].to_list() == ["a", "xbb", "xbb", "xbb"]


def test_observer_and_progress_see_every_step(system):
    seen, told = [], []
    master.run(
        system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=0.25),
        observe=lambda t, parts: seen.append((t, parts["i"].get("y"))),
        progress=told.append,
    )
    assert seen == [(0.0, 0.0), (0.25, 0.25), (0.5, 0.5), (0.75, 0.75), (1.0, 1.0)]
    assert told[-1] == 1.0 and math.isclose(told[1], 0.25)
