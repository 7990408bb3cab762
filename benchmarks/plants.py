"""What the commands of the plants written apart share: each asks its cases once, a line a case, then tells what was right."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from selflock.diagnosis import diagnose

STRONG = 2.0  # times the noise that the sheet's drive leaves


def named(cause) -> str:
    """A cause as the plants call it."""
    which = {"sensor": cause.channel, "parameter": next(iter(cause.parameters), "")}
    of = which.get(cause.component) or which.get(cause.effect) or ""
    return f"{cause.component}.{cause.effect} {of}".strip()


def _one(
    plant: ModuleType, about: Callable[[Any], str], names: list[str], seed: int, faulty: bool, duration: float
) -> tuple[bool, bool]:
    """Whether it was answered rightly, and whether it could be asked."""
    case, began = plant.hide(names, seed, duration, faulty), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        rig, train, test = case.write(Path(folder))
        result = diagnose(rig, train, test=[test], out=None, seed=seed)
    said = [named(cause) for cause in result.causes]
    if not names or names[0].startswith("unknown"):
        right = result.verdict == ("unknown" if names else "none")
    else:
        right = bool(said) and said[0] == names[0]
    hidden = " ".join(names) or ("faults: " + ", ".join(case.faults) if faulty else "none")
    numbers = {n: float(f"{v['value']:.4g}") for cause in result.causes for n, v in cause.parameters.items()}
    print(
        f"{'right' if right else 'WRONG'}  {hidden} ({seed}{about(case)}), {case.ratio:.1f} times the noise: "
        f"{result.verdict} {said} {numbers} {time.process_time() - began:.0f} s",
        flush=True,
    )
    return right, case.ratio >= STRONG or not names


def ask(plant: ModuleType, faults: int, seconds: float, about: Callable[[Any], str] = lambda case: "") -> None:
    """From the command line. faults, seconds: as many, and as long, where nobody says; about: what a line tells of a case."""
    parser = argparse.ArgumentParser(description=plant.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=plant.DEVELOPMENT, help="the first seed")
    parser.add_argument("--none", type=int, default=8, help="sound drives")
    parser.add_argument("--faults", type=int, default=faults, help="sound drives behind a faulty recording")
    parser.add_argument("--causes", type=int, default=len(plant.CAUSES), help="how many causes, from the first on")
    parser.add_argument("--seconds", type=float, default=seconds, help="of each log")
    parser.add_argument("--only", nargs="*", default=[], help="names of causes; else each once")
    asked = parser.parse_args()
    causes = [([name], False) for name in (asked.only or plant.CAUSES)][: asked.causes]
    sound, spoilt = [([], False)] * asked.none, [([], True)] * asked.faults
    seeds = range(asked.first, asked.first + 10**6)
    rows = [
        (kind, *_one(plant, about, names, seed, faulty, asked.seconds))
        for kind, listed in (("none", sound), ("faults", spoilt), ("causes", causes))
        for (names, faulty), seed in zip(listed, seeds)
    ]
    for kind in ("causes", "none", "faults"):
        told = [right for of, right, strong in rows if of == kind and strong]
        print(f"{kind}: {sum(told)} of {len(told)}{' strong ones first' if kind == 'causes' else ' answered none'}")
