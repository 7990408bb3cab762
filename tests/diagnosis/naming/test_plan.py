"""The run that tells apart what a naming could not: in a heated body whose FMU knows a rate and nothing else."""

import json
from dataclasses import asdict, replace

import hidden
import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis import DataError, plan
from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.naming.places import IN, READ, Insert, Place
from selflock.diagnosis.naming.plan import Open, least
from selflock.diagnosis.naming.same import alike
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.systems.system import prepare


def model(law, amount, place, over="", word="a"):
    """A law of one number before the heater or behind the body."""
    at = Place(READ, "relaxation.x") if place == "body" else Place(IN, "relaxation.u")
    number = Number(f"c.{word}", f"c.{word}", 0.0, -3.0, 3.0)
    label = f"{law} on {place}"
    values = {"relaxation.rate": 0.5, "relaxation.x": 0.3, f"c.{word}": amount}
    return Open(label, (Insert("c", at, law, over=over),), (number,), {}, values)


@pytest.fixture
def named(tmp_path, native):
    """A function: the folder of a naming that did not decide between these models, beside its rig and log."""
    hidden.rig(tmp_path, native("relaxation"))
    hidden.body(np.random.default_rng(1), 200).to_csv(tmp_path / "log.csv", index=False)

    def written(*models):
        folder = tmp_path / "naming"
        folder.mkdir()
        told = {
            "models": [asdict(one) for one in models],
            "sources": {"rig": "../rig.toml", "logs": ["../log.csv"]},
            "step": hidden.STEP,
            "errors": [{"name": "relaxation.x", "noise": 0.004}],
        }
        (folder / "naming.json").write_text(json.dumps(told))
        return folder

    return written


@pytest.mark.slow
def test_inputs_are_planned_under_which_two_laws_differ(named, tmp_path):
    """A loss with the third power and one with the square, alike where the body hardly moves."""
    folder = named(model("cubic", -0.05, "heater", "relaxation.x"), model("drag", -0.06, "heater", "relaxation.x"))
    result = plan(folder, {"relaxation.u": "-4:4", "duration": 20}, tmp_path / "plan")
    assert result.decides and least(result.more) > 5.0 * least(result.usual)
    table = pd.read_csv(tmp_path / "plan" / "plan.csv")
    heater = table.filter(like="heater").iloc[:, 0]
    assert heater.between(-4.0, 4.0).all() and table["time [s]"].iloc[-1] == pytest.approx(20.0)
    assert np.ptp(heater) > 4.0 and "plan.csv" in result.summary()
    assert json.loads((tmp_path / "plan" / "plan.json").read_text())["decides"]
    again = plan(folder, {"relaxation.u": "-4:4", "duration": 20}, None)
    assert np.array_equal(again.inputs["relaxation.u"], result.inputs["relaxation.u"])


@pytest.mark.slow
def test_what_acts_alike_under_all_inputs_is_told_as_that(named, tmp_path):
    """An offset of the heater and one of the body's sensor, where the run's begin is free."""
    offset, sensor = model("constant", 0.1, "heater"), model("constant", 0.1, "body")
    result = plan(named(offset, sensor), {}, None)
    assert not result.decides and least(result.more) < 1e-4
    assert "Under no inputs" in result.summary() and "constant on heater and constant on body" in result.summary()


@pytest.mark.parametrize("limits", [{}, {"relaxation.u": "-0.01:0.01"}], ids=["as far as the log went", "narrower"])
def test_where_no_run_that_was_drawn_tells_more_the_logs_own_inputs_are_planned(named, tmp_path, monkeypatch, limits):
    """Unless they leave the limits; and what neither an FMU nor a law is given is no part of a plan."""
    of_hardest = lambda inputs: np.append(np.linspace(0.02, 0.03, len(inputs) - 1), 0.2)
    as_told = lambda rig, parts, models, inputs, *rest: np.repeat(of_hardest(inputs), 4).reshape(-1, 2, 2)
    monkeypatch.setattr("selflock.diagnosis.naming.plan.compared", as_told)
    folder = named(model("cubic", -0.05, "heater", "relaxation.x"), model("drag", -0.06, "heater", "relaxation.x"))
    rig = tmp_path / "rig.toml"
    rig.write_text(rig.read_text().replace("[columns]", '[columns]\n"weather.wind" = "wind"'))
    log = pd.read_csv(tmp_path / "log.csv")
    log.assign(wind=np.sin(np.arange(len(log)))).to_csv(tmp_path / "log.csv", index=False)
    result = plan(folder, limits, None)
    assert list(result.inputs) == ["relaxation.u"] and result.again == (not limits)
    assert ("the longest log's own inputs" in result.summary()) == (not limits)
    assert least(result.more) == pytest.approx(0.03 if limits else 0.2) and least(result.usual) == pytest.approx(0.2)


def test_what_cannot_be_planned_is_a_sentence(named, tmp_path):
    folder = named(model("cubic", -0.05, "heater", "relaxation.x"))
    with pytest.raises(DataError, match="nothing does as well"):
        plan(folder, {}, None)
    (folder / "naming.json").write_text('{"models": [{}]}')
    with pytest.raises(DataError, match="Run selflock name again"):
        plan(folder, {}, None)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"relaxation.v": "0:1"}, "Did you mean 'relaxation.u'"),
        ({"relaxation.u": "1"}, "the lowest and the highest"),
        ({"relaxation.u": "2:1"}, "the lowest and the highest"),
        ({"duration": "soon"}, "seconds above 0"),
    ],
)
def test_limits_that_are_none(named, limits, words):
    both = model("cubic", -0.05, "heater", "relaxation.x"), model("drag", -0.06, "heater", "relaxation.x")
    with pytest.raises(DataError, match=words):
        plan(named(*both), limits, None)


@pytest.mark.slow
def test_one_thing_by_two_names_is_told_as_one_and_two_laws_that_other_inputs_tell_apart_are_not(tmp_path, native, rng):
    """An offset before a linear body is one behind it, wherever runs begin; a cubic law is a drag of no inputs that go so far."""
    rig = hidden.rig(tmp_path, native("relaxation"))
    hidden.body(rng, 200).to_csv(tmp_path / "log.csv", index=False)
    rig, parts = prepare(load(rig))
    runs, _, _ = gather(rig, [tmp_path / "log.csv"], [])
    told = lambda *models: alike(models, rig, parts, runs, {"relaxation.x": 0.004}, 0)
    offset = lambda place, amount: model("constant", amount, place)
    assert told(offset("heater", 0.3), offset("body", 0.32), offset("body", 0.0)) == ["constant on body", "constant on body"]
    cubic, drag = (model(law, a, "heater", "relaxation.x") for law, a in (("cubic", -0.2), ("drag", -0.24)))
    assert told(cubic, drag) == []
    assert told(cubic, replace(cubic, label="again", values=cubic.values | {"c.a": -0.199})) == ["again"]
