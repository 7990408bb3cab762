"""The engine: the same rows whatever happens, each finished run kept, none made twice."""

import os
import signal
import subprocess
import sys
import time
from collections import deque
from contextlib import ExitStack, contextmanager
from pathlib import Path

import dask
import jobs
import pandas as pd
import pytest
from distributed.comm.core import CommClosedError

from selflock.master.stops import Stops
from selflock.sweep import SweepError, map_runs
from selflock.sweep.cluster import _begun, _patiently, _refuse_unguarded
from selflock.sweep.engine import _batch, _round
from selflock.sweep.store import Store

SEEDS = [{"seed": seed} for seed in range(40)]


def rows_of(folder):
    return (Path(folder) / "runs.parquet").read_bytes()


@pytest.mark.slow
def test_same_bits_whatever_the_workers(tmp_path, scheduler):
    ways = {"none": {"workers": 0}, "one": {"workers": 1}, "two": {"scheduler": scheduler}}
    for name, way in ways.items():
        map_runs(jobs.draw, SEEDS, context={"offset": 0.5}, folder=tmp_path / name, columns=lambda item: item, **way)
    files = {rows_of(tmp_path / name) for name in ways}
    assert len(files) == 1
    table = pd.read_parquet(tmp_path / "none" / "runs.parquet")
    assert list(table["seed"]) == list(range(40))
    failed = table[table["status"] == "failed"]
    assert list(failed["seed"]) == [6, 13, 20, 27, 34]
    assert failed["reason"].iloc[0] == "ValueError: seed 6 cannot be"
    assert failed["drawn"].isna().all() and table["drawn"].notna().sum() == 35


@pytest.mark.slow
def test_rows_come_in_the_order_of_the_items_and_equal_items_are_run_once(tmp_path):
    items = [3, 1, 3, 2]
    rows = map_runs(jobs.note, items, context=str(tmp_path), workers=0)
    assert [row["item"] for row in rows] == items
    assert (tmp_path / "3.mark").read_text() == "x"


@pytest.mark.slow
def test_the_context_is_opened_once_for_each_worker_and_leaves_nothing(tmp_path, scheduler):
    log, items = tmp_path / "log", list(range(12))
    rows = map_runs(jobs.look, items, context=jobs.Opened(log), scheduler=scheduler, folder=tmp_path / "out")
    assert all(row["there"] for row in rows)
    lines = log.read_text().splitlines()
    opened = [line for line in lines if not line.endswith("closed")]
    assert len(opened) == len({line.split()[0] for line in opened}) <= 2
    assert len(lines) == 2 * len(opened)
    assert not any(Path(line.split()[1], "unpacked").exists() for line in opened)
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["lock", "parts", "runs.parquet", "study.json"]


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_run_that_kills_its_worker_is_tried_once_more_and_hurts_no_other(tmp_path):
    items = [{"crash": how, "n": n} for n, how in enumerate(["", "always", "", "once", ""])]
    rows = map_runs(jobs.crash, items, context=str(tmp_path), workers=2)
    assert [row["status"] for row in rows] == ["failed" if item["crash"] == "always" else "ok" for item in items]
    assert "killed its worker" in rows[1]["reason"]


def interrupted(tmp_path, workers, stop):
    """Start a sweep of 30 runs in a process of its own, stop it when some runs are finished, go on here."""
    marks = tmp_path / "marks"
    marks.mkdir()
    code = (
        "import jobs, sys; from selflock.sweep import map_runs\n"
        "if __name__ == '__main__':\n"
        "    marks, out, workers = sys.argv[1:]\n"
        "    map_runs(jobs.note, list(range(30)), context=marks, folder=out, workers=int(workers))\n"
    )
    (tmp_path / "go.py").write_text(code)
    out = tmp_path / "out"
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    running = subprocess.Popen(
        [sys.executable, tmp_path / "go.py", marks, out, str(workers)],
        env={**os.environ, "PYTHONPATH": path},
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored by what runs in the background
    )
    try:
        while len(list((out / "parts").glob("*.parquet"))) < 3:
            assert running.poll() is None, "it ended too early"
            time.sleep(0.05)
        stop(running)
        running.wait(30)
    finally:
        running.kill()
        said = running.communicate()[1]
    finished = {row["item"] for file in (out / "parts").glob("*.parquet") for row in pd.read_parquet(file).to_dict("records")}
    assert 3 <= len(finished) < 30
    rows = map_runs(jobs.note, list(range(30)), context=str(marks), folder=out, workers=0)
    assert [row["item"] for row in rows] == list(range(30))
    assert all((marks / f"{item}.mark").read_text() == "x" for item in finished)
    assert sorted(p.name for p in out.iterdir()) == ["lock", "parts", "runs.parquet", "study.json"]
    return said


@pytest.mark.slow
def test_going_on_after_an_interruption(tmp_path):
    said = interrupted(tmp_path, 2, lambda running: running.send_signal(signal.SIGINT))
    assert "of 30 runs are finished and kept" in said


@pytest.mark.in_turn
@pytest.mark.slow
def test_going_on_after_everything_was_killed(tmp_path):
    interrupted(tmp_path, 1, lambda running: running.kill())


def test_a_folder_belongs_to_one_study(tmp_path):
    map_runs(jobs.draw, SEEDS[:3], context={"offset": 0.0}, folder=tmp_path / "a", about={"offset": 0.0}, workers=0)
    before = rows_of(tmp_path / "a")
    with pytest.raises(SweepError, match="belongs to another study: it differs in offset"):
        map_runs(jobs.draw, SEEDS[:3], context={"offset": 1.0}, folder=tmp_path / "a", about={"offset": 1.0}, workers=0)
    with pytest.raises(SweepError, match="differs in runs"):
        map_runs(jobs.draw, SEEDS[:4], context={"offset": 0.0}, folder=tmp_path / "a", about={"offset": 0.0}, workers=0)
    assert rows_of(tmp_path / "a") == before
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "thesis.txt").touch()
    with pytest.raises(SweepError, match="not the folder of a sweep"):
        map_runs(jobs.draw, SEEDS[:3], context={"offset": 0.0}, folder=tmp_path / "b", workers=0)


@pytest.mark.slow
def test_a_growing_folder_keeps_runs_of_other_items_but_not_of_other_sources(tmp_path, monkeypatch):
    def grow(items):
        return map_runs(
            jobs.note, items, context=str(tmp_path), folder=tmp_path / "out", growing=True, sources=["jobs"], workers=0
        )

    assert [row["item"] for row in grow([1, 2])] == [1, 2]
    assert [row["item"] for row in grow([3, 2])] == [3, 2]
    assert [row["item"] for row in grow([1])] == [1]
    assert sorted(pd.read_parquet(tmp_path / "out" / "runs.parquet")["item"]) == [1, 2, 3]
    assert all((tmp_path / f"{item}.mark").read_text() == "x" for item in (1, 2, 3))
    monkeypatch.setattr("selflock.sweep.engine.fingerprint", lambda *packages: {"sources": "changed"})
    with pytest.raises(SweepError, match="it differs in sources"):
        grow([4])
    assert not (tmp_path / "4.mark").exists()


def test_two_sweeps_at_once_in_one_folder(tmp_path):
    store = Store(tmp_path, {})
    with pytest.raises(SweepError, match="Another sweep is writing"):
        Store(tmp_path, {})
    store.close()
    Store(tmp_path, {}).close()


def test_a_full_disk_loses_nothing(tmp_path, monkeypatch):
    from selflock.sweep import store

    real, written = store.pq.write_table, []

    def write(table, to):
        written.append(to)
        if len(written) > 5:
            Path(to).write_bytes(b"half")
            raise OSError(28, "No space left on device")
        real(table, to)

    monkeypatch.setattr(store.pq, "write_table", write)
    with pytest.raises(SweepError, match=r"No space left on device\). 5 finished runs are kept"):
        map_runs(jobs.draw, SEEDS, context={"offset": 0.0}, folder=tmp_path / "out", workers=0)
    assert not list(tmp_path.rglob("*.new"))
    monkeypatch.undo()
    rows = map_runs(jobs.draw, SEEDS, context={"offset": 0.0}, folder=tmp_path / "out", workers=0)
    assert len(rows) == 40


def test_a_torn_file_is_made_again(tmp_path):
    store = Store(tmp_path, {})
    store.add([{"key": "a", "status": "ok", "reason": None}])
    store.add([{"key": "b", "status": "ok", "reason": None}])
    store.close()
    (tmp_path / "parts" / "b.parquet").write_bytes(b"PAR1 torn")
    store = Store(tmp_path, {})
    assert set(store.rows) == {"a"}
    store.close()


@pytest.mark.slow
def test_a_scheduler_that_is_not_there(monkeypatch):
    monkeypatch.setattr("selflock.sweep.cluster.ANSWER", 0.5)
    with pytest.raises(SweepError, match="No Dask scheduler answers at tcp://127.0.0.1:1"):
        map_runs(jobs.draw, SEEDS, context={"offset": 0.0}, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(SweepError, match="No Dask scheduler answers at nonsense"):
        map_runs(jobs.draw, SEEDS, context={"offset": 0.0}, scheduler="nonsense://x")


@pytest.mark.parametrize("fails", [1, 2])
def test_a_machine_too_busy_to_start_dask_is_given_a_second_chance(fails):
    from selflock.sweep.cluster import _patiently

    tries = []

    def make(number, more):
        tries.append(number)
        assert len(tries) > fails  # as distributed's LoopRunner does
        return number + more

    if fails == 1:
        assert _patiently(make, 1, more=2) == 3 and tries == [1, 1]
    else:
        with pytest.raises(SweepError, match="too busy"):
            _patiently(make, 1, more=2)


@pytest.mark.slow
def test_a_scheduler_that_dies_loses_no_finished_run_and_another_goes_on(tmp_path, scheduler, monkeypatch):
    code = (
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    at = {'protocol': 'tcp', 'host': '127.0.0.1', 'dashboard_address': '127.0.0.1:0'}\n"
        "    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, **at) as cluster:\n"
        "        print(cluster.scheduler_address, flush=True); input()\n"
    )
    (tmp_path / "cluster.py").write_text(code)
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    cluster = subprocess.Popen(
        [sys.executable, tmp_path / "cluster.py"],
        env={**os.environ, "PYTHONPATH": path},
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )

    def kill_then(item):
        if item == 4:
            cluster.kill()
        return {}

    def command(address):
        return map_runs(
            jobs.note,
            list(range(20)),
            context=str(tmp_path),
            folder=tmp_path / "out",
            columns=kill_then,
            scheduler=address,
        )

    try:
        address = cluster.stdout.readline().strip()
        with pytest.raises(SweepError, match="scheduler is gone.* start a scheduler and give the same command again"):
            command(address)
        with monkeypatch.context() as short, pytest.raises(SweepError, match=f"No Dask scheduler answers at {address}"):
            short.setattr("selflock.sweep.cluster.ANSWER", 1.0)
            command(address)
    finally:
        cluster.kill()
        cluster.wait()
        cluster.stdin.close()
        cluster.stdout.close()
    done = {row["item"] for file in (tmp_path / "out" / "parts").iterdir() for row in pd.read_parquet(file).to_dict("records")}
    assert {0, 1, 2, 3, 4} <= done and len(done) < 20
    assert [row["item"] for row in command(scheduler)] == list(range(20))
    assert all((tmp_path / f"{item}.mark").read_text() == "x" for item in done)


def test_a_scheduler_that_dies_as_it_is_asked_for_what_it_told_is_gone():
    class Future:
        status = "finished"

        def add_done_callback(self, done):
            done(self)

    class Pool:
        slots, alive = 1, True
        send = staticmethod(lambda items, key: Future())

        def gather(self, futures):
            raise CommClosedError("in <TCP (closed)>: Stream is closed")

    with pytest.raises(SweepError, match="scheduler is gone.* start a scheduler and give the same command again"):
        _round(Pool(), [0], deque([0]), lambda numbers, outcomes: None)


def test_batches_last_but_leave_nobody_idle():
    assert _batch(5.0, slots=2, left=1000) == 1  # long runs come back one by one
    assert _batch(0.001, slots=2, left=100000) == 1000  # short ones for about a second
    assert _batch(0.001, slots=2, left=40) == 10  # in the end in ever smaller batches
    assert _batch(0.5, slots=1000, left=10**6) == 10  # a thousand workers: 200 messages a second, not 2000
    assert _batch(0.0, slots=2, left=0) == 1


def test_a_process_of_dask_that_is_killed_as_it_begins_is_begun_once_more():
    tries = []

    def make(times):
        tries.append(1)
        if len(tries) <= times:
            raise RuntimeError("Nanny failed to start.")
        return "begun"

    assert _patiently(make, 1) == "begun" and len(tries) == 2
    tries.clear()
    with pytest.raises(SweepError, match="Dask did not start, twice"):
        _patiently(make, 2)


@pytest.mark.slow
def test_a_process_of_dask_that_hangs_as_it_begins_is_not_waited_for_without_end(tmp_path, monkeypatch):
    (tmp_path / "hangs.py").write_text("import time\ntime.sleep(600)\n")
    monkeypatch.setattr("selflock.sweep.cluster.START", 3.0)
    with dask.config.set({"distributed.worker.preload": [str(tmp_path / "hangs.py")]}):
        with pytest.raises(SweepError, match="Dask did not start, twice"):
            map_runs(jobs.draw, SEEDS[:1], context={"offset": 0.0}, workers=1)


def test_processes_of_dask_end_where_a_signal_comes_as_they_begin():
    ended = []

    @contextmanager
    def begun():
        try:
            yield
        finally:
            ended.append(1)

    def cluster():
        signal.raise_signal(signal.SIGINT)
        return begun()

    with pytest.raises(KeyboardInterrupt), Stops(), ExitStack() as stack:
        _begun(stack, cluster)
    assert ended


def test_a_worker_that_dies_as_it_is_given_the_runs_is_tried_again():
    tries = []

    def give(*given):
        tries.append(given)
        if len(tries) == 1:
            raise CommClosedError("Stream is closed")
        return "given"

    assert _patiently(give, 1, wrong=OSError) == "given" and tries == [(1,), (1,)]
    with pytest.raises(CommClosedError):  # what nobody waits for
        _patiently(lambda: tries.clear() or give(), wrong=ValueError)


def test_a_script_that_its_processes_would_run_again_is_told(tmp_path):
    """Python begins processes by importing the script that asks for them."""
    text = "from selflock.sweep import map_runs\n\ndef main():\n    return map_runs(abs, [1.0], workers=1)\n\n"
    (script := tmp_path / "mine.py").write_text(text + "main()\n")
    with pytest.raises(SweepError, match='mine.py: .* if __name__ == "__main__":'):
        _refuse_unguarded(str(script))
    script.write_text(text + 'if __name__ == "__main__":\n    main()\n')
    for told in (str(script), None, "<stdin>"):
        _refuse_unguarded(told)


def test_a_folder_of_others_is_not_touched(tmp_path):
    for kept in ("work/thesis.txt", "parts/thesis.txt", "thesis.txt"):
        out = tmp_path / kept.replace("/", "_")
        (out / kept).parent.mkdir(parents=True)
        (out / kept).write_text("mine")
        before = sorted(out.rglob("*"))
        with pytest.raises(SweepError, match="is not the folder of a sweep.* Nothing in it was touched"):
            map_runs(jobs.draw, SEEDS, folder=out, workers=0)
        assert sorted(out.rglob("*")) == before
    Store(tmp_path / "mine", {"what": "a"}).close()
    (tmp_path / "mine" / "study.json").rename(tmp_path / "mine" / "study.json.new")  # killed as it was being made
    Store(tmp_path / "mine", {"what": "a"}).close()


def test_workers_below_none(tmp_path):
    with pytest.raises(SweepError, match="-1 workers"):
        map_runs(jobs.draw, SEEDS, workers=-1)
