"""FMUs of other makers: pythonfmu slaves and native ones written in C after the specification."""

import math
import subprocess
import tempfile
import zipfile
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from selflock import master
from selflock.fmus.units import of
from selflock.master import binary
from selflock.master.fmu import FmuPart


def test_a_pythonfmu_slave_runs(system, counter):
    parts = {"a": (counter, {"u": 2.0, "gain": 0.5}), "b": counter}
    result = master.run(system(parts, {"b.u": "a.sum"}, stop=1.0, step=0.1))
    last = result.table.iloc[-1]
    assert last["a.sum"] == 10.0 and last["a.n"] == 10 and last["a.word"] == "step 10"
    assert result.table["a.even"].dtype == bool and result.table["a.n"].dtype == "int64"
    assert last["b.sum"] == sum(range(1, 11))  # Gauss-Seidel: the newest sum


def test_its_failure_tells_all(system, counter, tmp_path):
    with pytest.raises(master.PartFailed) as caught:
        master.run(system({"a": (counter, {"u": 2.0, "stop_at": 0.55})}, stop=1.0, step=0.1), out=tmp_path / "t.csv")
    for words in ("a answered Discard to fmi2DoStep at t = 0.5 s (step 0.1 s)", "Error: no more after 0.55", "t.csv", "try:"):
        assert words in str(caught.value)
    assert len(master.read(tmp_path / "t.csv")[0]) == 6


def test_save_and_restore_give_the_same_bits(counter, native):
    for path, given, taken in ((counter, "u", "sum"), (native("relaxation"), "u", "x")):
        part = FmuPart("p", path)
        part.bind([given], [taken])
        part.enter_initialization(0.0, None)
        part.exit_initialization()

        def on(first):
            got = []
            for k in range(first, first + 5):
                part.u[0] = math.sin(k)
                part.cycle(k * 1e-7, 1e-7)
                got.append(part.y[0])
            return got

        on(0)
        state = part.save()
        straight = on(5)
        part.restore(state)
        assert on(5) == straight
        del state
        part.terminate()
        part.close()


def test_doubling_with_fmus(system, native):
    description = system(
        {"r": (native("relaxation"), {"rate": 3.0, "u": 0.0})}, stop=1.0, step=0.1, step_control="doubling", tolerance=1e-6
    )
    table = master.run(description).table
    assert table["r.x"].iloc[-1] == pytest.approx(math.exp(-3.0), rel=1e-12)
    assert np.allclose(table["r.flow"], -3.0 * table["r.x"])


def test_a_stiff_one_at_any_step(system, native):
    description = system({"r": (native("relaxation"), {"u": 5.0})}, stop=1.0, step=0.1)
    assert master.run(description).table["r.x"].iloc[-1] == pytest.approx(5.0, abs=1e-12)


def test_discarded_steps_are_finished_from_the_last_successful_time(system, native):
    """Impacts of a ball that falls from 1 m: the first after √(2/g), the others 2 e^n times that apart."""
    table = master.run(system({"b": (native("ball"), {"restitution": 0.5})}, stop=1.2, step=0.1)).table
    fall = math.sqrt(2 / 9.81)
    impacts = [fall + 2 * fall * sum(0.5**k for k in range(1, n)) for n in range(1, 8)]
    assert table["b.bounces"].to_list() == [sum(i <= t for i in impacts) for t in table["time"]]
    t = 0.8 - impacts[0]
    speed = 0.5 * 9.81 * fall
    assert table["b.height"].iloc[8] == pytest.approx(speed * t - 9.81 / 2 * t * t, abs=1e-12)


def test_a_step_discarded_whole_asks_for_a_smaller_one(system, native):
    with pytest.raises(master.PartFailed, match="(?s)Discard.*try: a smaller"):
        master.run(system({"b": (native("ball"), {"whole": True})}, stop=1.0, step=0.1))


def test_enumerations_are_integers_and_units_are_those_of_the_fmu(native):
    part = FmuPart("r", native("relaxation"))
    assert part.units["degC"] == of(offset=273.15, K=1)
    assert part.variables["rate"].minimum == 0.0 and part.variables["rate"].start == 1e6
    assert part.variables["flow"].depends_on == ("u",) and part.variables["x"].depends_on == ()
    part.close()


def broken(path, source, *, description=None, without=None):
    """A copy of an FMU with another description, or with something left out."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if without and name.startswith(without):
                continue
            content = old.read(name)
            new.writestr(name, description(content.decode()) if description and name == "modelDescription.xml" else content)
    return path


def test_files_that_are_no_fmu_for_us(tmp_path, native, refused):
    good = native("relaxation")
    (tmp_path / "text.fmu").write_text("hello")
    (tmp_path / "half.fmu").write_bytes(Path(good).read_bytes()[:300])
    corrupt = bytearray(Path(good).read_bytes())
    corrupt[len(corrupt) // 2] ^= 0xFF
    (tmp_path / "corrupt.fmu").write_bytes(corrupt)
    cases = {
        "none.fmu": "no FMU at",
        "text.fmu": "not an FMU",
        "half.fmu": "not an FMU",
        "corrupt.fmu": "damaged",
        broken(tmp_path / "empty.fmu", good, without="modelDescription"): "no modelDescription.xml",
        broken(tmp_path / "bare.fmu", good, without="binaries"): "no binary for this machine",
        broken(tmp_path / "xml.fmu", good, description=lambda text: text[:200]): "cannot be understood",
        broken(
            tmp_path / "three.fmu", good, description=lambda text: text.replace('fmiVersion="2.0"', 'fmiVersion="3.1"')
        ): "is FMI 3.1",
        broken(tmp_path / "me.fmu", good, description=lambda t: t.replace("CoSimulation", "ModelExchange")): "lacks fmi2",
        broken(
            tmp_path / "lib.fmu", good, description=lambda t: t.replace('Identifier="relaxation"', 'Identifier="other"')
        ): "named after its modelIdentifier",
    }
    for path, words in cases.items():
        refused(lambda: master.run(master.from_dict({"components": {"x": {"fmu": str(tmp_path / path)}}})), words)


def test_instances_share_one_unpacked_folder(counter):
    parts = [FmuPart(name, counter) for name in "ab"]
    assert parts[0]._binary is parts[1]._binary
    assert str(parts[0]._binary.folder).isascii()
    for part in parts:
        part.close()


@pytest.mark.slow
@pytest.mark.parametrize("end, status", [(3, "Error"), (4, "Fatal")])
def test_the_teller_ends_as_told(system, native, end, status):
    description = system(
        {"t": (native("teller"), {"word_in": "hallo", "count_in": 1, "flag_in": False, "mood": 2})}, stop=1.0, step=0.1
    )
    with pytest.raises(master.PartFailed) as caught:
        master.run(description, settings={"t.end": end, "t.ends_at": 0.5})
    for words in (
        f"t answered {status}",
        "at t = 0.5 s",
        "begins with hallo, 1 and 0.500",
        "told to end at 0.5 s, 100% on purpose",
    ):
        assert words in str(caught.value)
    assert caught.value.result.table["t.word_out"].iloc[-1] == "hallo!"


@pytest.mark.slow
def test_a_warning_does_not_end_a_run(system, native):
    description = system({"t": (native("teller"), {"word_in": "a", "count_in": 1, "flag_in": False})}, stop=1.0, step=0.1)
    assert master.run(description, settings={"t.end": 1, "t.ends_at": 0.5}).table["t.count_out"].iloc[-1] == 2


@pytest.mark.slow
def test_an_error_behind_the_last_step_is_a_note(system, native):
    """All rows are there by then, and nothing of them is lost."""
    result = master.run(system({"t": (native("teller"), {"end": 7})}, stop=0.5, step=0.1, open_inputs=True))
    assert len(result.table) == 6
    assert result.notes == ["t answered Error to fmi2Terminate, after its last step; the results are whole"]


@pytest.mark.slow
def test_not_a_number_from_an_fmu(system, native):
    description = system({"t": (native("teller"), {"end": 6, "ends_at": 0.5})}, stop=1.0, step=0.1, open_inputs=True)
    with pytest.raises(master.PartFailed, match=r"t.value answered nan at t = 0.6 s"):
        master.run(description)


@pytest.mark.in_turn
@pytest.mark.slow
def test_types_convert_from_one_native_fmu_to_another(system, native, refused):
    parts = {
        "a": (native("teller"), {"count_in": 4}),
        "b": native("teller"),
        "x": native("relaxation"),
        "z": native("relaxation"),
    }
    ends = {
        "b.count_in": {"from": "a.flag_out", "factor": 3.0, "offset": 1.0},
        "b.flag_in": "a.flag_out",
        "x.u": "a.flag_out",
        "z.u": {"from": "a.count_out", "factor": 0.5},
    }
    last = master.run(system(parts, ends, stop=0.3, step=0.1, open_inputs=True)).table.iloc[-1]
    assert bool(last["a.flag_out"]) and last["b.count_out"] == 3 + 1 + 1 and not last["b.flag_out"]
    assert last["x.x"] == pytest.approx(1.0) and last["z.x"] == pytest.approx(2.5)
    for target, source, words in (
        ("b.count_in", {"from": "a.count_out", "factor": 0.5}, "whole numbers"),
        ("b.flag_in", {"from": "a.flag_out", "offset": 1.0}, "is a Boolean"),
        ("b.word_in", {"from": "a.word_out", "factor": 2.0}, "is a String"),
        ("b.count_in", "x.x", "Real does not fit into Integer"),
    ):
        refused(lambda: master.run(system(parts, {target: source}, open_inputs=True)), target, words)


@pytest.mark.slow
def test_pending_steps_are_waited_for(system, native):
    description = system(
        {"t": (native("teller"), {"slow": True, "word_in": "a", "count_in": 4, "flag_in": True})}, stop=0.3, step=0.1
    )
    assert master.run(description).table["t.count_out"].to_list() == [0, 5, 5, 5]


@pytest.mark.slow
def test_an_fmu_without_variable_steps_refuses_step_control(system, native, refused):
    description = system({"t": native("teller")}, open_inputs=True, step_control="doubling")
    refused(lambda: master.run(description), "t takes steps of one size only")


def test_log_lines_find_their_instance_with_or_without_its_environment(counter):
    from selflock.master import binary

    parts = [FmuPart(name, counter) for name in ("one", "two")]
    binary._hear(parts[0]._number, b"whoever", 1, b"", b"hot")
    binary._hear(None, b"two", 3, b"", "zu heiß".encode())
    binary._hear(None, b"three", 3, b"", b"nobody's")
    assert list(parts[0].log) == ["Warning: hot"] and list(parts[1].log) == ["Error: zu heiß"]
    for part in parts:
        part.close()


def changed(path, out, change):
    """The FMU at `path` with its files renamed or changed: change(name, content) -> (name, content)."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            new.writestr(*change(name, old.read(name)))
    return str(out)


def test_a_binary_of_another_name_is_told(native, tmp_path, refused):
    def rename(name, content):
        return name.replace("linux64/ball.so", "linux64/bell.so"), content

    path = changed(native("ball"), tmp_path / "b.fmu", rename)
    refused(lambda: FmuPart("b", path), "named after its modelIdentifier", "there is bell.so", "not ball.so")


def test_a_missing_system_library_is_named(native, tmp_path, refused):
    needed = tmp_path / "libnowhere.so.3"
    subprocess.run(["gcc", "-shared", "-Wl,-soname,libnowhere.so.3", "-o", needed, "-x", "c", "/dev/null"], check=True)
    subprocess.run(
        ["gcc", "-shared", "-o", tmp_path / "own.so", "-x", "c", "/dev/null", "-x", "none", "-Wl,--no-as-needed", needed],
        check=True,
    )
    needed.unlink()

    def lacking(name, content):
        return name, (tmp_path / "own.so").read_bytes() if name.endswith(".so") else content

    path = changed(native("ball"), tmp_path / "b.fmu", lacking)
    refused(lambda: FmuPart("b", path), "the system library libnowhere.so.3", "not on this machine")


def test_a_binary_that_is_none_is_told(native, tmp_path, refused):
    path = changed(native("ball"), tmp_path / "b.fmu", lambda name, content: (name, b"no" if name.endswith(".so") else content))
    refused(lambda: FmuPart("b", path), "cannot be loaded", "b.fmu")


def test_processes_that_were_forked_unpack_side_by_side(tmp_path):
    """The study forks while FMUs are open: two of its processes unpacked the next one into one folder, and each found half of it."""
    binary.root()
    context = get_context("fork")
    answers = context.SimpleQueue()

    def unpacked():
        tempfile.tempdir = str(tmp_path)  # else it stays behind
        answers.put(binary.root())

    for process in (processes := [context.Process(target=unpacked) for _ in range(2)]):
        process.start()
    for process in processes:
        process.join()
    assert len({binary.root(), answers.get(), answers.get()}) == 3
