"""What others measured and others found: the spring of the Silverbox. The whole data are judged by benchmarks.silverbox --name.

A part of them is enough to name the law; the errors here are those of the part.
"""

import pytest

from benchmarks import silverbox
from selflock.diagnosis import name
from selflock.diagnosis.rules import RULES


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.skipif(not silverbox.DATA.exists(), reason="the measured data are not part of the project")
def test_the_silverbox_lacks_a_cubic_stiffness(tmp_path, monkeypatch):
    for rule, value in {
        "glance": 1500,
        "rounds": 1,
        "fits": 3,
        "fits_derived": 0,
        "of_law": 0,
        "polished": 1,
        "curves": 1,
    }.items():
        monkeypatch.setitem(vars(RULES.naming), rule, value)  # for speed
    monkeypatch.setattr(silverbox, "FINER", 2)
    rig, log, test = silverbox.prepared(tmp_path, (40_600, 44_600), (30_000, 34_000))
    rig.write_text(rig.read_text().replace("[rig]\n", '[rig]\ninputs = "smooth"\n'))
    result = name(rig, [log], test=[test], out=None, kinds=("law",), starts=1)
    assert result.verdict == "explained", result.summary()
    (cause,) = result.causes
    assert (cause.law, cause.place, cause.over) == ("cubic", "oscillator.force", "oscillator.position")
    assert "stiffness" in cause.sentence()
    (error,) = result.errors
    assert error.after < 0.25 * error.before  # begun in the middle of a motion, at a speed that no number says
