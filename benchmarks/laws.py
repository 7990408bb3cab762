"""What a step of the reducer's law costs, plain as in the FMU and compiled as in the diagnosis, in microseconds.

python benchmarks/laws.py
"""

from __future__ import annotations

from time import perf_counter

from numba import njit
from rich.console import Console
from rich.table import Table

from selflock.fmus.reducer import shaft, wedge
from selflock.master.compiled import compiled

STEP, ROUNDS, COUNT = 1e-3, 7, 5000
CASES = {  # parameters, output torque, speed of the input shaft, share of the torque that sliding needs
    "stuck": ({}, 2.0, 0.0, 0.5),
    "sliding": ({}, 2.0, 50.0, 1.0),
    "sliding, viscous": ({"viscous_damping": 1e-4}, 2.0, 50.0, 1.0),
    "sliding, ripple": ({"input_ripple": 0.1}, 2.0, 50.0, 1.0),
}


def case(law, changes, torque, speed, share):
    """Parameters, state and inputs of a case."""
    p = law.Parameters(**changes)
    push = share * wedge.sliding_torque(torque, 1.0, p.friction_kinetic, 0.0, 1.0 / p.gear_ratio, p.gear_ratio)
    return p, law.relaxed(p, torque, speed, 0.0, speed / p.gear_ratio), push, speed / p.gear_ratio


def rounds(advance, arguments):
    """The least of several rounds, in microseconds per step."""
    best = float("inf")
    for _ in range(ROUNDS):
        begin = perf_counter()
        advance(*arguments, COUNT)
        best = min(best, (perf_counter() - begin) / COUNT * 1e6)
    return best


def loop(step):
    def run(p, state, push, speed, count):
        for i in range(count):
            state, out = step(p, state, push, speed * STEP * i, speed, STEP)
        return out

    return run


def main() -> None:
    fast = compiled("selflock.fmus.reducer.shaft")
    plain, quick = loop(shaft.advance), njit(loop(fast.advance))
    table = Table("reducer, 1 ms step", "plain, us", "compiled, us")
    for name, values in CASES.items():
        table.add_row(name, f"{rounds(plain, case(shaft, *values)):.2f}", f"{rounds(quick, case(fast, *values)):.3f}")
    Console().print(table)


if __name__ == "__main__":
    main()
