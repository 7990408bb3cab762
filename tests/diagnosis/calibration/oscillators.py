"""Systems with hidden numbers, and logs of them: the tests' own, written beside the FMUs that are calibrated."""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from selflock import master
from selflock.master.system import Component, Connection, Run, System

sys.path.append(str(Path(__file__).parents[2] / "native"))

STEP = 0.005
TRUTH = {"stiffness": 60.0, "damping": 1.5, "gain": 1.4}
RANGES = {"stiffness": [10.0, 1000.0], "damping": [-1.0, 20.0], "gain": [0.1, 5.0]}
SIGNALS = "selflock.diagnosis.systems.parts:Signals"


def pushes(rng, count):
    """A force in stairs of a quarter of a second."""
    return np.repeat(rng.uniform(-20.0, 20.0, count // 50 + 1), 50)[:count]


def log(path, fmu, rng, truth=None, noise=0.002, count=1200, force=None, columns=("position",)):
    """A log of the oscillator with these hidden numbers: time, u, and its outputs with noise."""
    time = STEP * np.arange(count)
    force = pushes(rng, count) if force is None else force
    options = {"time": time, "columns": {"u": force}, "types": {"u": "Real"}}
    system = System(
        folder=fmu.parent,
        components={"log": Component(part=SIGNALS, options=options), "o": Component(fmu=fmu.name, start=truth or TRUTH)},
        connections={"o.force": Connection("log.u", convert=False)},
        run=Run(stop=STEP * (count - 1), step=STEP, record=["o.*"]),
    )
    table = master.run(system).table
    told = {"time": time, "u": force}
    told |= {name: table[f"o.{name}"] + noise * rng.standard_normal(count) for name in columns}
    pd.DataFrame(told).to_csv(path, index=False)
    return path


def rig(path, system, wanted=None, parameters=None, columns=None, more=""):
    """A rig of an oscillator called as its model."""
    columns = {"oscillator.force": "u", "oscillator.position": "position"} if columns is None else columns
    wanted = {f"oscillator.{name}": ends for name, ends in RANGES.items()} if wanted is None else wanted
    entry = lambda value: (
        "{ " + ", ".join(f"{key} = {json.dumps(one)}" for key, one in value.items()) + " }"
        if isinstance(value, dict)
        else json.dumps(value)
    )
    tables = {"columns": columns, "parameters": parameters or {}, "calibrate": wanted}
    lines = ["[rig]", f"system = {json.dumps(str(system))}", more]
    for table, entries in tables.items():
        lines += [f"[{table}]", *(f"{json.dumps(name)} = {entry(value)}" for name, value in entries.items())]
    path.write_text("\n".join(lines))
    return path
