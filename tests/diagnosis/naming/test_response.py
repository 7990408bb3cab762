"""What is added at a place, and how outputs answer it, held against the simulation of the very same; and steps of two sizes."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import hidden
import numpy as np
import pandas as pd
import pytest
from scipy.optimize import least_squares

from selflock.diagnosis import name
from selflock.diagnosis.calibration import fit
from selflock.diagnosis.calibration.fit import Calibrating, fit_from
from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.calibration.slopes import Forward, Learnt, beside
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.naming.extended import Extended, Extending
from selflock.diagnosis.naming.guesses import CURVE, LAW, PATH, Guess, curve, heights, number, points_of
from selflock.diagnosis.naming.limit import Limit
from selflock.diagnosis.naming.looks import Looks
from selflock.diagnosis.naming.places import IN, OUT, READ, Insert, Place
from selflock.diagnosis.naming.response import Responses
from selflock.diagnosis.naming.scene import Scene
from selflock.diagnosis.naming.steps import in_own_steps
from selflock.diagnosis.naming.work import Work
from selflock.diagnosis.residuals.blocks import Blocks
from selflock.diagnosis.search.screen import Direction
from selflock.diagnosis.systems.parts import Parts
from selflock.master.stops import Stops

TANKS = """
[run]
stop = 1.0
step = 1.0

[components]
upper = { fmu = "tank.fmu" }
lower = { fmu = "tank.fmu" }

[connections]
"lower.inflow" = "upper.flow"
"""
TANKS_RIG = """
[rig]
system = "system.toml"
inputs = "held"

[columns]
"upper.inflow" = "pump"
"upper.level" = "first"
"lower.level" = "second"

[parameters]
"upper.gain" = 0.15
"upper.outlet" = 0.15
"lower.gain" = 1.0
"lower.outlet" = 0.18
"upper.level" = 3.0
"lower.level" = 2.5
"""


@pytest.fixture
def problem(tmp_path, native):
    """Two tanks in a row, none of whose inputs may stay open, on a log of 300 rows."""
    (tmp_path / "tank.fmu").write_bytes(native("tank").read_bytes())
    (tmp_path / "system.toml").write_text(TANKS)
    (tmp_path / "rig.toml").write_text(TANKS_RIG)
    pump = hidden.stairs(np.random.default_rng(1), 300, 0.5, 2.5)  # the same each time: how close times are decides how near
    table = {"time": np.arange(300.0), "pump": pump, "first": pump + 2.0, "second": pump + 1.0}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    rig = load(tmp_path / "rig.toml")
    runs = read(tmp_path / "log.csv", rig)
    rows = [np.ones(len(run), bool) for run in runs]
    found = Extending(rig, runs, (), [0], rows, units={"upper.level": 1.0, "lower.level": 1.0})
    vars(found)["played"] = Extended(rig, Parts(rig), runs, ())
    yield found
    found.close()


LEVEL = "upper.level"
ADDED = [
    (Insert("c", Place(IN, "upper.inflow"), "constant"), {"a": 1e-4}, 0.1),
    (Insert("c", Place(IN, "upper.inflow"), "cubic", over=LEVEL, fixed=(("ahead", 0.5),)), {"a": 1e-5}, 0.1),
    (Insert("c", Place(IN, "lower.inflow"), "proportional", True, over="lower.level"), {"a": 1e-4}, 0.1),
    (Insert("c", Place(IN, "upper.inflow"), "constant"), {"a": 1e-4, "since": 60.0, "until": 140.0}, 0.1),
    (Insert("c", Place(IN, "upper.inflow"), "first order", over=LEVEL), {"a": 1e-4, "T": 20.0}, 0.1),
    (Insert("c", Place(OUT, "upper.level"), "lag"), {"T": 3.0}, 1e-6),  # none listens to it: only the reading is late
    (Insert("c", Place(READ, "upper.level"), "quantisation"), {"q": 0.3}, 1e-6),
]


@pytest.mark.alike
@pytest.mark.parametrize(("one", "numbers", "near"), ADDED, ids=lambda x: x.law if isinstance(x, Insert) else "")
def test_outputs_answer_what_is_added_as_in_the_simulation(problem, one, numbers, near):
    """What a tank makes of its inflow changes with its level; answers are known at twelve times. What is recorded is exact."""
    values = {f"c.{word}": value for word, value in numbers.items()}
    frees = tuple(Number(word, word, 0.0, -1e300, 1e300) for word in values)
    over = [one.over] if one.over and not one.own else []
    answered = Responses(problem, {}, (), {one.place: over}, {one.place: 1.0}).change(
        one, replace(problem, numbers=frees).settings(values)
    )
    before = problem.misfit(np.zeros(0))
    problem.played.extend([one])
    trial = replace(problem, numbers=frees)
    vars(trial)["played"] = problem.played
    errors = trial.errors(values)
    assert errors is not None, problem.played.last
    simulated = np.concatenate([e[0] for e in errors.values()]) - before
    assert np.linalg.norm(simulated) > 0.0
    assert np.linalg.norm(answered - simulated) <= near * np.linalg.norm(simulated)


def test_longer_steps_beside_what_finer_ones_change_leave_what_these_leave(problem):
    """And what these would leave if they were finer still: of held values half a step's error is known from twice the step."""
    work = Work(
        problem.rig,
        problem.played.parts,
        problem.runs,
        (),
        set(),
        problem.rows,
        "",
        Blocks(problem.runs, False),
        problem.played,
        1.0,
    )
    with work.opened:
        fine = work.in_steps(1.0 / 16.0)
        near = replace(problem)
        vars(near)["played"] = fine.played
        own = in_own_steps(fine, near, np.zeros(0))
        assert own.played.parts.system.run.step == 1.0 and near.played.parts.system.run.step == 1.0 / 16.0
        left, same = near.errors({}), own.errors({})
        longer = problem.errors({})
        finest = replace(problem)
        vars(finest)["played"] = work.in_steps(1.0 / 512.0).played
        aim = finest.errors({})
        for output in left:
            missed = [np.linalg.norm(one[output][0] - aim[output][0]) for one in (same, left)]
            assert missed[0] <= 0.2 * missed[1] + 1e-9  # those of 1/512 have a part of their own, 1/31 of that
        assert np.linalg.norm(longer["lower.level"][0] - left["lower.level"][0]) > 1e-3  # whose inflow is held for a step
        assert in_own_steps(work, problem, np.zeros(0)) is problem  # in its own steps already


def test_slopes_learnt_from_steps_are_those_along_them():
    """Broyden's: J s is what was seen, and across s nothing changed; slopes that are known are not asked for."""
    numbers = [Number(n, n, 0.5, 0.0, 1.0) for n in "ab"]
    misfit = lambda x: np.array([x[0] ** 2, x[0] * x[1], x[1]])
    asked = []
    slopes = Learnt(Forward(lambda x: asked.append(x) or misfit(x), numbers), {"a": np.array([1.0, 0.5, 0.0])})
    here, there = np.array([0.5, 0.5]), np.array([0.6, 0.4])
    first = slopes(here, misfit(here)).copy()
    assert first[:, 0].tolist() == [1.0, 0.5, 0.0] and first[:, 1] == pytest.approx([0.0, 0.5, 1.0], abs=1e-6)
    assert all(x[0] == 0.5 for x in asked)
    second = slopes(there, misfit(there))
    step, across = there - here, np.array([1.0, 1.0])
    assert second @ step == pytest.approx(misfit(there) - misfit(here))
    assert second @ across == pytest.approx(first @ across)


def test_slopes_of_what_takes_less_time_are_its_own_and_those_of_the_fit_where_it_breaks_off():
    numbers, asked = [Number(n, n, 0.5, 0.0, 1.0) for n in "ab"], []
    mine, other = (lambda x: asked.append("mine") or np.array([x[0], x[1]])), (lambda x: np.array([2.0 * x[0], x[1] + 0.3]))
    here = np.array([0.5, 0.5])
    assert beside(other)(mine, numbers)(here, mine(here)) == pytest.approx(np.array([[2.0, 0.0], [0.0, 1.0]]))
    assert len(asked) == 1
    learnt = Learnt(beside(other)(mine, numbers), {"b": np.ones(2)})
    assert learnt(here, mine(here)) == pytest.approx(np.array([[2.0, 1.0], [0.0, 1.0]]))
    assert beside(lambda x: None)(mine, numbers)(here, mine(here)) == pytest.approx(np.eye(2))


def test_what_adds_nothing_changes_nothing(problem):
    """Most guesses are looked at from where they do nothing: nothing is to be computed of that."""
    one = Insert("c", Place(IN, "upper.inflow"), "cubic", over=LEVEL)
    responses = Responses(problem, {}, (), {one.place: [LEVEL]}, {one.place: 1.0})
    responses.kept[one.place] = [None], [{"": np.ones(300), LEVEL: np.arange(300.0)}]  # no answers are known
    assert not responses.change(one, [{"c.a": 0.0}]).any()


def test_a_fit_with_slopes_that_are_learnt_ends_where_one_with_its_own_does(problem):
    frees = (Number("upper.gain", "upper.gain", 0.15, 0.05, 0.5), Number("lower.outlet", "lower.outlet", 0.18, 0.05, 0.5))
    one = replace(problem, numbers=frees)
    vars(one)["played"] = problem.played
    start = np.array([n.place(n.start) for n in frees])
    apart = fit_from(one, start, 30, (1e-8, 1e-8))
    known = {n.name: column for n, column in zip(frees, np.eye(2) @ _slopes(one, start).T)}
    learnt = fit_from(one, start, 30, (1e-8, 1e-8), known=known)
    assert learnt.loss == pytest.approx(apart.loss, rel=1e-3)


def test_units_are_taken_anew_where_a_fit_began_far_off(problem):
    """Beside the noise of the upper tank a lower one whose unit was its error at the start counted for nothing, and was `unknown`."""
    frees = (Number("lower.outlet", "lower.outlet", 0.4, 0.05, 0.5),)
    one = replace(problem, numbers=frees)
    vars(one)["played"] = problem.played
    far = fit.units(one, {"lower.outlet": 0.4})["lower.level"]
    end = fit.in_units(one, np.array([n.place(n.start) for n in frees]), 15, (1e-3, 1e-3))
    near = fit.units(one, one.values(end.places))["lower.level"]
    assert near < 0.5 * far and one.units["lower.level"] == pytest.approx(near, rel=0.05)


def test_a_fit_that_begins_where_the_system_breaks_off_has_no_worth_and_ends_nothing(problem):
    """A law that was believed on the runs' heads broke off in finer steps, and the naming ended with an assertion."""
    one = replace(problem, numbers=(Number("lower.outlet", "lower.outlet", 0.4, 0.05, 0.5),))
    vars(one)["played"] = problem.played
    vars(one)["errors"] = lambda values, which=None: None
    end = fit.in_units(one, np.array([0.3]), 15, (1e-3, 1e-3))
    assert (end.loss, end.misfit, end.places.tolist()) == (np.inf, None, [0.3]) and one.units["lower.level"] > 0.0


def test_a_fit_answers_with_the_errors_where_it_ended(problem, monkeypatch):
    """Although solvers, as SciPy's of 1.15, weigh in place what they are given."""

    def weighing(value, start, jac, **more):
        def taken(call):
            def once(x):
                given = call(x)
                own = given.copy()
                given[:] = np.nan
                return own

            return once

        return least_squares(taken(value), start, jac=taken(jac), **more)

    monkeypatch.setattr(fit, "least_squares", weighing)
    frees = (Number("upper.gain", "upper.gain", 0.15, 0.05, 0.5),)
    one = replace(problem, numbers=frees)
    vars(one)["played"] = problem.played
    end = fit_from(one, np.array([0.2]), 5)
    assert end.misfit.tolist() == one.misfit(end.places).tolist() and np.isfinite(end.jacobian).all()


def _slopes(problem: Calibrating, start):
    at, found = problem.misfit(start), []
    for j in range(len(start)):
        moved = start.copy()
        moved[j] += 1e-5
        found.append((problem.misfit(moved) - at) / 1e-5)
    return np.stack(found, -1)


@pytest.mark.slow
def test_what_stops_looking_answers_with_the_best_so_far(tmp_path, native):
    """Time is up as the first guess was fitted: it is judged, named and told as what it is."""
    rig = hidden.rig(tmp_path, native("relaxation"))
    rng = np.random.default_rng(1)
    for log in ("log.csv", "test.csv"):
        hidden.body(rng, 300, read=lambda t, x: np.minimum(x, 0.5)).to_csv(tmp_path / log, index=False)
    told = []
    from selflock.diagnosis.naming import run

    result = run.name_system(
        load(rig), [tmp_path / "log.csv"], [tmp_path / "test.csv"], None, lambda what, share: told.append(what), 1, 0,
        ("path",), None, Limit(lambda: any("best so far" in what for what in told)),
    )  # fmt: skip
    assert result.stopped and any("the time limit came before all was held against the base" in note for note in result.notes)
    assert result.causes and result.causes[0].law.startswith("saturation")
    whole = name(rig, [tmp_path / "log.csv"], [tmp_path / "test.csv"], out=None, kinds=["path"])
    assert not whole.stopped and whole.effort["simulations"] > result.effort["simulations"]


@pytest.mark.slow
def test_an_event_may_add_several_times_what_its_place_varies_by(tmp_path, native, rng):
    """An open window takes more than what a loop's heater varies by; it was told as three times that, with an interval beside the truth."""
    rig, added = hidden.rig(tmp_path, native("relaxation")), rng.uniform(1.7, 2.2)
    opened = lambda t, x: hidden.LOSS * added if 8.0 <= t < 14.0 else 0.0
    for log, heat in (("log.csv", opened), ("test.csv", lambda t, x: 0.0)):
        held = hidden.stairs(rng, 400, -0.5, 0.5)
        hidden.body(rng, 400, heat, held=held).to_csv(tmp_path / log, index=False)
    result = name(rig, [tmp_path / "log.csv"], [tmp_path / "test.csv"], out=None, kinds=["event"])
    (cause,) = result.causes
    (amount,) = (n for n in cause.numbers if n.name == "a")
    assert cause.kind == "event" and amount.value == pytest.approx(added, rel=0.02) and not amount.at_end, cause


@pytest.mark.slow
@pytest.mark.parametrize(("at", "fitted"), [("the base", 0), ("first look", 0), ("best so far", 1)])
def test_whenever_time_is_up_there_is_an_answer(tmp_path, native, monkeypatch, at, fitted):
    """Where a step of the search took longer than the rest of its time, all of it ended without a word of what was found."""
    from selflock.diagnosis.naming import run

    rig = hidden.rig(tmp_path, native("relaxation"))
    rng = np.random.default_rng(1)
    for log in ("log.csv", "test.csv"):
        hidden.body(rng, 200, read=lambda t, x: np.minimum(x, 0.5)).to_csv(tmp_path / log, index=False)
    stops = SimpleNamespace(time_up=False, asked=False, calm=nullcontext)

    def tell(what, share):
        if at in what and not stops.time_up:
            stops.time_up = stops.asked = True
            raise KeyboardInterrupt

    if at == "the base":
        monkeypatch.setattr(run, "heads", lambda work: tell(at, 0.0))
    logs = [tmp_path / "log.csv"], [tmp_path / "test.csv"]
    quiet = tell if fitted or at == "first look" else lambda what, share: None
    result = run.name_system(load(rig), *logs, tmp_path / "out", quiet, 1, 0, ("path",), None, Limit(stops=stops))
    assert result.stopped and not stops.asked and (tmp_path / "out" / "report.html").exists()
    assert any(f"best of {fitted} guesses" in note for note in result.notes), result.notes
    assert len(result.causes) == min(fitted, 1)


@pytest.mark.slow
def test_time_that_is_up_when_all_was_looked_at_has_stopped_nothing(tmp_path, native, monkeypatch):
    from selflock.diagnosis.naming import run

    rig = hidden.rig(tmp_path, native("relaxation"))
    for k, log in enumerate(("log.csv", "test.csv")):
        hidden.body(np.random.default_rng(k), 200).to_csv(tmp_path / log, index=False)
    late = []
    monkeypatch.setattr(run, "at_once", lambda found: late)
    limit = Limit(lambda: bool(late))
    monkeypatch.setattr(run, "beyond", lambda found: late.append("time is up now") or [])
    logs = [tmp_path / "log.csv"], [tmp_path / "test.csv"]
    result = run.name_system(load(rig), *logs, None, lambda what, share: None, 1, 0, ("path",), None, limit)
    assert late and not result.stopped and limit() and limit.cut


@pytest.mark.slow
@pytest.mark.parametrize("at", ["chance", "report"])
def test_time_that_is_up_while_the_answer_is_made_loses_nothing_of_it(tmp_path, native, at):
    """What was found was held against chance when the time was up, and nothing was told of it; or its page was half written."""
    from selflock.diagnosis.naming import run

    rig, rung = hidden.rig(tmp_path, native("relaxation")), []
    for k, log in enumerate(("log.csv", "test.csv")):
        hidden.body(np.random.default_rng(k), 200, read=lambda t, x: np.minimum(x, 0.5)).to_csv(tmp_path / log, index=False)
    logs = [tmp_path / "log.csv"], [tmp_path / "test.csv"]
    with Stops() as stops:

        def tell(what, share):
            if at in what and not rung:
                rung.append(what)
                stops._ring()

        limit = Limit(lambda: bool(rung), stops)
        result = run.name_system(load(rig), *logs, tmp_path / "out", tell, 1, 0, ("path",), None, limit)
    assert rung and result.causes[0].law.startswith("saturation") and result.stopped == (at == "chance")
    assert (tmp_path / "out" / "report.html").exists() and (tmp_path / "out" / "naming.json").exists()


def test_an_interrupt_that_is_not_the_limits_ends_all(tmp_path, native):
    rig = hidden.rig(tmp_path, native("relaxation"))
    hidden.body(np.random.default_rng(1), 60).to_csv(tmp_path / "log.csv", index=False)

    def tell(what, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        name(rig, [tmp_path / "log.csv"], out=None, progress=tell, kinds=["path"], max_time=100.0)


def test_all_that_a_path_does_is_simulated_where_answers_change(problem):
    """A late command: the answers to each step and to its return are large, and what is left of both is not their sum's error."""
    place = Place(IN, "upper.inflow")
    guess = Guess(PATH, "delay", "delay", (Insert("c", place, "delay"),), (number("c.T", 0.0, 0.0, 20.0),))
    looks = Looks.__new__(Looks)
    looks.problem, looks.values, looks.inserts = problem, {}, ()
    looks.scene, looks.base = SimpleNamespace(played=problem.played), SimpleNamespace(misfit=problem.misfit(np.zeros(0)))
    recorded = Place(READ, "upper.level")
    looks.responses = Responses(problem, {}, (), {place: [], recorded: []}, {place: 1.0, recorded: 1.0})
    summed, moved = (looks._misfit(guess, {"c.T": 7.0}, whole) for whole in (False, True))
    trial = looks.trial(guess)
    simulated = trial.misfit(np.array([n.place(7.0) for n in trial.free]))
    change = np.linalg.norm(simulated - looks.base.misfit)
    assert np.linalg.norm(moved - simulated) < 1e-9 * change
    assert np.linalg.norm(summed - simulated) > 0.05 * change
    assert not looks.responses.steady(place)
    law = Insert("c", place, "square root", False, "upper.level")
    leak = Guess(LAW, "square root", "", (law,), (number("c.a", 0.0, -1.0, 1.0),))
    looks.arranged, looks.linear, looks.drawn = (
        SimpleNamespace(put=lambda x: x[None]),
        SimpleNamespace(look=lambda *_: None),
        None,
    )
    as_it_is = looks.simulated(Direction(None, {}, (), np.zeros((1, 1, 0))), leak)
    trial = looks.trial(leak)
    slope = (trial.misfit(np.array([0.501])) - looks.base.misfit) / 0.002
    assert as_it_is.columns[0, :, 0] == pytest.approx(slope[as_it_is.part], rel=1e-3, abs=1e-3 * abs(slope).max())
    read = replace(leak, inserts=(replace(law, place=recorded),))
    assert looks.simulated(Direction(None, {}, (), np.zeros((1, 1, 0))), read) is None


def with_a_curve(problem):
    """Looks over a base, a curve of five points over a level, and the values of its numbers."""
    xs, added = (0.5, 1.5, 2.5, 3.5, 4.5), (0.0, 0.2, 0.5, 0.7, 0.8)
    fixed = (("ahead", 0.5), ("ahead_beside", 0.0), *((f"x{k + 1}", x) for k, x in enumerate(xs)))
    table = Insert("c", Place(IN, "upper.inflow"), "table", over=LEVEL, points=5, fixed=fixed)
    numbers = tuple(number(f"c.c{k + 1}", 0.0, -9.0, 9.0) for k in range(5))
    curve = Guess(CURVE, "table", "", (table,), numbers, {n.name: {y: 1.0} for n, y in zip(numbers, heights(table))})
    looks = Looks.__new__(Looks)
    looks.problem, looks.values, looks.inserts, looks.ways, looks.drawn, looks.paths = problem, {}, (), [], None, {}
    base = problem.misfit(np.zeros(0))
    looks.base = SimpleNamespace(misfit=base, jacobian=np.zeros((len(base), 0)))
    looks.scene = Scene(problem.played.parts, problem.played, problem.played.series([{}], [0]), "c")
    looks.arranged = SimpleNamespace(put=lambda x: x[None])
    looks.linear = SimpleNamespace(look=lambda way, _: setattr(way, "gain", 1.0))
    return looks, curve, dict(zip((n.name for n in numbers), added))


def test_a_finer_curve_lies_where_its_variable_goes_beside_it_and_not_where_the_base_has_it(problem):
    """What comes in beside a pump fills a tank higher: beyond what the base reaches a curve stayed as at its last point."""
    looks, curve, values = with_a_curve(problem)
    before = looks.trial(curve).errors(values)
    made, start = looks.finer(curve, values, SimpleNamespace(jacobian=np.zeros((len(looks.base.misfit), 5))))
    points, beside = points_of(made.inserts[0]), looks.trial(curve).settings(values)
    levels = problem.played.series(beside, [0])[LEVEL][0]
    assert (points[0], points[-1], len(points)) == (levels.min(), levels.max(), 17)
    assert points[-1] > looks.scene.joined(LEVEL).max()
    after = looks.trial(made).errors(start)
    left = max(abs(after[name][0] - before[name][0]).max() for name in before)
    assert left < 0.02 * max(np.std(before[name][0]) for name in before)
    assert [guess for _, guess in looks.ways] == [made]


def test_a_curve_over_what_tells_its_variable_has_its_points_where_that_is_at_its_own(problem, monkeypatch):
    """Steps of a tank's level were a curve of its flow, alone: of five points over each those of the flow lay better."""
    looks, curve, values = with_a_curve(problem)
    curve, end = replace(curve, label="curve of a level"), SimpleNamespace(jacobian=np.zeros((len(looks.base.misfit), 5)))
    other, flows = replace(curve.inserts[0], over="upper.flow", points=0), 0.15 * np.sqrt(points_of(curve.inserts[0]))
    before = looks.trial(curve).errors(values)
    made, start = looks.told_over(curve, values, end, other)
    assert made.label.startswith("curve of upper.flow") and made.inserts[0].over == "upper.flow"
    assert points_of(made.inserts[0])[1:-1] == pytest.approx(flows[1:-1], rel=0.005)  # the others may lie beyond what is reached
    after = looks.trial(made).errors(start)
    left = max(abs(after[name][0] - before[name][0]).max() for name in before)
    assert left < 0.05 * max(np.std(before[name][0]) for name in before)
    goes, series = Looks._goes, looks.scene.series  # and one that falls where the level rises
    turned = lambda self, table, *at: (-1.0 if table.over == "upper.flow" else 1.0) * goes(self, table, *at)
    monkeypatch.setattr(Looks, "_goes", turned)
    monkeypatch.setattr(Looks, "_begun", lambda self, guess, values, end, table, at, word: (points_of(table), at))
    looks.scene.series = series | {"upper.flow": [-x for x in series["upper.flow"]]}
    points, at = looks.told_over(curve, values, end, other)
    assert points[1:-1] == pytest.approx(-flows[-2:0:-1], rel=0.005) and list(at) == list(values.values())[::-1]


def test_a_law_is_begun_as_a_curve_where_its_variable_goes(problem):
    """A bump was a limit, and a second that takes it off again: the curve of five points had ended at three times what one left."""
    looks, _, _ = with_a_curve(problem)
    limit = Insert("c", Place(IN, "upper.inflow"), "limit", over=LEVEL, fixed=(("ahead", 0.5), ("ahead_beside", 0.0)))
    law = Guess(LAW, "limit", "limit", (limit,), (number("c.a", 0.0, -9.0, 9.0), number("c.l", 1.0, 0.0, 9.0)))
    values = {"c.a": -0.2, "c.l": 2.0}
    before = looks.trial(law).errors(values)
    made, start = looks.as_curve(law, values, SimpleNamespace(jacobian=np.zeros((len(looks.base.misfit), 2))))
    assert made.label.startswith("fine curve") and made.inserts[0].points == 17 and not {"c.a", "c.l"} & set(start)
    after = looks.trial(made).errors(start)
    left = max(abs(after[name][0] - before[name][0]).max() for name in before)
    assert left < 0.02 * max(np.std(before[name][0]) for name in before)


def test_what_a_tank_takes_away_may_go_on_where_its_level_is_asked_for_by_what_comes_out(problem, monkeypatch):
    """An overflow was a cubic of the lower level: what comes out went along with the level by 0.995, and for no law there was one of it."""
    series = problem.played.series([{}], [0])
    series["lower.inflow"] = series["upper.flow"] = [0.1 * series[LEVEL][0]]
    looks = Looks.__new__(Looks)
    looks.problem, looks.values, looks.inserts, looks.kinds = problem, {}, (), (LAW,)
    looks.base = SimpleNamespace(misfit=problem.misfit(np.zeros(0)))
    looks.scene = Scene(problem.played.parts, problem.played, series, "c")
    upper, lower = (Place(IN, f"{name}.inflow") for name in ("upper", "lower"))
    assert LEVEL not in [over for over, _ in looks.scene.variables(lower)]
    looks.responses = Responses(problem, {}, (), {p: looks._overs(p) for p in (upper, lower)}, {upper: 1.0, lower: 1.0})
    table, knots = curve(looks.scene, upper, LEVEL, 0, False)
    looks.tables = [(table, knots, looks._hats(table))]
    ((other, columns),) = looks._elsewhere(table)
    assert (other.place, other.over, other.points) == (lower, LEVEL, len(knots))
    assert columns.any() and columns.shape == looks.tables[0][2].shape
