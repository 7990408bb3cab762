"""The study's manoeuvre with one drive of the robot misbehaving: down to the drive, the component and the cause.

The robot is the system of study/ on belts or segmented tracks. The misbehaving component is a part of misbehaving.py beside this
in the FMU's place; a sensor's error is put on its column. The recorder adds noise and rounds. The rig knows robot.toml.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from selflock import master, study
from selflock.diagnosis import diagnose
from selflock.master.system import Component
from selflock.master.values import resolved

ROBOT = Path(study.__file__).parent / "robot.toml"
RECORDER = {  # column: noise, step of rounding
    "controller.voltage": (0.015, 0.01),
    "motor.current": (0.15, 0.01),
    "reducer.input_angle": (1e-4, 1e-4),
    "reducer.input_speed": (0.05, 0.0),
    "reducer.output_torque": (0.02, 0.005),
}


def record(folder, seed, parts=None, sensors=None, track="belt"):
    """The log of one manoeuvre at 1 kHz. parts: {component: (class, sheet)}; sensors: {column: (bias, factor)}; track: segmented or belt."""
    system = master.load(ROBOT)
    system.run.step = 2.5e-4
    for name, (kind, sheet) in (parts or {}).items():
        system.components[name] = Component(part=f"misbehaving:{kind}", options=sheet)
    table = master.run(system, settings={"robot.track": track}, allow_code=True).table
    for drive in ("front", "rear"):  # beside what it was computed from
        table[f"{drive}_controller.voltage"] = table[f"{drive}_controller.voltage"].shift(-1)
    table = table[::4][:-1]
    rng = np.random.default_rng(seed)
    log = {"time": table["time"]}
    for drive in ("front", "rear"):
        for channel in ("angle", "speed"):
            log[f"{drive}_controller.{channel}_setpoint"] = table[f"setpoints.{drive}_{channel}"]
        for channel, (noise, step) in RECORDER.items():
            name = f"{drive}_{channel}"
            bias, factor = (sensors or {}).get(name, (0.0, 1.0))
            values = bias + factor * table[name].to_numpy() + noise * rng.standard_normal(len(table))
            log[name] = step * np.round(values / step) if step else values
    path = folder / f"log_{seed}.csv"
    pd.DataFrame(log).to_csv(path, index=False, float_format="%.8g")
    return path


def rig(folder):
    """The columns, and what robot.toml says of controllers, motors and gears."""
    sheet = resolved(master.load(ROBOT)).components
    channels = ("controller.angle_setpoint", "controller.speed_setpoint", *RECORDER)
    columns = [f"{drive}_{channel}" for drive in ("front", "rear") for channel in channels]
    lines = ["[rig]", 'name = "robot"', 'kind = "forward"', 'drives = ["front_", "rear_"]', "[columns]"]
    lines += [f'"{column}" = "{column}"' for column in columns] + ["[parameters]"]
    for drive in ("front", "rear"):
        for part in ("controller", "motor", "reducer"):
            lines += [f'"{drive}_{part}.{name}" = {float(value)!r}' for name, value in sheet[f"{drive}_{part}"].start.items()]
    path = folder / "rig.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


HIDDEN = {  # cause: (seed, who is to blame, parts, sensors, track)
    "rear_reducer viscous": (11, "rear_reducer", {"rear_reducer": ("Gear", {"viscous": 5e-4})}, {}, "segmented"),
    "front_motor brush_drop": (21, "front_motor", {"front_motor": ("Motor", {"brush_drop": 1.0})}, {}, "belt"),
    "rear_controller dead_zone": (32, "rear_controller", {"rear_controller": ("Controller", {"dead_zone": 1.0})}, {}, "belt"),
    "sensor scale (front_motor.current)": (13, "sensor front_motor.current", {}, {"front_motor.current": (0.0, 1.1)}, "belt"),
}


@pytest.fixture(autouse=True)
def here(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent))


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("cause", HIDDEN)
def test_the_drive_the_component_and_the_cause_are_named(tmp_path, cause):
    seed, blamed, parts, sensors, track = HIDDEN[cause]
    result = diagnose(rig(tmp_path), [record(tmp_path, seed, parts, sensors, track)], out=None, seed=1)
    assert result.causes and result.causes[0].label == cause, result.summary()  # others may follow: nature's formula is not ours
    assert result.gain.after < 0.5 * result.gain.before
    assert result.blame[0]["component"] == blamed


@pytest.mark.slow
def test_nothing_is_missing_in_a_sound_robot(tmp_path):
    """The controller of another make and the same formulas is sound, too."""
    result = diagnose(rig(tmp_path), [record(tmp_path, 10, {"front_controller": ("Controller", {})})], out=None, seed=1)
    assert result.verdict == "none", result.summary()


def test_in_a_table_of_a_run_the_command_stands_beside_what_it_was_computed_from(tmp_path):
    from selflock.diagnosis.data.log import read
    from selflock.diagnosis.data.rig import load

    time = np.arange(100) * 0.001
    command = np.concatenate([[0.0], np.cos(time[:-1])])  # of the row before
    table = pd.DataFrame({"time": time, "rear_controller.voltage": command, "rear_motor.current": time})
    table.to_csv(tmp_path / "run.csv", index=False)
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "forward"\nnamed = true\ndrives = ["rear_"]\n')
    (run,) = read(tmp_path / "run.csv", load(tmp_path / "rig.toml"))
    assert np.allclose(run.signals["controller.voltage"][:-1], np.cos(time[:-1]))
    assert np.allclose(run.signals["motor.current"], time)
