"""FMUs in a process of their own."""

import gc
import os

import pytest

from selflock import master
from selflock.master.process import ProcessPart


@pytest.mark.slow
def test_the_same_bits_as_inside(system, counter, native):
    for path, start in ((counter, {"u": 0.3}), (native("relaxation"), {"u": 2.0, "rate": 7.0})):
        description = system({"a": (path, start)}, stop=1.0, step=0.1)
        inside = master.run(description).table
        description.components["a"].process = True
        assert master.run(description).table.equals(inside)


@pytest.mark.slow
def test_jacobi_in_processes_side_by_side(system, counter):
    parts = {name: (counter, {"gain": 0.5}, {"process": name != "c"}) for name in "abc"}
    ends = {"a.u": "b.n", "b.u": "c.sum", "c.u": "a.sum"}
    description = system(parts, ends, stop=1.0, step=0.1, algorithm="jacobi")
    apart = master.run(description).table
    for component in description.components.values():
        component.process = False
    assert master.run(description).table.equals(apart)


@pytest.mark.slow
def test_one_instance_per_process_means_a_process_for_each(system, native):
    parts = {name: (native("teller"), {}) for name in "abc"}
    ends = {f"{t}.{n}_in": f"{s}.{n}_out" for s, t in ("ab", "bc") for n in ("count", "flag", "word")}
    parts["a"] = (native("teller"), {"count_in": 1, "flag_in": True, "word_in": "go"})
    last = master.run(system(parts, ends, stop=0.5, step=0.1)).table.iloc[-1]
    assert last["c.count_out"] == 4 and last["c.word_out"] == "go!!!" and bool(last["b.flag_out"]) and not last["c.flag_out"]


@pytest.mark.slow
def test_a_crash_leaves_the_master_and_the_results_alive(system, native, counter, tmp_path):
    parts = {
        "t": (native("teller"), {"count_in": 1, "flag_in": True, "word_in": "go", "end": 5, "ends_at": 0.5}),
        "c": (counter, {}),
    }
    description = system(parts, {"c.u": "t.count_out"}, stop=1.0, step=0.1)
    with pytest.raises(master.PartFailed) as caught:
        master.run(description, out=tmp_path / "t.parquet")
    for words in (
        "t answered a crash (SIGSEGV) at t = 0.5 s (step 0.1 s)",
        "begins with go",
        "t.parquet",
        "other components are unharmed",
    ):
        assert words in str(caught.value)
    assert master.read(tmp_path / "t.parquet")[0]["c.n"].to_list() == [0, 1, 2, 3, 4, 5]
    assert len(master.run(description, settings={"t.ends_at": 9.0}).table) == 11  # and it can be run again


@pytest.mark.slow
def test_rollback_across_processes(system, native):
    description = system(
        {"r": (native("relaxation"), {"rate": 3.0, "u": 0.0})}, stop=1.0, step=0.1, step_control="doubling", tolerance=1e-6
    )
    inside = master.run(description).table
    description.components["r"].process = True
    assert master.run(description).table.equals(inside)


@pytest.mark.slow
def test_errors_come_over_as_they_are(tmp_path, refused, native):
    refused(lambda: ProcessPart("x", tmp_path / "none.fmu"), "no FMU at")
    part = ProcessPart("r", native("relaxation"))
    refused(lambda: part.get("nothing"), "r has no variable nothing")
    part.set("u", 3.0)
    assert part.get("u") == 3.0 and part.variables["x"].unit == "K"
    number = part._process.pid
    part.close()
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)


@pytest.mark.slow
def test_a_session_comes_back_to_an_early_snapshot_of_a_process(native):
    """The process keeps what somebody may come back to, and no more."""
    one = {"fmu": native("relaxation"), "start": {"rate": 1.0, "x": 1.0, "u": 0.0}, "process": True}
    with master.session(master.from_dict({"run": {"step": 0.01, "stop": 1.0}, "components": {"p": one}})) as s:
        kept, seen = [], []
        for _ in range(12):
            kept.append(s.snapshot())
            seen.append(s["p.x"])
            s.step()
        for k in (0, 5, 11):
            s.restore(kept[k])
            assert s["p.x"] == seen[k]
            s.step()
            assert k == 11 or s["p.x"] == seen[k + 1]
        part = s._running.wiring.parts["p"]
        del kept[1:]
        gc.collect()
        assert sorted(part._gone) == list(range(2, 13))
        s.snapshot()
        assert not [number for number in part._gone if number < 13]
        s.restore(kept[0])
        assert s["p.x"] == seen[0]
