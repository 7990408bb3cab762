"""Which causes are marked weak, and why, in words."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from lxml import html

from selflock.diagnosis.judge.cause import Cause, doubts, weakening
from selflock.diagnosis.judge.gain import Gain
from selflock.diagnosis.judge.result import Diagnosis
from selflock.diagnosis.judge.verdict import _confidence, named
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.fit import Fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.step import Stage
from selflock.fmus.effect import AMPLITUDE, SHAPE

DROP = Free("motor.brush_voltage", 0.0, 0.0, 5.0, "V", role=AMPLITUDE)
OTHER = Free("motor.other", 0.0, -5.0, 5.0, role=AMPLITUDE)
WIDE = Free("reducer.stribeck_speed", 1.0, 0.1, 500.0, "rad/s")
SPEED = Free("reducer.stribeck_speed", 1.0, 0.0, 10.0, "rad/s", role=SHAPE)
BESIDE = Free("motor.resistance", 0.3, 0.06, 1.5, "Ohm", companion=True)

END, NONE = "lies at the end of its range", "may as well be what it is without this cause"


@pytest.mark.parametrize("free, values, intervals, said", [
    ((DROP,), (1.0,), ((0.8, 1.2),), []),
    ((DROP,), (1.0,), ((0.0, 2.2),), [NONE]),
    ((DROP,), (4.999,), ((4.0, 5.0),), [END]),
    ((WIDE,), (0.3,), ((0.2, 0.4),), []),  # small beside its range, and well determined
    ((WIDE,), (0.3,), ((0.1, 0.8),), [END]),
    ((DROP,), (0.0,), ((0.0, 0.1),), [NONE]),  # at the end where there is none of it
    ((DROP, SPEED), (1.0, 10.0), ((0.8, 1.2), (9.0, 10.0)), []),  # what shapes it may be at its end
    ((DROP, SPEED), (1.0, 1.0), ((0.8, 1.2), (0.5, 1.5)), []),  # or as usual
    ((DROP, BESIDE), (1.0, 0.31), ((0.8, 1.2), (0.2, 0.4)), []),  # so may what is freed beside it
    ((DROP, BESIDE), (1.0, 1.4999), ((0.8, 1.2), (0.2, 1.5)), [END]),
    ((DROP, OTHER), (1.0, 0.1), ((0.8, 1.2), (-0.5, 0.7)), []),  # one amount is enough
    ((DROP, OTHER), (1.0, 0.1), ((0.0, 1.2), (-0.5, 0.7)), [NONE, NONE]),
])  # fmt: skip
def test_numbers_make_a_cause_weak(free, values, intervals, said):
    values, spans = ({p.name: one for p, one in zip(free, many)} for many in (values, intervals))
    doubted = doubts(free, values, spans)
    found = weakening(free, doubted)
    assert len(found) == len(said) and all(word in sentence for word, sentence in zip(said, found))
    assert all(sentence.startswith(tuple(doubted)) for sentence in found)


def test_a_number_that_makes_nothing_weak_is_doubted_by_itself():
    doubted = doubts((DROP, OTHER), {DROP.name: 1.0, OTHER.name: 0.1}, {DROP.name: (0.8, 1.2), OTHER.name: (-0.5, 0.7)})
    assert list(doubted) == [OTHER.name] and NONE in doubted[OTHER.name]


@pytest.mark.parametrize("confidence, rivals, said", [
    (0.995, [], []), (0.94, [], ["its confidence is 0.94, below 0.95"]),
    (0.497, ["b"], ["cannot tell it from another"]),  # which shares its confidence
    (0.4, ["b"], ["cannot tell it from another", "its confidence is 0.4"]),
])  # fmt: skip
def test_confidence_makes_a_cause_weak(confidence, rivals, said):
    cause = Cause("motor", "brush_drop", {}, confidence, rivals)
    assert len(cause.weak) == len(said) and all(word in sentence for word, sentence in zip(said, cause.weak))
    assert cause.mark == ("weak" if said else "certain") and cause.row()["weak"] == cause.weak and "doubts" not in cause.row()


@pytest.mark.parametrize("confidence, told", [(0.0, "below 0.01"), (1.0, "above 0.99"), (0.9312, "0.93")])
def test_confidence_is_told_without_a_certainty_that_it_has_not(confidence, told):
    assert Cause("motor", "brush_drop", {}, confidence).sure == told
    weak = Cause("motor", "brush_drop", {}, confidence, closest="load tilt").weak
    assert not weak or weak == [f"its confidence is {told}, below 0.95: load tilt may do as well"]


def test_confidence_asks_rivals_alone():
    """Φ of the mean difference over its standard error, as odds times what these are worth.

    What is put aside, and the winner with more numbers, ask nothing.
    """

    def fitted(name, losses, numbers=1):
        free = tuple(Free(f"load.{name}{k}", 0.0, -1.0, 1.0) for k in range(numbers))
        return Candidate(Hypothesis("load", name, free), free, Fit(free, {}, *[np.zeros(1)] * 3), np.c_[losses], chance=0.005)

    difference = np.array([0.3, -0.1, 0.2, 0.0])  # mean 0.1, standard error 0.0913
    winner = fitted("mass", np.ones(4))
    rival, better, wide = fitted("tilt", 1.0 + difference), fitted("drag", np.full(4, 0.9)), fitted("ripple", np.full(4, 0.9), 2)
    stage = Stage(winner, [better, wide, winner, rival], winner, aside=[better])
    grown = replace(winner, free=winner.free + rival.free[:0])
    worth = lambda p: 1.0 / (1.0 + (1.0 - p) / p / RULES.judge.odds)
    for one in (winner, grown):
        assert _confidence(one, stage) == (pytest.approx(worth(0.8634), abs=1e-4), "load tilt")  # Φ(1.0954)
    assert _confidence(winner, replace(stage, tied=[rival])) == (pytest.approx(worth(0.995) * 0.8634, abs=1e-4), "")
    same = fitted("twin", np.ones(4))
    alike = replace(stage, candidates=[better, wide, winner, rival, same, same], tied=[same, same])
    assert _confidence(winner, alike)[0] == pytest.approx(worth(0.8634) / 3, abs=1e-4)
    assert _confidence(winner, replace(stage, aside=[])) == (0.0, "load drag")


def test_marks_stand_in_the_summary():
    gain = Gain("", "", 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, [])
    causes = [Cause("motor", "brush_drop", {}, 0.99), Cause("load", "tilt", {}, 0.99, doubts=["load.tilt lies at the end"])]
    lines = Diagnosis("explained", [], [], causes, gain, {"significant": False}).summary().splitlines()
    assert lines[1].startswith("  cause, certain: motor brush_drop") and lines[2].startswith("  cause, weak: load tilt")
    assert lines[3] == "    weak: load.tilt lies at the end"


def test_a_notebook_shows_causes_and_numbers(hostile):
    number = {"value": 0.5, "low": 0.25, "high": 0.75, "unit": hostile, "determined": True, "doubt": ""}
    gain = Gain("error", "N.m", 2.0, 1.0, 1.0, 1.0, 0.5, 1.0, [])
    told = Diagnosis(hostile, [], [], [Cause("motor", hostile, {hostile: number}, 0.99)], gain, {"significant": False})
    tree = html.fragment_fromstring(told._repr_html_())
    assert tree.xpath("//tbody/tr/td/text()") == [f"motor {hostile}", "certain", hostile, "0.5", "0.25", "0.75", hostile]
    assert (
        "2 → 1 N.m" in tree.xpath("string(.)") and str(told) in tree.xpath("string(//pre)") and not tree.xpath("//script|//img")
    )


@pytest.mark.parametrize("size, weak", [(1.0, False), (1e-3, True)])
def test_the_interval_of_the_last_fit_decides(size, weak, rng):
    """A slope in noise, clear or not."""
    n = 400
    column = np.linspace(-1.0, 1.0, n)
    noise = rng.standard_normal(n)
    noise -= column * (column @ noise) / (column @ column)  # so that the fit is the size itself
    free = (Free("load.tilt", 0.0, -5.0, 5.0, "rad", role=AMPLITUDE),)
    fit = Fit(free, {"load.tilt": size}, noise, -column[:, None], np.ones(n))
    problem = SimpleNamespace(
        rows=np.ones(n, bool), blocks=np.arange(n) // 10, absolute=dict, experiment=SimpleNamespace(step=1e-3)
    )
    candidate = SimpleNamespace(hypothesis=Hypothesis("load", "tilt", free), free=free, chance=0.005)
    stage = Stage(candidate, [])
    (cause,) = named(SimpleNamespace(causes=[candidate], kept=[stage], problem=problem, final=fit))
    assert (cause.mark == "weak") == weak and bool(cause.parameters["load.tilt"]["doubt"]) == weak
