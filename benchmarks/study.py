"""How much the coupling costs: runs of the study against pymunk's own bare steps in them.

    python benchmarks/study.py [seconds of simulated time]

Bare is the time of `space.step` alone, on the same bodies and joints, as often as the run steps them. Runs are timed
from their first to their last communication point; building and settling the robot are left out. Everything is
measured in turn several times, in processor time, and the least taken: other work on the machine comes and goes.
"""

from __future__ import annotations

import sys
from time import thread_time

from rich.console import Console
from rich.table import Table

from selflock.master import run
from selflock.study import runs
from selflock.vehicle import Robot

ROUNDS = 7
FRICTION = 0.03


def robot(**settings) -> Robot:
    return Robot("robot", **(runs.system().components["robot"].start | settings))


def bare(stop: float) -> float:
    """Seconds of pymunk's steps alone."""
    model, inner = robot().model, robot().get("inner_step")
    step, count = model.space.step, round(stop / inner)
    began = thread_time()
    for _ in range(count):
        step(inner)
    return thread_time() - began


def coupled(mode: str, stop: float, **settings) -> float:
    """Seconds of a run of the study, from its first to its last communication point."""
    system = runs.system(mode)
    system.components["robot"].start |= settings
    case = runs.Case(mode, FRICTION, mode, FRICTION)
    ends = []

    def observe(time: float, parts) -> None:
        if time == 0.0 or time >= stop - 1e-9:
            ends.append(thread_time())

    run(system, settings=runs.settings_of(case, system), stop=stop, observe=observe)
    return ends[-1] - ends[0]


def belt_alone(stop: float) -> float:
    """Seconds of the vehicle with belt tracks, stepped by 1 ms without any FMU."""
    part = robot(track="belt")
    part.bind(["front_torque", "rear_torque"], ["front_angle", "rear_angle"])
    part.enter_initialization(0.0, stop)
    part.exit_initialization()
    began = thread_time()
    for k in range(round(stop / 1e-3)):
        part.write()
        part.step(k * 1e-3, 1e-3)
        part.read()
    return thread_time() - began


def main(stop: float) -> None:
    measures = {
        "bare": lambda: bare(stop),
        "dynamic": lambda: coupled("dynamic", stop),
        "kinematic": lambda: coupled("kinematic", stop),
        "belt, dynamic": lambda: coupled("dynamic", stop, track="belt"),
        "belt alone": lambda: belt_alone(stop),
    }
    times = {name: [] for name in measures}
    coupled("dynamic", 0.01)  # builds FMUs, compiles kernels
    belt_alone(0.01)
    for _ in range(ROUNDS):
        for name, measure in measures.items():
            times[name].append(measure())
    took = {name: min(values) for name, values in times.items()}
    table = Table(title=f"{stop:g} s of the robot, least of {ROUNDS}")
    for heading in ("", "seconds", "x bare steps", "target", "x real time"):
        table.add_column(heading, justify="left" if not heading else "right")
    rows = (("bare", "pymunk's bare steps", ""), ("dynamic", "segmented tracks, dynamic", "≤ 3"),
            ("kinematic", "segmented tracks, kinematic", "≤ 2"), ("belt, dynamic", "belt tracks, dynamic", ""))  # fmt: skip
    for key, name, target in rows:
        table.add_row(name, f"{took[key]:.3f}", f"{took[key] / took['bare']:.2f}", target, f"{stop / took[key]:.1f}")
    table.add_row("belt tracks without FMUs", f"{took['belt alone']:.3f}", "", "", f"{stop / took['belt alone']:.0f} (≥ 50)")
    Console().print(table)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 5.0)
