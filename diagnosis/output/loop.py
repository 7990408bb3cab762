"""A whole drive extended: its FMUs coupled from the set-points of a log, and run again by the master.

The promise of a fit was made by a compiled simulation of the closed loop. The system written here couples the FMU files as
that simulation couples the laws, but that it tells each its inputs as they are at the start or at the end of a step, and the
fit as they are in its middle. So both differ by what is of first order in the step, and running the system in half of it
tells how much that is.
"""

from __future__ import annotations

import json
from math import pi, remainder
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from selflock import master
from selflock.fmus import chain
from selflock.fmus.effect import ORDER, PHASE

from ..data.log import VALID
from ..data.signals import VOLTAGES
from ..residuals import drive, driven, whole
from ..residuals.channels import Channels
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.grid import grid
from ..residuals.laws import as_fmu, effects
from ..residuals.mending import rms
from ..residuals.phase import own
from ..residuals.residual import Residual
from ..residuals.set_points import upright
from ..rules import RULES
from .playback import staged, written

if TYPE_CHECKING:
    import pandas as pd


def _column(name: str, ch: Channels) -> str:
    """Where a run of the system has a channel: what the motor is given is its controller's, or in open loop the log's."""
    given = "controller.voltage" if whole.seen_by_controller(ch) else "log.voltage"
    return given if name in VOLTAGES else name


def write_loop(experiment: DriveExperiment, values: dict, fmus: dict[str, Path], out: Path) -> Path:
    """extended.toml and the set-points that drive it: the last run, simulated as the fit did, without anything of its recorder.

    What the rig says of that log alone is in it, and what belongs to that run; that a log's power is switched off is not.
    """
    run, ch = experiment.runs[-1], _last(experiment)
    begin, torque = whole.begin(values, ch)
    stiffness, damping, parts = whole.carried_in(values, ch)
    ratio = ch.setting.value("reducer.gear_ratio", values)
    law = drive.law("reducer", values, ch)
    more = own(values, run) | experiment.rig.of_log(run.log)
    starts: dict[str, dict] = {part: {} for part in chain.ORDER}
    for name, value in more.items():
        part, _, parameter = name.rpartition(".")
        if part in starts:
            starts[part][parameter] = as_fmu(part, parameter, value)
    starts["motor"] |= _phases(values, ch, float(begin[0]))
    starts["reducer"] |= {"kinematic": False, "initial_speed": float(begin[1]), "initial_torque": torque}
    if (stiffness, damping) != (law.shaft_stiffness, law.shaft_damping):  # as stiff as FMUs that take turns in this step carry
        starts["reducer"] |= {"shaft_stiffness": float(stiffness), "shaft_damping": float(damping)}
    starts["load"] |= {"start_angle": float(begin[2]), "start_speed": float(begin[3])}
    seen = whole.seen_by_controller(ch)
    if driven.of(ch) == driven.SPEED:
        starts["controller"]["angle_gain"] = 0.0
    if seen and driven.row_by_row(ch):
        starts["controller"]["sample_period"] = float(np.median(np.diff(run.time)))
    simulated = chain.ORDER if seen else chain.ORDER[:-1]
    components = [_component(part, fmus[part], starts[part]) for part in simulated]
    joined = {
        target: source for part in simulated for target, source in _joined(part).items() if seen or target != "motor.voltage"
    }
    connections = [f'"{target}" = "{source}"' for target, source in joined.items()]
    order = ["log"]
    for channel, target in zip(seen, ("angle", "speed")):
        factor = 1.0 / ratio if channel.startswith("reducer") else 1.0
        source = f'{{ from = "{channel}", factor = {factor!r} }}'
        if ch.sensor(channel, values) is not None:
            sensor = sensor_name(channel)
            components.append(_component(sensor, fmus[sensor], {}))
            connections.append(f'"{sensor}.value" = {source[:-2]}, convert = false }}')
            source = f'{{ from = "{sensor}.reading", convert = false }}'
            order.append(sensor)
        connections = [line for line in connections if not line.startswith(f'"controller.{target}" ')]
        connections.append(f'"controller.{target}" = {source}')
    time = run.time - run.time[0]
    volts = driven.asked(time, values, ch)
    names = ("controller.angle_setpoint", "controller.speed_setpoint") if seen else ("motor.voltage",)
    if seen and driven.inputs(ch):
        asked, names = volts, (*names, "stage.supply_voltage")
        volts = lambda when: np.vstack([asked(when), driven.supply(when, time, values, ch)])
        connections = [line for line in connections if not line.startswith('"motor.voltage" ')] + staged(str, components)
    new, given = upright(time, driven.instants(time, ch), volts)
    columns = {"time": new, **{name.rpartition(".")[2]: x for name, x in zip(names, given)}}
    connections += [f'"{name}" = {{ from = "log.{name.rpartition(".")[2]}", convert = false }}' for name in names]
    step = float(f"{grid(ch).dt[1:].max() / parts:.6g}")
    order += [
        part for part in simulated if part == "controller"
    ]  # what it makes of the start of a step holds over it, as in the fit
    order += ["stage"] if "stage.supply_voltage" in names else []
    order += chain.ORDER[:-1]
    return written(experiment.rig.name, out, columns, [], step, components, connections, order)


def _joined(part: str) -> dict[str, str]:
    """What the chain gives to a component."""
    return {f"{part}.{name}": source for name, source in chain.inputs(part).items()}


def sensor_name(channel: str) -> str:
    """What the FMU of a channel's sensor is called."""
    return f"sensor_{channel.replace('.', '_')}"


def in_the_loop(experiment: DriveExperiment, values: dict) -> list[str]:
    """Channels before the controller of which `values` say what their sensor does."""
    ch = _last(experiment)
    return [channel for channel in whole.seen_by_controller(ch) if ch.sensor(channel, values) is not None]


def _last(experiment: DriveExperiment) -> Channels:
    return experiment.channels[len(experiment.runs) - 1, ""]


def _component(name: str, path: Path, starts: dict) -> str:
    lines = [f"[components.{name}]", f"fmu = {json.dumps(path.name)}"]
    if starts:
        lines += [f"[components.{name}.start]", *(f"{key} = {json.dumps(value)}" for key, value in starts.items())]
    return "\n".join(lines) + "\n"


def _phases(values: dict, ch: Channels, angle: float) -> dict[str, float]:
    """Phases of the motor's waves: its FMU counts the rotor's angle from the start, the log from elsewhere."""
    found, law = {}, drive.law("motor", values, ch)
    for effect in effects("motor"):
        roles = {p.role: p.name for p in effect.parameters}
        if PHASE in roles and any(getattr(law, p.name) != p.off for p in effect.parameters):
            turned = getattr(law, roles[PHASE]) + getattr(law, roles[ORDER]) * angle
            found[roles[PHASE]] = remainder(turned, 2.0 * pi)
    return found


def run_again(experiment: DriveExperiment, values: dict, system: Path, told: Residual) -> dict:
    """The system run by the master, each channel beside the compiled simulation and the log; `told`: of what the gain is told.

    Errors are those of the drive's own signals, without what a recorder makes of them. Empty where the log has rows without
    power, which the system knows nothing of.
    """
    run, ch, rules = experiment.runs[-1], _last(experiment), RULES.pipeline
    if VALID in run.signals and not run.signals[VALID].all():
        return {}
    described = master.load(system)
    step = described.run.step
    stop = min(int(round(described.run.stop / step)), rules.coupled_steps) * step
    described.run.record = sorted({_column(one.output, ch) for one in experiment.residuals})
    table, half = (master.run(described, stop=stop, step=h).table for h in (step, step / 2))
    promised, here = whole.plain(values, ch), grid(ch).time
    channels = []
    for residual in experiment.residuals:
        name = residual.output
        when = here[here <= _told(table, _column(name, ch))[0][-1]]  # between its instants the compiled simulation says nothing
        fmu, finer = (np.interp(when, *_told(t, _column(name, ch))) for t in (table, half))
        compiled = promised[whole.SHOWN[name]][: len(when)]
        apart, by_step = rms([fmu - compiled]), 2.0 * rms([fmu - finer])  # of first order: half a step has half of the error
        allowed = rules.coupled_apart * by_step + rules.coupled_exact * rms([compiled])
        row = {"channel": name, "unit": residual.unit, "difference": apart, "of_step": by_step, "agrees": apart <= allowed}
        row |= {"promised": _off(name, when, compiled, ch), "fmu": _off(name, when, fmu, ch)}
        channels.append(row)
    mine = next(row for row in channels if row["channel"] == told.output)
    found = {key: mine[key] for key in ("promised", "fmu", "unit")}
    return found | {"step": step, "seconds": stop, "agrees": all(row["agrees"] for row in channels), "channels": channels}


def _told(table: pd.DataFrame, column: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a column; the command at the end of a step is what the controller gave at its start."""
    time, values = table["time"].to_numpy(), table[column].to_numpy()
    return (time[:-1], values[1:]) if column.startswith("controller.") else (time, values)


def _off(name: str, when: np.ndarray, simulated: np.ndarray, ch: Channels) -> float:
    """Error (root mean square) of a simulated channel at the rows of the log so far; an encoder's zero lies anywhere."""
    time = ch.run.time - ch.run.time[0]
    rows = (time <= when[-1]) & ch.good(name) & whole.settled(ch)
    error = ch.raw(name)[rows] - np.interp(time[rows], when, simulated)
    if driven.by_change(name, ch) and len(error) > (over := driven.rows_of_change(name, ch)):
        error = error[over:] - error[:-over]
    return rms([error - error.mean()]) if name == "reducer.input_angle" and rows.any() else rms([error])
