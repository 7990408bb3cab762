"""Two causes of one size hide each other: where all else leaves more than noise, a number of an FMU is asked first."""

from types import SimpleNamespace

import pytest

from selflock.diagnosis.naming import run
from selflock.diagnosis.naming.guesses import LAW, PARAMETER
from selflock.diagnosis.naming.round import Round


def rival(kind, chance=0.005):
    return SimpleNamespace(guess=SimpleNamespace(kind=kind), candidate=SimpleNamespace(chance=chance))


def searched(first, left, rounds=None, named=1):
    """A search whose best leaves so many times its noise."""
    return SimpleNamespace(
        outcomes=rounds or [first], named=[first] * named, best=left, leaves_noise=lambda: left < 1.1,
        work=SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None), inserts=()),
    )  # fmt: skip


@pytest.fixture
def play(monkeypatch):
    """Plays a search that leaves `left`, beside others that begin with each of some numbers; what was found, and what was asked first."""

    def play(left, others, winner=None, up=False):
        law = rival(LAW)
        numbers = {one: rival(PARAMETER, chance) for one, (chance, *_) in others.items()}
        first = Round(SimpleNamespace(), [law, *numbers.values()], winner=winner and numbers[winner] or law)
        asked, names = [], {id(one): name for name, one in numbers.items()}

        def rounds(_, work, near, places, begun):
            (only,) = begun.order
            assert begun.winner is None and begun is not first
            asked.append(names[id(only)])
            _, ends, count = others[asked[-1]]
            return searched(begun, ends, named=count)

        monkeypatch.setattr(run, "_rounds", rounds)
        monkeypatch.setattr(run, "helps", lambda one, other: one < 0.95 * other)
        begin = None, SimpleNamespace(played=SimpleNamespace(extend=lambda inserts: None)), None
        found = searched(first, left)
        return run._number_first(found, SimpleNamespace(enough=lambda: up), begin) is not found, asked

    return play


@pytest.mark.parametrize(
    ("left", "others", "expected"),
    [
        (5.0, {"a": (0.005, 1.0, 2)}, (True, ["a"])),
        (5.0, {"a": (0.005, 3.0, 2), "b": (0.005, 1.0, 2)}, (True, ["a", "b"])),
        (5.0, {"a": (0.005, 3.0, 2)}, (False, ["a"])),
        (5.0, {"a": (0.005, 1.0, 1)}, (False, ["a"])),
        (5.0, {"a": (0.9, 1.0, 2)}, (False, [])),
        (1.0, {"a": (0.005, 0.9, 2)}, (False, [])),
    ],
    ids=["hidden", "the second", "more than noise", "nothing beside it", "by chance", "noise already"],
)
def test_a_number_comes_first_where_with_something_beside_it_no_more_than_noise_is_left(play, left, others, expected):
    assert play(left, others) == expected


def test_a_number_that_came_first_already_is_not_asked_again(play):
    assert play(5.0, {"a": (0.005, 1.0, 2)}, winner="a") == (False, [])


def test_nothing_is_begun_when_time_is_up(play):
    assert play(5.0, {"a": (0.005, 1.0, 2)}, up=True) == (False, [])
