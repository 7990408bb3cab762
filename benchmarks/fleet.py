"""A hidden fleet: many units over a year, some of them wearing; what is named, and what it costs.

    python -m benchmarks.fleet [--search] [--units 50] [--months 12] [--worn 3] [--seconds 5] [--seed 0] [--workers 2] [--only 9 21 ...] [--picture]
    python -m benchmarks.fleet --draw          only look at the diagnoses at hand again

Units are of one type (the plant of tests/diagnosis/plant): each has tolerances of its own, a room that is warm in summer and
different every day, and every month a short log of another motion. Some wear, from a month on that the seed draws: grease
goes (viscous damping), the wedge is run in (friction falls), brushes go (resistance grows). Logs and diagnoses are kept in
out/fleet_benchmark: an interrupted one goes on. What docs/track.md says is printed; the page is track.html there, and --picture
makes docs/track.png of it.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.pictures import picture
from tests.diagnosis.plant import bench
from tests.diagnosis.plant.drive import Drive
from tests.diagnosis.plant.rig import SEEN, rig

ROOT = Path(__file__).parents[1]
OUT = ROOT / "out" / "fleet_benchmark"
FIRST = datetime(2025, 1, 8)
MONTH = 30.4  # days

UNCERTAIN = """
[uncertain]   # what wears, and what every unit has of its own
"reducer.friction_kinetic" = [0.005, 0.05]
"reducer.viscous_damping" = [0.0, 1e-3]
"motor.resistance" = [1.0, 4.0]
"motor.voltage_constant" = [0.03, 0.08]
"""
WEAR = {  # what becomes of a field of the drive: the product's name, and the change within a year at its full rate
    "viscous": ("reducer.viscous_damping", 0.8),
    "friction": ("reducer.friction_kinetic", -0.25),
    "resistance": ("motor.resistance", 0.12),
}


def unit(rng: np.random.Generator, sheet: Drive) -> Drive:
    """One of a type: what differs between two of them."""
    off = lambda share: float(1.0 + share * rng.uniform(-1.0, 1.0))
    return sheet._replace(
        friction=sheet.friction * off(0.06),
        viscous=9e-5 * off(0.2),
        resistance=sheet.resistance * off(0.03),
        voltage_constant=(constant := sheet.voltage_constant * off(0.02)),
        torque_constant=constant,
        ambient_friction=0.06,
    )


def worn(drive: Drive, field: str, month: float, since: float) -> Drive:
    """The drive after some months, one of its fields changing at an even rate since then."""
    return drive._replace(**{field: getattr(drive, field) * (1.0 + WEAR[field][1] * max(0.0, month - since) / 12.0)})


def plan(seed: int, units: int, count: int) -> dict[int, tuple[str, float]]:
    """Which units wear: the field, and the month in which it begins."""
    rng = np.random.default_rng([seed, 1])
    fields = [list(WEAR)[k % len(WEAR)] for k in range(count)]
    return {int(u): (field, float(rng.uniform(1.0, 5.0))) for u, field in zip(rng.permutation(units)[:count], fields)}


def record(given: argparse.Namespace) -> dict[int, tuple[str, float]]:
    """Every log that is not there yet; gives what is hidden."""
    sheet, hidden = bench.nominal(np.random.default_rng([given.seed, 0])), plan(given.seed, given.units, given.worn)
    (OUT / "logs").mkdir(parents=True, exist_ok=True)
    (OUT / "rig.toml").write_text(rig(sheet).replace('name = "hidden bench"', 'name = "drive of the hidden fleet"') + UNCERTAIN)
    for number in given.only or range(given.units):
        drive = unit(np.random.default_rng([given.seed, 2, number]), sheet)
        for month in range(given.months):
            rng = np.random.default_rng([given.seed, 3, number, month])
            when = FIRST + timedelta(days=MONTH * month + float(rng.uniform(-5.0, 5.0)))
            path = OUT / "logs" / f"{number:02d}" / f"{when:%Y-%m-%d}.csv"
            if path.exists():
                continue
            path.parent.mkdir(exist_ok=True)
            now = worn(drive, *((hidden[number][0], month, hidden[number][1]) if number in hidden else ("viscous", 0.0, 0.0)))
            motion = bench.motion(rng, given.seconds)
            warm = 22.0 - 7.0 * np.cos(2.0 * np.pi * month / 12.0) + rng.normal(0.0, 1.5)
            motion = replace(motion, ambient=np.full(len(motion.angle), warm))
            table = bench.record(bench.run(now, motion), now, rng)[["time", *SEEN["forward"]]]
            table.to_csv(path, index=False, float_format="%.7g")
    return {number: what for number, what in hidden.items() if not given.only or number in given.only}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, usual in (("units", 50), ("months", 12), ("worn", 3), ("seconds", 5.0), ("seed", 0), ("workers", 2)):
        parser.add_argument(f"--{name}", type=type(usual), default=usual)
    parser.add_argument(
        "--only", type=int, nargs="*", help="these of the units alone; six or more, that what all do at once is told"
    )
    parser.add_argument("--draw", action="store_true")
    parser.add_argument("--picture", action="store_true")
    parser.add_argument("--search", action="store_true", help="look for causes, too, where a log is not explained")
    given = parser.parse_args()

    from selflock.diagnosis import diagnose_fleet, track
    from selflock.sweep import map_runs

    hidden = record(given)
    began = time.perf_counter()
    row = {}
    if not given.draw:
        found = diagnose_fleet(
            OUT / "rig.toml",
            OUT / "logs",
            OUT / "fleet",
            partial(map_runs, workers=given.workers, progress=True),
            search=given.search,
        )
        row = {"minutes": round((time.perf_counter() - began) / 60.0, 1)}
        print(found.summary())
    began = time.perf_counter()
    result = track(OUT / "fleet", OUT / "track.html")
    row["seconds of track"] = round(time.perf_counter() - began, 1)
    print(result.summary())
    right = {(f"{number:02d}", WEAR[field][0]) for number, (field, _) in hidden.items()}
    named = {(change.unit, change.parameter) for change in result.changes}
    print(f"hidden: {hidden}")
    row |= {"units": given.units, "months": given.months, "logs": len(result.diagnoses.table), "worn": len(right)}
    row |= {
        "found": len(right & named),
        "false": len(named - right),
        "verdicts": result.diagnoses.table["verdict"].value_counts().to_dict(),
    }
    row["page"] = (OUT / "track.html").stat().st_size
    if given.picture:
        picture(OUT / "track.html", ROOT / "docs" / "track.png", width=1035, height=810)
    print(json.dumps(row))


if __name__ == "__main__":
    main()
