"""Comparisons, their samples and smoothing, and their noise."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import developed, rule

FIRST = developed("Logs and rigs are read, checked for faults and cut into component replays")
REPLAYED = developed("the reducer FMU on a measured motion with its known load; rigs of the four measured drives")
WHOLE = developed("Whole drives in closed loop, per-log parameters, speeds against angles, motions and torques filtered alike")
NOISE = developed("The noise floor of held, quantised and steady channels, held to noise that is known")
WAVES = developed("A fast wave no longer passes for noise")
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
        "samples of the gear's friction simulated in a fit: of longer logs, stretches spread over all of it",
        'a limit of time; first 120 000, then 8 000, at last with "long logs are fitted on stretches, then once on the whole"',
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

    # --- smoothing: residuals.drive_experiment, residuals.channels
    windows: tuple[int, ...] = rule((5, 7, 11, 17, 25, 41, 61), "samples of the smoothing windows that are tried", REPLAYED)
    longest_window: float = rule(0.045, "s; a longer smoothing window would blur the motion itself", WHOLE)
    usual_window: int = rule(11, "samples of the window where nothing asks for another", FIRST)
    shortest_window: int = rule(5, "samples of a window, at least; fewer are not smoothed", FIRST)
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

    # --- a whole drive in time: residuals.forward
    shaft_step: float = rule(
        0.3,
        "the output shaft's own frequency times the inner step, at most",
        "theory: explicit coupling is stable below 1; " + WHOLE,
    )
    shaft_parts: int = rule(
        4, "parts of a step in a whole drive, at most; a shaft too stiff for them is softened", "a limit of time; " + WHOLE
    )
    shaft_damping: tuple[float, float] = rule(
        (0.2, 0.4), "least and most damping of the output shaft, over √(stiffness · inertia)", WHOLE
    )

    # --- noise of samples: residuals.noise
    normal_median: float = rule(0.6745, "median absolute value of a normal law of deviation 1", "theory: Φ⁻¹(3/4)")
    normal_tenth: float = rule(1.645, "absolute value that a tenth of a normal law of deviation 1 exceeds", "theory: Φ⁻¹(0.95)")
    noise_samples: int = rule(10, "differences of samples without which nothing is said: the floor is 0 then", NOISE)
    coarse: float = rule(0.1, "a resolution beyond this share of the differences shows in them", NOISE)
    coarse_steps: float = rule(4.0, "of a coarse channel, steps up to which a difference is noise", NOISE)
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
        "samples that show what an FMU or a finer step leaves",
        f'a limit of time, with "{LEAN}": FMPy would take longer for an hour than the whole diagnosis',
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
    piece: int = rule(
        100_000,
        "samples that are differentiated at a time",
        'a limit of memory, with "Motions of an hour\'s log need a quarter less memory"',
    )
