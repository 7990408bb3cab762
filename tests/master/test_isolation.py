"""Strangers' FMUs in a process with limits and without rights: one message each, the master alive, nothing left behind."""

import json
import logging
import socket
import sys

import psutil
import pytest

from selflock import master
from selflock.master import binary, isolation
from selflock.master.line import Garbled, description, understood

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="native FMUs of the tests are for Linux")
NAME = "stranger"  # of the component, by which its processes are known


@pytest.fixture
def hostile(system, native, monkeypatch):
    """hostile(deed, text): the table of a run in which an isolated FMU does that; nothing may be left of it."""
    monkeypatch.setitem(isolation.LIMITS, "AS", 1500 << 20)
    before = processes()

    def run(deed, text="", **more):
        made = system({NAME: (native("hostile"), {"deed": deed, "text": text}, more)}, stop=1.0, step=0.1)
        made.run.open_inputs = True
        try:
            return master.run(made, isolate=True)
        finally:
            assert processes() <= before
            assert not list(binary.root().glob("part_*"))

    return run


def processes() -> set[str]:
    """The isolated processes that this one has."""
    return {str(child.pid) for child in psutil.Process().children() if _isolated(child)}


def _isolated(child) -> bool:
    try:
        return any("isolation.py" in word for word in child.cmdline())
    except psutil.Error:
        return False


@pytest.mark.slow
@pytest.mark.parametrize(
    ("deed", "said"),
    [
        ("exit", "code 3"),
        ("crash", "SIGSEGV"),
        ("hang", "nothing within 1 s"),
        ("memory", "SIGSEGV"),
        ("garbage", "4294967295 bytes"),
        ("failure", "no answer|more than was asked"),
        ("pickle", "where at most 16 are read|bytes where 8 are due"),
    ],
)
def test_one_message_and_the_results_until_then(hostile, tmp_path, deed, said):
    with pytest.raises(master.PartFailed, match=said) as caught:
        hostile(deed, f"touch {tmp_path}/run", step_timeout=1.0 if deed == "hang" else 0.0)
    assert caught.value.result.table[f"{NAME}.y"].to_list() == [0, 1, 2, 3, 4, 5]
    assert f"{NAME} answered" in str(caught.value) and not (tmp_path / "run").exists()


@pytest.mark.slow
def test_processor_time_is_bounded(hostile, monkeypatch):
    monkeypatch.setitem(isolation.LIMITS, "CPU", 3)
    with pytest.raises(master.PartFailed, match=r"SIGKILL|SIGXCPU"):
        hostile("hang", step_timeout=60.0)


@pytest.mark.slow
def test_what_it_started_ends_with_it_where_the_kernel_lets_us(hostile):
    if isolation.SPACES in hostile("").lacks.get(NAME, []):
        pytest.skip("no namespaces here, which was said: a process that leaves its group outlives the FMU")
    hostile("fork")


@pytest.mark.slow
def test_large_files_and_closed_folders_leave_nothing(hostile, tmp_path):
    assert hostile("large").table[f"{NAME}.y"].min() == 0
    tmp_path.chmod(0o755)
    hostile("close", str(tmp_path))
    assert tmp_path.stat().st_mode & 0o777 == 0o755  # links are not followed when its folder is cleared


@pytest.mark.slow
def test_neither_network_nor_files_where_the_kernel_lets_us(hostile, tmp_path, caplog):
    lacking = hostile("").lacks.get(NAME, [])
    with socket.create_server(("127.0.0.1", 0)) as server:
        reached = hostile("network", str(server.getsockname()[1])).table[f"{NAME}.y"].min() < 0
    written = hostile("write", str(tmp_path / "mine")).table[f"{NAME}.y"].min() < 0
    assert reached == (isolation.SPACES in lacking)
    assert written == (tmp_path / "mine").exists() == (isolation.DISK in lacking)
    for lack in lacking:
        assert lack in caplog.text
    if lacking:
        pytest.skip(f"the kernel does not let us take away {lacking}; that was said")


@pytest.mark.slow
def test_what_could_not_be_taken_away_is_said(hostile, monkeypatch, caplog):
    monkeypatch.setitem(isolation.LIMITS, "NONE_SUCH", 1)
    with caplog.at_level(logging.WARNING):
        result = hostile("")
    assert "RLIMIT_NONE_SUCH" in result.summary() and caplog.text.count("RLIMIT_NONE_SUCH") == 1


@pytest.mark.slow
def test_the_same_bits_isolated(system, counter):
    made = system({"a": (counter, {"u": 0.3})}, stop=1.0, step=0.1)
    inside = master.run(made).table
    made.components["a"].isolate = True
    assert master.run(made).table.equals(inside)


def test_only_fmus_are_isolated(system, refused):
    refused(lambda: master.run(system({"g": ("Gain", {}, {"isolate": True})})), "[components.g]", "for FMUs")


@pytest.mark.parametrize(
    "told",
    [
        "",
        "[]",
        "1",
        "null",
        "{}",
        '{"log": 1}',
        '{"log": [1]}',
        '{"log": [], "error": 1}',
        '{"log": [], "error": {}}',
        '{"log": [], "error": {"failed": [1]}}',
        '{"log": [], "error": {"failed": [1, 2, 3, 4, 5, 6]}}',
        "[" * 100_000,
        "\x80",
        '{"log": [], "error": {"failed": [1' + "0" * 400 + ', 2, "", {}, [], ""]}}',
    ],
)
def test_answers_that_are_none(told):
    with pytest.raises(Garbled):
        understood(told.encode("latin-1"), "x")


@pytest.mark.parametrize(
    "change", [{"type": "os"}, {"causality": 1}, {"more": 1}, {"depends_on": 3}, {"minimum": "x"}, {"name": None}]
)
def test_descriptions_that_are_none(change):
    variable = {"name": "a", "type": "Real", "causality": "input", **change}
    with pytest.raises(Garbled):
        description(json.loads(json.dumps({"variables": [variable], "units": {}, "can_roll_back": 1, "variable_step": 1})))
