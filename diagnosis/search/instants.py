"""When a set-point jumped, and when a controller slower than the log acts: within a row nobody logged it.

It belongs to a run, as where it begins does, and is no cause. The drive that fits best as it is described, recorder and all, is
simulated with its jumps at several places of their rows; each is left where its next moments fit best.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..residuals import driven, whole
from ..residuals.channels import Channels
from ..residuals.closing import answers_its_motion, answers_its_rows
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.mending import samples
from ..residuals.noise import floor
from ..residuals.recorder import commanded, ticks
from ..rules import RULES
from .fit import Fit
from .problem import Problem


def place_jumps(experiment: DriveExperiment, problem: Problem) -> bool:
    """Find when each jump of a whole drive's set-points came, and keep it with its run; whether there is any."""
    channels = list(experiment.channels.values())
    if not any(len(driven.jumped(ch)) for ch in channels):
        return False
    # what is measured jumps in more than a row, and shifts tell where of it
    rounds = 2 if driven.of(channels[0]) == driven.VOLTAGE else 1
    for _ in range(rounds):
        problem = problem.with_noise()
        problem = _placed(experiment, channels, problem, problem.fit(problem.base_free, problem.nominal))
    fitted = problem.fit(problem.base_free, problem.nominal)
    first = _instants(channels)
    closer = _closer(experiment, channels, problem, fitted, with_shifts=True, enough=RULES.search.sound)
    _put(channels, closer[2] if closer else first)
    return True


def place_jumps_again(experiment: DriveExperiment, problem: Problem, fits: Sequence[Fit]) -> tuple[Problem, Fit] | None:
    """The problem with each jump where it came for a drive with a cause, and that drive's fit; None where that says nothing new.

    They were placed for the drive as it is described, and as far as they could they made up for what is wrong with it: a friction
    more of which the log speaks for a late set-point, too, and then for any other cause that mends what is left. fits: of each cause
    that it may be. That drive is taken which then fits best.
    """
    channels = list(experiment.channels.values())
    if not any(len(driven.jumped(ch)) for ch in channels):
        return None
    first, found = _instants(channels), []
    for fitted in fits:
        if problem.excess(fitted.values).max() > RULES.search.sound and (
            closer := _closer(experiment, channels, problem, fitted)
        ):
            found.append(closer)
        _put(channels, first)
    if not found:
        return None
    closest, fitted, instants, _ = min(found, key=lambda one: one[3])
    _put(channels, instants)
    return closest, fitted


def _closer(
    experiment: DriveExperiment,
    channels: list[Channels],
    problem: Problem,
    fitted: Fit,
    with_shifts: bool = False,
    enough: float = 0.0,
) -> tuple[Problem, Fit, list[dict[int, float]], float] | None:
    """Jumps placed for a fit, and that made again, one after the other until that closes no more; None where it closes nothing.

    Problem, fit, when the jumps came, what the fit leaves. enough: times its noise, with which a drive needs no closer ones.
    """
    found = None
    for _ in range(RULES.search.again):
        if enough > 0.0 and problem.excess(fitted.values).max() <= enough:
            break
        other = _placed(experiment, channels, problem, fitted, with_shifts)
        further = other.fit(fitted.free, dict(fitted.values))
        if other.loss(further.misfit) > (1.0 - RULES.search.matters) * problem.loss(fitted.misfit):
            break
        problem, fitted = other, further
        found = problem, fitted, _instants(channels), problem.loss(fitted.misfit)
    return found


def _placed(
    experiment: DriveExperiment, channels: list[Channels], problem: Problem, fitted: Fit, with_shifts: bool = False
) -> Problem:
    """The problem with each jump of all runs where it came for a drive as it is fitted; with_shifts: whenever it was read."""
    values = problem.settled(experiment, problem.absolute(fitted.values), fitted.free)
    noise = _noise(experiment, values)
    for ch in channels:
        (_place_with_shifts if with_shifts else _place)(experiment, ch, values, noise)
    return problem.on(problem.experiment.but_with(problem.experiment.setting))


def _instants(channels: list[Channels]) -> list[dict[int, float]]:
    """When the jumps of each run came, as it is known."""
    return [dict(driven.sooner(ch)) for ch in channels]


def _put(channels: list[Channels], instants: list[dict[int, float]]) -> None:
    for ch, known in zip(channels, instants):
        driven.sooner(ch).update(known)
        _forget(ch)


def place_acts(experiment: DriveExperiment, problem: Problem, anew: Callable[[], Problem]) -> bool:
    """Find whether what drives the motor acts row by row and is held between, and whether its controller makes its speed itself.

    So a small controller does that writes its own log. Of these ways the one that fits best is kept with the runs. It is asked where
    the first, which acts between rows on the speed that was logged, leaves more than noise. Where none of them leaves no more, what
    is wrong with the drive may speak for any: then the command does, if it is the law of its own rows, or of the logged motion. anew: the problem, in the way
    that is kept.
    """
    channels = list(experiment.channels.values())
    ch = channels[0]
    if not commanded(ch):
        return False
    problem, sound = problem.with_noise(), RULES.search.sound
    fitted = problem.fit(problem.base_free, problem.nominal)
    values = fitted.values
    if problem.excess(fitted.values).max() <= sound:
        return False
    period = ch.setting.value("controller.sample_period", {}) if driven.of(ch) != driven.VOLTAGE else 0.0
    rows = period <= 0.0 or abs(period - experiment.step) <= RULES.data.uneven * experiment.step
    own = whole.needs_speed(ch) and not whole.makes_its_speed(ch)
    able = {name for name, there in {driven.BY_ROWS: rows, driven.OWN_SPEED: own}.items() if there}
    ways = [way for way in ({driven.BY_ROWS}, {driven.OWN_SPEED}, {driven.BY_ROWS, driven.OWN_SPEED}) if way <= able]
    loss = lambda fit: problem.loss(fit.misfit)
    best, least = set(), loss(fitted)
    for way in ways:
        _act(channels, way)
        other = anew().with_noise()
        other = replace(other, noise=problem.noise, quiet=problem.quiet, loss_scale=problem.loss_scale)
        fitted = other.fit(other.base_free, other.nominal)
        if loss(fitted) < least:
            best, least = way, loss(fitted)
            if other.excess(fitted.values).max() <= sound:
                break
    else:
        if all(map(answers_its_rows, channels)):
            best = able & {driven.BY_ROWS, driven.OWN_SPEED} | {driven.AT_ONCE}
        elif all(answers_its_motion(ch, _missed(experiment, ch, problem.absolute(values))) for ch in channels):
            best = best | {driven.AT_ONCE}
    _act(channels, best)
    return bool(best)


def place_again(
    experiment: DriveExperiment, problem: Problem, fits: Sequence[Fit], near: Sequence[Fit], anew: Callable[[], Problem]
) -> tuple[Problem, Fit] | None:
    """See place_jumps_again; and place_acts_again, where that closes still more."""
    jumps = place_jumps_again(experiment, problem, fits)
    least = jumps[0].loss(jumps[1].misfit) if jumps else min(problem.loss(fitted.misfit) for fitted in near)
    return place_acts_again(experiment, problem, near, least, anew) or jumps


def place_acts_again(
    experiment: DriveExperiment, problem: Problem, fits: Sequence[Fit], least: float, anew: Callable[[], Problem]
) -> tuple[Problem, Fit] | None:
    """Of a drive in open loop the problem with its voltage held from each row on where it was taken to go straight to the next, or
    the other way, and the fit of a cause that is best so; None where none leaves less so than `least`, enough to matter.

    It was asked of the drive as it is described. What is wrong with it may speak for the other way, as a supply that sags in the
    moment that follows a jump, and beside that for another cause. Nor may it be farther from its noise: where nothing happens
    between the rows there is less of that. fits: of all causes that it may be, near to the best. anew: the problem, in the way that
    is kept.
    """
    channels = list(experiment.channels.values())
    if driven.of(channels[0]) != driven.VOLTAGE or not commanded(channels[0]):
        return None
    now = min(fits, key=lambda f: problem.loss(f.misfit))
    off = max(RULES.search.sound, problem.excess(now.values).max())
    acts = set(channels[0].run.memory.get(driven.ACTS, ()))
    _act(channels, acts ^ {driven.BY_ROWS})
    other = replace(problem.on(anew().experiment), nominal=problem.nominal)
    best = min((other.fit(f.free, dict(f.values)) for f in fits), key=lambda f: other.loss(f.misfit))
    if other.loss(best.misfit) < (1.0 - RULES.search.matters) * least:
        for ch in channels:
            ch.memory.clear()
        kept = anew().with_noise()
        if kept.excess(best.values).max() <= off:
            return kept, best
        for ch in channels:
            ch.memory.clear()
    _act(channels, acts)
    return None


def _missed(experiment: DriveExperiment, ch: Channels, values: dict) -> float:
    """How far off the command is of a drive with these values; 0 where it is not compared."""
    for residual in experiment.residuals:
        if residual.output == commanded(ch):
            simulated, measured, good = residual.compute(values, ch)
            return float(np.sqrt(np.mean((measured - simulated)[good] ** 2))) if good.any() else 0.0
    return 0.0


def _act(channels: list[Channels], way: set[str]) -> None:
    """Keep with the runs how what drives the motor acts."""
    for ch in channels:
        ch.run.memory[driven.ACTS] = frozenset(way)


def place_ticks(experiment: DriveExperiment, problem: Problem) -> bool:
    """Find when within its period a controller acts whose period the rig gives, in each run; whether there is any to be found.

    The steps of its voltage tell it to a row, and to what a message takes; what current and voltage are between two acts tells the
    rest, each channel as late as fits best.
    """
    channels = list(experiment.channels.values())
    period = channels[0].setting.value("controller.sample_period", {})
    if (
        period <= experiment.step * (1.0 - RULES.data.uneven)
        or driven.of(channels[0]) == driven.VOLTAGE
        or not commanded(channels[0])
        or driven.row_by_row(channels[0])
    ):
        return False
    problem = problem.with_noise()
    values = problem.absolute(problem.fit(problem.base_free, problem.nominal).values)
    if problem.excess(values).max() <= RULES.search.sound:  # as the rows tell it it is good enough
        return False
    noise, shifts = _noise(experiment, values), {p.name: (p.low, p.high) for p in problem.base_free if p.name.endswith(".shift")}
    for ch in channels:
        ch.memory[whole.LATE] = dict.fromkeys([residual.output for residual in experiment.residuals], 0.0)
        known, first, apart = ch.run.memory["ticks"], ticks(period, ch), period / RULES.search.tick_places
        best, losses = first, {}
        for offsets in (np.arange(RULES.search.tick_places), *([-(0.5**n), 0.0, 0.5**n] for n in range(1, 4))):
            for place in best + apart * np.asarray(offsets):
                if place not in losses:
                    known[period] = float(place % period)
                    losses[place] = _read_best(experiment, ch, values, noise, shifts)
            best = min(losses, key=losses.__getitem__)
        known[period] = float(best % period)
        del ch.memory[whole.LATE]
        _forget(ch)
    return True


def _read_best(experiment: DriveExperiment, ch, values: dict, noise: list[float], shifts: dict) -> float:
    """Loss of all channels of a run, each read as late as fits best."""
    _forget(ch)
    everywhere, total = [np.ones(len(ch.taken(ch.run.time)), bool)], 0.0
    for residual, usual in zip(experiment.residuals, noise):
        name = f"recorder.{residual.output}.shift"
        if name not in shifts or usual <= 0.0:
            continue
        loss = lambda late, residual=residual, usual=usual, name=name: _squares(
            residual, ch, values | {name: float(late)}, everywhere, usual
        )[0]
        low, high = shifts[name]
        places = np.linspace(low, high, RULES.search.shift_places)
        least, late, apart = *min((loss(late), late) for late in places), places[1] - places[0]
        for n in range(1, 4):
            least, late = min((least, late), *((loss(x), x) for x in (late - apart / 2**n, late + apart / 2**n)))
        total += least
    return total


def _noise(experiment: DriveExperiment, values: dict) -> list[float]:
    """Of each channel. A median of its errors is none: a drive that rests for most of a log has next to no error there."""
    everywhere = np.ones(experiment.layout.count, bool)
    return [
        floor(experiment, residual, values, *samples(experiment, residual, values, everywhere)[:2])
        for residual in experiment.residuals
    ]


def _place_with_shifts(experiment: DriveExperiment, ch, values: dict, noise: list[float]) -> None:
    """Each jump of a run at its best place where all channels are read as much sooner or later as leaves least of the whole run.

    Shifts that were fitted with the jumps elsewhere keep them there: where both are wrong by as much the motion after a jump is right,
    and all other motion is not.
    """
    pairs, everywhere = driven.jumped(ch), [np.ones(len(ch.taken(ch.run.time)), bool)]
    if not len(pairs):
        return
    late, half = _late(experiment, ch, values), RULES.search.jump_places // 2
    shifts = [name for residual in experiment.residuals if (name := f"recorder.{residual.output}.shift") in values]
    known, found = driven.sooner(ch), []
    apart = float(np.median(np.diff(ch.run.time))) / (RULES.search.jump_places - 1)
    for n in range(-half, half + 1):
        moved = values | {name: values[name] + n * apart for name in shifts}
        _place(experiment, ch, moved, noise, late)
        ch.memory[whole.LATE] = late
        found.append((float(_losses(experiment, ch, moved, everywhere, noise)[0]), dict(known)))
        del ch.memory[whole.LATE]
    known.update(min(found, key=lambda one: one[0])[1])
    _forget(ch)


def _late(experiment: DriveExperiment, ch, values: dict) -> dict[str, float]:
    """How much later than in the first run each channel is read, s, as fits best."""
    return {residual.output: whole.lateness(residual.output, values, ch) for residual in experiment.residuals}


def _place(experiment: DriveExperiment, ch, values: dict, noise: list[float], late: dict[str, float] | None = None) -> None:
    """Each jump of a run at the best of some places, then of some about it, last where a parabola through these is lowest.

    late: how much later than in the first run each channel is read, s; as fits best.
    """
    pairs, time = driven.jumped(ch), ch.taken(ch.run.time)
    known, rules, most = driven.sooner(ch), RULES.search, 1.0 - 2.0 * RULES.residuals.upright
    if not len(pairs):
        return
    ch.memory[whole.LATE] = late or _late(experiment, ch, values)  # which would follow wherever all jumps are tried
    rows = pairs[:, 1]
    ends = np.minimum(ch.run.time[rows] + rules.jump_shows, np.append(ch.run.time[pairs[1:, 0]], np.inf))
    windows = [(time >= ch.run.time[row]) & (time < end) for row, end in zip(rows, ends)]

    def losses(places: np.ndarray) -> np.ndarray:
        known.update(zip(map(int, rows), map(float, places)))
        return _losses(experiment, ch, values, windows, noise)

    apart = 1.0 / (rules.jump_places - 1)
    best, closer = np.zeros(len(pairs)), np.array([-0.5, 0.0, 0.5]) * apart
    halved = range(int(np.ceil(np.log2((rows - pairs[:, 0]).max()))) + 1)  # to the same part of a row, however many it may take
    for offsets in (np.linspace(0.0, 1.0, rules.jump_places), *(closer / 2**n for n in halved)):
        tried = np.clip(best[:, None] + offsets, 0.0, most)
        best = tried[np.arange(len(rows)), np.argmin([losses(places) for places in tried.T], axis=0)]
    step = 0.5 * apart / 2 ** halved[-1]
    before, here, behind = (losses(best + n * step) for n in (-1, 0, 1))
    bend = before - 2.0 * here + behind
    ahead = np.divide(0.5 * step * (before - behind), bend, out=np.zeros(len(rows)), where=bend > 0.0)
    lowest = np.clip(best + np.clip(ahead, -step, step), 0.0, most)
    best = np.where(losses(lowest) < here, lowest, best)
    known.update(zip(map(int, rows), map(float, best)))
    del ch.memory[whole.LATE]
    _forget(ch)


def _losses(experiment: DriveExperiment, ch, values: dict, windows: list[np.ndarray], noise: list[float]) -> np.ndarray:
    """Of each window: squared errors of all channels in units of the noise of each, wild ones held back."""
    _forget(ch)
    found = np.zeros(len(windows))
    for residual, usual in zip(experiment.residuals, noise):
        if usual > 0.0:
            found += _squares(residual, ch, values, windows, usual)
    return found


def _squares(residual, ch, values: dict, windows: list[np.ndarray], usual: float) -> list[float]:
    """Of each window: squared errors of a channel in units of its noise, wild ones held back."""
    simulated, measured, good = residual.compute(values, ch)
    error = np.where(good & np.isfinite(simulated), measured - simulated, 0.0)
    squares = np.minimum((error / usual) ** 2, RULES.search.jump_wild)
    return [float(squares[window].sum()) for window in windows]


def _forget(ch) -> None:
    """What was simulated with other instants."""
    ch.memory.pop("grid", None)
    ch.memory.pop(whole.WHOLE, None)
