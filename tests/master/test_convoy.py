"""The compiled loop does what the algorithms in Python do, to the last bit."""

import math
import signal

import numpy as np
import pytest

from selflock import master
from selflock.master import running, simulation


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


@pytest.mark.parametrize("stop", [2.0, 1.98])  # also where the last of its steps goes beyond the run
def test_what_samples_does_so_once_in_several_macro_steps(monkeypatch, caplog, native, algorithm, stop):
    """It was stepped in Python, and all FMUs beside it: five times the time of a house whose thermostat samples."""
    description = ring(native, algorithm, stop=stop)
    description["components"]["i1"] |= {"step": 0.05, "samples": True}
    caplog.set_level("DEBUG", "selflock")
    slow, fast = both_ways(monkeypatch, description)
    same(slow, fast)
    assert [r.message for r in caplog.records].count("all 3 FMUs are stepped in one compiled loop") == 1
    stairs = fast.table["i1.x"].to_numpy()[1:]
    assert np.array_equal(stairs, np.repeat(stairs[::5], 5)[: len(stairs)]) and np.unique(stairs).size > 30


@pytest.mark.parametrize("ends_at", [1e9, 1.5])
def test_fmus_of_fmi_3(monkeypatch, native, algorithm, ends_at):
    """Beside those of FMI 2.0; an event that they tell of and an end of their own are handled where they are."""
    description = ring(native, algorithm)
    for k in (0, 2):
        description["components"][f"i{k}"]["fmu"] = native("relaxation3")
    description["components"]["i2"]["start"]["ends_at"] = ends_at
    slow, fast = both_ways(monkeypatch, description)
    same(slow, fast)
    assert slow.ended == fast.ended == ({"i2": 1.5} if ends_at < 2.0 else {}) and fast.time == min(ends_at, 2.0)
    pure = ring(native, algorithm)
    assert ends_at < 2.0 or master.run(master.from_dict(pure)).table[fast.table.columns].equals(fast.table)


@pytest.mark.slow
@pytest.mark.alike
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
    description["components"]["a"] |= {"step": 0.2, "samples": True}
    same(*both_ways(monkeypatch, description))


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


def fed(native, algorithm, count, held=()):
    """FMUs in a row, fed by functions of time that tell a stretch at once; one is held, one scaled."""
    time = np.arange(0.0, 31.0, 0.013)
    columns = {"u": np.sin(time), "v": np.cos(3.0 * time)}
    options = {"time": time, "columns": columns, "types": {"u": "Real", "v": "Integer" if held else "Real"}}
    described = ring(native, algorithm, count, stop=30.0)
    described["components"]["log"] = {"part": "selflock.diagnosis.systems.parts:Signals", "options": options}
    described["connections"] = {f"i{k}.u": f"i{k - 1}.x" for k in range(1, count)}
    described["connections"]["i0.u"] = "log.u"
    if count > 2:
        described["connections"]["i2.u"] = {"from": "log.v", "factor": 2.0, "offset": 0.3}
    described["run"]["record"] = [f"i{k}.x" for k in range(count)]
    return described


@pytest.mark.alike
@pytest.mark.parametrize("count, held", [(1, ()), (3, ()), (3, ("v",))])
def test_functions_of_time_feed_the_loop(monkeypatch, native, algorithm, count, held):
    described = fed(native, algorithm, count, held)
    slow, fast = both_ways(monkeypatch, described)
    same(slow, fast)
    assert all(slow.table[name].std() > 0.1 for name in slow.table)
    described["components"]["i0"] |= {"step": 0.05, "samples": True}
    same(*both_ways(monkeypatch, described))


def test_rows_are_whole_whenever_they_are_kept(monkeypatch, native, algorithm, tmp_path):
    """A file keeps them from a thread of its own, also just when the loop is through and functions of time are not told yet."""
    described = fed(native, algorithm, 2)
    described["run"]["record"] += ["log.u", "log.v"]
    monkeypatch.setattr(simulation, "WORTH", 0)
    expected = master.run(master.from_dict(described), allow_code=True).table
    kept, begin = [], running.Recorder.__init__

    class Told(list):
        def __iter__(self):
            kept.append(self.sink.save())
            return super().__iter__()

    def begun(recorder, wiring, seats, sink):
        begin(recorder, wiring, seats, sink)
        recorder.told = Told(recorder.told)
        recorder.told.sink = sink

    monkeypatch.setattr(running.Recorder, "__init__", begun)
    written = master.run(master.from_dict(described), out=tmp_path / "r.parquet", allow_code=True)
    assert kept and master.read(written.path)[0].equals(expected)


@pytest.mark.alike
def test_such_a_function_that_is_recorded_or_wrong_is_looked_at_in_python(monkeypatch, native, algorithm):
    recorded = fed(native, algorithm, 2)
    recorded["run"]["record"].append("log.u")
    wrong = fed(native, algorithm, 2)
    wrong["faults"] = [{"variable": "log.u", "kind": "offset", "start": 1.0, "stop": 20.0, "value": 0.5}]
    for described in (recorded, wrong):
        same(*both_ways(monkeypatch, described))


def test_a_discarded_step_takes_its_own_row_of_what_is_fed(monkeypatch, native, algorithm):
    """Balls bounce beside what is fed: the loop goes on behind the one that was finished in Python."""
    described = fed(native, algorithm, 1)
    described["components"] = {"ball": {"fmu": native("ball")}, **described["components"]}
    described["run"]["record"].append("ball.height")
    described["run"] |= {"stop": 3.0, "step": 0.05}
    same(*both_ways(monkeypatch, described))


@pytest.mark.slow
def test_a_session_is_what_the_compiled_loop_does(monkeypatch, native, algorithm):
    """Stepped in Python, looked at, gone back: the compiled run to the bit."""
    monkeypatch.setattr(simulation, "WORTH", 0)
    description = master.from_dict(ring(native, algorithm))
    whole = master.run(description)
    with master.session(description) as s:
        s.step(until=0.5)
        here = s.snapshot()
        s.step(until=1.0)
        s.restore(here)
        while s.time < 2.0 - 1e-9:
            s.step()
            assert s["i0.x"] == s["i0.x"]
    same(s.result, whole)


@pytest.mark.slow
def test_ctrl_c_ends_the_compiled_loop_between_stretches(monkeypatch, native, tmp_path):
    monkeypatch.setattr(simulation, "WORTH", 0)
    description = master.from_dict(ring(native, "jacobi", stop=30.0))
    told = []

    def pressed(fraction):
        told.append(fraction)
        if fraction > 0.1:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(master.RunInterrupted) as stopped:
        master.run(description, progress=pressed, out=tmp_path / "x.parquet")
    result = stopped.value.result
    assert 1 <= len(told) < 5 and len(master.read(tmp_path / "x.parquet")[0]) == result.steps + 1 < 3001
    assert result.table["i0.x"].tolist() == master.run(description, stop=result.time).table["i0.x"].tolist()
