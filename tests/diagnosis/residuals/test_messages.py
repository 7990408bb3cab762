"""How old the rows of a table are that holds what was last sent, beside tables whose messages are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.residuals.channels import Channels
from selflock.diagnosis.residuals.kernels import kernels
from selflock.diagnosis.residuals.messages import _surest, age, evenly_sent, period, standing, told
from selflock.diagnosis.residuals.setting import Setting
from selflock.diagnosis.rules import RULES

STEP = 2e-3


def channels(time, signals, tmp_path):
    """A run with these channels at these times."""
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "forward"\n[columns]\n"motor.current" = "i"\n')
    rig = load(tmp_path / "rig.toml")
    run = MeasuredRun("log", "", np.arange(len(time)), time, signals)
    return Channels(run, "", Setting(rig, len(time), kernels(), {"": 1}))


def table(rng, rows, phase, jitter, held=True):
    """A motion and a noisy current that are sent every so many rows from `phase` on, and how old each row of both is, s."""
    time = STEP * (np.arange(3000) + jitter * rng.uniform(-0.2, 0.2, 3000))
    sent = phase * STEP + rows * STEP * np.floor((time / STEP - phase) / rows) if held else time
    number = np.floor((time / STEP - phase) / rows).astype(int) + 2 if held else np.arange(len(time))
    motion = np.sin(11.0 * sent) + 0.3 * np.sin(23.0 * sent)
    noisy = motion + 0.05 * rng.standard_normal(number.max() + 1)[number]
    return time, {"reducer.input_angle": 1e-4 * np.floor(motion / 1e-4), "motor.current": noisy}, time - sent


@pytest.mark.parametrize("rows", [2, 5])
def test_values_that_stand_in_several_rows_are_as_old_as_their_message(rows, rng, tmp_path):
    time, signals, old = table(rng, rows, 0.4, 0.0)
    ch = channels(time, signals, tmp_path)
    for name in signals:
        assert period(name, ch)[0] == rows and told(name, ch).all()
        np.testing.assert_allclose(age(name, ch)[20:], (old - old.min())[20:], atol=1e-9)


def test_lost_rows_leave_messages_their_ages(rng, tmp_path):
    time, signals, old = table(rng, 2, 0.4, 0.0)
    kept = np.r_[0:1000, 1013:3000]
    ch = channels(time[kept], {name: x[kept] for name, x in signals.items()}, tmp_path)
    found = age("motor.current", ch)
    behind = np.arange(len(kept)) == 1000  # whose message was lost, or not
    np.testing.assert_allclose(found[20:][~behind[20:]], (old - old.min())[kept][20:][~behind[20:]], atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("rows", "phase"), [(1, 0.5), (1, 0.9), (2, 1.1)])
def test_uneven_rows_hold_what_was_sent_at_even_times(rows, phase, rng, tmp_path):
    """Where messages come within what rows scatter by, too: but for rows in which nobody can say which they have."""
    time, signals, old = table(rng, rows, phase, 1.0)
    ch = channels(time, signals, tmp_path)
    assert evenly_sent(ch)
    for name in signals:
        sure, off = told(name, ch), age(name, ch) - old
        assert sure.mean() > 0.8
        assert np.mean(abs(off - np.median(off))[sure] < 0.02 * STEP) > 0.999


def test_a_table_that_was_read_at_once_is_as_its_stamps_say(rng, tmp_path):
    time, signals, _ = table(rng, 1, 0.0, 1.0, held=False)
    ch = channels(time, signals, tmp_path)
    assert not evenly_sent(ch)
    for name in signals:
        assert period(name, ch) == (1, None) and not age(name, ch).any() and told(name, ch).all()


def test_a_ramp_in_steps_says_nothing_of_when_its_rows_came(rng, tmp_path):
    """Each new value is one step on, as if at even times: a duty of 8 bits played from a table, beside a motion read at once."""
    time, signals, _ = table(rng, 1, 0.0, 1.0, held=False)
    step = 1.0 / 255.0
    signals["motor.duty"] = step * np.floor(rng.uniform(0.2, 0.45) * time / step / time[-1] * 20.0)
    assert not evenly_sent(channels(time, signals, tmp_path))
    del signals["reducer.input_angle"], signals["motor.current"]
    assert not evenly_sent(channels(time, signals, tmp_path))


@pytest.mark.parametrize(("acts", "others", "rows"), [(0.0, 1, 1), (0.0, 3, 2), (2 * STEP, 3, 1), (STEP, 1, 2)])
def test_a_command_that_stands_as_long_as_its_controllers_period_is_no_message(acts, others, rows, rng, tmp_path):
    """acts: the period that its rig gives, s, or none; others: rows in which the current stands."""
    time, signals, _ = table(rng, 2, 0.4, 0.0)
    current = table(rng, others, 0.4, 0.0)[1]["motor.current"]
    signals = {
        "controller.voltage": signals["motor.current"],
        "motor.current": current,
        "controller.angle_setpoint": np.sin(time),
    }
    ch = channels(time, signals, tmp_path)
    ch = replace(ch, setting=replace(ch.setting, rig=replace(ch.setting.rig, parameters={"controller.sample_period": acts})))
    assert standing("controller.voltage", ch)[0] == 2 and period("controller.voltage", ch)[0] == rows


def test_all_phases_at_once_are_each_by_itself(rng):
    """Rows that have the message of the row before, counted one phase after the other; among them rows behind a gap."""
    rows, parts = int(rng.integers(1, 8)), int(rng.choice([1, 20]))
    place = np.cumsum(rng.uniform(0.6, 1.4, 400) + 30.0 * (rng.random(400) < 0.02))
    equal, wrong = rng.random(399) < rng.uniform(0.1, 0.9), RULES.residuals.message_wrong
    found = _surest(equal, np.stack([place[:-1], place[1:]]), rows, parts)
    assert len(found) == rows * parts
    for k, sure in enumerate(found):
        again = np.diff(np.floor((place - k / parts) / rows)) == 0
        chance = np.where(again, 1.0 - wrong, equal[~again].mean() if (~again).any() else 0.0)
        likely = lambda p: np.log(np.where(equal, p, 1.0 - p)).sum()
        assert sure == pytest.approx(likely(chance) - likely(equal.mean()), abs=1e-8)
