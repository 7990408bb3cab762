"""What may be missing or wrong in a system that nobody knows the inside of: every guess with its numbers and where to look first."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, product

import numpy as np
from scipy.signal import lfilter

from selflock.fmus.correction import law

from ..calibration.numbers import Number, label
from ..rules import RULES
from ..search.hypotheses import Free, Hypothesis
from .places import IN, Insert, Place, ahead
from .rounding import gathers, steps_of, thinned
from .scene import Scene

PARAMETER, PATH, EVENT, LAW, CURVE = "parameter", "path", "event", "law", "curve"
KINDS = PARAMETER, PATH, EVENT, LAW
"""What may be asked for; with laws go free curves."""
FAR = 1e300
PLAIN, DERIVED, PAIRS = range(3)
"""The stages in which guesses are asked: one of a later stage must be better, not only as good."""


@dataclass(frozen=True)
class Guess:
    """One thing that may be wrong, and the numbers that say how much of it there is."""

    kind: str
    law: str
    label: str
    inserts: tuple[Insert, ...]
    numbers: tuple[Number, ...]
    acts: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def place(self) -> Place | None:
        return self.inserts[0].place if self.inserts else None

    @property
    def over(self) -> tuple[str, int, str]:
        """The variable that its law goes with, what of it, and with which other."""
        return (self.inserts[0].over, self.inserts[0].taken, self.inserts[0].beside) if self.inserts else ("", law.VALUE, "")

    @property
    def goes(self) -> tuple[Place | None, str]:
        """Where it acts, and what it goes with."""
        return self.place, self.over[0]

    @property
    def stage(self) -> int:
        """When it is asked: PLAIN what goes with variables as they are and is added, or is no law at all; last what goes with two."""
        if any(one.beside for one in self.inserts):
            return PAIRS
        derived = any(one.multiplies or one.taken != law.VALUE or (one.over and self.kind == EVENT) for one in self.inserts)
        return DERIVED if derived else PLAIN

    @property
    def plain(self) -> bool:
        return self.stage == PLAIN

    @property
    def count(self) -> int:
        """How many numbers say how much of it there is; where a run begins is another thing."""
        return sum(not begins(n) for n in self.numbers)

    @cached_property
    def free(self) -> tuple[Free, ...]:
        """Its numbers as the linear look has them: off at their start values."""
        return tuple(Free(n.name, n.start, n.low, n.high) for n in self.numbers)

    @cached_property
    def hypothesis(self) -> Hypothesis:
        return Hypothesis("", self.label, self.free)


def begins(number: Number) -> bool:
    """Whether a number only says where a law's own state begins, in each run elsewhere: at x + d."""
    return number.run is not None and number.variable.endswith(".d")


@dataclass(frozen=True)
class Trial:
    """A guess with some of its numbers set: where its amplitudes are looked at, or, of a jump, what is looked at.

    at: of the numbers, by name; the amplitudes, which are `acting`, at their starts. A jump has one, the amount of which is 1.
    """

    guess: Guess
    at: dict[str, float]
    acting: tuple[str, ...] = ()


def number(name: str, start: float, low: float, high: float) -> Number:
    return Number(name, name, start, low, high)


def curve(scene: Scene, place: Place, over: str, what: int, multiplies: bool, beside: str = "") -> tuple[Insert, np.ndarray]:
    """A table of a variable, or of two taken together, its points where the variable is, all heights 0; and these points."""
    knots = points_over(scene.joined(over, what, beside))
    follows = lambda name: ahead(scene.parts, place, name, scene.smooth)
    carried = 0.5 if what == law.INTEGRAL else 0.0 if what in (law.RATE, law.SINCE_TURN) else follows(over)
    fixed: tuple[tuple[str, float], ...] = (("ahead", carried), ("ahead_beside", follows(beside) if beside else 0.0))
    return with_points(Insert(scene.prefix, place, "table", multiplies, over, what, 0, fixed, beside), knots), knots


def points_over(x: np.ndarray) -> np.ndarray:
    """Points between which a curve over a variable with these values is straight, as many as there are to a curve.

    Where straight lines are to leave least of a curve in the mean of their square they lie as close as the fifth root of how often
    the variable is there times the square of the curve's bend (de Boor, A Practical Guide to Splines, 1978, XII), and of the bend
    nobody knows. At the variable's quantiles they were much farther apart where it hardly is: whole waves fell between two.
    """
    count = RULES.naming.knots
    often, edges = np.histogram(x, 2 * (count - 1))
    there = often > 0
    low, wide = edges[:-1][there], np.diff(edges)[there]
    close = np.cumsum(often[there] ** 0.2 * wide)
    at = np.linspace(0.0, close[-1], count)
    bin_of = np.minimum(np.searchsorted(close, at), len(low) - 1)
    before = np.concatenate([[0.0], close[:-1]])
    knots = low[bin_of] + wide[bin_of] * (at - before[bin_of]) / (close - before)[bin_of]
    knots[0], knots[-1] = float(np.min(x)), float(np.max(x))
    gap = RULES.naming.knot_gap * float(np.ptp(x))
    while len(knots) > 2 and (np.diff(knots) < gap).any():
        tight = int(np.argmin(np.diff(knots)))
        knots = np.delete(knots, tight + 1 if 0 < tight + 1 < len(knots) - 1 else tight)
    return knots


def coarser(table: Insert, knots: np.ndarray) -> Iterator[tuple[Insert, np.ndarray]]:
    """A table, and the same of every second and of every fourth point, which few blocks tell better: what the heights are at the knots."""
    for apart in (1, 2, 4):
        few = knots[np.unique([*range(0, len(knots), apart), len(knots) - 1])]
        heights = np.stack([np.interp(knots, few, unit) for unit in np.eye(len(few))], -1)
        yield with_points(table, few), heights
        if len(few) < RULES.naming.coarser:
            return


def placed(table: Insert, x: np.ndarray) -> Insert:
    """A table with its points where its variable has these values."""
    return with_points(table, points_over(x))


def with_points(table: Insert, points: np.ndarray) -> Insert:
    """A table with these points for its own."""
    return replace(
        table, points=len(points), fixed=table.fixed[:2] + tuple((f"x{k + 1}", float(x)) for k, x in enumerate(points))
    )


def points_of(table: Insert) -> np.ndarray:
    """Where a table's points lie."""
    fixed = dict(table.fixed)
    return np.array([fixed[f"x{k + 1}"] for k in range(table.points)])


def heights(table: Insert) -> list[str]:
    """The names of a table's heights."""
    return [f"{table.name}.y{k + 1}" for k in range(table.points)]


def heights_at(guess: Guess, values: dict[str, float]) -> np.ndarray:
    """How high the points of a free curve lie with these values of its numbers."""
    (table,) = guess.inserts
    return np.array([sum(guess.acts[n.name].get(y, 0.0) * values[n.name] for n in guess.numbers) for y in heights(table)])


def words(kind: str, one: Insert) -> str:
    """A law at its place, in words."""
    how = "times" if one.multiplies else "on"
    return f"{kind} of {one.goes_with} {how} {one.place}" if one.over else f"{kind} {how} {one.place}"


def laws(scene: Scene, table: Insert, knots: np.ndarray) -> Iterator[tuple[Guess, dict[str, float], tuple[str, ...], np.ndarray]]:
    """The laws without a state that go with a table's variable: (guess, shapes, amplitudes, what these are at the knots)."""
    rules = RULES.naming
    size = float(abs(knots).max()) or 1.0
    low, high = float(knots[0]), float(knots[-1])
    spread = rules.reach if table.multiplies else rules.reach * scene.spread(table.place)
    shapes: dict[str, list[dict[str, float]]] = {
        "power": [{"n": n} for n in rules.powers],
        "Coulomb": [{"w": w * size} for w in rules.widths],
        "Stribeck": [{"w": w * size, "v": v * size} for w, v in product(rules.widths[:1], rules.widths[1:])],
        "dead band": [{"w": w * size} for w in rules.bands],
        "limit": [{"l": low + q * (high - low)} for q in rules.limits],
        "limit below": [{"l": high - q * (high - low)} for q in rules.limits],
    }
    ranges = {
        "n": (rules.powers[0] / 2.0, 2.0 * rules.powers[-1]), "w": (1e-3 * size, size), "v": (1e-3 * size, size), "l": (low, high + rules.beyond * (high - low))
    }  # fmt: skip
    one_sided = low >= 0.0 or high <= 0.0
    seen: list[np.ndarray] = []
    for name in ("constant", "proportional", "quadratic", "drag", "cubic", "square root", *shapes):
        if one_sided and name in ("drag", "Coulomb", "Stribeck", "dead band"):
            continue  # there they are no other law than quadratic, constant, limit
        amplitudes = tuple(n for n in law.BY_NAME[name].numbers if n in ("a", "b"))
        for shape in shapes.get(name, [{}]):
            at = np.stack([_heights(name, shape, amplitude, knots) for amplitude in amplitudes], -1)
            flat = at / np.maximum(np.sqrt((at**2).sum(0)), 1e-300)
            if len(amplitudes) == 1 and any(abs(float(flat[:, 0] @ other)) > rules.same for other in seen):
                continue  # of a variable of few values two laws may be one
            if not np.isfinite(at).all() or not at.any():
                continue
            if len(amplitudes) == 1 and not shape:
                seen.append(flat[:, 0])
            stiff = rules.stiff if name in ("limit", "limit below", "dead band") else 1.0
            most = stiff * spread / max(float(abs(at).max()), 1e-300)
            numbers = []
            for n in law.BY_NAME[name].numbers:
                if n in amplitudes:
                    numbers.append(number(f"{scene.prefix}.{n}", 0.0, -most, most))
                else:
                    numbers.append(number(f"{scene.prefix}.{n}", shape[n], *ranges[n]))
            one = replace(table, law=name, points=0, fixed=table.fixed[:2])
            guess = Guess(LAW, name, words(name, one), (one,), tuple(numbers))
            yield (
                guess,
                {f"{scene.prefix}.{k}": v for k, v in shape.items()},
                tuple(f"{scene.prefix}.{a}" for a in amplitudes),
                at,
            )


def _heights(name: str, shape: dict[str, float], amplitude: str, knots: np.ndarray) -> np.ndarray:
    """The law at the knots with this amplitude 1, others 0."""
    p = [0.0] * law.SIZE
    p[law.LAW] = law.BY_NAME[name].code
    for k, word in enumerate(law.BY_NAME[name].numbers):
        p[law.FIRST + k] = 1.0 if word == amplitude else shape.get(word, 0.0)
    return np.array([law.still(p, float(x)) for x in knots])


def with_state(scene: Scene, place: Place, over: str, what: int) -> Iterator[Trial]:
    """Laws that remember: hysteresis of a variable itself, and one more state of first order."""
    rules, x = RULES.naming, scene.joined(over, what)
    size, spread = float(np.ptp(x)) / 2.0, rules.reach * scene.spread(place)
    fixed = (("ahead", ahead(scene.parts, place, over, scene.smooth) if what == law.VALUE else 0.0),)
    a, w = f"{scene.prefix}.a", f"{scene.prefix}.w"

    def made(name: str, *numbers: Number) -> Guess:
        one = Insert(scene.prefix, place, name, False, over, what, 0, fixed)
        return Guess(LAW, name, words(name, one), (one,), numbers)

    if what == law.VALUE:
        for width in rules.bands:
            dahl = made("Dahl", number(a, 0.0, -spread, spread), number(w, width * size, 1e-3 * size, 2.0 * size))
            yield Trial(dahl, {w: width * size}, (a,))
    level = float(abs(x).max()) or 1.0
    d = f"{scene.prefix}.d"
    starts = [Number(f"{d} of {label(run)}", d, 0.0, -2.0 * level, 2.0 * level, run=i) for i, run in enumerate(scene.played.runs)]
    times = np.geomspace(rules.fastest * scene.step, rules.slowest * scene.span, rules.times)
    empty = {n.name: -first for n, first in zip(starts, scene.firsts(over, what))}
    for time in times:
        keep = float(np.exp(-scene.step / time))  # a slow state has little of what goes in
        left = float(abs(lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0]).max()) or level
        numbers = (
            number(a, 0.0, -spread / left, spread / left),
            number(f"{scene.prefix}.T", float(time), float(times[0]) / 10.0, 10.0 * float(times[-1])),
        )
        for begun in (
            {},
            empty,
        ):  # a state that has settled, or one that begins at 0: most that is seen of a slow one is its way up
            yield Trial(made("first order", *numbers, *starts), {f"{scene.prefix}.T": float(time)} | begun, (a,))


def sines(scene: Scene, place: Place, over: str, what: int, multiplies: bool) -> Iterator[Trial]:
    """A sine of what is an angle: of its unit, rad."""
    if what != law.VALUE or over not in scene.parts.variables or scene.parts.variables[over].unit != "rad":
        return
    table, _ = curve(scene, place, over, what, multiplies)
    one = replace(table, law="sine", points=0, fixed=table.fixed[:2])
    most = RULES.naming.reach * (1.0 if multiplies else scene.spread(place))
    for n in RULES.naming.waves:
        for phase in (0.0, 0.5 * np.pi):
            a, order, shift = (f"{scene.prefix}.{name}" for name in ("a", "n", "phase"))
            numbers = (number(a, 0.0, -most, most), number(order, n, 0.5 * n, 1.5 * n), number(shift, phase, -4.0, 4.0))
            yield Trial(Guess(LAW, "sine", words("sine", one), (one,), numbers), {order: n, shift: phase}, (a,))


def paths(scene: Scene, place: Place) -> Iterator[Trial]:
    """What a path may do to the signal."""
    rules, s, prefix = RULES.naming, scene.signal(place), scene.prefix
    size, spread = float(abs(s).max()) or 1.0, float(np.std(s))
    if spread <= RULES.judge.constant * size:
        return
    low, high = float(s.min()), float(s.max())

    def made(name: str, *numbers: Number, title: str = "", **fixed: float) -> Guess:
        one = Insert(prefix, place, name, fixed=tuple(fixed.items()))
        return Guess(PATH, title or name, words(title or name, one), (one,), numbers)

    a = f"{prefix}.a"
    offset = replace(made("constant", number(a, 0.0, -3.0 * size, 3.0 * size), title="offset"), law="offset")
    yield Trial(offset, {}, (a,))
    yield Trial(made("scale", number(a, 1.0, -3.0, 5.0)), {}, (a,))
    yield Trial(made("sign"), {})
    late = f"{prefix}.T"
    most = min((law.HISTORY - 2) * scene.step, rules.latest * scene.span)
    for steps in rules.late:
        if steps * scene.step < most:
            yield Trial(made("delay", number(late, 0.0, 0.0, most)), {late: steps * scene.step})
            yield Trial(made("lag", number(late, 0.0, 0.0, most)), {late: steps * scene.step})
    for share in np.geomspace(*rules.dead):
        w = f"{prefix}.w"
        yield Trial(made("dead zone", number(w, 0.0, 0.0, size)), {w: float(share) * size})
    for quantile in rules.clipped:
        for end, at in (("high", float(np.quantile(s, quantile))), ("low", float(np.quantile(s, 1.0 - quantile)))):
            bound = number(f"{prefix}.{end}", high if end == "high" else low, low, high)
            yield Trial(saturation(prefix, place, end, bound), {bound.name: at})
    rates = np.concatenate([abs(np.diff(x) / np.diff(t)) for x, t in zip(scene.series[place.variable], scene.series["time"])])
    fastest = float(rates.max())
    for share in np.geomspace(*rules.rates):
        r = f"{prefix}.r"
        yield Trial(made("rate limit", number(r, fastest, 1e-3 * fastest, fastest)), {r: float(share) * fastest})
    for step in _rounded_to(scene, place, size, spread):
        q = f"{prefix}.q"
        yield Trial(made("quantisation", number(q, 0.0, 0.0, 2.0 * spread)), {q: float(step)})


def saturation(prefix: str, place: Place, end: str, bound: Number) -> Guess:
    """A path whose signal ends there, at the "high" or the "low" end."""
    title, other = f"saturation ({end})", {"high": ("low", -FAR), "low": ("high", FAR)}[end]
    one = Insert(prefix, place, "saturation", fixed=(other,))
    return Guess(PATH, title, words(title, one), (one,), (bound,))


def _rounded_to(scene: Scene, place: Place, size: float, spread: float) -> np.ndarray:
    """Steps that a signal of this size and spread may be rounded to, so close that none counts otherwise than one of them.

    What decides are the counts of the largest value: with a step that is off by little it is soon another one, and a look at steps
    even in their logarithm met none where there were more than a few. Recorded values tell theirs: the mean of cos(2 pi y / q) is
    1 where all lie at whole numbers of q, and those steps are left at which they gather most.
    """
    if place.where != IN and place.variable in scene.played.rounded:
        return np.array([scene.played.rounded[place.variable].step])
    recorded = [] if place.where == IN else [run.signals[place.variable] for run in scene.played.runs]
    y = thinned(np.concatenate([np.zeros(0), *recorded]))
    if not len(y):
        return steps_of(size, spread)
    if not (varies := float(np.std(y))):
        return np.zeros(0)
    steps = steps_of(float(abs(y).max()), varies)
    gathered = gathers(y, steps)
    peaks = 1 + np.flatnonzero((gathered[1:-1] >= gathered[:-2]) & (gathered[1:-1] >= gathered[2:]))
    return steps[sorted(peaks, key=lambda k: -gathered[k])[: RULES.naming.gathered]]


def parameters(scene: Scene, taken_names: set[str], values: dict[str, dict], felt: Callable[[str], float]) -> Iterator[Trial]:
    """Each number of the FMUs that a user could set, and that is not fitted anyway. felt: how much of one that is 0 would make what is left."""
    parts = scene.parts
    for name, v in parts.variables.items():
        component = parts.owner(name)
        start_of = v.causality == "output" and v.initial in ("exact", "approx")
        if component not in scene.played.group.members or v.type != "Real" or name in taken_names:
            continue
        if not (v.causality == "parameter" or start_of) or not parts.rig.questioned(name) or v.variability == "constant":
            continue
        given = parts.rig.parameters.get(name, values.get(component, {}).get(name[len(component) + 1 :], v.start))
        if given is None or not np.isfinite(given):
            continue
        reach = RULES.naming.off_by * abs(given)
        if given == 0.0:
            reach = 2.0 * float(abs(scene.joined(name)).max()) if start_of and name in scene.series else 0.0
        if reach == 0.0 and not np.isfinite(v.high - v.low):
            reach = RULES.naming.off_by * felt(name)
        low, high = max(given - reach, v.low), min(given + reach, v.high)
        if reach == 0.0:
            low, high = v.low, v.high
        if given > 0.0 and low <= 0.0 and not start_of:
            low = given / (1.0 + RULES.naming.off_by)
        if np.isfinite(high - low) and low < high and low <= given <= high:
            yield Trial(Guess(PARAMETER, "parameter", name, (), (Number(name, name, float(given), low, high),)), {}, (name,))


def shifts(scene: Scene, place: Place) -> Iterator[tuple[Insert, float, str]]:
    """What an event may add to a place while it lasts: something constant, or in proportion to a variable of its component.

    The latter as of a part that was exchanged, or of an open lid. As (correction, how large its amplitude may be, words). What a loop
    holds varies by little, and an open window takes several times as much: it may be the reach of a law's of a place of that reach.
    """
    most = RULES.naming.reach**2 * scene.spread(place)
    yield Insert(scene.prefix, place, "constant"), most, ""
    component = scene.parts.owner(place.variable)
    mine = lambda name: not name or (name in scene.parts.variables and scene.parts.owner(name) == component)
    singles = [(name, what, "") for name, what in scene.variables(place) if what == law.VALUE and mine(name)]
    for over, what, beside in (*singles[: RULES.naming.gated], *scene.differences(place)[: RULES.naming.gated]):
        table, _ = curve(scene, place, over, what, False, beside)
        one = replace(table, law="proportional", points=0, fixed=table.fixed[:2])
        yield one, most / float(abs(scene.joined(over, what, beside)).max()), f", in proportion to {one.goes_with}"


def events(
    scene: Scene, added: Insert, most: float, in_words: str, edges: Sequence[np.ndarray], runs: Sequence[int]
) -> Iterator[tuple[int, Guess, int, int]]:
    """A shift between two times of a run, by the places of these among the edges: (run, guess, first, last)."""
    a, since, until = (f"{scene.prefix}.{name}" for name in ("a", "since", "until"))
    label = words("event", replace(added, over="")) + in_words
    for i, times in zip(runs, edges):
        end = float(times[-1])
        for j, k in combinations(range(len(times)), 2):
            numbers = [Number(a, a, 0.0, -most, most, run=i)]
            numbers.append(number(since, float(times[j]), 0.0, end))
            fixed = added.fixed
            if k < len(times) - 1:
                numbers.append(number(until, float(times[k]), 0.0, end))
            else:
                fixed += (("until", FAR),)
            yield i, Guess(EVENT, "event", label, (replace(added, fixed=fixed),), tuple(numbers)), j, k


def shifted(guess: Guess, at: dict[str, float]) -> Iterator[dict[str, float]]:
    """An event with an end half a stretch away: where what it adds is about 0 a fit cannot pass."""
    for n in guess.numbers[1:]:
        for by in (-0.5, 0.5):
            yield at | {n.name: float(np.clip(at[n.name] + by * n.high / RULES.naming.edges, n.low, n.high))}


def overflow(
    scene: Scene, first: Insert, knots: np.ndarray, second: Insert
) -> Iterator[tuple[Guess, dict[str, float], tuple[str, str], np.ndarray]]:
    """A limit over what an FMU gives that takes something away before it, and hands a surplus on to another FMU.

    first, second: tables of that variable at both places. As of `laws`: (guess, shapes, amplitudes, the limit at the knots).
    """
    low, high = float(knots[0]), float(knots[-1])
    a, level, on = f"{scene.prefix}.a", f"{scene.prefix}.l", f"{scene.prefix}_on"
    both = tuple(
        replace(one, name=name, law="limit", points=0, fixed=one.fixed[:2]) for one, name in ((first, scene.prefix), (second, on))
    )
    label = f"overflow of {first.goes_with}: from {first.place} on to {second.place}"
    acts = {level: {level: 1.0, f"{on}.l": 1.0}}
    for share in RULES.naming.limits:
        at = low + share * (high - low)
        heights = _heights("limit", {"l": at}, "a", knots)
        if not heights.any():
            continue
        reach = RULES.naming.stiff * RULES.naming.reach
        most = [reach * scene.spread(one.place) / float(heights.max()) for one in both]
        numbers = (
            number(a, 0.0, -most[0], most[0]),
            number(level, at, low, high + RULES.naming.beyond * (high - low)),
            number(f"{on}.a", 0.0, -most[1], most[1]),
        )
        yield Guess(LAW, "overflow", label, both, numbers, acts), {level: at}, (a, f"{on}.a"), heights


def brims(scene: Scene, guess: Guess) -> Iterator[dict[str, float]]:
    """Where else a limit before an FMU may begin: at any height, as one that takes away all that comes in at its highest."""
    if guess.law not in ("limit", "overflow") or guess.place is None or guess.place.where != IN or not guess.plain:
        return
    x = scene.joined(*guess.over)
    most = float(abs(scene.signal(guess.place)).max())
    a, level, *others = guess.numbers
    for share in RULES.naming.brims:
        at = float(x.min()) + share * float(np.ptp(x))
        if share < 1.0:
            steep = float(np.clip(-most / (float(x.max()) - at), a.low, a.high))
            yield {a.name: steep, level.name: at} | {n.name: -RULES.naming.surplus * steep for n in others}


def overflows(scene: Scene, one: Insert, other: Insert) -> bool:
    """Whether what a table goes with may overflow from its place on to that of another table."""
    component = scene.parts.owner(one.place.variable)
    return (
        one.place.where == other.place.where == IN
        and not one.multiplies
        and not other.multiplies
        and one.over == other.over
        and one.taken == other.taken == law.VALUE
        and one.over in scene.parts.variables
        and scene.parts.variables[one.over].causality == "output"
        and scene.parts.owner(one.over) == component != scene.parts.owner(other.place.variable)
    )
