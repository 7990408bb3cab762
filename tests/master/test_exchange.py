"""Model exchange: the equations of an FMU integrated here, its events located, as a part like others."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from selflock import master
from selflock.master import ssp

FOREIGN = Path(__file__).parents[2].parent / "shared" / "foreign"
foreign = pytest.mark.skipif(not FOREIGN.exists(), reason="the models of others are not in ../shared/foreign")


def bounced(times, e=0.7, g=9.81, least=1e-3):
    """Height and speed of the ball, and its bounces, in closed form: from impact to impact it is a parabola."""
    rows = []
    for time in times:
        since, height, speed, count = 0.0, 1.0, 0.0, 0
        until = math.sqrt(2.0 / g)
        while time - since > until + 1e-12:
            since, height, speed, count = since + until, 0.0, e * (g * until - speed), count + 1
            if speed < least:
                return np.array([*rows, *[(0.0, 0.0, count)] * (len(times) - len(rows))])
            until = 2.0 * speed / g
        fallen = time - since
        rows.append((height + speed * fallen - 0.5 * g * fallen**2, speed - g * fallen, count))
    return np.array(rows)


@pytest.mark.parametrize("step", [0.05, 0.4, 0.003])
def test_a_ball_bounces_as_in_closed_form(native, step):
    result = master.run(native("drop"), step=step, stop=1.2)
    table = result.table
    exact = bounced(table["time"].to_numpy())
    assert np.abs(table["drop.h"] - exact[:, 0]).max() < 1e-4 and np.abs(table["drop.v"] - exact[:, 1]).max() < 1e-3
    assert (table["drop.bounces"] == exact[:, 2]).all() and exact[-1, 2] == 2


def test_a_tighter_tolerance_is_nearer(native):
    errors = []
    for tolerance in (1e-3, 1e-6, 1e-9):
        table = master.run(native("drop"), stop=1.2, tolerance=tolerance).table
        assert (table["drop.tolerance"] == tolerance).all()  # the FMU is told, too
        errors.append(np.abs(table["drop.h"] - bounced(table["time"])[:, 0]).max())
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2] and errors[2] < 1e-6


def test_time_events_come_at_their_time(native):
    for step in (0.05, 0.1, 0.7):  # at communication points, between them, and several in one step
        table = master.run(native("drop"), step=step, stop=1.4).table
        assert (table["drop.ticks"] == np.floor(table["time"] / 0.25 + 1e-9)).all()


def test_it_comes_to_rest(native):
    last = master.run(native("drop"), stop=2.0, settings={"e": 0.5}, tolerance=1e-10).table.iloc[-1]
    assert last["drop.h"] == 0.0 and last["drop.v"] == 0.0
    assert last["drop.bounces"] == math.ceil(math.log2(math.sqrt(2.0 * 9.81) / 1e-3))  # from then on it is slower than 1e-3


def test_a_step_event_is_taken(native):
    table = master.run(native("drop"), settings={"fast": 2.0}, stop=0.4, step=0.02).table
    first = table["time"][table["drop.was_fast"]].iloc[0]
    assert 2.0 / 9.81 <= first <= 2.0 / 9.81 + 0.02 + 1e-9


def test_what_an_input_changes_is_seen(native, tmp_path):
    """A discrete input is taken in event mode; a continuous one that carries an indicator over zero makes an event."""
    (tmp_path / "u.csv").write_text("time,push,gear_in\n0,0,1\n0.2,0,1\n0.2,0.6,3\n0.3,0.6,3\n0.3,0.2,2\n")
    table = master.run(native("drop"), inputs=tmp_path / "u.csv", step=0.05, stop=0.4).table
    assert table["drop.alarm"].tolist() == [False] * 5 + [True] * 2 + [False] * 2
    assert table["drop.gear"].tolist() == [1] * 5 + [3] * 2 + [2] * 2
    v = [-9.81 * t + 0.6 * min(max(t - 0.2, 0.0), 0.1) + 0.2 * max(t - 0.3, 0.0) for t in table["time"]]
    assert table["drop.v"].to_numpy() == pytest.approx(v, abs=1e-5)


def test_it_may_end_the_run(native):
    result = master.run(native("drop"), settings={"ends_at": 0.33}, step=0.05)
    last = result.table.iloc[-1]
    assert result.ended == {"drop": 0.33} and last["time"] == 0.33
    assert last["drop.h"] == pytest.approx(1.0 - 0.5 * 9.81 * 0.33**2, abs=1e-5)


def test_it_is_coupled_like_others(system, native):
    """Two of them, and a spring between them of co-simulation: as one system of equations."""
    parts = {"a": (native("drop"), {"g": 0.0}), "m": ("Mass", {"mass": 1.0})}
    described = system(parts, {"a.push": "m.v"}, stop=1.0, step=0.01, open_inputs=True)
    described.components["m"].start["force"] = 1.0  # v = t, so that a.v = t²/2
    for algorithm, late in (("jacobi", -0.01), ("gauss-seidel", 0.01)):  # m goes first, then its new speed acts
        described.run.algorithm, described.run.order = algorithm, ["m", "a"]
        table = master.run(described).table
        time = table["time"].to_numpy()
        assert table["a.v"].to_numpy() == pytest.approx(0.5 * time**2 + 0.5 * late * time, abs=1e-6)


def test_it_goes_back(system, native):
    parts = {"a": native("drop"), "b": native("drop")}
    described = system(parts, {}, stop=1.0, step=0.1, step_control="doubling", step_min=0.05, open_inputs=True)
    table = master.run(described).table
    exact = bounced(table["time"])
    assert table["a.h"].to_numpy() == pytest.approx(exact[:, 0], abs=1e-4) and (table["b.bounces"] == exact[:, 2]).all()


def test_kept_parts_begin_anew(system, native):
    parts = {}
    described = system({"a": native("drop")}, {}, stop=0.6, step=0.1, open_inputs=True)
    try:
        first = master.run(described, keep=parts).table
        other = master.run(described, settings={"a.g": 1.0}, keep=parts).table
        again = master.run(described, settings={"a.g": 9.81}, keep=parts).table
    finally:
        for part in parts.values():
            part.close()
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_fmi_1(system, native):
    """No modes there, and no reset: kept, it is made again."""
    described = system({"f": native("fall")}, {}, stop=1.2, step=0.05, open_inputs=True)
    parts = {}
    try:
        master.run(described, settings={"f.g": 4.0}, keep=parts)
        table = master.run(described, keep=parts).table
    finally:
        for part in parts.values():
            part.close()
    exact = bounced(table["time"])
    assert np.abs(table["f.h"] - exact[:, 0]).max() < 1e-4 and (table["f.bounces"] == exact[:, 2]).all()
    assert (table["f.ticks"] == np.floor(table["time"] / 0.25 + 1e-9)).all()
    assert master.run(described, settings={"f.ends_at": 0.33}).ended == {"f": 0.33}


@pytest.mark.slow
def test_events_without_end_are_told(native):
    """It never comes to rest: e = 0.1, and all bounces are over at (1 + 2 e / (1 - e)) of the first fall."""
    with pytest.raises(master.PartFailed, match="events without end") as failed:
        master.run(native("fall"), settings={"e": 0.1}, step=0.1, stop=1.0)
    assert failed.value.time == pytest.approx(math.sqrt(2.0 / 9.81) * (1.0 + 0.2 / 0.9), abs=1e-3)


@pytest.mark.slow
def test_in_a_process_of_its_own(system, native):
    rows = [
        master.run(system({"a": (native("drop"), {"ends_at": 0.7}, {"process": apart})}, {}, step=0.1, open_inputs=True)).table
        for apart in (False, True)
    ]
    assert np.array_equal(*rows)


def test_a_wrong_interface_is_told(system, native, refused):
    refused(lambda: master.run(native("drop"), interface="cs"), "drop.fmu", "not for co-simulation", "model exchange")
    refused(lambda: master.run(native("ball"), interface="me"), "ball.fmu", "not for model exchange", "co-simulation")
    refused(lambda: master.run(native("drop"), interface="mx"), "mx", "choose from")
    described = system({"a": (native("ball"), {}, {"interface": "me"})}, {})
    refused(lambda: master.run(described), "[components.a]", "not for model exchange")
    refused(lambda: master.run(described, interface="cs"), "components.NAME")
    refused(lambda: master.run(system({"m": ("Mass", {}, {"interface": "me"})}, {})), "components.m", "for FMUs")


def test_through_a_system_structure(system, native, tmp_path):
    described = system({"a": (native("drop"), {"e": 0.5}), "m": native("ball")}, {"a.push": "m.height"}, stop=0.5, step=0.05)
    described.run.open_inputs = True
    ssp.export(described, tmp_path / "s.ssp")
    again = ssp.load(tmp_path / "s.ssp")
    assert {name: component.interface for name, component in again.components.items()} == {"a": "me", "m": "cs"}
    assert np.array_equal(master.run(described).table, master.run(again).table)


# --- of others -------------------------------------------------------------------------------------------------------


def van_der_pol(times):
    given = solve_ivp(
        lambda t, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0]], (0, 20), [2, 0], "DOP853", times, rtol=1e-11, atol=1e-11
    )
    return given.y.T


@foreign
@pytest.mark.parametrize("path", ["reference/{}.fmu", "fmus/ecos__{}.fmu"])  # FMI 2.0, FMI 3.0
def test_the_reference_fmus(path):
    def run(name, **more):
        return master.run(FOREIGN / path.format(name), interface="me", **more)

    time, x = run("Dahlquist").table.to_numpy().T
    assert np.abs(x - np.exp(-time)).max() < 1e-5
    table = run("VanDerPol", step=0.1).table.to_numpy()
    assert np.abs(table[:, 1:] - van_der_pol(table[:, 0])).max() < 1e-3
    table = run("BouncingBall").table.to_numpy()
    exact = bounced(table[:, 0], least=0.1)
    assert np.abs(table[:, 1] - exact[:, 0]).max() < 1e-4
    result = run("Stair")
    assert result.ended == {"Stair": 9.0} and result.table.iloc[-1].tolist() == [9.0, 10]
    inside = result.table.iloc[:-1]
    assert (inside["Stair.counter"] == 1 + np.floor(inside["time"] + 1e-9)).all()


@foreign
@pytest.mark.slow
def test_both_interfaces_of_an_openmodelica_fmu_agree():
    path = FOREIGN / "fmus" / "FMI4cpp__FmuExportCrossCompile.fmu"
    one, other = (master.run(path, interface=way, stop=0.3).table["FmuExportCrossCompile.h"] for way in ("cs", "me"))
    assert np.abs(one - other).max() < 2e-3 and one.iloc[-1] < 0.6  # its own solver is Euler's


@foreign
@pytest.mark.slow
def test_a_ball_and_its_bounce_of_dymola():
    """Two FMUs for model exchange that make one bouncing ball: the event of one is a discrete input of the other."""
    fmus = {name: {"fmu": str(FOREIGN / "fmus" / f"FMPy__{name}.fmu")} for name in ("Ball", "Bounce")}
    links = {"Ball.reset": "Bounce.reset", "Bounce.h": "Ball.h"}
    table = master.run(master.from_dict({"run": {"stop": 1.2}, "components": fmus, "connections": links})).table
    impact = math.sqrt(2.0 / 9.81)  # and the next after 0.7 of the speed
    hits = table["time"][table["Bounce.reset"]]
    assert hits.iloc[0] == pytest.approx(impact, abs=1.5e-3) and hits.iloc[1] == pytest.approx(2.4 * impact, abs=3e-3)
    flying = table[table["time"] < impact - 1e-3]
    assert flying["Ball.h"].to_numpy() == pytest.approx(1.0 - 0.5 * 9.81 * flying["time"] ** 2, abs=1e-5)
