"""Numbers arrive where they should, or a sentence says that they do not: parameters, integers, tolerances, ends."""

import logging
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from selflock import master
from selflock.master import ssp

FOREIGN = Path(__file__).parents[2].parent / "shared" / "foreign"
foreign = pytest.mark.skipif(not FOREIGN.exists(), reason="the models of others are not in ../shared/foreign")

GIVEN = {"gain": 3.0, "count": 7, "flag": True, "word": "held", "offset": 2.0}


def alone(system, path, start=(), more=(), **run):
    return system({"f": (path, dict(start), dict(more))}, open_inputs=True, **{"stop": 1.0, "step": 0.1, **run})


# --- parameters -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("process", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_what_is_set_stays_though_the_fmu_takes_its_defaults_back(system, native, process):
    seen = {}

    def observe(time, parts):
        seen.update({name: parts["f"].get(name) for name in GIVEN})

    result = master.run(alone(system, native("forgetful"), GIVEN, {"process": process}), observe=observe)
    assert seen == GIVEN and result.notes == []
    assert result.table["f.y"].to_numpy() == pytest.approx(3.0 * result.table["time"].to_numpy() + 2.0)
    assert (result.table["f.at_entry"] == 3.0).all()  # it had it already when it entered initialization


@pytest.mark.parametrize("process", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_parameter_that_is_not_taken_is_named(system, native, caplog, process):
    caplog.set_level(logging.WARNING, "selflock")
    given = {"limit": 5.0 + process, "gain": 0.1, "secret": 2.0 + process}  # its gain is a float, not a double
    result = master.run(alone(system, native("forgetful"), given, {"process": process}))
    limit, secret = sorted(result.notes)
    assert limit == f"f.limit = {given['limit']} was not taken: the FMU has 1.0"
    assert secret.startswith(f"f.secret = {given['secret']} cannot be read back")
    assert limit in caplog.messages and limit in result.summary()
    assert len(result.table) == 11  # and it runs


def test_kept_parts_begin_anew(system, native):
    parts = {}
    try:
        first = master.run(alone(system, native("forgetful")), settings={"f.gain": 2.0, "f.limit": 4.0}, keep=parts)
        second = master.run(alone(system, native("forgetful")), keep=parts)
    finally:
        for part in parts.values():
            part.close()
    assert first.table["f.y"].iloc[-1] == pytest.approx(2.0) and len(first.notes) == 1
    assert second.table["f.y"].iloc[-1] == pytest.approx(1.0) and second.notes == []


@pytest.mark.slow
def test_a_sweep_over_what_is_not_taken_is_refused(native, tmp_path):
    from selflock.sweep import SweepError, sweep

    (tmp_path / "system.toml").write_text(f'[run]\nopen_inputs = true\n[components.f]\nfmu = "{native("forgetful")}"\n')
    for name, refused in (("gain", False), ("limit", True)):
        study = tmp_path / f"{name}.toml"
        study.write_text(
            f'system = "system.toml"\n[vary.x]\nset = "f.{name}"\nvalues = [0.5, 2.0]\n[record]\ny = {{ final = "f.y" }}\n'
        )
        if refused:
            with pytest.raises(SweepError, match="f.limit = 2.0 was not taken: the FMU has 1.0"):
                sweep(study, tmp_path / name, workers=0)
        else:
            assert list(sweep(study, tmp_path / name, workers=0).table["y"]) == pytest.approx([0.5, 2.0])


def test_parameters_of_a_system_structure_stay(system, native, tmp_path):
    ssp.export(alone(system, native("forgetful"), GIVEN), tmp_path / "f.ssp")
    result = master.run(tmp_path / "f.ssp", settings={"f.limit": 0.5})
    assert result.table["f.y"].iloc[-1] == pytest.approx(3.0 + 2.0) and result.notes == []


@pytest.mark.parametrize("kind, word", [(b"Integer", "f.ssv"), (b"Real", "32 bits")])  # the schema, and we
def test_a_value_beyond_32_bits_in_a_system_structure_is_refused(system, native, tmp_path, refused, kind, word):
    ssp.export(alone(system, native("forgetful"), {"count": 1234567}), tmp_path / "f.ssp")
    with zipfile.ZipFile(tmp_path / "f.ssp") as old, zipfile.ZipFile(tmp_path / "g.ssp", "w") as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, text.replace(b'Integer value="1234567"', kind + b' value="99999999999"'))
    refused(lambda: master.run(tmp_path / "g.ssp"), "99999999999", word)


@foreign
@pytest.mark.slow
@pytest.mark.parametrize("name", ["FMI4cpp__ControlledTemperature", "FMI4cpp__TorsionBar", "FMI4j__Threetank"])
def test_20_sim_keeps_what_is_set(system, name):
    path = str(FOREIGN / "fmus" / f"{name}.fmu")
    plain = alone(system, path, stop=0.02, step=0.001)
    parts = {}
    master.run(plain, keep=parts)
    described = parts["f"].variables.values()
    given = {v.name: 1.01 * v.start for v in described if v.causality == "parameter" and v.type == "Real" and v.start}
    result = master.run(plain, settings={f"f.{n}": value for n, value in given.items()}, keep=parts)
    has = {n: parts["f"].get(n) for n in given}
    parts["f"].close()
    assert has == given and len(given) > 10 and result.notes == []


# --- integers ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [99999999999, -(2**31) - 1, "2147483648", 10**400])
def test_an_integer_beyond_32_bits_is_refused(system, native, refused, value):
    plain = alone(system, native("forgetful"))
    refused(lambda: master.run(plain, settings={"f.count": value}), "f.count", "32 bits")
    refused(lambda: master.run(alone(system, native("forgetful"), {"count_in": value})), "f.count_in", "32 bits")


def test_the_largest_integers_fit(system, native):
    for value in (2**31 - 1, -(2**31)):
        got = []
        plain = alone(system, native("forgetful"), stop=0.1)
        master.run(plain, settings={"f.count": value}, observe=lambda t, parts: got.append(parts["f"].get("count")))
        assert got == [value, value]


@pytest.mark.parametrize("stop", [2.0, 200.0])  # by Python, and by the compiled loop
def test_an_integer_that_grows_beyond_32_bits_on_its_way_is_refused(system, native, stop):
    if stop > 2.0:
        pytest.importorskip("numba")
    parts = {"a": native("forgetful"), "b": native("forgetful"), "t": native("ball")}
    described = system(
        parts, {"b.count_in": {"from": "t.bounces", "factor": 2.0**30}}, stop=stop, step=0.05, open_inputs=True, record=["b.y"]
    )
    with pytest.raises(master.PartFailed, match=r"(?s)b answered .* 32 bits .*count_in = 2.14748e\+09"):
        master.run(described)


# --- tolerances -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "of_run, own, asked, told",
    [
        (None, None, None, 1e-5),  # of its default experiment
        (1e-3, None, None, 1e-3),
        (1e-3, 1e-7, None, 1e-7),
        (1e-3, None, 1e-6, 1e-6),
        (1e-3, 1e-7, 1e-6, 1e-7),
        (0.0, None, None, -1.0),  # none
        (1e-3, 0.0, None, -1.0),
    ],
)
def test_who_says_the_tolerance(system, native, of_run, own, asked, told):
    run = {} if of_run is None else {"fmu_tolerance": of_run}
    described = alone(system, native("forgetful"), (), {} if own is None else {"tolerance": own}, **run)
    assert (master.run(described, tolerance=asked).table["f.tolerance"] == told).all()


@pytest.mark.slow
def test_the_tolerance_reaches_another_process_and_goes_through_a_system_structure(system, native, tmp_path):
    described = alone(system, native("forgetful"), (), {"process": True, "tolerance": 1e-7}, fmu_tolerance=1e-3)
    ssp.export(described, tmp_path / "f.ssp")
    again = ssp.load(tmp_path / "f.ssp")
    assert again.run.fmu_tolerance == 1e-3 and again.components["f"].tolerance == 1e-7
    assert (master.run(again).table["f.tolerance"] == 1e-7).all()


def test_a_tolerance_that_is_none_is_refused(system, native, refused):
    refused(lambda: master.run(alone(system, native("forgetful"), fmu_tolerance=-1.0)), "fmu_tolerance", "relative")
    refused(lambda: master.run(alone(system, native("forgetful"), (), {"tolerance": 2.0})), "components.f", "relative")


# --- ends -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "more, step, rows",
    [
        ({}, 0.1, 10),
        ({}, 0.25, 5),
        ({}, 0.0001, 9001),
        ({"step": 0.05}, 0.1, 10),
        pytest.param({"process": True}, 0.25, 5, marks=pytest.mark.slow),
    ],
)
def test_an_fmu_ends_the_run(system, native, more, step, rows):
    result = master.run(alone(system, native("forgetful"), {"ends_at": 0.9}, more, stop=2.0, step=step))
    last = result.table.iloc[-1]
    assert last["time"] == pytest.approx(0.9) and last["f.y"] == pytest.approx(0.9) and len(result.table) == rows
    assert result.time == pytest.approx(0.9) and result.ended == {"f": pytest.approx(0.9)}
    assert "f ended the run itself at t = 0.9 s" in result.summary()


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("stop", [2.0, 400.0])  # by Python, and by the compiled loop
def test_all_come_to_the_point_where_one_ends(system, native, algorithm, stop):
    parts = {"a": native("ball"), "f": (native("forgetful"), {"ends_at": 1.5}), "b": native("forgetful")}
    for ends_at, last in ((1.5, 1.5), (1.43, 1.4)):  # within a step: the others have nothing to show there
        described = system(
            parts, {"b.offset": "f.y"}, stop=stop, step=0.1, open_inputs=True, algorithm=algorithm, interval=0.2 * (last == 1.4)
        )
        result = master.run(described, settings={"f.ends_at": ends_at})
        row = result.table.iloc[-1]
        assert row["time"] == pytest.approx(last) and result.time == pytest.approx(last)
        assert row["f.y"] == pytest.approx(last)
        assert row["b.y"] == pytest.approx(2 * last - 0.1 * (algorithm == "jacobi"))
        assert result.steps == round(last / 0.1) and result.ended == {"f": ends_at}


def test_a_long_step_ends_where_it_ends(system, native):
    parts = {"f": (native("forgetful"), {"ends_at": 1.6}, {"step": 0.4}), "b": native("forgetful")}
    result = master.run(system(parts, {}, stop=4.0, step=0.1, open_inputs=True))
    assert result.table["time"].iloc[-1] == pytest.approx(1.6) and result.table["f.y"].iloc[-1] == pytest.approx(1.6)


@pytest.mark.parametrize("more", [{}, {"step_control": "doubling", "step_min": 0.05}])
def test_a_part_of_ones_own_may_end_the_run(system, more):
    result = master.run(system({"t": "Tired", "i": "Integrator"}, {"i.u": "t.y"}, stop=2.0, step=0.1, **more))
    last = result.table.iloc[-1]
    assert last[["time", "t.y"]].tolist() == pytest.approx([0.5, 0.5]) and result.ended == {"t": pytest.approx(0.5)}


@pytest.mark.slow
def test_a_figure_beyond_the_end_is_no_figure(native, tmp_path):
    from selflock.sweep import sweep

    (tmp_path / "system.toml").write_text(
        f'[run]\nopen_inputs = true\nstep = 0.1\n[components.f]\nfmu = "{native("forgetful")}"\n'
    )
    (tmp_path / "study.toml").write_text(
        'system = "system.toml"\n[vary.x]\nset = "f.ends_at"\nvalues = [0.5, 2.0]\n[record]\ny = { mean = "f.y", to = 0.9 }\n'
    )
    table = sweep(tmp_path / "study.toml", tmp_path / "out", workers=0).table
    assert list(table["status"]) == ["failed", "ok"] and "ended the run itself at t = 0.5 s" in table["reason"][0]


@foreign
@pytest.mark.parametrize("step", [0.2, 0.7])
def test_stair_has_its_last_row(system, step):
    result = master.run(alone(system, str(FOREIGN / "reference" / "Stair.fmu"), stop=14.0, step=step))
    assert result.table.iloc[-1].tolist() == [9.0, 10] and result.ended == {"f": 9.0}


@pytest.mark.slow
def test_the_command_says_the_end_and_is_content(native, tmp_path):
    (tmp_path / "s.toml").write_text(
        f'[run]\nopen_inputs = true\nstep = 0.1\n[components.f]\nfmu = "{native("forgetful")}"\n[components.f.start]\nends_at = 0.5\n'
    )
    command = [sys.executable, "-m", "selflock.cli", "run", "s.toml", "-o", "out.csv", "--tolerance", "1e-4"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and "f ended the run itself at t = 0.5 s" in done.stdout and done.stderr == ""
    table, _ = master.read(tmp_path / "out.csv")
    assert table["time"].iloc[-1] == 0.5 and (table["f.tolerance"] == 1e-4).all()
