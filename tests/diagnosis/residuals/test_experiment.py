"""The comparisons of a drive: residuals vanish for the law that made the log, and show in the residual that is wrong."""

from dataclasses import asdict, replace
from inspect import signature

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun, read
from selflock.diagnosis.judge.gain import comparisons, measure
from selflock.diagnosis.residuals import drive, loops
from selflock.diagnosis.residuals.blocks import Blocks
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.kernels import kernels
from selflock.diagnosis.residuals.laws import effects, in_proportion, parameters
from selflock.diagnosis.residuals.mending import Mending
from selflock.diagnosis.residuals.recorder import written_step
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.hypotheses import vocabulary
from selflock.diagnosis.search.problem import Problem

RIG = """
[rig]
kind = "{kind}"
[columns]
"reducer.input_speed" = "speed"
"motor.torque" = "torque"
[parameters]
"reducer.gear_ratio" = 50.0
"reducer.friction_kinetic" = 0.03
"reducer.shaft_inertia" = 1e-4
"load.inertia" = 0.05
"load.constant_torque" = 2.0
"""
STEP = 1e-3


def inverse(folder, rng, friction=0.03, n=6000, noise=1e-5):
    """A log made with the wedge's closed form (eq 2-13): F = P tan(alpha + phi) driving, P tan(alpha - phi) back-driving."""
    (folder / "rig.toml").write_text(RIG.format(kind="inverse"))
    time = np.arange(n) * STEP
    speed = 60.0 * np.sin(1.3 * time)
    acceleration = 78.0 * np.cos(1.3 * time)
    load = 2.0 + 0.05 * acceleration / 50.0
    alpha, phi = np.arctan(1 / 50.0), np.arctan(friction)
    torque = load * np.where(load * speed > 0.0, np.tan(alpha + phi), np.tan(alpha - phi)) + 1e-4 * acceleration
    torque += noise * rng.standard_normal(n)
    pd.DataFrame({"time": time, "speed": speed, "torque": torque}).to_csv(folder / "log.csv", index=False)
    rig = rigs.load(folder / "rig.toml")
    runs = read(folder / "log.csv", rig)
    check(runs, rig)
    return DriveExperiment(rig, runs)


def error(bench, residual, values):
    parts = [(measured - simulated)[good] for simulated, measured, good in bench.compare(residual, values)]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def test_the_closed_form_of_the_wedge_leaves_only_noise(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    (gear,) = bench.residuals
    assert gear.components == ("reducer", "load")
    assert error(bench, gear, {}) < 3e-5
    assert error(bench, gear, {"reducer.friction_kinetic": 0.025}) > 5e-3


def test_residuals_are_binned_by_block_and_absent_where_the_shaft_turns_round(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    present = bench.present({})
    assert bench.misfit({}).shape == present.shape and present.shape[0] == bench.layout.count
    assert 0.8 < present.mean() < 1.0


def test_a_sensor_is_undone_on_inputs_and_applied_to_outputs(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    (gear,) = bench.residuals
    nominal = bench.compare(gear, {})[0][0]
    np.testing.assert_allclose(bench.compare(gear, {"sensor.motor.torque.bias": 0.1})[0][0], nominal + 0.1, atol=1e-12)
    np.testing.assert_allclose(bench.compare(gear, {"sensor.motor.torque.scale_factor": 2.0})[0][0], 2.0 * nominal, atol=1e-12)
    ch = bench.channels[0, ""]
    np.testing.assert_allclose(
        ch.true("reducer.input_speed", {"sensor.reducer.input_speed.scale_factor": 0.5}), 2.0 * ch.raw("reducer.input_speed")
    )
    slow = ch.true("reducer.input_speed", {"sensor.reducer.input_speed.lag_time": 0.02})
    np.testing.assert_allclose(
        slow[100:-100], 60.0 * np.sin(1.3 * (np.arange(6000) * STEP + 0.02))[100:-100], atol=0.05
    )  # earlier by the lag


def test_gain_is_measured_on_the_blocks_that_are_asked_for(tmp_path, rng):
    bench = inverse(tmp_path, rng, friction=0.04)
    (gear,) = bench.residuals
    held = np.arange(bench.layout.count) % 3 == 2
    gain = measure(Mending(bench, gear, {}, {"reducer.friction_kinetic": 0.04}, held), ["block"], np.random.default_rng(0))
    assert gain.before > 50 * gain.after and gain.closed > 0.99 and gain.low <= gain.after <= gain.high
    worse = measure(Mending(bench, gear, {"reducer.friction_kinetic": 0.04}, {}, held), ["block"], np.random.default_rng(0))
    assert worse.closed == 0.0 and worse.regimes[0]["after"] > worse.regimes[0]["before"]


def test_errors_are_told_beside_the_signal_and_as_mean_absolute_ones(tmp_path, rng):
    """Against their definitions, over the samples that are trusted in the blocks that judge."""
    bench = inverse(tmp_path, rng, friction=0.04)
    (gear,) = bench.residuals
    held = np.arange(bench.layout.count) % 3 == 2
    mending = Mending(bench, gear, {}, {"reducer.friction_kinetic": 0.04}, held)
    gain = measure(mending, ["block"], np.random.default_rng(0))
    ((simulated, measured, good),) = bench.compare(gear, {})
    there = good & held[bench.layout.block(0)]
    off, signal = (measured - simulated)[there], np.std(measured[there])
    assert gain.signal == pytest.approx(signal)
    assert gain.share_before == pytest.approx(np.sqrt(np.mean(off**2)) / signal) == gain.before / gain.signal
    assert gain.absolute_before == pytest.approx(np.mean(abs(off))) and gain.absolute_before < gain.before
    assert gain.share_after < 0.02 * gain.share_before and gain.absolute_after < 0.02 * gain.absolute_before
    assert f"{100 * gain.share_before:.3g} -> " in gain.relative and gain.relative.endswith("% of the signal")
    (row,) = comparisons(mending, gain)
    assert (row["comparison"], row["channel"], row["unit"]) == ("gear", "motor.torque", "N.m")
    assert all(row[key] == value for key, value in asdict(gain).items() if key in row and key != "unit")


def test_every_comparison_is_told_and_a_signal_that_stands_still_has_no_share(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    (gear,) = bench.residuals
    flat = replace(gear, name="flat", compute=lambda values, ch: (np.zeros(6000), np.full(6000, 2.0), np.ones(6000, bool)))
    both = bench.but(residuals=(gear, flat))
    held = np.ones(bench.layout.count, bool)
    mending = Mending(both, gear, {}, {"reducer.friction_kinetic": 0.04}, held)
    first, second = comparisons(mending, measure(mending, ["block"], rng))
    assert first["before"] != first["after"] and second["before"] == second["after"] == second["absolute_after"] == 2.0
    assert (second["comparison"], second["signal"], second["share_before"], second["share_after"]) == ("flat", 0.0, None, None)


def test_the_vocabulary_is_that_of_the_components_and_channels_in_play(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    labels = {h.label for h in vocabulary(bench.rig, bench.components, bench.measured, bench)}
    assert {"reducer stribeck", "reducer ripple", "load tilt", "sensor bias (motor.torque)", "reducer.friction_kinetic"} <= labels
    assert not any(label.startswith(("motor ", "controller")) for label in labels)


@pytest.mark.parametrize("ratio", [50.0, 5000.0])
def test_a_wave_that_no_run_goes_through_once_is_not_looked_for(tmp_path, ratio, rng):
    bench = inverse(tmp_path, rng)
    bench = DriveExperiment(replace(bench.rig, parameters={**bench.rig.parameters, "reducer.gear_ratio": ratio}), bench.runs)
    turns = 2.0 * 60.0 / 1.3 / (2.0 * np.pi)  # of 60 sin(1.3 t) rad/s over its 6 s, to and fro
    (ripple,) = [h for h in vocabulary(bench.rig, bench.components, bench.measured, bench) if h.effect == "ripple"]
    orders = {p.name: p.low for p in ripple.free if p.name.endswith("_order")}
    assert orders["reducer.input_ripple_order"] == 1.0
    if ratio == 50.0:
        assert orders["reducer.output_ripple_order"] == pytest.approx(ratio / turns, rel=0.01)
    else:  # not even the shortest
        assert not any("output" in p.name for p in ripple.free)


def test_a_torque_is_looked_for_up_to_a_share_of_what_the_motor_gives_at_rest(tmp_path, rng):
    """K_m U / R: of a large motor's cogging 0.1 N.m was the most, so that it was told as a ripple of its gear."""
    bench = inverse(tmp_path, rng)
    large = {"motor.torque_constant": 0.4, "motor.resistance": 0.5, "controller.voltage_max": 60.0}
    bench = DriveExperiment(replace(bench.rig, parameters={**bench.rig.parameters, **large}), bench.runs)
    found = {p.name: p for h in vocabulary(bench.rig, {"motor", "reducer"}, bench.measured, bench) for p in h.free}
    share = {p.name: p.of_drive for of in ("motor", "reducer") for effect in effects(of) for p in effect.parameters}
    for name in ("motor.cogging_torque", "reducer.input_ripple_torque"):
        assert found[name].high == pytest.approx(share[name.split(".")[1]] * 0.4 * 60.0 / 0.5)
    assert found["reducer.input_ripple_torque"].low == -found["reducer.input_ripple_torque"].high


def test_what_the_winding_and_its_supply_lose_is_looked_for_up_to_a_share_of_the_motor_at_rest(tmp_path, rng):
    """Of R, R/U and R/U^2: a supply of 5 Ohm was the most, so that one of 5.8 was told as a limit of the command, and a small motor's
    constant could lose a twentieth of itself at most."""
    bench = inverse(tmp_path, rng)
    small = {
        "motor.torque_constant": 0.01,
        "motor.resistance": float(rng.uniform(10.0, 60.0)),
        "controller.voltage_max": 6.0,
        "controller.voltage_min": -6.0,
    }
    bench = DriveExperiment(replace(bench.rig, parameters={**bench.rig.parameters, **small}), bench.runs)
    found = {p.name: p for h in vocabulary(bench.rig, {"motor"}, bench.measured, bench) for p in h.free}
    share = {p.name: p.of_drive for effect in effects("motor") for p in effect.parameters}
    r = small["motor.resistance"]
    for name, of in (("supply_resistance", r), ("weakening_per_current", r / 6.0), ("weakening_per_loss", r / 36.0)):
        assert found["motor." + name].high == pytest.approx(share[name] * of)


def test_the_motor_of_an_hour_is_simulated_piece_by_piece_to_the_same_bits(tmp_path, rng, monkeypatch):
    n, rules = int(rng.integers(900, 1100)), RULES.residuals
    time = np.cumsum(rng.uniform(0.9e-3, 1.1e-3, n))
    columns = {"speed": 60.0 * np.sin(9.0 * time), "u": rng.uniform(-24.0, 24.0, n), "i": rng.uniform(-9.0, 9.0, n)}
    (tmp_path / "rig.toml").write_text(
        '[rig]\nkind = "inverse"\n[columns]\n"reducer.input_speed" = "speed"\n"motor.voltage" = "u"\n"motor.current" = "i"\n'
    )
    pd.DataFrame({"time": time} | columns).to_csv(tmp_path / "log.csv", index=False)
    rig = rigs.load(tmp_path / "rig.toml")
    bench = DriveExperiment(rig, read(tmp_path / "log.csv", rig))
    (motor,) = (one for one in bench.residuals if one.kind == "motor")
    heat = {"motor.weakening_per_loss": 1e-3, "motor.thermal_time": 0.2}
    for late in (0.0, 0.2e-3, -1.7e-3):
        values = heat | {"recorder.motor.voltage.shift": late}
        monkeypatch.setitem(vars(rules), "motions_remembered", 10 * n)
        at_once = bench.but().compare(motor, values)[0][0]
        bench.channels[0, ""].memory.clear()
        monkeypatch.setitem(vars(rules), "motions_remembered", n - 1)
        monkeypatch.setitem(vars(rules), "piece", int(rng.integers(2, n + 9)))
        np.testing.assert_array_equal(bench.but().compare(motor, values)[0][0], at_once)
        bench.channels[0, ""].memory.clear()
    assert np.ptp(at_once) > 1.0


LAWS_OF = {
    "averaged": (), "read": (loops.sensor,), "read_anew": (loops.sensor,), "undo": (loops.sensor,), "motor": (loops.dc,),
    "motor_further": (loops.dc,), "shaft_torque": (loops.dc,),
    "load_torque": (loops.load,), "gear": (loops.shaft,), "windup": (loops.shaft,), "controller": (loops.pd,),
    "whole": (loops.pd, loops.dc, loops.shaft, loops.load),
    "closed": (loops.pd, loops.dc, loops.shaft, loops.load, loops.sensor, loops.sensor),
}  # fmt: skip
NUMBERS = {
    "time": 0.01,
    "closed": 1.0,
    "parts": 2,
    "sensed": 1.0,
    "at_motor": 0.0,
    "looped": 1.0,
    "behind": 1.0,
    "ticked": 0.0,
    "at": np.array([0, 20]),
}
NUMBERS |= {
    "weights": np.array([0.5, 0.2, 0.05]),
    "begins": np.array([0, 13, 20]),
    "place": 2,
    "over": 1,
    "knots": np.array([-9.0, 0.0, 1.0, 7.0]),
    "heights": np.full(4, 1e-3),
}


def test_stretches_of_rows_are_read_as_logs_of_their_own(rng):
    x, dt, whole, apart = rng.uniform(-1.0, 1.0, 30), np.full(30, STEP), np.empty(30), np.empty(30)
    p = parameters("sensor", "s", {"s.lag_time": 0.02, "s.bias": 0.3})
    kernels().read_anew(p, x, dt, np.array([0, 13, 20]), whole)
    for part in (slice(0, 13), slice(13, 20), slice(20, 30)):
        kernels().read(p, x[part], dt[part], apart[part])
    assert np.array_equal(whole, apart)


def test_all_loops_are_compiled():
    assert LAWS_OF.keys() == vars(kernels()).keys()


@pytest.mark.parametrize("name", LAWS_OF)
def test_kernels_agree_with_the_plain_laws(name, rng):
    """Looped over as plain Python, with an effect of each component on."""
    n = 50
    on = {
        "motor.brush_voltage": 0.7,
        "reducer.viscous_damping": 1e-3,
        "controller.dead_zone": 0.1,
        "load.tilt_error": 0.1,
        "sensor.lag_time": 0.02,
        "sensor.bias": 0.3,
        "motor.weakening_per_loss": 1e-3,
        "reducer.compliance": 1e-4,
    }
    plain, compiled = getattr(loops, name), getattr(kernels(), name)
    names = list(signature(plain).parameters)[len(LAWS_OF[name]) :]
    shapes = {"x": n + 4, "start": 4, "starts": (2, 4), "out": (8, n), "asked": (2, n), "ahead": (2, n)}
    arrays = {key: NUMBERS.get(key, rng.uniform(-20.0, 20.0, shapes.get(key, n))) for key in names} | {"dt": np.full(n, STEP)}
    arrays = {key: arrays[key] for key in names}
    found = []
    for function, second in ((plain, False), (compiled, True)):
        given = []
        for law in LAWS_OF[name]:
            part = law.__name__.split(".")[-2]
            p = parameters(part, part, on)
            given.append(p if second else law.Parameters(*p))
        mine = {key: np.copy(value) if isinstance(value, np.ndarray) else value for key, value in arrays.items()}
        function(*given, *mine.values())
        found.append(mine)
    for key in names:
        assert found[1][key] == pytest.approx(found[0][key], rel=1e-9, abs=1e-9), key
    assert any(np.any(found[0][key] != arrays[key]) for key in names)


@pytest.mark.parametrize("bends", ["", "cogging_torque", "weakening_per_loss", "weakening_per_current"])
def test_a_motor_without_an_effect_on_its_torque_has_one_constant_for_all_rows(bends, rng):
    """And is known as that: nothing is computed row by row. Brushes lose a voltage, and no torque."""
    n, given = 30, {"motor.brush_voltage": 0.5, "motor.winding_thermal_resistance": 5.0, "motor.torque_constant": 0.04}
    p = parameters("motor", "motor", given | ({f"motor.{bends}": 0.01} if bends else {}))
    constant, beside = np.empty(n), np.empty(n)
    kernels().shaft_torque(p, *rng.uniform(1.0, 5.0, (3, n)), np.full(n, STEP), constant, beside)
    assert in_proportion(p) == bool((constant == 0.04).all() and (beside == 0.0).all()) == (not bends)


def test_the_head_of_a_bench_compares_the_same_samples(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    (gear,) = bench.residuals
    whole, short = bench.compare(gear, {})[0], bench.head([2000]).compare(gear, {})[0]
    edge = 2000 - 2 * bench.reach(gear)  # smoothing ends there
    for a, b in zip(whole, short):
        assert len(b) == 2000
        np.testing.assert_allclose(b[:edge], a[:edge], rtol=1e-9)


def test_an_excerpt_says_of_its_samples_what_the_whole_log_does(tmp_path, rng):
    """Of a gear's balance, which remembers nothing: whatever its parameters and sensors are, and behind a gap."""
    inverse(tmp_path, rng, n=20_000)
    table = pd.read_csv(tmp_path / "log.csv").drop(index=range(7000, 7400))
    table.to_csv(tmp_path / "log.csv", index=False)
    rig = rigs.load(tmp_path / "rig.toml")
    runs = read(tmp_path / "log.csv", rig)
    check(runs, rig)
    bench = DriveExperiment(rig, runs, sampled=True)
    part = bench.excerpt()
    assert len(part.runs[0]) < 0.5 * len(bench.runs[0])
    usual = {}
    for values in (
        usual,
        {"reducer.friction_kinetic": 0.02},
        {"load.inertia": 0.1},
        {"reducer.shaft_inertia": 3e-4},
        {"sensor.motor.torque.scale_factor": 1.1},
    ):
        np.testing.assert_allclose(part.misfit(values), bench.misfit(values), rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(part.present(values), bench.present(values))
    assert not bench.present(usual).all()


def test_a_short_log_has_no_excerpt(tmp_path, rng):
    bench = inverse(tmp_path, rng, n=3000)
    assert bench.excerpt() is bench


@pytest.mark.slow
def test_a_comparison_names_all_that_it_uses(tmp_path, rng):
    """What a residual does not use may change without changing it: else a remembered residual would be another's."""
    from ..plant import bench as plant

    rig, log, _ = plant.hide([], seed=int(rng.integers(1000)), duration=4.0).write(tmp_path)
    rig = rigs.load(rig)
    runs = read(log, rig)
    check(runs, rig)
    bench = DriveExperiment(rig, runs)
    asked = 0
    for hypothesis in vocabulary(rig, bench.components, bench.measured, bench):
        for p in hypothesis.free:
            value = p.nominal + 0.3 * (p.high - p.nominal if p.high > p.nominal else p.low - p.nominal)
            for residual in bench.residuals:
                if not residual.uses(p.name):
                    asked += 1
                    assert np.array_equal(bench.binned(residual, {p.name: value})[0], bench.binned(residual, {})[0]), (
                        residual.name,
                        p.name,
                    )
    assert asked > 50


@pytest.fixture
def drive_bench(tmp_path, rng):
    """A sound hidden drive, 4 s at 500 Hz with all its channels."""
    from ..plant import bench as plant

    rig, log, _ = plant.hide([], seed=int(rng.integers(1000)), duration=4.0).write(tmp_path)
    rig = rigs.load(rig)
    runs = read(log, rig)
    check(runs, rig)
    return DriveExperiment(rig, runs)


@pytest.mark.slow
def test_no_comparison_trusts_a_sample_whose_inputs_are_faulty(drive_bench):
    (run,) = drive_bench.runs
    for residual in drive_bench.residuals:
        for channel in (*residual.reads, residual.output):
            other = replace(run, good={**run.good, channel: np.arange(len(run)) % 100 >= 10})
            bench = DriveExperiment(drive_bench.rig, [other])
            ((_, _, good),) = bench.compare(next(c for c in bench.residuals if c.name == residual.name), {})
            assert good.any() and not good[~other.good[channel]].any(), (residual.name, channel)


def test_what_the_rig_says_of_one_log_acts_in_every_comparison(drive_bench):
    """Its parameters stand over the nominal ones there, and nowhere else."""
    (run,) = drive_bench.runs
    drive_bench = DriveExperiment(replace(drive_bench.rig, smoothing=0.02), [run])
    for residual, name, value in (
        ("controller", "controller.angle_gain", 7.0),
        ("motor", "motor.resistance", 3.0),
        ("gear", "load.mass", 9.0),
    ):
        for log in ("this.csv", "other.csv"):
            bench = DriveExperiment(replace(drive_bench.rig, logs={"this*": {name: value}}), [replace(run, log=log)])
            mine = next(c for c in bench.residuals if c.name == residual)
            simulated = bench.compare(mine, {})[0][0]
            wanted = drive_bench.compare(
                next(c for c in drive_bench.residuals if c.name == residual), {name: value} if log == "this.csv" else {}
            )[0][0]
            np.testing.assert_array_equal(simulated, wanted)


def test_a_controller_acts_on_what_its_encoder_says(drive_bench):
    """Right or wrong: that the encoder of the motor's shaft is thought wrong changes nothing of what the controller was told."""
    (run,) = drive_bench.runs
    signals = {name: x for name, x in run.signals.items() if not name.startswith("load.")}
    bench = DriveExperiment(drive_bench.rig, [replace(run, signals=signals, good={name: run.good[name] for name in signals})])
    residual = next(c for c in bench.residuals if c.name == "controller")
    right, wrong = (bench.compare(residual, {"sensor.reducer.input_angle.scale_factor": factor})[0][0] for factor in (1.0, 1.05))
    np.testing.assert_array_equal(right, wrong)


def test_every_sample_lies_in_a_block_of_its_own_run():
    for lengths in ((441, 200), (437,), (20, 700, 33), (980, 981, 21)):
        runs = [MeasuredRun("log", str(i), np.arange(n), np.arange(n) * 1e-3, {}) for i, n in enumerate(lengths)]
        layout = Blocks(runs, False)
        assert len(layout.run_of) == layout.count == 1 + max(int(p.max()) for p in layout.place) // layout.bins
        for i, place in enumerate(layout.place):
            assert (layout.run_of[place // layout.bins] == i).all()
            assert (layout.block(i) == place // layout.bins).all()


def test_a_sensors_lag_begins_anew_behind_a_gap(drive_bench):
    ch = drive_bench.channels[0, ""]
    ch.take = np.concatenate([np.arange(100, 200), np.arange(900, 1000)])
    held = np.repeat([1.0, 5.0], 100)  # what is settled in either stretch stays
    for lag in (0.05, -0.05):
        shown = drive.read("motor.current", held, {"sensor.motor.current.lag_time": lag}, ch)
        np.testing.assert_allclose(shown, held, rtol=1e-12)


def test_what_is_measured_as_a_current_is_compared_as_one(drive_bench):
    """The balance asks for half the current where the motor makes twice the torque of it; a scale of the sensor shows in it."""
    gear = next(c for c in drive_bench.residuals if c.kind == "gear")
    assert (gear.unit, gear.quantity) == ("A", "motor.current")
    constant = drive_bench.setting.value("motor.torque_constant", {})
    asked = drive_bench.compare(gear, {})[0][0]
    for values, times in (({"motor.torque_constant": 2.0 * constant}, 0.5), ({"sensor.motor.current.scale_factor": 1.2}, 1.2)):
        np.testing.assert_allclose(drive_bench.compare(gear, values)[0][0], times * asked, rtol=1e-9, atol=1e-12)


def test_a_static_friction_that_the_rig_leaves_open_is_what_it_says(tmp_path, rng):
    """Elsewhere it is counted from the kinetic one; a range in the rig is that of the number itself."""
    inverse(tmp_path, rng)
    path = tmp_path / "rig.toml"
    path.write_text(path.read_text() + '"reducer.friction_static" = 0.05\n')
    for more, wanted in (("", 0.03 + 0.4), ('[uncertain]\n"reducer.friction_static" = [0.2, 0.7]\n', 0.4)):
        (tmp_path / "more.toml").write_text(path.read_text() + more)
        rig = rigs.load(tmp_path / "more.toml")
        bench = DriveExperiment(rig, read(tmp_path / "log.csv", rig))
        ground = Problem.of(bench, np.ones(bench.layout.count, bool))
        assert ground.absolute({"reducer.friction_static": 0.4})["reducer.friction_static"] == pytest.approx(wanted)
        free = [p for h in ground.hypotheses for p in h.free if p.name == "reducer.friction_static"]
        assert all(p.nominal == pytest.approx(0.02) for p in free) and bool(free) == (not more)


@pytest.mark.slow
def test_the_fmu_of_a_sampling_controller_samples_where_the_law_does(drive_bench, tmp_path):
    from selflock.diagnosis.output.extend import starts, with_fmus
    from selflock.fmus.build import build

    residual = next(c for c in drive_bench.residuals if c.name == "controller")
    values = {"controller.sample_period": 5 * drive_bench.step}
    short = drive_bench.head([300])
    path = build("Controller", tmp_path / "c.fmu", **starts("controller", "controller", {**short.rig.parameters, **values}))
    promised = short.compare(residual, values)[0][0]
    theirs = with_fmus(short, {"controller": path}, residual)
    np.testing.assert_allclose(theirs.compare(residual, values)[0][0], promised, rtol=1e-9, atol=1e-9)
    digits = 3.0 * written_step("controller.voltage", drive_bench.channels[0, ""])  # within a step a promise is the log's own
    assert np.ptp(np.flatnonzero(abs(np.diff(promised)) > digits)[1:] % 5) == 0  # it holds over five samples
