"""What is resumed equals what was not interrupted, to the bit."""

from pathlib import Path

import pytest

from selflock import master
from selflock.master import convoy, simulation, state

BENCH = Path(__file__).parents[2] / "examples" / "bench.toml"


class Ends:
    """Ctrl-C when so much of the run is done."""

    def __init__(self, share):
        self.share = share

    def __call__(self, share):
        if share >= self.share and share < 1.0:
            raise KeyboardInterrupt


@pytest.fixture
def interrupted(tmp_path, monkeypatch):
    """interrupted(description, ending, at): the run without an end before its end, and with some; their results."""

    def both(description, ending, at, every=0.0, **more):
        monkeypatch.setattr(state, "EVERY", every)
        whole = master.run(description, out=tmp_path / f"whole.{ending}", resume=True, **more)
        path = tmp_path / f"resumed.{ending}"
        for share in at:
            with pytest.raises(KeyboardInterrupt, match="goes on from t = ") as said:
                master.run(description, out=path, resume=True, progress=Ends(share), **more)
            assert len(master.read(path)[0]) <= len(whole.table), said.value
        resumed = master.run(description, out=path, resume=True, **more)
        assert sorted(file.name for file in tmp_path.iterdir()) == [f"resumed.{ending}", f"whole.{ending}"]
        if ending == "csv":
            assert path.read_bytes() == whole.path.read_bytes()
        assert resumed.table.equals(whole.table) and resumed.peaks.equals(whole.peaks)
        assert resumed.energy.equals(whole.energy) and resumed.steps == whole.steps and resumed.time == whole.time
        assert resumed.reached == whole.reached
        return resumed

    return both


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "iterated"])
def test_circles_go_on_with_what_was_learned_of_them(system, interrupted, algorithm):
    parts = {"a": ("Lag", {"through": -3.0, "push": 1.0}), "b": ("Stepped", {"through": 1.5}), "c": ("Rooted", {"b": 0.0})}
    ends = {"a.u": "b.y", "b.u": "a.y", "c.a": "b.y"}
    resumed = interrupted(system(parts, ends, stop=0.4, step=0.01, algorithm=algorithm), "csv", (0.3, 0.9))
    assert not resumed.coupling.empty


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("algorithm, interval", [("gauss-seidel", 0.0), ("jacobi", 0.03)])
def test_parts_of_any_step_go_on(system, interrupted, ending, algorithm, interval):
    parts = {
        "a": ("Mass", {"mass": 2.0, "v0": 1.0}, {"step": 0.005}),
        "s": ("Spring", {"stiffness": 30.0}),
        "b": ("Mass", {"damping": 0.1}, {"step": 0.04}),
        "t": ("Types", {"flag": True, "count": 1, "word": 'x, "y"'}),
    }
    ends = {"s.v1": "a.v", "s.v2": "b.v", "a.force": "s.force", "b.force": "s.reaction"}
    description = system(parts, ends, stop=0.4, step=0.01, algorithm=algorithm, interval=interval)
    interrupted(description, ending, (0.25, 0.26, 0.9))


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_our_fmus_in_the_compiled_loop_go_on(interrupted, ending, monkeypatch):
    monkeypatch.setattr(convoy, "STRETCH", 100)
    monkeypatch.setattr(simulation, "WORTH", 0)
    description = master.load(BENCH)
    description.faults, description.components["gear"].step = [], 0.0  # else it is not stepped in the compiled loop
    interrupted(description, ending, (0.3, 0.7), stop=0.6)


@pytest.mark.slow
def test_faults_that_are_functions_of_time_go_on(interrupted, refused, tmp_path):
    description = master.load(BENCH)
    description.faults = [master.Fault("motor.voltage", "offset", 0.005, 0.015, value=-3.0)]
    interrupted(description, "csv", (0.3, 0.5), stop=0.02)
    description.faults = [master.Fault("motor.voltage", "noise", 0.005, 0.015, deviation=1.0, seed=1)]
    refused(lambda: master.run(description, out=tmp_path / "x.csv", resume=True), "motor.voltage, noise, remembers")


def test_what_cannot_be_saved_is_a_sentence(system, native, tmp_path, refused):
    tank = system({"t": (native("tank"), {})}, stop=1.0, step=0.1)
    tank.run.open_inputs = True
    refused(lambda: master.run(tank, out=tmp_path / "x.csv", resume=True), "t cannot save its state", "without --resume")
    mass = system({"m": ("Mass", {"force": 0.0})}, stop=1.0, step=0.1)
    refused(lambda: master.run(mass, resume=True), "a file of results")
    assert not list(tmp_path.iterdir())


def test_the_state_of_another_run_is_refused(system, tmp_path, monkeypatch):
    monkeypatch.setattr(state, "EVERY", 0.0)
    path = tmp_path / "x.csv"
    description = system({"m": ("Mass", {"force": 1.0})}, stop=1.0, step=0.1)
    with pytest.raises(KeyboardInterrupt):
        master.run(description, out=path, resume=True, progress=Ends(0.5))
    before = path.read_bytes()
    with pytest.raises(master.ResultError, match="state of another run"):
        master.run(description, {"m.force": 2.0}, out=path, resume=True)
    assert path.read_bytes() == before
    (tmp_path / "x.csv.state").write_bytes(b"torn")
    with pytest.raises(master.ResultError, match="is no saved state"):
        master.run(description, out=path, resume=True)
    (tmp_path / "x.csv.state").unlink()
    master.run(description, out=path, resume=True)
    assert len(master.read(path)[0]) == 11
