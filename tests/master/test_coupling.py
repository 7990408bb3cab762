"""Circles solved in a step, against the whole as one linear system: order of convergence in the step, and stiff joints."""

import numpy as np
import pytest
from scipy.linalg import expm
from test_algorithms import error, two_masses

from selflock import master

LOOP = {"a.u": "b.y", "b.u": "a.y"}
K, L = -3.0, 1.5  # the loop's gain is -4.5: a value that lags grows by that in each step


def loop(system, part, **run):
    """x' = u - x, y = x + through u, on each other; a pushes."""
    parts = {"a": (part, {"through": K, "push": 1.0, "x": 0.5}), "b": (part, {"through": L})}
    return system(parts, LOOP, stop=1.0, **run)


def whole(time):
    """The same without coupling: y_a = x_a + K y_b + 1, y_b = x_b + L y_a solved by hand; x' = A x + c."""
    at_once = np.linalg.inv(np.array([[1.0, -K], [-L, 1.0]]))  # y = at_once (x + push)
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])  # u = swap y
    a, c = swap @ at_once - np.eye(2), swap @ at_once @ [1.0, 0.0]
    block = np.zeros((3, 3))
    block[:2, :2], block[:2, 2] = a, c
    x = (expm(block * time) @ [0.5, 0.0, 1.0])[:2]
    return at_once @ (x + [1.0, 0.0])


@pytest.mark.alike
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel", "iterated"])
@pytest.mark.parametrize("part", ["Lag", "Stepped"])
def test_a_loop_converges_to_the_whole_with_first_order(system, part, algorithm):
    results = [master.run(loop(system, part, step=h, algorithm=algorithm)) for h in (0.05, 0.025, 0.0125)]
    errors = [np.abs(r.table.iloc[-1][["a.y", "b.y"]].to_numpy() - whole(1.0)).max() for r in results]
    assert errors[-1] < 0.01 and np.diff(np.log2(errors)) * -1 == pytest.approx([1.0, 1.0], abs=0.15)
    told = results[0].coupling.iloc[0]
    assert told.unknowns == 2 and told.residual <= 1e-5 and told.most <= 4 and not told.loose
    assert len(results[0].loops) == 1 and not results[0].lagging and f": {results[0].coupling.index[0]}" in results[0].summary()
    first = results[0].table.iloc[0]
    assert first[["a.y", "b.y"]].to_numpy() == pytest.approx(whole(0.0), abs=1e-9)


def test_what_can_only_step_lags_and_says_why(system, monkeypatch):
    import small_parts

    monkeypatch.setattr(small_parts.Stepped, "can_roll_back", False)
    result = master.run(loop(system, "Stepped", step=0.05))
    assert np.abs(result.table["a.y"]).max() > 1e6  # 4.5 to the 20th
    assert "lag by a step, for a, b do not roll back: " in result.summary() and result.coupling.empty


def test_what_says_nothing_of_its_dependences_lags_as_it_ever_did(system, monkeypatch):
    import small_parts

    silent = tuple(
        master.Variable("y", "", 0.0, causality="output") if v.name == "y" else v for v in small_parts.Stepped.described
    )
    monkeypatch.setattr(small_parts.Stepped, "described", silent)
    result = master.run(loop(system, "Stepped", step=0.05))
    assert "a, b do not say which outputs depend" in result.lagging[result.loops[0]]


def test_a_nonlinear_loop_that_repetition_cannot_solve(system):
    """a + b + c = 0, 2 a - 3 b + 2 c = 9, a² + b² + c² = 5: b = -9/5, and a, c solve 2 c² - 3.6 c + 1.48 = 0."""
    parts = {
        "a": ("Gain", {"gain": -1.0, "shift": 1.8, "u": 1.0}),  # where to begin: from 0 there is no root
        "b": ("Gain", {"gain": 0.0, "shift": -1.8}),
        "c": ("Rooted", {"b": -1.8}),
    }
    result = master.run(system(parts, {"a.u": "c.y", "b.u": "c.y", "c.a": "a.y"}, stop=0.1, step=0.1))
    roots = np.roots([2.0, -3.6, 1.48])
    assert np.abs(roots - result.table["c.y"].iloc[-1]).min() < 1e-8 and result.table["b.y"].iloc[-1] == -1.8


def test_a_loop_without_a_solution_ends_the_run_by_name(system):
    """y = u + 1 around."""
    description = system({"a": ("Lag", {"through": 1.0}), "g": ("Gain", {})}, {"a.u": "g.y", "g.u": "a.y"}, stop=1.0, step=0.1)
    with pytest.raises(master.DescriptionError, match="a.y -> g.y -> a.y|g.y -> a.y -> g.y"):
        master.run(description, settings={"a.x": 1.0})


def test_a_loop_that_loses_its_solution_on_the_way_ends_the_run_with_its_rows(system):
    """c = root of 5 - a², a = t + c: c is not negative until t = √5."""
    parts = {"i": ("Integrator", {"u": 1.0}), "a": "Sum", "c": ("Rooted", {"b": 0.0})}
    with pytest.raises(master.PartFailed, match="not settled") as failure:
        master.run(system(parts, {"a.u": "i.y", "a.w": "c.y", "c.a": "a.y"}, stop=4.0, step=0.1))
    table = failure.value.result.table
    assert table["time"].iloc[-1] == pytest.approx(2.2)
    t = table["i.y"].to_numpy()
    assert table["c.y"].to_numpy() == pytest.approx((np.sqrt(10.0 - t**2) - t) / 2.0, abs=1e-7)


def test_iterated_coupling_is_of_second_order_and_needs_no_order(system):
    errors = [error(master.run(two_masses(system, step=h, algorithm="iterated")).table) for h in (0.2, 0.1)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert errors[1] < error(master.run(two_masses(system, step=0.1)).table) / 2
    turned = [
        master.run(two_masses(system, step=0.1, algorithm="iterated", order=o)).table for o in (["a", "b", "s"], ["s", "b", "a"])
    ]
    assert np.abs(turned[0] - turned[1][turned[0].columns]).max().max() < 1e-4


def test_a_joint_too_stiff_for_the_step_stays_stable(system):
    """A spring of 1e6 N/m between 1 and 2 kg swings 195 times a second; with 1 ms Jacobi and Gauss-Seidel fly apart."""
    parts = {"a": ("Mass", {"v0": 1.0}), "b": ("Mass", {"mass": 2.0}), "s": ("Spring", {"stiffness": 1e8})}
    ends = {"a.force": "s.force", "b.force": "s.reaction", "s.v1": "a.v", "s.v2": "b.v"}

    def speeds(algorithm):
        table = master.run(system(parts, ends, stop=0.1, step=1e-3, algorithm=algorithm)).table
        return table[["a.v", "b.v"]].to_numpy()

    held = speeds("iterated")
    assert np.abs(held).max() < 1.5 and held @ [1.0, 2.0] == pytest.approx(np.ones(len(held)), abs=1e-4)
    assert np.abs(speeds("jacobi")).max() > 1e6 and np.abs(speeds("gauss-seidel")).max() > 1e6


def test_no_circle_no_iteration(system):
    parts = {"g": ("Gain", {"gain": 2.0}), "i": ("Integrator", {"u": 1.0})}
    result = master.run(system(parts, {"g.u": "i.y"}, stop=1.0, step=0.1, algorithm="iterated"))
    assert result.coupling.empty
    assert result.table["g.y"].to_numpy() == pytest.approx(2.0 * result.table["time"].to_numpy())


@pytest.mark.parametrize("part", ["Lag", "Stepped"])
def test_going_back_comes_to_the_same_bits(system, part):
    with master.session(loop(system, part, step=0.1)) as s:
        s.step(0.3)
        instant = s.snapshot()
        s.step(0.6)
        once = s.table.copy()
        s.restore(instant)
        s.step(0.6)
        assert s.table.equals(once)


def test_what_cannot_be_stepped_again_is_refused(system, refused, monkeypatch):
    import small_parts

    made = two_masses(system, step=0.1, algorithm="iterated")
    made.components["a"].step = 0.05
    refused(lambda: master.run(made), "iterated", "a has a step of its own")
    monkeypatch.setattr(small_parts.Spring, "can_roll_back", False)
    refused(lambda: master.run(two_masses(system, step=0.1, algorithm="iterated")), "iterated", "s does not roll back")


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("interface", ["me", "cs"])
def test_anybodys_fmus_on_a_loop(system, native, interface):
    """The FMU refuses y after u without a step, for co-simulation as the standard has it."""

    def ends(h):
        parts = {
            "a": (native("lag"), {"through": K, "x": 0.5}, {"interface": interface}),
            "b": (native("lag"), {"through": L}, {"interface": interface}),
            "p": ("Gain", {"shift": 1.0}),
        }
        made = system(parts, {"a.u": "b.y", "p.u": "a.y", "b.u": "p.y"}, stop=1.0, step=h)
        table = master.run(made).table
        return np.abs(table.iloc[-1][["p.y", "b.y"]].to_numpy() - whole(1.0)).max()

    errors = [ends(h) for h in (0.05, 0.025)]
    assert errors[1] < 0.03 and np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("interface", ["me", "cs"])
def test_newton_uses_an_fmus_own_derivatives_where_it_has_them(system, native, monkeypatch, interface):
    from selflock.master import secant

    monkeypatch.setattr(secant, "PLAIN", -secant.REMEMBERED)  # no evaluation without derivatives
    parts = {name: (native("lag"), {"through": t}, {"interface": interface}) for name, t in (("a", K), ("b", L))}
    parts["a"][1]["x"] = 1.0
    made = system(parts, LOOP, stop=0.2, step=0.1, record=["a.y", "b.y", "a.asked"])
    result = master.run(made)
    first, asked = result.table.iloc[0], result.table["a.asked"].iloc[-1]
    assert first["a.y"] == pytest.approx(1.0 / (1.0 - K * L)) and first["b.y"] == pytest.approx(L / (1.0 - K * L))
    assert (asked > 0.0) == (interface == "me")  # of co-simulation they are of an instant, not of a step


@pytest.mark.parametrize("algorithm, order", [("gauss-seidel", 2.0), ("jacobi", 1.5), ("iterated", 2.0)])
def test_fmus_that_interpolate_their_inputs_make_the_coupling_better(system, native, algorithm, order):
    """x' = y_b - x, x_b' = -4 x - x_b: u goes straight on over a step instead of being held."""

    def off(h, **run):
        parts = {"a": (native("lag"), {"x": 1.0}), "b": native("lag")}
        made = system(parts, {"a.u": "b.y"}, stop=1.0, step=h, algorithm=algorithm, **run)
        made.connections["b.u"] = master.Connection("a.y", factor=-4.0)
        row = master.run(made).table.iloc[-1]
        return np.abs(row[["a.y", "b.y"]].to_numpy() - expm(np.array([[-1.0, 1.0], [-4.0, -1.0]]))[:, 0]).max()

    errors = [off(h, input_derivatives=True) for h in (0.1, 0.05)]
    assert np.log2(errors[0] / errors[1]) > order - 0.25 and errors[1] < off(0.05) / 2


def test_an_input_from_a_function_of_time_goes_straight_between_its_points(system, native):
    """x' = sin t - x from 0: (sin t - cos t + exp(-t)) / 2; for a line between points the error is of second order."""

    def off(h):
        made = system({"c": "Clock", "a": native("lag")}, {}, stop=1.0, step=h, input_derivatives=True)
        made.connections["a.u"] = master.Connection("c.angle", convert=False)
        table = master.run(made).table
        t = table["time"].to_numpy()
        return np.abs(table["a.y"].to_numpy() - 0.5 * (np.sin(t) - np.cos(t) + np.exp(-t))).max()

    errors = [off(0.1), off(0.05)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1) and errors[1] < 1e-4
