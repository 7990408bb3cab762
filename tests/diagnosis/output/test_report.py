"""What a report says in words."""

import numpy as np
import pytest

from selflock.diagnosis.judge.cause import Cause
from selflock.diagnosis.output.report import convention


@pytest.mark.parametrize(
    "value, unit, said",
    [(-1.5 * np.pi, "rad", "-270°"), (np.pi / 2 + 0.01, "rad", "90°"), (0.01, "rad", ""), (np.pi, "A", ""), (1.0, "rad", "")],
)
def test_a_bias_of_quarters_of_a_turn_is_another_zero(value, unit, said):
    number = {"value": value, "low": value - 0.001, "high": value + 0.001, "unit": unit, "determined": True, "doubt": ""}
    told = convention(Cause("sensor", "bias", {"sensor.load.angle.bias": number}, 1.0, channel="load.angle"))
    assert (f" is {said}: no fault of a sensor" in told) if said else told == ""
