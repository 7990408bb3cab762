"""The extended model: FMUs with the effects switched on, a parameter file, a system file; and the FMUs run again on the log.

The promise of a fit was made by compiled laws. Here the FMU files themselves take the laws' places, under FMPy, and
must give the same error.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from fmus.build import build

from .bench import Bench, Cut
from .gain import rms, samples
from .hypotheses import COMPONENTS, Hypothesis
from .laws import LAWS
from .playback import write_system
from .rig import split


def extend(bench: Bench, cut: Cut, before: dict, after: dict, blocks: np.ndarray, out: Path, causes: list[Hypothesis]) -> dict:
    """Write the extended FMUs, parameters.toml and extended.toml; run the FMUs on the held-out data."""
    values = {**bench.rig.parameters, **after}
    names = [prefix + part for prefix in bench.rig.drives for part in COMPONENTS]
    used = [name for name in names if name in bench.components]
    fmus = {}
    for name in used:
        prefix, part = split(name, bench.rig.drives)
        fmus[name] = build(part.capitalize(), out / f"{name}.fmu", **starts(part, name, values), **({"kinematic": True} if part == "reducer" else {}))
    for cause in causes:
        if cause.component == "sensor":
            start = len(f"sensor.{cause.channel}.")
            known = {key[start:]: value for key, value in after.items() if key.startswith(f"sensor.{cause.channel}.")}
            name = f"sensor_{cause.channel.replace('.', '_')}"
            fmus[name] = build("Sensor", out / f"{name}.fmu", **known)
    _parameters(bench, before, after, out / "parameters.toml")
    system = write_system(bench, values, fmus, out)
    promised = _error(bench, cut, after, blocks)
    with with_fmus(bench, fmus, cut) as theirs:
        found = _error(theirs, cut, after, blocks) if theirs.runs_fmus else promised
    return {
        "fmus": sorted(path.name for path in fmus.values()), "parameters": "parameters.toml", "system": system.name if system else None,
        "promised": promised, "fmu": found, "unit": cut.unit,
    }


def starts(part: str, name: str, values: dict[str, float]) -> dict:
    """Start values of a component's FMU."""
    fields = LAWS[part].Parameters._fields
    given = {key[len(name) + 1:]: value for key, value in values.items() if key.startswith(name + ".")}
    found = {key: float(value) for key, value in given.items() if key in fields}
    if "irreversible" in found:
        found["irreversible"] = bool(found["irreversible"])
    return found


def _error(bench: Bench, cut: Cut, values: dict, blocks: np.ndarray) -> float:
    errors, trusted = samples(bench, cut, values, blocks)
    return rms([e[t] for e, t in zip(errors, trusted)])


def _parameters(bench: Bench, before: dict, after: dict, path: Path) -> None:
    """What the fits changed, beside what it was."""
    lines = ["# Parameters of the extended simulation; what they were stands behind.", "", "[parameters]"]
    for name in sorted({**bench.rig.parameters, **after}):
        value = {**bench.rig.parameters, **after}[name]
        old = before.get(name, bench.rig.parameters.get(name))
        lines.append(f'"{name}" = {value!r}' + (f"  # was {old!r}" if old is not None and old != value else "  # new" if old is None else ""))
    path.write_text("\n".join(lines) + "\n")


class with_fmus:
    """A bench whose laws of one cut run as FMUs under FMPy."""

    def __init__(self, bench: Bench, fmus: dict[str, Path], cut: Cut):
        self.bench, self.cut, self.kind = bench, cut, cut.name[len(cut.prefix):]
        part = {"gear": "reducer", "twist": "", "load": ""}.get(self.kind, self.kind)
        self.path = fmus.get(cut.prefix + part) if part else None
        self.runs_fmus = self.path is not None

    def __enter__(self):
        if not self.runs_fmus:
            return self
        laws = vars(self.bench.kernels)
        mine = {"gear": lambda p, *a: _play(self.path, GEAR, a[:-2], a[-2], a[-1:]),
                "motor": lambda p, u, w, dt, *out: _shifted(self.path, u, w, dt, out),
                "controller": lambda p, *a: _play(self.path, CONTROL, a[:-2], a[-2], a[-1:])}
        self._own = self.bench.kernels
        self.bench.kernels = SimpleNamespace(**{**laws, self.kind: mine[self.kind]})
        self.bench.runs_fmus = True
        return self.bench

    def __exit__(self, *_):
        if self.runs_fmus:
            self.bench.kernels = self._own
            del self.bench.runs_fmus


GEAR = (("imposed_angle", "imposed_speed", "output_angle", "output_speed"), ("input_torque",))
MOTOR = (("voltage", "speed"), ("current", "torque"))
CONTROL = (("angle_setpoint", "speed_setpoint", "angle", "speed", "motor_speed", "output_torque"), ("voltage",))


def _shifted(path: Path, voltage, speed, dt, out) -> None:
    """The motor's step ends at the sample: voltage of the sample before, mean of both speeds."""
    results = tuple(np.empty(len(dt) - 1) for _ in out)
    _play(path, MOTOR, (voltage[:-1], 0.5 * (speed[1:] + speed[:-1])), dt[1:], results)
    for target, values in zip(out, results):
        target[1:], target[0] = values, values[0]


def _play(path: Path, names, inputs, dt: np.ndarray, out) -> None:
    """Run an FMU under FMPy: inputs[i] over a step of dt[i], outputs at its end."""
    import shutil

    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    description = read_model_description(path)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    given, wanted = [reference[n] for n in names[0]], [reference[n] for n in names[1]]
    folder = extract(str(path))
    fmu = FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier, instanceName="replay")
    try:
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.setReal(given, [float(x[0]) for x in inputs])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        rows = np.stack(inputs, axis=1).tolist()
        time = 0.0
        for i, (row, step) in enumerate(zip(rows, dt.tolist())):
            fmu.setReal(given, row)
            fmu.doStep(time, step)
            time += step
            for target, value in zip(out, fmu.getReal(wanted)):
                target[i] = value
        fmu.terminate()
        fmu.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
