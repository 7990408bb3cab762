"""What hides in a heated body is named, where the FMU knows a rate and nothing else; nothing is named where nothing hides.

Bounds of values are four of their 95 % intervals, and what a held step of the log leaves open.
"""

import json
import zipfile

import hidden
import numpy as np
import pytest

from selflock import master
from selflock.diagnosis import name
from selflock.diagnosis.naming import extended, whole
from selflock.diagnosis.rules import RULES
from selflock.master import ssp

NUMBERS = ("parameter", "path", "event")


@pytest.fixture
def rng():
    """The same plants each time: a search over hundreds of rivals may be right in most draws alone."""
    return np.random.default_rng(1)


def named(tmp_path, native, rng, kinds=None, free=hidden.FREE, out=None, count=500, test=None, **hides):
    """The naming of a body in which this hides, in what teaches and, but for an event, in what judges."""
    rig = hidden.rig(tmp_path, native("relaxation"), free)
    logs = [tmp_path / "log.csv", tmp_path / "test.csv"]
    hidden.body(rng, count, **hides).to_csv(logs[0], index=False)
    hidden.body(rng, count, **(hides if test is None else test)).to_csv(logs[1], index=False)
    more = {"kinds": kinds} if kinds else {}
    return name(rig, logs[:1], test=logs[1:], out=out, **more)


def told(result):
    """The one cause, and its numbers by name."""
    assert result.verdict in ("explained", "ambiguous") and len(result.causes) == 1, result.summary()
    (cause,) = result.causes
    return cause, {number.name: number for number in cause.numbers}


def near(number, truth, slack=0.0):
    assert abs(number.value - truth) < 2.0 * (number.high - number.low) + slack, (number, truth)


@pytest.mark.slow
def test_nothing_that_runs_is_left_open_by_what_stops_a_search(tmp_path, native, rng, monkeypatch):
    """Also where half the steps are tried, and their systems stand beside those that were there."""
    every, went = [], extended.Extended.__init__

    def begun(self, *given):
        went(self, *given)
        every.append(self)

    def stopped(problem, *given):
        problem.loss(problem.misfit(np.array([n.place(n.start) for n in problem.free])))
        assert any(played.kept for played in every)
        raise KeyboardInterrupt

    monkeypatch.setattr(extended.Extended, "__init__", begun)
    monkeypatch.setattr(whole, "in_units", stopped)
    with pytest.raises(KeyboardInterrupt):
        named(tmp_path, native, rng, count=100)
    assert len(every) > 2 and not any(played.kept for played in every)


@pytest.mark.slow
def test_nothing_is_named_where_nothing_hides(tmp_path, native, rng):
    result = named(tmp_path, native, rng)
    assert (result.verdict, result.exit_code, result.causes) == ("none", 3, [])


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_number_that_is_off(tmp_path, native, rng):
    result = named(tmp_path, native, rng, NUMBERS, free="", loss=30.0)
    cause, numbers = told(result)
    assert cause.kind == "parameter" and cause.place == "relaxation.rate"
    near(numbers["relaxation.rate"], 30.0 / hidden.CAPACITY)


@pytest.mark.slow
def test_a_sensor_that_ends(tmp_path, native, rng):
    result = named(tmp_path, native, rng, NUMBERS, read=lambda t, x: np.minimum(x, 0.5))
    cause, numbers = told(result)
    assert cause.law == "saturation (high)" and cause.place == "relaxation.x" and cause.where == "out"
    near(numbers["high"], 0.5)
    (error,) = result.errors
    assert error.after < 1.2 * 0.004 < 0.2 * error.before


@pytest.mark.slow
def test_what_two_causes_leave_is_told_of_both(tmp_path, native, rng):
    """It was what the first of them leaves, where no third was asked for."""
    result = named(tmp_path, native, rng, NUMBERS, free="", loss=24.0, read=lambda t, x: np.minimum(x, 0.45))
    assert {cause.law or cause.kind for cause in result.causes} == {"parameter", "saturation (high)"}, result.summary()
    assert not result.remainder["significant"] and max(result.remainder["ratios"].values()) < RULES.judge.excess
    assert "more than noise" not in result.summary()


@pytest.mark.slow
def test_a_path_that_is_late(tmp_path, native, rng):
    late = 8 * hidden.STEP
    result = named(tmp_path, native, rng, NUMBERS, heater=lambda t, u: np.concatenate([u[:1].repeat(8), u[:-8]]))
    cause, numbers = told(result)
    assert cause.law == "delay"  # of a linear body nobody can tell whether what goes in is late, or what comes out
    near(numbers["T"], late, 0.1 * hidden.STEP)


@pytest.mark.slow
def test_a_lid_is_open_for_some_time(tmp_path, native, rng):
    lid = lambda t, x: -12.0 if 8.0 < t < 14.0 else 0.0
    result = named(tmp_path, native, rng, NUMBERS, heat=lid, test={})
    cause, numbers = told(result)
    assert cause.kind == "event" and cause.place == "relaxation.u"
    near(numbers["a"], -12.0 / hidden.LOSS)
    near(numbers["since"], 8.0, hidden.STEP)
    near(numbers["until"], 14.0, hidden.STEP)
    assert cause.runs == ["log.csv"] and "it was in log.csv: of other runs it lowers no error" in result.summary()
    (error,) = result.errors
    assert error.taught_after < 1.3 * 0.004 < 0.1 * error.taught_before and error.after < 1.2 * 0.004


@pytest.mark.slow
def test_what_an_open_lid_lets_through_goes_with_the_heat_of_the_body(tmp_path, native, rng):
    lid = lambda t, x: -16.0 * x if 6.0 < t < 16.0 else 0.0
    result = named(tmp_path, native, rng, ("event",), heat=lid, test={})
    cause, numbers = told(result)
    assert cause.label == "event on relaxation.u, in proportion to relaxation.x" and cause.place == "relaxation.u"
    near(numbers["a"], -16.0 / hidden.LOSS, 0.01)
    near(numbers["since"], 6.0, hidden.STEP)
    near(numbers["until"], 16.0, hidden.STEP)


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_law_is_named_and_the_extended_system_does_what_was_promised(tmp_path, native, rng, monkeypatch):
    """A loss that grows with the third power, before the FMU: it passes through the body's own dynamics."""
    for rule, value in {"fits": 3, "fits_derived": 1, "of_law": 0, "polished": 1, "curves": 1}.items():
        monkeypatch.setitem(vars(RULES.naming), rule, value)  # for speed
    out = tmp_path / "out"
    before = native("relaxation").read_bytes()
    result = named(tmp_path, native, rng, ("law", "path"), out=out, heat=lambda t, x: -6.0 * x**3)
    cause, numbers = told(result)
    assert (cause.law, cause.place, cause.where) == ("cubic", "relaxation.u", "in") and "relaxation.x" in cause.over
    near(numbers["a"], -6.0 / hidden.LOSS)
    assert result.curve is not None and result.curve.place == "relaxation.u" and result.curve.of_answer
    again = result.extension
    assert again["agrees"] and again["fmu"] == pytest.approx(again["promised"], rel=1e-3)
    # what lies there runs by itself, and so does the SSP, with the promised error; the FMU is as it was
    log = np.genfromtxt(tmp_path / "test.csv", delimiter=",", names=True)
    for file in ("extended.toml", "extended.ssp"):
        table = master.run(out / file, stop=float(log["time"][-1]), step=hidden.STEP, inputs=out / "inputs.csv").table
        error = log["body"] - np.interp(log["time"], table["time"], table["relaxation.x"])
        assert np.sqrt(np.mean(error**2)) == pytest.approx(again["promised"], rel=0.02), file
    assert (tmp_path / "relaxation.fmu").read_bytes() == before
    with zipfile.ZipFile(out / "extended.ssp") as archive:
        assert any(archive.read(n) == before for n in archive.namelist() if n.endswith(".fmu"))
    assert ssp.load(out / "extended.ssp").components.keys() == {"relaxation", "correction"}
    data = json.loads((out / "naming.json").read_text())
    assert data["verdict"] == result.verdict and data["rivals"][0]["rows"]
    page = (out / "report.html").read_text().replace("<wbr>", "")
    assert "cubic of relaxation.x" in page and page.count("data-figure=") == 1 + bool(result.curve)
    first = ["What is missing has a name", "cubic of relaxation.x", *['data-figure="missing"'] * bool(result.curve), "&rarr;", "What to do next",
             "selflock run extended.toml --input inputs.csv", "<table"]  # fmt: skip
    shown = page.partition("<h1>")[2].replace("\u2192", "&rarr;")
    assert sorted(first, key=shown.index) == first


@pytest.mark.in_turn
@pytest.mark.slow
def test_what_no_law_says_is_unknown_with_its_variable_and_a_curve(tmp_path, native, rng, monkeypatch):
    for rule, value in {"rounds": 1, "fits": 4, "of_law": 0, "polished": 1}.items():
        monkeypatch.setitem(vars(RULES.naming), rule, value)  # for speed
    bump = lambda t, x: 14.0 * np.exp(-(((x - 0.4) / 0.25) ** 2))
    result = named(tmp_path, native, rng, ("law",), count=800, heat=bump)
    assert result.verdict == "unknown" and result.exit_code == 4, result.summary()
    (cause,) = result.causes
    assert cause.kind == "curve" and cause.over == "relaxation.x" and cause.place == "relaxation.u"
    (error,) = result.errors
    assert 1.0 - (error.after**2 - 0.004**2) / (error.before**2 - 0.004**2) > 0.7
    curve = result.curve
    assert abs(curve.x[int(np.argmax(curve.y))] - 0.4) < 0.35


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_law_of_two_variables(tmp_path, native, rng, monkeypatch):
    """A loss that wind takes with it: neither the wind nor the temperature alone says how much."""
    for rule, value in {"rounds": 1, "fits": 3, "fits_derived": 2, "of_law": 0, "of_path": 0, "polished": 1, "curves": 1}.items():
        monkeypatch.setitem(vars(RULES.naming), rule, value)  # for speed
    wind = lambda t: 1.0 + np.sin(0.9 * t)
    rig = hidden.rig(tmp_path, native("relaxation"))
    rig.write_text(rig.read_text().replace("[columns]", '[columns]\n"wind" = "wind"'))
    logs = [tmp_path / "log.csv", tmp_path / "test.csv"]
    for log in logs:
        table = hidden.body(rng, 400, heat=lambda t, x: -8.0 * wind(t) * x)
        table.assign(wind=wind(table["time"])).to_csv(log, index=False)
    result = name(rig, logs[:1], test=logs[1:], out=tmp_path / "out", kinds=("law",))
    cause, numbers = told(result)
    assert (cause.law, cause.place) == ("proportional", "relaxation.u") and cause.over in (
        "relaxation.x · wind",
        "wind · relaxation.x",
    )
    near(numbers["a"], -8.0 / hidden.LOSS, 0.01)
    assert result.extension["agrees"]
