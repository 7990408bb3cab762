"""Claims 11 to 19: motors, controllers, power, and the advice to the designer."""

from __future__ import annotations

import math

import numpy as np

from .check import Check, row
from .curves import LIMIT, Curves, Runs, largest, least, least_step, pairs, rms

ELECTRIC, MECHANICAL = "rear_motor.electric_power", "rear_motor.mechanical_power"
LONG_HOLD = 600.0  # s, the hold of claim 19's duty cycle: the holders rarely turn


@row(11, "Dynamic mode resembles kinematic mode; with friction the torques fall gradually after 4 s and 8 s.", (13, 14))
def gradual_fall(runs: Runs) -> list[Check]:
    checks = []
    for start, stop, window in ((4.0, 6.0, "hold B"), (8.0, 10.0, "hold C")):
        times: dict[str, list[float]] = {"dynamic": [], "kinematic": []}
        for mode, mu, run in runs.each():
            if mu > 0:
                rho = run.mean(run.F, window) / run.mean(run.P, window)
                bound = 0.05 * float(np.max(np.abs(run.P))) / runs.facts.gear_ratio
                times[mode].append(run.settled_after(start, stop, run.F - rho * run.P, bound))
        checks.append(
            Check(f"dynamic: time from {start:g} s to the hold's torque, shortest", least(times["dynamic"]), ">=", 0.050, "s")
        )
        checks.append(
            Check(
                f"kinematic: time from {start:g} s to the hold's torque, longest", largest(times["kinematic"]), "<=", 0.010, "s"
            )
        )
    return checks


@row(12, "The torque peak near 4 s is smaller in dynamic mode, and grows with friction.", (13, 14))
def landing_peak(runs: Runs) -> list[Check]:
    def peaks(of: dict[float, Curves]) -> list[float]:
        return [float(np.max(np.abs(of[mu].F[of[mu].inside((3.8, 4.4))]))) for mu in sorted(of)]

    kinematic, dynamic = peaks(runs.kinematic), peaks(runs.dynamic)
    return [
        *(
            Check(f"peak dynamic / peak kinematic, μ = {mu:g}", d / k, "<", 1)
            for mu, k, d in zip(sorted(runs.kinematic), kinematic, dynamic)
        ),
        Check("kinematic: least growth of the peak from one μ to the next", least_step(kinematic), ">", 0, "N.m"),
        Check("dynamic: least growth of the peak from one μ to the next", least_step(dynamic), ">", 0, "N.m"),
    ]


@row(13, "Mechanical power is zero at rest; input power grows with friction, output power does not.", (15,))
def mechanical_power(runs: Runs) -> list[Check]:
    dynamic = [runs.dynamic[mu] for mu in sorted(runs.dynamic)]
    at_rest = largest(
        float(np.max(np.abs(run[MECHANICAL][run.inside(window)])) / np.max(np.abs(run[MECHANICAL])))
        for run in dynamic
        for window in ("hold B", "hold C")
    )
    put_in = [run.energy(MECHANICAL, "lift", "raise") for run in dynamic]
    put_out = [run.energy("rear_reducer.output_power", "lift", "raise") for run in dynamic]
    spread = float((largest(put_out) - least(put_out)) / abs(np.mean(put_out)))
    return [
        Check("largest |P_M| in hold B and C / its peak", at_rest, "<=", 0.01),
        Check("least growth of the input energy over lift and raise from one μ to the next", least_step(put_in), ">", 0, "J"),
        Check("spread of the output energy / its mean", spread, "<=", 0.02),
    ]


@row(14, "Electric power at rest: R/K_m² M² below the limit, zero at and above it.", (16,))
def electric_power_at_rest(runs: Runs) -> list[Check]:
    window = (5.5, 6.0)
    copper = runs.facts.resistance / runs.facts.torque_constant**2
    base = runs.dynamic[0.0].mean(ELECTRIC, window)
    checks = []
    for mu, run in sorted(runs.dynamic.items()):
        power = run.mean(ELECTRIC, window)
        if mu < LIMIT:
            stalled = run.mean(copper * run["rear_motor.torque"] ** 2, window)
            checks.append(Check(f"P_E, μ = {mu:g}", power, ">", 0, "W"))
            checks.append(Check(f"P_E against eq 19, μ = {mu:g}", abs(power / stalled - 1), "<=", 0.01))
        else:
            checks.append(Check(f"P_E / P_E(0), μ = {mu:g}", abs(power) / base, "<=", 0.01))
    return checks


@row(15, "While rotating, electric power grows with friction.", (16,))
def electric_power_moving(runs: Runs) -> list[Check]:
    energies = [runs.dynamic[mu].energy(ELECTRIC, (6.0, 8.0)) for mu in sorted(runs.dynamic)]
    return [
        *(Check(f"electric energy over 6–8 s, μ = {mu:g}", e, unit="J") for mu, e in zip(sorted(runs.dynamic), energies)),
        Check("its least growth from one μ to the next", least_step(energies), ">", 0, "J"),
    ]


@row(
    16,
    "Without friction electric power is close to mechanical at high speed and much greater at low speed and high torque.",
    (17,),
)
def efficiency_of_the_motor(runs: Runs) -> list[Check]:
    run = runs.dynamic[0.0]
    electric, mechanical = run[ELECTRIC], run[MECHANICAL]
    driving = (electric > 0) & (mechanical > 0)  # not where the load drives the motor
    at_rest = run.inside("hold B") | run.inside("hold C")
    return [
        Check("mean P_E/P_M in lift", _mean_quotient(electric, mechanical, run.inside("lift")), "<=", 1.25),
        Check("mean P_E/P_M in raise", _mean_quotient(electric, mechanical, run.inside("raise")), ">=", 2),
        Check("largest P_M/P_E", float(np.max(mechanical[driving] / electric[driving], initial=0.0)), ">=", 0.9),
        Check("mean |P_M|/P_E at rest (0 to 1 %)", _mean_quotient(np.abs(mechanical), electric, at_rest), "<=", 0.01),
    ]


def _mean_quotient(a: np.ndarray, b: np.ndarray, mask: np.ndarray) -> float:
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.mean(a[mask] / b[mask]))


@row(17, "The motion is practically the same in all dynamic runs.", (7,))
def same_motion(runs: Runs) -> list[Check]:
    return [
        Check(
            f"largest RMS difference of the {end} holder's angle",
            largest(math.degrees(rms(a[f"robot.{end}_angle"] - b[f"robot.{end}_angle"])) for a, b in pairs(runs.dynamic)),
            "<=",
            0.5,
            "°",
        )
        for end in ("front", "rear")
    ]


@row(18, "The results are not highly sensitive to the contact parameters.", (9,))
def contact_parameters(runs: Runs) -> list[Check]:
    base = runs.kinematic[0.0]
    checks = []
    for (parameter, factor), run in sorted(runs.contact.items()):
        worst = largest(abs(run.mean(run.P, w) / base.mean(base.P, w) - 1) for w in ("hold A", "hold B", "hold C"))
        checks.append(Check(f"{parameter} × {factor:g}: largest shift of the mean P in A, B, C", worst, "<=", 0.03))
    return checks


@row(19, "The advice: friction slightly above the self-locking limit.", (16, 18))
def advice(runs: Runs) -> list[Check]:
    levels = sorted(runs.sweep)
    hold, move = zip(*(duty(runs.sweep[mu]) for mu in levels))
    total = [m + h for m, h in zip(move, hold)]
    best = levels[int(np.argmin(total))]
    beyond = [abs(h) for mu, h in zip(levels, hold) if mu >= LIMIT]
    below = [h for mu, h in zip(levels, hold) if mu <= LIMIT]
    return [
        Check(
            f"least fall of the energy to hold for {LONG_HOLD:g} s up to the limit", least_step([-h for h in below]), ">", 0, "J"
        ),
        Check("energy to hold at and above the limit / without friction", largest(beyond) / hold[0], "<=", 0.01),
        Check("least growth of the energy to move from one μ to the next", least_step(move), ">", 0, "J"),
        Check("best μ of moving once and holding long, at least the limit", best, ">=", LIMIT),
        Check("best μ of moving once and holding long, just above the limit", best, "<=", 1.25 * LIMIT),
    ]


def duty(run: Curves) -> tuple[float, float]:
    """Electric energy in J to hold configuration C for long, and to do the manoeuvre's two turns once."""
    return run.mean(ELECTRIC, (9.5, 10.0)) * LONG_HOLD, run.energy(ELECTRIC, (2.0, 4.0), (6.0, 8.0))
