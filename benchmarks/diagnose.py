"""Speed of the diagnosis: python benchmarks/diagnose.py

Prints the cost of one compiled forward simulation of a drive at 1 kHz for each step, of a whole diagnosis of a 60 s,
1 kHz log with the full vocabulary, and how the time grows with the log's length.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import diagnosis
from diagnosis.kernels import kernels
from diagnosis.laws import parameters

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


def simulate(seconds: float, brush: float = 0.0):
    """A drive in closed loop, simulated by the compiled laws; the time it took."""
    n = int(seconds / STEP)
    t = np.arange(n) * STEP
    setpoint = 1.2 * np.sin(0.9 * t) + 0.4 * np.sin(2.3 * t)
    speed = 1.08 * np.cos(0.9 * t) + 0.92 * np.cos(2.3 * t)
    given = {"reducer.shaft_stiffness": 3000.0, "reducer.shaft_damping": 10.0, "load.inertia": 0.15, "load.mass": 1.0,
             "controller.angle_gain": 100.0, "controller.speed_gain": 8.0, "controller.release_time": 1e9, "motor.brush_voltage": brush}
    laws = [parameters(part, part, given) for part in ("controller", "motor", "reducer", "load")]
    zero, out = np.zeros(n), np.zeros((8, n))
    run = lambda: kernels().whole(*laws, 1.0, np.ones(n), zero, zero, setpoint, speed, np.full(n, STEP), 1, np.zeros(4), out)
    run()
    began = time.perf_counter()
    run()
    return t, setpoint, speed, out, time.perf_counter() - began


def log(folder: Path, seconds: float) -> tuple[Path, Path]:
    t, setpoint, speed, out, _ = simulate(seconds, brush=0.6)
    rng = np.random.default_rng(0)
    noisy = lambda x, sigma: x + sigma * rng.standard_normal(len(x))
    table = pd.DataFrame({"time": t, "setpoint": setpoint, "setpoint_speed": speed, "voltage": out[0], "current": noisy(out[1], 0.05),
                          "input_angle": noisy(out[3], 2e-3), "input_speed": noisy(out[4], 0.2), "angle": noisy(out[6], 2e-4), "speed": noisy(out[7], 5e-3)})
    table.to_csv(folder / f"log{seconds:g}.csv", index=False)
    (folder / "rig.toml").write_text(RIG)
    return folder / "rig.toml", folder / f"log{seconds:g}.csv"


def main(lengths: list[float]) -> None:
    *_, spent = simulate(60.0)
    print(f"forward simulation of a drive in closed loop at 1 kHz: {spent / 60e3 * 1e6:.3f} us a step (target 0.5)")
    with tempfile.TemporaryDirectory() as folder:
        for seconds in lengths:
            rig, path = log(Path(folder), seconds)
            began, busy = time.perf_counter(), time.process_time()
            result = diagnosis.diagnose(rig, [path], out=Path(folder) / "out", seed=1)
            print(f"diagnosis of {seconds:g} s at 1 kHz, full vocabulary, report and FMUs: {time.perf_counter() - began:.1f} s, "
                  f"{time.process_time() - busy:.1f} s of processor (target 60 s for 60 s): {result.verdict}, {[c.label for c in result.causes]}")
    print(f"memory, largest: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2:.2f} GiB")


if __name__ == "__main__":
    main([float(x) for x in sys.argv[1:]] or [30.0, 60.0, 120.0])
