"""Initial values in the order in which they depend on each other."""

import pytest

from selflock import master


def test_a_chain_is_evaluated_from_its_source_whatever_the_order(system):
    parts = {name: ("Gain", {"gain": 2.0}) for name in ("d", "b", "c")} | {"a": ("Gain", {"u": 1.0, "gain": 2.0})}
    table = master.run(system(parts, {"d.u": "c.y", "c.u": "b.y", "b.u": "a.y"}, stop=0.1, step=0.1)).table
    assert table.loc[0, ["a.y", "b.y", "c.y", "d.y"]].to_list() == [2.0, 4.0, 8.0, 16.0]


def test_no_loop_where_an_output_does_not_depend_on_its_input(system):
    result = master.run(
        system({"i": "Integrator", "g": ("Gain", {"shift": 1.0})}, {"i.u": "g.y", "g.u": "i.y"}, stop=0.1, step=0.1)
    )
    assert result.loops == []


def test_a_loop_that_settles_is_solved_and_named(system):
    parts = {"a": ("Gain", {"gain": 0.5, "shift": 1.0}), "b": ("Gain", {"gain": -0.5})}
    result = master.run(system(parts, {"a.u": "b.y", "b.u": "a.y"}, stop=0.1, step=0.1))
    assert result.table.loc[0, "a.y"] == pytest.approx(1.0 / 1.25, abs=1e-9)
    assert len(result.loops) == 1 and "a.y" in result.loops[0] and "b.y" in result.loops[0]
    assert "algebraic loop" in result.summary()


def test_a_loop_that_does_not_settle_is_refused_by_name(system, refused):
    parts = {"a": ("Gain", {"gain": 2.0, "shift": 1.0}), "b": ("Gain", {"gain": 0.5})}  # a = a + 1
    refused(lambda: master.run(system(parts, {"a.u": "b.y", "b.u": "a.y"}, stop=0.1, step=0.1)), "a.y", "b.y", "same instant")


def test_a_loop_that_repetition_would_not_settle_is_solved(system):
    """a = 2 b + 1, b = 2 a."""
    parts = {"a": ("Gain", {"gain": 2.0, "shift": 1.0}), "b": ("Gain", {"gain": 2.0})}
    table = master.run(system(parts, {"a.u": "b.y", "b.u": "a.y"}, stop=0.1, step=0.1)).table
    assert table.loc[0, ["a.y", "b.y"]].to_list() == pytest.approx([-1.0 / 3.0, -2.0 / 3.0], abs=1e-9)


def test_a_part_connected_to_itself(system):
    result = master.run(system({"a": ("Gain", {"gain": 0.5, "shift": 1.0})}, {"a.u": "a.y"}, stop=0.1, step=0.1))
    assert result.table.loc[0, "a.y"] == pytest.approx(2.0, abs=1e-8)
    assert result.loops == ["a.y -> a.y"]
