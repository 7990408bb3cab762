"""The whole way: what teaches and what judges, what is run again, others' systems."""

from __future__ import annotations

from dataclasses import dataclass

from .rule import developed, rule

END_TO_END = developed("contest, gain on held-out data, blame, remainder and result file end to end")
SYSTEMS = developed("Any FMU system on a log: each component alone on its measured inputs")


@dataclass(frozen=True)
class PipelineRules:
    # --- what teaches and what judges: pipeline.hold_out
    fewest_blocks: int = rule(8, "training blocks without which nothing can be told from chance", END_TO_END)
    every: int = rule(3, "one block in so many is held out where no log judges", END_TO_END)
    even: float = rule(
        1e-3,
        "share of the usual step by which rows may miss it and count as even; else a whole drive is compared where it is described",
        "theory: digits of a clock in µs",
    )
    most_faulty: float = rule(0.5, "share of a channel's samples that may be faulty before the log is refused", END_TO_END)

    # --- what is run again: output.playback, output.loop
    longest_step: float = rule(
        5e-4, "s; step of an extended system of a whole drive, at most", developed("the system that plays the log")
    )

    coupled_steps: int = rule(6_000, "steps of a coupled extended drive that are run again", "a limit of time")
    coupled_apart: float = rule(
        2.0,
        "times the error of its step by which a coupled extended drive may miss what the fit promised, and agrees",
        "theory: of first order, half a step has half of the error; as much again for the promise's own steps. It is told, and decides nothing",
    )
    coupled_exact: float = rule(
        1e-6, "the same as a share of the channel, where steps hardly matter", "theory: digits of a text file"
    )

    # --- while it runs: progress
    told_every: float = rule(
        10.0,
        "s from one line of progress to the next where no terminal shows a bar, and of a stage before the rest of it is guessed",
        "not studied; a diagnosis of a minute is told in a few lines, one of an hour in some hundred; it decides nothing",
    )

    # --- others' systems: systems.system
    fine: float = rule(
        1e-3, "share of a channel's size below which no error matters: a log without noise is no reason to look closer", SYSTEMS
    )
    off_seen: float = rule(
        1.05,
        "error in units of the noise from which on a component is off, where its error is seen to go with something",
        SYSTEMS,
    )
