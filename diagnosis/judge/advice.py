"""Which run would tell two causes apart."""

from __future__ import annotations

from ..search.hypotheses import Hypothesis

RUNS = {
    "stribeck": "slow ramps of speed through zero, both ways, at one load",
    "viscous": "constant speeds up to the highest, at one load",
    "asymmetric": "the same speeds in both directions with the load taken off",
    "load_dependent": "the same motion with twice and with half the load, lifting and lowering",
    "preload": "the same motion with the load taken off",
    "ripple": "one slow constant speed over many turns",
    "backlash": "reversals under a load that changes its side, both shafts' angles measured",
    "compliance": "slowly rising load at standstill, both shafts' angles measured",
    "warm_up": "the same motion cold, and again after half an hour of running",
    "wear": "the same short test before and after a long run, with a pause to cool down between",
    "winding_heating": "a high current held for minutes, then the same voltage steps cold and warm",
    "torque_constant": "standstill against a force gauge at several currents",
    "brush_drop": "small voltages at standstill, both signs",
    "cogging": "turning the motor slowly without current",
    "supply_sag": "the supply's voltage measured at the driver during high current",
    "delay": "a step of the set-point sampled ten times faster",
    "dead_zone": "set-points so small that the command stays within a few tenths of a volt",
    "saturation": "a set-point step that drives the command to its limit",
    "sampling": "the command recorded ten times faster than now",
    "bias": "a minute at rest without power",
    "scale": "the channel against a second instrument at two values",
    "lag": "a fast step seen by this channel and a faster instrument",
    "quantisation": "the channel recorded raw at slow motion",
    "mass": "the load held level at standstill, then moved slowly, with the load weighed",
    "centre_of_mass": "the same motion with the load weighed, fast and slow",
    "inertia": "fast accelerations with gravity balanced",
    "tilt": "a full turn of the load, slowly",
    "parameter": "the quantity measured by itself on the bench",
}


def separate(winner: Hypothesis, rivals: list[Hypothesis]) -> str:
    """A sentence that names the run, empty where nothing needs telling apart."""
    if not rivals:
        return ""
    runs = list(dict.fromkeys(RUNS[h.effect] for h in (winner, *rivals) if h.effect in RUNS))[:3]
    return "Would separate them: " + "; or ".join(runs) + "."
