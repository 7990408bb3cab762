"""Calls of a host that is not Python, in any order and with any numbers, to our FMUs: each answers, none ends the host.

A step that answers OK leaves outputs that are numbers.
"""

from __future__ import annotations

import math
import os
import subprocess
import sysconfig
import tempfile
from functools import cache, partial
from pathlib import Path

from hypothesis import strategies as st
from lives import Extracted

from selflock.fmus import loader
from selflock.fmus.build import built

FMUS = ("Reducer", "Motor", "Controller", "Load", "Sensor")
LENGTH = 40  # calls of a sequence
NUMBERS = st.sampled_from("0 1 -1 -0.0 0.5 1e-3 1e3 50 1e-300 1e300 -1e300 5e-324 nan inf -inf 1e9 2147483648 12.5".split())
SIZES = st.sampled_from("0x1p-10 0x1p-10 1e-3 1e-3 0 -1e-3 1e-12 1 1e9 nan inf 0.125".split())


@cache
def _host() -> tuple[Path, tempfile.TemporaryDirectory]:
    """The program, compiled once, and the folder that it is in."""
    folder = tempfile.TemporaryDirectory()
    program = Path(folder.name) / "host"
    source = Path(__file__).parents[1] / "hosts" / "host.c"
    subprocess.run([loader.compiler(), "-O1", "-o", program, source, "-ldl", "-lpthread"], check=True)
    return program, folder


@cache
def _fmu(name: str) -> Extracted:
    return Extracted(built(name), Path(_host()[1].name) / name)


def possible() -> bool:
    """Whether such a host can be made here."""
    return loader.compiler() is not None and bool(sysconfig.get_config_var("Py_ENABLE_SHARED"))


@st.composite
def calls(draw, fmu: Extracted):
    """Commands of host.c: a regular life with anything in it."""
    known = sorted(fmu.vr.values())
    reference = st.one_of(st.sampled_from(known), st.sampled_from([0, 9999, 4294967295]))
    slot = st.integers(0, 3)
    one = st.one_of(
        st.tuples(st.just("step"), st.just(0), NUMBERS, SIZES),
        st.tuples(st.just("real"), st.just(0), reference, NUMBERS),
        st.tuples(st.just("real"), st.just(0), reference, NUMBERS),
        st.tuples(st.just("bool"), st.just(0), reference, st.sampled_from([0, 1, 7, -1])),
        st.tuples(st.just("get"), st.just(0), reference),
        st.tuples(st.just("getb"), st.just(0), reference),
        st.tuples(st.sampled_from(["save", "restore", "drop", "pack"]), st.just(0), slot),
        st.tuples(st.sampled_from(["setup", "enter", "exit", "terminate", "reset"]), st.just(0)),
        st.just(("again",)),
    )
    new = ("new", 0, "A", "it", fmu.uri, fmu.description.guid)
    made: list[tuple] = [("load", "A", fmu.library), new, ("setup", 0)]
    made += [("real", 0, draw(st.sampled_from(known)), draw(NUMBERS)) for _ in range(draw(st.integers(0, 3)))]
    made += [("enter", 0), ("exit", 0)]
    outputs = ("get", 0, *(fmu.vr[name] for name in fmu.outputs))
    there: set[int] = set()  # states that may be dropped or packed
    for command in draw(st.lists(one, min_size=5, max_size=LENGTH)):
        if command == ("again",):
            made += [("free", 0), new]
            there.clear()
            continue
        if command[0] == "save":
            there.add(command[2])
        elif command[0] in ("restore", "drop", "pack") and command[2] not in there:
            continue  # a pointer to nothing is the host's mistake
        elif command[0] == "drop":
            there.discard(command[2])
        made.append(command)
        if command[0] == "step":
            made.append(outputs)
    return [*made, ("free", 0)]


def ask(name: str, data, room: Path | None = None) -> str:
    """One sequence: "answered" where every call did with OK or Warning, else "refused"."""
    commands = data.draw(calls(_fmu(name)))
    lines = "".join("\t".join(map(str, command)) + "\n" for command in commands)
    environment = {"PATH": os.environ["PATH"], "MALLOC_PERTURB_": "165"}
    done = subprocess.run([_host()[0]], input=lines.encode(), env=environment, capture_output=True, timeout=120)
    answers = [line for line in done.stdout.decode("utf-8", "replace").splitlines() if line[:1] in "0123456789n"]
    assert done.returncode == 0, f"the host ended with {done.returncode} after {len(answers)} of {len(commands)} calls: {lines}"
    assert b"Traceback" not in done.stderr, done.stderr.decode("utf-8", "replace")[-2000:]
    assert len(answers) == len(commands), f"{len(answers)} answers to {len(commands)} calls"
    assert "null" not in answers, "no instance was made, and nothing asked of it"
    step = ""
    for command, answer in zip(commands, answers):
        status, *values = answer.split()
        if command[0] == "get" and len(command) > 3 and step == status == "0":
            assert all(math.isfinite(float.fromhex(value)) for value in values), f"OK with {values}: {lines}"
        step = status if command[0] == "step" else step
    return "answered" if all(answer.split()[0] in "01" for answer in answers) else "refused"


def kinds() -> dict:
    return {f"calls of {name}": partial(ask, name) for name in FMUS} if possible() else {}
