"""The diagnosis on another plant than that of the studies (tests/diagnosis/plant/impulses.py): each cause, none, and faults.

    python -m benchmarks.impulses [--first 10000] [--none 8] [--faults 8] [--only reducer.viscous ...]

One line a case, then what was right. Seeds from 10 000 on are for development, those below judge: no rule may be chosen on them.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from selflock.diagnosis import diagnose
from tests.diagnosis.plant import impulses

STRONG = 2.0  # times the noise that the sheet's drive leaves


def one(names: list[str], seed: int, faulty: bool, duration: float) -> tuple[bool, bool]:
    """Whether it was answered rightly, and whether it could be asked."""
    case, began = impulses.hide(names, seed, duration, faulty), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        rig, train, test = case.write(Path(folder))
        result = diagnose(rig, [train], test=[test], out=None, seed=seed)
    said = [cause.label for cause in result.causes]
    if not names:
        right = result.verdict == "none"
    elif names[0].startswith("unknown"):
        right = result.verdict == "unknown"
    else:
        right = bool(said) and said[0].split(" (")[0] == names[0].replace(".", " ")
    asked = case.ratio >= STRONG or not names
    hidden = " ".join(names) or ("faults: " + ", ".join(case.faults) if faulty else "none")
    numbers = {n: float(f"{v['value']:.4g}") for cause in result.causes for n, v in cause.parameters.items()}
    print(
        f"{'right' if right else 'WRONG'}  {hidden} ({seed}), {case.ratio:.1f} times the noise: {result.verdict} {said} {numbers} "
        f"{time.process_time() - began:.0f} s",
        flush=True,
    )
    return right, asked


def main() -> None:
    """From the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=impulses.DEVELOPMENT, help="the first seed")
    parser.add_argument("--none", type=int, default=8, help="sound drives")
    parser.add_argument("--faults", type=int, default=8, help="sound drives behind a faulty recording")
    parser.add_argument("--seconds", type=float, default=15.0, help="of each log")
    parser.add_argument("--only", nargs="*", default=[], help="names of causes; else each once")
    asked = parser.parse_args()
    causes = [([name], False) for name in (asked.only or impulses.CAUSES)]
    sound, spoilt = [([], False)] * asked.none, [([], True)] * asked.faults
    seeds = range(asked.first, asked.first + 10**6)
    rows = [
        (kind, *one(names, seed, faulty, asked.seconds))
        for kind, listed in (("none", sound), ("faults", spoilt), ("causes", causes))
        for (names, faulty), seed in zip(listed, seeds)
    ]
    for kind in ("causes", "none", "faults"):
        told = [right for of, right, strong in rows if of == kind and strong]
        print(f"{kind}: {sum(told)} of {len(told)}{' strong ones first' if kind == 'causes' else ' answered none'}")


if __name__ == "__main__":
    main()
