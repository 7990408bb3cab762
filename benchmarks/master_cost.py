"""The master's cost per FMU step, as a ratio to the bare C calls on the same FMUs in the same run.

    python benchmarks/master_cost.py [--steps 2000] [--fmu some.fmu --input u --output x]

Bare: fmi2SetReal, fmi2DoStep, fmi2GetReal through ctypes on preallocated buffers, one input and one output per
instance, nothing passed on and nothing recorded. The master does the same calls, passes outputs on around a ring,
keeps the table, counts time, checks every status and every number. Both are timed in turns, the least time counts.
"""

from __future__ import annotations

import argparse
import ctypes
import statistics
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from selflock import master
from selflock.master.fmu import FmuPart

ROOT = Path(__file__).parents[1]


def system(fmu: Path, count: int, step: float, given: str, taken: str, start: dict) -> master.System:
    """`count` instances in a ring."""
    return master.from_dict(
        {
            "run": {"step": step, "record": ["*." + taken], "coupling_tolerance": 0.0},  # a loop through the ring lags
            "components": {f"i{k}": {"fmu": str(fmu), "start": start} for k in range(count)},
            "connections": {f"i{k}.{given}": {"from": f"i{(k + 1) % count}.{taken}", "convert": False} for k in range(count)},
        }
    )


def bare(fmu: Path, count: int, steps: int, step: float, given: str, taken: str) -> float:
    """Seconds per FMU step of the C calls alone."""
    parts = [FmuPart(f"b{k}", fmu) for k in range(count)]
    calls = []
    for part in parts:
        part.enter_initialization(0.0, None)
        part.exit_initialization()
        library, known = part._library, part._places
        reference = [(ctypes.c_uint * 1)(known[name].reference) for name in (given, taken)]
        values = [(ctypes.c_double * 1)() for _ in range(2)]
        calls.append((library["fmi2SetReal"], library["fmi2DoStep"], library["fmi2GetReal"], part._instance, *reference, *values))
    now, size, one, keep = ctypes.c_double(), ctypes.c_double(step), ctypes.c_size_t(1), ctypes.c_int(1)
    began = time.perf_counter()
    for index in range(steps):
        now.value = index * step
        for set_real, do_step, get_real, instance, reference_in, reference_out, value_in, value_out in calls:
            set_real(instance, reference_in, one, value_in)
            do_step(instance, now, size, keep)
            get_real(instance, reference_out, one, value_out)
    took = time.perf_counter() - began
    for part in parts:
        part.close()
    return took / (steps * count)


def coupled(fmu: Path, count: int, steps: int, step: float, given: str, taken: str, start: dict) -> float:
    """Seconds per FMU step of the master; loading and initialization, timed by the first observed point, left out."""
    began = []
    description = system(fmu, count, step, given, taken, start)
    description.run.stop = steps * step

    def observe(now, parts):
        if now == 0.0 or now >= (steps - 0.5) * step:
            began.append(time.perf_counter())

    master.run(description, observe=observe)
    return (began[-1] - began[0]) / (steps * count)


def ratio(fmu: Path, count: int, steps: int, step: float, given: str, taken: str, start: dict, turns: int = 5):
    pairs = [
        (bare(fmu, count, steps, step, given, taken), coupled(fmu, count, steps, step, given, taken, start)) for _ in range(turns)
    ]
    return min(b for b, _ in pairs), min(c for _, c in pairs), statistics.median(c / b for b, c in pairs)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--steps", type=int, default=2000)
    options.add_argument("--instances", type=int, nargs="+", default=[2, 8, 32, 100])
    options.add_argument("--fmu", type=Path, nargs="*", help="FMU files to time; default: Motor of this package and a native one")
    options.add_argument("--input", default="voltage")
    options.add_argument("--output", default="torque")
    chosen = options.parse_args()
    sys.path.insert(0, str(ROOT / "tests" / "native"))
    from pack import pack

    table = Table("FMU", "instances", "bare, µs", "master, µs", "ratio", "median ratio", title="cost of one FMU step")
    with tempfile.TemporaryDirectory() as folder:
        if chosen.fmu:
            cases = [(path, chosen.input, chosen.output, {}) for path in chosen.fmu]
        else:
            from selflock.fmus.build import built

            cases = [(built("Motor"), "voltage", "torque", {"speed": 0.0}), (pack("relaxation", folder), "u", "x", {"rate": 1.0})]
        for path, given, taken, start in cases:
            for count in chosen.instances:
                least, most, middle = ratio(path, count, max(200, chosen.steps * 8 // count), 0.001, given, taken, start)
                table.add_row(
                    path.stem, str(count), f"{1e6 * least:.2f}", f"{1e6 * most:.2f}", f"{most / least:.2f}", f"{middle:.2f}"
                )
    Console().print(table)


if __name__ == "__main__":
    main()
