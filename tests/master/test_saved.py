"""What was computed is in the file, whatever becomes of the run."""

import logging
import resource
import shutil
import signal
import threading
import time

import numpy as np
import pytest
import small_parts

from selflock import master
from selflock.master import errors, files


@pytest.fixture
def warned(caplog):
    errors.warn.cache_clear()
    with caplog.at_level(logging.WARNING, logger="selflock"):
        yield lambda: caplog.text


def until(what, seconds=60.0):
    """Wait for it, however busy the machine is."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if (found := what()) is not None:
            return found
        time.sleep(0.01)
    raise AssertionError("it did not come")


def read_or_not(path):
    try:
        return master.read(path)[0]
    except master.ResultError:
        return None


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_rows_are_in_the_file_while_a_step_takes_for_ever(system, tmp_path, ending, monkeypatch, warned):
    monkeypatch.setattr(small_parts.Waits, "go", threading.Event(), raising=False)
    monkeypatch.setattr(files, "EVERY", 0.02)
    path, copy = tmp_path / f"t.{ending}", tmp_path / f"copy.{ending}"
    path.write_bytes(b"what was here before")
    description = system({"w": ("Waits", {"from_": 0.3})}, stop=1.0, step=0.1)
    run = threading.Thread(target=lambda: master.run(description, out=path))
    run.start()

    def all_rows():
        table = read_or_not(path)
        return table if table is not None and len(table) == 4 else None

    try:
        table = until(all_rows)
        for file in list(tmp_path.iterdir()):  # what a crash at this instant would leave
            shutil.copy(file, tmp_path / file.name.replace("t.", "copy.", 1))
    finally:
        small_parts.Waits.go.set()
        run.join()
    assert table["w.t"].to_numpy() == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert master.read(copy)[0].equals(table)
    assert ("not finished" in warned()) == (ending == "parquet")
    whole = master.read(path)[0]
    assert whole["w.t"].to_numpy() == pytest.approx(0.1 * np.arange(11)) and whole.iloc[:4].equals(table)
    assert not {"t.parquet.arrows", "t.parquet.new"} & {file.name for file in tmp_path.iterdir()}
    torn = copy if ending == "csv" else files._stream(copy)
    content = torn.read_bytes()
    first = content.index(b"\n") + 1 if ending == "csv" else len(content) - 1
    for size in range(len(content) - 1, first, -7):  # cut off anywhere: whole rows from the begin
        torn.write_bytes(content[:size])
        cut = master.read(copy)[0]
        assert len(cut) < 4 and cut.to_numpy().tolist() == table.iloc[: len(cut)].to_numpy().tolist(), size


def test_an_arrow_stream_that_is_torn_anywhere_is_read_to_there(system, tmp_path, warned):
    columns = [master.Variable("time", "s"), master.Variable("x.word", type="String")]
    sink = files.Parquet(columns, tmp_path / "t.parquet")
    for k in range(20):
        sink.block[sink.fill, 0] = k
        sink.words.append([f"w{k}"])
        sink.fill += 1
        sink.save()
    content, least, header = files._stream(sink.path).read_bytes(), 0, len(sink._schema.serialize())
    sink.close()
    sink.path.unlink()
    stream = files._stream(sink.path)
    for size in range(header, len(content), 211):
        stream.write_bytes(content[:size])
        table, units = master.read(sink.path)
        assert table["x.word"].to_list() == [f"w{k}" for k in range(len(table))] and units["time"] == "s"
        assert len(table) >= least
        least = len(table)
    assert least >= 18


def test_a_csv_whose_header_is_cut_has_no_columns(system, tmp_path, warned):
    """A full disk, or a crash, at the very begin: half a first line is no table of other columns."""
    path = tmp_path / "t.csv"
    master.run(system({"i": ("Integrator", {"u": 1.0})}, stop=0.2, step=0.1), out=path)
    whole = path.read_bytes()
    first = whole.index(b"\n") + 1
    for size in range(first):
        path.write_bytes(whole[:size])
        with pytest.raises(master.ResultError, match="not even its first line|Empty"):
            master.read(path)
    path.write_bytes(whole[:first])
    table, units = master.read(path)
    assert units["time"] == "s"
    path.write_bytes(whole)
    assert table.equals(master.read(path)[0].iloc[:0])


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_full_disk_is_told_with_what_is_kept(system, tmp_path, ending, warned):
    path = tmp_path / f"t.{ending}"
    description = system({"i": ("Integrator", {"u": 1.0})}, stop=2e4, step=1.0)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        with pytest.raises(master.ResultError) as caught:
            master.run(description, out=path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    message = str(caught.value)
    table = master.read(path)[0]
    assert 4096 <= len(table) < 20001 and table["time"].to_list() == list(range(len(table)))
    for words in (str(path), "no file may be larger", f"{len(table)} rows until t = {len(table) - 1} s", "MiB", "Make room"):
        assert words in message, message
    assert not (tmp_path / "t.parquet.new").exists()
    master.run(description, out=path, stop=200.0)  # and it can be run again
    assert len(master.read(path)[0]) == 201 and len(list(tmp_path.iterdir())) == 1


def test_a_last_line_without_an_end(tmp_path, warned):
    path = tmp_path / "t.csv"
    path.write_text("time [s],m.x [m]\n0.0,1.5\n1.0,2.25\n2.0,3.12")  # it was 3.125
    assert master.read(path)[0]["m.x"].to_list() == [1.5, 2.25] and "last line has no end" in warned()
    assert files.read(path, whole=True)[0]["m.x"].to_list() == [1.5, 2.25, 3.12]  # a person's, who needs no line break


@pytest.mark.parametrize("heard", ["as it comes", "told", "torn", "lost"])
@pytest.mark.parametrize("ending", [None, "csv", "parquet"])
def test_ctrl_c_is_the_user_whoever_meets_it(system, tmp_path, heard, ending, monkeypatch):
    monkeypatch.setattr(small_parts.Waits, "heard", heard)
    path = tmp_path / f"t.{ending}" if ending else None
    description = system({"w": ("Waits", {"from_": 0.3})}, stop=1.0, step=0.1)
    with pytest.raises(KeyboardInterrupt) as caught:
        master.run(description, out=path)
    at = 0.4 if heard == "lost" else 0.3  # then the step was made
    assert f"The run was stopped; the results until t = {at} s" in str(caught.value)
    if path:
        assert str(path) in str(caught.value)
        assert master.read(path)[0]["w.t"].to_numpy() == pytest.approx(0.1 * np.arange(round(at / 0.1) + 1))


@pytest.mark.parametrize("heard", ["told", "torn"])
def test_ctrl_c_is_the_user_while_an_fmu_is_made(system, heard, monkeypatch):
    class Unborn(small_parts.Waits):
        def __init__(self, name, **options):
            super().__init__(name, **options)
            self.heard = heard
            self.hear(0.0, 0.0)

    monkeypatch.setattr(small_parts, "Unborn", Unborn, raising=False)
    with pytest.raises(KeyboardInterrupt, match="The run was stopped; it had not begun"):
        master.run(system({"w": ("Unborn", {})}, stop=1.0, step=0.1))


@pytest.mark.slow
@pytest.mark.parametrize("inside", ["main thread", "background", "another thread"])
def test_a_run_has_a_time_limit(system, tmp_path, inside, monkeypatch):
    monkeypatch.setattr(small_parts.Waits, "go", threading.Event(), raising=False)
    path = tmp_path / "t.csv"
    if inside != "another thread":  # a step that would wait for ever
        description = system({"w": ("Waits", {"from_": 0.3})}, stop=1.0, step=0.1)
    else:  # many steps, each of which comes to its end
        description = system({"w": "Waits"}, stop=1e6, step=0.1)
    raised = []

    def run():
        try:
            master.run(description, out=path, max_time=0.05)
        except master.TimeUp as error:
            raised.append(error)

    if inside == "main thread":
        run()
    elif inside == "background":  # of a script: Ctrl-C is not for it
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            run()
            assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
        finally:
            signal.signal(signal.SIGINT, before)
    else:
        thread = threading.Thread(target=run)
        thread.start()
        thread.join()
    error = raised[0]
    assert "time limit, 0.05 s" in str(error) and str(path) in str(error)
    assert len(master.read(path)[0]) == error.result.steps + 1 and error.result.steps >= (1 if inside == "another thread" else 3)
    with pytest.raises(master.DescriptionError, match="seconds above zero"):
        master.run(description, max_time=0.0)
