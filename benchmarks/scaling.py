"""How cost grows: processor time and memory over log length, hypotheses, drives, instances and workers.

    python -m benchmarks.scaling [--longest 60] [--only native drives] [--draw]

Each point has a process of its own, and counts the processor time (user and system) of what it names with all processes
that it starts, which a busy machine changes less than the clock; and the largest memory of one process. Of each curve the
cost is fitted as a + b n^p: p is its exponent, with what the scatter of the points leaves of it; what is paid once, a, is told
beside it. Points are kept in out/scaling.json; --draw runs nothing. The table goes into docs/benchmarks.md, the picture beside it.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import curve_fit

from benchmarks import diagnose as closed_loop
from benchmarks.tally import table
from selflock import diagnosis, master
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.pipeline.hold_out import split
from selflock.diagnosis.pipeline.run import gather, problem_of
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.search.selection import ForwardSelection
from selflock.fmus.build import built
from selflock.sweep import map_runs

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURE, KEPT = ROOT / "docs" / "benchmarks.md", ROOT / "docs" / "scaling.png", ROOT / "out" / "scaling.json"
FIRST, LAST = "<!-- scaling -->\n", "<!-- end of scaling -->"
MOST = 1.1  # the largest exponent that is asked for
STEPS, LOG, RUNS = 2000, 6.0, 24  # communication steps of a ring; s of the log whose hypotheses grow; runs of a sweep
RUN = 100.0  # s simulated of drives beside each other: of less, what is loaded is all that is seen
ENOUGH, TIMES = 4.0, 5  # s of processor after which a point is not measured again, and how often it is at most

Work = Callable[[], Any]


def of_length(seconds: float, folder: Path) -> Work:
    """A diagnosis with the whole vocabulary, report and FMUs included."""
    rig, log = closed_loop.log(folder, seconds)
    return lambda: diagnosis.diagnose(rig, [log], out=folder / "out", seed=1)


def drive(prefix: str) -> dict[str, dict[str, dict]]:
    """Controller, motor, gear and load, with the values of benchmarks.diagnose."""
    name = lambda part: f"{prefix}_{part}"
    starts = {
        "controller": {"angle_gain": 100.0, "speed_gain": 8.0, "release_time": 1e9, "angle_setpoint": 1.0},
        "motor": {},
        "reducer": {"shaft_stiffness": 3000.0, "shaft_damping": 10.0},
        "load": {"inertia": 0.15, "mass": 1.0},
    }
    components = {name(part): {"fmu": f"selflock:{part.title()}", "start": start} for part, start in starts.items()}
    wires = {
        "controller.angle": "load.angle",
        "controller.speed": "load.speed",
        "motor.voltage": "controller.voltage",
        "motor.speed": "reducer.input_speed",
        "reducer.motor_torque": "motor.torque",
        "reducer.output_angle": "load.angle",
        "reducer.output_speed": "load.speed",
        "load.torque": "reducer.output_torque",
    }
    connections = {f"{prefix}_{target}": {"from": f"{prefix}_{source}", "convert": False} for target, source in wires.items()}
    return {"components": components, "connections": connections}


def run_of(drives: int, seconds: float) -> Work:
    """A run of drives beside each other at 1 kHz, loading included, every output recorded."""
    made = [drive(f"d{k}") for k in range(drives)]
    whole = {key: {name: one for each in made for name, one in each[key].items()} for key in ("components", "connections")}
    return lambda: master.run(master.from_dict({"run": {"step": 1e-3, "stop": seconds, "open_inputs": True}, **whole}))


def ring(fmu: Path, given: str, taken: str, count: int, start: dict[str, float]) -> Work:
    """Equal FMUs in a ring for `STEPS` steps, loading included; what is passed on lags by a step, as in other masters."""
    described = {
        "run": {"step": 1e-3, "stop": STEPS * 1e-3, "record": [f"*.{taken}"], "coupling_tolerance": 0.0},
        "components": {f"i{k}": {"fmu": str(fmu), "start": start} for k in range(count)},
        "connections": {f"i{k}.{given}": {"from": f"i{(k + 1) % count}.{taken}", "convert": False} for k in range(count)},
    }
    return lambda: master.run(master.from_dict(described))


def of_native(count: float, folder: Path) -> Work:
    sys.path.append(str(ROOT / "tests" / "native"))
    from pack import pack

    return ring(pack("relaxation", folder), "u", "x", int(count), {"rate": 1.0})


def of_motors(count: float, folder: Path) -> Work:
    return ring(built("Motor"), "voltage", "torque", int(count), {"speed": 0.0})


def of_hypotheses(count: float, folder: Path) -> Work:
    """The first cause sought among so many: some of the vocabulary, or all of it and some again under other names."""
    rig, log = closed_loop.log(folder, LOG)
    read, (runs, _, held) = load(rig), gather(load(rig), [log], [])
    experiment = DriveExperiment(read, runs)
    train, _ = split(experiment, runs, held)
    problem = problem_of(experiment, runs, held, train)
    known = [problem.hypotheses[k] for k in np.random.default_rng(0).permutation(len(problem.hypotheses))]
    again = [replace(h, effect=f"{h.label} {k}") for k in range(2, 9) for h in known]
    asked = replace(problem, hypotheses=tuple([*known, *again][: int(count)]))
    return lambda: ForwardSelection(asked, np.random.default_rng(1)).run(1)


def robot(context: Any, friction: float) -> dict[str, float]:
    result = master.run(context, stop=2.0, settings={"friction": friction})
    return {"peak": float(result.table["rear_motor.torque"].abs().max())}


def of_workers(count: float, folder: Path) -> Work:
    """A sweep of the robot on belt tracks, 2 s each."""
    from selflock.study import runs

    system = runs.system()
    system.components["robot"].start["track"] = "belt"
    items = [0.06 * k / RUNS for k in range(RUNS)]
    return lambda: map_runs(robot, items, context=system, workers=int(count))


@dataclass(frozen=True)
class Curve:
    """What grows, over what; `make` prepares a point and gives the work that is counted. judged: whether MOST is asked of it."""

    name: str
    unit: str
    points: tuple[float, ...]
    make: Callable[[float, Path], Work]
    judged: bool = True


CURVES = {
    "length": Curve("diagnosis, log length", "s", (1, 3, 10, 30, 60, 120, 300, 600, 1800, 3600), of_length),
    "run": Curve("run of a drive, simulated time", "s", (30, 100, 300, 1000, 3000), lambda n, folder: run_of(1, n)),
    "hypotheses": Curve("first cause, hypotheses", "", (10, 20, 40, 80, 140, 200), of_hypotheses, judged=False),
    "drives": Curve(f"run of {RUN:g} s, drives", "", (1, 2, 4, 8, 12), lambda n, folder: run_of(int(n), RUN)),
    "native": Curve(f"{STEPS} steps, native instances", "", (2, 8, 32, 100, 320, 1000), of_native),
    "motors": Curve(f"{STEPS} steps, Motor.fmu instances", "", (2, 8, 32, 100, 320, 1000), of_motors),
    "workers": Curve(f"sweep of {RUNS} runs, workers", "", (1, 2), of_workers, judged=False),
}


def spent() -> float:
    """Processor time of this process and of those that it has seen end, s."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def point(key: str, n: float) -> dict[str, float]:
    """One point, the least of a few times where it is short, after the smallest point of its curve, which loads and compiles."""
    curve = CURVES[key]
    with tempfile.TemporaryDirectory() as folder:
        for name, size in (("warm", curve.points[0]), ("counted", n)):
            (place := Path(folder) / name).mkdir()
            work = curve.make(size, place)
            took: list[float] = []
            while len(took) < (TIMES if name == "counted" else 1) and sum(took) < ENOUGH:
                before = spent()
                work()
                took.append(spent() - before)
    most = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return {"n": n, "processor": min(took), "memory": most / 1024}


def fitted(n: np.ndarray, cost: np.ndarray) -> tuple[float, float, float, float]:
    """a, b and p of a + b n^p with a, b >= 0, by relative error, and the standard error of p; not a number below four points."""
    if len(n) < 4:
        return (np.nan,) * 4
    law = lambda n, a, b, p: np.log(a + b * n**p)
    start = 0.9 * cost.min(), cost.max() / n.max(), 1.0
    found, spread = curve_fit(law, n, np.log(cost), start, bounds=([0.0, 1e-12, 0.0], [np.inf, np.inf, 3.0]), max_nfev=10_000)
    return (*found, float(np.sqrt(spread[2, 2])))


def page(kept: dict[str, list[dict[str, float]]]) -> str:
    """The table of the page."""
    rows = []
    for key, found in kept.items():
        curve, (first, last) = CURVES[key], (found[0], found[-1])
        n, cost = (np.array([row[name] for row in found]) for name in ("n", "processor"))
        once, _, p, error = fitted(n, cost)
        memory = f"{first['memory']:.0f} to {last['memory']:.0f} MiB"
        over = f"{first['n']:g} to {last['n']:g} {curve.unit}".strip()
        law = "" if np.isnan(p) else f"{p:.2f} ± {error:.2f}"
        holds = "" if not curve.judged or np.isnan(p) else "yes" if p <= MOST else "**no**"
        told = "" if np.isnan(p) else f"{once:.2f} s"
        rows.append((curve.name, over, f"{first['processor']:.2f} to {last['processor']:.2f} s", told, law, holds, memory))
    heads = ("what", "over", "processor time", "of it once", "exponent", f"at most {MOST}", "memory")
    return table(heads, rows)


def draw(kept: dict[str, list[dict[str, float]]]) -> None:
    shown = {key: found for key, found in kept.items() if len(found) > 2}
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    for key, found in shown.items():
        n = np.array([row["n"] for row in found])
        once, b, p, _ = fitted(n, np.array([row["processor"] for row in found]))
        (line,) = left.loglog(n, [row["processor"] for row in found], "o", ms=5)
        if not np.isnan(p):
            fine = np.geomspace(n[0], n[-1], 60)
            left.loglog(fine, once + b * fine**p, "-", color=line.get_color(), lw=1)
        right.loglog(n, [row["memory"] for row in found], "o-", ms=4, lw=1, color=line.get_color(), label=CURVES[key].name)
    left.set(xlabel="how many, or seconds", ylabel="processor time [s]", title="Time, and a + b nᵖ")
    right.set(xlabel="how many, or seconds", ylabel="largest memory of a process [MiB]", title="Memory")
    right.legend(fontsize=8, loc="upper left")
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=110)
    plt.close(figure)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--longest", type=float, default=60.0, help="log, s; an hour: 3600")
    options.add_argument("--only", nargs="+", choices=list(CURVES), default=list(CURVES), help="these curves")
    options.add_argument("--draw", action="store_true", help="run nothing")
    given = options.parse_args()
    kept: dict[str, list[dict[str, float]]] = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    for key in () if given.draw else given.only:
        curve, found = CURVES[key], []
        for n in curve.points:
            if key == "length" and n > given.longest:
                continue
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as alone:
                found.append(alone.submit(point, key, n).result())
            print(f"{curve.name} {n:g}: " + ", ".join(f"{name} {value:.4g}" for name, value in found[-1].items()), flush=True)
            kept[key] = found
            KEPT.parent.mkdir(exist_ok=True)
            KEPT.write_text(json.dumps(kept, indent=1))
    kept = {key: kept[key] for key in CURVES if key in kept}
    text = page(kept)
    print(text)
    before, rest = PAGE.read_text().split(FIRST)
    PAGE.write_text(f"{before}{FIRST}\n{text}\n\n{LAST}{rest.split(LAST)[1]}")
    draw(kept)


if __name__ == "__main__":
    main()
