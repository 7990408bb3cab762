"""Tables of results, in memory and in files."""

import math
import tracemalloc

import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet

from selflock import master
from selflock.master import files, results, simulation


def table_of(system, out=None, **run):
    parts = {"t": ("Types", {"flag": True, "count": 1, "word": 'x, "y"'}), "m": ("Mass", {"force": 1 / 3})}
    return master.run(system(parts, stop=1.0, step=0.01, **run), out=out)


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".CSV"])
def test_a_file_holds_the_same_as_memory(system, tmp_path, ending):
    path = tmp_path / "deep" / f"table{ending}"
    inside, written = table_of(system), table_of(system, out=path)
    table, units = master.read(path)
    pd.testing.assert_frame_equal(table, inside.table, check_exact=True, check_dtype=False)
    assert [d.kind for d in table.dtypes][:4] == ["f", "b", "i", table.dtypes.iloc[3].kind]
    pd.testing.assert_frame_equal(written.table, table)
    assert units == inside.units == written.units
    assert units["m.v"] == "m/s" and units["time"] == "s" and units["t.word_out"] == ""
    assert written.path == path
    for name in ("time", "t.flag_out", "t.count_out", "m.v"):  # before the table and behind it, as floats
        told = [one.column(name) for one in (table_of(system), inside, written)]
        assert all(x.dtype == float and np.array_equal(x, table[name].to_numpy(float)) for x in told)


def test_whole_numbers_stay_reals_in_csv(system, tmp_path):
    master.run(system({"i": ("Integrator", {"u": 1.0})}, stop=2.0, step=1.0), out=tmp_path / "t.csv")
    assert master.read(tmp_path / "t.csv")[0]["i.y"].dtype == float


def test_the_header_of_a_csv_carries_units(system, tmp_path):
    table_of(system, out=tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text().splitlines()[0] == "time [s],t.flag_out,t.count_out,t.word_out,m.x [m],m.v [m/s]"


def test_only_the_interval_is_recorded(system):
    assert table_of(system, interval=0.1).table["time"].to_numpy() == pytest.approx(np.linspace(0, 1, 11))


@pytest.mark.alike
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_long_run_is_written_in_pieces(system, tmp_path, ending, monkeypatch):
    sizes = []
    kind = files.FILES[f".{ending}"]
    put = kind.put
    monkeypatch.setattr(kind, "put", lambda self, frame: (sizes.append(len(frame)), put(self, frame)))
    path = tmp_path / f"long.{ending}"
    master.run(system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=1e-4), out=path)
    assert sum(sizes) == 10001 and len(sizes) >= 3 and max(sizes) <= results.ROWS
    assert master.read(path)[0]["i.y"].to_numpy() == pytest.approx(np.linspace(0, 1, 10001))
    kept = master.run(system({"i": ("Integrator", {"u": 1.0})}, stop=1.0, step=1e-4))  # in memory in as many
    assert np.array_equal(kept.column("i.y"), kept.table["i.y"]) and len(kept.table) == 10001


def test_what_cannot_be_written_or_read(system, tmp_path):
    def refused(call, word):
        with pytest.raises(master.ResultError, match=word):
            call()

    (tmp_path / "file").write_text("")
    (tmp_path / "bad.parquet").write_text("no parquet")
    refused(lambda: table_of(system, out=tmp_path / "t.xlsx"), ".csv or .parquet")
    refused(lambda: table_of(system, out=tmp_path / "file" / "t.csv"), "cannot be written")
    refused(lambda: master.read(tmp_path / "none.csv"), "no result file")
    refused(lambda: master.read(tmp_path / "bad.parquet"), "no table of results")
    refused(lambda: master.read(tmp_path / "file"), ".csv or .parquet")


@pytest.mark.parametrize("ending", [None, ".csv", ".parquet"])
def test_a_failure_keeps_the_results_so_far(system, tmp_path, ending):
    path = tmp_path / f"t{ending}" if ending else None
    description = system({"f": ("Fragile", {"u": 1.0}), "g": "Gain"}, {"g.u": "f.y"}, stop=1.0, step=0.01)
    with pytest.raises(master.PartFailed) as caught:
        master.run(description, out=path)
    message = str(caught.value)
    for words in (
        "f answered Error at t = 0.5 s (step 0.01 s)",
        "the shaft broke",
        "u = 1",
        "try: a thicker shaft",
        "until t = 0.5 s",
    ):
        assert words in message
    assert (str(path) if path else "`result`") in message
    table = master.read(path)[0] if path else caught.value.result.table
    assert table["time"].to_numpy() == pytest.approx(np.arange(51) * 0.01)
    assert caught.value.result.time == 0.5


def test_a_value_that_is_no_number_ends_the_run(system):
    description = system(
        {"i": "Integrator", "g": ("Gain", {"gain": 1e3, "shift": 1.0})}, {"i.u": "g.y", "g.u": "i.y"}, stop=1000.0, step=1.0
    )
    with pytest.raises(master.PartFailed, match=r"answered (inf|nan) at t = "):
        master.run(description)


def test_the_summary_tells_what_a_person_wants(system, tmp_path):
    text = table_of(system, out=tmp_path / "t.csv").summary()
    assert "1 s in 100 steps" in text and "t.csv" in text


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_memory_does_not_grow_with_what_is_written(system, tmp_path, ending):
    def peak(stop):
        tracemalloc.start()
        master.run(
            system({"i": ("Integrator", {"u": 1.0}), "m": ("Mass", {"force": 0.0}, {"step": 10.0})}, stop=stop, step=1e-3),
            out=tmp_path / f"t.{ending}",
        )
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(4.0)  # long enough for the compiled loop to be loaded
    long = 80.0 if ending == "parquet" else 20.0  # both halves hold whole row groups
    assert peak(long) < peak(long / 2) + 100_000  # 10000 rows of 4 numbers more are 320 kB if they were kept
    if ending == "parquet":  # what its writer keeps grows with the row groups
        assert parquet.ParquetFile(tmp_path / "t.parquet").num_row_groups == 2


def test_what_a_name_holds_breaks_no_line_of_the_summary(system):
    description = system({"i": "Integrator"}, open_inputs=True, stop=0.1)
    lines = master.run(description).summary().splitlines()
    description.name = "one\nerror: two\x1b[2J"
    told = master.run(description).summary()
    assert len(told.splitlines()) == len(lines) and told.startswith(r"one\nerror: two\x1b[2J: 0.1 s")


@pytest.mark.parametrize("worth", [math.inf, 0])
@pytest.mark.parametrize("ending", [None, ".csv", ".parquet"])
def test_an_interval_thins_rows_and_neither_peaks_nor_the_end(native, monkeypatch, tmp_path, ending, worth):
    """A peak between two rows was in no summary, and an end that the interval does not meet in no table."""
    monkeypatch.setattr(simulation, "WORTH", worth)
    run = {"step": 0.001, "stop": 5.0, "algorithm": "gauss-seidel"}  # more steps than are in memory at once
    parts = {"a": {"fmu": native("oscillator"), "start": {"force": 1.0}}}
    found = []
    for interval, name in ((0.0, "all"), (0.3, "some")):
        system = master.from_dict({"run": {**run, "interval": interval, "open_inputs": True}, "components": parts})
        found.append(master.run(system, out=tmp_path / f"{name}{ending}" if ending else None))
    every, some = found
    assert some.steps == every.steps > results.ROWS
    pd.testing.assert_frame_equal(some.peaks, every.peaks)
    kept = every.table.iloc[[*range(0, 5000, 300), 5000]].reset_index(drop=True)
    pd.testing.assert_frame_equal(some.table, kept)
    assert some.peaks.greatest["a.position"] > 1.001 * some.table["a.position"].max()  # it lies between rows


def test_a_run_that_ends_before_its_stop_keeps_its_end_at_any_interval(system):
    tired = master.run(system({"t": "Tired", "m": "Mass"}, stop=1.0, step=0.1, interval=0.4, open_inputs=True))
    assert tired.table["time"].tolist() == pytest.approx([0.0, 0.4, 0.5])
    with pytest.raises(master.PartFailed) as caught:
        master.run(system({"f": ("Fragile", {"u": 1.0})}, stop=1.0, step=0.1, interval=0.4))
    assert caught.value.result.table["time"].tolist() == pytest.approx([0.0, 0.4, 0.5])


@pytest.mark.parametrize("record", [["l.y"], ["l.*"], ["*"]])
def test_what_is_no_number_ends_a_run_whether_or_not_it_is_recorded(system, record):
    """Nobody saw it, or the input that it went into was named."""
    parts = {"l": ("Listener", {"w": 0.0}), "i": ("Integrator", {"u": 1.0}), "r": ("Rooted", {"b": 0.0})}
    made = system(parts, {"r.a": "i.y", "l.u": "r.y"}, stop=5.0, step=0.01, record=record)
    with pytest.raises(master.PartFailed, match=r"^r\.y answered nan at t = 2\.") as caught:  # beyond the root of 5
        master.run(made)
    assert caught.value.time < np.sqrt(5.0) + 0.01 * 17
    assert caught.value.result.table["time"].iloc[-1] == pytest.approx(caught.value.result.time)


def test_texts_at_an_interval(system):
    every, some = table_of(system).table, table_of(system, interval=0.3).table
    pd.testing.assert_frame_equal(some, every.iloc[[0, 30, 60, 90, 100]].reset_index(drop=True))
