"""A diagnosis that was stopped goes on where it was, to the same bits; its folder is its own."""

import ctypes
import json
import signal
from dataclasses import asdict

import pytest

from selflock import diagnosis
from selflock.diagnosis import calls
from selflock.diagnosis.search import problem as ground
from selflock.diagnosis.search.kept import Kept
from selflock.fmus.errors import SelflockError
from selflock.master import TimeUp
from selflock.master.stops import Stops

from ..residuals.test_experiment import inverse


@pytest.fixture
def fits(monkeypatch):
    """How many fits were made."""
    made, fit = [], ground.fit
    monkeypatch.setattr(ground, "fit", lambda *given, **more: (made.append(1), fit(*given, **more))[1])
    return made


@pytest.mark.slow
def test_what_was_stopped_goes_on_to_the_same_bits(tmp_path, rng, fits):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3, n=3000)
    given = tmp_path / "rig.toml", [tmp_path / "log.csv"]

    def stop(what, share):
        if "fits" in what and share > 0.5:
            raise KeyboardInterrupt

    whole = diagnosis.diagnose(*given, out=None, seed=3)
    of_all, out = len(fits), tmp_path / "out"
    fits.clear()
    with pytest.raises(KeyboardInterrupt, match="fits are kept in .*out.*goes on with them"):
        diagnosis.diagnose(*given, out=out, seed=3, progress=stop)
    of_first, there = len(fits), list((out / "kept").glob("*.npz"))
    there[0].write_bytes(there[0].read_bytes()[:-100])  # torn
    fits.clear()
    found = diagnosis.diagnose(*given, out=out, seed=3)
    assert len(there) > 3 and len(fits) <= of_all - of_first + 4  # phases of a fit, and those under way on other threads
    mine, theirs = (
        json.loads(json.dumps(asdict(one) | {"extension": {}, "folder": None, "sources": {}}, default=repr))
        for one in (found, whole)
    )
    assert mine == theirs
    assert not (out / "kept").exists()


def test_the_same_diagnosis_alone_goes_on(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("a")
    first = Kept.of(tmp_path / "out", {"rig": frozenset("abc")}, [log], None)
    again = Kept.of(tmp_path / "out", {"rig": frozenset("cba")}, [log], None)
    assert again.seed == first.seed
    (again.folder / "x.npz").write_bytes(b"")
    assert again.get("x") is None
    log.write_text("b")
    Kept.of(tmp_path / "out", {"rig": frozenset("abc")}, [log], None)
    assert not (again.folder / "x.npz").exists()


def test_a_diagnosis_has_a_time_limit(tmp_path, rng, monkeypatch):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)
    made = []
    monkeypatch.setattr(calls, "Stops", lambda seconds: made.append(Stops(seconds)) or made[0])

    def over(what, share):  # the clock strikes here, where no file is open
        made[0]._ring()
        for _ in range(1000):
            pass

    with pytest.raises(TimeUp, match="The diagnosis took more than its time limit, 500 s.*goes on with them"):
        diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=tmp_path / "out", progress=over, max_time=500.0)


def test_a_folder_with_others_content_is_refused_before_anything_is_written(tmp_path, rng):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)
    before = sorted(tmp_path.iterdir())
    for call in (diagnosis.diagnose, diagnosis.calibrate, diagnosis.name):
        with pytest.raises(SelflockError, match="it holds log.csv. Nothing in it was touched"):
            call(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=tmp_path)
    with pytest.raises(SelflockError, match="is not the folder of a replay"):
        diagnosis.replay(tmp_path / "rig.toml", tmp_path / "log.csv", tmp_path)
    assert sorted(tmp_path.iterdir()) == before


def test_ctrl_c_that_c_swallowed_ends_a_diagnosis_at_its_next_stage(tmp_path, rng):
    """As within numba's compiler, which calls Python: no exception goes on through it."""
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)
    told = []

    def progress(what, share):
        told.append(what)
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()

    with pytest.raises(KeyboardInterrupt, match="The diagnosis was stopped; nothing is kept"):
        diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=None, progress=progress)
    assert len(told) == 1


@pytest.mark.slow
def test_ctrl_c_behind_the_answer_says_that_it_is_whole(tmp_path, rng, monkeypatch):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)
    forget = Kept.forget

    def interrupted(kept):
        forget(kept)
        raise KeyboardInterrupt

    monkeypatch.setattr(Kept, "forget", interrupted)
    with pytest.raises(KeyboardInterrupt, match="The diagnosis was stopped; its answer is whole, in .*out"):
        diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=tmp_path / "out")
    assert json.loads((tmp_path / "out" / "diagnosis.json").read_text())["verdict"]
