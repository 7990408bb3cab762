import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun


@pytest.fixture
def moving():
    """A run whose set-point is sin 2t: speeds up to 2, accelerations up to 4."""
    time = np.arange(0.0, 10.0, 0.01)
    return MeasuredRun("log.csv", "", np.arange(len(time)), time, {"controller.angle_setpoint": np.sin(2.0 * time)})
