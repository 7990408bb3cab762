"""Fits that are kept in a folder as they end, so that a search that was stopped goes on where it was, to the same bits.

Everything else of a search is computed again, from the same seed: fits take nearly all of its time. A fit is known by what
it begins with: the misfit at its start, the numbers that it frees, the rules in force.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import secrets
import shutil
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from selflock.fmus.cache import sha256

from ..rules import RULES

FOLDER = "kept"  # in that of the command
DECIDES = ("selflock.diagnosis", "selflock.fmus", "selflock.master")  # packages whose sources decide the bits of a fit
LIBRARIES = ("numpy", "scipy", "numba")


@dataclass(frozen=True)
class Kept:
    """Fits in a folder, of draws of a seed."""

    folder: Path
    seed: int

    @classmethod
    def of(cls, out: Path, about: Any, files: Sequence[Path], seed: int | None) -> Kept:
        """The fits kept in `out` of a search like this; none where another was begun there. seed: drawn where none is given."""
        folder = out.resolve() / FOLDER  # other processes keep theirs there, too
        whole = [
            json.dumps(about, default=_plain, sort_keys=True),
            [sha256(path) for path in files],
            repr(RULES),
            _sources(),
        ]
        told = {"diagnosis": hashlib.sha256(json.dumps(whole).encode()).hexdigest()}
        try:
            known = json.loads((folder / "about.json").read_text("utf-8"))
        except (OSError, ValueError):
            known = {}
        if known.get("diagnosis") == told["diagnosis"] and seed in (None, known.get("seed")):
            return cls(folder, int(known["seed"]))
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        seed = secrets.randbits(32) if seed is None else seed
        _write(folder / "about.json", json.dumps(told | {"seed": seed}).encode())
        return cls(folder, seed)

    @property
    def count(self) -> int:
        """Fits that are there."""
        return len(list(self.folder.glob("*.npz")))

    def key(self, misfit: np.ndarray, *what: Any) -> str:
        """Of a fit that begins with this misfit."""
        told = hashlib.sha256(np.ascontiguousarray(misfit).tobytes())
        told.update(repr(what).encode())
        return told.hexdigest()[:40]

    def get(self, key: str) -> dict[str, np.ndarray] | None:
        """What is kept of a fit."""
        try:
            with np.load(io.BytesIO((self.folder / f"{key}.npz").read_bytes()), allow_pickle=False) as file:
                return dict(file)
        except (OSError, ValueError, EOFError, BadZipFile):  # none, or a torn one
            return None

    def put(self, key: str, **fitted: Any) -> None:
        """Keep a fit; where the disk is full, it is not kept, and that is all."""
        new = self.folder / f"{key}.{os.getpid()}.{threading.get_ident()}.new"
        try:
            with new.open("wb") as file:
                np.savez(file, **fitted)
            os.replace(new, self.folder / f"{key}.npz")
        except OSError:
            new.unlink(missing_ok=True)

    def forget(self) -> None:
        """The search is at its end."""
        shutil.rmtree(self.folder, ignore_errors=True)


def _plain(value: Any) -> Any:
    """A set in order, else a text."""
    return sorted(map(repr, value)) if isinstance(value, frozenset) else repr(value)


def _write(path: Path, content: bytes) -> None:
    new = path.with_name(path.name + ".new")
    new.write_bytes(content)
    os.replace(new, path)


@cache
def _sources() -> list[str]:
    """What the bits of a fit depend on."""
    sources = hashlib.sha256()
    for package in DECIDES:
        spec = find_spec(package)
        if spec is not None and spec.origin is not None:
            for file in sorted(Path(spec.origin).parent.rglob("*.py")):
                sources.update(file.name.encode() + b"\0" + file.read_bytes())
    return [sources.hexdigest(), *(version(name) for name in LIBRARIES)]
