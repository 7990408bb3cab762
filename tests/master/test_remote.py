"""FMUs that `selflock serve` holds: the same bits, and a sentence where something is missing."""

import socket
import threading

import numpy as np
import pytest

from selflock import master
from selflock.master.line import Line
from selflock.master.remote import GREETING, NONCE, SECRET, Server


@pytest.fixture
def served(native, monkeypatch):
    """served(name): the address of a server of that native FMU."""
    monkeypatch.setenv(SECRET, "between us")
    servers = []

    def serve(name, **more):
        servers.append(Server(native(name), **more))
        threading.Thread(target=servers[-1].run, daemon=True).start()
        return servers[-1].address

    yield serve
    for server in servers:
        server.close()


def system(component, **run):
    return master.from_dict({"run": {"stop": 1.0, "step": 0.1} | run, "components": {"a": component}})


START = {"start": {"u": 2.0, "through": 0.5, "x": 1.0}}


@pytest.mark.slow
def test_the_same_bits_as_inside_and_states_over_the_line(native, served):
    doubling = {"step_control": "doubling", "tolerance": 1e-6}
    for run in ({}, doubling):
        near = master.run(system({"fmu": native("lag"), **START}, **run)).table
        far = master.run(system({"host": served("lag"), "fmu": "lag.fmu", **START}, **run)).table
        assert far.equals(near) and len(far) > 5


@pytest.mark.slow
def test_a_loop_of_distant_fmus_is_solved(native, served):
    """y_a = -3 y_b + 1 and y_b = 1.5 y_a at the start; equations are asked at one instant, over the line, too."""
    address = served("lag")
    for interface in ("me", "cs"):
        tables = []
        for place in ({"host": address}, {"fmu": native("lag")}):
            parts = {
                "a": {**place, "interface": interface, "start": {"through": -3.0, "x": 1.0}},
                "b": {**place, "interface": interface, "start": {"through": 1.5}},
            }
            ends = {"a.u": "b.y", "b.u": "a.y"}
            tables.append(
                master.run(master.from_dict({"run": {"stop": 0.2, "step": 0.1}, "components": parts, "connections": ends})).table
            )
        assert tables[0].equals(tables[1]) and tables[0]["a.y"].iloc[0] == pytest.approx(1.0 / 5.5)


@pytest.mark.slow
def test_a_crash_over_there_is_told_here(served):
    made = system({"host": served("hostile"), "start": {"deed": "crash", "text": ""}}, open_inputs=True)
    with pytest.raises(master.PartFailed, match=r"a answered no more, for the line to 127.0.0.1:\d+ ended,") as failure:
        master.run(made)
    assert "selflock serve" in str(failure.value)


def test_nobody_is_asked_without_a_secret_or_with_a_wrong_one(served, refused, monkeypatch):
    address = served("lag")
    monkeypatch.setenv(SECRET, "something else")
    refused(lambda: master.run(system({"host": address, **START})), "a: ", address, "does not take the secret in SELFLOCK_SECRET")
    monkeypatch.delenv(SECRET)
    refused(lambda: master.run(system({"host": address, **START})), "asked only with a secret")


def test_what_is_wrong_with_an_address_is_said(served, refused, monkeypatch):
    monkeypatch.setenv(SECRET, "x")
    for wrong in ("machine", "machine:", ":7000", "machine:70000", "machine:x"):
        refused(lambda: master.run(system({"host": wrong, **START})), "a: host", '"machine:port"')
    with socket.create_server(("127.0.0.1", 0)) as silent:
        free = f"127.0.0.1:{silent.getsockname()[1]}"
    refused(lambda: master.run(system({"host": free, **START})), f"nobody answers at {free}", "selflock serve")
    refused(lambda: master.run(system({"host": free, "process": True, **START})), "selflock serve --isolate")


@pytest.mark.slow
def test_a_served_fmu_is_the_one_that_is_meant(served, refused):
    refused(lambda: master.run(system({"host": served("lag"), "fmu": "tank.fmu", **START})), "tank.fmu is asked for, and lag.fmu")


def test_the_server_says_its_greeting_and_nothing_to_strangers(served):
    """The bytes as the page tells them: a length, a word and a nonce; a wrong proof, or a long message, ends the line."""
    host, port = served("lag").split(":")
    for told in (bytes(2 * NONCE), bytes(5), bytes(1000)):
        with socket.create_connection((host, int(port)), 5.0) as end:
            line = Line(end)
            greeting = line.receive(100)
            assert greeting.startswith(GREETING) and len(greeting) == len(GREETING) + NONCE
            line.send(told)
            left = b""
            while more := end.recv(100):
                left += more
            assert left in (b"\0\0\0\2no", b"")


def test_no_two_greetings_are_alike(served):
    host, port = served("lag").split(":")
    seen = set()
    for _ in range(3):
        with socket.create_connection((host, int(port)), 5.0) as end:
            seen.add(Line(end).receive(100))
    assert len(seen) == 3 and np.all([len(one) == len(GREETING) + NONCE for one in seen])
