"""Numbers are searched within what a drive has of their unit: bounds that hold for a crane are no scale for a toy."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.fit import scale
from selflock.diagnosis.search.hypotheses import vocabulary
from selflock.diagnosis.search.reach import amounts, told_of_supply, with_supply

VOLTS = 12.0


def drive(rng, torque_constant, resistance, **parameters):
    """A log of a drive by voltage, and the rig that says so."""
    n = 200
    angle = np.cumsum(rng.normal(0.0, 0.1, n))
    signals = {"motor.voltage": rng.uniform(-VOLTS, VOLTS, n), "motor.current": rng.normal(0.0, 1.0, n), "load.angle": angle}
    signals["motor.voltage"][7] = VOLTS
    given = {
        "motor.torque_constant": torque_constant,
        "motor.voltage_constant": torque_constant,
        "motor.resistance": resistance,
        "reducer.gear_ratio": 40.0,
        "reducer.shaft_inertia": 1e-7,
        "load.inertia": 2e-4,
        "load.mass": 0.5,
        "load.arm": 0.1,
    }
    given |= {name.replace("__", "."): value for name, value in parameters.items()}
    rig = Rig(Path("rig.toml"), "toy", "forward", tuple(LogColumn(n, n) for n in signals), given, time=LogColumn("time", "time"))
    return DriveExperiment(rig, [MeasuredRun("log.csv", "", np.arange(n), 0.01 * np.arange(n), signals)])


def numbers(bench):
    return {p.name: p for h in vocabulary(bench.rig, {"motor", "reducer", "load"}, bench.measured, bench) for p in h.free}


def test_what_a_drive_has_of_each_unit(rng):
    """At the motor's shaft and, by the gear's ratio, at the load: K_m U / R, K_m K_e / R, and what hangs in balance with it."""
    k, r = rng.uniform(0.003, 0.03), rng.uniform(1.0, 5.0)
    bench = drive(rng, k, r)
    motor, load = (amounts(bench.rig, part, bench.measured, bench) for part in ("motor", "load"))
    assert motor["N.m"] == pytest.approx(k * VOLTS / r)
    assert load["N.m"] == pytest.approx(40.0 * motor["N.m"])
    assert motor["N.m.s/rad"] == pytest.approx(k * k / r)
    assert load["N.m.s/rad"] == pytest.approx(40.0**2 * k * k / r)
    assert load["kg"] * 9.81 * 0.1 == pytest.approx(load["N.m"]) == 0.5 * 9.81 * load["m"]
    assert load["kg.m2"] == pytest.approx(2e-4 + 0.5 * 0.1**2 + 1e-7 * 40.0**2)
    assert motor["rad/N.m"] * load["N.m"] == pytest.approx(1.0)


@pytest.mark.parametrize("channel, factor", [("load.angle", 40.0), ("reducer.input_angle", 1.0)])
def test_wear_is_looked_for_within_what_a_shaft_went(rng, channel, factor):
    """Of a worm's long way a hundredth of all that any drive may wear was twice its friction: the look never saw it."""
    bench = drive(rng, 0.004, 6.0)
    (run,) = bench.runs
    run.signals[channel] = angle = 1e3 * run.signals["load.angle"]
    way = factor * float(abs(np.diff(angle)).sum())
    found = numbers(bench)["reducer.wear_rate"]
    assert amounts(bench.rig, "reducer", bench.measured, bench)["1/rad"] == pytest.approx(1.0 / way)
    assert (found.low, found.high) == pytest.approx((-3.0 / way, 3.0 / way))
    assert RULES.search.leading * RULES.search.difference * scale(found, 0.0) * way < 0.1  # of the friction


@pytest.mark.parametrize("channel, factor", [("reducer.input_speed", 1.0), ("load.speed", 40.0)])
def test_a_shafts_way_is_told_by_its_speed_where_no_angle_is_measured(rng, channel, factor):
    bench = drive(rng, 0.004, 6.0)
    speed = rng.normal(0.0, 30.0, 500)
    run = MeasuredRun("log.csv", "", np.arange(500), 0.01 * np.arange(500), {channel: speed})
    found = amounts(bench.rig, "load", set(), SimpleNamespace(runs=[run], components={}, rig=bench.rig))
    assert found["1/rad"] == pytest.approx(40.0 / (factor * 0.01 * abs(speed[1:]).sum()))


def test_a_derivative_is_taken_over_a_small_part_of_what_the_drive_has(rng):
    """Of a small motor K_m K_e / R was less than what its friction was moved by, so that nothing was seen of it."""
    bench = drive(rng, 0.004, 6.0)
    found, amount = numbers(bench), amounts(bench.rig, "reducer", bench.measured, bench)["N.m.s/rad"]
    for name, most in (("reducer.viscous_damping", amount), ("load.damping", amount * 40.0**2)):
        assert 0.0 < RULES.search.difference * scale(found[name], 0.0) < 1e-3 * most
        assert found[name].high >= 5.0 * most


def test_what_a_rig_says_is_within_the_search(rng):
    """However large: a data sheet may know of a brake."""
    bench = drive(rng, 0.004, 6.0, reducer__viscous_damping=0.3)
    assert numbers(bench)["reducer.viscous_damping"].high >= 0.6


def test_where_nothing_tells_of_a_motor_bounds_are_the_laws_own(rng):
    """Of a gear on a bench nobody knows what turns it."""
    bench = drive(rng, 0.004, 6.0)
    apart = {name: value for name, value in bench.rig.parameters.items() if not name.startswith("motor.")}
    signals = {"reducer.input_speed": rng.normal(0.0, 9.0, 200), "reducer.input_torque": rng.normal(0.0, 1.0, 200)}
    signals["reducer.output_torque"] = rng.normal(0.0, 9.0, 200)
    rig = replace(bench.rig, kind="inverse", parameters=apart, columns=tuple(LogColumn(n, n) for n in signals))
    gear = DriveExperiment(rig, [replace(bench.runs[0], signals=signals)])
    assert amounts(rig, "reducer", gear.measured, gear).keys() == {"1/rad"}
    free = {p.name: p for h in vocabulary(rig, {"reducer"}, gear.measured, gear) for p in h.free}
    assert free["reducer.viscous_damping"].high == 1.0 < inf


def test_an_effect_is_searched_as_far_from_what_a_rig_says_of_its_number_as_any_nominal_value_is(rng):
    """Ten N.m between flanks are many for any gear, and next to nothing more where the rig says 6.5 to 9.5."""
    said, factor = rng.uniform(6.5, 9.5), RULES.search.nominal_factor
    much, little = (
        numbers(drive(rng, 0.01, 2.0, reducer__preload=preload))["reducer.preload"] for preload in (said, 0.01 * said)
    )
    assert much.nominal == pytest.approx(said)
    assert much.high == pytest.approx(factor * said)
    assert little.high == 10.0
    assert much.low == little.low == 0.0


def test_a_supply_of_which_nothing_is_said_has_the_highest_voltage_that_the_motor_is_given(rng):
    """Of a law's own 24 V a toy of 6 V took a quarter, and the sag's resistance was as many times what it is."""
    bench = drive(rng, 0.004, 6.0)
    name = "motor.supply_voltage"
    assert with_supply(bench.rig, bench.runs).parameters == bench.rig.parameters | {name: VOLTS}
    limited = replace(
        bench.rig, parameters=bench.rig.parameters | {"controller.voltage_min": -15.0, "controller.voltage_max": 9.0}
    )
    assert with_supply(limited, bench.runs).parameters[name] == 15.0
    assert told_of_supply(limited, with_supply(limited, bench.runs)) == [
        f"{name} as the highest that the motor may be given, 15 V"
    ]
    assert told_of_supply(limited, limited) == []
    said = replace(bench.rig, parameters=bench.rig.parameters | {name: 48.0})
    assert with_supply(said, bench.runs) is said
    uncertain = replace(bench.rig, uncertain={name: (6.0, 24.0)})
    assert with_supply(uncertain, bench.runs) is uncertain
    measured = replace(bench.runs[0], signals=bench.runs[0].signals | {name: np.full(200, 13.0)})
    assert with_supply(bench.rig, [measured]) is bench.rig
