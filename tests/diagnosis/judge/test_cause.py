"""Which causes are marked weak, and why, in words."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from lxml import html

from selflock.diagnosis.judge.cause import Cause, doubts, weakening
from selflock.diagnosis.judge.gain import Gain
from selflock.diagnosis.judge.likely import confidence
from selflock.diagnosis.judge.result import Diagnosis
from selflock.diagnosis.judge.verdict import named, verdict
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.fit import Fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.step import Stage
from selflock.fmus.effect import AMPLITUDE, SHAPE, VALUE

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
    (0.497, ["b"], ["cannot tell it from another"]),  # which has as much
    (0.4, ["b"], ["cannot tell it from another", "the confidence of all these is 0.8"]),
])  # fmt: skip
def test_confidence_makes_a_cause_weak(confidence, rivals, said):
    cause = Cause("motor", "brush_drop", {}, confidence, rivals, together=confidence * (1 + len(rivals)))
    assert len(cause.weak) == len(said) and all(word in sentence for word, sentence in zip(said, cause.weak))
    assert cause.mark == ("weak" if said else "certain") and cause.row()["weak"] == cause.weak and "doubts" not in cause.row()


@pytest.mark.parametrize("confidence, told", [(0.0, "below 0.01"), (1.0, "above 0.99"), (0.9312, "0.93")])
def test_confidence_is_told_without_a_certainty_that_it_has_not(confidence, told):
    assert Cause("motor", "brush_drop", {}, confidence).sure == told
    weak = Cause("motor", "brush_drop", {}, confidence, closest="load tilt").weak
    assert not weak or weak == [f"its confidence is {told}, below 0.95: load tilt may do as well"]


def fitted(name, losses, numbers=1):
    free = tuple(Free(f"load.{name}{k}", 0.0, -1.0, 1.0) for k in range(numbers))
    return Candidate(Hypothesis("load", name, free), free, Fit(free, {}, *[np.zeros(1)] * 3), np.array(losses), chance=0.005)


def contest(winner, *rivals, base, tied=(), aside=()):
    return Stage(fitted("none", base, 0), [*rivals, winner], winner, tied=list(tied), aside=list(aside))


ENTRIES = SimpleNamespace(
    entries=np.full((4, 2), 50.0), new=np.array([0.2, 1.0])
)  # 20 of 100 entries of a block are new in the first
MENDS = np.c_[[1.0, 1.2, 0.9, 1.1], np.ones(4)]  # of two residuals the first, which the base leaves as
NOTHING = MENDS + np.c_[np.ones(4), np.zeros(4)]


def test_causes_that_predict_the_same_share_equally():
    """However surely one is a trifle better: every block says so of the first."""
    winner, trifle, twin = fitted("mass", MENDS), fitted("tilt", MENDS + 1e-9), fitted("drag", MENDS)
    sure, together, closest = confidence(winner, contest(winner, trifle, twin, base=NOTHING, tied=[trifle, twin]), ENTRIES)
    assert sure == pytest.approx(0.995 / 3, abs=1e-4) and together == pytest.approx(0.995, abs=1e-4) and closest == ""


def test_a_difference_that_all_blocks_share_counts_as_its_likelihood():
    """By 0.05 of 20 new entries in each of 4 blocks: exp(2) to 1."""
    winner, rival = fitted("mass", MENDS), fitted("tilt", MENDS + np.array([0.05, 0.0]))
    sure, together, closest = confidence(winner, contest(winner, rival, base=NOTHING), ENTRIES)
    assert sure == together == pytest.approx(0.995 / (1.0 + np.exp(-2.0)), abs=1e-4) and closest == "load tilt"


def test_a_large_difference_is_as_sure_as_its_blocks(rng):
    """Two blocks for it and two against it, all by far: as likely as that the draws' sum of the four is above 0."""
    winner = fitted("mass", MENDS)
    rival = fitted("tilt", MENDS + np.c_[1e4 * np.array([1.0, -1.0, 3.0, -1.0]), np.zeros(4)])
    counts = rng.dirichlet(np.ones(4), 20_000)
    share = np.mean(counts @ [1.0, -1.0, 3.0, -1.0] > 0.0)
    assert confidence(winner, contest(winner, rival, base=NOTHING), ENTRIES)[0] == pytest.approx(0.995 * share, abs=0.03)


def test_what_mends_another_residual_is_no_rival():
    """It may be there beside the cause. Nor is what the rules refuse for what it is, or what has more numbers."""
    winner, elsewhere = fitted("mass", MENDS), fitted("delay", NOTHING - np.array([0.0, 0.9]))
    refused, wide = fitted("lag", 0.1 * MENDS), fitted("ripple", 0.1 * MENDS, 2)
    beside = contest(winner, elsewhere, refused, wide, base=NOTHING, aside=[refused])
    assert confidence(winner, beside, ENTRIES) == (0.995, 0.995, "")
    assert confidence(winner, replace(beside, aside=[]), ENTRIES)[::2] == (0.0, "load lag")
    assert confidence(replace(winner, free=winner.free + wide.free[:1]), beside, ENTRIES)[0] < 0.01


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
        rows=np.ones(n, bool), blocks=np.arange(n) // 10, absolute=dict, experiment=SimpleNamespace(step=1e-3), asked=()
    )
    candidate = Candidate(Hypothesis("load", "tilt", free), free, fit, MENDS, chance=0.005)
    kept = contest(candidate, base=NOTHING)
    base = SimpleNamespace(values={})
    (cause,) = named(SimpleNamespace(causes=[candidate], kept=[kept], problem=problem, final=fit, searched=ENTRIES, base=base))
    assert (cause.mark == "weak") == weak and bool(cause.parameters["load.tilt"]["doubt"]) == weak


@pytest.mark.parametrize("ended, alike, told", [(14.0, True, True), (9.0, True, False), (14.0, False, False), (0.0, True, False)])
def test_what_is_more_of_an_uncertain_value_than_its_range_has_is_told_as_that(ended, alike, told, rng):
    """A guide's friction beyond what the rig gave the gear's was a warm-up of ten hours, `explained` with a confidence of 0.995."""
    n = 400
    column, other, noise = rng.standard_normal((3, n))
    beside = column + 1e-3 * other if alike else other
    excess = Free("reducer.cold_excess", 0.0, -0.9, 5.0, "", role=AMPLITUDE)
    drag = Free("reducer.drag_torque", 8.0, 0.0, 14.0, "N", role=VALUE)
    fit = Fit((drag, excess), {drag.name: 13.9, excess.name: 0.4}, noise, -np.stack([beside, column], -1), np.ones(n))
    problem = SimpleNamespace(
        rows=np.ones(n, bool),
        blocks=np.arange(n) // 10,
        absolute=dict,
        experiment=SimpleNamespace(step=1e-3),
        asked=(drag,),
    )
    candidate = Candidate(Hypothesis("reducer", "warm_up", (excess,)), (excess,), fit, MENDS, chance=0.005)
    outcome = SimpleNamespace(causes=[candidate], kept=[contest(candidate, base=NOTHING)], problem=problem, final=fit)
    outcome.searched, outcome.base = ENTRIES, SimpleNamespace(values={drag.name: ended})
    (cause,) = named(outcome)
    assert bool(cause.indistinguishable_from) == told
    assert verdict([cause], [], outcome) == ("ambiguous" if told else "explained")
    if told:
        assert cause.indistinguishable_from == ["reducer.drag_torque outside of its range, 0 to 14"]
        assert cause.separate_by == "Widen reducer.drag_torque under [uncertain], and diagnose again."
