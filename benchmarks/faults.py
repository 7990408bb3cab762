"""Commands killed at random instants: what was finished is there, whole and once; what goes on equals what was not killed.

    python -m benchmarks.faults --kills 200 [--areas run sweep] [--seed 1]

Each area's command is run once to its end. Then it is begun, killed at a random instant of its time by SIGINT, SIGTERM or
SIGKILL, looked at, and given again, perhaps killed again, until it ends: then every byte, or every number, must be that of the
run that nobody killed. Nothing may be left in the temporary folder, or, after SIGKILL, after the next command.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from selflock.master import ResultError, read

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
AGAIN = 0.4  # share of what goes on that is killed again
PATIENCE = 600.0  # s that a command may take on a busy machine

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
OFTEN = "from selflock.master import state; state.EVERY = 0.2; "
SHORT = "from selflock.study import runs; every = runs.cases; runs.cases = lambda: [c for c in every() if c.group in ('kinematic', 'standstill')]; "


class Area:
    """What is killed. `python`: the command, with the folder of the results as its last argument."""

    name, python = "", ""

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
    name = "run"
    ending = "csv"

    @property
    def python(self) -> str:  # type: ignore[override]
        return (
            OFTEN
            + f"sys.argv[1:] = ['run', r'{self.room}/system.toml', '--resume', '-o', sys.argv[1] + '/x.{self.ending}']; cli.main()"
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
        assert found.equals(read(reference / f"x.{self.ending}")[0].iloc[: len(found)]), "other numbers"
        return len(found)


class RunParquet(Run):
    name, ending = "run, Parquet", "parquet"


class Sweep(Area):
    name = "sweep"

    @property
    def python(self) -> str:  # type: ignore[override]
        return f"sys.argv[1:] = ['sweep', r'{self.room}/study.toml', '-o', sys.argv[1], '--workers', '1']; cli.main()"

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


class Diagnose(Area):
    name = "diagnose"

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

    def look(self, out, reference):
        return len(list((out / "kept").glob("*.npz"))) if out.exists() else 0


AREAS = {area.name: area for area in (Run, RunParquet, Sweep, Study, Diagnose)}


def begin(area: Area, out: Path, scratch: Path) -> subprocess.Popen:
    lines = area.python.replace("; ", "\n").splitlines()
    code = "import sys\nfrom selflock import cli\nfrom selflock.ending import Watched\n"
    if "cli.main" in area.python:
        code += "\n".join(lines)
    else:
        body = "\n".join(f"        {line}" for line in lines)
        code += f"with Watched(cli.errors) as ending:\n    try:\n{body}\n    except KeyboardInterrupt as error:\n        sys.exit(str(error))\n"
    environment = {**os.environ, "TMPDIR": str(scratch), "COLUMNS": "200"}
    return subprocess.Popen(
        [sys.executable, "-c", code, str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=environment,
        start_new_session=True,
    )


def killed(area: Area, out: Path, scratch: Path, after: float, number: signal.Signals) -> tuple[bool, str]:
    """The command, sent a signal after so many seconds: whether it was still at work, and what it said."""
    process = begin(area, out, scratch)
    try:
        said, _ = process.communicate(timeout=after)
        return False, said.decode()
    except subprocess.TimeoutExpired:
        if number == signal.SIGINT:
            os.killpg(process.pid, number)  # as a terminal does
        else:
            process.send_signal(number)
        said, _ = process.communicate(timeout=PATIENCE)
        return True, said.decode()


def campaign(area: Area, kills: int, rng: random.Random, told: Counter, failures: list[str]) -> None:
    scratch, reference = area.room / "tmp", area.room / "reference"
    scratch.mkdir()
    reference.mkdir()
    began = time.monotonic()
    process = begin(area, reference, scratch)
    said, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, said.decode()
    length = time.monotonic() - began
    case = 0
    while told["kills"] < kills:
        case += 1
        out = area.room / f"case_{case}"
        if area.name.startswith("run"):
            out.mkdir()
        had = times = 0
        while True:
            last = told["kills"] >= kills or (times > 0 and rng.random() > AGAIN)
            number = rng.choice(SIGNALS)
            hit, said = killed(area, out, scratch, PATIENCE if last else rng.uniform(0.0, 1.1 * length), number)
            try:
                if not hit:
                    area.compare(out, reference)
                    told["ended"] += 1
                    break
                told["kills"] += 1
                told[number.name] += 1
                assert "Traceback" not in said, said[-1500:]
                there = area.look(out, reference)
                assert there >= had or area.name.startswith("run"), f"{had} were there, now {there}"
                told["with something kept"] += there > 0
                had, times = there, times + 1
                assert number == signal.SIGKILL or not list(scratch.iterdir()), f"left: {list(scratch.iterdir())}"
            except AssertionError as error:
                told["failed"] += 1
                failures.append(f"{area.name}, {number.name}: {error}")
                break
    left = [path.name for path in scratch.iterdir()]
    if left:
        time.sleep(1.5)  # what was made in this very second is not swept up
        killed(area, area.room / "sweeps_up", scratch, PATIENCE, signal.SIGTERM)
        if left := [path.name for path in scratch.iterdir() if not path.name.startswith("dask")]:
            failures.append(f"{area.name}: left in the temporary folder: {left}")
            told["failed"] += 1


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kills", type=int, default=50)
    options.add_argument("--areas", nargs="*", default=list(AREAS))
    options.add_argument("--seed", type=int)
    chosen = options.parse_args()
    seed = secrets.randbits(31) if chosen.seed is None else chosen.seed
    columns = ("kills", *(number.name for number in SIGNALS), "with something kept", "ended", "failed")
    table = Table("area", *columns, title=f"seed {seed}")
    failures: list[str] = []
    for name in chosen.areas:
        told: Counter = Counter()
        with tempfile.TemporaryDirectory() as room:
            campaign(
                AREAS[name](Path(room)), -(-chosen.kills // len(chosen.areas)), random.Random(f"{seed} {name}"), told, failures
            )
        table.add_row(name, *(str(told[column]) for column in columns))
        print(f"{name}: {dict(told)}", flush=True)
    for failure in failures:
        print(failure)
    Console().print(table)
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
