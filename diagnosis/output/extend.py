"""The extended model: FMUs with the effects on, a parameter file, a system file; and the FMUs run again on the log.

The promise of a fit was made by compiled laws. Here the FMU files themselves take the laws' places, under FMPy, and
must give the same error.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from selflock.fmus.build import build

from ..data.rig import split
from ..residuals.experiment import Experiment
from ..residuals.laws import LAWS
from ..residuals.residual import Residual
from ..residuals.sizes import rms, samples
from ..search.hypotheses import COMPONENTS, Hypothesis
from .playback import write_system


def extend(
    experiment: Experiment, residual: Residual, before: dict, after: dict, blocks: np.ndarray, out: Path, causes: list[Hypothesis]
) -> dict:
    """Write the extended FMUs, parameters.toml and extended.toml; run the FMUs on held-out data."""
    values = {**experiment.rig.parameters, **after}
    names = [prefix + part for prefix in experiment.rig.drives for part in COMPONENTS]
    used = [name for name in names if name in experiment.components]
    fmus = {}
    for name in used:
        prefix, part = split(name, experiment.rig.drives)
        fmus[name] = build(
            part.capitalize(),
            out / f"{name}.fmu",
            **starts(part, name, values),
            **({"kinematic": True} if part == "reducer" else {}),
        )
    for cause in causes:
        if cause.component == "sensor":
            start = len(f"sensor.{cause.channel}.")
            known = {key[start:]: value for key, value in after.items() if key.startswith(f"sensor.{cause.channel}.")}
            name = f"sensor_{cause.channel.replace('.', '_')}"
            fmus[name] = build("Sensor", out / f"{name}.fmu", **known)
    _parameters(experiment, before, after, out / "parameters.toml")
    system = write_system(experiment, values, fmus, out)
    enough = experiment.head(experiment.enough(blocks))
    promised = _error(enough, residual, after, blocks)
    with with_fmus(enough, fmus, residual) as theirs:
        found = _error(theirs, residual, after, blocks) if theirs.runs_fmus else None  # this comparison is not one of an FMU
    return {
        "fmus": sorted(path.name for path in fmus.values()),
        "parameters": "parameters.toml",
        "system": system.name if system else None,
        "promised": promised,
        "fmu": found,
        "unit": residual.unit,
    }


def starts(part: str, name: str, values: dict[str, float]) -> dict:
    """Start values of a component's FMU."""
    fields = LAWS[part].Parameters._fields
    given = {key[len(name) + 1 :]: value for key, value in values.items() if key.startswith(name + ".")}
    found = {key: float(value) for key, value in given.items() if key in fields}
    if "irreversible" in found:
        found["irreversible"] = bool(found["irreversible"])
    return found


def _error(experiment: Experiment, residual: Residual, values: dict, blocks: np.ndarray) -> float:
    errors, trusted = samples(experiment, residual, values, blocks)
    return rms([e[t] for e, t in zip(errors, trusted)])


def _parameters(experiment: Experiment, before: dict, after: dict, path: Path) -> None:
    """What the fits changed, beside what it was."""
    lines = ["# Parameters of the extended simulation; what they were stands behind.", "", "[parameters]"]
    for name in sorted({**experiment.rig.parameters, **after}):
        value = {**experiment.rig.parameters, **after}[name]
        old = before.get(name, experiment.rig.parameters.get(name))
        lines.append(
            f'"{name}" = {value!r}'
            + (f"  # was {old!r}" if old is not None and old != value else "  # new" if old is None else "")
        )
    path.write_text("\n".join(lines) + "\n")


class with_fmus:
    """A experiment whose laws of one residual run as FMUs under FMPy."""

    def __init__(self, experiment: Experiment, fmus: dict[str, Path], residual: Residual):
        self.experiment, self.residual, self.kind = experiment, residual, residual.name[len(residual.prefix) :]
        part = {"gear": "reducer", "drive": "reducer"}.get(self.kind, self.kind)
        self.path = fmus.get(residual.prefix + part) if self.kind in ("gear", "motor", "controller", "drive") else None
        self.runs_fmus = self.path is not None
        theirs = {name for values in experiment.rig.logs.values() for name in values}  # FMUs have the rig's own values
        self.of_log = {
            c: [n.rpartition(".")[2] for n in theirs if n.rpartition(".")[0] == residual.prefix + c] for c in COMPONENTS
        }
        self.part = part
        if self.kind == "drive":
            self.kind, self.chain = "whole", [fmus.get(residual.prefix + c) for c in COMPONENTS]

    def __enter__(self):
        if not self.runs_fmus:
            return self
        laws, of_log = vars(self.experiment.kernels), lambda p: _starts_of_log(p, self.of_log[self.part])
        mine = {
            "gear": lambda p, *a: _play(self.path, of_log(p), GEAR, a[:-2], a[-2], a[-1:]),
            "motor": lambda p, u, w, dt, *out: _shifted(self.path, of_log(p), u, w, dt, out),
            "controller": lambda p, *a: _play(self.path, of_log(p), CONTROL, a[:-2], _from_start(a[-2]), a[-1:]),
            "whole": lambda *a: _chain(self.chain, list(self.of_log.values()), *a),
        }
        self._own = self.experiment.kernels
        self.experiment.kernels = SimpleNamespace(**{**laws, self.kind: mine[self.kind]})
        self.experiment.runs_fmus = True
        return self.experiment

    def __exit__(self, *_):
        if self.runs_fmus:
            self.experiment.kernels = self._own
            del self.experiment.runs_fmus


GEAR = (("imposed_angle", "imposed_speed", "output_angle", "output_speed"), ("input_torque",))
MOTOR = (("voltage", "speed"), ("current", "torque"))
CONTROL = (("angle_setpoint", "speed_setpoint", "angle", "speed", "motor_speed", "output_torque"), ("voltage",))


def _starts_of_log(p, names: list[str]) -> dict:
    """Parameters of a single log, as its FMU takes them."""
    return {n: bool(getattr(p, n)) if n == "irreversible" else float(getattr(p, n)) for n in names}


def _from_start(dt: np.ndarray) -> np.ndarray:
    """The first sample is at the start, as the compiled controller has it."""
    return np.concatenate([[0.0], dt[1:]])


def _shifted(path: Path, before: dict, voltage, speed, dt, out) -> None:
    """The motor's step ends at the sample: voltage of the sample before, mean of both speeds."""
    results = tuple(np.empty(len(dt) - 1) for _ in out)
    _play(path, before, MOTOR, (voltage[:-1], 0.5 * (speed[1:] + speed[:-1])), dt[1:], results)
    for target, values in zip(out, results):
        target[1:], target[0] = values, values[0]


class _Fmu:
    """One FMU under FMPy, between its initialization and its end."""

    def __init__(self, path: Path, before: dict, inputs: tuple[str, ...], outputs: tuple[str, ...], first: list[float]):
        description = read_model_description(path)
        reference = {v.name: v.valueReference for v in description.modelVariables}
        self.given, self.wanted = [reference[n] for n in inputs], [reference[n] for n in outputs]
        self.folder = extract(str(path))
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            instanceName="replay",
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        for name, value in before.items():
            (self.slave.setBoolean if isinstance(value, bool) else self.slave.setReal)([reference[name]], [value])
        self.slave.setReal(self.given, first)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = 0.0

    def step(self, row: list[float], size: float) -> list[float]:
        self.slave.setReal(self.given, row)
        if size > 0.0:
            self.slave.doStep(self.time, size)
            self.time += size
        return self.slave.getReal(self.wanted)

    def close(self) -> None:
        self.slave.terminate()
        self.slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def _chain(paths, of_log, pc, pm, pr, pl, closed, powered, supply, voltage, wanted, rate, dt, parts, start, out) -> None:
    """The whole drive made of FMUs, coupled as kernels.whole couples the laws; `of_log`: parameters of single logs."""
    own = [_starts_of_log(p, names) for p, names in zip((pc, pm, pr, pl), of_log)]
    angle, speed = float(start[2]), float(start[3])
    fmus = []
    if closed:
        fmus.append(_Fmu(paths[0], own[0], *CONTROL, [wanted[0], rate[0], angle, speed, start[1], 0.0]))
    motor = _Fmu(paths[1], own[1], *MOTOR, [0.0, float(start[1])])
    softer = {
        **own[2],
        "kinematic": False,
        "shaft_stiffness": pr.shaft_stiffness,
        "shaft_damping": pr.shaft_damping,
        "initial_speed": float(start[1]),
    }
    gear = _Fmu(
        paths[2],
        softer,
        ("motor_torque", "output_angle", "output_speed"),
        ("input_angle", "input_speed", "output_torque"),
        [0.0, angle, speed],
    )
    load = _Fmu(paths[3], {**own[3], "start_angle": angle, "start_speed": speed}, ("torque",), ("angle", "speed"), [0.0])
    fmus += [motor, gear, load]
    input_angle, input_speed, delivered, u, current, torque = float(start[0]), float(start[1]), 0.0, 0.0, 0.0, 0.0
    try:
        for i, step in enumerate(dt.tolist()):
            for _ in range(parts if i else 0):
                current, torque = motor.step([u, input_speed], step / parts)
                input_angle, input_speed, delivered = gear.step([torque, angle, speed], step / parts)
                angle, speed = load.step([delivered], step / parts)
            u = float(voltage[i])
            if closed:
                (u,) = fmus[0].step([wanted[i], rate[i], angle, speed, input_speed, delivered], step)
                u *= supply[i] if supply[i] > 0.0 else 1.0
            if powered[i] == 0.0:
                u = pm.voltage_constant * input_speed
            out[:, i] = (u, current, torque, input_angle, input_speed, delivered, angle, speed)
    finally:
        for fmu in fmus:
            fmu.close()


def _play(path: Path, before: dict, names, inputs, dt: np.ndarray, out) -> None:
    """MeasuredRun an FMU under FMPy: inputs[i] over a step of dt[i], outputs at its end."""
    fmu = _Fmu(path, before, *names, [float(x[0]) for x in inputs])
    try:
        for i, (row, step) in enumerate(zip(np.stack(inputs, axis=1).tolist(), dt.tolist())):
            for target, value in zip(out, fmu.step(row, step)):
                target[i] = value
    finally:
        fmu.close()
