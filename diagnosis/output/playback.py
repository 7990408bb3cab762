"""A log as a part of a system: its outputs are the measured signals at each time; and the system file that uses it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from selflock.fmus import chain
from selflock.master.face import Part, Variable

from ..data.log import write_csv
from ..residuals import drive, phase
from ..residuals.compare import gear_inputs
from ..residuals.drive_experiment import DriveExperiment
from ..rules import RULES

VOLTAGES = ("voltage", "supply_voltage")
"""Columns of a played log that are held from row to row."""


class Playback(Part):
    """Signals from a table with a column "time"; between rows straight lines, or the row before with `held`."""

    can_roll_back = tells_ahead = True

    def __init__(self, name: str, log: str, folder: str = ".", held: Iterable[str] = ()):
        import pandas as pd  # a third of a second to load, for those who play a log

        table = pd.read_csv(Path(folder) / log)
        columns = {column: table[column].to_numpy(float) for column in table.columns if column != "time"}
        self._play(name, table["time"].to_numpy(float), columns, {}, held)

    def _play(
        self,
        name: str,
        time: np.ndarray,
        columns: dict[str, np.ndarray],
        types: dict[str, str],
        held: Iterable[str],
    ) -> None:
        """Become the part that plays these columns, of these types (Real where none is told)."""
        super().__init__(
            name,
            [
                Variable(c, start=x[0].item(), depends_on=(), causality="output", type=types.get(c, "Real"))
                for c, x in columns.items()
            ],
        )
        self._time, self._columns, self._held = time, columns, set(held)
        self._now = 0.0

    def get(self, name: str) -> float:
        return self._at(name, self._now)

    def set(self, name: str, value: Any) -> None:
        raise KeyError(name)

    def _at(self, name: str, time: float) -> float:
        return float(self._told_at(name, time))

    def _told_at(self, name: str, time: float | np.ndarray) -> np.ndarray:
        if name in self._held:
            rows = np.searchsorted(self._time, time + 1e-9, side="right") - 1
            return self._columns[name][np.maximum(rows, 0)]
        return np.interp(time, self._time, self._columns[name])

    def ahead(self, times: np.ndarray) -> np.ndarray:
        """What `at` would fill y with at each of these times, a row each."""
        return np.stack([self._told_at(name, times) for name in self.outputs], axis=1)

    def at(self, time: float) -> None:
        """Fill y for this time without a step."""
        for place, name in enumerate(self.outputs):
            self.y[place] = self._at(name, time)

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._now = start

    def read(self) -> None:
        self.at(self._now)

    def step(self, time: float, size: float) -> None:
        self._now = time + size

    def save(self) -> float:
        return self._now

    def restore(self, state: float) -> None:
        self._now = state

    def reset(self) -> None:
        self._now = 0.0


class PowerStage(Part):
    """A duty times the supply's voltage."""

    can_roll_back = True
    described = (
        Variable("duty", start=0.0, causality="input"),
        Variable("supply_voltage", start=0.0, causality="input"),
        Variable("voltage", start=0.0, depends_on=("duty", "supply_voltage"), causality="output"),
    )

    def __init__(self, name: str, folder: str = "."):
        super().__init__(name)

    def compute(self) -> None:
        self.values["voltage"] = self.values["duty"] * self.values["supply_voltage"]


def _chained(part: str, name) -> list[str]:
    """The connections that the drive's chain gives to a part, but the command, which may come through a power stage."""
    sources = {target: source.split(".") for target, source in chain.inputs(part).items() if target != "voltage"}
    return [f'"{name(part)}.{target}" = "{name(owner)}.{output}"' for target, (owner, output) in sources.items()]


def _command(name, ch, components: list[str], play, values: dict) -> list[str]:
    """The connection from the controller to the motor: a voltage, or a duty of the measured supply."""
    if not ch.has("motor.duty", "motor.supply_voltage"):
        return [f'"{name("motor")}.voltage" = "{name("controller")}.voltage"']
    play("supply_voltage", ch.true("motor.supply_voltage", values), f"{name('stage')}.supply_voltage")
    return staged(name, components)


def staged(name, components: list[str]) -> list[str]:
    """The connections from a controller to its motor through a power stage, which joins the components; name: of each in its drive."""
    stage = name("stage")
    components.append(f'[components.{stage}]\npart = "selflock.diagnosis.output.playback:PowerStage"\n')
    return [
        f'"{stage}.duty" = {{ from = "{name("controller")}.voltage", convert = false }}',
        f'"{name("motor")}.voltage" = {{ from = "{stage}.voltage", convert = false }}',
    ]


def write_system(experiment: DriveExperiment, values: dict, fmus: dict[str, Path], out: Path) -> Path | None:
    """extended.toml and the log that drives it: the last run, each drive from its first measured input on.

    With set-points and a voltage the loop is closed over the load; with a voltage alone it is open; with a motion
    alone the motion is imposed on the reducer. Steady-state points are no motion: they get no system. What the rig says
    of that log alone is in it, and what belongs to that run; that a log's power is switched off is not.
    """
    if experiment.steady:
        return None
    i = len(experiment.runs) - 1
    run = experiment.runs[i]
    columns: dict[str, np.ndarray] = {"time": run.time - run.time[0]}
    components, connections, held = [], [], []
    for prefix in experiment.rig.drives:
        ch = experiment.channels[i, prefix]
        name = lambda part: prefix + part
        first, second = drive.both(values, ch)

        of_run = phase.own(values, run)

        def component(part: str, more: str = "") -> None:
            begin = name(part) + "."
            mine = [f"{key.removeprefix(begin)} = {value!r}" for key, value in of_run.items() if key.startswith(begin)]
            more = "\n".join(filter(None, [*mine, more]))
            components.append(
                f'[components.{name(part)}]\nfmu = "{fmus[name(part)].name}"\n'
                + (f"[components.{name(part)}.start]\n{more}\n" if more else "")
            )

        def play(column: str, x: np.ndarray, target: str) -> None:
            columns[prefix + column] = x
            if column in VOLTAGES:
                held.append(prefix + column)
            connections.append(f'"{target}" = {{ from = "log.{prefix}{column}", convert = false }}')

        whole = name("motor") in fmus and name("load") in fmus
        if not whole and name("reducer") in fmus:
            component("reducer")
            (angle, speed, output_angle, output_speed), _ = gear_inputs(values, ch)
            for column, x in (
                ("imposed_angle", angle),
                ("imposed_speed", speed),
                ("output_angle", output_angle),
                ("output_speed", output_speed),
            ):
                play(column, x, f"{name('reducer')}.{column}")
            continue
        if not whole:
            continue
        electric = drive.electric(ch)
        if name("controller") in fmus and ch.has("controller.angle_setpoint"):
            own = {
                key.rpartition(".")[2]: value
                for key, value in experiment.rig.of_log(run.log).items()
                if key.startswith(name("controller") + ".")
            }
            component("controller", "\n".join(f"{key} = {value!r}" for key, value in own.items()))
            wanted = ch.raw("controller.angle_setpoint")
            play("angle_setpoint", wanted, f"{name('controller')}.angle_setpoint")
            play("speed_setpoint", drive.speed_setpoint(wanted, {}, ch), f"{name('controller')}.speed_setpoint")
            connections += [*_chained("controller", name), *_command(name, ch, components, play, values)]
        elif electric:
            play("voltage", drive.voltage(electric, values, ch), f"{name('motor')}.voltage")
        component("motor")
        component("reducer", f"kinematic = false\ninitial_speed = {float(first.speed[0])!r}")
        component("load", f"start_angle = {float(second.angle[0])!r}\nstart_speed = {float(second.speed[0])!r}")
        connections += [line for part in ("motor", "reducer", "load") for line in _chained(part, name)]
    if not components:
        return None
    step = float(np.median(run.time[1:] - run.time[:-1]))
    step = min(step, RULES.pipeline.longest_step) if any("initial_speed" in c for c in components) else step
    return written(experiment.rig.name, out, columns, held, step, components, connections)


def written(
    name: str,
    out: Path,
    columns: dict[str, np.ndarray],
    held: list[str],
    step: float,
    components: list[str],
    connections: list[str],
    order: Iterable[str] = (),
) -> Path:
    """extended.toml of these components and connections, in steps of `step`, s; its inputs are `columns`, one of them "time"."""
    write_csv(columns, out / "inputs.csv")
    stop = np.floor(columns["time"][-1] / step) * step
    text = [
        "# The extended simulation on the last log: selflock run extended.toml -o result.csv",
        "",
        "[system]",
        f"name = {json.dumps(name + ', extended', ensure_ascii=False)}",
        "",
        "[run]",
        f"stop = {stop:.9g}",
        f"step = {step:.9g}",
        "open_inputs = true",
        *([f"order = {list(order)!r}"] if order else []),
        "",
        "[components.log]",
        'part = "selflock.diagnosis.output.playback:Playback"',
        "[components.log.options]",
        f"log = {str((out / 'inputs.csv').resolve())!r}",
        f"held = {held!r}",
        "",
        *components,
        "[connections]",
        *connections,
        "",
    ]
    path = out / "extended.toml"
    path.write_text("\n".join(text))
    return path
