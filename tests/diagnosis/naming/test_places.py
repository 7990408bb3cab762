"""Corrections put into a system: what goes where, in which order, and which part of a step their variable is of; and what is refused."""

from types import SimpleNamespace

import hidden
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import lfilter

from selflock.diagnosis import DataError, name
from selflock.diagnosis.calibration.fit import End
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.naming.afresh import LATE_OR_BENT, afresh, elsewhere
from selflock.diagnosis.naming.extended import component, taken
from selflock.diagnosis.naming.guesses import EVENT, PATH, Guess, number, paths, points_over
from selflock.diagnosis.naming.places import IN, OUT, READ, Insert, Place, ahead, extended, of_system, quantities
from selflock.diagnosis.naming.rounding import between, stepped
from selflock.diagnosis.naming.scene import Scene, one_to_one, order
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.systems.parts import Parts
from selflock.fmus.correction import law

CHAIN = """
[run]
stop = 1.0
step = 0.1
open_inputs = true

[components.first]
fmu = "relaxation.fmu"

[components.second]
fmu = "relaxation.fmu"

[connections]
"second.u" = { from = "first.x", factor = 2.0, offset = 1.0 }
"""


@pytest.fixture
def parts(tmp_path, native):
    (tmp_path / "relaxation.fmu").write_bytes(native("relaxation").read_bytes())
    (tmp_path / "chain.toml").write_text(CHAIN)
    (tmp_path / "rig.toml").write_text('[rig]\nsystem = "chain.toml"\nnamed = true\n')
    return Parts(load(tmp_path / "rig.toml"))


def test_before_an_input_behind_an_output_and_as_it_is_recorded(parts):
    system = parts.system
    system.run.record = ["first.x", "second.x"]
    inserts = [
        Insert("a", Place(IN, "second.u"), "cubic", over="second.x"),
        Insert("b", Place(OUT, "first.x"), "scale"),
        Insert("c", Place(READ, "second.x"), "constant"),
        Insert("d", Place(READ, "second.x"), "lag"),
    ]
    found, moved = extended(system, parts, inserts, component)
    assert found.order == ["first", "b", "a", "second", "c", "d"]
    sources = {target: (c.source, c.factor, c.offset) for target, c in found.connections.items()}
    assert sources == {
        "second.u": ("a.corrected", 1.0, 0.0),
        "a.signal": ("b.corrected", 2.0, 1.0),  # what the connection did before it does now
        "a.x": ("second.x", 1.0, 0.0),
        "b.signal": ("first.x", 1.0, 0.0),
        "c.signal": ("second.x", 1.0, 0.0),
        "d.signal": ("c.corrected", 1.0, 0.0),
    }
    assert moved == {"first.x": "b.corrected", "second.x": "d.corrected"}
    assert found.run.record == ["b.corrected", "d.corrected"]
    assert "a" not in system.components and system.connections["second.u"].source == "first.x"


def test_all_places_and_the_part_of_a_step_that_a_variable_is_of(parts):
    found = of_system(parts, ["first", "second"], ["first.u"], ["first.x", "second.x"])
    assert set(map(str, found)) == {"first.u", "second.u", "first.x", "second.x", "recorded first.x"}
    before = Place(IN, "second.u")
    assert ahead(parts, before, "second.x", False) == 0.5  # of the step's begin: half a step on
    assert ahead(parts, before, "first.x", False) == -0.5  # of its end
    assert ahead(parts, before, "first.u", False) == 0.0  # the log's, as the FMUs are given it
    assert ahead(parts, Place(OUT, "second.x"), "second.flow", False) == 0.0


def test_what_a_link_gives_is_one_quantity_with_what_it_is_given(parts):
    """Each law was asked twice, over an output and over the input that it feeds, and told as two that nobody can tell apart."""
    names = ["first.u", "first.x", "second.u", "second.x", "column"]
    assert quantities(parts, "first", names) == (["first.u", "first.x"], ["second.x", "column"])
    assert quantities(parts, "second", names) == (["second.u", "second.x"], ["first.u", "column"])


def test_what_of_a_variable_a_law_takes_is_known_beforehand():
    time = np.linspace(0.0, 2.0, 201)
    x = np.sin(3.0 * time)
    assert taken(x, time, law.RATE, x)[1:-1] == pytest.approx(3.0 * np.cos(3.0 * time[1:-1]), abs=1e-2)
    assert taken(x, time, law.INTEGRAL, x) == pytest.approx((1.0 - np.cos(3.0 * time)) / 3.0, abs=1e-2)
    since = taken(x, time, law.SINCE_TURN, x)
    w = np.cos(time)
    assert taken(x, time, law.DIFFERENCE, w) == pytest.approx(x - w) and taken(x, time, law.PRODUCT, w) == pytest.approx(x * w)
    assert taken(x, time, law.ROOTED, -(w**2)) == pytest.approx(-x * abs(w))
    assert since[-1] == pytest.approx(2.0 - np.pi / 2.0, abs=0.03) and since[40] == pytest.approx(0.4, abs=0.011)


@pytest.mark.slow
def test_bad_input_gets_its_sentence(tmp_path, native):
    rig = hidden.rig(tmp_path, native("relaxation"))
    log = tmp_path / "log.csv"
    log.write_text("time,heater,body\n" + "\n".join(f"{0.05 * k:.2f},1.0,{0.001 * k}" for k in range(300)))
    with pytest.raises(DataError, match="no input moves"):
        name(rig, [log], out=None)
    with pytest.raises(DataError, match="magic.*parameter, path, event, law"):
        name(rig, [log], out=None, kinds=("magic",))
    with pytest.raises(DataError, match="starts = 0"):
        name(rig, [log], out=None, starts=0)
    drive = tmp_path / "drive.toml"
    drive.write_text('[rig]\nkind = "forward"\n[columns]\n"motor.current" = "i"\n')
    with pytest.raises(DataError, match="names no system"):
        name(drive, [log], out=None)
    rig.write_text(rig.read_text().replace('inputs = "held"', 'inputs = "bent"'))
    with pytest.raises(DataError, match="'smooth' or 'held'"):
        name(rig, [log], out=None)


def test_differences_of_a_component_begin_with_what_is_alike_in_size():
    """No unit tells temperatures from heats there; the heat through an open window goes with the difference of the first."""
    time = np.linspace(0.0, 10.0, 200)
    heat, outside, inside = 1500.0 * np.sin(3.1 * time), 5.0 + np.sin(time), 20.0 + np.cos(2.3 * time)
    series = {"time": time, "room.heat": heat, "room.outside": outside, "room.inside": inside, "wall.heat": 2.0 * heat**2}
    known = {name: SimpleNamespace(unit="") for name in series if name != "time"}
    parts = SimpleNamespace(variables=known, links={}, owner=lambda name: name.split(".")[0])
    scene = Scene(parts, None, {name: [x] for name, x in series.items()}, "correction")
    found = scene.differences(Place(IN, "room.outside"))
    assert found[0] == ("room.outside", law.DIFFERENCE, "room.inside") or found[0] == (
        "room.inside",
        law.DIFFERENCE,
        "room.outside",
    )
    assert len(found) == 3 and not any("wall.heat" in one for one in found)
    known["room.heat"].unit = "W"
    assert len(scene.differences(Place(IN, "room.outside"))) == 1  # what has another unit is no longer taken from it


def test_dead_zones_are_looked_at_so_closely_that_one_takes_nearly_all_that_any_does(rng):
    """Whatever its width is: a look adds each as it is, and has no amplitude that could make up for a wrong one."""
    s, place = rng.uniform(-3.0, 3.0, 2000), Place(IN, "first.u")
    scene = SimpleNamespace(
        signal=lambda place: s, prefix="c", step=0.1, span=200.0, series={"first.u": [s], "time": [0.1 * np.arange(len(s))]}
    )
    widths = [trial.at["c.w"] for trial in paths(scene, place) if trial.guess.law == "dead zone"]
    taken_off = lambda width: np.clip(s, -width, width)
    for width in np.geomspace(0.06, 1.8, 30):
        left = min(np.sum((taken_off(width) - taken_off(one)) ** 2) for one in widths)
        assert left < 0.06 * np.sum(taken_off(width) ** 2)


def test_steps_of_a_rounded_sensor_far_from_zero_are_read_from_what_it_recorded(rng):
    """A level about 3 with steps of 0.15 has 30 of them: of steps that are off by 2 % none looked like it, and it was `none`."""
    place, level = Place(OUT, "tank.level"), 3.0 + 0.4 * np.cumsum(rng.standard_normal(800)) / np.sqrt(800)
    for step in rng.uniform(0.15, 0.8, 5) * np.std(level):
        told = step * np.floor(level / step + 0.5) + 0.05 * step * rng.standard_normal(len(level))
        scene = SimpleNamespace(
            signal=lambda place: level, prefix="c", step=1.0, span=800.0,
            series={"tank.level": [level], "time": [np.arange(800.0)]},
            played=SimpleNamespace(runs=[SimpleNamespace(signals={"tank.level": told})], rounded={}),
        )  # fmt: skip
        asked = [trial.at["c.q"] for trial in paths(scene, place) if trial.guess.law == "quantisation"]
        assert min(abs(one / step - 1.0) for one in asked) < 0.1 * step / level.max()


def test_of_the_steps_that_are_looked_at_one_takes_most_of_what_a_rounded_command_lacks(rng):
    """A command in stairs is not recorded rounded. Of steps 8 % apart none took anything of one that rounds it to a tenth of its range."""
    s, place = np.repeat(rng.uniform(-1.0, 1.0, 300), 10), Place(IN, "first.u")
    scene = SimpleNamespace(
        signal=lambda place: s, prefix="c", step=0.1, span=300.0, series={"first.u": [s], "time": [0.1 * np.arange(len(s))]}
    )
    asked = np.array([trial.at["c.q"] for trial in paths(scene, place) if trial.guess.law == "quantisation"])
    missing = lambda q: q * np.floor(s / q + 0.5) - s
    for step in rng.uniform(0.15, 0.8, 20) * np.std(s):
        left = min(np.sum((missing(step) - missing(one)) ** 2) for one in asked)
        assert left < 0.5 * np.sum(missing(step) ** 2)


def test_what_is_late_is_looked_at_from_the_numbers_that_the_rig_has(rng):
    """A sensor 1 s late was two laws of first order: slower bodies made up for it, and a fit from there ended at 0.4 s."""
    u, place, rate = np.repeat(rng.uniform(-1.0, 1.0, 50), 10), Place(OUT, "body.x"), number("rate", 1.0, 0.2, 5.0)

    def told(slow, late):
        keep = np.exp(-0.1 * slow)
        x = lfilter([1.0 - keep], [1.0, -keep], u)
        return np.interp(np.arange(500) - 10.0 * late, np.arange(500), x)

    seen = told(1.2, 1.0) + 0.005 * rng.standard_normal(500)
    model = lambda numbers, late: SimpleNamespace(
        free=numbers,
        values=lambda places: {n.name: n.at(p) for n, p in zip(numbers, places)},
        misfit=lambda places: told(numbers[0].at(places[0]), numbers[1].at(places[1]) if late else 0.0) - seen,
    )
    played = SimpleNamespace(extend=lambda inserts: None, runs=[SimpleNamespace(signals={"body.x": seen})], rounded={})
    scene = SimpleNamespace(
        signal=lambda place: told(0.5, 0.0), prefix="c", step=0.1, span=50.0, places=[place], played=played,
        series={"body.x": [seen], "time": [0.1 * np.arange(500)]},
    )  # fmt: skip
    broken = SimpleNamespace(free=(), misfit=lambda places: None)
    trial = lambda guess: model((rate, *guess.numbers), True) if guess.law == "delay" else broken
    looks = SimpleNamespace(problem=model((rate,), False), scene=scene, inserts=(), trial=trial)
    ((guess, start),) = afresh(looks, LATE_OR_BENT)
    numbers = (rate, *guess.numbers)
    begun = [n.place(start[n.name]) for n in numbers]
    found = least_squares(model(numbers, True).misfit, begun, bounds=(0.0, 1.0), diff_step=1e-4).x
    assert guess.law == "delay" and [n.at(x) for n, x in zip(numbers, found)] == pytest.approx([1.2, 1.0], rel=0.05)

    turned = SimpleNamespace(free=(rate,), misfit=lambda places: -told(rate.at(places[0]), 0.0) + told(1.2, 0.0))
    looks = SimpleNamespace(
        problem=SimpleNamespace(
            free=(rate,), values=model((rate,), False).values, misfit=lambda places: told(rate.at(places[0]), 0.0) + told(1.2, 0.0)
        ),
        scene=scene, inserts=(), trial=lambda guess: turned,
    )  # fmt: skip
    # a command of the wrong sign: the base is as slow as it may be, and a sign is fitted from where the rig's numbers are
    ((guess, start),) = afresh(looks, ("sign",))
    assert (guess.law, start) == ("sign", {"rate": 1.0})
    looks.problem, turned.misfit = turned, looks.problem.misfit  # and not where it leaves more than none does
    turned.values = model((rate,), False).values
    assert afresh(looks, ("sign",)) == []


def test_what_is_cut_off_is_looked_at_from_the_numbers_that_the_rig_has(rng):
    """Of two bodies in a row either may be the slow one: cut off for half of its rows the first's sensor made the base turn them round.

    From there no fit of its own name came back; eleven of others, a pair and a second cause were looked for, without an answer after 420 s.
    """
    u, place = np.repeat(rng.uniform(-2.0, 2.0, 50), 10), Place(READ, "first.x")
    rates = tuple(number(name, start, 0.2, 5.0) for name, start in (("first", 1.0), ("second", 0.4)))

    def told(first, second, high):
        x = u
        bodies = []
        for rate in (first, second):
            keep = np.exp(-0.1 * rate)
            bodies.append(x := lfilter([0.0, 1.0 - keep], [1.0, -keep], x))
        return np.concatenate([np.minimum(bodies[0], high), bodies[1]])

    seen = told(0.9, 0.33, -0.14)
    model = lambda numbers: SimpleNamespace(
        free=numbers,
        values=lambda places: {n.name: n.at(p) for n, p in zip(numbers, places)},
        misfit=lambda places: told(*(n.at(p) for n, p in zip(numbers, places)), *([np.inf] if len(numbers) == 2 else [])) - seen,
    )
    base = told(0.33, 0.9, np.inf)[:500]  # turned round
    played = SimpleNamespace(extend=lambda inserts: None, runs=[SimpleNamespace(signals={"first.x": seen[:500]})], rounded={})
    scene = SimpleNamespace(
        signal=lambda place: base, prefix="c", step=0.1, span=50.0, places=[place], played=played,
        series={"first.x": [base], "time": [0.1 * np.arange(500)]},
    )  # fmt: skip
    broken = SimpleNamespace(free=(), misfit=lambda places: None)
    trial = lambda guess: model((*rates, *guess.numbers)) if guess.law == "saturation (high)" else broken
    ((guess, start),) = afresh(SimpleNamespace(problem=model(rates), scene=scene, inserts=(), trial=trial), LATE_OR_BENT)
    numbers = (*rates, *guess.numbers)
    begun = [n.place(start[n.name]) for n in numbers]
    found = least_squares(model(numbers).misfit, begun, bounds=(0.0, 1.0), diff_step=1e-4).x
    assert [n.at(x) for n, x in zip(numbers, found)] == pytest.approx([0.9, 0.33, -0.14], rel=0.01)


def test_points_of_a_curve_lie_where_straight_lines_between_them_leave_little_whatever_the_curve(rng):
    """A ripple that grows with its variable fell between two of nine quantiles: of 66 and 42 % closed that was most of the rest."""
    x = np.clip(rng.normal(0.0, 0.3, 2000), -1.0, 1.0)
    knots, wave = points_over(x), lambda x: np.sin(7.0 * x + rng.uniform(0.0, 6.0))
    assert (knots[0], knots[-1], len(knots)) == (x.min(), x.max(), 17)
    assert 1.0 < np.diff(knots).max() / np.diff(knots).min() < 6.0  # fifth roots: of a hundredth 0.4
    truth = wave(x)
    hats = np.stack([np.interp(x, knots, unit) for unit in np.eye(17)], -1)
    left = truth - hats @ np.linalg.lstsq(hats, truth, rcond=None)[0]
    assert left.var() < 0.01 * truth.var()
    levels = points_over(rng.choice([-1.0, 0.5, 2.0], 500))
    assert (levels[0], levels[-1]) == (-1.0, 2.0) and (np.diff(levels) >= 0.02 * 3.0).all()


def test_what_rises_with_one_variable_alone_is_no_pair(rng):
    """A ripple of a tank's level was a curve over its level times its flow, which is that to the power of 1.5."""
    level = rng.uniform(0.1, 4.0, 300)
    assert one_to_one(order(level), order(level * np.sqrt(level))) and one_to_one(order(level), order(-np.exp(level)))
    assert not one_to_one(order(level), order(level * rng.uniform(0.5, 1.0, 300)))


def test_a_rounding_is_fitted_from_one_step_to_the_next(rng):
    """A command that was rounded to a few steps left a fifth of the loss: a level of it counted otherwise, and no slope leads there."""
    levels = np.where(np.arange(40) % 5, rng.uniform(-2.0, 2.0, 40), rng.choice([-1.0, 1.0], 40) * 6.495 * 0.3)
    u = np.repeat(levels, 12)
    rate, step = number("rate", 1.0, 0.2, 5.0), number("c.q", 0.0, 0.0, 3.0)

    def told(rate, q):
        keep = np.exp(-0.1 * rate)
        return lfilter([1.0 - keep], [1.0, -keep], np.round(u / q) * q)

    seen = told(1.2, 0.3) + 0.002 * rng.standard_normal(480)
    problem = SimpleNamespace(
        free=(rate, step),
        misfit=lambda places: told(rate.at(places[0]), max(step.at(places[1]), 0.05)) - seen,
        loss=lambda misfit: float(np.sum(misfit**2)),
    )

    def fitted(places):
        found = least_squares(problem.misfit, places, bounds=(0.0, 1.0), diff_step=1e-4)
        return End(places, found.x, problem.loss(found.fun))

    places = lambda at: np.array([n.place(at[n.name]) for n in problem.free])
    begun, guess, size = {"rate": 1.18, "c.q": 0.2985}, Guess(PATH, "quantisation", "", (), (step,)), float(abs(u).max())
    first = fitted(places(begun))
    assert first.loss > 200.0 * 480 * 0.002**2
    found = stepped(problem, guess, fitted(places(between(problem, guess, begun, size))), size, fitted)
    assert found.loss < 0.02 * first.loss and step.at(found.places[1]) == pytest.approx(0.3, rel=5e-3)
    assert between(problem, guess, begun | {"c.q": 0.0}, 2.0)["c.q"] == 0.0


def test_an_event_is_looked_at_elsewhere_from_the_numbers_that_fit_beside_it(rng):
    """A heat before a house's radiator was named at its thermostat: where it was the look, at the base's numbers, saw nothing of it."""
    u, rate, a = rng.standard_normal(300), number("rate", 1.0, 0.2, 5.0), number("c.a", 0.0, -0.1, 0.1)
    times = number("c.since", 8.0, 0.0, 30.0), number("c.until", 16.0, 0.0, 30.0)
    acts = np.where((np.arange(300) >= 80) & (np.arange(300) < 160), 1.0, 0.0)
    at = {"a": acts, "b": lfilter([0.2], [1.0, -0.8], acts), "c": lfilter([0.05], [1.0, -0.95], acts)}
    seen = 1.2 * u + 0.5 * at["b"] + 0.005 * rng.standard_normal(300)
    place = lambda name: Place(IN, f"body.{name}")

    def model(numbers, name=""):
        values = lambda places: {n.name: n.at(p) for n, p in zip(numbers, places)}
        told = lambda v: v["rate"] * u + (v["c.a"] * at[name] if name else 0.0) - seen
        return SimpleNamespace(free=numbers, values=values, misfit=lambda places: told(values(places)))

    event = Guess(EVENT, "event", "event on body.a", (Insert("c", place("a"), "constant"),), (a, *times))
    best = SimpleNamespace(guess=event, values={"rate": 1.25, "c.a": 0.4, "c.since": 8.0, "c.until": 16.0})
    scene = SimpleNamespace(
        places=[place(name) for name in "abc"], prefix="c", spread=lambda place: 1.0, played=SimpleNamespace(extend=lambda inserts: None)
    )  # fmt: skip
    trial = lambda guess: model((rate, *guess.numbers), guess.place.variable[-1])
    looks = SimpleNamespace(problem=model((rate,)), scene=scene, inserts=(), trial=trial)
    (guess, start), (other, _) = elsewhere(looks, best)
    assert (guess.label, other.label) == ("event on body.b", "event on body.c") and guess.numbers[0].high == RULES.naming.reach**2
    assert [one.label for one, _ in elsewhere(looks, best, {"event on body.b"})] == ["event on body.c"]
    assert start == {"rate": pytest.approx(1.2, abs=0.01), "c.a": pytest.approx(0.5, abs=0.02), "c.since": 8.0, "c.until": 16.0}
