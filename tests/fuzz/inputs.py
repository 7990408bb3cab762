"""What strangers may hand over, drawn from grammars: files that are right but for a few things, and things that never were.

A case is one draw: `KINDS[kind](data, folder)` writes it into a folder and asks of it what a user would. What may come back is
an answer or one message (a SelflockError, an OSError that names its file), within PATIENCE; nothing is written outside.
"""

from __future__ import annotations

import io
import math
import os
import signal
import threading
import zipfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from selflock import examples, master
from selflock.fmus.build import built
from selflock.fmus.errors import SelflockError
from selflock.info import info

PATIENCE, LONGEST = 30, 600  # s of processor, and of wall time on a busy machine, that any input may take
RIGHT = (SelflockError, OSError)  # what the command line tells in one message

VALUES = [
    "0", "-1", "1", "-0.0", "1e300", "-1e300", "1e-300", "5e-324", "nan", "inf", "-inf", "2147483648", "9" * 400, "1e6",
    "1" + "0" * 5000, '""', '"\\u0000"', '"a\\u0000b"', '"../../x"', '"/etc/passwd"', '"' + "a" * 10_000 + '"', "[]", "{}",
    "[" * 60 + "]" * 60, "[" * 3000 + "]" * 3000, "true", "false", '"= 1 / 0"', '"= ' + "(" * 300 + "1" + ")" * 300 + '"', '"= ratio"',
    '"= 9 ** 9 ** 9"', '"= nothing.at.all"', "1979-05-27", "1979-05-27T07:32:00Z", "07:32:00", '"nan"', '"selflock:Motor"',
    '"os:system"', '"motor.speed"', '"*"', '"["', '"N.m"', '"rad/s"', '"\\u202e\\ud7ff"', "[1.0, nan]", "[0.0, 1e300]", "{ a = 1 }", '["a", "a"]',
]  # fmt: skip
KEYS = ["run", "step", "components", "motor", "vary", "set", "values", "time", "x.y.z", '""', '"\\u0000"', "record", "é"]
BYTES = [b"", b"\0", b"\xff\xfe", b"\n[", b'"""', b"=", b"#", b"]", b"\r", b"e999", b"\xf0\x9f", b"{" * 500]
HOSTILE, WORDS, NAUGHTY = map(st.sampled_from, (VALUES, KEYS, BYTES))


@st.composite
def changed(draw, text: str) -> bytes:
    """A text of `key = value` lines under [tables] with a few things wrong."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    for _ in range(draw(st.integers(0, 4))):
        place = draw(st.integers(0, len(lines) - 1))
        way = draw(st.integers(0, 6))
        key, equals, _ = lines[place].partition("=")
        if way <= 2 and equals:
            lines[place] = f"{key}= {draw(HOSTILE)}"
        elif way == 3 and len(lines) > 1:
            del lines[place]
        elif way == 4:
            lines.insert(place, lines[draw(st.integers(0, len(lines) - 1))])
        elif way == 5:
            lines.insert(place, f"{draw(WORDS)} = {draw(HOSTILE)}")
        else:
            lines.insert(place, f"[{draw(WORDS)}]")
    whole = "\n".join(lines).encode() + b"\n"
    return _torn(draw, whole) if draw(st.integers(0, 9)) == 0 else whole


def _torn(draw, whole: bytes) -> bytes:
    """Cut off, or with naughty bytes in it."""
    place = draw(st.integers(0, len(whole)))
    return whole[:place] + (b"" if draw(st.booleans()) else draw(NAUGHTY) + whole[place:])


def _text(name: str) -> str:
    return examples.files()[name].read_text("utf-8")


def _sound(table) -> None:
    """No number in an answer that is none."""
    for name, column in table.items():
        if column.dtype.kind == "f":
            assert np.isfinite(column.to_numpy()).all(), f"an answer with {name} that is no number"


def system(data, folder: Path) -> None:
    path = folder / "x.toml"
    path.write_bytes(data.draw(changed(_text(data.draw(st.sampled_from(["bench", "motor_failure"]))))))
    if data.draw(st.integers(0, 3)) == 0:
        info(path)
    described = master.load(path)
    described.run.stop = described.run.start + 5.0 * described.run.step
    _sound(master.run(described, out=folder / "x.csv", max_time=PATIENCE).table)


RIG = """
[rig]
name = "a rig"
kind = "inverse"
run = "run"
[columns]
time = "time"
"reducer.input_speed" = { column = "speed", unit = "rad/s" }
"motor.torque" = { column = "torque", unit = "N.m" }
[parameters]
"reducer.gear_ratio" = 50.0
"reducer.friction_kinetic" = 0.03
"reducer.shaft_inertia" = 1e-4
"load.inertia" = 0.05
"load.constant_torque" = 2.0
[uncertain]
"reducer.viscous_damping" = [0.0, 1e-3]
"""
WRONG = ["", "nan", "1e300", "-1e300", "inf", "x", "1e999", '"', "0", "-0", "1,5", "9" * 400, "1e-320", "é", "\0", "True"]
CELLS = st.sampled_from(WRONG)


def _log(data) -> bytes:
    """A log of a sound drive with cells that are wrong."""
    time = 0.01 * np.arange(240)
    speed = 20.0 * np.sin(3.0 * time)
    rows = [[f"{t:.9g}", f"{s:.9g}", f"{0.1 * math.tanh(s):.9g}", str(int(t > 1.2))] for t, s in zip(time, speed)]
    for _ in range(data.draw(st.integers(0, 3))):
        column, wrong = data.draw(st.integers(0, 3)), data.draw(CELLS)
        first = data.draw(st.integers(0, len(rows) - 1))
        for row in rows[first : first + data.draw(st.sampled_from([1, 1, 1, 100, 1000]))]:
            row[column] = wrong
    names = ["time", "speed", "torque", "run"]
    if data.draw(st.integers(0, 9)) == 0:
        names[data.draw(st.integers(0, 3))] = data.draw(st.sampled_from(["", "time", "speed [m]", "\0", "a" * 1000, "run"]))
    whole = "\n".join(",".join(row) for row in [names, *rows]).encode() + b"\n"
    return _torn(data.draw, whole) if data.draw(st.integers(0, 9)) == 0 else whole


def rig(data, folder: Path) -> None:
    from selflock.diagnosis import replay

    (folder / "rig.toml").write_bytes(data.draw(changed(RIG)))
    (folder / "log.csv").write_bytes(_log(data))
    replay(folder / "rig.toml", folder / "log.csv", None)


def log(data, folder: Path) -> None:
    """The log alone is wrong; it is also a table that feeds an FMU, and one of results."""
    from selflock.diagnosis import replay

    (folder / "rig.toml").write_text(RIG)
    (folder / "log.csv").write_bytes(_log(data))
    try:
        info(folder / "log.csv")
        master.run(built("Motor"), {"speed": 0.0}, stop=0.01, step=0.001, inputs=folder / "log.csv")
    except RIGHT:
        pass
    replay(folder / "rig.toml", folder / "log.csv", None)


SWEEP = """
system = "system.toml"
stop = 0.003
[set]
"motor.voltage" = "= 10 * ohm"
[vary.ohm]
set = "motor.resistance"
grid = { from = 0.5, to = 2.0, count = 2 }
[vary.km]
set = "motor.torque_constant"
range = [0.02, 0.03]
[sample]
method = "lhs"
count = 2
seed = 1
[record]
current = { final = "motor.current", unit = "A" }
torque = { max = "abs(motor.torque)", from = 0.001, unit = "N.m" }
both = { value = "current + ohm" }
"""
MOTOR = """
[run]
stop = 0.003
step = 0.001
[components.motor]
fmu = "selflock:Motor"
[components.motor.start]
voltage = 12.0
speed = 0.0
"""


def sweep(data, folder: Path) -> None:
    from selflock.sweep import sweep as run_sweep
    from selflock.sweep.study import read

    (folder / "system.toml").write_text(MOTOR)
    (folder / "study.toml").write_bytes(data.draw(changed(SWEEP)))
    study = read(folder / "study.toml")
    study.stop = 0.003  # a long run is no hang
    if len(study.settings) <= 8:
        run_sweep(study, folder / "out", workers=0)


@contextmanager
def _archive(path: Path, given: bytes, data):
    """Rewrite an archive with some entries changed."""
    content = {}
    with zipfile.ZipFile(io.BytesIO(given)) as archive:
        for entry in archive.infolist():
            content[entry.filename] = archive.read(entry)
    yield content
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in content.items():
            archive.writestr(name, value)
        for _ in range(data.draw(st.integers(0, 1))):
            archive.writestr(
                data.draw(st.sampled_from(["/abs", "../up", "a\\b", "C:x", "a\x01", "x/../../y", "a" * 5000, "é"])), b"x"
            )
    whole = buffer.getvalue()
    path.write_bytes(_torn(data.draw, whole) if data.draw(st.integers(0, 5)) == 0 else whole)


XML = st.sampled_from([
    b"", b"-1", b"1e999", b"nan", b"0", b"&#0;", b"&x;", b"9" * 400, b"a" * 20_000, b"true", b"../x", b"<a>" * 2000, b'"', b"2147483648",
    b"input", b"output", b"Real", b"fixed", b"exact", b"4294967296", b"\xff", b"<!DOCTYPE a [<!ENTITY x 'y'>]>",
])  # fmt: skip


def _xml(data, whole: bytes) -> bytes:
    """A document with some values of attributes, some marks, wrong."""
    for _ in range(data.draw(st.integers(0, 3))):
        quotes = [place for place, byte in enumerate(whole) if byte == 0x22]
        if len(quotes) < 2:
            break
        first = data.draw(st.integers(0, len(quotes) // 2 - 1)) * 2
        whole = whole[: quotes[first] + 1] + data.draw(XML) + whole[quotes[first + 1] :]
    return whole


def fmu(data, folder: Path) -> None:
    """What is told of an FMU; the binary, which is a program, is as it was."""
    path = folder / "x.fmu"
    with _archive(path, built("Motor").read_bytes(), data) as content:
        content["modelDescription.xml"] = _xml(data, content["modelDescription.xml"])
        if data.draw(st.integers(0, 4)) == 0:
            content.pop(data.draw(st.sampled_from(sorted(content))))
    info(path)


_ssp: list[bytes] = []


def ssp(data, folder: Path) -> None:
    if not _ssp:
        from selflock.master.ssp import export

        (folder / "system.toml").write_text(MOTOR)
        _ssp.append(Path(export(master.load(folder / "system.toml"), folder / "good.ssp")).read_bytes())
    path = folder / "x.ssp"
    with _archive(path, _ssp[0], data) as content:
        for name in sorted(content):
            if name.endswith((".ssd", ".ssv", ".ssm")) and data.draw(st.booleans()):
                content[name] = _xml(data, content[name])
    if data.draw(st.integers(0, 3)) == 0:
        info(path)
    described = master.load(path)
    described.run.stop = described.run.start + 3.0 * described.run.step
    _sound(master.run(described, max_time=PATIENCE).table)


def result(data, folder: Path) -> None:
    """Files of results, of any content, in either form."""
    name = data.draw(st.sampled_from(["x.csv", "x.parquet", "x.parquet.arrows", "x.mat"]))
    if name.endswith("csv"):
        content = _log(data)
    else:
        import pyarrow as pa
        import pyarrow.parquet as pq

        table, buffer = pa.table({"time": [0.0, 1.0], "a.b": [1.0, math.nan], "s": ["x", None]}), io.BytesIO()
        if name.endswith("arrows"):
            with pa.ipc.new_stream(buffer, table.schema) as stream:
                stream.write_table(table)
        else:
            pq.write_table(table, buffer)
        content = _torn(data.draw, buffer.getvalue())
    (folder / name).write_bytes(content)
    info(folder / name.removesuffix(".arrows"))


KINDS = {"system": system, "rig": rig, "log": log, "sweep": sweep, "FMU": fmu, "SSP": ssp, "results": result}


class Hung(BaseException):
    """Nothing in between may take it for a failure of its own."""


@contextmanager
def bounded():
    """Raise where an input takes longer than PATIENCE; in the main thread alone."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def hung(number, _):
        raise Hung(f"a hang of more than {PATIENCE if number == signal.SIGPROF else LONGEST} s")

    before = {number: signal.signal(number, hung) for number in (signal.SIGPROF, signal.SIGALRM)}
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    signal.alarm(LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.alarm(0)
        for number, handler in before.items():
            signal.signal(number, handler)


def ask(kind: str, data, room: Path) -> str:
    """One draw of a kind in a folder of its own below `room`: "answered" or "refused". Raises whatever else comes of it."""
    folder = room / "case"
    folder.mkdir()
    inside = os.getcwd()
    try:
        with bounded(), np.errstate(all="ignore"):
            KINDS[kind](data, folder)
        told = "answered"
    except RIGHT as error:
        assert str(error).strip(), "an empty message"
        told = "refused"
    finally:
        for path in sorted(folder.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()
        folder.rmdir()
        assert os.getcwd() == inside
    assert not list(room.iterdir()), f"written outside its folder: {[path.name for path in room.iterdir()]}"
    return told
