"""The effects of docs/extending.md, put into a copy of the project: each is one file and a test, and then it is everywhere."""

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import selflock

pytestmark = pytest.mark.slow  # the laws are compiled anew in the copy

ROOT = Path(__file__).parents[2]
ROOMS = ("fmus", "master", "vehicle", "view", "study", "diagnosis", "sweep")
EXAMPLES = dict(re.findall(r"```python\n# (\S+\.py)\n(.*?)```", (ROOT / "docs/extending.md").read_text(), re.S))
EFFECTS = [("motor", "windage"), ("sensor", "eccentricity")]

EVERYWHERE = """
import sys, zipfile
from types import SimpleNamespace

import numpy as np
from fmpy import read_model_description

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import Rig
from selflock.diagnosis.residuals import drive
from selflock.diagnosis.residuals.channels import Channels
from selflock.diagnosis.residuals.kernels import kernels
from selflock.diagnosis.residuals.setting import Setting
from selflock.diagnosis.search.hypotheses import vocabulary
from selflock.fmus.build import build

component, effect = sys.argv[1:]
path = build(component.capitalize(), "built")
(variable,) = [v for v in read_model_description(path).modelVariables if v.name == effect]
assert (variable.causality, float(variable.start), float(variable.min)) == ("parameter", 0.0, 0.0)
with zipfile.ZipFile(path) as archive:
    assert f">{effect}</td>" in archive.read("documentation/index.html").decode()

time = np.arange(500) * 1e-2
angle = 3.0 * np.sin(time)
run = MeasuredRun("log.csv", "", np.arange(500), time, {"load.angle": angle}, {"load.angle": np.ones(500, bool)})
rig = Rig(None, "one", "inverse", (), {})
some = SimpleNamespace(rig=rig, runs=[run], channels={}, components=set(), step=1e-2, by_channel=False)
labels = {h.label: h for h in vocabulary(rig, {"motor"}, {"load.angle"}, some)}
label = f"{component} {effect}" + (" (load.angle)" if component == "sensor" else "")
assert labels[label].free[0].name.endswith(f".{effect}") and labels[label].advice and labels[label].shown_over

if component == "sensor":  # the diagnosis undoes it, and reads as it does
    values = {f"sensor.load.angle.{effect}": 0.1}
    channels = Channels(run, "", Setting(rig, 500, kernels(), {"": 11}))
    true = channels.true("load.angle", values)
    assert 0.05 < abs(true - angle).max() < 0.11
    np.testing.assert_allclose(drive.read("load.angle", true, values, channels), angle, atol=1e-14)
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """run(*arguments): Python in a copy of the project that has the examples' files as well."""
    house = tmp_path_factory.mktemp("house")
    for name, room in {"": selflock, **{room: import_module(f"selflock.{room}") for room in ROOMS}}.items():
        source, target = Path(room.__file__).parent, house / "selflock" / name
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    shutil.copytree(ROOT / "tests" / "fmus", house / "tests" / "fmus", ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in EXAMPLES.items():
        target = house / ("selflock" if name.startswith("fmus/") else "") / name
        assert not target.exists()
        target.write_text(text)

    def run(*arguments):
        environment = {**os.environ, "PYTHONPATH": str(house), "SELFLOCK_CACHE": str(house / "cache")}
        done = subprocess.run([sys.executable, *arguments], cwd=house, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_the_page_shows_a_file_and_a_test_of_each():
    for component, effect in EFFECTS:
        assert f"fmus/{component}/effects/{effect}.py" in EXAMPLES and f"tests/fmus/{component}/test_{effect}.py" in EXAMPLES


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize(("component", "effect"), EFFECTS)
def test_one_file_and_it_is_a_parameter_a_hypothesis_and_a_row(copy, component, effect):
    copy("-c", EVERYWHERE, component, effect)


@pytest.mark.slow
def test_their_own_tests_and_the_rules_of_effects_hold(copy):
    names = " or ".join(effect for _, effect in EFFECTS)
    own = [name for name in EXAMPLES if name.startswith("tests/")]
    options = ("-q", "-p", "no:cacheprovider", "--import-mode=importlib", "-k", names)
    told = copy("-m", "pytest", *options, "tests/fmus/test_effect.py", *own)
    assert int(re.search(r"(\d+) passed", told)[1]) >= (1 + 5) * len(EFFECTS), told
