"""What solving circles brings, and what distance costs: the figures of docs/coupling.md, and its picture.

    python -m benchmarks.coupling [--stop 4]

Loops: two FMUs x' = u - x, y = x + k u on each other (tests/native/lag), whose loop has the gain -4.5, against the whole as
one linear system. Joints: the robot of the study. Distance: eight native FMUs in a ring, under Jacobi.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.linalg import expm

from selflock import master
from selflock.master.errors import PartFailed
from selflock.master.remote import SECRET, Server

ROOT = Path(__file__).resolve().parents[1]
STEPS = (0.1, 0.05, 0.025, 0.0125)  # s
GAINS = {"a": -3.0, "b": 1.5}
WAYS: dict[str, dict[str, Any]] = {
    "model exchange": {"interface": "me"},
    "co-simulation": {"interface": "cs"},
    "co-simulation, iterated": {"interface": "cs", "algorithm": "iterated"},
    "the same, with input derivatives": {"interface": "cs", "algorithm": "iterated", "input_derivatives": True},
}
RING, COUNT, TURNS = 8, 1000, 4


def native(name: str, folder: Path) -> Path:
    sys.path.append(str(ROOT / "tests" / "native"))
    from pack import pack

    return pack(name, folder)


def exact(time: float) -> np.ndarray:
    """x of both, from y_a = x_a - 3 y_b and y_b = x_b + 1.5 y_a."""
    at_once = np.linalg.inv(np.array([[1.0, -GAINS["a"]], [-GAINS["b"], 1.0]]))
    return at_once @ expm((np.array([[0.0, 1.0], [1.0, 0.0]]) @ at_once - np.eye(2)) * time) @ [1.0, 0.0]


def loops(fmu: Path) -> pd.DataFrame:
    """The error at 1 s of each way and step, relative to the largest value."""
    rows = {}
    for way, told in WAYS.items():
        run = {key: value for key, value in told.items() if key != "interface"}
        parts = {
            name: {"fmu": str(fmu), "interface": told["interface"], "start": {"through": gain, "x": float(name == "a")}}
            for name, gain in GAINS.items()
        }
        errors = []
        for step in STEPS:
            made = {"run": {"step": step, **run}, "components": parts, "connections": {"a.u": "b.y", "b.u": "a.y"}}
            table = master.run(master.from_dict(made)).table[["a.y", "b.y"]].to_numpy()
            errors.append(np.abs(table[-1] - exact(1.0)).max() / np.abs(table).max())
        rows[way] = [*errors, np.log2(errors[-2] / errors[-1])]
    return pd.DataFrame.from_dict(rows, "index", columns=[*(f"{1e3 * step:g} ms" for step in STEPS), "order"])


def robot(stop: float, algorithm: str, step: float) -> tuple[pd.DataFrame, float, str]:
    """The study's manoeuvre: rows at every ms, seconds of computing, and how it went."""
    system = master.load(ROOT / "study" / "robot.toml")
    system.run.algorithm, system.run.step, system.run.interval = algorithm, step, 1e-3
    began = time.perf_counter()
    try:
        result, said = master.run(system, stop=stop), "ran"
    except PartFailed as failure:
        result, said = failure.result, f"flew apart at {failure.time:.3g} s"
    took = time.perf_counter() - began
    if len(result.coupling):
        one = result.coupling.iloc[0]
        said += f", {one.evaluations / one.solved:.2g} evaluations a step, {one.most} at most"
    return result.table, took, said


def apart(table: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """Of some columns, how far from a reference: root mean square and largest, as a share of what the column spans."""
    names = ["rear_angle", "front_angle", "chassis_pitch"]
    columns = [
        *(f"robot.{name}" for name in names),
        *(f"{end}_reducer.output_torque" for end in ("rear", "front")),
        "rear_motor.current",
    ]
    rows = {}
    for column in columns:
        off, span = table[column].to_numpy() - reference[column].to_numpy(), np.ptp(reference[column])
        rows[column] = [np.sqrt(np.mean(off**2)) / span, np.abs(off).max() / span]
    return pd.DataFrame.from_dict(rows, "index", columns=["root mean square", "largest"])


def ring(component: dict[str, Any]) -> float:
    """Microseconds for a step of one FMU of eight: the least of several turns, the first of which warms up."""
    made = {
        "run": {"stop": COUNT * 1e-3, "step": 1e-3, "algorithm": "jacobi"},
        "components": {f"i{k}": component for k in range(RING)},
        "connections": {f"i{k}.u": f"i{(k + 1) % RING}.x" for k in range(RING)},
    }
    parts: dict[str, Any] = {}  # kept from turn to turn
    took = []
    for _ in range(TURNS):
        marks: list[float] = []
        master.run(master.from_dict(made), progress=lambda share: marks.append(time.perf_counter()), keep=parts)
        took.append(marks[-1] - marks[0])
    for part in parts.values():
        part.close()
    return min(took) / COUNT / RING * 1e6


def distance(fmu: Path) -> dict[str, float]:
    os.environ.setdefault(SECRET, "the secret of a benchmark")
    server = Server(fmu)
    threading.Thread(target=server.run, daemon=True).start()
    try:
        ways = {
            "inside": {"fmu": str(fmu)},
            "processes": {"fmu": str(fmu), "process": True},
            "loopback": {"host": server.address},
        }
        return {way: ring({**told, "interface": "cs"}) for way, told in ways.items()}
    finally:
        server.close()


def draw(errors: pd.DataFrame, tables: dict[str, pd.DataFrame], path: Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8))
    steps = [1e3 * step for step in STEPS]
    for (way, row), line in zip(errors.iterrows(), ("o-", "o-", "s--", "o-")):  # the second and third are the same here
        left.loglog(steps, row.iloc[: len(STEPS)], line, ms=5, label=way)
    left.set_xticks(steps, [f"{step:g}" for step in steps])
    left.set_xticks([], minor=True)
    left.set(xlabel="step [ms]", ylabel="error at 1 s, of the largest value", title="A loop of gain -4.5 against the whole")
    left.legend(fontsize=8)
    for (name, table), line in zip(tables.items(), ({"lw": 2.5, "alpha": 0.5}, {"lw": 0.8}, {"lw": 0.8})):
        right.plot(table["time"], table["rear_reducer.output_torque"], **line, label=name)
    right.set(xlabel="time [s]", ylabel="torque on the rear holder [N.m]", title="The robot's drive shaft", ylim=(-60, 60))
    right.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--distance", action="store_true", help="these figures alone")
    options.add_argument("--stop", type=float, default=4.0, help="of the robot's runs, s")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if not given.distance:
            print((errors := loops(native("lag", Path(folder)))).to_string(), flush=True)
        for way, cost in distance(native("relaxation", Path(folder))).items():
            print(f"{way}: {cost:.3g} µs for a step of one FMU of {RING}", flush=True)
    if given.distance:
        return
    runs = {"Jacobi, 0.1 ms": ("jacobi", 1e-4), "iterated, 1 ms": ("iterated", 1e-3), "Jacobi, 1 ms": ("jacobi", 1e-3)}
    tables = {}
    for name, (algorithm, step) in runs.items():
        tables[name], took, said = robot(given.stop, algorithm, step)
        print(f"{name}: {said}; {took:.3g} s of computing", flush=True)
    print(apart(tables["iterated, 1 ms"], tables["Jacobi, 0.1 ms"]).map("{:.2%}".format))
    draw(errors, tables, ROOT / "docs" / "coupling.png")


if __name__ == "__main__":
    main()
