"""The first thing that a newcomer tries: a log that our own simulation wrote of a sound drive."""

import json
import shutil
from pathlib import Path

import pytest

import selflock
from selflock import diagnosis

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.mark.slow
def test_an_arm_that_is_sound_is_answered_so(tmp_path):
    """Its controller's sensors are at the motor, it lets go at rest, and its names begin with the drive's."""
    for name in ("arm.toml", "arm.csv", "rigs/arm_rig.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    selflock.run(tmp_path / "arm.toml", stop=7.0).table.to_csv(tmp_path / "sound.csv", index=False)
    diagnosis.diagnose(tmp_path / "arm_rig.toml", [tmp_path / "sound.csv"], out=tmp_path / "out")
    answer = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert answer["verdict"] == "none" and not answer["causes"]
    assert answer["recorder"]["mode"] == "whole"
    assert any("over reducer.input_angle" in line for line in answer["recorder"]["assumed"]), answer["recorder"]["assumed"]
