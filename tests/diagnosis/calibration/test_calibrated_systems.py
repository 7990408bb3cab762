"""Calibration of systems of several FMUs, native and in Python, from system files and SSPs; and on processes."""

import subprocess
import sys

import numpy as np
import oscillators
import pandas as pd
import pytest

from selflock import master
from selflock.diagnosis import calibrate
from selflock.diagnosis.calibration.run import here
from selflock.master import ssp
from selflock.master.system import Component, Connection, Run, System

RATES = {"first": 2.5, "second": 0.4}
TANK = '''
from math import sqrt

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Tank(Fmi2Slave):
    """A tank with a hole: a full one ends the run."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.hole, self.full, self.flow, self.level = 1.0, 1.0, 3.0, 0.0, 1.0
        for name in ("gain", "hole", "full"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("flow", causality=Fmi2Causality.input))
        self.register_variable(Real("level", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        for _ in range(5):
            self.level += h / 5 * (self.gain * self.flow - self.hole * sqrt(max(self.level, 0.0)))
        return self.level < self.full
'''


def chain(folder, native, rates, starts=None):
    """Two relaxations, one after the other, the second seen in other units."""
    (folder / "relaxation.fmu").write_bytes(native("relaxation").read_bytes())
    start = lambda name: {"rate": rates[name]} | (starts or {}).get(name, {})
    return System(
        "chain",
        folder=folder,
        components={name: Component(fmu="relaxation.fmu", start=start(name)) for name in rates},
        connections={"second.u": Connection("first.x", 2.0, -1.0)},
        run=Run(stop=8.0, step=0.01, open_inputs=True),
    )


def recorded(folder, native, rng):
    """The log of a chain with hidden rates: the input, and what comes out."""
    hidden = chain(folder, native, RATES, {"first": {"x": 0.3}})
    time = np.arange(0.0, 8.001, 0.01)
    wanted = np.sin(1.3 * time) + np.floor(time / 2.0) % 2
    options = {"time": time, "columns": {"u": wanted}, "types": {"u": "Real"}}
    hidden.components["log"] = Component(part=oscillators.SIGNALS, options=options)
    hidden.connections["first.u"] = Connection("log.u", convert=False)
    table = master.run(hidden).table
    noise = lambda: 0.005 * rng.standard_normal(len(table))
    told = {
        "time": time,
        "wanted": wanted,
        "first.x": table["first.x"] + noise(),
        "second.x [mK]": 1e3 * (table["second.x"] + noise()),
    }
    pd.DataFrame(told).to_csv(folder / "log.csv", index=False)
    return folder / "log.csv"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["toml", "ssp"])
def test_a_chain_from_a_file_of_either_kind(tmp_path, native, rng, kind):
    from selflock.master.dump import save

    log = recorded(tmp_path, native, rng)
    system = chain(tmp_path, native, {"first": 1.0, "second": 1.0})
    path = tmp_path / f"chain.{kind}"
    save(system, path) if kind == "toml" else ssp.export(system, path)
    wanted = {"first.rate": [0.1, 20.0], "second.rate": {"start": 2.0, "low": 0.1, "high": 5.0}, "first.x": [-2.0, 2.0]}
    columns = {"first.u": {"column": "wanted", "unit": "K"}}
    rig = oscillators.rig(tmp_path / "rig.toml", path.name, wanted, columns=columns, more="named = true")
    result = calibrate(rig, [log], out=tmp_path / "out", starts=1)
    for name, hidden in {"first.rate": 2.5, "second.rate": 0.4, "first.x": 0.3}.items():
        number = next(n for n in result.numbers if n.name == name)
        assert abs(hidden - number.value) <= 1.25 * (number.high - number.low) and number.high - number.low < 0.03 * hidden
    assert [error.after for error in result.errors] == pytest.approx([0.005, 0.005], rel=0.15)
    calibrated = master.load(tmp_path / f"out/calibrated.{kind}")
    assert calibrated.components["second"].start["rate"] == pytest.approx(result.values["second.rate"], rel=1e-12)
    assert master.run(calibrated, stop=1.0).steps == 100


@pytest.mark.slow
def test_what_is_uncertain_is_fitted_too(tmp_path, native, rng):
    from selflock.master.dump import save

    log = recorded(tmp_path, native, rng)
    save(chain(tmp_path, native, {"first": 1.0, "second": 1.0}, {"first": {"x": 0.3}}), tmp_path / "chain.toml")
    columns = {"first.u": {"column": "wanted", "unit": "K"}}
    rig = oscillators.rig(tmp_path / "rig.toml", "chain.toml", {"first.rate": [0.1, 20.0]}, columns=columns, more="named = true")
    rig.write_text(rig.read_text() + '\n[uncertain]\n"second.rate" = [0.1, 5.0]\n')
    assert calibrate(rig, [log], out=None, starts=1).values == pytest.approx({"second.rate": 0.4, "first.rate": 2.5}, rel=0.01)


@pytest.mark.slow
def test_an_fmu_in_python_that_ends_some_runs_itself(tmp_path, rng):
    (tmp_path / "tank.py").write_text(TANK)
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", "tank.py", "-d", "."]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    time = np.arange(0.0, 20.01, 0.1)
    flow = np.repeat(rng.uniform(0.2, 1.4, len(time) // 20 + 1), 20)[: len(time)]
    level, seen = 1.0, []
    for given in flow:  # the hidden one: Heun's steps
        seen.append(level)
        slope = lambda x, given=given: 1.3 * given - 0.9 * np.sqrt(max(x, 0.0))
        for _ in range(10):
            level += 0.005 * (slope(level) + slope(level + 0.01 * slope(level)))
    log = pd.DataFrame({"time": time, "flow": flow, "level": np.array(seen) + 0.005 * rng.standard_normal(len(time))})
    log.to_csv(tmp_path / "log.csv", index=False)
    full = 1.2 * max(seen)
    wanted = {"Tank.gain": [0.2, 5.0], "Tank.hole": {"start": 2.0, "low": 0.2, "high": 5.0}}
    columns = {"Tank.flow": "flow", "Tank.level": "level"}
    rig = oscillators.rig(tmp_path / "rig.toml", "Tank.fmu", wanted, {"Tank.full": full}, columns, "step = 0.1")
    result = calibrate(rig, [tmp_path / "log.csv"], out=None, starts=2)
    assert result.values == pytest.approx({"Tank.gain": 1.3, "Tank.hole": 0.9}, rel=0.03)  # Euler's fifths leave a percent
    assert result.effort["failed"] > 0 and list(result.effort["reasons"]) == ["Tank ended the run itself"]


@pytest.mark.slow
def test_fits_may_be_made_elsewhere(tmp_path, oscillator, rng):
    """What is sent to other processes is the problem as plain data, and the answer comes back alike."""
    import pickle

    def elsewhere(function, items, context):
        there = pickle.loads(pickle.dumps(context))
        try:
            return [function(there, item) for item in items]
        finally:
            there.close()

    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=600)
    parameters = {"oscillator.damping": 1.5, "oscillator.stiffness": 60.0}
    wanted, more = {"oscillator.gain": [0.1, 5.0]}, f"step = {oscillators.STEP}"
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, parameters, more=more)
    answers = [calibrate(rig, [log], out=None, starts=2, spread=spread) for spread in (here, elsewhere)]
    assert answers[0].values == answers[1].values
    assert answers[0].effort["simulations"] == pytest.approx(answers[1].effort["simulations"], abs=10)
