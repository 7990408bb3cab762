"""Cost of the vehicle: its whole inner step over pymunk's own step of the same bodies, the belt against real time, whole runs.

    python -m benchmarks.vehicle

Each figure is the least processor time of many rounds, all taken in this one run, in turns.
"""

from __future__ import annotations

import math
import time

import numpy as np
from numba import njit

from selflock import master
from selflock.master import convoy, simulation
from selflock.study import runs
from selflock.vehicle import Robot
from selflock.vehicle.munk import call_step

ROUNDS, TIME = 80, 0.04  # s of simulated time in a round: short, so that some rounds meet no other work on the machine
LONG = 1.5  # s of a whole run


@njit
def bare_steps(steps, step, space, dt):
    for _ in range(steps):
        call_step(step, space, dt)


def best(actions: dict, rounds: int = ROUNDS) -> dict[str, float]:
    """Shortest time of each action in s, taken in turns."""
    times = {name: [] for name in actions}
    for _ in range(rounds + 1):
        for name, action in actions.items():
            begin = time.thread_time()
            action()
            times[name].append(time.thread_time() - begin)
    return {name: min(values[1:]) for name, values in times.items()}


def drive(robot: Robot, size: float = 1e-3):
    """A part's life as the master sees it: write, step, read, with the holders held by a spring."""
    robot.bind(["front_torque", "rear_torque"], ["front_angle", "front_speed", "rear_angle", "rear_speed", "rear_ground_normal"])
    robot.exit_initialization()
    robot.read()

    def run():
        for i in range(round(TIME / size)):
            robot.u[0] = -2e4 * (robot.y[0] + size * robot.y[1])
            robot.u[1] = -2e4 * (robot.y[2] + size * robot.y[3])
            robot.write()
            robot.step(i * size, size)
            robot.read()

    return run


def whole(mode: str, alone: bool = False) -> float:
    """Processor time of a ms of the study's manoeuvre while its posture is that of the rounds, µs; `alone`: without the robot."""
    system = runs.system(mode)
    if alone:
        del system.components["robot"]
        apart = lambda name: name.partition(".")[0] == "robot"
        system.connections = {to: wire for to, wire in system.connections.items() if not apart(to) and not apart(wire.source)}
        system.bonds = [bond for bond in system.bonds if not apart(bond.effort) and not apart(bond.flow)]
        system.run.order.remove("robot")
        system.run.open_inputs = True
    marks: list[tuple[float, float]] = []  # simulated and processor time, s
    convoy.STRETCH, before = 50, convoy.STRETCH  # macro steps from mark to mark
    try:
        master.run(system, stop=LONG, progress=lambda done: marks.append((LONG * done, time.thread_time())))
    finally:
        convoy.STRETCH = before
    simulated, took = np.diff(marks[1:-1], axis=0).T
    return float(np.min(took / simulated)) * 1e3


def main() -> None:
    simulation.TWINS = 0  # laws of FMUs are compiled, as in long runs
    segmented, belt, coarse, falling = Robot(), Robot(track="belt"), Robot(track="belt", inner_step=1e-3), Robot()
    model = falling.model
    inner = math.ceil(1e-3 / model.inner - 1e-9)  # inner steps of a communication step
    dt = 1e-3 / inner
    steps = round(TIME / dt)
    took = best(
        {
            "vehicle": drive(segmented),
            "belt": drive(belt),
            "coarse": drive(coarse),
            "bare": lambda: bare_steps(steps, model.step_address, model.space_address, dt),
            "python": lambda: [model.space.step(dt) for _ in range(steps)],
        }
    )
    vehicle, bare, python = (took[name] / steps * 1e6 for name in ("vehicle", "bare", "python"))
    print(f"{len(model.bodies)} bodies, {len(model.joints)} joints, inner step {dt * 1e3:.3g} ms, communication step 1 ms")
    print(f"  pymunk's step from compiled code      {bare:7.2f} µs")
    print(f"  pymunk's step from Python             {python:7.2f} µs")
    ratios = f"{vehicle / bare:.2f} x pymunk's step ({vehicle / python:.2f} x from Python)"
    print(f"  whole vehicle step                    {vehicle:7.2f} µs  = {ratios}")
    for mode in ("dynamic", "kinematic"):
        run, drives = (min(whole(mode, alone) for _ in range(4)) for alone in (False, True))
        told = f"{run / inner / bare:.2f} x pymunk's steps; its FMUs and the master's rows alone {drives:.1f} µs"
        print(f"  whole run, {mode:10}                 {run:7.1f} µs a ms = {told}")
    print(f"  segmented track                       {TIME / took['vehicle']:7.1f} x real time")
    print(f"  belt track, inner step {dt * 1e3:.3f} ms       {TIME / took['belt']:7.1f} x real time")
    print(f"  belt track, inner step 1 ms           {TIME / took['coarse']:7.1f} x real time")


if __name__ == "__main__":
    main()
