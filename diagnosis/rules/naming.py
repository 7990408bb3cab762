"""Naming what any system lacks: where guesses are looked for first, how many are fitted, and when one is believed."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import rule

TIME = "a limit of time; not studied"
GRID = "where fits start; they go on from there. Not studied beyond the hidden plants of the tests"


@dataclass(frozen=True)
class NamingRules:
    # --- what runs: naming.run
    halved: int = rule(3, "times that the system's step is halved where the model moves with it, at most", TIME)
    coarse: float = rule(
        0.14,
        "share of an output's noise by which half the steps move it from which on they are taken",
        "theory: of an error that falls with the step twice as much is left, 4 % of noise and error together, search.relevant",
    )
    at_once: float = rule(
        0.625,
        "share of what an FMU answers in a step, its inputs held, that is there after a quarter of it: it acts once a step",
        "theory: of what moves by a state a quarter, of what is computed all; between the two",
    )
    settles: float = rule(
        0.75,
        "share of what half the steps change of an FMU alone that a quarter of them must change again for it to act once a step",
        "theory: errors that fall with the step fall to a half or less; what goes by the count of steps, not at all",
    )
    other_system: float = rule(
        0.1,
        "share of an output's spread that finer steps may move it by for rivals to be fitted in the rig's own steps",
        "not studied; what is held against the noise is ten times as small in all hidden plants of the tests",
    )

    # --- what is looked at: naming.guesses
    glance: int = rule(4_500, "samples of all runs that hypotheses are looked at and compared on, at most", TIME)
    glance_longer: int = rule(20_000, "the same where what lies behind leaves more than they do", TIME)
    later: float = rule(
        1.3,
        "times the error of the heads of the runs that what lies behind them leaves, from which on it is looked at",
        "not studied; where nothing happens it is 1",
    )
    variables: int = rule(14, "variables that a law at one place may go with, at most", TIME)
    pairs: int = rule(12, "differences and products of two variables that a law at one place may go with, at most", TIME)
    same: float = rule(
        0.9995, "correlation from which on two laws of a variable are the same", "theory: nothing tells them apart"
    )
    same_variable: float = rule(0.995, "the same of two variables", "not studied; sums over steps drift")
    knots: int = rule(
        17,
        "points of a free curve, straight between them, at most",
        "theory: of three waves over the variable's range straight lines between them leave less than half a percent",
    )
    read_again: int = rule(
        4,
        "times that when outputs were read and the model's numbers are fitted in turn",
        "theory: each time a part of what is left",
    )
    goes_beyond: float = rule(
        0.02,
        "share of what judges that lies beyond a curve's points from which on that is told",
        "not studied; it decides nothing",
    )
    coarser: int = rule(
        5, "points of a curve from which on it is also asked for with every second", "theory: below that it is a line"
    )
    knot_gap: float = rule(0.02, "share of the variable's range that knots lie apart, at least", "not studied")
    unit: float = rule(
        1e-3,
        "share of a place's spread that is added for a linear look",
        "theory: digits of a double, and small beside the signal",
    )
    unchanged: float = rule(
        0.01,
        "share by which two answers to a step at different times of a run may differ, and one stands for all",
        "theory: of slopes by differences the last digits are noise; a look ranks, and fits decide",
    )
    least_spread: float = rule(
        0.1, "share of a signal's size that its spread is taken for, at least", "of a signal that hardly varies; not studied"
    )
    reach: float = rule(
        3.0, "times a place's spread that a law may add to it, or times it that a law may multiply it, at most", GRID
    )
    stiff: float = rule(30.0, "times that reach of a limit and of a dead band, which may be hard", GRID)
    powers: tuple[float, ...] = rule((0.3, 1.5, 2.5, 4.0), "exponents of a power that are looked at", GRID)
    widths: tuple[float, ...] = rule(
        (0.02, 0.1, 0.3), "widths, as shares of a variable's size, within which friction turns round", GRID
    )
    dying: float = rule(
        3.0,
        "times the width of a Coulomb law within which what Stribeck adds dies away, where a fit of it begins; and so on, up to the "
        "variable's size",
        GRID,
    )
    bands: tuple[float, ...] = rule((0.1, 0.3, 0.6), "the same of dead bands and hystereses", GRID)
    rates: tuple[float, float, int] = rule(
        (0.9, 0.01, 8),
        "largest and least rate of a limited signal, over the fastest that it has, and how many between that are looked at",
        "theory: a command in stairs has its fastest rate in a single step, far above any that limits it",
    )
    dead: tuple[float, float, int] = rule(
        (0.02, 0.6, 9),
        "least and largest dead zone of a path, over the signal's size, and how many between that are looked at",
        "theory: between two of them the nearer is off by less than a quarter, and leaves 6 % of what the right one takes",
    )
    limits: tuple[float, ...] = rule((0.3, 0.5, 0.7, 0.85, 0.95), "shares of a variable's range at which a limit may begin", GRID)
    beyond: float = rule(
        0.5,
        "share of a variable's range, as the base has it, beyond which no limit is looked for",
        "not studied; without the limit the base lies lower",
    )
    brims: tuple[float, ...] = rule(
        (0.25, 0.5, 0.75), "shares of a variable's range at which a brim may lie, beyond which all that comes in is lost", GRID
    )
    surplus: float = rule(0.1, "share of what a brim takes away that goes on elsewhere, at first", GRID)
    clipped: tuple[float, ...] = rule((0.99, 0.9, 0.75), "quantiles of a signal at which it may be cut off", GRID)
    late: tuple[int, ...] = rule((1, 2, 4, 8, 16, 32, 64, 128), "steps by which a path may be late", GRID)
    latest: float = rule(0.1, "share of the longest run that a path may be late by, at most", GRID)
    counts: tuple[float, float] = rule((0.1, 1.2), "least and largest steps of a rounded signal, over its spread", GRID)
    counted: float = rule(
        0.1,
        "steps of the largest value by which the numbers of steps in it that are looked at lie apart",
        "theory: values are then no more than a twentieth of a step from where they would be told, and a fortieth count otherwise",
    )
    gathered: int = rule(5, "steps that a recorded signal gathers at that are looked at, those where it does so most", TIME)
    simulated: int = rule(
        20,
        "roundings of a place, those that look best by how outputs answer, that are simulated where answers change as a run goes on",
        TIME,
    )
    on_steps: float = rule(
        0.5,
        "mean of cos(2 pi y / q) of values that just passed to another number of steps, from which on they were rounded to q",
        "theory: 0 of what lies anywhere, below where a slow one passes a border, 1 of what is rounded; of noise beyond it, a fifth of a step, borders cut some off",
    )
    no_chance: float = rule(
        5.0,
        "deviations of that mean by chance, of so many values, that it must exceed",
        "theory: of a thousand steps that are looked at none does so by chance",
    )
    roundings: int = rule(
        10,
        "roundings between two that are looked at that are simulated around one that a fit starts from",
        "theory: of fifty levels that lie evenly a quarter of one counts otherwise from one to the next",
    )
    waves: tuple[float, ...] = rule((1.0, 2.0, 4.0), "waves in a turn of an angle that are looked at", GRID)
    fastest: float = rule(4.0, "steps that a further state takes, at least", GRID)
    slowest: float = rule(0.3, "share of the longest run that it takes, at most", GRID)
    times: int = rule(
        8,
        "times between these two, even in their logarithm, that are looked at",
        "theory: of 500 rows the nearer of two is off by less than a half, and a state that late differs by a tenth",
    )
    off_by: float = rule(4.0, "times itself by which a number of an FMU may be off", GRID)
    decades_of_nothing: tuple[int, int] = rule(
        (-6, 7), "powers of ten, as range has them, of which a number that is 0 and has no ends is tried until it is felt", GRID
    )
    edges: int = rule(12, "stretches of a run between which an event may begin and end", GRID)
    gated: int = rule(3, "variables, and differences of two, that an event may be in proportion to, at most", TIME)
    edge_runs: int = rule(4, "runs in which events are looked for, at most", TIME)
    degenerate: float = rule(
        1e-3,
        "share of a free curve's largest effect below which a direction of it is the base's own",
        "theory: slopes by differences are no better",
    )

    one_block: float = rule(
        0.5,
        "share of all that a number of the base moves which lies in one block, from which on no other block is asked for it",
        "of where a run begins it is nearly 1, of a parameter one over the blocks; between the two",
    )

    away: float = rule(
        1e6,
        "times its unit by which an output is off where a run counts as one that broke off",
        "a guard: squares of it are still numbers",
    )

    # --- what is fitted and believed: naming.contest
    lasts: float = rule(
        0.37,
        "autocorrelation of the base's errors below which they are over; blocks are no shorter than that",
        "theory: 1/e, the usual correlation time; 0.1 was taken first, and changed while the cascaded tanks were looked at",
    )
    curves: int = rule(2, "free curves that are fitted, those that look best", TIME)
    fits: int = rule(8, "other hypotheses that are fitted, those that look best", TIME)
    fits_derived: int = rule(
        3,
        "the same of what multiplies, or goes with rates, integrals, times since a turn; and of what goes with two variables",
        TIME,
    )
    of_place: int = rule(4, "laws of the best curve's variable at its place that are fitted in any case", TIME)
    promising: float = rule(
        0.15,
        "share of the best look's gain below which nothing is fitted but limits, which are far from what a look can see",
        TIME,
    )
    of_law: int = rule(1, "places of each law, path and so on that are fitted in any case, those that look best", TIME)
    overflows: int = rule(6, "overflows that are fitted in any case, those that look best", TIME)
    of_path: int = rule(3, "the same of each path, and of numbers of FMUs: before and behind a linear FMU most look alike", TIME)
    as_much: float = rule(
        0.9,
        "share of what the best rival takes away that one of fewer numbers must take away to do as well: few blocks tell little apart",
        "not studied; the tanks' first half was looked at when it was brought in, their second half judges",
    )
    likely: int = rule(
        6, "places and variables of the best law, of what its FMU has, that are fitted where they look nearly as good", TIME
    )
    vetoed: int = rule(3, "rivals in a round that the data that judge may refuse, one after the other", TIME)
    starts: int = rule(1, "ways to begin, those that look best, from which a hypothesis is fitted", TIME)
    starts_limit: int = rule(2, "the same of one with a limit, which a fit hardly crosses", TIME)
    shifted: int = rule(2, "events whose ends are shifted and fitted again, those that predict most", TIME)
    retold: int = rule(4, "times that a log is told anew for a rival, for as long as that moves it, at most", TIME)
    polished: int = rule(4, "rivals that are fitted again with slopes of their own, those that predict most", TIME)
    events: int = rule(3, "the same of events that look best", TIME)
    by_fit: int = rule(10, "the same of those that fit most", TIME)
    bent: float = rule(
        0.05,
        "share of the base's loss that a limit or an overflow takes off from which on it is fitted so from all its starts",
        "not studied: where a law is bent slopes learnt from steps say little",
    )
    in_reach: float = rule(
        0.5,
        "share of what the best that has a name takes off the loss that such a rival must take off",
        "not studied; the winner must take nine tenths of it, as_much, with slopes that were not its own before",
    )
    beside: int = rule(2, "times that what looks as good as the best, or the same, is asked for and fitted beside it", TIME)
    effort: int = rule(15, "steps of a fit of a hypothesis, at most", TIME)
    ended: tuple[float, float] = rule((1e-3, 1e-3), "relative change of loss, and of values, that ends it", TIME)
    rounds: int = rule(2, "causes, one after another, at most", TIME)

    enough: float = rule(
        0.8, "share of the time limit after which nothing more is looked at: the answer and its report need the rest", TIME
    )
    closer: int = rule(
        3, "rivals that leave less than a cause with more numbers, that are told beside it, at most", "a limit of lines"
    )
    broken: float = rule(0.2, "share of simulations that broke off from which on that is told", "not studied")

    # --- what is one thing by several names: naming.same
    tried: int = rule(4, "inputs that are drawn, beside the log's own, under which the same must do the same", TIME)

    # --- what is run again: naming.extend
    again: int = rule(60_000, "steps of the extended system that are run again with the FMUs themselves, at most", TIME)
    agrees: float = rule(
        1e-3,
        "share of its error by which it may miss what was promised, and agrees",
        "theory: digits of two ways to the same numbers",
    )
