"""The extended model: FMUs with the effects on, a parameter file, a system file; and the FMUs run again on the log.

The promise of a fit was made by compiled laws. Here the FMU files themselves take the laws' places, under FMPy, and
must give the same error.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from glob import escape
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from selflock.fmus import chain, temporary
from selflock.fmus.build import build
from selflock.fmus.errors import SelflockError
from selflock.master.archive import unpack

from ..data.rig import split
from ..errors import DataError
from ..residuals import phase
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.laws import COMPONENTS, as_fmu, law
from ..residuals.mending import Mending
from ..residuals.residual import RUNS, Residual
from ..residuals.whole import WHOLE
from ..rules import RULES
from ..search.hypotheses import Hypothesis
from .loop import in_the_loop, run_again, sensor_name, write_loop
from .playback import write_system


def extend(mending: Mending[DriveExperiment], out: Path, causes: list[Hypothesis]) -> dict:
    """Write the extended FMUs, parameters.toml and extended.toml; run the FMUs on held-out data."""
    experiment, residual, after, blocks = mending.experiment, mending.residual, mending.after, mending.blocks
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
    together = experiment.rig.simulate == WHOLE
    read = [cause.channel for cause in causes if cause.component == "sensor"]
    for channel in dict.fromkeys([*read, *(in_the_loop(experiment, after) if together else ())]):
        start = len(f"sensor.{channel}.")
        known = {key[start:]: value for key, value in after.items() if key.startswith(f"sensor.{channel}.")}
        name = sensor_name(channel)
        fmus[name] = build("Sensor", out / f"{name}.fmu", **known)
    _parameters(experiment, mending.before, after, out / "parameters.toml")
    system = write_loop(experiment, values, fmus, out) if together else write_system(experiment, values, fmus, out)
    enough = experiment.head(experiment.enough(blocks, _played(experiment, blocks)))
    promised = Mending(enough, residual, after, after, blocks)
    theirs = with_fmus(enough, fmus, residual, after)  # None where this comparison is not one of an FMU
    found = None if theirs is None else Mending(theirs, residual, after, after, blocks)
    told = {
        "fmus": sorted(path.name for path in fmus.values()),
        "parameters": "parameters.toml",
        "system": system.name if system else None,
        "promised": promised.size(promised.old),
        "fmu": None if found is None else found.size(found.old),
        "unit": residual.unit,
    }
    if not (together and system):
        return told
    try:
        return told | run_again(experiment, values, system, residual)
    except SelflockError as error:  # as of an FMU that cannot go on
        return told | {"not_run": str(error)}


def _played(experiment: DriveExperiment, blocks: np.ndarray) -> int:
    """How many samples of these blocks there are in as many rows, of the runs that have any, as FMUs are run again on."""
    runs = [blocks[experiment.layout.block(i)] for i in range(len(experiment.runs))]
    return int(RULES.residuals.played * np.mean(np.concatenate([one for one in runs if one.any()] or [np.ones(1)])))


def starts(part: str, name: str, values: dict[str, float]) -> dict:
    """Start values of a component's FMU."""
    fields = law(part).Parameters._fields
    given = {key[len(name) + 1 :]: value for key, value in values.items() if key.startswith(name + ".")}
    return {key: as_fmu(part, key, value) for key, value in given.items() if key in fields}


def _parameters(experiment: DriveExperiment, before: dict, after: dict, path: Path) -> None:
    """What the fits changed, beside what it was."""
    lines = ["# Parameters of the extended simulation; what they were stands behind.", "", "[parameters]"]
    of_runs = {name for name in after if name.startswith(phase.RUN)}
    for name in sorted({**experiment.rig.parameters, **after}.keys() - of_runs):
        value = {**experiment.rig.parameters, **after}[name]
        old = before.get(name, experiment.rig.parameters.get(name))
        lines.append(
            f'"{name}" = {value!r}'
            + (f"  # was {old!r}" if old is not None and old != value else "  # new" if old is None else "")
        )
    path.write_text("\n".join(lines + _of_runs(experiment, after)) + "\n")


def _of_runs(experiment: DriveExperiment, after: dict) -> list[str]:
    """What belongs to a run alone: of a log with one run as a rig has it; of one among several no rig can say it."""
    logs, lines = [run.log for run in experiment.runs], []
    for run in experiment.runs:
        own = [f'"{name}" = {value!r}' for name, value in sorted(phase.own(after, run).items())]
        if own and logs.count(run.log) == 1:
            lines += ["", f"[logs.{json.dumps(escape(run.log), ensure_ascii=False)}]", *own]
        elif own:
            lines += ["", f"# run {json.dumps(run.name, ensure_ascii=False)} of {json.dumps(run.log, ensure_ascii=False)}"]
            lines += [f"# {line}" for line in own]
    return lines


def with_fmus(
    experiment: DriveExperiment, fmus: dict[str, Path], residual: Residual, values: Iterable[str] = ()
) -> DriveExperiment | None:
    """The experiment with FMUs under FMPy in place of the laws of one residual; None where the residual has none of these.

    values: names of those that it will be asked with; FMUs are told what belongs to a run.
    """
    kind, prefix = residual.kind, residual.prefix
    part = RUNS.get(kind, "")
    path = fmus.get(prefix + part)
    if not part or path is None:
        return None
    theirs = {name for own in experiment.rig.logs.values() for name in own}  # FMUs have the rig's own values
    theirs |= {phase.parameter(name) for name in values if name.startswith(phase.RUN)}
    of_log = {c: [n.rpartition(".")[2] for n in theirs if n.rpartition(".")[0] == prefix + c] for c in COMPONENTS}
    own = lambda p: _starts_of_log(part, p, of_log[part])
    loop = {
        "gear": lambda p, *a: _play(path, own(p), GEAR, a[:-2], a[-2], a[-1:]),
        "motor": lambda p, u, w, dt, *out: _shifted(path, own(p), u, w, dt, out),
        "controller": lambda p, *a: _play(path, own(p), CONTROL, a[:-2], _from_start(a[-2]), a[-1:]),
        "drive": lambda *a: _chain({c: fmus.get(prefix + c) for c in COMPONENTS}, of_log, *a),
    }[kind]
    known = {**vars(experiment.setting.kernels), "motor_further": None}  # an FMU is run from a log's start to its end
    kernels = SimpleNamespace(**{**known, "whole" if kind == "drive" else kind: loop})
    return experiment.but_with(replace(experiment.setting, kernels=kernels))


Names = tuple[tuple[str, ...], tuple[str, ...]]
"""Inputs and outputs of an FMU."""

GEAR = (("imposed_angle", "imposed_speed", "output_angle", "output_speed"), ("input_torque",))
MOTOR = (("voltage", "speed"), ("current", "torque"))
CONTROL = (("angle_setpoint", "speed_setpoint", "angle", "speed", "motor_speed", "output_torque"), ("voltage",))


def _starts_of_log(part: str, p, names: list[str]) -> dict:
    """Parameters of a single log, as its FMU takes them."""
    return {name: as_fmu(part, name, getattr(p, name)) for name in names}


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
        self.path, self.inputs = path, inputs
        description = read_model_description(path)
        reference = {v.name: v.valueReference for v in description.modelVariables}
        self.given, self.wanted = [reference[n] for n in inputs], [reference[n] for n in outputs]
        self.room = temporary.folder()
        self.folder = str(self.room / "fmu")
        unpack(path, Path(self.folder), "FMU")
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
        self.time, self.fine = 0.0, True
        try:
            self.slave.setReal(self.given, first)
            self.slave.enterInitializationMode()
            self.slave.exitInitializationMode()
        except FMICallException:
            raise self._refused(first) from None

    def _refused(self, row: list[float]) -> DataError:
        """What is said where it refuses what is asked of it under these inputs; it has ended then."""
        self.close()
        given = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.inputs, row))
        return DataError(
            f"{self.path.name} has no result at t = {self.time:.9g} s of the log for {given}: numbers beyond what a drive does. Leave such "
            "samples out, or look at the unit and the factor of their column."
        )

    def step(self, row: list[float], size: float) -> list[float]:
        try:
            self.slave.setReal(self.given, row)
            if size > 0.0:
                self.slave.doStep(self.time, size)
                self.time += size
            return self.slave.getReal(self.wanted)
        except FMICallException:
            raise self._refused(row) from None

    def close(self) -> None:
        if self.fine:
            self.fine = False
            with suppress(FMICallException):  # after an error nothing is terminated
                self.slave.terminate()
            self.slave.freeInstance()
            temporary.remove(self.room)


SETPOINTS = {"angle_setpoint": "log.angle_setpoint", "speed_setpoint": "log.speed_setpoint"}
GIVES = {
    "controller": ("voltage",),
    "motor": ("current", "torque"),
    "reducer": ("input_angle", "input_speed", "output_torque"),
    "load": ("angle", "speed"),
}
"""What a row of the whole drive has, of each component."""


def _chain(paths, of_log, pc, pm, pr, pl, closed, powered, supply, voltage, wanted, rate, dt, parts, start, out) -> None:
    """The whole drive made of FMUs, coupled as kernels.whole couples the laws; `of_log`: parameters of single logs."""
    own = {part: _starts_of_log(part, p, names) for p, (part, names) in zip((pc, pm, pr, pl), of_log.items())}
    now = {f"{part}.{name}": 0.0 for part, names in GIVES.items() for name in names}
    now |= dict(zip(("reducer.input_angle", "reducer.input_speed", "load.angle", "load.speed"), start.tolist()))
    own["reducer"] |= {
        "kinematic": False,
        "shaft_stiffness": pr.shaft_stiffness,
        "shaft_damping": pr.shaft_damping,
        "initial_speed": now["reducer.input_speed"],
    }
    own["load"] |= {"start_angle": now["load.angle"], "start_speed": now["load.speed"]}
    given = {part: chain.inputs(part) for part in chain.ORDER} | {"controller": SETPOINTS | chain.inputs("controller")}
    log = {"log.angle_setpoint": wanted, "log.speed_setpoint": rate}
    now |= {name: float(x[0]) for name, x in log.items()}
    fmus: dict[str, _Fmu] = {}

    def step(part: str, size: float) -> None:
        found = fmus[part].step([now[source] for source in given[part].values()], size)
        now.update(zip((f"{part}.{name}" for name in GIVES[part]), found))

    try:
        for part in chain.ORDER if closed else chain.ORDER[:-1]:
            first = [now[source] for source in given[part].values()]
            fmus[part] = _Fmu(paths[part], own[part], tuple(given[part]), GIVES[part], first)
        for i, size in enumerate(dt.tolist()):
            for _ in range(parts if i else 0):
                for part in chain.ORDER[:-1]:
                    step(part, size / parts)
            now["controller.voltage"] = float(voltage[i])
            if closed:
                now |= {name: float(x[i]) for name, x in log.items()}
                step("controller", size)
                now["controller.voltage"] *= supply[i] if supply[i] > 0.0 else 1.0
            if powered[i] == 0.0:
                now["controller.voltage"] = pm.voltage_constant * now["reducer.input_speed"]
            out[:, i] = [now[f"{part}.{name}"] for part, names in GIVES.items() for name in names]
    finally:
        for fmu in fmus.values():
            fmu.close()


def _play(
    path: Path, before: dict, names: Names, inputs: Sequence[np.ndarray], dt: np.ndarray, out: Sequence[np.ndarray]
) -> None:
    """Run an FMU under FMPy: inputs[i] over a step of dt[i], outputs at its end."""
    fmu = _Fmu(path, before, *names, [float(x[0]) for x in inputs])
    try:
        for i, (row, step) in enumerate(zip(np.stack(inputs, axis=1).tolist(), dt.tolist())):
            for target, value in zip(out, fmu.step(row, step)):
                target[i] = value
    finally:
        fmu.close()
