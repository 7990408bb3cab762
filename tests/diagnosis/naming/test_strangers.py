"""The hidden plants of benchmarks.strangers; what is named in them is the study's. Here: where steps would pass for a law."""

import subprocess
import sys
from copy import copy
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import strangers

from benchmarks.cases import rate
from selflock.diagnosis import name
from selflock.diagnosis.calibration.numbers import of_rig
from selflock.diagnosis.calibration.played import Played
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals.mending import rms
from selflock.diagnosis.systems.system import prepare


@pytest.mark.in_turn
@pytest.mark.slow
def test_steps_that_are_too_long_are_halved_and_nothing_is_named(tmp_path, monkeypatch):
    """FMUs in a ring hand over held values: with long steps what they leave looks like a lag between them."""
    monkeypatch.setattr(strangers, "ROWS", 300)
    rig, train, test = strangers.write(strangers.hide("none", 10_000, "electrical"), tmp_path)
    result = name(rig, [train], test=[test], out=None, starts=1)
    assert (result.verdict, result.causes) == ("none", [])
    assert any("0.0025 s are too long" in note for note in result.notes)


def test_what_hides_is_drawn_anew_for_each_seed_and_moves_what_is_recorded(monkeypatch):
    monkeypatch.setattr(strangers, "ROWS", 60)
    cases = [strangers.hide("path: offset", seed, "mechanical") for seed in (10_000, 10_001, 10_000)]
    first, other, again = (case.logs[0]["position"].to_numpy() for case in cases)
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert cases[0].right[1] == {"controller.wanted", "recorded controller.wanted"}


def test_the_right_name_beside_another_is_no_right_name_and_a_class_of_its_own():
    case = SimpleNamespace(
        kind="law", name="law: drag", right=({"drag", "quadratic"}, {"body.force"}, "body.v"), noise={"body.x": 0.1}, beyond={}
    )
    error = SimpleNamespace(name="body.x", before=1.0, after=0.1)
    first = lambda place, over, *beside, same=(): SimpleNamespace(
        law="drag", place=place, over=over, where="in", label=f"drag of {over} on {place}", beside=beside, same=same
    )
    answer = lambda *causes: strangers.judged(case, SimpleNamespace(verdict="", causes=causes, errors=[error]))
    told = lambda *causes: [answer(*causes)[key] for key in ("right", "alike")]
    assert told(first("body.force", "body.v")) == [True, False]
    assert told(first("controller.u", "body.v", "quadratic of body.v on body.force")) == [False, True]
    assert told(first("controller.u", "body.v", "cubic of body.v on body.force")) == [False, False]
    assert told(first("controller.u", "body.v")) == told() == [False, False]
    same = answer(first("controller.u", "body.v", same=["drag of body.v on body.force"]))  # told as one with it
    assert [same["right"], same["first"], same["alike"]] == [True, False, False]


@pytest.mark.parametrize(
    ("verdict", "after", "right"), [("unknown", 0.2, True), ("unknown", 0.8, False), ("explained", 0.2, False)]
)
def test_outside_the_library_a_curve_that_is_the_same_as_the_right_one_is_right(verdict, after, right):
    case = SimpleNamespace(
        kind="outside", name="outside: bump", right=({"table"}, {"coil.voltage"}, "coil.current"), noise={"coil.current": 0.1}
    )
    case.beyond = {"coil.current": 0.15}
    error = SimpleNamespace(name="coil.current", before=1.0, after=after)
    curve = lambda place, *same: SimpleNamespace(
        kind="curve", law="table", place=place, over="coil.current", where="in", label="", beside=[], same=same
    )
    for first in (curve("coil.voltage"), curve("coil.back", "curve of coil.current on coil.voltage")):
        row = strangers.judged(case, SimpleNamespace(verdict=verdict, causes=[first], errors=[error]))
        assert [row["right"], row["curve"]] == [right, verdict == "unknown"]
        assert row["of_reach"] == pytest.approx(1.0 - (after**2 - 0.1**2 - 0.15**2) / (1.0 - 0.1**2 - 0.15**2))
    assert not strangers.judged(case, SimpleNamespace(verdict=verdict, causes=[curve("coil.back")], errors=[error]))["right"]


VESSEL = '''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Vessel(Fmi2Slave):
    """Air in a vessel, from 7 bar and to 1 bar through a valve each."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.size, self.volume, self.begin, self.inlet, self.outlet, self.pressure, self.flow = 1.0, 9.0, 3.0, 0.5, 0.5, 3.0, 0.0
        for name in ("size", "volume", "begin"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("inlet", "outlet"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in ("pressure", "flow"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.pressure = self.begin

    def do_step(self, t, h):
        self.flow = 1.3 * self.inlet * abs(7.0 - self.pressure) ** 0.5
        self.pressure += h * (self.flow - self.size * self.outlet * abs(self.pressure - 1.0) ** 0.5) / self.volume
        return True
'''
VESSEL_RIG = """
[rig]
system = "Vessel.fmu"
step = 0.1
inputs = "held"

[columns]
"Vessel.inlet" = "inlet"
"Vessel.outlet" = "outlet"
"Vessel.pressure" = "pressure"
"Vessel.flow" = "flow"

[calibrate]
"Vessel.size" = { start = 1.0, low = 0.2, high = 5.0 }
"Vessel.begin" = { start = 3.0, low = 1.0, high = 6.0, each_run = true }
"""


def vessel(rng, rows=500, late=4, at_once=False, volume=9.0, noise=0.015):
    """A log of a vessel whose outlet follows its command so many rows late, in steps of a hundredth of a row.

    at_once: the flow of a row is read when the inlet has moved, not before.
    """
    stairs = lambda: np.repeat(rng.uniform(0.05, 1.0, rows), rng.integers(10, 40, rows))[:rows]
    inlet, outlet = stairs(), stairs()
    real = np.concatenate([outlet[:1].repeat(late), outlet[: rows - late]])
    x, flow, seen = 2.5, 1.3 * inlet[0] * (7.0 - 2.5) ** 0.5, []
    for into, out in zip(inlet, real):
        seen.append((x, 1.3 * into * (7.0 - x) ** 0.5 if at_once else flow))
        for _ in range(100):
            flow = 1.3 * into * (7.0 - x) ** 0.5
            x += 0.001 * (flow - 0.9 * out * (x - 1.0) ** 0.5) / volume
    told = np.array(seen) + noise * rng.standard_normal((rows, 2))
    return pd.DataFrame(
        {"time": 0.1 * np.arange(rows), "inlet": inlet, "outlet": outlet, "pressure": told[:, 0], "flow": told[:, 1]}
    )


def vessels(tmp_path, **how):
    """The rig of a vessel that is recorded so, and its logs."""
    rng = np.random.default_rng(1)
    (tmp_path / "vessel.py").write_text(VESSEL)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "vessel.py", "-d", "."]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    (tmp_path / "rig.toml").write_text(VESSEL_RIG)
    logs = [tmp_path / "train.csv", tmp_path / "test.csv"]
    for log in logs:
        vessel(rng, **how).to_csv(log, index=False)
    return tmp_path / "rig.toml", *logs


def named(tmp_path, kinds, **how):
    """The naming of a vessel that is recorded so."""
    rig, log, test = vessels(tmp_path, **how)
    return name(rig, [log], test=[test], out=None, starts=1, kinds=kinds)


def test_what_was_read_before_the_step_that_computes_it_is_compared_a_step_later_and_not_a_row(tmp_path):
    """A row later a sound loop's pressure had gone on by what finer steps could not mend: a law was named that made up for it."""
    path, log, _ = vessels(tmp_path, late=0, at_once=True, volume=0.5, noise=0.0)
    rig, parts = prepare(load(path))
    runs, _, _ = gather(rig, [log], [])
    values = {"Vessel.size": 0.9, "Vessel.begin": 2.5, "Vessel.volume": 0.5}
    left = []
    for pieces in (1, 2, 4, 8):
        finer = copy(parts)
        finer.system = replace(parts.system, run=replace(parts.system.run, step=0.1 / pieces))
        played = Played(rig, finer, runs, of_rig(rig, parts, runs))
        assert not played.trusted("Vessel.flow", [0])[0][0]
        played.early = frozenset(["Vessel.flow"])
        (trusted,), (errors,) = played.trusted("Vessel.flow", [0]), played.errors([values], [0])["Vessel.flow"]
        assert trusted[0] and not trusted[-1] and trusted[:-1].all()
        left.append(rms([errors[trusted]]))
        played.close()
    assert all(less < 0.6 * more for more, less in pairwise(left)), left


@pytest.mark.slow
def test_a_late_command_of_what_it_multiplies_is_seen(tmp_path):
    """How a vessel answers its valve changes with all that acts on it, so that sums of answers to steps say little of a delay.

    It was `unknown`: the look put the delay far behind chance, and it was never fitted.
    """
    result = named(tmp_path, ["path"])
    assert result.causes and (result.causes[0].law, result.causes[0].place) == ("delay", "Vessel.outlet"), result.summary()
    assert result.causes[0].numbers[0].value == pytest.approx(0.4, abs=0.1)
    assert not any("at once" in note for note in result.notes)


@pytest.mark.slow
def test_an_output_that_was_read_in_the_row_of_what_it_follows_at_once_is_compared_a_row_later(tmp_path):
    """It was `unknown`: the flow jumps with the valve, in the model a row behind it. What hides beside it has its name."""
    result = named(tmp_path, ["path"], late=4, at_once=True)
    assert [note.split()[0] for note in result.notes if "next step" in note] == ["Vessel.flow"], result.summary()
    assert result.causes and (result.causes[0].law, result.causes[0].place) == ("delay", "Vessel.outlet"), result.summary()
    flow = {e.name: e for e in result.errors}["Vessel.flow"]
    assert flow.after == pytest.approx(0.015, rel=0.2)  # the sensor's noise


@pytest.mark.slow
def test_what_an_fmu_has_not_computed_before_its_first_step_is_no_error(tmp_path):
    """Its flow is 0 there, as it was written; the log's is not. It was `unknown`, of a battery's voltage a law of 20 s."""
    result = named(tmp_path, ["path"], late=0)
    assert (result.verdict, result.causes) == ("none", []), result.summary()
    flow = {e.name: e for e in result.errors}["Vessel.flow"]
    assert flow.after == pytest.approx(0.015, rel=0.15)  # the sensor's noise; four standard errors of 500 samples


@pytest.mark.slow
def test_what_a_law_does_beyond_what_taught_can_not_be_closed(monkeypatch):
    monkeypatch.setattr(strangers, "ROWS", 120)
    farther, within = (strangers.hide("outside: ripple", seed, "electrical") for seed in (10_011, 10_012))
    goes = lambda case, column: [(log[column].min(), log[column].max()) for log in case.logs]
    (low, high), (least, most) = goes(farther, "current")
    assert least < low and most > high and all(farther.beyond[n] > 3.0 * size for n, size in farther.noise.items())
    (low, high), (least, most) = goes(within, "voltage")
    assert low < least and most < high and set(within.beyond.values()) == {0.0}


def test_the_interval_of_none_and_of_all_has_no_sign():
    """None of fifteen was told as -0 to 20 %."""
    assert all(rate([one] * n).partition("; ")[2].startswith("0 to") != one for n in range(1, 200) for one in (False, True))
    assert rate([False] * 15) == "0 % (0 of 15; 0 to 20 %)" and rate([True] * 15) == "100 % (15 of 15; 80 to 100 %)"


def test_an_overflow_is_known_by_the_words_in_which_it_is_told():
    """One that stood beside the overflow of the flow out of it was counted as not told at all."""
    case = SimpleNamespace(
        kind="law", right=({"overflow"}, {"a.inflow"}, "a.level"), hidden=SimpleNamespace(also=("b.inflow", 0.3))
    )
    assert strangers.labels(case) == {"overflow of a.level: from a.inflow on to b.inflow"}
