"""Reading and checking logs."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import developed, rule

CHECKED = developed("Logs and rigs are read, checked for faults and cut into component replays")
REFUSED = developed("What cannot carry a diagnosis is refused")
STUCK = developed("A channel that stands still is held against what tells of the same motion") + "; seeds 10 000 to 10 059"
IMPACT = developed("An impact is no corrupted sample: it has neighbours, or others feel it") + "; seeds 10 000 to 10 059"
SLIP = "theory: slips of a unit are 6 (deg/s, rpm), 9.5 (rpm, rad/s), 57 (deg, rad), 1000 and more; no bench is off by 5 in what follows from another channel"
BESIDE = "theory: brushes, cables, friction and a load that nobody told add several times what a data sheet says, never 30 times; a slip of 1000 is seen all the same"
AT_REST = developed("A steady-state point at rest is told by its mean's own uncertainty")


@dataclass(frozen=True)
class DataRules:
    # --- reading: data.log, data.rig
    fewest_points: int = rule(
        6, "points at constant speed that a replay compares; a diagnosis asks for shortest_log", "theory: fewer show no curve"
    )
    shortest_log: int = rule(30, "samples of a log; fewer tell nothing", CHECKED)
    same_times: float = rule(
        0.5, "share of the rows that may repeat the time before; more, and it was written too coarsely", REFUSED
    )
    like_name: float = rule(
        0.85, "similarity (difflib's ratio) from which on a name of no signal is taken for a misspelt one", REFUSED
    )

    # --- the clock: data.faults
    gap: int = rule(4, "usual steps without a sample that are a gap", CHECKED)
    uneven: float = rule(
        0.5,
        "share of the usual step by which an uneven one differs from it; where most are even, a longer one lost rows",
        CHECKED,
    )
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
    beyond_limits: float = rule(
        2.0,
        "times a controller's limits from which on its command is corrupted",
        "theory: no data sheet's limit is off by that, and a controller commands no more",
    )
    spike: int = rule(3, "samples of the longest corrupted stretch; what lasts longer may be real", CHECKED)
    spike_samples: int = rule(20, "sound samples of a run without which no spike is looked for", CHECKED)
    spike_tail: float = rule(0.98, "quantile of the distances from neighbours that may be the signal's own", CHECKED)
    spike_tail_deviations: float = rule(3.0, "deviations that this quantile is taken for", CHECKED)
    spike_range: float = rule(0.25, "share of the signal's range that a spike exceeds", CHECKED)
    spike_beside: float = rule(
        0.25, "share of a spike that its neighbours on both sides stay below; an impact builds up, lasts or rings down", IMPACT
    )
    impact_reach: int = rule(2, "samples by which others may show an impact sooner or later", IMPACT)
    impact_witnesses: int = rule(
        2,
        "other places (a shaft, a voltage, a torque) that bend as they rarely do (spike_tail) where a torque's spike is an impact and no fault",
        IMPACT,
    )
    impact_sharp: float = rule(
        5.0,
        "times the usual bend about a spike that they bend at it: where a motion turns, all bend for many samples",
        "theory: of noise one row in 1500 bends as much. Seeds 10 000 to 10 039; on 10 600 to 10 719 all of 360 corrupted rows are told, and no impact",
    )
    impact_about: int = rule(10, "widths of the bend to both sides that are about a spike", "as impact_sharp")
    spike_range_at_ends: float = rule(
        1.5,
        "the same at the ends of a run, where a step looks like a spike: larger than the signal itself",
        developed("Tests of the diagnosis' own units, and its benchmark"),
    )
    range_quantiles: tuple[float, float] = rule((0.02, 0.98), "quantiles between which a signal's range lies", CHECKED)

    # --- clipped and frozen channels
    apart: float = rule(
        4.0,
        "times as far as they may that the angles told by two channels come apart while one of them stands still",
        STUCK,
    )
    apart_and_odd: float = rule(2.0, "the same where the channel's own noise too would not leave it still for so long", STUCK)
    apart_agreed: float = rule(
        0.5, "the same that a second witness has to say, where there is one: one alone may be at fault", STUCK
    )
    apart_usual: float = rule(0.98, "quantile of how far they come apart elsewhere that they may", STUCK)
    apart_rows: int = rule(4096, "samples of the longest window in which that is looked at", STUCK)
    apart_share: float = rule(0.05, "the same, as a share of the run: of fewer windows no quantile can be told", STUCK)
    ratio_parts: int = rule(100, "parts of a run over which the ratio of two angles is a weighted median", STUCK)
    clipped_stretch: int = rule(3, "samples in a row at the extreme value", CHECKED)
    let_go: float = rule(
        2.0, "times a large usual step (range_quantiles) by which a channel jumps when it is let go, and not from a limit", STUCK
    )
    clipped_beside: int = rule(10, "values beside the extreme one that tell how often it would be found by chance", STUCK)
    frozen_samples: int = rule(100, "samples of a run without which a frozen channel is not looked for", CHECKED)
    frozen_parts: int = rule(20, "parts of a run over which the usual share of repeated values is a median", CHECKED)
    noisy_repeats: float = rule(
        0.28,
        "that share above which a channel's noise is finer than its steps: without noise a steady motion repeats values",
        "theory: 1 / (2 √π), where a normal law's deviation is one step",
    )
    frozen_shares: tuple[float, float] = rule((1e-3, 0.95), "bounds of that share", CHECKED)
    frozen_shortest: float = rule(20.0, "samples of the shortest frozen stretch", CHECKED)
    frozen_chance: float = rule(
        1e-9,
        "chance of so long a stretch anywhere in a log, below which it is no chance: ln(chance / samples) / ln(share)",
        CHECKED,
    )
    creeps: float = rule(
        1e-4,
        "chance below which rows that change by one step at most, beside a stretch that seems frozen, are a value that creeps, and no noise",
        "a level",
    )
    usual_stills: int = rule(
        3,
        "stretches alike from which on they are the channel's way, as rests of counts or a gear's play are, and no fault",
        STUCK,
    )
    witness_quantiles: tuple[float, float] = rule(
        (0.05, 0.95),
        "quantiles between which another channel moved meanwhile",
        developed("Tests of the diagnosis' own units, and its benchmark"),
    )
    witness_share: float = rule(0.1, "share of that channel's range that shows that something happened", CHECKED)
    moving_share: float = rule(
        0.02, "share of a fast motion's way (range_quantiles) from which on a drive moves, and a torque has to change", STUCK
    )
    smallest_step: float = rule(0.05, "quantile of the steps between a channel's values that is its resolution", CHECKED)

    # --- steady-state points at rest
    moves: float = rule(
        4.0,
        "a steady-state point moves whose mean speed is this many times its uncertainty; one at rest has no direction",
        AT_REST + ". Before it, a share of 0.9 of samples of one sign",
    )
    mean_parts: int = rule(8, "parts of a run whose means tell that uncertainty", AT_REST)
    part_samples: int = rule(5, "samples of such a part, at least", AT_REST)

    # --- what the log says against what the rig says: data.motions, data.balances
    pieces: int = rule(
        200,
        "pieces of a run over which two channels' ways are compared",
        "a limit of time: means over a piece have next to no noise",
    )
    fine_pieces: int = rule(
        1000, "pieces of a run over which a torque is held against the motion that it makes", "a limit of time"
    )
    piece_samples: int = rule(5, "samples of a piece, at least", "theory: fewer are no mean")
    fewest_pieces: int = rule(
        12, "pieces with a motion without which nothing is said", "theory: a chance of 2 in 2^12 that signs agree by accident"
    )
    kept_speed: float = rule(
        0.98,
        "share of a speed's way up and down that means over pieces have to keep; else parts of a long run are looked at in shorter ones",
        "theory: what changes over pieces is told by five of them and more in each period of it",
    )
    kept_angle: float = rule(
        0.995, "the same of an angle, where no speed is there: its speed changes faster", "theory: as kept_speed"
    )
    most_parts: int = rule(8, "such parts of a run, those with most motion", "a limit of time")
    gross: float = rule(5.0, "times that a channel may be off from what another channel or a voltage's balance says of it", SLIP)
    gross_beside: float = rule(
        30.0,
        "times that a torque, or a voltage beyond what speed and current ask for, may be more than the rig's values make",
        BESIDE,
    )
    one_sign: float = rule(
        0.9, "share of the pieces with most motion that agree on a sign or a factor", "theory: of the fewest pieces one may lie"
    )
    one_factor: float = rule(3.0, "quartiles' ratio up to which they agree on a factor", "theory: less than the smallest slip")
    ratio_told: float = rule(
        0.01,
        "share by which two shafts may turn in another ratio than one that was assumed, without a remark",
        "a remark alone, which decides nothing",
    )
    ratio_off: float = rule(
        0.25, "the same of a ratio that the rig gives: sensors are off by less", "a remark alone, which decides nothing"
    )
    known_slip: float = rule(
        0.15,
        "relative distance from a slip's factor within which it is named",
        "theory: half of the way from 6 to 9.5, with room for a sensor that is off",
    )
    mends: float = rule(
        3.0,
        "times by which a slip must lessen a balance's error to be named",
        "theory: less than the smallest slip; a sound balance has nothing to mend",
    )
    mended: float = rule(0.5, "share of the signal that is then left, at most", "theory: the slip explains more than all else")
    unlike: float = rule(
        0.7,
        "share of the signal that a balance misses from which on slips are tried",
        "theory: near 1 what the rig says explains nothing",
    )
    goes_on: float = rule(
        0.5, "correlation of a speed's means over adjacent pieces from which on it is a motion", "theory: of noise it is 0"
    )
    surely: float = rule(
        0.05,
        "share of the highest speed below which a torque is not asked which way friction acts",
        "theory: over a mean the sign may change",
    )
    both_ways: float = rule(
        0.1,
        "share of the pieces that go each way, without which a torque's sign is not told",
        "theory: friction is told from a constant load by going both ways",
    )
    told_share: float = rule(
        0.3,
        "share of a torque that an inertia, a friction or gravity makes, from which on it tells of them",
        "theory: a tenth of its power",
    )
    against: float = rule(
        -0.3,
        "share of the power that friction seems to give, beyond which a torque has the wrong sign",
        "theory: friction takes; 0 is the limit, the rest is for sensors that lag",
    )
    zero_share: float = rule(
        0.5,
        "share of the way that a set-point goes by which an angle's zero may lie beside it, without a remark",
        "a remark alone, which decides nothing",
    )
    zero_quarters: float = rule(
        0.2,
        "rad from quarters of a turn within which an angle is counted from another zero, and stops a loop that is simulated whole",
        "theory: a drive stands 90 degrees from where it is sent only where its angle is another one",
    )
    zero_angle: float = rule(
        0.5,
        "rad by which gravity may pull at another angle than the rig says, without a remark; a bench leans by less",
        "a remark alone, which decides nothing",
    )
    zero_mends: float = rule(
        2.0, "times by which that other angle must lessen what is left of the torque", "a remark alone, which decides nothing"
    )
    clamped: float = rule(
        0.2,
        "share of what its input shaft turns to and fro, over the ratio, that an output may move and still be clamped",
        "theory: through a gear it follows all of it; a clamp gives less than the shaft that winds up",
    )
    slow_rows: float = rule(
        0.5,
        "s between rows of a moving drive from which on the time's unit is remarked on",
        "a remark alone, which decides nothing",
    )
    fast_rows: float = rule(
        2e-6, "s between rows below which the time's unit is remarked on", "a remark alone, which decides nothing"
    )
    ahead_samples: int = rule(
        20_000, "samples of the longest run by which an angle is held against its set-point", "a limit of time"
    )
    ahead_within: int = rule(30, "rows by which it may be early or late there", "a limit of time")
    ahead_rows: int = rule(
        3,
        "rows by which an angle is ahead of its set-point, from which on they may be exchanged",
        "theory: a recorder may read them a row or two apart",
    )
    ahead_mends: float = rule(
        1.25, "times by which that must lessen what lies between them", "a remark alone, which decides nothing"
    )
    slow_coil: float = rule(
        0.1,
        "s of a winding's time constant L / R from which on its inductance is remarked on",
        "a remark alone, which decides nothing",
    )
    fast_coil: float = rule(1e-6, "s of it below which it is remarked on", "a remark alone, which decides nothing")
    limp: float = rule(
        0.2,
        "rad by which an output shaft may wind up under what it carries, without a remark",
        "theory: gears give by less than a degree or two, springs in series by some; beyond gross times as much nothing holds",
    )
    slow_shaft: float = rule(
        0.5, "Hz at which a load may swing on its gear's shaft, without a remark", "a remark alone, which decides nothing"
    )
    unlimited: float = rule(
        0.9, "share of a voltage's highest value up to which no limit cuts it", "theory: what is cut rests at one value"
    )
    most_volts: float = rule(1000.0, "V of a limit from which on it is remarked on", "a remark alone, which decides nothing")
    unsteady: float = rule(
        0.3,
        "share of the speeds' size by which the speed of a steady point may change within it",
        "theory: a point at constant speed has one direction; noise and start are less",
    )
