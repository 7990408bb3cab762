"""The run to record next: how set-points are drawn, how many are tried, and what counts as told apart."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import rule

TIME = "a limit of time; not studied"
DRAWN = "how wide runs are drawn; what tells models apart best is kept, so it decides little. Not studied"


@dataclass(frozen=True)
class PlanningRules:
    # --- set-points: planning.moves
    slowest: float = rule(0.03, "share of the greatest speed that a style may be as slow as", DRAWN)
    gentlest: float = rule(0.1, "share of the greatest acceleration that a style may be as gentle as", DRAWN)
    shares: tuple[float, ...] = rule(
        (2.0, 0.5, 0.7, 0.3), "of moves, creeping, waves and rests in a style (of a Dirichlet law)", DRAWN
    )
    everywhere: float = rule(0.7, "share of styles that go all the way", DRAWN)
    narrowest: float = rule(0.1, "share of the way to which a style may be confined", DRAWN)
    lengths: tuple[float, float] = rule((0.1, 1.0), "s of a rest; a wave has so many times `periods`", DRAWN)
    periods: int = rule(8, "periods of the longest wave", DRAWN)
    creep: float = rule(0.1, "share of its speed with which a segment creeps", DRAWN)
    resolved: float = rule(10.0, "rows in a quarter of the fastest wave, at least", "theory: a wave of forty rows is one")
    settle: float = rule(
        0.3, "s of rest before the first segment", "what is compared begins behind the settling of a run; not studied"
    )
    segments: int = rule(40, "segments that are drawn; those that no time is left for are left out", DRAWN)
    # --- the search: planning.run
    drawn: int = rule(64, "runs that are drawn", TIME)
    kept: int = rule(4, "of these the best go on", TIME)
    changed: int = rule(64, "times that one of them is changed in places", TIME)
    longest: float = rule(30.0, "s of a planned run, at most, where no duration is given", TIME)
    shortest: float = rule(20.0, "s of it, at least", "moves of every kind take some seconds each; not studied")
    # --- systems of FMUs: naming.plan
    drawn_inputs: int = rule(48, "runs that are drawn for a system of FMUs", TIME)
    models: int = rule(4, "models of a naming that are told apart, at most", TIME)
    held: float = rule(4.0, "rows that a level of an input is held, at least", DRAWN)
    # --- distances: planning.rivals
    difference: float = rule(
        1e-3, "share of a number's range by which it is moved for a slope", "as steep as rounding allows; not studied"
    )
    decided: float = rule(0.95, "probability of being decided from which on a plan is called good", "a level")
    broken: float = rule(
        1e3,
        "times its noise that an entry differs by, at most: where one model breaks down, that is enough",
        "theory: no one doubts it",
    )
