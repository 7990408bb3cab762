"""JSON schemas of the files that people write, by name."""

from __future__ import annotations

import json
from importlib import import_module
from typing import Any

from selflock.fmus.errors import SelflockError

ROOMS = {"rig": "selflock.diagnosis.data.schema", "system": "selflock.master.schema", "sweep": "selflock.sweep.schema"}


def schema(of: str) -> dict[str, Any]:
    """The schema of a rig, a system or a sweep file."""
    if of not in ROOMS:
        raise SelflockError(f"There is no schema of {of!r}; there is: {', '.join(ROOMS)}.")
    return import_module(ROOMS[of]).schema()


def text(of: str) -> str:
    """The same as JSON."""
    return json.dumps(schema(of), indent=1)
