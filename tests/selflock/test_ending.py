"""A command that is ended says what is kept, blames nobody else, and leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time

import pytest

from selflock.master import read

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="native FMUs of the tests are for Linux")]

COMMAND = "import sys; from selflock import cli, ending; ending.GRACE = 0.3; sys.argv[0] = 'selflock'; cli.main()"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "native"))
    from pack import pack

    return pack("hostile", tmp_path_factory.mktemp("hostile"))


@pytest.mark.parametrize(
    "number, whole_group, process",
    [(signal.SIGINT, True, True), (signal.SIGTERM, False, False)],
    ids=["Ctrl-C, a process", "SIGTERM, in this one"],
)
def test_a_stuck_fmu_is_ended_with_its_rows_kept(hostile, tmp_path, number, whole_group, process):
    system = tmp_path / "x.toml"
    system.write_text(
        f'[run]\nstop = 1.0\nstep = 0.1\nopen_inputs = true\n[components.stranger]\nfmu = "{hostile}"\n'
        f'process = {str(process).lower()}\nstart = {{ deed = "hang" }}\n'
    )
    rows, temporary = tmp_path / "rows.csv", tmp_path / "tmp"
    temporary.mkdir()
    running = subprocess.Popen(
        [sys.executable, "-c", COMMAND, "run", str(system), "-o", str(rows)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "TMPDIR": str(temporary)},
    )
    end = time.monotonic() + 120.0
    while time.monotonic() < end and not (rows.exists() and rows.read_text().count("\n") == 7):  # header, t = 0 … 0.5 s
        assert running.poll() is None, running.communicate()
        time.sleep(0.02)
    (os.killpg if whole_group else os.kill)(running.pid, number)
    _, said = running.communicate(timeout=120.0)
    assert running.returncode == 128 + number, said
    told = " ".join(said.split())
    assert "Traceback" not in said and "stranger answered" not in told and str(rows) in said.replace("\n", "")
    assert ("did not come to its end" if not process else "The run was stopped") in told
    assert read(rows)[0]["stranger.y"].to_list() == [0, 1, 2, 3, 4, 5]
    assert not list(temporary.iterdir())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_as_the_process_ends_leaves_nothing_and_no_traceback(tmp_path, number):
    """Python takes a while to end: what was unpacked is gone before, and nobody listens any more."""
    late = f"import atexit, os, time; atexit.register(lambda: (os.kill(os.getpid(), {int(number)}), time.sleep(60)))\n"
    system = tmp_path / "x.toml"
    system.write_text(
        '[run]\nstop = 0.01\nstep = 0.001\n[components.m]\nfmu = "selflock:Motor"\nstart = { voltage = 1.0, speed = 0.0 }\n'
    )
    (tmp_path / "tmp").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", COMMAND.replace("import sys;", late + "import sys;"), "run", system, "-o", tmp_path / "x.csv"],
        capture_output=True,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path / "tmp")},
    )
    assert done.returncode == -number and "Traceback" not in done.stderr and "Exception" not in done.stderr, done.stderr
    assert len(read(tmp_path / "x.csv")[0]) == 11 and not list((tmp_path / "tmp").iterdir())


def test_a_process_that_ends_leaves_no_modules_to_the_collector():
    told = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count(), len(gc.get_objects()), flush=True))\n"
    done = subprocess.run([sys.executable, "-c", told + COMMAND, "--version"], capture_output=True, text=True)
    kept, looked_at = map(int, done.stdout.split()[-2:])
    assert kept > 10_000 and looked_at < 0.1 * kept, done.stderr


def test_a_time_limit_is_told_as_one(tmp_path):
    system = tmp_path / "x.toml"
    system.write_text(
        '[run]\nstop = 1e6\nstep = 0.001\n[components.m]\nfmu = "selflock:Motor"\nstart = { voltage = 1.0, speed = 0.0 }\n'
    )
    words = ["run", system, "-o", tmp_path / "x.csv", "--max-time", "0.5"]
    done = subprocess.run([sys.executable, "-c", COMMAND, *words], capture_output=True, text=True)
    assert done.returncode == 130 and done.stderr.strip().startswith("error: The run took more than its time limit"), done.stderr
