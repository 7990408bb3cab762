"""Parameters that the diagnosis finds beside those that were hidden: python -m benchmarks.parameters [--seeds 3] [NAME ...]

Prints each case, then for each cause how many were named, how many amounts are near the hidden one (within three half
intervals or a tenth), and the median of found over hidden: 1 where nothing biases it.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from selflock.diagnosis import diagnose
from tests.diagnosis.plant import bench, score

NAMES = ("motor.brush_drop", "controller.dead_zone", "controller.delay", "controller.sampling", "reducer.backlash",
         "reducer.compliance", "reducer.preload", "sensor.bias", "sensor.scale", "sensor.lag", "parameter")  # fmt: skip
"""Causes whose parameters mean the same in plant and product."""


def found(name, seed, folder):
    """Whether the cause was named, and the amounts, hidden and found."""
    case = bench.hide([name], seed=seed, target=6.0)
    rig, train, test = case.write(folder)
    result = score.plain(diagnose(rig, [train], test=[test], out=None, seed=seed))
    return score.right_first(result, case), score.amounts(result, case)


def main(names: list[str], seeds: int) -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            cases = [found(name, seed, Path(folder) / f"{name}{seed}") for seed in range(seeds)]
            for seed, (right, amounts) in enumerate(cases):
                print(f"{name} {seed}: {'named' if right else 'not named'}; {'; '.join(map(str, amounts))}", flush=True)
            rows.append((name, [amounts for right, amounts in cases if right]))
    print(f"{'cause':22}{'named':>8}{'near':>8}{'found / hidden, median':>26}")
    for name, cases in rows:
        amounts = [amount for case in cases for amount in case]
        bias = np.median([amount.found / amount.hidden for amount in amounts]) if amounts else np.nan
        print(f"{name:22}{len(cases):>5}/{seeds}{sum(a.near for a in amounts):>5}/{len(amounts)}{bias:>26.3f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help=", ".join(NAMES))
    parser.add_argument("--seeds", type=int, default=3)
    given = parser.parse_args()
    main(given.names or list(NAMES), given.seeds)
