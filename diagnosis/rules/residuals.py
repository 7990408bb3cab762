"""Comparisons, their samples and smoothing, and their noise."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import developed, rule

FIRST = developed("Logs and rigs are read, checked for faults and cut into component replays")
REPLAYED = developed("the reducer FMU on a measured motion with its known load; rigs of the four measured drives")
WHOLE = developed("Whole drives in closed loop, per-log parameters, speeds against angles, motions and torques filtered alike")
NOISE = developed("The noise floor of held, quantised and steady channels, held to noise that is known")
WAVES = developed("A fast wave no longer passes for noise")
CLOSED = developed("The whole drive in closed loop is compared with every channel as its recorder reads it")
PERIODS = (
    "20 recorded voltages, a third of them of controllers with periods of 8 to 20 ms (development seeds 10 700 to 10 706): these stood 15 "
    "times and more above the median near them, all else, as what noise reaches in so many places, 6 times at most. Of 15 others (10 760 "
    "to 10 764) all five periods were read right, and one faster than a row as its beat with the rows"
)
LEAN = "An hour of log in lean memory"


@dataclass(frozen=True)
class ResidualRules:
    # --- blocks and bins: residuals.blocks
    blocks: int = rule(36, "blocks that all runs together are cut into, about", FIRST)
    shortest_block: int = rule(20, "samples of a block, at least", FIRST)
    bins: int = rule(
        250, "averages kept of each block, at most", FIRST + ". What is left of noise then is small, and fits are fast"
    )

    # --- samples that are simulated: residuals.drive_experiment
    samples: int = rule(
        3_000,
        "samples that a fit compares: of longer logs, stretches spread over all of it, for all comparisons alike",
        'a limit of time; first 120 000, then 8 000, at last with "long logs are fitted on stretches, then once on the whole". Of the gear alone '
        "before, which then counted the less beside others, the longer the log",
    )
    samples_whole: int = rule(
        4_500,
        "samples of a whole drive simulated in a fit: of longer logs, the first part of each block, started as measured",
        'a limit of time, with "half the time, and nearer to linear"',
    )
    sampled_from: float = rule(1.5, "times these samples from which on a log is sampled", REPLAYED)
    stretch: int = rule(
        80,
        "samples in a stretch of a long log",
        developed("long logs are fitted on stretches, then once on the whole") + "; 60 before",
    )
    stretch_left: int = rule(
        40,
        "samples that the smoothing which a rig asks for leaves of a stretch, at least",
        "half a stretch; a window as long as the stretch left nothing of it, and no error to fit",
    )

    excerpt_ahead: float = rule(
        0.1,
        "s before each stretch that a first look computes, and what smoothing reaches",
        "checked for each hypothesis: `search.excerpt_alike`",
    )
    excerpt_share: float = rule(
        0.5, "share of a log from which on it is as well computed whole", "theory: then hardly anything is saved"
    )

    # --- smoothing: residuals.drive_experiment, residuals.channels
    windows: tuple[int, ...] = rule((5, 7, 11, 17, 25, 41, 61), "samples of the smoothing windows that are tried", REPLAYED)
    longest_window: float = rule(0.045, "s; a longer smoothing window would blur the motion itself", WHOLE)
    usual_window: int = rule(11, "samples of the window where nothing asks for another", FIRST)
    shortest_window: int = rule(
        3,
        "samples of a window that a rig may ask for, at least; fewer are not smoothed",
        "a window has a sample to either side of its middle; 5 before, which a rig that asked for less got without a word",
    )
    window_samples: int = rule(20, "trusted samples of a run without which it says nothing of the window", REPLAYED)
    window_level: float = rule(1.15, "times the least noise that the shortest window may leave which is taken", REPLAYED)
    window_deviations: float = rule(
        6.0,
        "standard deviations of the Gaussian average in a window",
        developed("Smoothing without overshoot, the ends of runs left out"),
    )
    smoothed_noise: float = rule(
        2.25,
        "a smoothed speed's noise is that of the unsmoothed over √(samples of the window / 2.25)",
        FIRST + ". Theory would give 1.69 for white noise under this average (6 / (2 √π))",
    )

    # --- where a comparison is trusted: residuals.channels, residuals.compare
    still_noise: float = rule(4.0, "a shaft slides for sure where its speed is this many times its noise", FIRST)
    still_speed: float = rule(5e-3, "and this share of its high speed", WHOLE)
    high_speed: float = rule(0.98, "quantile of the speed that is its high speed", FIRST)
    pressed: float = rule(0.1, "share of the high torque from which on it presses one flank for sure", REPLAYED)
    high_torque: float = rule(0.9, "quantile of the torque that is its high torque", REPLAYED)
    pressed_windows: int = rule(2, "windows of smoothing over which it has pressed the same flank", REPLAYED)
    broken: float = rule(
        1e3,
        "error, in deviations of the measured channel, where a simulation breaks down: it is wrong, not absent",
        developed("a comparison that breaks down whole is infinitely wrong, without a warning"),
    )

    # --- a motor on a measured voltage: residuals.compare
    motor_parts: int = rule(
        4,
        "parts of a step in which a motor runs on a measured voltage and speed that change between rows",
        "as many as those in which the step is asked whether it is fine enough (`parts`): the middle of a part misses its mean by "
        "a sixteenth of what the middle of a step does",
    )

    # --- a whole drive in time: residuals.forward
    turns_step: float = rule(
        0.3,
        "the output shaft's own frequency times the inner step, at most, of components that take turns",
        "theory: explicit coupling is stable below 1; " + WHOLE,
    )
    turns_parts: int = rule(
        4, "parts of a step in such a drive, at most; a shaft too stiff for them is softened", "a limit of time; " + WHOLE
    )
    turns_damping: tuple[float, float] = rule(
        (0.2, 0.4), "least and most damping of its output shaft, over √(stiffness · inertia)", WHOLE
    )
    shaft_step: float = rule(
        0.1,
        "of a whole drive compared in all its channels: the output shaft's own frequency and its damper's rate, times the inner step, "
        "at most",
        "theory: Verlet's step is stable below 2, and its frequency off by (0.1)^2 / 24, which a drive that swings for a hundred "
        "waves does not yet show",
    )
    shaft_look: float = rule(
        0.3,
        "the same in a first look at all hypotheses",
        "theory: the frequency is off by (0.3)^2 / 24, 0.4 %; a look needs to know what changes, not where",
    )
    shaft_parts: int = rule(
        12, "parts of a step in a whole drive, at most; a shaft too stiff for them is softened", "a limit of time; " + WHOLE
    )
    shaft_unseen: float = rule(
        0.1,
        "share of its noise by which a shaft that swings no faster than the log is asked to show may change a channel; root of the mean square",
        "theory: a hundredth of the squared error",
    )

    # --- a whole drive in closed loop against all channels: residuals.whole
    whole_step: float = rule(
        5e-4, "s; the longest step of the simulation, and the longest time between two acts of a continuous controller", CLOSED
    )
    whole_look: float = rule(1e-3, "s, the longest step of the first look at all hypotheses", "a limit of time")
    answers: float = rule(
        0.25,
        "of what a simulated command misses, what the law of the logged motion may miss of it where the drive is wrong behind its command",
        "theory: a sixteenth of the variance; tried on small controllers' development seeds",
    )
    seen_at_motor: float = rule(
        0.5,
        "share of what the load's angle misses of the command below which the wind-up must leave it, for the controller's sensors to be "
        "the motor's",
        "at least half told; of a loop that closes there nothing is left",
    )
    jump_beside: float = rule(
        0.1,
        "share of a set-point's change below which those before and behind it are for it to be a jump",
        "theory: a motion's are as large",
    )
    upright: float = rule(
        1e-3, "rows that a jump takes where straight lines draw it, for FMUs that are run again", "theory: next to none"
    )
    most_jumps: float = rule(
        0.02, "share of the rows that may jump; a set-point that does so oftener goes in steps", "not studied"
    )
    leap_noise: float = rule(
        8.0, "times its noise by which a measured voltage changes, at least, where it jumps", "beyond chance"
    )
    leap_rows: int = rule(
        3, "rows that its jump may take", "theory: a table that goes straight between messages of two rows draws it over three"
    )
    leap_held: int = rule(
        2, "rows by which it may have jumped sooner than is seen", "theory: a message of two rows that is held is as old"
    )
    message_rows: int = rule(10, "rows that a message may stand in a table, at most", "slower ones are told by rows that repeat")
    message_parts: int = rule(20, "places in a row at which messages are tried to come, where rows are uneven", "not studied")
    message_sure: float = rule(
        20.0, "logarithm of how much likelier messages must make the rows that are equal", "beyond chance: 1 in 10^8"
    )
    message_wrong: float = rule(0.01, "share of rows that have the message before and yet another value", "rows at its edge")
    evener: float = rule(
        0.5,
        "of what is new in a row of a motion by its stamps, the most that is new if it was sent at even times, for it to have been",
        "at least half told",
    )
    rate_rows: float = rule(0.25, "rows over which the rate of a channel tells how late a run's messages are", "not studied")
    whole_fits: float = rule(
        30.0, "s of log on which hypotheses are fitted, the first part of each run; the last fit has all", "a limit of time"
    )
    whole_longest: float = rule(
        120.0, "the same where these are sound and all are not: twice as many and twice again, at most so many", "a limit of time"
    )
    whole_glance: float = rule(10.0, "s of log of the first look, but at what drifts", "a limit of time")
    whole_shows: float = rule(
        0.25,
        "of the mean square above noise, in the channel farthest off, the least that these seconds show of what all do, to be enough",
        "half of its size; 13 drives of development had 0.2 to 1.5, and a play that nobody saw 0",
    )
    rows_whole: int = rule(
        36_000, "rows of a whole drive compared in a fit, evenly spread: four in a bin of a long log", "a limit of time"
    )
    wholes_remembered: int = rule(6, "simulations of a run that are kept: every channel asks for the same", "a limit of memory")
    settling: float = rule(
        0.5, "s behind the start of a run and behind a gap in which nothing is compared: what was before is not known", CLOSED
    )
    settling_share: float = rule(0.1, "the same, at most this share of a run", CLOSED)
    shortest_mean: float = rule(0.5, "steps of the simulation below which a mean over a window is the value itself", CLOSED)
    ripples: tuple[int, ...] = rule(
        (1, 2, 4), "waves in a turn that a tacho's reading may have", "commutators of few segments and coupling errors; " + CLOSED
    )

    # --- noise of samples: residuals.noise
    normal_median: float = rule(0.6745, "median absolute value of a normal law of deviation 1", "theory: Φ⁻¹(3/4)")
    noise_scatter: float = rule(
        1.25,
        "standard error of such a noise of n samples, in units of itself / sqrt(n)",
        "theory: a median of differences of neighbours in white noise, by simulation (tests/diagnosis/residuals)",
    )
    noise_off: float = rule(
        3.0, "of these, by which noise as a median has it is off at most", "theory: beyond chance, 1 in 700 of a normal law"
    )
    normal_tenth: float = rule(1.645, "absolute value that a tenth of a normal law of deviation 1 exceeds", "theory: Φ⁻¹(0.95)")
    no_count: float = rule(1e-9, "rad; what turned by less did not", "theory: digits of a log")
    on_a_count: float = rule(
        0.02, "counts by which a difference of counts may miss a whole number", "theory: digits of a log; " + CLOSED
    )
    few_counts: float = rule(
        4.5, "counts up to which a difference is held against its angle's", "theory: a clock a twentieth off"
    )
    mostly: float = rule(0.9, "share of the rows in which it must not", CLOSED)
    missing: float = rule(
        0.3,
        "of the power beside, the most that a difference over n rows has at 1, 2, ... waves in n rows",
        "theory: nothing; (2 pi n 1.5 / segment)^2 / 2 < 0.12 leaks in from the bins beside. Of 31 recorders (development seeds "
        "321000 to 321059) the right n had at most 0.03, wrong ones 0.65 and more",
    )
    longest_segment: int = rule(512, "rows of the segments over which that spectrum is averaged, at most", "usual (Welch 1967)")
    segments: int = rule(
        4, "of them in a short log, at least, not counting that they overlap", "usual for a spectrum that is averaged"
    )
    segment_rows: int = rule(19, "times n rows in a segment, at least", "theory: see what leaks in")
    differenced_once: float = rule(-0.5, "correlation of neighbours below which it is a difference over one row", "theory: -3/4")
    period_slowest: float = rule(40.0, "rows of the longest period of a controller that is looked for", CLOSED)
    period_fastest: float = rule(2.0, "rows of the shortest", "theory: twice as often as a row no log shows it (Nyquist)")
    period_padding: int = rule(8, "times the rows over which its spectrum is taken", CLOSED)
    period_near: float = rule(
        1.5, "times its frequency, and parts of it, between which a line is held against the spectrum", PERIODS
    )
    period_line: float = rule(8.0, "medians of the spectrum near it above which a line is a period's", PERIODS)
    period_part: float = rule(
        0.5,
        "of the strongest line, above which one of a part of its frequency may be the period's",
        "theory: all lines of like steps are as strong; of steps of which every other is larger the slower is half as strong at three times",
    )
    on_steps: float = rule(
        0.1,
        "mean distance from a step's whole numbers, in steps, up to which values lie in it",
        "theory: 1/4 where they lie anywhere",
    )
    of_own_steps: float = rule(
        0.75,
        "noise of a voltage, in its steps, up to which it is that of rounding to them; beyond, it was measured",
        "theory: rounding a ramp of any slope leaves 0.71 at most, as fourth differences tell noise",
    )
    step_parts: float = rule(4.0, "parts of a channel's own step in which a coarser one is looked for", CLOSED)
    step_places: float = rule(2e5, "places between its least and largest value, at most", "a limit of memory")
    step_padding: int = rule(4, "times the places over which the spectrum of its values is taken", CLOSED)
    step_closer: int = rule(101, "places between two of that spectrum at which the best is looked for", CLOSED)
    step_fewest: float = rule(3.0, "steps within its reach, at least", "theory: two levels lie in steps of any distance")
    step_most: float = rule(8.0, "and so many from which on where it stays is no matter", CLOSED)
    step_passed: int = rule(
        20,
        "rows in which a signal goes on to another of few steps, at least",
        "theory: 20 phases of chance have a mean longer than `step_like` once in 150",
    )
    step_lobes: float = rule(
        1.5,
        "times the first frequency at which that mean is long, within which the best is taken",
        "theory: side lobes of few steps lie before it, the step's half is at twice",
    )
    step_above: float = rule(
        1.66,
        "own steps that a coarser one has, at least",
        "theory: rounded to its own steps s what lies in steps of q has a mean of sinc(s / q), which is `step_like` at 1.66",
    )
    step_like: float = rule(0.5, "length of the mean of exp(2 pi i x / q) above which values lie in steps of q", CLOSED)
    zeros: tuple[float, ...] = rule(
        (0.1, 0.35, 0.6, 0.85), "counts by which an encoder's zero is moved to know its rounding", CLOSED
    )
    beside_count: int = rule(
        4, "rows on each side of a count by which a voltage's own change is told", "as for differences of noise"
    )
    sees_counts: float = rule(
        0.5,
        "share of angle_gain times a count by which the voltage steps with it, for a controller to see counts",
        "half: 0 or 1",
    )
    sees_counts_errors: float = rule(4.0, "standard errors of that share that it has to be from 0", "beyond chance")
    acts_late: int = rule(
        32, "rows within which a controller in step with the log acts on a sample", "theory: longer than delays are"
    )
    formulas: float = rule(
        0.003,
        "share of a channel's size below which no simulation of a whole drive is asked to be right; of the controlled angle what "
        "makes the voltage by that share another, of a wind-up its own size; and of the gear's friction and stiffness",
        "a data sheet is no better; " + CLOSED,
    )
    own_formulas: float = rule(
        0.1,
        "share of what causes move in a channel of a whole drive that their formulas may leave of it: no further cause is asked for it",
        "a tenth, as for `shows_whole`. Measured since on 42 single causes of the hidden plant (seeds 10 520 and 10 521), each "
        "fitted alone: in the channel that shows it most half leave 0.06, five in six 0.1 or less",
    )
    near: int = rule(8, "rows about whose mean noise is told in a whole drive: what lasts longer is no noise", CLOSED)
    near_tail: float = rule(0.98, "quantile of these variances that may be noise; what is above may be a fault's", CLOSED)
    seldom: float = rule(
        0.1,
        "share of the rows of a driving voltage in which its noise is seen, at least: what is in fewer is an event, no noise",
        "theory: of white noise nine in ten groups of `near` rows have less than 1.7 times the mean (chi-square of 7), so that it is none's limit",
    )
    noise_samples: int = rule(10, "differences of samples without which nothing is said: the floor is 0 then", NOISE)
    coarse: float = rule(0.1, "a resolution beyond this share of the differences shows in them", NOISE)
    coarse_steps: float = rule(4.0, "of a coarse channel, steps up to which a difference is noise", NOISE)
    exact: float = rule(
        1e-3,
        "noise of a voltage, as a share of its spread, up to which it is a number that the controller gave; beyond, it was measured",
        "theory: more than rounding to 12 bits of its range leaves. The numbers of the study of power have 1e-4, "
        "the voltages of the recorders of development 4e-3 and more",
    )
    of_next_row: float = rule(
        0.5,
        "share of what a command misses of its own row's angle below which it must miss the next row's, for rows that are not the controller's",
        "at least half told: no cause in a drive makes a command come before what it answers",
    )
    dithered: float = rule(
        0.5,
        "counts of noise from which on a channel's rounding is white, too; below, it is that of the counts alone",
        "theory: Widrow and Kollár (2008), Quantization Noise, chapter 4",
    )
    rounded_window: int = rule(41, "samples whose mean tells what lies between two counts", "the longest window; not studied")
    half_stretches: int = rule(
        8, "stretches of a run of steady state; every second one makes one half, so that a drift is in both", NOISE
    )
    load_alike: float = rule(0.02, "share of the largest load by which the loads of neighbouring points may differ", NOISE)
    point_neighbours: int = rule(3, "points between neighbours without which nothing is said of their noise", NOISE)

    # --- noise of bins: residuals.noise
    bin_differences: int = rule(20, "differences of near bins that tell noise; with fewer, of all in a row", FIRST)
    least_noise: float = rule(1e-3, "share of the error that its noise is at least", FIRST)
    quiet_share: float = rule(0.2, "quantile of the blocks' noise that is taken for that of the quieter ones", WAVES)
    quiet_blocks: int = rule(5, "blocks without which nothing is said of the quieter ones", WAVES)
    quiet_below: float = rule(
        0.84, "spreads by which that quantile of equally noisy blocks lies below their middle", "theory: -Φ⁻¹(0.2)"
    )
    quiet_least: float = rule(0.5, "share of their middle that it is taken for, at least", WAVES)
    median_spread: float = rule(
        1.3, "spread of a block's noise, times √(differences)", WAVES + ". A median of a normal law has 1.25 deviations"
    )
    tied: float = rule(0.5, "of bins within the reach of smoothing, the share that is no new evidence", WAVES)

    # --- memory and time
    shown: int = rule(
        60_000,
        "samples that show what a finer step leaves",
        f'a limit of time, with "{LEAN}"; not studied',
    )
    played: int = rule(
        20_000,
        "rows, about, on which an extended FMU is run again",
        "a limit of time: the FMU gives what the compiled law gives, or it does not; FMPy takes 30 us a sample",
    )
    shown_least: int = rule(
        100,
        "samples kept of a run that has none to show: it is there for its place among the others",
        f'with "{LEAN}"; not studied',
    )
    remembered: int = rule(
        24,
        "misfits of a residual that are kept: a fit asks for the same values again and again",
        "a limit of memory; not studied",
    )
    motions_remembered: int = rule(
        1_000_000,
        "samples of all motions of a shaft that are remembered beside the first",
        "a limit of memory: an hour's motion is 90 MB",
    )
    derived_remembered: int = rule(
        4,
        "of what is derived from a motion (its load's torque, its motor's constants) the last ones are kept, in so many runs of a fit",
        "a limit of memory, with the one above; not studied",
    )
    piece: int = rule(
        100_000,
        "samples that are differentiated at a time",
        'a limit of memory, with "Motions of an hour\'s log need a quarter less memory"',
    )
