"""From measured data to the named cause, the extended model and its measured gain.

from selflock import diagnosis
result = diagnosis.diagnose("rig.toml", ["train.csv"], test=["test.csv"], out="out")
print(result.summary())
"""

from .errors import DataError
from .replay import Comparison, Replay, replay
from .result import Cause, Diagnosis
from .run import diagnose

__all__ = ["Cause", "Comparison", "DataError", "Diagnosis", "Replay", "diagnose", "replay"]
