"""Channels that tell of one motion, held against each other: signs, the gear's ratio, units, the clock.

What follows without any law: a speed is its angle's derivative, two shafts turn in the gear's ratio, a drive goes where its
set-point sends it. A relation that is off names several that may be wrong; what is common to all that are off, and in none
that holds, is the one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import degrees, pi

import numpy as np

from ..rules import RULES
from .finding import Finding, Said
from .pieces import Pieces
from .rig import Rig
from .signals import SETPOINTS

RATIO, TIME = "reducer.gear_ratio", "time"
ANGLES = ("reducer.input_angle", "load.angle", "controller.angle_setpoint")
SHAFT = {"reducer.input_angle": "input", "reducer.input_speed": "input"}

RPM, DEGREE, TURN = pi / 30.0, pi / 180.0, 2.0 * pi
SLIPS = {  # times that a value is too large, and why
    "angle": ((1 / DEGREE, "degrees read as radians", 'unit = "deg"'), (DEGREE, "radians read as degrees", 'unit = "rad"'),
              (1 / TURN, "turns read as radians", 'unit = "turn"'), (TURN, "radians read as turns", 'unit = "rad"'),
              (1e3, "mrad read as rad", 'unit = "mrad"')),
    "speed": ((1 / RPM, "rpm read as rad/s", 'unit = "rpm"'), (RPM, "rad/s read as rpm", 'unit = "rad/s"'),
              (1 / DEGREE, "deg/s read as rad/s", 'unit = "deg/s"'), (DEGREE, "rad/s read as deg/s", 'unit = "rad/s"'),
              (RPM / DEGREE, "deg/s read as rpm", 'unit = "deg/s"'), (DEGREE / RPM, "rpm read as deg/s", 'unit = "rpm"'),
              (1 / TURN, "turns per second read as rad/s", 'unit = "turn/s"')),
    "time": ((1e3, "ms read as s", 'unit = "ms"'), (1e-3, "s read as ms", 'unit = "s"'), (1e6, "µs read as s", 'unit = "us"'),
             (1e-6, "s read as µs", 'unit = "s"'), (1e9, "ns read as s", 'unit = "ns"')),
}  # fmt: skip
METRES = {"angle": ((1e3, "mm read as m", 'unit = "mm"'), (1e-3, "m read as mm", 'unit = "m"')),
          "speed": ((1e3, "mm/s read as m/s", 'unit = "mm/s"'), (1e-3, "m/s read as mm/s", 'unit = "m/s"')), "time": SLIPS["time"]}  # fmt: skip


@dataclass(frozen=True)
class Relation:
    """`first` over `second`, which should be 1. `blamed`: what each that may be wrong would be too large by."""

    first: str
    second: str
    factor: float
    blamed: dict[str, float]

    @property
    def off(self) -> bool:
        """Beyond what a drive can do."""
        return not 1.0 / RULES.data.gross < self.factor < RULES.data.gross


def factor(first: np.ndarray, second: np.ndarray) -> float | None:
    """By how much `first` is larger than `second` where both move most; None where the pieces do not agree."""
    rules = RULES.data
    both = np.isfinite(first) & np.isfinite(second) & (first * second != 0.0)
    first, second = first[both], second[both]
    if len(first) < rules.fewest_pieces:
        return None
    size = abs(first * second)
    most = size >= np.median(size)
    each = first[most] / second[most]
    sign = 1.0 if np.median(each) > 0.0 else -1.0
    low, high = np.quantile(abs(each), (0.25, 0.75))
    if np.mean(each * sign > 0.0) < rules.one_sign or high > rules.one_factor * low:
        return None
    return sign * float(np.median(abs(each)))


def relations(pieces: Pieces, ratio: float) -> list[Relation]:
    """What follows from what, of the channels that there are. ratio: the gear's, as the rig has it."""
    has, found = pieces.has, []
    moved: dict[str, Callable[[str], np.ndarray]] = {
        "reducer.input_angle": pieces.change, "reducer.input_speed": pieces.way, "load.angle": pieces.change,
        "load.speed": pieces.way, "controller.angle_setpoint": pieces.change, "controller.speed_setpoint": pieces.way,
    }  # fmt: skip

    def relate(first: str, second: str) -> bool:
        if not (has(first) and has(second)):
            return False
        geared = SHAFT.get(first) != SHAFT.get(second)
        k = factor(moved[first](first), moved[second](second) * (ratio if geared else 1.0))
        if k is not None:
            blamed = {first: k, second: 1.0 / k}
            if geared:
                blamed[RATIO] = 1.0 / k
            if (first in ANGLES) != (second in ANGLES):
                blamed[TIME] = 1.0 / k if first in ANGLES else k
            found.append(Relation(first, second, k, blamed))
        return True

    relate("reducer.input_angle", "reducer.input_speed")
    relate("load.angle", "load.speed")
    relate("controller.angle_setpoint", "controller.speed_setpoint")
    geared = [relate("reducer.input_angle", "load.angle"), relate("reducer.input_speed", "load.speed")]
    if not any(geared):
        relate("reducer.input_angle", "load.speed")
        relate("reducer.input_speed", "load.angle")
    asked = [relate("controller.angle_setpoint", "load.angle"), relate("controller.speed_setpoint", "load.speed")]
    if not any(asked) and not (relate("reducer.input_angle", "controller.angle_setpoint") or has("load.angle")):
        relate("reducer.input_speed", "controller.speed_setpoint")
    return found


def contradictions(found: list[Relation], said: Said, rig: Rig, agree: set[str]) -> list[Finding]:
    """A sentence for each thing that is wrong, the one that explains most first. agree: signals that others bear out."""
    wrong = [r for r in found if r.off]
    right = agree | {name for r in found if not r.off for name in r.blamed}
    told = []
    while wrong:
        covers = {name: [r for r in wrong if name in r.blamed and _agree(r, name, wrong)] for r in wrong for name in r.blamed}
        worth = {name: (len(rs), name not in right) for name, rs in covers.items()}
        best = max(worth.values())
        names = [name for name in worth if worth[name] == best]
        mine = covers[names[0]]
        told.append(_sentence(mine, names, said, rig, _alike(mine[0], names, found, said, rig)))
        wrong = [r for r in wrong if r not in mine]
    return told


def other_ratio(found: list[Relation], said: Said) -> list[Finding]:
    """A remark where two shafts turn in another ratio than the rig has it, or than was assumed because nobody gave one."""
    ratio, given = said.value(RATIO), said.given(RATIO)
    least = RULES.data.ratio_off if given else RULES.data.ratio_told
    for one in found:
        shafts = RATIO in one.blamed and not one.off and not {*one.blamed} & SETPOINTS
        if (
            shafts
            and abs(one.factor - 1.0) > least
            and not any(low <= one.factor * ratio <= high for low, high in [said.ends(RATIO)])
        ):
            rig = f"the rig says {ratio:g}" if given else f"nobody gave {said.prefix}{RATIO}, so that {ratio:g} was assumed"
            text = f"{said(one.first)} and {said(one.second)} turn in a ratio of {number(one.factor * ratio)}, and {rig}"
            mend = f"write {said.prefix}{RATIO} = {number(one.factor * ratio)}"
            return [Finding(f"{text}: {mend}{_lines(one, said)}.", False, (RATIO,))]
    return []


def _lines(one: Relation, said: Said) -> str:
    """What else shafts may be that turn two or four times as far, or as little: an encoder counts both edges of one or two tracks."""
    for times in (4.0, 2.0):
        for name, factor in ((one.first, one.factor), (one.second, 1.0 / one.factor)):
            if near(factor, times):
                return f"; or {said(name)} counts each line of its encoder {times:g} times: divide its factor by {times:g}"
    return ""


def _alike(off: Relation, names: list[str], found: list[Relation], said: Said, rig: Rig) -> str:
    """What else it may be: an angle and its set-point that bear each other out, for both are in another unit than the rig has them."""
    for name in off.blamed:
        holds = [r for r in found if not r.off and name in r.blamed]
        partners = {one for r in holds for one in r.blamed if one != name}
        if (
            name not in (*names, RATIO, TIME)
            and holds
            and partners <= SETPOINTS
            and (text := _slip(name, off.blamed[name], said, rig))
        ):
            return text.replace(said(name), " and of ".join(map(said, (name, *sorted(partners)))))
    return ""


def _agree(one: Relation, name: str, wrong: list[Relation]) -> bool:
    """Whether a relation tells of this the same as the first that does."""
    first = next(r for r in wrong if name in r.blamed)
    share = one.blamed[name] / first.blamed[name]
    return 1.0 / RULES.data.one_factor < share < RULES.data.one_factor


def _sentence(off: list[Relation], names: list[str], said: Said, rig: Rig, alike: str) -> Finding:
    first = off[0]
    slips = [text for name in names if (text := _slip(name, first.blamed[name], said, rig))] + [alike] * bool(alike)
    if len(names) == 1 and names[0] not in (RATIO, TIME):
        name, times = names[0], first.blamed[names[0]]
        others = [r.second if r.first == name else r.first for r in off]
        how = "moves the other way than" if times < 0.0 else f"moves {_times(times)} as far as"
        text = f"{said(name)} {how} {' and '.join(map(said, others))} say" + ("s" if len(others) == 1 else "")
    elif names == [RATIO]:
        text = f"{said(first.first)} and {said(first.second)} turn in a ratio of {number(1.0 / first.blamed[RATIO] * said.value(RATIO))}, the rig says {said.value(RATIO):g}"
    elif names == [TIME]:
        text = f"by column {rig.time.column!r} {_times(first.blamed[TIME])} the time goes by that {said(first.first)} and {said(first.second)} tell"
    else:
        how = "the other way than" if first.factor < 0.0 else f"{_times(first.factor)} as far as"
        text = f"{said(first.first)} moves {how} {said(first.second)} says"
    mend = f": {'; or '.join(slips)}" if slips else ": look at units, factors and the ratio of what is named here"
    return Finding(text + mend + ".", True, tuple(names))


def _slip(name: str, times: float, said: Said, rig: Rig) -> str:
    """What may have happened to a value that is so many times too large; "" where nothing known."""
    if name == RATIO:
        ratio = said.value(RATIO) / times
        if times < 0.0:  # no gear of ours turns the motion round: a sign belongs to a column
            return "" if near(-times, 1.0, RULES.data.gross) else f"the log asks for {said.prefix}{RATIO} = {number(-ratio)}, too"
        turned = "it stands upside down (input speed over output speed); " if near(ratio * said.value(RATIO), 1.0) else ""
        return f"{turned}the log asks for {said.prefix}{RATIO} = {number(ratio)}"
    kind = "time" if name == TIME else "angle" if name in ANGLES else "speed"
    for slip, text, unit in (METRES if rig.linear else SLIPS)[kind]:
        if near(abs(times), slip):
            where = "under [time]" if name == TIME else f"of {said(name)} under [columns]"
            sign = " and its sign, factor = -1.0" if times < 0.0 else ""
            return f"{text}? Write {unit}{sign} {where}"
    if times < 0.0 and name != TIME and near(abs(times), 1.0, RULES.data.gross):
        return f"turn the sign of {said(name)}, {said.turned(name)}"
    return ""


def near(value: float, wanted: float, times: float = 1.0 + RULES.data.known_slip) -> bool:
    """Whether a factor is this one."""
    return wanted / times < value < wanted * times


def _times(value: float) -> str:
    value = abs(value)
    return f"{number(value)} times" if value >= 1.0 else f"1/{number(1.0 / value)} times"


def number(value: float) -> str:
    """To three digits, as people write it."""
    return f"{value:.3g}" if not 999.0 < abs(value) < 1e7 else f"{float(f'{value:.3g}'):.0f}"


def look_at_ratio(said: Said) -> str:
    """To look at the gear's ratio; below 1 it may stand upside down."""
    ratio = said.value(RATIO)
    return "the gear's ratio" if ratio >= 1.0 else f"the gear's ratio (input speed over output speed: {number(1.0 / ratio)}?)"


def zero(pieces: Pieces, said: Said) -> list[Finding]:
    """An angle that follows its set-point from afar: a remark.

    By quarters of a turn it is a contradiction where the whole loop is simulated: no number of a drive moves it there.
    """
    asked, angle = "controller.angle_setpoint", "load.angle"
    if not (pieces.has(asked) and pieces.has(angle)):
        return []
    goal, place = pieces.samples(asked, angle)  # of a long log means over pieces move by little
    if len(goal) < RULES.data.fewest_pieces:
        return []
    apart = place - goal
    low, middle, high = np.quantile(apart, (0.05, 0.5, 0.95))
    way = float(np.ptp(np.quantile(goal, (0.02, 0.98))))
    if abs(middle) < max(RULES.data.zero_share * way, high - low):
        return []
    more = f" ({degrees(middle):.0f} degrees)" if not said.linear else ""
    text = f"{said(angle)} lies {middle:.3g} {'m' if said.linear else 'rad'}{more} from where {said(asked)} sends it"
    quarters = round(middle / (TURN / 4.0))
    other = quarters != 0 and abs(middle - quarters * TURN / 4.0) < RULES.data.zero_quarters
    looped = said.rig.simulate in ("closed", "whole") or (not said.rig.simulate and said.given("controller.angle_gain"))
    gross = other and looped and not said.linear
    offset = f"{-quarters * TURN / 4.0:.6g}" if gross else f"{-middle:.4g}"
    mend = f"write offset = {offset} for {said(angle) if gross else 'one of them'} under [columns]"
    why = "an angle that is counted from another zero" if gross else "if their zeros are not the same"
    return [Finding(f"{text}: {why}{': ' if gross else ', '}{mend}.", gross, (angle,))]
