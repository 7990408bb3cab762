"""Which FMUs act once a step, and what is made of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import strangers
from rivals import cause

from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.naming import run, sampled
from selflock.diagnosis.naming.round import Round
from selflock.diagnosis.naming.run import Search, _better
from selflock.diagnosis.naming.whole import Whole
from selflock.diagnosis.naming.work import Work
from selflock.master.system import Component, Run, System

H = 0.1
U = np.repeat([1.0, -2.0, 0.5, 3.0], 5)


def told(step):
    """What an FMU tells of U in the pieces of a step: step(state, u, h) -> state; or that, and what it tells."""

    def alone(played, outputs, inputs, series, settings, pieces):
        x, found = 0.0, [0.0]
        for u in np.repeat(U, pieces):
            made = step(x, u, H / pieces)
            x, y = made if isinstance(made, tuple) else (made, made)
            found.append(y)
        return {"a.y": np.array(found)}

    return alone


@pytest.mark.parametrize(
    ("step", "once"),
    [
        (lambda x, u, h: 3.0 * u - 1.0, True),  # computes
        (lambda x, u, h: x + 0.2 * u, True),  # sums up, whatever the step is
        (lambda x, u, h: (x + h * u, 3.0 * u + x), True),  # mostly at once, as a controller with an integral
        (lambda x, u, h: x + h * (u - x), False),  # Euler
        (lambda x, u, h: u + (x - u) * np.exp(-h), False),  # exact
        (lambda x, u, h: x + h * u, False),  # an integral
        (lambda x, u, h: 0.0 * u, False),  # nothing moves
    ],
)
def test_what_computes_or_counts_acts_once_a_step_and_what_has_a_state_does_not(monkeypatch, step, once):
    monkeypatch.setattr(sampled, "_alone", told(step))
    links = {"b.u": SimpleNamespace(source="a", output="y")}
    parts = SimpleNamespace(
        inputs={"a": ["a.u"]}, owner=lambda name: "a", links=links, variables={"a.y": SimpleNamespace(type="Real")}
    )
    played = SimpleNamespace(parts=parts)
    assert sampled._acts_once(played, "a", {"a.u": U}, {}) == once


@pytest.mark.slow
@pytest.mark.parametrize(("domain", "found"), [("mechanical", {"controller"}), ("electrical", set()), ("house", {"thermostat"})])
def test_of_the_plants_the_controller_acts_once_a_step(tmp_path, monkeypatch, domain, found):
    monkeypatch.setattr(strangers, "ROWS", 60)
    rig, train, test = strangers.write(strangers.hide("none", 10_000, domain), tmp_path)
    seen = []

    def asked(near, values):
        seen.append(sampled.sampled(near, values))
        raise RuntimeError("seen")

    monkeypatch.setattr(run, "sampled", asked)
    with pytest.raises(RuntimeError, match="seen"):
        run_of(rig, train, test)
    assert seen == [found]


def run_of(rig, train, test):
    from selflock.diagnosis import name

    return name(rig, [train], test=[test], out=None, starts=1, kinds=["path"])


@pytest.mark.parametrize(
    ("own", "finer", "taken"),
    [((1.0, 1), (1.0, 8), "own"), ((1.0, 8), (1.0, 1), "finer"), ((2.0, 1), (1.0, 8), "finer"), ((1.0, 8), (2.0, 1), "own")],
)
def test_of_two_readings_of_what_acts_once_a_step_the_one_that_leaves_less_or_needs_less_is_taken(own, finer, taken):
    """A dead zone was named as Stribeck, twice, with eight numbers: in finer steps its sampled controller was another one."""
    one, begin = Number("c.a", "c.a", 0.0, 0.0, 1.0), Number("c.d of log", "c.d", 0.0, 0.0, 1.0, run=0)
    search = lambda name, left, numbers: SimpleNamespace(
        name=name,
        best=Whole(None, None, {}, None, {"x": left}, {}),
        work=SimpleNamespace(found=[(one,) * numbers, (begin,) * (9 - numbers)]),  # where a run begins counts for nothing
    )
    assert _better(search("own", *own), search("finer", *finer)).name == taken


@pytest.mark.parametrize(
    ("left", "explains", "asked"),
    [
        ((0.5, 0.5), {"finer"}, ["finer"]),
        ((0.5, 0.5), {"own"}, ["finer", "own"]),
        ((1.0, 0.5), {"finer"}, ["finer"]),  # beside what is missing from the first
        ((1.2, 0.5), {"own"}, ["own"]),
        ((0.99, 0.99), {"own"}, ["own"]),
        ((0.99, 0.99), {"finer"}, ["own", "finer"]),
    ],
)
def test_the_steps_that_leave_less_are_searched_first_beside_what_only_computes(monkeypatch, left, explains, asked):
    """A house of six FMUs in a loop: what its own steps miss was several times the noise, and was searched for a cause, for minutes.

    So it was still where another output's sensor was off, beside which what the steps miss of the first is little of all.
    """
    seen = []
    problem = lambda name, left: SimpleNamespace(
        name=name, rows=dict(zip("xy", left)), values=lambda at: {}, played=SimpleNamespace(extend=list)
    )
    own, finer = problem("own", (1.0, 1.0)), problem("finer", left)

    def rounds(asked, work, near, places):
        seen.append(near.name)
        best = Whole(None, None, {}, None, {"x": 1.0}, {})
        explained = lambda: near.name in explains
        return SimpleNamespace(explains=explained, named=[], best=best, work=SimpleNamespace(found=[]))

    components = {"thermostat": SimpleNamespace(step=0.0), "room": SimpleNamespace(step=0.0)}
    parts = SimpleNamespace(system=SimpleNamespace(components=components))
    work = Work(None, parts, [], (), set(), [], "", None, None, 1.0)
    monkeypatch.setattr(run, "_fitted_base", lambda asked, work, *_: (work, own, 0.0))
    monkeypatch.setattr(run, "_as_given", lambda work: None)
    monkeypatch.setattr(run, "sampled", lambda near, values: frozenset({"thermostat"}))
    monkeypatch.setattr(
        run, "fine_enough", lambda work, near, places: (work, own, 0.0) if work.keep else (replace(work), finer, 0.0)
    )
    monkeypatch.setattr(run, "sizes", lambda problem, values, rows: rows)
    monkeypatch.setattr(run, "_rounds", rounds)
    run._causes(SimpleNamespace(enough=lambda: False), work, 1, 0)
    assert seen == asked


@pytest.mark.parametrize(
    ("names", "quiet", "there", "enough"),
    [
        (["curve"], True, (1.0, 2.0), True),
        (["curve"], True, (1.0, 1.0), True),
        (["curve"], True, (0.9, 2.0), False),
        (["curve"], False, (1.0, 2.0), False),
        (["Stribeck", "Coulomb"], True, (1.0, 2.0), False),  # a dead zone, in the steps of another controller
    ],
)
def test_where_other_steps_leave_no_less_beside_a_curve_they_are_not_searched(monkeypatch, names, quiet, there, enough):
    """Of a curve in a house all was looked at twice: it is no name, and only what has one explains."""
    here = Whole(None, None, {}, {"x": 1.0, "y": 1.0}, None, {})
    rounds = [Round(None, [], cause(name, 1.0), off=np.array([not quiet])) for name in names]
    asked = []

    def fitted(work, values, fixed):
        asked.append([one.name for one in work.inserts])
        return Whole(None, None, {}, dict(zip("xy", there)), None, {})

    monkeypatch.setattr(run, "fitted", fitted)
    monkeypatch.setattr(run, "remaining", lambda problem, values: {"x": (1.0, 0.5), "y": (1.0, 0.5)})
    work = Work(None, None, [], (), set(), [], "", None, SimpleNamespace(extend=list), 1.0)
    found = Search(work, None, here, here, rounds, [], work, lambda: False)
    assert run._as_much(found, work, SimpleNamespace(fixed={})) == enough
    assert asked == ([["curve"]] if quiet and len(names) == 1 else [])


def test_where_a_round_saw_no_more_than_noise_all_is_explained_though_its_steps_leave_more():
    """A round sees what steps that vanish would leave; what is written are steps that were halved three times."""
    whole = Whole(None, None, {}, {"x": 2.0}, None, {})
    quiet, off = (Round(None, [], off=np.array([one])) for one in (False, True))
    work = SimpleNamespace(played=SimpleNamespace(extend=list), inserts=())
    found = Search(work, None, whole, whole, [quiet], [], work, lambda: False)
    assert quiet.quiet and not off.quiet and found.explains()


@pytest.mark.parametrize(("told", "won", "leaves"), [(True, True, True), (False, True, False), (True, False, False)])
def test_beside_a_curve_that_left_no_more_than_noise_only_steps_leave_more(monkeypatch, told, won, leaves):
    """Steps over a house's wall were found after 245 s, and looked for once more: what eighths of its steps miss was 1.4 times a radiator's noise."""
    monkeypatch.setattr(run, "remaining", lambda problem, values: {"x": (1.0, 0.5)})
    whole, curve, law = Whole(None, None, {}, {"x": 2.0}, None, {}), cause("curve", 1.0), cause("law", 1.0)
    only = (curve.guess.place, curve.guess.over[0]) if told else None
    outcome = Round(None, [], curve if won else law, curve=curve, only=only, off=np.array([True]))
    work = SimpleNamespace(played=SimpleNamespace(extend=list), inserts=())
    assert Search(work, None, whole, whole, [outcome], [], work, lambda: False).leaves_noise() == leaves


def test_in_finer_steps_of_all_others_a_sampled_controller_keeps_the_rigs(monkeypatch):
    """Behind a friction in its loop a false second cause was named: what long steps miss where it turns round could not be asked."""
    monkeypatch.setattr(Work, "played_on", lambda self, parts, runs, numbers: None)
    system = System(components={"controller": Component(), "body": Component(), "slow": Component(step=0.4)}, run=Run(step=0.1))
    work = Work(None, SimpleNamespace(system=system), [], (), set(), [], "", None, None, 0.1)
    kept = replace(work, sampled=frozenset({"controller", "slow"})).keeping()
    assert kept.keep == {"controller"} and kept.others == {"slow"}
    finer = kept.in_steps(0.5).in_steps(0.5)
    assert finer.step == pytest.approx(0.025)
    acts = {name: (c.step, c.samples) for name, c in finer.parts.system.components.items()}
    assert acts == {"controller": (0.1, True), "body": (0.0, False), "slow": (0.4, False)}
    assert finer.in_steps(4.0).parts.system == work.in_steps(0.5).in_steps(2.0).parts.system == system
