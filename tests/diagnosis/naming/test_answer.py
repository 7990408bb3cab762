"""An answer says what contradicts it, and no two of its sentences contradict each other."""

from types import SimpleNamespace

import pytest

from selflock.diagnosis.naming.answer import _closed, _closer, _unseen, _verdict
from selflock.diagnosis.naming.guesses import CURVE, EVENT, LAW
from selflock.diagnosis.naming.outcome import Fitted, NamedCause, NamedError, Naming
from selflock.diagnosis.naming.round import Round
from selflock.diagnosis.rules import RULES


@pytest.mark.parametrize("verdict, times, told", [("none", 5.0, True), ("none", 1.2, False), ("explained", 5.0, False)])
def test_that_nothing_is_missing_is_held_against_the_data_that_judge(rng, verdict, times, told):
    """A log of half a second determined nothing: the other was off by five times the noise, and nothing was missing."""
    noise = rng.uniform(0.1, 10.0)
    errors = [NamedError("body.position", "m", times * noise, times * noise, None, None, noise)]
    said = _unseen(verdict, errors)
    assert bool(said) == told
    assert all(f"body.position is off by {times:.2g} times the noise" in sentence for sentence in said)


def test_a_run_that_breaks_off_or_has_no_noise_is_off_by_nothing():
    errors = [NamedError("a", "", None, None, None, None, 1.0), NamedError("b", "", 1.0, 1.0, None, None, 0.0)]
    assert _unseen("none", errors) == []


def test_what_remains_beside_nothing_that_is_missing_is_told_in_one_sentence():
    assert _verdict([], 1.1, False) == ("none", "Nothing is missing that these data could show")
    verdict, why = _verdict([], 1.12, True)
    assert verdict == "none" and why.startswith("What remains is 1.1 times its noise")
    assert _verdict([], RULES.judge.excess + 0.1, True)[0] == "unknown"


def test_a_name_of_a_part_is_told_as_that_of_a_part():
    cause = NamedCause("law", "cubic", "cubic of x on y", "y", "in", "x", False, "a x^3", [], 0.3, 0.005)
    assert _verdict([cause], 1.0, False) == ("explained", "What is missing has a name")
    verdict, why = _verdict([cause], 6.2, True)
    assert verdict == "explained" and why == "Some of what is missing has a name: what remains is 6.2 times its noise"


def test_a_number_that_the_logs_do_not_determine_is_told_as_such():
    """It stood there as a value like any other."""
    assert str(Fitted("a", 0.81583, None, None)) == "a = 0.8158 [not determined]"
    assert str(Fitted("a", 0.81583, 0.8, 0.9)) == "a = 0.8158 [0.8, 0.9]"
    assert str(Fitted("a", 0.81583, None, None, unit="kg")) == "a = 0.8158 [not determined] kg"


@pytest.mark.parametrize("size", [1.0, -1.0, 1e-12, 1e9])
def test_the_ends_of_an_interval_are_told_apart(size):
    """An outlet was 0.0012 [0.0012, 0.0012]."""
    told = str(Fitted("tank.outlet", size * 1.2, *sorted((size * 1.19993, size * 1.20007)), unit="m2"))
    value, low, high = (float(word.strip("[],")) for word in told.split()[2:5])
    assert low < value < high and told.endswith("] m2")
    assert high - low == pytest.approx(abs(size) * 1.4e-4, rel=0.02)
    assert len(str(Fitted("a", 1.0, 1.0, 1.0))) < 20


def test_the_numbers_that_were_fitted_with_what_was_found_are_told_but_for_those_of_a_run():
    numbers = [Fitted("body.damping", 3.0, 2.9, 3.1), Fitted("body.begin of train.csv", 0.1, 0.0, 0.2, each_run=True)]
    effort = {"simulations": 1, "steps_per_second": 1.0, "elapsed": 1.0}
    found = Naming("none", "", "", "", [], "", [], [], None, {}, [], numbers, effort)
    assert "  fitted with it: body.damping = 3 [2.9, 3.1]" in found.summary().splitlines()


@pytest.mark.parametrize("low, high, told", [(None, None, False), (-3999.0, 3999.0, False), (0.1, 0.3, True), (-0.3, -0.1, True)])
def test_a_law_of_which_nobody_knows_how_much_there_is_is_no_answer(low, high, told):
    """A friction of bristles stood for a force's scale, with 1173 [-3999, 3999], and a random wind was one of nothing at all."""
    amount, shape = Fitted("a", 0.2, low, high), Fitted("w", 5.0, -1.0, 9.0)
    cause = NamedCause("law", "LuGre", "LuGre of x on y", "y", "in", "x", False, "a z", [amount, shape], 0.3, 0.005)
    verdict, why = _verdict([cause], 1.0, False)
    assert verdict == ("explained" if told else "unknown")
    assert told or why == f"LuGre of x on y has a name, and the data do not tell how much of it there is: {amount}"


@pytest.mark.parametrize(
    "kind, after, closed",
    [(LAW, 0.0378, 0.35), (LAW, 0.0242, 0.744), (LAW, 0.0075, 1.0), (EVENT, 0.0378, 0.9867)],
)
def test_what_closes_little_is_not_what_is_missing(kind, after, closed):
    """A bump that gives a plant two places of rest was a limit and a Coulomb friction, `explained`, with six times its noise left."""
    cause = NamedCause(kind, "limit", "limit of x on y", "y", "in", "x", False, "", [], 0.3, 0.005)
    errors = [
        NamedError("force", "N", 0.3, 0.3, None, None, 0.3),
        NamedError("position", "m", 0.0467, after, None, None, 0.0061, 0.07, 0.01),
    ]
    assert _closed(errors, [cause]) == pytest.approx(closed, abs=0.005)
    verdict, why = _verdict([cause], 4.0, True, _closed(errors, [cause]))
    assert verdict == ("unknown" if closed < 0.8 else "explained") and (f"closes {100 * closed:.0f} % of the error" in why) == (
        closed < 0.8
    )


def test_what_leaves_less_with_more_numbers_is_told_beside_the_simplest():
    """Coulomb friction is named as a square root of the speed where that does nearly as well with a number less: both are seen."""

    def rival(label, kind=LAW, doubt=""):
        return SimpleNamespace(guess=SimpleNamespace(label=label, kind=kind), candidate=SimpleNamespace(doubt=doubt))

    winner = rival("square root")
    ahead = [
        rival("Coulomb"),
        rival("a curve", CURVE),
        rival("Dahl", doubt="chance finds as much"),
        rival("drag"),
        rival("cubic"),
    ]
    outcome = Round(None, [*ahead, winner, rival("proportional")], winner, beside=[ahead[-1]])
    assert _closer(outcome, ["drag"]) == ["Coulomb"]
    assert _closer(Round(None, [winner, *ahead], winner), []) == []


@pytest.mark.parametrize("kind", [EVENT, LAW])
def test_an_event_tells_its_errors_where_it_was_and_what_is_left_of_which_output(kind):
    """A window was open in a run that taught: all errors that were told, of the run that judged, stayed as they were."""
    times = [Fitted("since", 36975.9, 36973.7, 36978.1, unit="s")]
    cause = NamedCause(
        kind, "event", "event on room.heat", "room.heat", "in", "", False, "a", times, 0.3, 0.005, runs=["b3_2.csv"]
    )
    errors = [NamedError("ctrl.u", "", 0.0029, 0.0027, None, None, 0.002, 0.077, 0.006)]
    effort = {"simulations": 1, "steps_per_second": 1.0, "elapsed": 1.0}
    left = {"significant": True, "ratios": {"room.t_room": 1.1, "ctrl.u": 3.0}}
    lines = Naming("explained", "", "", "", [], "x.csv", [cause], errors, None, left, [], [], effort).summary().splitlines()
    (told,) = (line for line in lines if "ctrl.u, held out" in line)
    assert ("where it taught 0.077 -> 0.006" in told) == (kind == EVENT)
    assert "  what remains is more than noise, most of ctrl.u, 3 times it" in lines
    assert any("since = 36975.9" in line and "] s" in line for line in lines)
