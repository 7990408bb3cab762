"""Claims 1 to 10: what the torques of the rear track holder are, and why."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from .check import Check, row
from .curves import LIMIT, Curves, Runs, apart, largest, least, pairs, rms

HOLDS = ("hold A", "hold B", "hold C")


@row(1, "Without friction the output torque is r times the input torque at every instant.", (8, 9))
def frictionless(runs: Runs) -> list[Check]:
    r = runs.facts.gear_ratio
    return [
        Check(f"max |r F − P| / max |P|, {mode}", float(np.max(np.abs(r * run.F - run.P)) / np.max(np.abs(run.P))), "<=", 1e-6)
        for mode, mu, run in runs.each()
        if mu == 0
    ]


@row(2, "The output torque is practically the same for every friction level and in both modes.", (9,))
def same_output_torque(runs: Runs) -> list[Check]:
    checks = [
        Check(
            "kinematic runs, largest RMS difference of P / RMS of P",
            largest(rms(a.P - b.P) / rms(a.P) for a, b in pairs(runs.kinematic)),
            "<=",
            0.01,
        )
    ]
    for window in ("lift", "lower", "raise", "hold C"):
        worst = largest(
            abs(d.mean(d.P, window) / k.mean(k.P, window) - 1) for d in runs.dynamic.values() for k in runs.kinematic.values()
        )
        checks.append(Check(f"dynamic against kinematic, mean P in {window}", worst, "<=", 0.03))
    for window in ("hold A", "hold B"):
        means = [run.mean(run.P, window) for _, _, run in runs.each()]
        checks.append(
            Check(f"spread of the mean P over all runs in {window} (indeterminate)", max(means) - min(means), unit="N.m")
        )
    return checks


@row(3, "A constant torque is needed while nothing rotates, and it differs between the configurations.", (8, 9))
def constant_at_rest(runs: Runs) -> list[Check]:
    checks = []
    for window, bound in zip(HOLDS, (0.025, 0.025, 0.08)):
        worst = largest(run.ripple(run.P, window) for _, _, run in runs.each())
        checks.append(Check(f"standard deviation of P / mean in {window}, worst of eight runs", worst, "<=", bound))
    for one, other in combinations(HOLDS, 2):
        nearest = least(apart(run.mean(run.P, one), run.mean(run.P, other)) for _, _, run in runs.each())
        checks.append(Check(f"mean P of {one} and {other} apart", nearest, ">", 0.05))
    still = runs.standstill
    assert still is not None  # one of the study's runs
    checks += [
        Check(f"standing still: standard deviation of P / mean in {w}", still.ripple(still.P, w), "<=", 0.005) for w in HOLDS
    ]
    return checks


@row(
    4, "The torque changes rapidly where the centre of pressure moves: at 2 s back under the axis, and near 4 s and 6 s.", (6, 8)
)
def centre_of_pressure(runs: Runs) -> list[Check]:
    checks = []
    away = []
    for _, _, run in runs.each():
        up = run.inside((2.5, 3.5))  # the holder is up in the air
        carried = run["robot.rear_ground_normal"][up] > 0
        away.append(float(np.max(np.abs(run["robot.rear_pressure_x"][up][carried]), initial=0.0)) if carried.any() else np.nan)
    checks.append(Check("rear centre of pressure from the axis, 2.5–3.5 s", largest(away), "<=", runs.facts.sprocket_radius, "m"))
    for window in ((1.9, 2.6), (3.6, 4.4), (5.9, 6.6)):
        contrast = least(_burst(run, window) for _, _, run in runs.each())
        checks.append(
            Check(f"largest |dP/dt| in {window[0]}–{window[1]} s / median over the run, least of eight runs", contrast, ">", 10)
        )
    return checks


def _burst(run: Curves, window: tuple[float, float]) -> float:
    rate = np.abs(np.gradient(run.P, run.time))
    return float(rate[run.inside(window)].max() / np.median(rate))


@row(
    5,
    "While lifted, the outside moment is mainly the holder's own weight: positive when lifting, negative when lowering.",
    (8, 9),
)
def own_weight(runs: Runs) -> list[Check]:
    checks = [
        Check("mean P in lift, least of eight runs", least(run.mean(run.P, "lift") for _, _, run in runs.each()), ">", 0, "N.m"),
        Check(
            "mean P in lower, largest of eight runs",
            largest(run.mean(run.P, "lower") for _, _, run in runs.each()),
            "<",
            0,
            "N.m",
        ),
    ]
    for window in ("lift", "lower"):
        worst = largest(
            abs(run.mean(run.P, window) / run.mean("robot.rear_gravity_moment", window) - 1) for _, _, run in runs.each()
        )
        checks.append(Check(f"|mean P / gravity moment − 1| in {window}, worst of eight runs", worst, "<=", 0.10))
    return checks


@row(6, "Just after 4 s the torque is not constant although nothing rotates: the ground's springs and dampers settle.", (8, 9))
def ground_settles(runs: Runs) -> list[Check]:
    moves, stays = [], []
    for run in runs.kinematic.values():
        level = run.mean(run.P, "hold B")
        moves.append(float(np.max(np.abs(run.P[run.inside((4.0, 4.5))] - level)) / abs(level)))
        width = int(round(0.2 / float(np.median(np.diff(run.time)))))
        average = np.convolve(run.P, np.ones(width) / width, mode="same")  # centred
        stays.append(float(np.max(np.abs(average[run.inside((5.0, 5.9))] - level)) / abs(level)))
    return [
        Check("largest |P − mean over hold B| / mean in 4.0–4.5 s", least(moves), ">", 0.05),
        Check("0.2 s moving average of P off the mean in 5.0–5.9 s", largest(stays), "<=", 0.02),
    ]


def _input_ratios(runs: Runs, mu: float, directions: dict[str, int]) -> list[Check]:
    """F(mu)/F(0) of the kinematic runs in windows, against tan(alpha ± phi)/tan alpha."""
    run, base = runs.kinematic[mu], runs.kinematic[0.0]
    checks = []
    for window, direction in directions.items():
        expected = runs.facts.sliding_ratio(mu, direction)
        ratio = run.mean(run.F, window) / base.mean(base.F, window)
        checks.append(Check(f"F({mu:g})/F(0) in {window}", ratio))
        checks.append(Check(f"F({mu:g})/F(0) in {window}, distance from {expected:.4f}", abs(ratio / expected - 1), "<=", 0.01))
    return checks


@row(7, "Friction below the limit: much less torque to hold, more to lift, less to brake.", (10, 13))
def below_limit(runs: Runs) -> list[Check]:
    down = {window: -1 for window in (*HOLDS, "lower")}
    return [
        check
        for mu in sorted(runs.kinematic)
        if 0 < mu < LIMIT
        for check in _input_ratios(runs, mu, down | {"lift": 1, "raise": 1})
    ]


@row(8, "At the limit: holding torque practically zero, braking torque very small, lifting takes more.", (11, 13))
def at_limit(runs: Runs) -> list[Check]:
    run = runs.kinematic[LIMIT]
    held = largest(float(np.max(np.abs(run.F[run.inside(window)]))) for window in HOLDS)
    return [
        Check("max |F| in the holds / max |F|", held / float(np.max(np.abs(run.F))), "<=", 1e-9),
        *_input_ratios(runs, LIMIT, {"lift": 1}),
    ]


@row(9, "Beyond the limit the holder must be driven down; at rest no input torque; lifting takes most.", (12, 13))
def beyond_limit(runs: Runs) -> list[Check]:
    run = runs.kinematic[0.03]
    lower = run.inside("lower")
    held = largest(float(np.max(np.abs(run.F[run.inside(window)]))) for window in HOLDS)
    return [
        Check("least F ω in lower", float(np.min((run.F * run["rear_reducer.input_speed"])[lower])), ">", 0, "W"),
        Check("max |F| in the holds", held, "<=", 0, "N.m"),
        *_input_ratios(runs, 0.03, {"lift": 1}),
    ]


@row(10, "Among the possible input torques at rest the smallest is chosen.", (10, 11, 12))
def smallest_at_rest(runs: Runs) -> list[Check]:
    step, off = 1e-4, []
    for mu, run in runs.kinematic.items():
        for window in HOLDS:
            for k in np.flatnonzero(run.inside(window))[::50]:
                unit = abs(run.P[k]) * np.tan(runs.facts.alpha)
                smallest = least_admissible(run.P[k], mu, runs.facts.alpha, runs.facts.preload, step)
                off.append(abs(abs(run.F[k]) - smallest) / unit)
    return [Check("|F| against a search over the friction cone, in parts of |P| tan α", largest(off), "<=", 1.01 * step)]


def least_admissible(P: float, mu: float, alpha: float, preload: float, step: float) -> float:
    """Smallest |F| with |T| <= mu max(N0, |N|) (eq 4, 7, 14) by trying all F on a grid of step * |P| tan(alpha), N.m."""
    count = int(round(3 / step))
    F = np.arange(-count, count + 1) * (step * abs(P) * np.tan(alpha))
    N = P * np.cos(alpha) + F * np.sin(alpha)
    T = F * np.cos(alpha) - P * np.sin(alpha)
    admissible = np.abs(T) <= mu * np.maximum(preload, np.abs(N)) + 1e-12 * abs(P)
    return float(np.min(np.abs(F[admissible]), initial=np.inf))
