"""Reading and checking logs."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import developed, rule

CHECKED = developed("Logs and rigs are read, checked for faults and cut into component replays")
REFUSED = developed("What cannot carry a diagnosis is refused")
AT_REST = developed("A steady-state point at rest is told by its mean's own uncertainty")


@dataclass(frozen=True)
class DataRules:
    # --- reading: data.log, data.rig
    shortest_log: int = rule(30, "samples of a log; fewer tell nothing", CHECKED)
    same_times: float = rule(
        0.5, "share of the rows that may repeat the time before; more, and it was written too coarsely", REFUSED
    )
    like_name: float = rule(
        0.85, "similarity (difflib's ratio) from which on a name of no signal is taken for a misspelt one", REFUSED
    )

    # --- the clock: data.faults
    gap: int = rule(4, "usual steps without a sample that are a gap", CHECKED)
    uneven: float = rule(0.5, "share of the usual step by which an uneven one differs from it", CHECKED)
    most_uneven: float = rule(0.05, "share of uneven steps from which on a clock is irregular", CHECKED)

    # --- corrupted samples
    corrupted: float = rule(
        12.0,
        "robust deviations from its neighbours from which on a sample is corrupted",
        "theory: a normal law gives one in 1e32 (Hampel's test). Why 12 and not less is not recorded: " + CHECKED,
    )
    deviation: float = rule(
        1.4826, "standard deviations of a normal law in its median absolute deviation", "theory: 1 / Φ⁻¹(3/4)"
    )
    spike: int = rule(3, "samples of the longest corrupted stretch; what lasts longer may be real", CHECKED)
    spike_samples: int = rule(20, "sound samples of a run without which no spike is looked for", CHECKED)
    spike_tail: float = rule(0.98, "quantile of the distances from neighbours that may be the signal's own", CHECKED)
    spike_tail_deviations: float = rule(3.0, "deviations that this quantile is taken for", CHECKED)
    spike_range: float = rule(0.25, "share of the signal's range that a spike exceeds", CHECKED)
    spike_range_at_ends: float = rule(
        1.5,
        "the same at the ends of a run, where a step looks like a spike: larger than the signal itself",
        developed("Tests of the diagnosis' own units, and its benchmark"),
    )
    range_quantiles: tuple[float, float] = rule((0.02, 0.98), "quantiles between which a signal's range lies", CHECKED)

    # --- clipped and frozen channels
    clipped_levels: int = rule(100, "different values without which a channel is too coarse to tell clipping", CHECKED)
    clipped_stretch: int = rule(3, "samples in a row at the extreme value", CHECKED)
    clipped_stretches: int = rule(2, "such stretches that clipping takes", CHECKED)
    clipped_samples: int = rule(
        10, "samples at the extreme value, and times as often as a usual value, beyond which it is clipped", CHECKED
    )
    frozen_samples: int = rule(100, "samples of a run without which a frozen channel is not looked for", CHECKED)
    frozen_parts: int = rule(20, "parts of a run over which the usual share of repeated values is a median", CHECKED)
    frozen_shares: tuple[float, float] = rule((1e-3, 0.95), "bounds of that share", CHECKED)
    frozen_shortest: float = rule(20.0, "samples of the shortest frozen stretch", CHECKED)
    frozen_chance: float = rule(
        1e-9,
        "chance of so long a stretch anywhere in a log, below which it is no chance: ln(chance / samples) / ln(share)",
        CHECKED,
    )
    witness_quantiles: tuple[float, float] = rule(
        (0.05, 0.95),
        "quantiles between which another channel moved meanwhile",
        developed("Tests of the diagnosis' own units, and its benchmark"),
    )
    witness_share: float = rule(0.1, "share of that channel's range that shows that the drive moved", CHECKED)
    smallest_step: float = rule(0.05, "quantile of the steps between a channel's values that is its resolution", CHECKED)

    # --- steady-state points at rest
    moves: float = rule(
        4.0,
        "a steady-state point moves whose mean speed is this many times its uncertainty; one at rest has no direction",
        AT_REST + ". Before it, a share of 0.9 of samples of one sign",
    )
    mean_parts: int = rule(8, "parts of a run whose means tell that uncertainty", AT_REST)
    part_samples: int = rule(5, "samples of such a part, at least", AT_REST)
