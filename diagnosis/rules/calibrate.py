"""Fitting numbers of others' systems: starts, slopes, when a fit ends, and what is told of each number."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import rule

FAMILIES = "of a fit from a start; not studied beyond the hidden parameters of the tests"


@dataclass(frozen=True)
class CalibrateRules:
    # --- starts: calibration.fit
    scattered: int = rule(
        32,
        "points of all ranges, evenly scattered, that are simulated to find where fits should start",
        "a limit of time; a power of 2 as Sobol's points want it",
    )
    starts: int = rule(5, "fits: from the start given, and from the best of the scattered points", "a limit of time; " + FAMILIES)
    decades: float = rule(
        100.0,
        "times its lowest value that a range above 0 must reach to be gone through in its logarithm",
        "theory: evenly scattered points then lie in every decade",
    )
    effort_start: int = rule(40, "steps of a fit from a start, Jacobians apart, at most", "a limit of time; " + FAMILIES)
    effort_end: int = rule(
        60, "steps of the fit from the best end, in units of what remains, at most", "a limit of time; " + FAMILIES
    )
    rounds: int = rule(2, "times that what remains is taken anew as the unit of each channel", FAMILIES)
    ended_start: tuple[float, float] = rule(
        (1e-4, 1e-4),
        "relative change of the loss, and of the values, that ends a fit from a start",
        "a limit of time; " + FAMILIES,
    )
    ended: tuple[float, float] = rule((1e-8, 1e-8), "the same of the last fits", FAMILIES)
    alike: float = rule(1e-3, "share of its range by which two ends of fits may differ and are the same", FAMILIES)

    # --- slopes of what may jump: calibration.slopes
    difference: float = rule(
        1e-5,
        "share of its scale by which a number is moved for a derivative at first",
        "theory: the cube root of the digits of a double",
    )
    wider: float = rule(10.0, "times by which a difference is widened that jumps hide, or that changes nothing", FAMILIES)
    worse: float = rule(2.0, "times the least of the jumps so far from which on a wider difference helps no more", FAMILIES)
    widest: float = rule(0.1, "share of a number's range that a difference takes, at most", FAMILIES)
    jumps: float = rule(
        0.1,
        "size of the second difference over the first from which on a slope is one of jumps",
        "theory: 0 of a straight line, 1 of a jump to one side; between the two",
    )
    narrower: int = rule(2, "times that a difference is made 100 times smaller where the system fails on both sides", FAMILIES)

    # --- what a log gives: calibration.heard
    heard: float = rule(
        0.5,
        "share of an output's noise from row to row that is left where its component is given what was measured of another's",
        "theory: noise that it heard goes, noise that it did not hear comes in; half lies between, and no fit is asked",
    )

    heard_noise: float = rule(
        0.9,
        "share of an output's noise by fourth differences that is left then, at most",
        "theory: of what a component did not hear more is there, or as much; a tenth for chance",
    )
    felt: float = rule(
        0.9,
        "share of what is missed of the outputs behind an input's spikes that is left with these, at most, where they were there",
        "theory: a number up to twice what it is leaves less with them; of a sample that a recorder spoilt all is more; a tenth for chance",
    )
    felt_rows: int = rule(10, "rows behind a spike in which its answer is looked for", "theory: as a lag of a few rows begins")

    unseen: float = rule(
        3.0, "times what inputs usually do unseen for as long, that they may have done in a gap", "usual: three deviations"
    )
    forgotten: float = rule(
        1e-3,
        "of an output's spread, or its noise if that is more, up to which what inputs did in a gap is forgotten",
        "theory: of a log without noise less is in no picture",
    )

    # --- what is told: calibration.told
    unmoved: float = rule(
        1e-12,
        "share of a channel's spread by which it must change with a number, or the number changes nothing",
        "theory: digits of a double, with room",
    )
    steps_between: float = rule(
        300.0,
        "steps of a system that rows lie apart from which on the rig must say in which unit their times are",
        "theory: ms read as s are 1000, of rows as far apart as three steps or one; the rig says it, and goes on",
    )
    elsewhere: float = rule(
        0.38,
        "of every number's range: the other place about which it is asked whether a number changes anything",
        "no default lies there",
    )
    bound: float = rule(
        1e-3, "share of a range within which a value is at its end", "not studied; it is told, and decides nothing"
    )
    undetermined: float = rule(
        0.5,
        "share of its range that a number's 95 % interval takes from which on the data do not determine it",
        "not studied; it is told, and decides nothing",
    )
    lost: float = rule(
        1e-4,
        "singular value of slopes at length 1, over the largest, below which a direction is not determined",
        "theory: slopes by differences are no better",
    )
    told_correlation: float = rule(0.1, "correlation below which none is told", "as lmfit does")
    still: float = rule(
        2.0,
        "spread of every output over its noise below which a log with resting inputs says nothing",
        "not studied; such a log is refused",
    )
