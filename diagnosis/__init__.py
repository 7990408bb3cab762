"""From measured data to the named cause, the extended model and its measured gain.

    from selflock import diagnosis
    result = diagnosis.diagnose("rig.toml", ["train.csv"], test=["test.csv"], out="out")
    print(result.summary())

Rooms, each standing on those before it: rules, data, residuals, search, judge, output, pipeline, systems, planning, calibration, naming, begin, tracking; asked, answered and calls join them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from selflock.rooms import offered

if TYPE_CHECKING:
    from .begin.init import Begun, rig_init
    from .calibration.result import Calibration
    from .calls import calibrate, diagnose, name, plan, replay, track
    from .errors import DataError
    from .fleet import Fleet, diagnose_fleet
    from .judge.cause import Cause
    from .judge.result import Diagnosis
    from .naming.outcome import Naming
    from .pipeline.replay import Comparison, Replay
    from .tracking.track import Track

__all__ = [
    "Begun",
    "Calibration",
    "Cause",
    "Comparison",
    "DataError",
    "Diagnosis",
    "Fleet",
    "Naming",
    "Replay",
    "Track",
    "calibrate",
    "diagnose",
    "diagnose_fleet",
    "name",
    "plan",
    "replay",
    "rig_init",
    "track",
]

__getattr__, __dir__ = offered(__name__)  # a replay needs no search, a track no log
