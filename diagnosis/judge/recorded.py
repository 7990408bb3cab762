"""What was assumed and estimated about the recorder of a log: channel by channel where a whole drive is simulated.

There the last fit holds numbers of the recorder beside all others (search.hypotheses.recorder), and what is told of them
is that fit's. Where parts of a drive run on measured inputs nothing of the kind is estimated but how a measured voltage is
read between its rows, and what was assumed instead is told.
"""

from __future__ import annotations

import numpy as np

from ..data.rig import Rig
from ..data.signals import ANGLE_OF, SPEED_OF, VOLTAGES, along, unit
from ..residuals import drive, driven, whole
from ..residuals.channels import Channels
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.forward import swinging
from ..residuals.recorder import commanded, counts, ticks
from ..residuals.rounding import sees_counts
from ..rules import RULES
from ..search.fit import Fit
from ..search.hypotheses import Free
from ..search.problem import Problem
from ..search.swings import SHAFT

CONTROLLER = "controller"


def recorded(problem: Problem, final: Fit, why: str, given: Rig) -> dict:
    """The recorder as diagnosis.json tells it, by the fit that has the last word. why: the drive was compared as it was; given: the rig
    as it was read.

    `mode`: whole, parts, or as the rig's `simulate` says; `assumed`: sentences; `channels` and `controller`: of a whole drive.
    """
    experiment = problem.experiment
    rig = experiment.rig
    found: dict = {"mode": rig.simulate or "parts", "why": why, "estimated": rig.simulate == whole.WHOLE}
    numbers = _numbers(problem, final)
    if rig.simulate != whole.WHOLE:
        channels = [_between_rows(name, number) for name, number in numbers.items()]
        beside = {"estimated": True, "channels": channels} if channels else {}
        return found | beside | {"assumed": _assumed_in_parts(experiment, bool(channels))}
    ch = experiment.channels[0, ""]
    found["assumed"] = _assumed_of_whole(ch) + _shaft(ch, given)
    if whole.seen_by_controller(ch):
        found["controller"] = _controller(rig, ch, numbers)
    if told := loop(ch, given):
        found["loop"] = told
    found["channels"] = [_channel(residual.output, ch, numbers, final, problem) for residual in experiment.residuals]
    return found


def _numbers(problem: Problem, final: Fit) -> dict[str, dict]:
    """Value and 95 % interval, each with its unit, of all numbers of the recorder; no interval where the log feels none."""
    intervals = final.intervals(problem.rows, problem.blocks)
    found = {}
    for p, column in zip(final.free, final.jacobian.T):
        if p.of_recorder:
            low, high = intervals[p.name] if np.any(column[problem.rows]) else (None, None)
            found[p.name] = {
                "value": final.values[p.name],
                "low": low,
                "high": high,
                "unit": _unit(p),
                "at_end": _at_end(p, final),
            }
    return found


def _unit(p: Free) -> str:
    """Relative of a ripple, an angle of a zero; all else are times."""
    return "1" if ".ripple_" in p.name else "rad" if p.name.endswith(".zero") else "s"


def _at_end(p: Free, final: Fit) -> bool:
    """Whether a number lies at an end of its range other than 0, where there is simply none of it."""
    near = RULES.search.at_end * (p.high - p.low)
    return any(end != 0.0 and abs(final.values[p.name] - end) < near for end in (p.low, p.high))


def _controller(rig: Rig, ch: Channels, numbers: dict[str, dict]) -> dict:
    """When the controller acts: as the rig says, or the delay that was fitted; and the filter of the speed that it makes."""
    known: dict = {"filter": numbers[whole.FILTER]} if whole.FILTER in numbers else {}
    if hold := numbers.get(whole.HOLD):
        read = "acts later than its row by half of an unknown period, taken for a delay"
        return {"read": read, "numbers": {"hold": hold, **known}}
    told = {"period": "controller.sample_period", "delay": "controller.command_delay"}
    for word, name in told.items():
        if name in rig.parameters:
            known[word] = {"value": rig.parameters[name], "unit": "s"}
    period = rig.parameters.get(told["period"], 0.0)
    own = ", on a speed that it makes of its angle" if whole.makes_its_speed(ch) else ""
    if driven.row_by_row(ch):
        return {"read": f"acts at each row and holds what it gives until the next{own}", "numbers": known}
    if period > 0.0:
        known["ticked"] = {"value": ticks(period, ch), "unit": "s"}
        return {"read": "acts once in its period, which the rig says; when, the steps of its command tell", "numbers": known}
    return {"read": "acts as the rig says", "numbers": known}


def _channel(name: str, ch: Channels, numbers: dict[str, dict], final: Fit, problem: Problem) -> dict:
    """How one channel was read: what its log shows of itself, what was fitted, and the rest in words."""
    mine = f"recorder.{name}."
    fitted = {key.removeprefix(mine): number for key, number in numbers.items() if key.startswith(mine)}
    count, rows = counts(name, ch) if name in whole.TURNS or name in SPEED_OF else (0.0, 0)
    linear = ch.setting.rig.linear
    found: dict = {"channel": name, "count": count, "rows": rows, "unit": unit(ANGLE_OF.get(name, name), linear)}
    found["read"] = _way(name, count, rows)
    found["numbers"] = fitted
    if ripples := _ripples(mine, final, problem):
        found["ripple"] = ripples
    return found


def _between_rows(name: str, number: dict) -> dict:
    """How a measured voltage was read where parts of a drive run on it."""
    channel = name.removeprefix("recorder.").removesuffix(".shift")
    read = "a voltage that at 0 is held from its row to the next, half a step late goes straight from row to row, beyond was read late"
    return {"channel": channel, "count": 0.0, "rows": 0, "unit": "V", "read": read, "numbers": {"shift": number}}


def _way(name: str, count: float, rows: int) -> str:
    if rows:
        return f"the difference of an angle's counts over {rows} row{'s' * (rows > 1)}, divided by their time"
    if name in SPEED_OF:
        return "an angle in counts, read at the instant" if count > 0.0 else "an angle, read at the instant"
    if name in whole.TURNS:
        return "a speed behind a first-order filter, with a tacho's ripple, read at the instant"
    if name in VOLTAGES:
        return "a voltage averaged over the window before it is read"
    return "read at the instant, neither averaged nor filtered"


def _ripples(mine: str, final: Fit, problem: Problem) -> list[dict]:
    """Amplitude of each wave of a channel's ripple, relative, with the interval that its cosine and sine give to first order."""
    names = [p.name for p in final.free]
    spread = final.covariance(problem.rows, problem.blocks) if any(n.startswith(f"{mine}ripple") for n in names) else None
    found = []
    for waves in RULES.residuals.ripples:
        pair = [f"{mine}ripple_{wave}_{waves}" for wave in ("cos", "sin")]
        if spread is None or not all(name in names for name in pair):
            continue
        both, places = np.array([final.values[name] for name in pair]), [names.index(name) for name in pair]
        size = float(np.hypot(*both))
        slope = both / size if size > 0.0 else np.full(2, np.sqrt(0.5))
        half = RULES.search.interval * float(np.sqrt(max(0.0, slope @ spread[np.ix_(places, places)] @ slope)))
        found.append({"waves": waves, "value": size, "low": max(0.0, size - half), "high": size + half, "unit": "1"})
    return found


def loop(ch: Channels, given: Rig) -> str:
    """At which shaft a controller of angle is taken to see what it is told, and why, where both are logged; "" where there is no question."""
    if driven.of(ch) != driven.ANGLE or not all(
        ch.has(f"{side}angle") or ch.has(f"{side}speed") for side in ("load.", "reducer.input_")
    ):
        return ""
    seen = " and ".join(whole.seen_by_controller(ch))
    why = (
        "as the rig says"
        if given.loop
        else "as its command tells"
        if commanded(ch) and ch.setting.rig.loop
        else 'for so least is left, and no command is logged that tells; if it is another, write loop = "load", "motor" or "dual" in [rig]'
    )
    return f"the controller is taken to see {seen}, {why}"


def _assumed_of_whole(ch: Channels) -> list[str]:
    time, rules, way = ch.run.time, RULES.residuals, driven.of(ch)
    settling = min(rules.settling, rules.settling_share * float(time[-1] - time[0]))
    if way == driven.VOLTAGE:
        how = [
            f"the drive is in open loop: {' times '.join(driven.inputs(ch))} drives it, "
            f"{'held from its row to the next' if driven.row_by_row(ch) else 'straight between rows but where it jumps'}, as late as "
            "the channels say"
        ]
    else:
        over = [name for name in whole.seen_by_controller(ch) if way == driven.ANGLE or name.endswith("speed")]
        how = [
            "set-points are numbers, valid at the instant of their row and straight between rows",
            f"the loop closes over {' and '.join(over)}, as the drive has them, not as they were recorded"
            + (f"; {driven.DUTY} counts times {driven.SUPPLY}, which was measured" if driven.inputs(ch) else "")
            + ("; the voltage steps with the angle's counts, which are taken for noise" if sees_counts(ch) else ""),
        ]
    changes = [name for name in ("load.angle", "reducer.input_angle") if ch.has(name) and driven.by_change(name, ch)]
    how += [
        f"no controller holds {name}, so that it strays: its change over {driven.rows_of_change(name, ch)} rows is compared"
        for name in changes
    ]
    return [
        *how,
        "a channel was read in the same way from the first row to the last, in all logs",
        f"a run begins as its first row says; its first {settling:.2g} s, and as much behind a gap, are not compared",
    ]


def _shaft(ch: Channels, given: Rig) -> list[str]:
    """What was found of an output shaft of which the rig says nothing."""
    told = ch.setting.rig.parameters
    if not all(name in told and name not in given.parameters for name in SHAFT):
        return []
    reducer, load = (drive.law(part, {}, ch) for part in ("reducer", "load"))
    swings = np.sqrt(reducer.shaft_stiffness / swinging(reducer, load)) / (2.0 * np.pi)
    sizes = [f"{told[name]:.3g} {along(of) if given.linear else of}" for name, of in zip(SHAFT, ("N.m/rad", "N.m.s/rad"))]
    return [
        f"the rig says no {SHAFT[0]}: the drive is right with one of {sizes[0]}, which swings {swings:.3g} times a second, and a "
        f"{SHAFT[1].partition('.')[2]} of {sizes[1]}, and is taken to have these"
    ]


def _assumed_in_parts(experiment: DriveExperiment, estimated: bool) -> list[str]:
    rig = experiment.rig
    if experiment.steady:
        point = "the mean of the trusted samples of its run" if rig.run else "a row of the log"
        return [f"each point is {point}; all its channels are of the same steady state"]
    which = "all channels of a row but its voltage" if estimated else "all channels of a row"
    found = [f"{which} were read at its instant, as they were then: not late, not averaged, not filtered"]
    if rig.kind == "forward":
        held = "a set-point" if estimated else "a command"
        found.append(f"between two rows {held} keeps its value, and a measured motion goes straight from one to the next")
    if any(residual.kind == CONTROLLER for residual in experiment.residuals) or rig.simulate == "closed":
        period = rig.parameters.get("controller.sample_period", 0.0)
        found.append(
            f"the controller acts every {period:g} s, as the rig says" if period > 0.0 else "the controller acts at every row"
        )
    for prefix, rows in experiment.setting.smoothing.items():
        if any(residual.smoothed and residual.prefix == prefix for residual in experiment.residuals) and rows > 1:
            where = f" of {prefix.rstrip('_')}" if prefix else ""
            by = "as the rig says" if rig.smoothing > 0.0 else "chosen by the noise of the motion"
            found.append(
                f"motion and torque at the gear{where} are averaged alike over {rows} rows ({rows * experiment.step:.3g} s), {by}"
            )
    return found
