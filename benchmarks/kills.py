"""What benchmarks.faults kills: commands, what is there of one that was killed, and what must be there at its end."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from selflock.fmus.build import build_all
from selflock.master import ResultError, read

FULL, WORKER = "disk full", "a worker killed"
ALL = 10**9  # more than any count of fits
ENDS = ("SIGINT", "SIGTERM", "SIGKILL", FULL)

SYSTEM = """
[run]
stop = {stop}
step = 0.001
[components.motor]
fmu = "selflock:Motor"
[components.motor.start]
voltage = 12.0
[components.gear]
fmu = "selflock:Reducer"
step = 0.0005
[components.gear.start]
imposed_angle = 0.0
imposed_speed = 0.0
[components.weight]
fmu = "selflock:Load"
[components.weight.start]
mass = 1.0
arm = 0.3
[connections]
"motor.speed" = "gear.input_speed"
"gear.motor_torque" = "motor.torque"
"weight.torque" = "gear.output_torque"
"gear.output_angle" = "weight.angle"
"gear.output_speed" = "weight.speed"
"""
STUDY = """
system = "system.toml"
stop = 0.4
[vary.mu]
set = ["gear.friction_kinetic", "gear.friction_static"]
grid = { from = 0.0, to = 0.03, count = 40 }
[record]
last = { final = "weight.angle" }
most = { max = "abs(motor.current)" }
"""
RIG = """
[rig]
kind = "inverse"
[columns]
"reducer.input_speed" = "speed"
"motor.torque" = "torque"
[parameters]
"reducer.gear_ratio" = 50.0
"reducer.friction_kinetic" = 0.03
"reducer.shaft_inertia" = 1e-4
"load.inertia" = 0.05
"load.constant_torque" = 2.0
"""
MOTOR = """
[rig]
system = "Motor.fmu"
step = 0.001
[columns]
"Motor.voltage" = "u"
"Motor.speed" = "n"
"Motor.current" = "i"
[calibrate]
"""
OFTEN = "from selflock.master import state; state.EVERY = 0.2; "
SHORT = "from selflock.study import runs; every = runs.cases; runs.cases = lambda: [c for c in every() if c.group in ('kinematic', 'standstill')]; "


class Area:
    """What is killed. `python`: the command, with the folder of the results as its last argument."""

    name, python = "", ""
    ends: tuple[str, ...] = ENDS

    def __init__(self, room: Path):
        self.room = room
        (room / "system.toml").write_text(SYSTEM.format(stop=6.0))
        (room / "study.toml").write_text(STUDY)

    def compare(self, out: Path, reference: Path) -> None:
        """What is there of a command that ended equals what nobody killed. Raises AssertionError."""
        raise NotImplementedError

    def look(self, out: Path, reference: Path) -> int:
        """How much of a killed command is there; whatever is, is right. Raises AssertionError."""
        raise NotImplementedError


class Run(Area):
    name = "run --resume, CSV"
    ending = "csv"

    @property
    def python(self) -> str:  # type: ignore[override]
        return (
            OFTEN
            + f"sys.argv[1:] = ['run', r'{self.room}/system.toml', '--resume', '-o', sys.argv[1] + '/x.{self.ending}']; cli.app()"
        )

    def compare(self, out, reference):
        mine, theirs = (folder / f"x.{self.ending}" for folder in (out, reference))
        assert read(mine)[0].equals(read(theirs)[0]), "other numbers"
        assert self.ending == "parquet" or mine.read_bytes() == theirs.read_bytes(), "other bytes"
        assert [path.name for path in out.iterdir()] == [mine.name], f"left: {sorted(path.name for path in out.iterdir())}"

    def look(self, out, reference):
        try:
            found = read(out / f"x.{self.ending}")[0]
        except ResultError as error:
            begun = (out / f"x.{self.ending}").exists() or (out / f"x.{self.ending}.arrows").exists()
            assert not begun or "Empty" in str(error) or "no table" in str(error), error
            return 0
        whole = read(reference / f"x.{self.ending}")[0]
        assert list(found) == list(whole), "other columns"
        assert found.empty or found.equals(whole.iloc[: len(found)]), "other numbers"  # a CSV without rows has no types
        return len(found)


class RunParquet(Run):
    name, ending = "run --resume, Parquet", "parquet"


class Sweep(Area):
    name = "sweep"
    ends = (*ENDS, WORKER)

    @property
    def python(self) -> str:  # type: ignore[override]
        return f"sys.argv[1:] = ['sweep', r'{self.room}/study.toml', '-o', sys.argv[1], '--workers', '1']; cli.app()"

    def compare(self, out, reference):
        assert (out / "runs.parquet").read_bytes() == (reference / "runs.parquet").read_bytes(), "other bytes"
        assert not (out / "work").exists()

    def look(self, out, reference):
        from selflock.sweep.store import rows_in

        known = {row["key"]: row for row in pd.read_parquet(reference / "runs.parquet").to_dict("records")}
        found = rows_in(out) if out.exists() else {}
        for key, row in found.items():
            assert {k: v for k, v in known[key].items() if k != "run"} == row, f"another row of {key}"
        return len(found)


class Study(Area):
    name = "study"
    python = SHORT + "from pathlib import Path; runs.run_all(Path(sys.argv[1]))"

    def compare(self, out, reference):
        names = sorted(path.name for path in reference.glob("*.parquet"))
        assert names == sorted(path.name for path in out.glob("*.parquet")) and len(names) > 3
        self.look(out, reference)

    def look(self, out, reference):
        count = 0
        for path in out.glob("*.json") if out.exists() else ():
            told, known = (json.loads((folder / path.name).read_text()) for folder in (out, reference))
            assert told["energy"] == known["energy"] and told["postures"] == known["postures"], f"other numbers in {path.name}"
            table = path.with_suffix(".parquet").name
            assert (out / table).read_bytes() == (reference / table).read_bytes(), f"other bytes in {table}"
            count += 1
        return count


class Keeping(Area):
    """What keeps each fit until its answer is there whole."""

    answer = ""

    def look(self, out, reference):
        kept = out / "kept"
        if not kept.exists() and (out / self.answer).exists():  # ended as the process was about to
            self.compare(out, reference)
            return ALL
        return len(list(kept.glob("*.npz")))


class Diagnose(Keeping):
    name, answer = "diagnose", "diagnosis.json"

    def __init__(self, room):
        super().__init__(room)
        (room / "rig.toml").write_text(RIG)
        rng, time_ = np.random.default_rng(5), 1e-3 * np.arange(3000)
        speed, load = 60.0 * np.sin(1.3 * time_), 2.0 + 0.078 * np.cos(1.3 * time_)
        alpha, phi = np.arctan(1 / 50.0), np.arctan(0.04)
        torque = load * np.where(load * speed > 0.0, np.tan(alpha + phi), np.tan(alpha - phi)) + 7.8e-3 * np.cos(1.3 * time_)
        pd.DataFrame({"time": time_, "speed": speed, "torque": torque + 2e-3 * rng.standard_normal(3000)}).to_csv(
            room / "log.csv", index=False
        )

    @property
    def python(self) -> str:  # type: ignore[override]
        return (
            "from selflock.diagnosis import diagnose; "
            f"diagnose(r'{self.room}/rig.toml', [r'{self.room}/log.csv'], out=sys.argv[1], seed=3)"
        )

    def compare(self, out, reference):
        mine, theirs = ((folder / "diagnosis.json").read_text().replace(str(folder), "") for folder in (out, reference))
        assert json.loads(mine) == json.loads(theirs), "another answer"
        assert not (out / "kept").exists()


class Fitted(Keeping):
    """A motor on a bench whose resistance and constant are hidden; `command` keeps its fits."""

    command, options = "", ""

    def __init__(self, room):
        super().__init__(room)
        build_all(room, ["Motor"])
        (room / "rig.toml").write_text(MOTOR + self.options)
        rng, time_ = np.random.default_rng(4), 1e-3 * np.arange(400)
        voltage, speed = 12.0 * np.sign(np.sin(81.0 * time_ + 0.1)), 200.0 * np.sin(31.4 * time_)
        current, seen = 0.0, []
        for u, w in zip(voltage, speed):
            seen.append(current)
            for _ in range(100):
                current += 1e-5 * (u - 0.75 * current - 0.028 * w) / 0.9e-3
        measured = np.array(seen) + 0.05 * rng.standard_normal(len(time_))
        pd.DataFrame({"time": time_, "u": voltage, "n": speed, "i": measured}).to_csv(room / "log.csv", index=False)

    @property
    def python(self) -> str:  # type: ignore[override]
        given = f"r'{self.room}/rig.toml', [r'{self.room}/log.csv'], out=sys.argv[1], starts=3"
        return f"from selflock.diagnosis import {self.command}; {self.command}({given})"

    def compare(self, out, reference):
        mine, theirs = (json.loads((folder / self.answer).read_text().replace(str(folder), "")) for folder in (out, reference))
        for key in ("seconds", "steps_per_second", "elapsed"):
            mine["effort"].pop(key, None)
            theirs["effort"].pop(key, None)
        assert mine == theirs, "another answer"
        assert not (out / "kept").exists()


class Calibrate(Fitted):
    name = command = "calibrate"
    answer = "calibration.json"
    options = '"Motor.resistance" = [0.1, 5.0]\n"Motor.inductance" = [1e-5, 1e-2]\n"Motor.voltage_constant" = [0.001, 0.1]\n'


class Name(Fitted):
    name = command = "name"
    answer = "naming.json"
    options = '"Motor.resistance" = [0.1, 5.0]\n'

    @property
    def python(self) -> str:  # type: ignore[override]
        return super().python.replace("starts=3", "kinds=['parameter', 'path']")


class Fleet(Diagnose):
    """A diagnosis, without a search, for each of twelve logs on one worker."""

    name = "diagnose --fleet"
    ends = (*ENDS, WORKER)

    def __init__(self, room):
        super().__init__(room)
        with (room / "rig.toml").open("a") as rig:
            rig.write('[uncertain]\n"reducer.friction_kinetic" = [0.005, 0.1]\n')
        rows = (room / "log.csv").read_text().splitlines(keepends=True)
        for k in range(12):
            path = room / "logs" / "ab"[k % 2] / f"2026-{k + 1:02}-01.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("".join([rows[0], *rows[1 + 150 * k : 1001 + 150 * k]]))

    @property
    def python(self) -> str:  # type: ignore[override]
        options = f"'--fleet', r'{self.room}/logs', '-o', sys.argv[1], '--workers', '1', '--no-search'"
        return f"sys.argv[1:] = ['diagnose', r'{self.room}/rig.toml', {options}]; cli.app()"

    def _answers(self, folder):
        return {path.relative_to(folder): path.read_bytes() for path in folder.glob("logs/**/diagnosis.json")}

    def compare(self, out, reference):
        assert (out / "runs.parquet").read_bytes() == (reference / "runs.parquet").read_bytes(), "other bytes"
        assert self._answers(out) == self._answers(reference) and len(self._answers(out)) == 12, "other answers"

    def look(self, out, reference):
        known = self._answers(reference)
        for path, found in self._answers(out).items():
            assert known[path] == found, f"another answer in {path}"
        return len(self._answers(out))


class Track(Fleet):
    """The page of a fleet's diagnoses: there whole, or not at all."""

    name = "track"
    ends = ENDS

    def __init__(self, room):
        super().__init__(room)
        subprocess.run(
            [sys.executable, "-m", "selflock.cli", "diagnose", room / "rig.toml", "--fleet", room / "logs", "-o", room / "found"]
            + ["--workers", "1", "--no-search"],
            check=True,
            capture_output=True,
        )

    @property
    def python(self) -> str:  # type: ignore[override]
        return f"sys.argv[1:] = ['track', r'{self.room}/found', '-o', sys.argv[1] + '/x.html']; cli.app()"

    def compare(self, out, reference):
        names = sorted(path.name for path in reference.iterdir())
        assert names == sorted(path.name for path in out.iterdir())
        assert self.look(out, reference) == len(names)

    def look(self, out, reference):
        there = [path for path in out.iterdir() if path.suffix != ".new"]  # SIGKILL leaves such, until the next page
        for path in there:
            assert path.read_bytes() == (reference / path.name).read_bytes(), f"other bytes in {path.name}"
        return len(there)


AREAS = {area.name: area for area in (Run, RunParquet, Sweep, Study, Diagnose, Calibrate, Name, Fleet, Track)}
FILES = (Run, RunParquet, Track)  # these write files into a folder that is there
