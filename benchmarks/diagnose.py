"""Speed and memory of the diagnosis: python benchmarks/diagnose.py [SECONDS ...] [--hour] [--logs 4]

Prints the cost of one compiled forward simulation of a drive at 1 kHz for each step, and of whole diagnoses of 1 kHz
logs of these lengths (30, 60 and 120 s) with the full vocabulary: processor time (user and system, of all threads),
which a loaded machine changes less than the time on the clock, and the largest memory. Each diagnosis has a process
of its own. --logs: so many logs of each length, of which the last is judged on and no fit sees it.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.csv

from selflock import diagnosis
from selflock.diagnosis.residuals.kernels import kernels
from selflock.diagnosis.residuals.laws import parameters

STEP = 1e-3
RIG = """
[rig]
name = "benchmark"
kind = "forward"
[columns]
"controller.angle_setpoint" = "setpoint"
"controller.speed_setpoint" = "setpoint_speed"
"controller.voltage" = "voltage"
"motor.current" = "current"
"reducer.input_angle" = "input_angle"
"reducer.input_speed" = "input_speed"
"load.angle" = "angle"
"load.speed" = "speed"
[parameters]
"reducer.shaft_stiffness" = 3000.0
"reducer.shaft_damping" = 10.0
"load.inertia" = 0.15
"load.mass" = 1.0
"controller.angle_gain" = 100.0
"controller.speed_gain" = 8.0
"controller.release_time" = 1e9
"""


def simulate(seconds: float, brush: float = 0.0, phase: float = 0.0):
    """A drive in closed loop, simulated by the compiled laws; the processor time it took, the least of five."""
    n = int(seconds / STEP)
    t = np.arange(n) * STEP
    setpoint = 1.2 * np.sin(0.9 * t) + 0.4 * np.sin(2.3 * t + phase)
    speed = 1.08 * np.cos(0.9 * t) + 0.92 * np.cos(2.3 * t + phase)
    given = {
        "reducer.shaft_stiffness": 3000.0,
        "reducer.shaft_damping": 10.0,
        "load.inertia": 0.15,
        "load.mass": 1.0,
        "controller.angle_gain": 100.0,
        "controller.speed_gain": 8.0,
        "controller.release_time": 1e9,
        "motor.brush_voltage": brush,
    }
    laws = [parameters(part, part, given) for part in ("controller", "motor", "reducer", "load")]
    zero, out = np.zeros(n), np.zeros((8, n))
    run = lambda: kernels().whole(*laws, 1.0, np.ones(n), zero, zero, setpoint, speed, np.full(n, STEP), 1, np.zeros(4), out)
    run()
    spent = []
    for _ in range(5):
        began = time.process_time()
        run()
        spent.append(time.process_time() - began)
    return t, setpoint, speed, out, min(spent)


def log(folder: Path, seconds: float, number: int = 0) -> tuple[Path, Path]:
    """Rig and log of that drive, with a voltage drop at the brushes that the rig does not know and noise; number: of several."""
    t, setpoint, speed, out, _ = simulate(seconds, brush=0.6, phase=float(number))
    rng = np.random.default_rng(number)
    noisy = lambda x, sigma: x + sigma * rng.standard_normal(len(x))
    columns = {
        "time": t,
        "setpoint": setpoint,
        "setpoint_speed": speed,
        "voltage": out[0],
        "current": noisy(out[1], 0.05),
        "input_angle": noisy(out[3], 2e-3),
        "input_speed": noisy(out[4], 0.2),
        "angle": noisy(out[6], 2e-4),
        "speed": noisy(out[7], 5e-3),
    }
    rig, path = folder / "rig.toml", folder / f"log{seconds:g}{f'_{number}' if number else ''}.csv"
    pyarrow.csv.write_csv(pyarrow.table(columns), path)
    rig.write_text(RIG)
    return rig, path


def diagnose(rig: Path, paths: list[Path], out: Path) -> tuple[str, float, float, float]:
    """The answer; processor time and time on the clock, s; the process's largest memory, GiB."""
    began, busy = time.perf_counter(), time.process_time()
    result = diagnosis.diagnose(rig, paths[:1] + paths[1:-1], test=paths[1:][-1:], out=out, seed=1)
    busy, began = time.process_time() - busy, time.perf_counter() - began
    answer = f"{result.verdict}, {[cause.label for cause in result.causes]}"
    return answer, busy, began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2


def main(lengths: list[float], logs: int) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as alone:
        *_, spent = simulate(60.0)
        print(f"forward simulation of a drive in closed loop at 1 kHz: {spent / 60e3 * 1e6:.3f} us a step (target 0.5)")
        with tempfile.TemporaryDirectory() as folder:
            for seconds in lengths:
                made = [alone.submit(log, Path(folder), seconds, number).result() for number in range(logs)]
                answer, busy, clock, memory = alone.submit(
                    diagnose, made[0][0], [path for _, path in made], Path(folder) / "out"
                ).result()
                print(
                    f"diagnosis of {f'{logs} logs of ' if logs > 1 else ''}{seconds:g} s at 1 kHz, full vocabulary, report and FMUs: {busy:.1f} s of processor, "
                    f"{clock:.1f} s on the clock, {memory:.2f} GiB: {answer}",
                    flush=True,
                )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("seconds", nargs="*", type=float, help="lengths of logs, s")
    parser.add_argument("--hour", action="store_true", help="a log of an hour as well")
    parser.add_argument("--logs", type=int, default=1, help="of each length; of several the last is judged on")
    given = parser.parse_args()
    main((given.seconds or [30.0, 60.0, 120.0]) + [3600.0] * given.hour, given.logs)
