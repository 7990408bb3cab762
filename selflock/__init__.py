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

from typing import TYPE_CHECKING, Any

from .rooms import offered

if TYPE_CHECKING:
    from . import diagnosis, errors, examples, fmus, master, vehicle  # noqa: F401
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

_offered, __dir__ = offered(__name__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("selflock")
    return _offered(name)
