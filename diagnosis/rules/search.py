"""Hypotheses, the first look, fits, steps and what is believed."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import developed, rule

FIRST = developed("the contest of hypotheses over them")
AMOUNTS = developed("the reducer FMU on a measured motion with its known load; rigs of the four measured drives")
CLOSER = developed("Amounts of a threshold are tried closer around the best")
END_TO_END = developed("contest, gain on held-out data, blame, remainder and result file end to end")
RECORDERS = "what encoders, tachos, filters and multiplexed converters of drives are sold with; not studied"
LONG = "long logs are fitted on stretches, then once on the whole"
NONLINEAR = developed("A whole drive is far from linear: fits start from small amounts of all numbers")
GUESSES = developed("luck of the folds is no gain")


@dataclass(frozen=True)
class SearchRules:
    # --- what a fit may change: search.hypotheses
    nominal_factor: float = rule(5.0, "a nominal value may be off by this factor", FIRST)
    nominal_zero: float = rule(1e3, "bounds of what is nominally 0 and has no bounds of its own", FIRST)
    untold: tuple[float, float] = rule(
        (1000.0, 10.0),
        "what no data sheet says and an effect frees is searched down to a 1000th and up to 10 times its usual value",
        developed("the extended FMUs run again under FMPy") + ". A time constant may be anything",
    )
    periods: tuple[int, int] = rule((2, 40), "samples of the sampling periods that are tried", AMOUNTS)

    # --- when set-points jumped: search.instants
    jump_places: int = rule(
        5,
        "places within its row at which a jump is tried, evenly, and then half as far to both sides of the best",
        "a limit of time",
    )
    jump_shows: float = rule(0.3, "s after a jump by which its instant is told", "not studied")
    jump_wild: float = rule(
        1e4, "square of an error, in those of its channel's noise, from which on it counts no more", "not studied"
    )

    tick_places: int = rule(
        8, "places within its period at which a controller's acts are tried, and then three times half as far", "a limit of time"
    )

    # --- an output shaft of which the rig says nothing: search.swings
    shaft_swings: int = rule(11, "swings of it that are tried, the fastest that is simulated and slower ones", "a limit of time")
    shaft_slower: float = rule(
        1.414,
        "times by which each is slower than the one before",
        "theory: a swing is seen to its width, and fits go on from there",
    )
    shaft_damped: tuple[float, ...] = rule(
        (0.05, 0.1, 0.2, 0.5),
        "shares of critical damping that each is tried with",
        "of steel some percent, of a gear's teeth and grease more; not studied",
    )
    shafts_fitted: int = rule(3, "of these that are fitted, the best first, until one leaves only noise", "a limit of time")
    shaft_about: float = rule(
        3.0,
        "times by which a fit of stiffness and damping may go away from where it starts",
        "theory: more than to the next that is tried",
    )

    # --- free laws inside a whole drive, which rival all causes: search.freely
    free_apart: float = rule(0.01, "share of its variable's range by which knots are apart at least", "not studied")
    free_ridges: tuple[float, ...] = rule(
        (0.001, 0.01, 0.1),
        "shares of what all blocks know of a height that hold it back; what predicts most of unseen blocks",
        "not studied",
    )
    free_steps: tuple[float, ...] = rule(
        (1.0, 0.3, 0.1), "shares of a Gauss-Newton step of one that are tried, until one helps", "a limit of time"
    )
    free_fits: int = rule(2, "free laws that are fitted, those that look best", "a limit of time; not studied")

    # --- what recorders do, and is no cause: search.hypotheses.recorder
    latest: float = rule(
        2e-3,
        "s that a channel may be read late beside one step of the log; a step early, for a row may be stamped before",
        RECORDERS,
    )
    differenced: int = rule(20, "steps of the log over which a speed may be a difference of angles, at most", RECORDERS)
    slowest_filter: float = rule(0.010, "s, the longest time constant of a speed's filter", RECORDERS)
    shift_places: int = rule(
        13, "times of a channel's shift, evenly over its range, of which the best is where fits begin", "a limit of time"
    )
    window_start: float = rule(0.25, "steps over which a converter's mean is first taken to go", RECORDERS)
    filter_start: float = rule(5e-4, "s from which a fit of it starts: at 0 it has no slope", RECORDERS)
    tacho_ripple: float = rule(0.02, "largest relative ripple of a tacho", RECORDERS)

    # --- the first look: search.screen
    per_decade: int = rule(2, "values tried in a decade of a parameter that shapes an effect", FIRST)
    decades_from: float = rule(30.0, "ratio of its bounds from which on a range is tried by decades", FIRST)
    lowest: float = rule(1e-4, "share of the upper bound from which on decades are counted", FIRST)
    places: int = rule(5, "places in another range, its ends among them, which are not tried", FIRST)
    probes: int = rule(3, "of the values tried, those that tell whether a parameter shapes an effect, about", FIRST)
    narrow: float = rule(2.0, "ratio of its bounds below which a parameter is no question", FIRST)
    highest_order: int = rule(64, "waves in a turn are looked for up to this number", FIRST)
    waves: int = rule(
        3, "waves in a turn of a shaft that a whole drive is simulated with: a look at the error chooses them", "a limit of time"
    )
    starts_by_channel: int = rule(12, "the same of a whole drive compared in all its channels", "a limit of time; not studied")
    most_starts: int = rule(40, "combinations of shapes tried for one way of acting, orders apart", "a limit of time; " + FIRST)
    leading: float = rule(10.0, "difference steps that an amplitude is switched on by, while shapes are looked for", FIRST)
    alone: float = rule(1e-9, "share of the misfit that an amplitude at its nominal value may move it by", FIRST)
    unfelt: float = rule(1e-12, "share of the misfit below which a parameter does not act", FIRST)
    proportional: float = rule(0.2, "share by which twice the amount may miss twice the change", FIRST)
    bend_at: float = rule(
        0.3, "share of the way to its bounds at which a parameter is asked whether it acts in proportion", AMOUNTS
    )
    bend: float = rule(0.25, "share of the change (of squares) by which it may miss proportion", AMOUNTS)
    jumps: int = rule(11, "amounts tried of a parameter that acts only from a finite amount on", AMOUNTS)
    jumps_by_channel: int = rule(6, "the same of a whole drive compared in all its channels", "a limit of time; not studied")
    closer: int = rule(3, "times that such amounts are tried closer around the best", CLOSER)
    closer_by: float = rule(3.0, "by which factor closer each time", CLOSER)

    excerpt_alike: float = rule(
        0.1,
        "share (root mean square) by which what a hypothesis does to stretches computed by themselves may miss what it does to the "
        "whole log; beyond it is looked at there",
        "a look chooses what is fitted, by gains that differ more; not studied",
    )

    # --- fits: search.fit, search.problem
    loss_scale: float = rule(
        3.0, "deviations of noise from which on a misfit counts less than its square (soft_l1), at least", FIRST
    )
    loss_median: float = rule(2.0, "the same in medians of the absolute misfit", FIRST)
    effort: int = rule(25, "simulations of a fit, Jacobians apart, at most", "a limit of time; " + FIRST)
    effort_first: int = rule(15, "the same before the noise is known", "a limit of time; " + FIRST)
    effort_begin: int = rule(
        8, "the same of a hypothesis about a whole drive, before it is known which are worth more", "a limit of time; not studied"
    )
    behind: float = rule(
        2.0,
        "times the least loss of these first fits from which on a hypothesis is fitted no further",
        "a limit of time; of 25 fits of development seed 10 613 what was fitted after that took away a quarter at most",
    )
    effort_recorders: int = rule(
        8, "the same in which what recorders did is fitted with the rest, once the rest is", "a limit of time; not studied"
    )
    effort_last: int = rule(8, "the same in the last fit over all samples", f'a limit of time, with "{LONG}"')
    start_places: int = rule(
        2,
        "places of each uncertain value's range, beside the value given and the middle, from which the nominal drive is fitted",
        "a limit of time; not studied",
    )
    ends_alike: float = rule(
        0.01,
        "share by which a value may miss the best fit's, beyond its interval, and is the same: a fit ends before; of a whole "
        "drive, by which its loss must be lower than from the start given",
        "not studied; of whole drives brought in when the search over the measured servo was seen to turn on small changes of its base",
    )
    at_bound: float = rule(
        0.1,
        "standard errors from the end of its range within which an uncertain value is at it, and no more than `at_end` of the range",
        "not studied; it tells, and decides nothing",
    )
    collinear_index: float = rule(
        30.0,
        "condition index of the Jacobian's columns beyond which values cannot be told apart",
        "theory: Belsley, Kuh and Welsch (1980), Regression Diagnostics, chapter 3",
    )
    collinear_share: float = rule(
        0.5,
        "share of a value's variance that such a combination must bear for the value to be one of them; and that two values "
        "must share for their correlation to be told",
        "theory: as above",
    )
    tolerances: tuple[float, float] = rule((1e-6, 1e-5), "relative change of the loss, and of the values, that ends a fit", FIRST)
    tolerances_whole: tuple[float, float] = rule((1e-4, 1e-4), "the same of a whole drive", NONLINEAR)
    flat: float = rule(1e-8, "gradient that ends a fit", "scipy's own value")
    difference: float = rule(1e-3, "share of its scale by which a parameter is moved for a derivative", FIRST)
    range_scale: float = rule(0.02, "share of its range that is a parameter's scale, at least", FIRST)
    inside: float = rule(1e-9, "share of its scale by which a fit starts inside its bounds", FIRST)
    singular: float = rule(1e-10, "share of the largest singular value below which a direction is not determined", END_TO_END)
    interval: float = rule(1.96, "standard errors to either side of a value: a 95 % interval", "theory: Φ⁻¹(0.975)")
    ridge: float = rule(1e-8, "added to normal equations of columns of length 1, so that they can be solved", FIRST)

    # --- the phase of a wave in each run: search.phases
    phase_blocks: int = rule(
        2,
        "blocks of each run without which all runs share a phase: of a run that is one block no other tells it",
        "the least with which a phase can be judged on what it was not fitted to",
    )
    phase_places: int = rule(
        8, "phases at which a run is simulated to find its own", "theory: two harmonics need five; not studied beyond"
    )
    phase_damping: float = rule(
        0.1,
        "share of a run's usual energy of a wave below which, at the first look, it hardly says what phase it has",
        "a run that goes through a part of a wave alone is no measure of its other half; not studied",
    )
    phase_fine: int = rule(
        720,
        "phases at which what these tell is looked at: to half a degree",
        "an error of a quarter of a degree leaves 2e-5 of a wave's energy",
    )

    # --- blocks not seen: search.problem, search.fit
    folds: int = rule(5, "folds of the blocks that teach; each is judged under the fit to the others", FIRST)
    wild: float = rule(
        1.03,
        "where a linear step leaves so many times more on unseen blocks than the fit itself, it is simulated",
        GUESSES + '; 1.2 before, with "Folds are simulated where a linear step cannot be believed"',
    )
    dampings: tuple[float, ...] = rule(
        (1e-9, 1e-3, 1e-2, 0.1, 1.0),
        "Levenberg-Marquardt's, over columns of length 1: tried where the simulation is far from linear",
        NONLINEAR,
    )

    # --- which hypotheses are fitted: search.step
    fits: int = rule(8, "hypotheses that are fitted in a step, those that look best", "a limit of time; " + FIRST)
    fits_by_channel: int = rule(
        6,
        "the same of a whole drive compared in all its channels, beside what a log shows of itself",
        "a limit of time; not studied",
    )
    begun_by_channel: int = rule(
        16,
        "hypotheses of such a drive that are begun, those that leave least where they begin: what a few steps of a fit leave tells better "
        "which are fitted to their end",
        "a limit of time; not studied",
    )
    starts: int = rule(
        4,
        "sets of free numbers that a hypothesis is fitted with, at most",
        'a limit of time; not studied. First said in "The contest in four files"',
    )
    unfiltered: float = rule(
        0.75,
        "share of what the base leaves that a way of acting must leave at most where it begins without the controller's filter",
        "of three drives of development: two shafts that wind up leave 0.32 and 0.66, a play whose swing no simulation has the phase "
        "of 0.86, and ended at two thirds of itself",
    )
    ways_begun: int = rule(
        6,
        "ways of acting of a hypothesis of such a drive that are simulated where they begin, those that look best",
        "a limit of time",
    )
    starts_whole: int = rule(2, "the same of a whole drive", "a limit of time; not studied")
    turned: int = rule(
        24,
        "phases around a turn from the best of which a wave is fitted again beside another",
        "theory: within an eighth of a radian of any",
    )
    waves_raced: int = rule(
        6, "ways of a wave of a whole drive that are begun, of which the best is fitted", "a limit of time; not studied"
    )
    promising: float = rule(0.5, "share of the best way's gain from which on another way is fitted", FIRST)
    small: float = rule(0.01, "share of its range within which a number of a whole drive starts", NONLINEAR)
    small_look: float = rule(0.1, "share of what the linear look says that it starts from", NONLINEAR)
    threads: int = rule(
        2,
        "hypotheses of a whole drive looked at or fitted at a time, at most",
        "not studied; the machine of the development has two cores",
    )

    # --- what is believed: search.step, search.candidate
    draws: int = rule(199, "draws of what the search finds by chance", FIRST)
    together: int = rule(16, "ways of acting that are tried in these draws together", "a limit of memory; it changes no number")
    significant: float = rule(
        0.02,
        "share of draws in which chance may do as well as a cause",
        FIRST + ". Measured since (docs/diagnosis.md): on two drives it calls 1 and 10 of 60 logs without effect significant",
    )
    chance_quantile: float = rule(
        0.95,
        "quantile of the draws that is told as the chance level: one draw of twenty; a cause of less confidence is marked weak",
        AMOUNTS,
    )
    relevant: float = rule(
        0.04,
        "share by which a cause must lower the error of some residual: smaller gains may be a matter of formulas",
        FIRST + ". Measured since (docs/diagnosis.md): where nothing is hidden 2.2 % are found, which no chance gives",
    )
    shows: float = rule(
        0.01,
        "and that over single samples by this share: averages of many show what smoothing bends, far below the noise",
        developed("A cause must show in samples, not in averages of many alone"),
    )
    clean: float = rule(
        1.08, "a residual whose error is no more than this many times its noise has nothing missing", developed(LONG)
    )
    left: float = rule(1.15, "the same once a cause is found: nature's formula is never exactly ours", GUESSES)
    sound: float = rule(
        1.15,
        "times its noise up to which a channel of a whole drive has nothing missing, before anything is found",
        "not studied on its own: 32 sound drives of seeds 10 700 to 10 715 came to 1.09 in the worst of their channels",
    )
    natural: float = rule(
        1.3,
        "the same once a cause is found: as much is left by a law of the right name whose formula is not nature's",
        "the target of the power studies for what a right answer leaves",
    )
    shows_whole: float = rule(
        0.1,
        "share by which a cause must lower the error of such a channel that is off",
        "not studied; about half of what closing 1.3 to 1 takes",
    )
    closes: float = rule(
        0.7,
        "the same where it is off by less than `natural`, in shares of what brings it to its noise, and of held-out data: no other formula explains it",
        "chosen on seeds 10 621, 10 654 and 10 655: right causes close 0.77 and more, wrong ones 0.67 and less",
    )
    near_best: float = rule(
        1.5,
        "times what the best leaves up to which a whole drive's fits are gone on with, and made again from where they ended",
        "a limit of time; where `behind` was looked at fits took away a quarter at most, 1.33 times what they end with",
    )
    again: int = rule(
        8, "times, at most, that such a fit is made again, while it leaves less by a factor of `alike`", "a limit of time"
    )
    matters: float = rule(0.02, "share of the error's energy by which a rival must be worse to be beaten", GUESSES)
    apart: float = rule(
        1e-3,
        "share of a residual's loss from which on two candidates differ in it",
        developed("Rivals are compared where they differ, not diluted by comparisons that neither touches"),
    )
    spreads: float = rule(
        2.0,
        "standard errors over blocks beyond which a difference is no variation",
        "theory: about 95 % of a normal law; " + FIRST,
    )
    chance_levels: float = rule(2.0, "chance levels beyond which a difference is no variation", AMOUNTS)
    alike: float = rule(1.002, "errors within this factor are equal to the last digits: the same law twice", AMOUNTS)
    same_law: float = rule(0.05, "share of a usual misfit within which two laws are the same", AMOUNTS)
    same_misfit: float = rule(3.0, "a usual misfit: the loss scale over this", AMOUNTS)
    at_end: float = rule(1e-3, "share of its range within which a number is at the end of it", NONLINEAR)

    # --- step after step: search.selection
    most_steps: int = rule(
        4, "steps of the search, at most", developed("a cause may be given more of its numbers in a later round")
    )
    rivals: float = rule(
        0.3,
        "share of the winner's gain from which a rival is tried again beside the causes found later",
        developed("Two causes found together are tried in the place of a first guess and its helpers"),
    )
