"""The page of a plan: what each model expects, as live figures over what the logs' noise hides."""

import json
from types import SimpleNamespace

import numpy as np

from selflock.diagnosis.data.rig import LogColumn
from selflock.diagnosis.judge.models import OpenModel
from selflock.diagnosis.planning.moves import Limits
from selflock.diagnosis.planning.page import expected, write
from selflock.diagnosis.planning.rivals import Planned
from selflock.diagnosis.planning.run import NextRun


def planned(hostile=""):
    time = np.linspace(0.0, 4.0, 400)
    angle, speed, names = 1.0 - np.cos(time), np.sin(time), ("motor.current", "load.angle")
    outputs = [{name: (1 + k) * angle for name in names} for k in range(2)]
    run = Planned(time, angle, speed, outputs, np.array([[0.0, 30.0], [20.0, 0.0]]), np.full((2, 2), 2.0))
    models = [OpenModel(label + hostile, {"reducer.wear_rate": 0.1}, {}) for label in ("wear", "warm-up")]
    rig = SimpleNamespace(name="rig" + hostile, columns=[], time=LogColumn("t", "time", "ms"))
    return NextRun(rig, models, Limits(0.0, 2.0, 1.0, 1.0, 4.0), run, run, dict.fromkeys(names, 0.1), 1, 12)


def test_what_each_model_expects_is_drawn_beside_the_first():
    plan = planned()
    top, *others = expected(plan)
    assert top["y"]["unit"] == "rad" and np.array_equal(top["marks"][0]["y"], plan.run.angle)
    assert [plot["y"]["unit"] for plot in others] == ["A", "rad"]
    for plot in others:
        noise, first, second = plot["marks"]
        assert (noise["kind"], first["label"], second["label"]) == ("band", "wear", "warm-up")
        assert not first["y"].any() and np.allclose(second["y"], plan.run.angle)


def test_the_page_takes_hostile_names_as_words(tmp_path, harmless, hostile):
    write(planned(hostile), tmp_path)
    tree = harmless(tmp_path / "report.html", scripts=1)
    assert hostile in tree.xpath("//h1")[0].text_content() and tree.xpath("//*[@data-figure='expected']")
    assert json.loads((tmp_path / "plan.json").read_text())["tried"] == 12
    assert (tmp_path / "plan.csv").read_text().splitlines()[0].startswith("t [ms]")
