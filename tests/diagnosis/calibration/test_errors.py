"""What is left of an output against its noise, both told by samples: few of them make more of it by chance."""

import numpy as np
import pytest

from selflock.diagnosis.calibration.result import ChannelError, FittedNumber
from selflock.diagnosis.residuals.noise import of_samples
from selflock.diagnosis.rules import RULES


def lacking(rng, rows, judged, left=1.0):
    """Whether more than noise is said to be left where an error of other samples is `left` times that noise."""
    seen, unseen = rng.standard_normal(rows), left * rng.standard_normal(judged)
    noise = of_samples([seen], [np.ones(rows, bool)])
    held_out = float(np.sqrt(np.mean(unseen**2)))
    return ChannelError("y", "", 9.0, 1.0, noise, 9.0, rows, 9.0, held_out, judged).lacking


@pytest.mark.slow
@pytest.mark.parametrize("rows", [100, 1200, 12_000])
def test_noise_alone_lacks_nothing(rng, rows):
    """At most in `significant` of the cases; of 600 a share of a fiftieth scatters by 0.6 %."""
    assert np.mean([lacking(rng, rows, rows) for _ in range(600)]) <= RULES.judge.significant + 4 * 0.006


@pytest.mark.parametrize(("rows", "left"), [(1200, 1.4), (12_000, 1.2), (100_000, 1.12)])
def test_what_is_beyond_it_is_told_the_finer_the_more_samples(rng, rows, left):
    assert all(lacking(rng, rows, rows, left) for _ in range(50))


def test_a_run_that_broke_off_lacks(rng):
    assert ChannelError("y", "", None, None, 0.1, 1.0, 100).lacking


@pytest.mark.parametrize(
    "left, said",
    [(1.0, ""), (1.4, ""), (3.0, "y is off by 3 times its noise"), (1e3, "more than what was measured of it varies")],
)
def test_what_is_left_speaks_against_the_numbers(left, said):
    """A car in steps of a row left 2.9 times the noise, its drag beside the truth by four intervals, and nothing was doubtful."""
    doubts = ChannelError("y", "", 5.0, 0.1 * left, 0.1, 9.0, 2000, 5.0, 0.1 * left, 2000).sentences()
    assert len(doubts) == bool(said) and all(said in doubt for doubt in doubts)


def test_a_level_within_one_step_of_what_was_written_is_no_wrong_unit():
    """A battery at rest, its charge written in 0.1 %: the model's falls by a tenth of that, and every row has the same number."""
    (doubt,) = ChannelError("soc", "", 0.16, 9e-5, 3.5e-7, 1e-9, 3000, 0.16, 9e-5, 1000).sentences()
    assert "stands still" in doubt and "unit" not in doubt


@pytest.mark.parametrize("error", [None, 0.01])
def test_where_a_number_that_nothing_tells_ends_is_shown_and_is_no_doubt_of_its_range(error):
    loose = FittedNumber(
        "k", "k", 0.3, 0.05, 0.3, error, 0.12, (0.05, 0.3), "", "", determined=error is not None, at_bound="highest"
    )
    said = " ".join(loose.sentences())
    assert ("the highest value of its range" in said) == (error is not None)
    assert ("not determined" in said) == (error is None)
