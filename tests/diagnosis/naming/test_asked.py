"""What is asked of data that judge, and of a second cause; and where the state of a missing law may begin."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rivals import cause

from selflock.diagnosis.naming import asked as asked_module
from selflock.diagnosis.naming import guesses, instead
from selflock.diagnosis.naming.asked import told_apart
from selflock.diagnosis.naming.guesses import EVENT, with_state
from selflock.diagnosis.naming.places import IN, Place
from selflock.diagnosis.naming.round import Round
from selflock.diagnosis.naming.run import Search
from selflock.diagnosis.naming.scene import Scene
from selflock.diagnosis.naming.whole import Whole
from selflock.diagnosis.naming.work import Work
from selflock.diagnosis.search.candidate import Candidate


def whole(*held):
    return Whole(None, None, {}, None, dict(zip("xy", held)), {})


@pytest.mark.parametrize(
    ("limit", "dead_band", "beyond", "first", "beside"),
    [
        ((3.0, 1.0), (1.0, 1.0), True, "dead band", []),  # the data that judge ask for the other one
        ((1.0, 1.0), (1.2, 1.0), True, "limit", []),  # and here they refuse it
        ((1.0, 1.0), (1.02, 1.0), True, "limit", ["dead band"]),  # nor here do they tell them apart
        ((1.0, 2.0), (2.0, 1.0), True, "limit", ["dead band"]),  # or of each output otherwise
        ((1.2, 1.0), (1.0, 1.0), False, "limit", ["dead band"]),  # what steps miss says nothing
        ((1.0, 1.0), (1.2, 1.0), False, "limit", ["dead band"]),
    ],
)
def test_what_taught_cannot_tell_apart_data_that_judge_may(monkeypatch, limit, dead_band, beyond, first, beside):
    """A dead band was named as a limit: what taught went beyond it to one side alone. And a level's overflow as its flow's.

    And one more thermal mass of a house's room as the wall's where the room is read, by what the finest steps missed of each.
    """
    monkeypatch.setattr(asked_module, "beyond_steps", lambda *_: beyond)
    one, other = cause("limit", 1.0), cause("dead band", 1.0)
    left = {"limit": whole(*limit), "dead band": whole(*dead_band)}
    tried = lambda rival: (rival.guess.label, left[rival.guess.label])
    rival, work, after, refuted = told_apart((one, *tried(one)), [other], tried, False)
    assert (rival.guess.label, work, after) == (first, first, left[first])
    assert [r.guess.label for r in (one, other) if r is not rival and r not in refuted] == beside
    assert told_apart((one, *tried(one)), [other], tried, True)[0] is one  # no time is left to ask


def test_of_an_event_other_runs_say_nothing():
    event, law = cause("event", 1.0), cause("law", 1.0)
    event.guess = replace(event.guess, kind=EVENT)
    tried = lambda rival: (None, whole(3.0 if rival is event else 1.0))
    assert told_apart((event, *tried(event)), [law], tried, False)[0] is event
    assert told_apart((law, *tried(law)), [event], tried, False)[3] == []


@pytest.mark.parametrize(
    ("left", "loss", "beyond", "one"),
    [
        (1.02, 0.1, True, True),
        (1.2, 0.1, True, False),  # more is left of what judges
        (1.02, 0.5, True, False),  # of unseen blocks
        (1.2, 0.1, False, True),  # no more than steps miss
    ],
)
def test_a_second_cause_goes_where_another_name_of_the_first_leaves_nothing_for_it(monkeypatch, left, loss, beyond, one):
    """A lag before a body was named, and a state of first order that made up for its sensor's, which was as good a name for the first."""
    first, second, other = cause("lag before", 1.0), cause("state", 1.0), cause("lag behind", 1.0, loss=loss)
    other.problem = SimpleNamespace(fixed={})
    work = Work(None, None, [], (), {1}, [], "", None, None, 1.0)
    monkeypatch.setattr(instead, "fitted", lambda work, *_: whole(left if work.inserts[0].name == "lag behind" else 0.1))
    monkeypatch.setattr(asked_module, "beyond_steps", lambda *_: beyond)
    base = Candidate(first.guess.hypothesis, (), None, np.ones((4, 1)))
    rounds = [Round(base, [], first, order=[first, other], beside=[other]), Round(base, [], second, order=[second])]
    both = replace(work, inserts=(*first.guess.inserts, *second.guess.inserts))
    found = Search(both, None, whole(9.0), whole(1.0), rounds, [], work, lambda: False)
    instead.one_alone(found)
    assert [outcome.winner for outcome in found.named] == ([other] if one else [first, second])
    assert found.best.held["x"] == (left if one else 1.0)
    assert found.work.inserts == (other.guess.inserts if one else both.inserts)
    assert rounds[0].beside == ([] if one else [other])


def test_a_state_of_first_order_is_looked_at_also_as_it_begins_at_0(monkeypatch):
    """Of a slow one that most is seen: its level was settled beside the base's numbers, and the next tank's level was named instead."""
    monkeypatch.setattr(guesses, "ahead", lambda *_: 0.5)
    time = np.arange(50.0)
    series = {"time": [time, time], "tank.level": [3.0 + np.sin(time), 2.0 + np.cos(time)], "tank.inflow": [time, time]}
    runs = [SimpleNamespace(log=name, name="") for name in ("one", "two")]
    parts = SimpleNamespace(system=SimpleNamespace(run=SimpleNamespace(step=1.0)))
    scene = Scene(parts, SimpleNamespace(runs=runs), series, "c")
    looks = [one for one in with_state(scene, Place(IN, "tank.inflow"), "tank.level", 0) if one.guess.law == "first order"]
    begun = [{n.run: one.at.get(n.name, 0.0) for n in one.guess.numbers if n.run is not None} for one in looks]
    settled, empty = [d == {0: 0.0, 1: 0.0} for d in begun], [d == {0: -3.0, 1: -3.0} for d in begun]
    assert len(looks) > 4 and sum(settled) == sum(empty) == len(looks) // 2
    assert all(one.acting == ("c.a",) and "c.T" in one.at for one in looks)
