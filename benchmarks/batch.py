"""A fixed batch of diagnoses, kept to the last bit: python -m benchmarks.batch FOLDER [--against OTHER] [--workers 2]

One hidden case of every kind, four drives with nothing hidden, three pairs, and the measured drives of ../shared/data
(the servo, some ten minutes, with --servo). Each answer is a JSON file in FOLDER with all numbers as they are;
against another folder every difference is told. A change that is to change no answer is held to this before and after.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

MEASURED = ("lead_screw", "worm_drive", "emps", "xl330")


def cases() -> list[tuple[str, tuple[str, ...], int]]:
    """Name, what is hidden, seed; the measured drives have neither."""
    from tests.diagnosis.plant.causes import DRAWS

    pairs = (
        ("reducer.stribeck", "motor.brush_drop"),
        ("load.tilt", "reducer.backlash"),
        ("motor.winding_heating", "controller.delay"),
    )
    listed = [(name, (), -1) for name in reversed(MEASURED)]
    listed += [(f"none_{seed}", (), seed) for seed in (1, 2, 3, 4)]
    listed += [("+".join(pair), pair, 2) for pair in pairs]
    return listed + [(name, (name,), 11) for name in DRAWS]


def answer(name: str, hidden: tuple[str, ...], seed: int) -> str:
    """What is answered, as text."""
    if seed < 0:
        return measured(name)
    from selflock.diagnosis import diagnose
    from tests.diagnosis.plant import bench, score

    with tempfile.TemporaryDirectory() as folder:
        case = bench.hide(list(hidden), seed=seed, target=6.0 if hidden else None)
        rig, train, test = case.write(Path(folder))
        for log in (train, test):
            os.utime(log, (0, 0))  # when they were recorded is told in the answer
        return _text(score.plain(diagnose(rig, [train], test=[test], out=None, seed=seed)))


def measured(name: str) -> str:
    from benchmarks import measurements

    return _text(measurements.answer(name, None).data())


def _text(found: dict) -> str:
    return json.dumps(found, indent=1, sort_keys=True, default=float)


def one(folder: str, name: str, hidden: tuple[str, ...], seed: int) -> str:
    (Path(folder) / f"{name}.json").write_text(answer(name, hidden, seed))
    return name


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--servo", action="store_true")
    parser.add_argument("--only", nargs="*", default=[])
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    listed = [case for case in cases() if case[0] in (chosen.only or [c[0] for c in cases() if chosen.servo or c[0] != "xl330"])]
    listed = [case for case in listed if not (chosen.folder / f"{case[0]}.json").exists()]
    with ProcessPoolExecutor(chosen.workers) as pool:
        for done in as_completed([pool.submit(one, str(chosen.folder), *case) for case in listed]):
            print(done.result(), flush=True)
    if chosen.against:
        names = sorted(p.name for p in chosen.folder.glob("*.json") if (chosen.against / p.name).exists())
        differ = [name for name in names if (chosen.folder / name).read_text() != (chosen.against / name).read_text()]
        print(f"{len(names)} compared, {len(differ)} differ: {', '.join(differ) or 'none'}")
        sys.exit(bool(differ))


if __name__ == "__main__":
    main()
