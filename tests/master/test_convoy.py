"""The compiled loop does what the algorithms in Python do, to the last bit."""

import math

import pytest

from selflock import master
from selflock.master import simulation


@pytest.fixture(params=["jacobi", "gauss-seidel"])
def algorithm(request):
    return request.param


def both_ways(monkeypatch, description, **options):
    """The same run in Python and in the compiled loop."""
    results = []
    for worth in (math.inf, 0):
        monkeypatch.setattr(simulation, "WORTH", worth)
        results.append(master.run(master.from_dict(description), allow_code=True, **options))
    return results


def ring(native, algorithm, count=3, **run):
    return {
        "run": {"step": 0.01, "stop": 2.0, "algorithm": algorithm, **run},
        "components": {f"i{k}": {"fmu": native("relaxation"), "start": {"rate": 1.0 + k}} for k in range(count)},
        "connections": {
            f"i{k}.u": {"from": f"i{(k + 1) % count}.x", "factor": 1.0 - 0.1 * k, "offset": 0.1} for k in range(count)
        },
    }


def same(a, b):
    assert a.table.equals(b.table)
    assert a.energy.equals(b.energy)
    assert a.steps == b.steps


def test_a_ring_of_native_fmus(monkeypatch, native, algorithm):
    slow, fast = both_ways(monkeypatch, ring(native, algorithm))
    same(slow, fast)
    assert slow.table["i0.x"].std() > 0.0


def test_rows_at_an_interval_and_more_rows_than_are_kept_at_once(monkeypatch, native, algorithm, tmp_path):
    slow, fast = both_ways(monkeypatch, ring(native, algorithm, step=0.001, stop=30.0, interval=0.003))
    same(slow, fast)
    assert len(fast.table) == 10001
    monkeypatch.setattr(simulation, "WORTH", 0)
    written = master.run(
        master.from_dict(ring(native, algorithm, step=0.001, stop=30.0, interval=0.003)), out=tmp_path / "r.parquet"
    )
    table, _ = master.read(written.path)
    assert table.equals(slow.table)


def test_bonds_booleans_and_parts_in_between(monkeypatch, algorithm):
    """Controller, motor and gear in a convoy, a load in Python before them; torque and speed are bonds, `stuck` a Boolean."""
    description = {
        "run": {"step": 0.001, "stop": 0.3, "algorithm": algorithm, "open_inputs": True},
        "components": {
            "load": {"part": "small_parts:Mass", "start": {"mass": 0.2}},
            "motor": {"fmu": "selflock:Motor", "start": {"voltage": 6.0}},
            "reducer": {
                "fmu": "selflock:Reducer",
                "start": {"friction_kinetic": 0.01, "friction_static": 0.01, "shaft_stiffness": 2000.0},
            },
        },
        "connections": {
            "motor.speed": "reducer.input_speed",
            "reducer.motor_torque": "motor.torque",
            "load.force": {"from": "reducer.output_torque", "convert": False},
            "reducer.output_angle": {"from": "load.x", "convert": False},
            "reducer.output_speed": {"from": "load.v", "convert": False},
        },
    }
    slow, fast = both_ways(monkeypatch, description)
    same(slow, fast)
    assert len(fast.energy) >= 1
    assert fast.table["reducer.stuck"].dtype == bool


def test_a_discarded_step_is_finished_and_the_run_goes_on(monkeypatch, native, algorithm):
    description = {
        "run": {"step": 0.05, "stop": 3.0, "algorithm": algorithm},
        "components": {"a": {"fmu": native("ball")}, "b": {"fmu": native("ball")}},
    }
    slow, fast = both_ways(monkeypatch, description)
    same(slow, fast)


@pytest.mark.slow
def test_a_failure_keeps_the_rows_before_it(monkeypatch, native, algorithm):
    description = ring(native, algorithm)
    description["components"]["t"] = {
        "fmu": native("teller"),
        "start": {"ends_at": 0.5, "end": 4, "count_in": 1, "flag_in": True, "word_in": "a"},
    }
    tables = []
    for worth in (math.inf, 0):
        monkeypatch.setattr(simulation, "WORTH", worth)
        system = master.from_dict(description)
        system.run.open_inputs = True
        system.run.record = ["i0.x"]
        with pytest.raises(master.PartFailed, match="^t answered") as failure:
            master.run(system)
        tables.append(failure.value.result.table)
    assert tables[0].equals(tables[1])
    assert 0.4 < tables[1]["time"].iloc[-1] <= 0.5
