"""Which comparisons a log allows: residuals of the drive, so that each component runs on measured inputs.

A residual is a comparison of one measured channel with what some of the components compute from other measured channels:

    controller   set-points and measured angles     -> voltage
    motor        measured voltage and speed         -> current (or torque)
    supply       commanded voltage and the current    -> voltage of the supply
    gear         measured motion (and load)         -> torque at the motor's shaft, or the current that makes it
    load         measured motion of the load        -> output torque
    twist        measured angle of the input shaft  -> angle of the load
    shafts       measured motion of one shaft         -> speed of the other, where one is known by its speed alone
    input        measured angle of the input shaft  -> its speed: sensors alone
    output       measured angle of the load         -> its speed: sensors alone
    drive        set-points or voltage              -> motion: the whole at once, where the rig asks for it (simulate)
    whole        set-points, or in open loop a voltage -> one of all measured channels, behind its recorder

A residual whose misfit is noise proves its components; a residual that is off has the fault among its components.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..data.signals import MOVES, SPEED_OF, unit
from ..errors import DataError
from . import compare, drive, driven, forward, free_law, laws, phase, whole
from .channels import Channels
from .compare import Compared

RUNS = {"gear": "reducer", "motor": "motor", "controller": "controller", "drive": "reducer"}
"""The FMU that takes the law's place in a residual of this kind; in a whole drive those of all components do."""


@dataclass(frozen=True, eq=False)
class Residual:
    """One comparison: `compute(values, channels)` gives simulated, measured and trusted samples of one run."""

    kind: str  # controller | motor | supply | gear | load | twist | shafts | input | output | drive; whole; of a system of FMUs: signal
    name: str  # with the drive's prefix
    components: tuple[str, ...]
    reads: tuple[str, ...]
    output: str  # channel
    unit: str
    compute: Callable[[dict, Any], Compared]
    prefix: str = ""  # of the drive
    through: tuple[str, ...] = ()  # channels over which a simulated loop closes: their sensors matter, not what they say
    over: float = 0.0  # s over which the change of an angle is compared that no controller holds; 0: the angle itself is
    beside: tuple[str, ...] = ()  # channels read that must be sound, and whose sensors do not matter

    @property
    def reading(self) -> str:
        """What the compared channel reads: speed, current, torque ..."""
        return self.output.rpartition(".")[2]

    @property
    def winds(self) -> bool:
        """Whether what the gear winds up is compared: of a whole drive both of whose angles are measured, in place of the input's."""
        return self.kind == "whole" and self.reading == "input_angle" and f"{self.prefix}load.angle" in self.reads

    @property
    def told(self) -> str:
        """Its name where people read it. `name` is what results are known by, and says the channel alone."""
        return f"whole {self.prefix}reducer.windup" if self.winds else self.name

    @property
    def quantity(self) -> str:
        """What is compared: at the gear a torque, whatever channel it comes from, but of a current the current itself."""
        if self.winds:
            return f"wind-up, {self.output} / gear_ratio - {self.prefix}load.angle"
        if self.over:
            return f"change of {self.output} in {self.over:.3g} s"
        return "torque at the motor's shaft" if self.kind == "gear" and self.reading != "current" else self.output

    @property
    def smoothed(self) -> bool:
        """Whether what is compared is smoothed like the motion that it is computed from."""
        return self.kind in ("gear", "input", "output", "shafts")

    def uses(self, name: str) -> bool:
        """Whether a parameter's value matters to this residual: one of its components', or a sensor's of its channels."""
        name = phase.parameter(name)
        owner = name.rpartition(".")[0]
        what, _, channel = owner.partition(".")
        if name in whole.MOVING:
            return self.kind == "whole"
        if name.startswith(free_law.PREFIX):
            of = free_law.channel(name)
            return self.kind == "whole" and (not of or of in (self.output, *self.reads, *self.through))
        if what in ("sensor", "recorder"):
            if channel in self.beside:
                return False
            return channel in (*self.reads, self.output) or (what == "sensor" and channel in self.through)
        if self.kind in ("input", "output"):
            return False
        if owner == self.prefix + "reducer" and self.kind in ("twist", "shafts"):
            return name.rpartition(".")[2] in laws.winding()
        if owner == self.prefix + "motor" and self.kind == "motor":
            return name.rpartition(".")[2] in laws.electric()
        if owner == self.prefix + "motor" and self.kind == "gear" and self.reading == "current":
            return name.rpartition(".")[2] in laws.driving()
        if owner == self.prefix + "load" and self.kind in ("motor", "supply"):
            return False
        return owner in self.components or name == self.prefix + "reducer.gear_ratio" or owner == self.prefix + "load"


def residuals(probe: Channels) -> list[Residual]:
    """The comparisons that the channels of one drive allow."""
    rig, prefix, steady, has = probe.setting.rig, probe.prefix, probe.steady, probe.has
    name = {part: prefix + part for part in ("controller", "motor", "reducer", "load")}
    found: list[Residual] = []

    def add(kind, components, reads, output, compute, beside=()):
        measure = unit("motor.torque" if kind == "gear" and output != "motor.current" else output, rig.linear)
        reads = tuple(prefix + r for r in reads if has(r))
        found.append(
            Residual(
                kind,
                prefix + kind,
                tuple(name[c] for c in components),
                reads,
                prefix + output,
                measure,
                compute,
                prefix,
                beside=tuple(prefix + b for b in beside),
            )
        )

    if rig.simulate == whole.WHOLE:
        whole.refuse_open(rig, set(probe.run.signals))
        for shown in whole.compared(probe):
            reads = (*driven.inputs(probe), *(("load.angle",) if shown == "reducer.input_angle" else ()))
            add("whole", whole.components(probe), reads, shown, lambda v, ch, shown=shown: whole.channel(shown, v, ch))
        seen = whole.seen_by_controller(probe)
        return [replace(one, name=f"whole {one.output}", through=seen, over=driven.lasting(one.output, probe)) for one in found]

    electric = drive.electric(probe)
    moves = [m for m in MOVES if has(m)]
    delivered = ("reducer.output_torque",) if has("reducer.output_torque") else ()
    if rig.kind == "forward" and rig.simulate in ("open", "closed") and (electric or rig.simulate == "closed") and moves:
        closed = rig.simulate == "closed"
        if closed and not has("controller.angle_setpoint"):
            raise DataError(f'{rig.path}: simulate = "closed" needs a column "controller.angle_setpoint".')
        shown = next(m for m in forward.SHOWN if has(m))
        read = (
            ("controller.angle_setpoint", "controller.speed_setpoint", "motor.supply_voltage")
            if closed
            else ("motor.duty", "motor.supply_voltage", "motor.voltage", "controller.voltage")
        )
        add(
            "drive",
            [*(["controller"] if closed else []), "motor", "reducer", "load"],
            (*read, *moves),
            shown,
            lambda v, ch: forward.motion(shown, closed, v, ch),
        )
        return found

    volts = ("motor.duty", "motor.supply_voltage") if electric == "motor.duty" else (electric,) if electric else ()
    command = "controller.voltage" if has("controller.voltage") else "motor.voltage" if has("motor.voltage") else ""
    if command and has("controller.angle_setpoint") and moves and not steady:
        add(
            "controller",
            ["controller"],
            ("controller.angle_setpoint", "controller.speed_setpoint", *moves, *delivered),
            command,
            lambda v, ch: compare.controller(command, v, ch),
        )
    if electric and moves and has("motor.current"):
        turned = next(m for m in ("reducer.input_speed", "reducer.input_angle", "load.speed", "load.angle") if has(m))
        others = tuple(m for m in moves if m != turned)
        add("motor", ["motor"], (*volts, *moves), "motor.current", lambda v, ch: compare.motor(electric, v, ch), others)
    # a duty counts times the measured supply, and a voltage measured on the motor has fallen with it: what such a motor
    # lacks is no matter of its supply
    if (
        electric == "controller.voltage"
        and (has("motor.current") or moves)
        and not steady
        and _varies(probe, "motor.supply_voltage")
    ):
        drawn = ("motor.current",) if has("motor.current") else tuple(moves)
        add("supply", ["motor"], (electric, *drawn), "motor.supply_voltage", lambda v, ch: compare.supply(v, ch))
    torque = next((t for t in ("motor.torque", "reducer.input_torque", "motor.current") if has(t)), electric)
    if torque and moves:
        who = ["reducer"] if delivered else ["reducer", "load"]
        if torque not in ("motor.torque", "reducer.input_torque"):
            who = ["motor", *who]
        add(
            "gear",
            who,
            (*moves, *(volts if torque == electric else ()), *delivered),
            torque,
            lambda v, ch: compare.gear(torque, electric, v, ch),
        )
    described = {key.rpartition(".")[0] for key in rig.parameters}
    if delivered and (has("load.angle") or has("load.speed")) and name["load"] in described:
        add(
            "load",
            ["load"],
            ("load.angle", "load.speed"),
            "reducer.output_torque",
            lambda v, ch: compare.load(v, ch),
        )
    for side, kind in (("reducer.input_", "input"), ("load.", "output")):
        if has(side + "angle", side + "speed") and not steady:
            add(kind, [], (side + "angle",), side + "speed", lambda v, ch, side=side: compare.redundant(side, v, ch))
    if has("reducer.input_angle", "load.angle") and not steady:
        add(
            "twist",
            ["reducer", *([] if delivered else ["load"])],
            (*moves, *delivered),
            "load.angle",
            lambda v, ch: compare.twist(v, ch),
        )
    elif not steady and all(any(has(m) for m in side) for side in SPEED_OF.items()):
        known = "reducer.input_speed" if has("load.angle") else "load.speed"  # the shaft that has no angle
        add(
            "shafts",
            ["reducer", *([] if delivered else ["load"])],
            (*[m for m in moves if m != known], *delivered),
            known,
            lambda v, ch: compare.shafts(known, v, ch),
        )
    return found


def _varies(probe: Channels, name: str) -> bool:
    """Whether a channel was measured, and is no number that somebody wrote down."""
    return probe.has(name) and len(set(probe.raw(name)[probe.good(name)])) > 1
