"""The sanity box: what a log shows against what its rig says, and what was assumed because nobody gave it.

It looks for slips (a unit, a sign, a ratio, exchanged columns), not for causes: what a diagnosis is there to find passes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from ..rules import RULES
from . import ahead, balances, electric, lifting, motions, scales, wrapped
from .finding import Finding, Said
from .log import MeasuredRun
from .pieces import Pieces, telling
from .rig import Rig
from .signals import ANGLE_OF, GIVEN, SETPOINTS

ELECTRIC = {"motor.voltage", "controller.voltage", "motor.duty"}


@dataclass(frozen=True)
class Box:
    """What a log and its rig say of each other."""

    shows: tuple[str, ...]  # what was measured of the relations, one by one
    findings: tuple[Finding, ...]
    assumed: dict[str, tuple[float, str]]  # value and unit of what nobody gave, by component.parameter
    made: tuple[str, ...] = ()  # channels that nobody recorded, and what they were made of
    silent: tuple[str, ...] = ()  # numbers that somebody gave, and of whose unit these logs say nothing

    @property
    def gross(self) -> list[str]:
        """What no drive does: sentences."""
        return [f.sentence for f in self.findings if f.gross]

    def row(self) -> dict:
        """As diagnosis.json has it."""
        return {
            "shows": list(self.shows),
            "contradictions": self.gross,
            "remarks": [f.sentence for f in self.findings if not f.gross],
            "assumed": {name: {"value": value, "unit": unit} for name, (value, unit) in self.assumed.items()},
            "made": list(self.made),
            "silent": list(self.silent),
        }

    def lines(self) -> list[str]:
        """The box in a few lines of text."""
        told = [f"  {'CONTRADICTION' if f.gross else 'remark'}: {f.sentence}" for f in self.findings]
        if self.shows:
            told.insert(0, f"  log: {'; '.join(self.shows)}")
        if self.assumed or self.made:
            told.append(f"  assumed, for nobody gave it: {', '.join(self.assumptions())}")
        if self.silent:
            told.append(f"  given, and nothing here would show another unit of it: {', '.join(self.silent)}")
        return ["Log against rig:", *told] if told else []

    def assumptions(self) -> list[str]:
        """Channels and what they were made of, name = value unit of all that was assumed; what is 0 together."""
        told = [f"{name} = {value:g} {unit}".rstrip() for name, (value, unit) in self.assumed.items() if value]
        none = [name for name, (value, _) in self.assumed.items() if not value]
        return list(self.made) + told + [f"and 0 for {', '.join(none)}"] * bool(none)

    def refuse(self, rig: Rig, anyway: bool) -> None:
        """DataError where log and rig contradict each other beyond what a drive can do, and nobody says to go on."""
        if self.gross and not anyway:
            said = "\n".join(f"  - {sentence}" for sentence in self.gross)
            raise DataError(
                f"{rig.path}: the log and the rig contradict each other:\n{said}\nMend what is wrong, or go on as it is with --anyway (anyway=True in Python)."
            )


def box(rig: Rig, runs: list[MeasuredRun]) -> Box:
    """Hold the runs of a drive, which are checked for faults, against its rig."""
    findings, shows, silent = _told_nothing(rig) + _clock(rig, runs), [_extent(rig, runs)], list[str]()
    own = rig.of_log(runs[0].log)
    for prefix in rig.drives:
        said = Said(rig, prefix, {**rig.parameters, **own})
        mine, shown, mute = _drive(rig, runs, prefix, said)
        findings += mine
        shows += shown
        silent += mute
    taken = assumed(rig, set(runs[0].signals), own)
    return Box(tuple(filter(None, shows)), tuple(findings), taken, tuple(_made(rig, runs)), tuple(silent))


def assumed(rig: Rig, signals: set[str], own: dict[str, float] | None = None) -> dict[str, tuple[float, str]]:
    """Value and unit of what a simulation needs and nobody gave. signals: of the log; own: parameters of that log alone; else of any."""
    found: dict[str, tuple[float, str]] = {}
    own = {name: value for table in rig.logs.values() for name, value in table.items()} if own is None else own
    for prefix in rig.drives:
        seen = {name.removeprefix(prefix) for name in signals if name.startswith(prefix)}
        found |= Said(rig, prefix, {**rig.parameters, **own}).assumed(_components(seen, rig.simulate in ("closed", "whole")))
    return found


def _made(rig: Rig, runs: list[MeasuredRun]) -> Iterator[str]:
    """The set-point of a speed that no column has: a controller may do without."""
    for prefix in rig.drives:
        seen = {name.removeprefix(prefix) for name in runs[0].signals if name.startswith(prefix)}
        compared = "controller" in _components(seen, rig.simulate in ("closed", "whole"))
        if compared and "controller.angle_setpoint" in seen and "controller.speed_setpoint" not in seen:
            yield f"{prefix}controller.speed_setpoint as the rate of {prefix}controller.angle_setpoint"


def _drive(rig: Rig, runs: list[MeasuredRun], prefix: str, said: Said) -> tuple[list[Finding], list[str], list[str]]:
    """Findings, what the log shows, and of which numbers it says nothing."""
    parts = runs if rig.kind == "steady" else telling(runs, prefix)
    coarse = Pieces(parts, prefix, RULES.data.pieces)
    kind = _kind(rig, runs, prefix, said, coarse)
    kind += wrapped.contradictions(runs, prefix, said)
    if any(f.gross for f in kind):
        return kind, [], []
    silent: list[str] = []
    ratio = said.value("reducer.gear_ratio")
    found = motions.relations(coarse, ratio)
    if scales.follows(coarse, said):
        found = [r for r in found if not (r.off and {*r.blamed} & SETPOINTS)]
    findings = motions.contradictions(found, said, rig, balances.borne_out(coarse, said))
    suspects = {name for f in findings for name in f.about}
    if "time" not in suspects:
        volts = balances.voltage(coarse, said, suspects)
        findings += volts
        seen = {name.removeprefix(prefix) for name in runs[0].signals if name.startswith(prefix)}
        if seen & ELECTRIC and not any(balances.KE in f.about and "given as" in f.sentence for f in volts):
            findings += balances.motor_constants(said)
        suspects |= {name for f in findings for name in f.about}
        findings += electric.torque(coarse, said, suspects)
        suspects |= {name for f in findings for name in f.about}
        fine = Pieces(parts, prefix, RULES.data.fine_pieces)
        lifts = lifting.lifting(fine, said, suspects)
        findings += lifts + lifting.unloaded({name.removeprefix(prefix) for name in runs[0].signals}, said)
        findings += [] if lifts else lifting.frictions(said)
        findings += (leans := lifting.leaning(said))
        suspects |= {name for f in leans for name in f.about}
        if not any(f.gross for f in lifts):
            torques = balances.torque(fine, coarse, said, suspects)
            if any("load.arm_angle" in f.about for f in torques):  # then it is lifted at other places
                findings = [f for f in findings if f not in lifts]
            findings += torques
        wrong = suspects | {name for f in findings for name in f.about}
        more, silent = scales.scales(fine, said, wrong, _components(seen, rig.simulate in ("closed", "whole")))
        findings += more
    if not suspects and (zero := motions.zero(coarse, said)):
        findings = zero + [f for f in findings if "load.angle" not in f.about]
    findings += ahead.exchanged(runs, prefix, said, suspects)
    if "reducer.gear_ratio" not in suspects:
        findings += motions.other_ratio(found, said)
    if not 0.5 < ratio and "reducer.gear_ratio" not in suspects:
        text = f"{prefix}reducer.gear_ratio = {ratio:g} is below 1, which gears up: it is input speed over output speed"
        findings.append(
            Finding(f"{text}. If the sheet says 1:{1 / ratio:g}, write {1 / ratio:g}.", False, ("reducer.gear_ratio",))
        )
    return kind + findings, [_relation(r, ratio, prefix) for r in found], silent


def _relation(relation: motions.Relation, ratio: float, prefix: str) -> str:
    """What a relation gives, as numbers."""
    first, second = prefix + relation.first, relation.second
    if motions.RATIO in relation.blamed:
        return f"{first} / {second} = {relation.factor * ratio:.4g} (rig {ratio:g})"
    of = "the integral of " if motions.TIME in relation.blamed else ""
    return f"{first} = {relation.factor:.3g} {of}{second}"


def _components(seen: set[str], closed: bool) -> tuple[str, ...]:
    """Whose parameters matter to what is simulated, or which. closed: the loop is simulated, whatever of it was measured."""
    controller = ("controller",) if closed or (seen & SETPOINTS and seen & ELECTRIC) else ()
    motor = ("motor",) if closed or seen & ELECTRIC else ("motor.torque_constant",) if "motor.current" in seen else ()
    return (*controller, *motor, "reducer", "load")


def _told_nothing(rig: Rig) -> list[Finding]:
    if rig.parameters or rig.uncertain or rig.logs:
        return []
    text = f"nothing is known of the drive, for [parameters] of {rig.path.name} is empty: every value would be the FMUs' own"
    return [Finding(f"{text}. Give what the data sheets say, the gear's ratio first.", True, ("parameters",))]


def _extent(rig: Rig, runs: list[MeasuredRun]) -> str:
    rows, lasts = sum(map(len, runs)), sum(float(np.ptp(run.time)) for run in runs)
    if rig.kind == "steady":
        return f"{rows} rows in {len(runs)} runs" if rig.run else f"{rows} points"
    steps = np.concatenate([np.diff(run.time) for run in runs])
    runs_ = f" in {len(runs)} runs" if len(runs) > 1 else ""
    return f"{lasts:.4g} s{runs_}, a row every {1e3 * float(np.median(steps)):.4g} ms"


def _clock(rig: Rig, runs: list[MeasuredRun]) -> list[Finding]:
    """A remark where the time itself looks wrong: there may be no second channel to show it."""
    if rig.kind == "steady":
        return []
    step = float(np.median(np.concatenate([np.diff(run.time) for run in runs])))
    column = f"column {rig.time.column!r}"
    if step >= RULES.data.slow_rows:
        lasts = sum(float(np.ptp(run.time)) for run in runs)
        text = f"rows are {step:.3g} s apart by {column}, and the log lasts {f'{lasts / 3600:.3g} h' if lasts > 3600 else f'{lasts:.3g} s'}"
        return [Finding(f'{text}. If that column is in ms, write unit = "ms" under [time].', False, ("time",))]
    if step < RULES.data.fast_rows:
        text = f"rows are {1e6 * step:.3g} µs apart by {column}"
        return [Finding(f'{text}. If that column is in s, write unit = "s" under [time].', False, ("time",))]
    return []


def _kind(rig: Rig, runs: list[MeasuredRun], prefix: str, said: Said, pieces: Pieces) -> list[Finding]:
    """A kind that the log is not of."""
    seen = {name.removeprefix(prefix) for name in runs[0].signals if name.startswith(prefix)}
    if rig.kind == "inverse" and seen & GIVEN - SETPOINTS:
        given = said(sorted(seen & GIVEN - SETPOINTS)[0])
        text = f'kind = "inverse" says that the motion was imposed, and {given} that a voltage drove it'
        mend = 'each component is compared all the same; with kind = "forward" the whole drive can be simulated, too'
        return [Finding(f"{text}: {mend}.", False, ("kind",))]
    speed = next((name for name in ANGLE_OF if name in seen), None)
    if rig.kind != "steady" or speed is None:
        return []
    if rig.run:
        sound = [run.signals[prefix + speed][run.usable(prefix + speed)] for run in runs]
        within = np.array([np.std(x) for x in sound if len(x) > 1])
        wrong = len(within) > 0 and np.median(within) > RULES.data.unsteady * balances.rms(np.concatenate(sound))
        what = "within its runs"
    else:
        x = np.concatenate([run.signals[prefix + speed] for run in runs])
        turns = int(np.sum(x[1:] * x[:-1] < 0.0))
        wrong = balances.moves(x) and turns >= RULES.data.fewest_pieces  # points that somebody sorted turn once or twice
        what = "from row to row as of a motion to and fro"
    if not wrong:
        return []
    text = f'kind = "steady" asks for points at constant speed, and the speed of {said(speed)} changes {what}'
    kinds = 'write kind = "forward" (voltage in) or "inverse" (torque measured)'
    return [Finding(f"{text}: {kinds}, or name the column that tells the points apart, [rig] run.", True, ("kind",))]
