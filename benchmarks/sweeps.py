"""What a sweep costs: .venv/bin/python -m benchmarks.sweeps [load] [speed_up] [overhead]

Prints what 1000 workers that only sleep do to a Dask scheduler, message by message and in batches; the speed-up of 2
workers over 1; and what the engine adds to belt-track runs of 10 s, in processor time, which a busy machine spoils
least.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import dask
import psutil
from distributed import Client, LocalCluster

from selflock import master
from selflock.sweep import engine, map_runs
from selflock.sweep.cluster import QUIET
from selflock.sweep.record import figures
from selflock.sweep.runs import Bench, adapt, run_one
from selflock.sweep.study import from_dict

RUNS = 40
SLOTS = 1000


def study():
    data = {
        "system": "study/robot.toml", "set": {"robot.track": "belt"}, "stop": 10.0,
        "vary": {"mu": {
            "grid": {"from": 0.0, "to": 0.06, "count": RUNS},
            "set": ["rear_reducer.friction_kinetic", "rear_reducer.friction_static"],
        }},
        "record": {"peak": {"max": "abs(rear_motor.torque)"}, "energy": {"integral": "rear_motor.electric_power"}},
    }  # fmt: skip
    return from_dict(data, Path(__file__).parents[1] / "benchmark.toml")


def nothing(context, item):
    return {"x": item}


def sleep(context, item):
    time.sleep(context)
    return {"x": item}


def timed(action) -> float:
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


@contextmanager
def workers_here(count: int):
    """A Dask cluster of this machine, as quiet as a sweep's own, and a folder for what is written."""
    with (
        tempfile.TemporaryDirectory() as folder,
        dask.config.set(QUIET),
        LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address="127.0.0.1:0", local_directory=folder) as cluster,
    ):
        yield cluster, Path(folder)


def used(process: psutil.Process) -> float:
    """Processor time of a process so far in s, user and system."""
    return sum(process.cpu_times()[:2])


def clocked(bench, item):
    """As run_one, with the processor and wall time of the bare run in s."""
    system, settings = adapt(bench.system, item["settings"])
    cpu, begin = time.thread_time(), time.perf_counter()
    result = master.run(system, settings=settings, stop=bench.stop, keep=bench.parts)
    spent = {"cpu": time.thread_time() - cpu, "wall": time.perf_counter() - begin}
    return {**figures(bench.record, result.table, item["parameters"]), **spent}


def overhead(rounds: int = 3) -> None:
    """All that a sweep with one worker uses beside the runs: of this process and of the worker, from call to return.

    Compared with the very runs that it made, so that a machine busy with other things speaks for both alike.
    """
    made = study()
    bench, here = Bench(master.load(made.system), made.record, made.stop), psutil.Process()
    with workers_here(1) as (cluster, folder):
        worker, address = psutil.Process(next(iter(cluster.workers.values())).pid), cluster.scheduler_address
        map_runs(clocked, made.items[:2], context=bench, scheduler=address)  # compiles the vehicle's kernel
        for number in range(rounds):
            before, begin = (used(here), used(worker)), time.perf_counter()
            rows = map_runs(clocked, made.items, context=bench, folder=folder / f"out{number}", scheduler=address)
            wall, cpu = time.perf_counter() - begin, sum(row["cpu"] for row in rows)
            parent, there = used(here) - before[0], used(worker) - before[1] - cpu
            slower = wall / sum(row["wall"] for row in rows) - 1
            print(
                f"{RUNS} belt-track runs of 10 s, 1 worker: {cpu / RUNS:.3f} s of processor a run; the sweep adds"
                f" {100 * there / cpu:.1f} % in the worker and {100 * parent / cpu:.1f} % beside it, together"
                f" {100 * (there + parent) / cpu:.1f} % (target 5); wall time {100 * slower:+.1f} %"
            )


def speed_up() -> None:
    made = study()
    bench = Bench(master.load(made.system), made.record, made.stop)
    seconds = {}
    for workers in (1, 2):
        with workers_here(workers) as (cluster, folder):
            address = cluster.scheduler_address
            map_runs(run_one, made.items[: 2 * workers], context=bench, scheduler=address)  # compiles the vehicle's kernel
            seconds[workers] = timed(
                lambda: map_runs(run_one, made.items, context=bench, folder=folder / "out", scheduler=address)
            )
    print(
        f"{RUNS} belt-track runs of 10 s: {seconds[1]:.1f} s with 1 worker, {seconds[2]:.1f} s with 2: "
        f"{seconds[1] / seconds[2]:.2f} x (target 1.9)"
    )
    with workers_here(1) as (cluster, folder):
        count, engine.BATCH_SECONDS, engine.TASKS_PER_SECOND = 300, 0.0, 1e9  # each run a message of its own
        whole = timed(lambda: map_runs(nothing, range(count), folder=folder / "out", scheduler=cluster.scheduler_address)) / count
        engine.BATCH_SECONDS, engine.TASKS_PER_SECOND = 1.0, 200
    print(f"a run that does nothing, sent by itself and written at once: {1e3 * whole:.1f} ms")


def load() -> None:
    """A scheduler in a process of its own, 1000 slots that sleep."""
    command = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--port",
        "18786",
        "--dashboard-address",
        "127.0.0.1:0",
        "--host",
        "127.0.0.1",
    ]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(command, **quiet)
    address = "tcp://127.0.0.1:18786"
    workers = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "distributed.cli.dask_worker",
            address,
            "--nworkers",
            "1",
            "--nthreads",
            str(SLOTS),
            "--no-dashboard",
        ],
        **quiet,
    )
    try:
        with Client(address, timeout=30) as client:
            client.wait_for_workers(1, timeout=60)
        process = psutil.Process(scheduler.pid)
        for seconds, count, longest in ((0.5, 4_000, 0.0), (0.5, 20_000, engine.BATCH_SECONDS)):
            engine.BATCH_SECONDS, usual = longest, engine.BATCH_SECONDS
            engine.TASKS_PER_SECOND = engine.TASKS_PER_SECOND if longest else 1e9
            before = used(process)
            took = timed(lambda: map_runs(sleep, range(count), context=seconds, scheduler=address))
            cpu = used(process) - before
            engine.BATCH_SECONDS, engine.TASKS_PER_SECOND = usual, 200
            print(
                f"{SLOTS} sleepers, runs of {seconds} s, {'in batches' if longest else 'one by one'}: "
                f"{count / took:.0f} runs/s of {SLOTS / seconds:.0f} possible; "
                f"scheduler {100 * cpu / took:.0f} % of a core, {1e3 * cpu / count:.3f} ms a run"
            )
    finally:
        for process in (workers, scheduler):
            for child in psutil.Process(process.pid).children(recursive=True):
                child.kill()
            process.kill()
            process.wait()


if __name__ == "__main__":
    chosen = sys.argv[1:] or ["load", "speed_up", "overhead"]
    for name in chosen:
        {"load": load, "speed_up": speed_up, "overhead": overhead}[name]()
