"""Parameters that were found, held to those that were hidden, where a parameter means the same in plant and product.

Three here, each in one drive. All of them, over more seeds: python -m benchmarks.parameters
"""

import numpy as np
import pytest

from diagnosis import diagnose

from .plant import bench, score

NAMES = ("motor.brush_drop", "controller.dead_zone", "controller.delay", "controller.sampling", "reducer.backlash",
         "reducer.compliance", "reducer.preload", "sensor.bias", "sensor.scale", "sensor.lag", "parameter")


def found(name, seed, folder):
    """What was named and the amounts, hidden and found."""
    case = bench.hide([name], seed=seed, target=6.0)
    rig, train, test = case.write(folder)
    result = score.plain(diagnose(rig, [train], test=[test], out=None, seed=seed))
    return score.right_first(result, case), score.amounts(result, case)


@pytest.mark.parametrize("name", ["motor.brush_drop", "reducer.compliance", "sensor.scale"])
def test_what_was_hidden_is_found_in_size_too(name, tmp_path):
    named, amounts = found(name, 1, tmp_path)
    assert named and amounts and all(amount.near for amount in amounts), [*map(str, amounts)]


def test_amounts_are_counted_from_where_an_effect_is_off():
    case = bench.hide(["sensor.scale"], seed=1, target=3.0)
    (value,) = case.parameters.values()
    channel = score.signal(case.causes[0].what)
    said = {"causes": [{"parameters": {f"sensor.{channel}.scale_factor": {"value": 1.0 + 1.05 * value, "low": 0.9, "high": 0.9}}}]}
    (amount,) = score.amounts(said, case)
    assert np.isclose(amount.hidden, value) and np.isclose(amount.found, 1.05 * value) and amount.near
    said["causes"][0]["parameters"][f"sensor.{channel}.scale_factor"]["value"] = 1.0 + 1.2 * value
    assert not score.amounts(said, case)[0].near
