"""What is asked of a rig: which code of it may run, and what a diagnosis of it reads."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from selflock.fmus.laws import joined
from selflock.master.code import allowed_effects

from .data.rig import Rig, load
from .errors import DataError


def asked(rig: str | Path | Rig, allow_code: bool, isolate: bool = False) -> Rig:
    """The rig, read where it is a file, with what its user allows."""
    if not isinstance(rig, (str, Path, Rig)):
        raise DataError(f"a rig is a file, its path, or what selflock.diagnosis.load gave: a {type(rig).__name__} is none.")
    rig = rig if isinstance(rig, Rig) else load(rig)
    return replace(rig, allow_code=rig.allow_code or allow_code, isolate=rig.isolate or isolate)


def laws(rig: Rig) -> AbstractContextManager[None]:
    """The laws of a call: ours, and the rig's effects beside them where its user allows them to run."""
    return joined(allowed_effects(rig.effects, f"{rig.path}: [rig]", rig.allow_code))


def files(rig: Rig, logs: Sequence[str | Path], test: Sequence[str | Path]) -> list[Path]:
    """What a search reads, those that there are."""
    found = [*map(Path, logs), *map(Path, test), *([rig.system] if rig.system else [])]
    if rig.system is not None and rig.system.suffix == ".toml" and rig.system.is_file():
        from selflock.master import load as load_system

        system = load_system(rig.system, rig.allow_code)
        found += [system.folder / component.fmu for component in system.components.values() if component.fmu]
    found += sorted(rig.effects.glob("*.py")) if rig.effects and rig.effects.is_dir() else []
    return [path for path in found if path.is_file()]
