"""Robot drives with self-locking gears: FMUs, a master that couples them, a published study, and the diagnosis of measured drives.

    >>> import selflock
    >>> from selflock import examples
    >>> _ = examples.copy("bench")
    >>> result = selflock.run("bench.toml", {"gear.friction_kinetic": 0.005}, stop=0.01)
    >>> result.table.shape[0]  # a pandas table, one row each millisecond, one column each component.variable
    11

and from a measurement to its cause, `found = selflock.diagnose("rig.toml", ["log.csv"], out="out/diagnosis")`.

Rooms: `selflock.fmus` (laws and FMUs), `selflock.master` (systems), `selflock.vehicle`, `selflock.view`, `selflock.study`, `selflock.diagnosis`,
`selflock.sweep`. The last word of a room's own is called as the room itself: `selflock.study("out")`, `selflock.sweep("chart.toml", "out")`.
What is offered here is loaded when it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import errors
    from .diagnosis import calibrate, diagnose, name, replay
    from .master import load, part, run, session
    from .packing import build
    from .study import study
    from .sweep import sweep
    from .view import view

    __version__: str

__all__ = [
    "__version__",
    "build",
    "calibrate",
    "diagnose",
    "errors",
    "load",
    "name",
    "part",
    "replay",
    "run",
    "session",
    "study",
    "sweep",
    "view",
]

_FROM = {
    "build": ("selflock.packing", "build"),
    "calibrate": ("selflock.diagnosis", "calibrate"),
    "diagnose": ("selflock.diagnosis", "diagnose"),
    "load": ("selflock.master", "load"),
    "name": ("selflock.diagnosis", "name"),
    "part": ("selflock.master", "part"),
    "replay": ("selflock.diagnosis", "replay"),
    "run": ("selflock.master", "run"),
    "session": ("selflock.master", "session"),
}
_ROOMS = ("diagnosis", "errors", "examples", "fmus", "master", "study", "sweep", "vehicle", "view")


def __getattr__(name: str) -> Any:
    if name in _FROM:
        module, attribute = _FROM[name]
        return getattr(import_module(module), attribute)
    if name in _ROOMS:
        return import_module(f"{__name__}.{name}")
    if name == "__version__":
        from importlib.metadata import version

        return version("selflock")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_ROOMS})
