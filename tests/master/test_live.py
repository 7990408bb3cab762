"""A session: the master of `run` a step at a time, to the bit; writing, reading, going back, and a person who ends it."""

import signal

import numpy as np
import pandas as pd
import pytest
import small_parts
from test_algorithms import two_masses

from selflock import master


def chain(system, **run):
    """A clock, an integrator and a gain in a ring with a slow and a fast part, and something recorded of each."""
    parts = {
        "clock": "Clock",
        "i": ("Integrator", {}, {"step": 0.025}),
        "slow": ("Integrator", {}, {"step": 0.2}),
        "g": ("Gain", {"gain": -0.7, "shift": 0.3}),
    }
    return system(parts, {"i.u": "g.y", "slow.u": "clock.angle", "g.u": "i.y"}, stop=1.0, step=0.1, **run)


SYSTEMS = {
    "gauss-seidel": lambda system: chain(system),
    "jacobi": lambda system: chain(system, algorithm="jacobi", interval=0.2, start=0.0),
    "doubling": lambda system: brief(two_masses(system, step=0.1, step_control="doubling", tolerance=1e-2)),
    "power": lambda system: brief(two_masses(system, step=0.1, step_control="power", tolerance=0.2)),
    "discarded": lambda system: system(
        {"c": ("Careful", {"u": 1.0, "longest": 0.03})}, stop=1.0, step=0.1, step_control="doubling"
    ),
    "ended": lambda system: system({"t": "Tired"}, stop=1.0, step=0.1),
}


def brief(made):
    made.run.stop = 0.5
    return made


def faulty(system):
    made = chain(system)
    made.faults = [master.Fault("i.y", "noise", 0.2, deviation=0.1, seed=1), master.Fault("g.u", "delay", 0.1, delay=0.2)]
    return made


@pytest.mark.parametrize("name", [*SYSTEMS, "faults"])
def test_stepped_to_its_end_it_is_the_run_to_the_bit(system, name):
    made = SYSTEMS.get(name, faulty)(system)
    whole = master.run(made)
    with master.session(made) as s:
        while not s.ended and s.time < made.run.stop - 1e-9:
            s.step()
    assert s.result.table.equals(whole.table) and s.result.energy.equals(whole.energy) and s.result.peaks.equals(whole.peaks)
    assert (s.result.rejected > 0) == (name == "discarded")
    assert (s.result.steps, s.result.rejected, s.ended, s.result.time) == (whole.steps, whole.rejected, whole.ended, whole.time)


def test_looking_at_every_step_changes_nothing(system):
    made = chain(system)
    with master.session(made) as s:
        seen = [(s.time, s["i.y"], s["clock.angle"], s["g.y"], s["slow.y"])]
        while s.time < 1.0 - 1e-9:
            seen.append((s.step(), s["i.y"], s["clock.angle"], s["g.y"], s["slow.y"]))
            len(s.table)
    assert s.table.equals(master.run(made).table)
    assert np.array_equal(np.array(seen), s.table[["time", "i.y", "clock.angle", "g.y", "slow.y"]].to_numpy())


def test_what_is_written_counts_from_the_next_step_on(system):
    """dy/dt = u: the sum of what was written, by hand."""
    with master.session(system({"i": "Integrator"}, stop=float("inf"), step=0.5, record=["i.*"])) as s:
        s["i.u"] = 1.0
        assert s["i.y"] == 0.0
        s["i.u"] = 2.0  # nothing of the 1.0 is left
        s.step()
        s["i.u"] = -4
        assert (s["i.y"], s["i.u"]) == (1.0, -4.0)
        assert s.step(until=1.9) == 2.0
        assert s["i.y"] == -5.0
    assert s.table["i.u"].tolist() == [2.0, 2.0, -4.0, -4.0, -4.0]


def test_written_stairs_are_those_of_a_table(system, tmp_path):
    made = chain(system, record=["i.y", "g.u"])
    del made.connections["g.u"]
    stairs = [0.1 * k * (-1) ** k for k in range(10)]
    rows = [(t, x) for k, x in enumerate(stairs) for t in (k * 0.1, (k + 1) * 0.1)]  # two of one time are a jump
    pd.DataFrame(rows, columns=["time", "g.u"]).to_csv(tmp_path / "u.csv", index=False)
    with master.session(made, {"g.u": 0.0}) as s:
        for x in stairs:
            s["g.u"] = x
            s.step()
    assert np.array_equal(s.table["i.y"], master.run(made, inputs=tmp_path / "u.csv").table["i.y"])
    assert s.table["i.y"].iloc[-1] == pytest.approx(sum(0.1 * (0.3 - 0.7 * x) for x in [0.0, *stairs[:-1]]))


def test_parameters_and_values_before_the_first_step_are_settings(system):
    made = system({"i": ("Integrator", {"u": 1.0}), "g": ("Gain", {"gain": "= 2 * k"})}, {"g.u": "i.y"}, stop=1.0, step=0.1)
    made.values = {"k": 1.0}
    with master.session(made) as s:
        assert s["k"] == 1.0 and s["g.gain"] == 2.0
        s["k"], s["g.shift"] = 3.0, "0.5"
        assert (s["k"], s["g.gain"], s["g.y"]) == (3.0, 6.0, 0.5)
        s.step(until=1.0)
        with pytest.raises(master.SessionError, match="before the first step"):
            s["k"] = 1.0
    assert s.table.equals(master.run(made, {"k": 3.0, "g.shift": 0.5}).table)


def test_types_are_kept(system):
    with master.session(system({"t": ("Types", {"flag": False, "count": 1, "word": "a"})}, stop=1.0, step=0.5)) as s:
        s.step()
        assert (s["t.flag_out"], s["t.count_out"], s["t.word_out"], s["t.flag"]) == (False, 4, "ab", False)
        assert [type(s[f"t.{name}"]) for name in ("flag_out", "count_out", "word_out")] == [bool, int, str]
        s["t.word"], s["t.count"] = "xyz", 7
        s.step()
        assert (s["t.word_out"], s["t.count"]) == ("xyzb", 7)


def test_a_tunable_parameter_can_be_written_while_it_goes_on(system, monkeypatch):
    tunable = small_parts.real("gain", "parameter", "", 1.0, variability="tunable")
    monkeypatch.setattr(small_parts.Gain, "described", (tunable, *small_parts.Gain.described[1:]))
    with master.session(system({"g": ("Gain", {"u": 2.0})}, stop=1.0, step=0.5)) as s:
        s.step()
        s["g.gain"] = 5.0
        s.step()
        with pytest.raises(master.SessionError, match="g.shift is a parameter"):
            s["g.shift"] = 1.0
    assert s.table["g.y"].tolist() == [2.0, 2.0, 10.0]


# --- going back ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["gauss-seidel", "jacobi", "doubling", "power", "discarded"])
def test_gone_back_it_goes_the_same_way(system, name):
    made = SYSTEMS[name](system)
    whole = master.run(made)
    with master.session(made) as s:
        s.step(until=0.3 * made.run.stop)
        back = s.snapshot()
        s.step(until=0.7 * made.run.stop)
        late = s.snapshot()
        s.step(until=made.run.stop)
        for one in (back, late, back):
            s.restore(one)
            assert s.time == one.time >= s.table["time"].iloc[-1]
            s.step(until=made.run.stop)
            result = s.result
            assert result.table.equals(whole.table) and result.energy.equals(whole.energy)
            assert (result.steps, result.rejected) == (whole.steps, whole.rejected)
            assert np.allclose(result.peaks.drop(columns="unit"), whole.peaks.drop(columns="unit"), rtol=1e-12, atol=1e-15)


def test_the_better_of_two_ways_is_gone(system):
    with master.session(system({"i": "Integrator"}, {}, stop=2.0, step=0.5), {"i.u": 0.0}) as s:
        here = s.snapshot()
        for u in (1.0, -1.0):
            s.restore(here)
            s["i.u"] = u
            s.step(until=2.0)
        assert s.table["i.y"].tolist() == [0.0, -0.5, -1.0, -1.5, -2.0] and s.result.peaks.loc["i.y", "greatest"] == 0.0
        s.restore(here)
        assert s["i.u"] == 0.0 and len(s.table) == 1


def test_what_cannot_go_back_says_so(system, monkeypatch):
    monkeypatch.setattr(small_parts.Gain, "can_roll_back", False)
    with master.session(chain(system)) as s, pytest.raises(master.SessionError, match="g cannot roll back"):
        s.snapshot()
    with master.session(faulty(system)) as s, pytest.raises(master.SessionError, match="cannot roll back"):
        s.snapshot()
    one, other = (master.session(system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=0.5)) for _ in range(2))
    with one, other, pytest.raises(master.SessionError, match="another session"):
        one.restore(other.snapshot())


def test_back_behind_a_step_that_was_discarded(system):
    with master.session(system({"c": ("Careful", {"u": 1.0, "longest": 0.03})}, stop=1.0, step=0.1)) as s:
        here = s.snapshot()
        with pytest.raises(master.PartFailed, match="too long for me"):
            s.step()
        with pytest.raises(master.SessionError, match="c failed"):
            s.step()
        s.restore(here)
        assert s["c.y"] == 0.0
    with master.session(system({"f": ("Fragile", {"u": 1.0})}, stop=1.0, step=0.1)) as s:
        here = s.snapshot()
        with pytest.raises(master.PartFailed, match="the shaft broke"):
            s.step(until=1.0)
        with pytest.raises(master.SessionError, match="no.* to come back to"):
            s.restore(here)
    assert s.table["time"].iloc[-1] == pytest.approx(0.5)


# --- what is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("begun", [False, True])
@pytest.mark.parametrize(
    "name, value, words",
    [
        ("g.u", 1.0, ("g.u is fed by the connection from i.y", 'del system.connections["g.u"]')),
        ("g.y", 1.0, ("g.y", "output", "cannot be set")),
        ("g.w", 1.0, ("g has no variable w",)),
        ("gg.u", 1.0, ("no component gg", "Did you mean g?")),
        ("i.u", "fast", ("i.u = fast is not a number",)),
        ("i.u", float("nan"), ("i.u = nan is not a finite number",)),
    ],
)
def test_what_cannot_be_written(system, begun, name, value, words):
    with master.session(system({"i": ("Integrator", {"u": 1.0}), "g": "Gain"}, {"g.u": "i.y"}, stop=1.0, step=0.1)) as s:
        if begun:
            s.step()
        with pytest.raises((master.SessionError, master.DescriptionError)) as caught:
            s[name] = value
        assert all(word in str(caught.value) for word in words), str(caught.value)
        s.step()  # nothing of it is left
        assert s["i.u"] == 1.0


def test_times_that_are_none(system, refused):
    made = system({"i": "Integrator"}, stop=1.0, step=0.1)
    with master.session(made) as s:
        refused(s.step, "Inputs that nobody gives: i.u")
        s["i.u"] = 1.0
        s.step(until=0.5)
        for until, word in (
            (0.4, "is at 0.5 s"),
            (1.2, "stop=1.2"),
            (float("nan"), "nan"),
            ("1.0", "is no time"),
            (True, "is no time"),
        ):
            with pytest.raises(master.SessionError, match=word):
                s.step(until=until)
        with pytest.raises(master.SessionError, match="3 is no snapshot: give what s.snapshot"):
            s.restore(3)
        assert s.step(until=np.float32(0.5)) == 0.5 and s.step(until=1) == 1.0
        with pytest.raises(master.SessionError, match="the session ended at t = 1 s"):
            s.step()
    for use in (s.step, s.snapshot, lambda: s["i.y"], lambda: s.__setitem__("i.u", 1.0)):
        with pytest.raises(master.SessionError, match="is closed"):
            use()
    assert len(s.table) == 11
    refused(lambda: master.session(made, stop=0.25), "not a whole number")
    refused(lambda: master.session("nowhere.toml"), "no system file")
    refused(lambda: master.session(made, {"i.w": 1.0}), "i has no variable w")


# --- keeping -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["x.csv", "x.parquet"])
def test_a_saved_table_is_the_file_that_a_run_writes(system, tmp_path, name):
    made = chain(system)
    (tmp_path / "run").mkdir()
    master.run(made, out=tmp_path / "run" / name)
    with master.session(made) as s:
        s.step(until=1.0)
        saved = s.save(tmp_path / name)
    assert saved.read_bytes() == (tmp_path / "run" / name).read_bytes()
    whole = master.run(made, out=tmp_path / f"other{name}")
    assert whole.save(whole.path) == whole.path and whole.save(tmp_path / f"again{name}").read_bytes() == saved.read_bytes()


def test_parts_are_closed_whatever_happens(system):
    made = system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=0.5)
    with pytest.raises(ZeroDivisionError), master.session(made) as s:
        part = s._running.wiring.parts["i"]
        s.step(until=1 / 0)
    assert part.closed


# --- a person ------------------------------------------------------------------------------------------------------


class Presses(small_parts.Integrator):
    """Somebody presses Ctrl-C while it is stepped."""

    def step(self, time, size):
        if abs(time - 0.3) < 1e-9:
            signal.raise_signal(signal.SIGINT)
        super().step(time, size)


@pytest.fixture
def pressed(system, monkeypatch):
    monkeypatch.setattr(small_parts, "Presses", Presses, raising=False)
    return system({"i": ("Presses", {"u": 1.0})}, stop=1.0, step=0.1)


def test_ctrl_c_leaves_what_was_computed(pressed, tmp_path):
    with pytest.raises(KeyboardInterrupt, match="was stopped; the results until t = 0.3 s are in the `result`") as stopped:
        master.run(pressed)
    result = stopped.value.result
    assert (
        result.table["i.y"].to_numpy() == pytest.approx([0.0, 0.1, 0.2, 0.3]) and "interrupted at t = 0.3 s" in result.summary()
    )
    with pytest.raises(master.RunInterrupted, match="x.csv"):
        master.run(pressed, out=tmp_path / "x.csv")
    assert len(master.read(tmp_path / "x.csv")[0]) == 4
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_session_goes_on_after_ctrl_c(pressed):
    with master.session(pressed) as s:
        with pytest.raises(KeyboardInterrupt):
            s.step(until=1.0)
        assert s.time == pytest.approx(0.4)
        s.step(until=1.0)
    assert s.table["i.y"].iloc[-1] == pytest.approx(1.0)


def test_ctrl_c_in_an_observer_is_one_too(system):
    def observe(time, parts):
        if time > 0.25:
            raise KeyboardInterrupt

    with pytest.raises(master.RunInterrupted) as stopped:
        master.run(system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=0.1), observe=observe)
    assert len(stopped.value.result.table) == 4
