"""Schemas for editors: every example is right by them, and a misspelt key is not; the readers say the same."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from selflock.schemas import ROOMS, schema, text

ROOT = Path(__file__).parents[2]
FILES = {
    "system": ["examples/bench.toml", "study/robot.toml", "study/four_drives.toml", "tests/peers/servo.toml"],
    "sweep": ["examples/friction_chart.toml", "examples/motor_choice.toml"],
    "rig": sorted(str(path.relative_to(ROOT)) for path in (ROOT / "examples" / "rigs").glob("*.toml")),
}


def checks(of):
    found = schema(of)
    jsonschema.Draft7Validator.check_schema(found)
    return jsonschema.Draft7Validator(found)


def data(path):
    return tomllib.loads((ROOT / path).read_text(encoding="utf-8"))


@pytest.mark.parametrize("of, path", [(of, path) for of, paths in FILES.items() for path in paths])
def test_every_example_is_right(of, path):
    wrong = [error.message for error in checks(of).iter_errors(data(path))]
    assert not wrong


SLIPS = [
    ("system", "examples/bench.toml", lambda d: d.update(componets={})),
    ("system", "examples/bench.toml", lambda d: d["run"].update(algoritm="jacobi")),
    ("system", "examples/bench.toml", lambda d: d["run"].update(algorithm="jacoby")),
    ("system", "examples/bench.toml", lambda d: d["run"].update(step="fast")),
    ("system", "examples/bench.toml", lambda d: d["components"]["motor"].update(strat={})),
    ("system", "examples/bench.toml", lambda d: d["components"]["motor"].update(part="a:B")),
    ("system", "examples/bench.toml", lambda d: d["connections"].update({"motor.speed": {"from": "a.b", "factr": 2.0}})),
    ("system", "examples/bench.toml", lambda d: d["connections"].update({"motor.speed": {"from": "a.b", "factor": "2"}})),
    ("system", "study/robot.toml", lambda d: d["values"].update({"my ratio": 2.0})),
    ("system", "study/robot.toml", lambda d: d["values"].update({"ratio": "fifty"})),
    ("system", "examples/bench.toml", lambda d: d["faults"][0].update(kind="broken")),
    ("system", "examples/bench.toml", lambda d: d["faults"][0].pop("start")),
    ("sweep", "examples/friction_chart.toml", lambda d: d.update(systm="x")),
    ("sweep", "examples/friction_chart.toml", lambda d: d["vary"]["ratio"].update(value=[1])),
    ("sweep", "examples/friction_chart.toml", lambda d: d["record"]["peak_torque"].update(maxx="1")),
    ("rig", "examples/rigs/worm_drive.toml", lambda d: d["rig"].update(kinds="steady")),
    ("rig", "examples/rigs/worm_drive.toml", lambda d: d["rig"].update(kind="stedy")),
    ("rig", "examples/rigs/worm_drive.toml", lambda d: d["parameters"].update({"reducer.gear_ration": 60.0})),
    ("rig", "examples/rigs/worm_drive.toml", lambda d: d["columns"].update({"motor.torque": {"colum": "m"}})),
    ("rig", "examples/rigs/worm_drive.toml", lambda d: d["uncertain"].update({"reducer.friction_kinetic": [0.1]})),
    ("rig", "examples/rigs/worm_drive.toml", lambda d: d.update(paramters={})),
]


@pytest.mark.alike
@pytest.mark.parametrize("of, path, slip", SLIPS, ids=range(len(SLIPS)))
def test_a_slip_is_refused(of, path, slip):
    given = data(path)
    slip(given)
    assert not checks(of).is_valid(given)


def test_names_of_others_pass_in_a_rig_of_a_system():
    rig = {
        "rig": {"system": "x.fmu"},
        "columns": {"x.y": "y"},
        "parameters": {"x.anything": 1.0},
        "calibrate": {"x.k": [0.0, 1.0]},
    }
    assert checks("rig").is_valid(rig)


@pytest.mark.parametrize("of", ROOMS)
def test_the_command_writes_it(of, tmp_path):
    from typer.testing import CliRunner

    from selflock.cli import app

    assert CliRunner().invoke(app, ["schema", of, "-o", str(tmp_path / "s.json")]).exit_code == 0
    assert json.loads((tmp_path / "s.json").read_text()) == schema(of) == json.loads(text(of))
