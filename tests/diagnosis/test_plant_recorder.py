"""The drawn recorder: what it does to a channel is what it says; and a case knows what a true model leaves."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from .plant import faults, recordings, score
from .plant.drive import CHANNELS, Drive
from .plant.outside import MORE
from .plant.recorder import DENSE, LATEST, NOISE, Speed, draw


@pytest.fixture
def seed(rng):
    return recordings.DEVELOPMENT + int(rng.integers(10**6))


def _ramp(n=40_000, slope=2.0):
    rows = np.zeros((n, len(CHANNELS)))
    for name, factor in (("angle", 1.0), ("motor_angle", 50.0)):
        rows[:, CHANNELS.index(name)] = factor * slope * np.arange(n) * DENSE
    for name, factor in (("speed", 1.0), ("motor_speed", 50.0)):
        rows[:, CHANNELS.index(name)] = factor * slope
    return rows


ALL = ("current", "motor_angle", "motor_speed", "speed", "output_torque", "supply")


def test_what_is_drawn_is_within_what_recorders_do(seed):
    rng = np.random.default_rng(seed)
    drawn = [draw(rng) for _ in range(300)]
    assert all(r.control == 0.0 or 5e-5 - 1e-9 <= r.control <= 5e-3 + 1e-9 for r in drawn)
    assert all(5e-4 - 1e-9 <= r.step <= 5e-3 + 1e-9 and 10.0 <= r.duration <= 300.0 for r in drawn)
    assert all(0.0 <= lag <= LATEST for r in drawn for lag in r.lags.values())
    assert all(500 <= n <= 20_000 for r in drawn for n in r.counts.values())
    assert {s.by for r in drawn for s in r.speeds.values()} == {"difference", "tacho", "filter"}
    assert {s.rows for r in drawn for s in r.speeds.values()} == set(range(1, 11))
    for name in ("current", "motor_angle", "output_torque", "supply"):
        assert 0.1 < np.mean([name in r.channels for r in drawn]) < 0.95
    assert all({"motor_angle", "motor_speed"} & set(r.channels) for r in drawn)


def test_a_difference_of_a_ramp_is_its_slope_within_its_counts(seed):
    rng = np.random.default_rng(seed)
    r = draw(rng, ALL)
    r = replace(r, speeds=dict.fromkeys(r.speeds, Speed("difference", int(rng.integers(1, 11)))), jitter=0.0)
    assert np.allclose(r.read(_ramp(), 0)["speed"], 2.0, rtol=1e-9)
    off = abs(r.read(_ramp(), 0, rng)["speed"].to_numpy()[10:] - 2.0)
    count, rows = 2 * np.pi / r.counts["angle"], r.speeds["speed"].rows
    assert off.max() <= 2.0 * count / (rows * r.step) and (off.max() > 0.0)


def test_lags_and_filters_read_the_past(seed):
    rng = np.random.default_rng(seed)
    r = draw(rng, ALL)
    r = replace(r, lags=r.lags | {"angle": 1.7e-3}, speeds=dict.fromkeys(r.speeds, Speed("filter", time=5e-3)))
    late, prompt = r.read(_ramp(), 0), replace(r, lags=dict.fromkeys(r.lags, 0.0)).read(_ramp(), 0)
    assert np.allclose(prompt["angle"] - late["angle"], 2.0 * 1.7e-3)
    rows = _ramp()
    rows[:, CHANNELS.index("speed")] = np.where(np.arange(len(rows)) * DENSE < 5.0, 0.0, 1.0)
    read = replace(r, lags=dict.fromkeys(r.lags, 0.0)).read(rows, 0)
    after = read["time"] + 2.0 * LATEST - 5.0
    inside = (after > 1e-3) & (after < 0.02)
    assert np.allclose(read["speed"][inside], 1.0 - np.exp(-after[inside] / 5e-3), atol=0.06)


def test_noise_and_counts_are_as_large_as_told(seed):
    rng = np.random.default_rng(seed)
    r = draw(rng, ALL, true_speeds=True)
    off = {name: r.read(_ramp(), 0, rng)[name] - r.read(_ramp(), 0)[name] for name in ("current", "output_torque", "angle")}
    for name in ("current", "output_torque"):
        assert np.std(off[name]) == pytest.approx(r.noise[name], rel=0.15) and r.noise[name] >= NOISE[name]
    count = 2.0 * np.pi / r.counts["angle"]
    assert abs(off["angle"]).max() < 0.85 * count and abs(off["angle"].mean()) < 0.1 * count


@pytest.mark.slow
def test_a_voltage_changes_between_rows(seed):
    case = recordings.hide(
        [], seed, duration=10.0, recorder=replace(draw(np.random.default_rng(seed)), control=0.0, duration=10.0)
    )
    volts = recordings.dense(case.base, case.plans[0])[:, CHANNELS.index("voltage")]
    assert np.mean(np.diff(volts) != 0.0) > 0.5  # in every quarter of a millisecond


@pytest.mark.slow
def test_the_same_seed_makes_the_same_log_and_says_little(tmp_path, seed):
    first, second = (recordings.hide(["motor.brush_drop"], seed, duration=10.0).write(tmp_path / name) for name in ("a", "b"))
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(first, second))
    rig = tomllib.loads(first[0].read_text())
    assert set(rig) == {"rig", "columns", "parameters"} and set(rig["rig"]) == {"name", "kind"}
    header = first[1].read_text().split("\n", 1)[0].split(",")
    assert set(header) == {"time"} | {entry["column"] for entry in rig["columns"].values()}


@pytest.mark.slow
def test_the_true_model_leaves_the_noise_and_the_strength_is_what_it_mends(seed):
    case = recordings.hide(["load.mass"], seed, target=4.0, duration=10.0)
    (ratio,), (strength,), (hidden,) = case.ratios, case.strengths, case.causes
    if strength > hidden.extent[0]:
        assert ratio == pytest.approx(4.0, rel=0.15)
    else:  # a torque sensor of little noise feels the least that makes sense more than that
        assert ratio > 4.0
    assert case.strong
    best = max(case.off[name] / case.floor[name] for name in case.floor if name in recordings.SHOWN)
    assert best > 0.8 * case.ratios[0]  # the log that judges shows it at least as well as the weaker of the two
    if case.recorder.noise["current"] and "current" in case.floor:
        grain = 40.0 / 4096 / np.sqrt(12.0)
        assert case.floor["current"] == pytest.approx(np.hypot(case.recorder.noise["current"], grain), rel=0.1)


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("name", [*MORE, "controller.sampling"])
def test_a_further_cause_is_nothing_at_strength_zero_and_something_at_its_strength(name):
    rng = np.random.default_rng([5, len(name)])
    cause = recordings.DRAWS[name](rng, Drive())
    plan = recordings.motion(rng, 9.0, DENSE)
    plain = recordings.dense(Drive(), plan)
    if cause.extent[0] < cause.extent[1]:
        assert np.array_equal(recordings.dense(Drive()._replace(**cause.change(0.0)), plan), plain)
    assert not np.array_equal(recordings.dense(Drive()._replace(**cause.change(1.0)), plan), plain)


@pytest.mark.slow
def test_faults_are_where_they_are_said_to_be(seed):
    case = recordings.hide([], seed, faulty=True, duration=12.0)
    table, by = case.logs[0], {}
    for fault in case.placed:
        by.setdefault(fault["kind"], []).append(fault)
    assert set(by) == {"clipped", "frozen", "corrupted", "non-finite", "missing"}
    (gap,), (frozen,), (lost,) = by["missing"], by["frozen"], by["non-finite"]
    assert table["time"][gap["last"]] - table["time"][gap["first"]] > 0.2
    x = table[frozen["channel"]]
    assert np.ptp(x[frozen["first"] - 1 : frozen["last"] + 1]) == 0.0
    assert table[lost["channel"]][lost["first"] : lost["last"] + 1].isna().all()
    assert table.drop(columns="time").isna().sum().sum() == lost["last"] - lost["first"] + 1
    level = abs(table[by["clipped"][0]["channel"]]).max()
    clipped = np.concatenate([np.arange(f["first"], f["last"] + 1) for f in by["clipped"]])
    assert np.allclose(abs(table[by["clipped"][0]["channel"]][clipped].dropna()), level)
    assert len(clipped) == np.sum(abs(table[by["clipped"][0]["channel"]]) == level)


def test_clipping_is_of_one_channel_and_a_recording_is_long_enough_for_every_fault():
    rng = np.random.default_rng(1)
    r = draw(rng, ALL)
    table, placed = faults.spoil_recording(r.read(_ramp(), 0, rng), rng, ("current", "motor_speed", "angle"))
    assert len({f["channel"] for f in placed if f["kind"] == "clipped"}) == 1


def test_what_is_noted_of_faults_anyhow_is_what_is_wrong(seed):
    """Rows that are left are as they were, but for those that are noted; and what is lost is behind a row that is noted."""
    rng = np.random.default_rng(seed)
    sound = draw(rng, ALL, duration=10.0).read(_ramp(), 0, rng)
    channels = ("current", "motor_speed", "angle", "voltage")
    table, placed = faults.spoil_anyhow(sound, rng, channels)
    rows = {name: np.zeros(len(table), bool) for name in (*channels, "time")}
    for fault in placed:
        rows[fault["channel"]][fault["first"] : fault["last"] + 1] = True
    kept = np.isin(sound["time"], table["time"])
    for name in channels:
        left = sound[name][kept].to_numpy()
        off = (table[name].to_numpy() != left) & np.isfinite(left)
        assert not (off & ~rows[name]).any() or {f["kind"] for f in placed if f["channel"] == name} >= {"frozen"}
    lost = np.flatnonzero(np.diff(np.flatnonzero(kept)) > 1)
    assert rows["time"][lost].all() and (~kept).any() == rows["time"].any()


def test_fault_rows_are_counted_by_channel_and_kind():
    placed = [
        {"channel": "current", "first": 10, "last": 19, "kind": "frozen"},
        {"channel": "time", "first": 30, "last": 31, "kind": "missing"},
    ]
    told = lambda channel, first, last, kind: dict(log="a/train.csv", channel=channel, first=first, last=last, kind=kind)
    result = {
        "faults": [
            told("motor.current", 15, 22, "frozen"),  # five of ten, and three beside them, which are near enough
            told("load.angle", 15, 16, "frozen"),
            told("time", 30, 31, "missing"),
            told("motor.current", 40, 40, "corrupted"),
            told("motor.current", 10, 19, "frozen") | {"log": "a/test.csv"},
        ]
    }
    found = score.fault_rows(result, placed, "train")
    assert found == {"frozen": [10, 5, 10, 8], "missing": [2, 2, 2, 2], "corrupted": [0, 0, 1, 0]}


@pytest.mark.slow
def test_what_is_believed_is_counted_cause_by_cause():
    case = recordings.hide(["motor.brush_drop"], 10_001, duration=10.0)
    named = [dict(component="motor", effect="brush_drop", confidence=0.9), dict(component="load", effect="mass", confidence=0.4)]
    assert score.believed({"verdict": "explained", "causes": named}, case) == [(0.9, True), (0.4, False)]
    assert score.believed({"verdict": "unknown", "causes": named}, case) == []
