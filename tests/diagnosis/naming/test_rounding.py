"""What of a recorded signal tells that it was rounded, and what is noise beside that."""

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.naming.extended import Extended, Extending
from selflock.diagnosis.naming.guesses import paths
from selflock.diagnosis.naming.places import OUT, Place
from selflock.diagnosis.naming.rounding import Rounded, beside_step, rounded

ROWS, TIME = 500, np.arange(500.0)


def wandering(rng):
    """A body behind two others that goes after a command in stairs: it passes a tenth of its spread in a few rows."""
    x = np.repeat(rng.uniform(-2.0, 2.0, 60), rng.integers(8, 30, 60))[:ROWS]
    for slow in (5.0, 8.0, 15.0):
        x = np.array([y := x[0], *(y := y + (s - y) / slow for s in x[1:])])
    return x


def told(x):
    return rounded([MeasuredRun("log.csv", "", np.arange(ROWS), TIME, {"body.x": x})], ["body.x"]).get("body.x")


def test_a_rounded_sensor_tells_its_step_and_the_noise_about_it(rng):
    """A house's wall in steps of a quarter of its spread: from row to row the model goes 11 times the noise, and the answer was `none`."""
    x = wandering(rng)
    for share in (0.2, 0.4, 0.6):
        step = share * np.std(x)
        sigma = rng.uniform(0.01, 0.08) * step
        one = told(step * np.round(x / step) + sigma * rng.standard_normal(ROWS))
        assert one is not None and one.step == pytest.approx(step, rel=0.02)
        assert one.noise == pytest.approx(sigma, rel=0.25)


def test_what_is_not_rounded_is_not_told_as_such(rng):
    """Neither what rests at a stop most of its time, which lies at a whole number of many steps, nor a recorder's resolution."""
    x = wandering(rng)
    noise = 0.005 * np.std(x) * rng.standard_normal(ROWS)
    assert told(x + noise) is None
    assert told(np.minimum(x, np.quantile(x, 0.4)) + noise) is None
    assert told(np.sign(x) * np.maximum(abs(x) - np.quantile(abs(x), 0.6), 0.0) + noise) is None
    assert told(0.2 * np.std(x) * np.round(5.0 * x / np.std(x))) is None
    assert told(np.zeros(ROWS)) is None


def test_noise_of_what_was_rounded_is_what_it_has_about_its_steps(rng):
    """Its errors differ from row to row by what the model goes, which is no noise; of another output they are asked as ever."""
    problem = Extending(None, [], (), [0], [np.ones(ROWS, bool)])
    vars(problem)["played"] = played = Extended.__new__(Extended)
    played.rounded, played.outputs = {"wall.x": Rounded(0.3, 0.005)}, ["wall.x", "room.x"]
    coarse = 0.5 * np.round(rng.standard_normal(ROWS) / 0.5)
    played.logged = [SimpleNamespace(signals={"wall.x": rng.standard_normal(ROWS), "room.x": rng.standard_normal(ROWS)})]
    vars(problem)["trusted"] = {"wall.x": [np.ones(ROWS, bool)], "room.x": [np.ones(ROWS, bool)]}
    error = 0.06 * rng.standard_normal(ROWS)
    assert problem.floor("wall.x", [error]) == 0.005
    assert problem.floor("room.x", [error]) == pytest.approx(0.06, rel=0.2)
    assert problem.floor("wall.x", [0.01 * error]) < 0.001
    played.logged[0].signals["room.x"] = coarse  # the steps of a recorder are noise, though what is compared may be told anew
    vars(problem).pop("quanta")
    assert problem.floor("room.x", [error]) == pytest.approx(0.5 / np.sqrt(12.0))


def test_of_what_was_rounded_no_other_step_is_looked_at(rng):
    """What is compared may be told anew for what coarse steps miss, and lies at steps no more."""
    x = wandering(rng)
    scene = SimpleNamespace(
        signal=lambda place: x, prefix="c", step=1.0, span=500.0, series={"body.x": [x], "time": [TIME]},
        played=SimpleNamespace(runs=[SimpleNamespace(signals={"body.x": x})], rounded={"body.x": Rounded(0.31, 0.004)}),
    )  # fmt: skip
    asked = [trial.at["c.q"] for trial in paths(scene, Place(OUT, "body.x")) if trial.guess.law == "quantisation"]
    assert asked == [0.31]


def test_beside_its_step_a_model_is_off_by_how_far_it_is_beyond(rng):
    """A row that is on another step by a hair is off by a hair; the noise is there whether the model is in the step or not."""
    x, q = wandering(rng), 0.3
    noise = 0.02 * q * rng.standard_normal(ROWS)
    y = q * np.floor(x / q + 0.5) + noise
    assert beside_step(y, x, q) == pytest.approx(noise)
    off = beside_step(y, x + 0.01, q) - noise
    assert off.max() < 1e-12 and off.min() > -0.01 - 1e-12 and 0.0 < np.mean(off < -1e-12) < 0.15
    assert beside_step(y, x, 0.0) == pytest.approx(y - x)
