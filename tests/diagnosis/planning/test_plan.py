"""What a plan asks for, and what it refuses in a sentence."""

import json

import pytest

from selflock.diagnosis import DataError, plan
from selflock.diagnosis.planning.run import _diagnosis, _limits

MODEL = {"label": "reducer wear", "values": {"reducer.wear_rate": 0.1}, "free": {"reducer.wear_rate": [0.0, 1.0]}}


def written(folder, **told):
    found = {
        "verdict": "ambiguous",
        "models": [MODEL, MODEL | {"label": "reducer warm_up"}],
        "sources": {"rig": "rig.toml", "logs": []},
    }
    (folder / "diagnosis.json").write_text(json.dumps(found | told))
    return folder


@pytest.mark.parametrize(
    "told, words",
    [
        (dict(verdict="none"), "nothing is missing"),
        (dict(verdict="explained", models=[MODEL]), "stands alone"),
        (dict(verdict="explained", models=[]), "stands alone"),
        (dict(verdict="perhaps"), "'perhaps' is none that is known"),
        (dict(models=[MODEL, {"label": "x"}]), "an older selflock wrote it"),
        (dict(sources={}), "an older selflock wrote it"),
        (dict(), "is not there any more"),
    ],
    ids=str,
)
def test_what_leaves_nothing_to_plan_is_a_sentence(told, words, tmp_path):
    with pytest.raises(DataError, match=words):
        plan(written(tmp_path, **told))


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"verdict": []}'])
def test_what_is_no_diagnosis_is_a_sentence(text, tmp_path):
    (tmp_path / "diagnosis.json").write_text(text)
    with pytest.raises(DataError, match="Run selflock diagnose again"):
        _diagnosis(tmp_path)


def test_a_folder_without_a_diagnosis(tmp_path):
    with pytest.raises(DataError, match="holds no diagnosis.json"):
        plan(tmp_path)
    (tmp_path / "naming.json").write_text("{}")
    with pytest.raises(DataError, match="Run selflock name again"):
        plan(tmp_path)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"speeed": 2}, "Did you mean 'speed'"),
        ({"speed": "fast"}, "is not a number"),
        ({"speed": -1}, "above 0"),
        ({"angle": "1"}, "lowest and the highest"),
        ({"angle": "2:1"}, "lowest and the highest"),
        ({"angle": "a:b"}, "is not a number"),
        ({"duration": "inf"}, "above 0"),
    ],
    ids=str,
)
def test_a_limit_that_is_none_is_a_sentence(given, words, moving):
    with pytest.raises(DataError, match=words):
        _limits(given, [moving])


def test_limits_are_as_far_as_the_logs_went(moving):
    limits = _limits({}, [moving])
    assert (limits.low, limits.high) == (pytest.approx(-1.0, abs=1e-3), pytest.approx(1.0, abs=1e-3))
    assert limits.speed == pytest.approx(2.0, rel=1e-2) and limits.acceleration == pytest.approx(4.0, rel=2e-2)
    assert _limits({"angle": "-0.5:0.25", "voltage": 12}, [moving]).low == -0.5


def test_a_set_point_that_rests_tells_no_limits(moving):
    moving.signals["controller.angle_setpoint"][:] = 0.2
    with pytest.raises(DataError, match="do not move"):
        _limits({}, [moving])
