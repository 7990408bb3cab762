"""The commands as a user types them: a mistake is one sentence on stderr and exit code 2, never a traceback."""

import logging
import os
import signal
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import selflock
from selflock import cli
from selflock.diagnosis import DataError
from selflock.fmus import blas
from selflock.master import read
from selflock.master.running import Running
from selflock.verbose import listen

BENCH = str(Path(__file__).parents[2] / "examples" / "bench.toml")


@pytest.fixture
def typed(monkeypatch, capsys):
    """What a command line answers: exit code, stdout, stderr."""

    def type_(*words) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["selflock", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            cli.carry_out()
        said = capsys.readouterr()
        return end.value.code or 0, said.out, said.err

    return type_


@pytest.mark.parametrize("setting, words", [
    ("gear.friction_kinetic=-1", "at least 0"),
    ("gear.friction_kinetic=nan", "finite"),
    ("gear.friction_kinetic=60", "mu tan(alpha)"),
    ("gear.gear_ratio=0", "at least"),
    ("gear.shaft_inertia=-1", "at least 0"),
    ("motor.voltage=inf", "finite"),
    ("motor.voltage=1e300", "not finite"),
    ("gear.gear_ratio=fifty", "is not a number"),
    ("gear.kinematic=maybe", "true or false"),
    ("gear.output_torque=1", "an output is computed"),
    ("gear.gear_rato=50", "gear_ratio"),
    ("geer.gear_ratio=50", "there is no component geer"),
    ("gear_ratio", "component.variable=value"),
])  # fmt: skip
def test_a_bad_value_is_told_in_one_message(typed, tmp_path, setting, words):
    code, _, told = typed("run", BENCH, "--stop", "0.01", "--set", setting, "-o", tmp_path / "x.csv")
    assert code == 2 and told.count("error:") == 1 and words in " ".join(told.split()) and "Traceback" not in told


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_what_was_set_is_what_runs(typed, tmp_path, ending):
    path = tmp_path / f"x.{ending}"
    code, told, _ = typed("run", BENCH, "--stop", "0.01", "--set", "motor.voltage=0", "-o", path)
    table, units = read(path)
    assert code == 0 and "0.01 s in 10 steps" in " ".join(told.split())
    assert len(table) == 11 and table["motor.torque"].iloc[0] == 0.0 and units["gear.output_torque"] == "N.m"


@pytest.mark.slow
def test_a_run_names_the_command_that_shows_it_and_a_page_is_written(typed, tmp_path):
    code, told, _ = typed("run", BENCH, "--stop", "0.005", "-o", tmp_path / "x.csv")
    assert code == 0 and f"selflock view {tmp_path / 'x.csv'} --system {BENCH}" in "".join(told.split("\n"))
    code, told, _ = typed("view", tmp_path / "x.csv", "--system", BENCH, "-o", tmp_path / "p.html")
    assert code == 0 and "Open" in told and "gear locks itself" in (tmp_path / "p.html").read_text("utf-8")
    code, told, _ = typed("run", BENCH, "--stop", "0.005", "-o", tmp_path / "x.csv", "--view", tmp_path / "q.html")
    assert code == 0 and "weight" in (tmp_path / "q.html").read_text("utf-8")
    code, _, told = typed("run", BENCH, "-o", tmp_path / "no.csv", "--view", "q.pdf")
    assert code == 2 and "the page is an .html file" in told and not (tmp_path / "no.csv").exists()


def test_a_rig_begins_with_a_log_and_is_not_overwritten(typed, tmp_path):
    rows = "\n".join(f"{0.01 * k:.2f};{k % 7};{(k * k) % 11}" for k in range(60))
    (tmp_path / "log.csv").write_text("Time [s];motor speed [rpm];motor torque [mNm]\n" + rows.replace(".", ","))
    code, told, _ = typed("rig", "init", tmp_path / "log.csv", "-o", tmp_path / "rig.toml")
    assert code == 0 and "reducer.input_speed [rpm]" in told and (tmp_path / "rig.toml").exists()
    code, _, told = typed("rig", "init", tmp_path / "log.csv", "-o", tmp_path / "rig.toml")
    assert code == 2 and "is not overwritten" in " ".join(told.split()) and "Traceback" not in told


def test_one_fmu_runs_by_itself(typed, tmp_path, monkeypatch):
    from selflock.fmus.build import built

    monkeypatch.chdir(tmp_path)
    fmu = built("Motor")
    (tmp_path / "u.csv").write_text("time,voltage\n0,12\n")
    code, told, _ = typed("run", fmu, "--stop", "0.01", "--set", "resistance=2", "--set", "speed=0", "--input", "u.csv")
    table, _ = read(tmp_path / "Motor_result.csv")
    assert code == 0 and "Motor_result.csv" in told and table["time"].iloc[-1] == 0.01
    assert table["Motor.current"].iloc[-1] == pytest.approx(6.0, rel=1e-6)
    code, _, told = typed("run", fmu, "--set", "resistanse=2")
    assert code == 2 and "Did you mean resistance?" in told


def test_step_and_algorithm_can_be_chosen(typed, tmp_path):
    chosen = "--stop", "0.01", "--step", "0.0005", "--algorithm", "jacobi"
    code, told, _ = typed("run", BENCH, *chosen, "-o", tmp_path / "x.csv")
    assert code == 0 and "in 20 steps" in " ".join(told.split())


@pytest.mark.parametrize("words", [
    ("run", "nofile.toml", "-o", "x.csv"),
    ("run", BENCH, "-o", "x.txt"),
    ("run", BENCH, "--stop", "0", "-o", "x.csv"),
    ("run", BENCH, "--step", "0", "-o", "x.csv"),
    ("run", BENCH, "--algorithm", "leapfrog", "-o", "x.csv"),
    ("replay", "norig.toml", "nolog.csv", "-o", "replay"),
])  # fmt: skip
def test_wrong_files_are_told(typed, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    code, _, told = typed(*words)
    assert code == 2 and told.count("error:") == 1 and "Traceback" not in told
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["replay", "diagnose", "calibrate", "name"])
def test_nothing_is_left_of_work_that_is_refused(typed, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(
        '[rig]\nkind = "inverse"\n[columns]\n"motor.torque" = "m"\n[parameters]\n"reducer.gear_ratio" = 60\n'
    )
    (tmp_path / "log.csv").write_text("time,m\n" + "".join(f"{0.01 * k},{k % 7}\n" for k in range(100)))
    before = sorted(tmp_path.rglob("*"))
    code, _, told = typed(command, "rig.toml", "log.csv", "-o", "out/here")
    assert code == 2 and told.count("error:") == 1 and "Traceback" not in told
    assert sorted(tmp_path.rglob("*")) == before
    if command != "replay":
        code, _, told = typed(command, "rig.toml", "log.csv", "-o", "out/here", "--max-time", "0")
        assert code == 2 and told.count("error:") == 1 and sorted(tmp_path.rglob("*")) == before


@pytest.mark.alike
@pytest.mark.parametrize("command", [("run", BENCH), ("build", "Sensor"), ("study",), ("export", BENCH)])
def test_a_place_that_cannot_be_written_is_told(typed, tmp_path, command):
    (tmp_path / "file").write_text("")
    code, _, told = typed(*command, "-o", tmp_path / "file" / "x.csv")
    assert code == 2 and told.count("error:") == 1 and "Traceback" not in told
    assert "file" in told


def test_a_missing_extra_is_told_in_one_message(typed, tmp_path, monkeypatch):
    monkeypatch.setattr(selflock, "diagnosis", selflock.diagnosis)  # what is loaded a second time here is forgotten
    for name in [name for name in sys.modules if name.startswith("selflock.diagnosis") or name.partition(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "scipy", None)
    code, _, told = typed("diagnose", "rig.toml", "log.csv", "-o", tmp_path)
    assert code == 2 and told.count("error:") == 1 and "pip install 'selflock[diagnosis]'" in told and "Traceback" not in told


def test_the_version_is_the_package_s(typed):
    assert typed("--version") == (0, f"selflock {version('selflock')}\n", "")


@pytest.fixture
def unheard():
    """The library's log as it was, after a test in which somebody listened."""
    log = logging.getLogger("selflock")
    before = log.handlers[:], log.level, log.propagate
    yield log
    log.handlers[:], log.propagate = before[0], before[2]
    log.setLevel(before[1])


@pytest.mark.parametrize("words", [("-v", "run", BENCH), ("run", BENCH, "-v"), ("run", BENCH, "-vv")])
def test_v_tells_what_is_done(typed, tmp_path, unheard, words):
    code, told, heard = typed(*words, "--stop", "0.002", "-o", tmp_path / "x.csv")
    assert code == 0 and "in 2 steps" in " ".join(told.split())
    assert heard.count("INFO selflock.master.running: bench: 3 components, 5 connections") == 1
    assert ("DEBUG selflock.master.running: motor.torque -> gear.motor_torque" in heard) == (words[-1] == "-vv")
    assert "INFO selflock.master.simulation: bench: 2 steps to 0.002 s" in heard


def test_what_is_told_moves_no_cursor(capsys, unheard):
    listen(1)
    listen(1)
    logging.getLogger("selflock.master").info("a name %s", "\x1b[2Jx\r")
    assert capsys.readouterr().err.count("a name \\x1b[2Jx\\r") == 1
    listen(0)
    logging.getLogger("selflock").warning("%s is torn", "\x1b]0;title\x07")  # said to those, too, who did not ask
    assert capsys.readouterr().err == "\\x1b]0;title\\x07 is torn\n"


@pytest.mark.parametrize("error", [DataError("x.csv: is it cut off?"), ValueError("of a reader in C")])
def test_an_error_that_a_reader_made_of_ctrl_c_is_the_user_s(typed, monkeypatch, error):
    def app():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise error from None

    monkeypatch.setattr(cli, "app", app)
    assert typed() == (130, "", f"Stopped; what was under way ended with: {error}\n")


def test_ctrl_c_leaves_rows_and_their_summary(typed, tmp_path, monkeypatch):
    def pressed(self, time, record=True, of=Running.arrive):
        of(self, time, record)
        if time > 0.0095:
            raise KeyboardInterrupt

    monkeypatch.setattr(Running, "arrive", pressed)
    code, told, _ = typed("run", BENCH, "-o", tmp_path / "x.csv")
    assert code == 130 and "interrupted at t = 0.01 s" in " ".join(told.split())
    assert len(read(tmp_path / "x.csv")[0]) == 11


@pytest.mark.slow
def test_a_help_lists_commands_by_what_they_are_for_and_loads_nothing_that_draws(typed):
    code, out, _ = typed("--help")
    assert not code and [line for line in out.splitlines() if line.endswith(":") and line[0] != " "] == [
        "Options:", *(f"{panel}:" for panel in cli.GROUPS)
    ]  # fmt: skip
    ask = "import sys, selflock.cli as c\ntry: c.app(['--help'])\nexcept SystemExit: pass\nprint(sorted(sys.modules), file=sys.stderr)"
    loaded = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True).stderr
    assert "'typer.core'" in loaded and not any(
        f"'{name}'" in loaded for name in ("markdown_it", "pygments", "pydantic", "numpy")
    )


FEW = ("scipy.signal", "scipy.stats", "dask", "pint", "matplotlib")


@pytest.mark.slow
@pytest.mark.parametrize("room, more", [("pipeline.replay", ("fmpy", "lxml")), ("answered", ())], ids=["replay", "diagnose"])
def test_what_replays_and_diagnoses_loads_no_library_that_few_need(room, more):
    ask = f"import sys, selflock.diagnosis.calls, selflock.diagnosis.{room}; print(sorted(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True).stdout
    assert "'numba'" in loaded and [name for name in (*FEW, *more) if f"'{name}'" in loaded] == []


@pytest.mark.parametrize("said, threads", [(None, 1), ("2", 2)])
def test_blas_has_one_thread_in_a_command_unless_its_user_says_otherwise(said, threads):
    ask = (
        "import sys; sys.argv = ['selflock', '--help']\n"
        "from selflock import cli\n"
        "assert 'numpy' not in sys.modules\n"
        "try: cli.main()\n"
        "except SystemExit: pass\n"
        "import numpy\nfrom threadpoolctl import threadpool_info\n"
        "print({one['num_threads'] for one in threadpool_info() if one['user_api'] == 'blas'}, file=sys.stderr)"
    )
    env = {name: value for name, value in os.environ.items() if name not in blas.THREADS}
    env |= dict.fromkeys(blas.THREADS, said) if said else {}
    told = subprocess.run([sys.executable, "-c", ask], env=env, capture_output=True, text=True, check=True).stderr
    assert told.strip() == f"{{{min(threads, os.cpu_count() or 1)}}}"


def test_the_commands_of_a_group_are_told_whole(typed):
    _, told, _ = typed("rig", "--help")
    assert "init" in told and "..." not in told.partition("Commands:")[2]


@pytest.mark.parametrize("volts, code", [("1e305, 2e305", 2), ("12.0, 1e305", 0)])
def test_a_sweep_without_a_run_that_went_well_says_so_by_its_exit_code(typed, tmp_path, volts, code):
    """A script went on with figures that there were none of."""
    (tmp_path / "s.toml").write_text(
        '[run]\nstop = 0.01\n[components.m]\nfmu = "selflock:Motor"\nstart = { voltage = 1.0, speed = 0.0, resistance = 1e-5 }\n'
    )
    (tmp_path / "w.toml").write_text(
        f'system = "s.toml"\n[vary.u]\nset = "m.voltage"\nvalues = [{volts}]\n[record]\ni = {{ final = "m.current" }}\n'
    )
    answered, told, _ = typed("sweep", tmp_path / "w.toml", "-o", tmp_path / "out", "--workers", 0)
    assert answered == code and "failed" in told and (tmp_path / "out" / "runs.parquet").is_file()
