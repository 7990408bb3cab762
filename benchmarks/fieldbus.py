"""The diagnosis on drives that lift nothing, read over a field bus (tests/diagnosis/plant/fieldbus.py): none, faults, causes.

    python -m benchmarks.fieldbus [--first 10000] [--none 8] [--faults 4] [--only reducer.viscous ...]

One line a case, then what was right. Seeds from 10 000 on are for development, those below judge: no rule may be chosen on them.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from selflock.diagnosis import diagnose
from tests.diagnosis.plant import fieldbus

STRONG = 2.0  # times the noise that the sheet's drive leaves


def named(cause) -> str:
    """A cause as the plant calls it."""
    which = {"sensor": cause.channel, "parameter": next(iter(cause.parameters), "")}
    of = which.get(cause.component) or which.get(cause.effect) or ""
    return f"{cause.component}.{cause.effect} {of}".strip()


def one(names: list[str], seed: int, faulty: bool, duration: float, keep: str = "") -> tuple[bool, bool]:
    """Whether it was answered rightly, and whether it could be asked."""
    case, began = fieldbus.hide(names, seed, duration, faulty), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        rig, train, test = case.write(Path(keep or folder))
        result = diagnose(rig, train, test=[test], out=None, seed=seed)
    said = [named(cause) for cause in result.causes]
    if not names or names[0].startswith("unknown"):
        right = result.verdict == ("unknown" if names else "none")
    else:
        right = bool(said) and said[0] == names[0]
    hidden = " ".join(names) or ("faults: " + ", ".join(case.faults) if faulty else "none")
    numbers = {n: float(f"{v['value']:.4g}") for cause in result.causes for n, v in cause.parameters.items()}
    print(
        f"{'right' if right else 'WRONG'}  {hidden} ({seed}; {case.make.load} by {case.make.way}, {case.recorder.table}, "
        f"{case.recorder.stamps}), {case.ratio:.1f} times the noise: {result.verdict} {said} {numbers} "
        f"{time.process_time() - began:.0f} s",
        flush=True,
    )
    return right, case.ratio >= STRONG or not names


def main() -> None:
    """From the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=fieldbus.DEVELOPMENT, help="the first seed")
    parser.add_argument("--none", type=int, default=8, help="sound drives")
    parser.add_argument("--faults", type=int, default=4, help="sound drives behind a faulty recording")
    parser.add_argument("--causes", type=int, default=len(fieldbus.CAUSES), help="how many causes, from the first on")
    parser.add_argument("--seconds", type=float, default=8.0, help="of each of three logs")
    parser.add_argument("--only", nargs="*", default=[], help="names of causes; else each once")
    asked = parser.parse_args()
    causes = [([name], False) for name in (asked.only or fieldbus.CAUSES)][: asked.causes]
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
