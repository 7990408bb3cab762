"""The longest step of our FMUs with hostile values that they accept, in processor time.

    python -m benchmarks.hostile [--fmus Reducer Motor] [--draws 20000] [--seed 1]

Each draw is an instance with up to twelve of its parameters, and its inputs, drawn anew: some over all orders of magnitude,
some near to where they matter. It is initialized and makes up to eight steps of 1e-6 to 1e3 s under inputs that jump. What is
refused, and told why, counts as well. Exit code 1 where a step or an initialization took more than MOST.
"""

from __future__ import annotations

import argparse
import random
import secrets
import sys
import time
from collections import Counter
from math import inf

from rich.console import Console
from rich.table import Table

from selflock.fmus.controller.fmu import Controller
from selflock.fmus.correction.fmu import FACES
from selflock.fmus.load.fmu import Load
from selflock.fmus.motor.fmu import Motor
from selflock.fmus.reducer.fmu import Reducer
from selflock.fmus.sensor.fmu import Sensor
from selflock.fmus.variable import Variable

EVERY = {face.__name__: face for face in (Reducer, Motor, Controller, Load, Sensor, *FACES.values())}
MOST = 0.05  # s
NEAR = {  # where a value that is off, or 0, begins to matter
    "friction_kinetic": 0.03, "friction_static": 0.05, "preload": 0.5, "backlash": 0.01, "compliance": 1e-4,
    "stribeck_speed": 3.0, "input_ripple_order": 10.0, "output_ripple_order": 10.0, "mass": 5.0, "damping": 1.0,
}  # fmt: skip


def drawn(row: Variable, wild: bool, rng: random.Random) -> float:
    """A number that this variable accepts."""
    low, high = (bound if bound is not None else unbound for bound, unbound in ((row.minimum, -1e308), (row.maximum, 1e308)))
    if wild:
        size = 10.0 ** rng.choice([rng.uniform(-3, 3), rng.uniform(-12, 12), rng.uniform(-300, 300)])
        value = rng.choice([0.0, size, size, -size])
    else:
        near = NEAR.get(row.name) or abs(float(row.start)) or row.nominal or 1.0
        value = near * 10.0 ** rng.gauss(0.0, rng.choice([0.5, 1.5, 3.0])) * (rng.choice([1.0, -1.0]) if low < 0.0 else 1.0)
    return min(max(value, low), high)


def life(face: type, rng: random.Random, told: Counter) -> tuple[float, str]:
    """One instance: the longest of its calls, s, and what it was."""

    class Told(face):  # type: ignore[misc, valid-type]
        def log(self, *_):
            pass

    it = Told(instance_name="it", resources="")
    given: dict[str, float] = {}

    def put(row: Variable, wild: bool) -> None:
        place = face._place[row.name]
        if row.type == "Boolean":
            given[row.name] = rng.random() < 0.3
            it.set_boolean([place], [given[row.name]])
        elif row.type == "Integer":
            given[row.name] = rng.randint(int(row.minimum or 0), int(row.maximum or 9))
            it.set_integer([place], [given[row.name]])
        else:
            given[row.name] = drawn(row, wild, rng)
            it.set_real([place], [given[row.name]])

    wild = rng.random() < 0.4
    for row in rng.sample(face.parameters, rng.randint(0, min(12, len(face.parameters)))):
        put(row, wild and rng.random() < 0.6)
    for row in face.inputs:
        if rng.random() < 0.7:
            put(row, wild)
    it.setup_experiment(0.0)
    began = time.process_time()
    it.enter_initialization_mode()
    it.exit_initialization_mode()
    longest, what, now = time.process_time() - began, f"initialization {given}", 0.0
    if it._fault:
        told["unfit"] += 1
        return longest, what
    for _ in range(rng.choice([1, 2, 4, 8])):
        size = 10.0 ** rng.choice([rng.uniform(-6, 3), rng.uniform(-4, 0), -3.0])
        began = time.process_time()
        fine = it.do_step(now, size)
        took = time.process_time() - began
        told["steps"] += 1
        told["refused"] += not fine
        if took > longest:
            longest, what = took, f"a step of {size:.6g} s, {given}"
        if not fine:
            break
        now += size
        for row in face.inputs:
            if rng.random() < 0.2:
                put(row, wild)
    return longest, what


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--fmus", nargs="*", default=list(EVERY))
    options.add_argument("--draws", type=int, default=2000, help="of each FMU")
    options.add_argument("--seed", type=int)
    chosen = options.parse_args()
    seed = secrets.randbits(31) if chosen.seed is None else chosen.seed
    table = Table("FMU", "draws", "unfit", "steps", "refused", "longest, ms", title=f"seed {seed}")
    bad = False
    for name in chosen.fmus:
        rng, told, longest, what = random.Random(f"{seed} {name}"), Counter(), -inf, ""
        for _ in range(chosen.draws):
            took, where = life(EVERY[name], rng, told)
            if took > longest:
                longest, what = took, where
        bad |= longest > MOST
        table.add_row(
            name, str(chosen.draws), *(str(told[word]) for word in ("unfit", "steps", "refused")), f"{1e3 * longest:.1f}"
        )
        if longest > 0.2 * MOST:
            print(f"{name}: {1e3 * longest:.1f} ms: {what}", flush=True)
    Console().print(table)
    sys.exit(bad)


if __name__ == "__main__":
    main()
