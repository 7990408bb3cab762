"""In which order what does alike is believed, and what stands beside the first of it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

from ..rules import RULES
from ..search.candidate import worse
from ..systems.parts import Parts
from .guesses import CURVE, DERIVED, LAW, PAIRS, PARAMETER, PLAIN, Guess

if TYPE_CHECKING:
    from .round import Rivalled, Round


def beside(winner: Rivalled, order: Sequence[Rivalled], level: float, base: float) -> list[Rivalled]:
    """What does as well as the winner, with no more numbers; of curves with any: blocks that they did not see asked for these."""
    return as_good(winner, order, level, base, len(winner.candidate.free))


def as_good(winner: Rivalled, order: Sequence[Rivalled], level: float, base: float, count: int) -> list[Rivalled]:
    """What does as well as the winner, with no more than so many numbers, or as a curve."""
    least = RULES.naming.as_much * (base - winner.candidate.errors.mean())
    few = lambda r: r.guess.kind == CURVE or len(r.candidate.free) <= count
    near = [r for r in order if r is not winner and few(r) and base - r.candidate.errors.mean() >= least]
    return [r for r in near if not worse(r.candidate, winner.candidate, level)]


def curves_beside(curve: Rivalled, fitted: Sequence[Rivalled], level: float, base: float) -> list[Rivalled]:
    """Free curves over something else, or elsewhere, that do as well as this one, each once: finer or coarser it is itself."""
    where = lambda r: (r.guess.place, r.guess.over, r.guess.inserts[0].multiplies)
    of = {where(r): r for r in reversed(fitted) if r.guess.kind == CURVE and not r.candidate.doubt and where(r) != where(curve)}
    return beside(curve, list(reversed(of.values())), level, base)


def names_of(curve: Rivalled, order: Sequence[Rivalled], level: float) -> list[Rivalled]:
    """Laws of a curve's variable at its place that predict as well as it does, those of fewest numbers first."""
    what = lambda r: (r.guess.place, r.guess.over, [one.multiplies for one in r.guess.inserts])
    mine = [r for r in order if r.guess.kind == LAW and what(r) == what(curve) and not worse(r.candidate, curve.candidate, level)]
    return sorted(mine, key=lambda r: (len(r.candidate.free), r.candidate.errors.mean()))


def ordered(real: list[Rivalled], level: float, base: float, far: Callable[[Guess], tuple[bool, bool]]) -> list[Rivalled]:
    """The real ones in the order in which they are believed: the fewest numbers of those that are no worse than the best.

    Of as many numbers one that an FMU has comes first: nothing must be there beside what is. Then what needs no more than its
    own FMU knows: for a law of what another has there would have to be a path between them that the system does not have, too.
    Then what acts on an FMU that does not only compute.
    """
    if not real:
        return []
    best = real[0].candidate
    least = RULES.naming.as_much * (base - best.errors.mean())
    as_good = [r for r in real if base - r.candidate.errors.mean() >= least and not worse(r.candidate, best, level)]
    as_good.sort(key=lambda r: (len(r.candidate.free), r.guess.kind != PARAMETER, far(r.guess), r.candidate.errors.mean()))
    return as_good + [r for r in real if r not in as_good]


def believe(outcome: Round, far: Callable[[Guess], tuple[bool, bool]]) -> None:
    """Put the named ones that are real in the order in which they are believed; what was asked later must be better."""
    named = [r for r in outcome.fitted if not r.candidate.doubt and r.guess.kind != CURVE]
    base = outcome.base.errors.mean()
    for stage in (PLAIN, DERIVED, PAIRS):
        later = ordered([r for r in named if r.guess.stage == stage], outcome.chance_level, base, far)
        if later and (not outcome.order or worse(outcome.order[0].candidate, later[0].candidate, outcome.chance_level)):
            outcome.order = later + outcome.order
    if outcome.order:
        outcome.winner = outcome.order[0]


def only_beside(outcome: Round) -> None:
    """Where one curve leaves no more than noise, without what is neither a law of its variable at its place nor does as well.

    What is missing acts there: an event of a house's wall that left ten times the noise was held against the data that judge,
    with three overflows, and fitted to all that teaches five times.
    """
    if outcome.only is None or outcome.curve is None:
        return
    base = outcome.base.errors.mean()
    least = RULES.naming.as_much * (base - outcome.curve.candidate.errors.mean())
    for rival in outcome.order:
        there = rival.guess.kind == LAW and rival.guess.goes == outcome.only and len(rival.guess.inserts) == 1
        if not there and base - rival.candidate.errors.mean() < least:
            rival.candidate.doubt = "what is missing goes with one variable at one place, where a curve leaves no more than noise"
    outcome.order = [rival for rival in outcome.order if not rival.candidate.doubt]
    outcome.winner = outcome.order[0] if outcome.order else None


def curve_of(
    fitted: Sequence[Rivalled], level: float, far: Callable[[Guess], tuple[bool, bool]], parts: Parts
) -> Rivalled | None:
    """The free curve that predicts most, of variables as they are unless others are better beyond what varies."""
    found: Rivalled | None = None
    for stage in (PLAIN, DERIVED, PAIRS):
        real = [r for r in fitted if r.guess.kind == CURVE and r.guess.stage == stage and not r.candidate.doubt]
        if real and (found is None or worse(found.candidate, real[0].candidate, level)):
            found = nearest(real, level, far, parts)
    return found


def nearest(curves: list[Rivalled], level: float, far: Callable[[Guess], tuple[bool, bool]], parts: Parts) -> Rivalled:
    """Of curves, of which the first predicts most, that of those which do as well that is nearest to what moves.

    Of as near ones that over what has a start, as a level: what an FMU computes of that, as its flow, tells the same.
    """
    best = curves[0].candidate
    alike = [r for r in curves if not worse(r.candidate, best, level)]
    return min(alike, key=lambda r: (far(r.guess), computed(r.guess, parts), r.candidate.errors.mean()))


def with_names(found: Sequence[Rivalled]) -> list[Rivalled]:
    """Rivals that have a name and whose fit broke off nowhere."""
    return [r for r in found if r.guess.kind != CURVE and r.end.misfit is not None]


def fits_best(found: Sequence[Rivalled]) -> Rivalled | None:
    """The rival with a name that fits best."""
    return min(with_names(found), key=lambda r: r.end.loss, default=None)


def leading(
    found: Sequence[Rivalled],
    takes: Callable[[Rivalled], float],
    left: Callable[[Rivalled], float],
    far: Callable[[Guess], tuple[bool, bool]],
) -> list[Rivalled]:
    """Rivals that have a name beside which other steps are asked for: what takes most off the loss, and what leaves least over the noise.

    And, where it does nearly as well, what takes most before an FMU that does not only compute: before what acts once a step a
    law is as it is in any steps of the others. A friction that turns round within one was named at a controller's reading of it.
    """
    fitted = with_names(found)
    most = max(fitted, key=takes, default=None)
    if most is None:
        return []
    moving = [r for r in fitted if not far(r.guess)[1] and takes(r) >= RULES.naming.as_much * takes(most)]
    return list({id(r): r for r in (most, min(fitted, key=left), *sorted(moving, key=takes)[-1:])}.values())


def far(guess: Guess, parts: Parts, sampled: Collection[str]) -> tuple[bool, bool]:
    """Whether a law goes with what its FMU does not know; whether that FMU only computes, and passes on what others move by.

    Before what acts once a step a law does what it does behind it, but for what is computed of it: nature acts where there is
    a state.
    """
    computed = guess.kind in (LAW, CURVE) and guess.place is not None and parts.owner(guess.place.variable) in sampled
    return foreign(guess, parts), computed


def foreign(guess: Guess, parts: Parts) -> bool:
    """Whether its law goes with what the FMU that it acts on is not given and does not give."""
    owner = lambda name: parts.owner(name) if name in parts.variables else ""
    return any(owner(name) != owner(one.place.variable) for one in guess.inserts[:1] for name in (one.over, one.beside) if name)


def computed(guess: Guess, parts: Parts) -> bool:
    """Whether its law goes with what an FMU gives and has no start for: that is computed of what has one."""
    known = [parts.variables[name] for name in guess.over[::2] if name in parts.variables]
    return any(v.causality == "output" and v.initial not in ("exact", "approx") for v in known)


def distinct(rivals: Sequence[Rivalled]) -> list[Rivalled]:
    """Of each guess the end that fits best, whatever unseen blocks say of it; those that predict most come first."""
    best: dict[str, Rivalled] = {}
    for rival in rivals:
        label = rival.guess.label
        if label not in best or rival.end.loss < best[label].end.loss:
            best[label] = rival
    return sorted(best.values(), key=lambda r: r.candidate.errors.mean())
