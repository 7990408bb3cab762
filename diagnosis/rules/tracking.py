"""A fleet, or one drive over months: what counts as a change, and what as chance."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import rule


@dataclass(frozen=True)
class TrackingRules:
    false_names: float = rule(
        0.01,
        "chance that a report on drives that do not change names any change at all, over all units, parameters and places in time",
        "a level: of a hundred such reports one. It is shared among all that is tried (Bonferroni)",
    )
    fewest: int = rule(4, "values of a unit from which on a change is looked for", "theory: two before and two after it")
    beside: int = rule(2, "values on each side of a change", "theory: one alone may be a log that went wrong")
    together: int = rule(
        6, "units from which on what all of them do at once is taken out", "theory: the median of fewer follows one of them"
    )
    polished: int = rule(20, "rounds of the median polish, at most", "a limit of time: it ends where nothing changes any more")
    away: float = rule(
        5.0,
        "times its error by which each unit's usual value is away from 0 for changes to be counted as shares of it",
        "theory: a share of what may as well be 0 is no number",
    )
    wild: float = rule(
        3.0, "times its deviation from which on a value does not tell the scatter; what a normal law loses by it is given back",
        "theory: one normal value in 370 is as far",
    )  # fmt: skip
    little: float = rule(
        1.5,
        "times as far as among many logs from which on it is told how far a change has to be beyond chance",
        "a remark alone, which decides nothing",
    )
    freedom: float = rule(
        18 / 35,
        "degrees of freedom of the scatter for each value beside its neighbours",
        "theory: of second differences of even values of a normal law (Gasser, Sroka and Jennen-Steinmetz 1986)",
    )
    places: int = rule(200, "moments of a unit at which a change is looked for, at most", "a limit of time")
