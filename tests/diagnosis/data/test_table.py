"""Files as strangers write them: each of these stopped somebody. The same drive, told in each form, must be read as the same numbers."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import scipy.io

from selflock.diagnosis import DataError
from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.gathered import gathered
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.table import table

N = 400
T = np.arange(N) * 0.01
W, M = 30.0 * np.sin(3.0 * T), 0.2 * np.cos(3.0 * T) + 0.05 * np.sign(np.sin(3.0 * T))
RIG = """
[rig]
kind = "inverse"
[time]
{time}
[columns]
"reducer.input_speed" = {{ {speed} }}
"motor.torque" = {{ {torque} }}
[parameters]
"reducer.gear_ratio" = 50.0
"""


def rig(folder, time='column = "time"', speed='column = "n"', torque='column = "m"'):
    path = folder / "rig.toml"
    path.write_text(RIG.format(time=time, speed=speed, torque=torque), encoding="utf-8")
    return rigs.load(path)


def lines(separator=",", comma=False, digits=6):
    rows = [separator.join(f"{v:.{digits}f}" for v in row) for row in zip(T, W, M)]
    return [row.replace(".", ",") for row in rows] if comma else rows


def preamble(count=13):
    words = [
        "Motion Manager export;;",
        "Drive;MCBL 3006;V2.5",
        "Date;12.03.2026 14:05;",
        "Sample time;10;ms",
        "Node;1;",
        "",
        "Remark;none;",
    ]
    return [words[k % len(words)] for k in range(count)]


TEXTS = {
    "preamble": preamble() + ["time;n;m"] + lines(";", comma=True),
    "units row": ["time;n;m", "s;rad/s;N.m"] + lines(";", comma=True),
    "units row in brackets": ["time\tn\tm", "[s]\t[rad/s]\t[N.m]"] + lines("\t"),
    "comment": ["# made by a logger", "# time n m"] + lines(" "),
    "blanks": ["  time   n   m"] + ["  " + row.replace(" ", "   ") for row in lines(" ")],
    "trailing": ["time,n,m,"] + [row + "," for row in lines()],
    "quoted": ['"time","n","m"'] + [",".join(f'"{v}"' for v in row.split(",")) for row in lines()],
    "bar": ["time|n|m"] + lines("|"),
    "end of header": ["LabVIEW Measurement", "Separator\tTab", "***End_of_Header***", "", "time\tn\tm\tComment"] + lines("\t"),
}


@pytest.mark.parametrize("how", TEXTS)
def test_text_is_read_however_it_is_written(how, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(TEXTS[how]) + "\n")
    (run,) = read(path, rig(tmp_path))
    np.testing.assert_allclose(run.time, T, atol=1e-9)
    np.testing.assert_allclose(run.signals["reducer.input_speed"], W, atol=1e-6)
    np.testing.assert_allclose(run.signals["motor.torque"], M, atol=1e-6)


def test_windows_letters_and_utf16_are_letters(tmp_path):
    text = "\n".join(["time;n [°/s];m"] + lines(";", comma=True)) + "\n"
    for encoding in ("cp1252", "utf-16", "utf-8-sig"):
        (tmp_path / "log.csv").write_bytes(text.encode(encoding))
        assert list(table(tmp_path / "log.csv").columns) == ["time", "n [°/s]", "m"], encoding


def test_a_wrong_cell_is_told_by_the_line_of_the_file(tmp_path):
    rows = preamble() + ["time;n;m"] + lines(";", comma=True)
    rows[20] = rows[20].rpartition(";")[0] + ";OVERFLOW"
    (tmp_path / "log.csv").write_text("\n".join(rows))
    with pytest.raises(DataError, match="line 21, column 'm': 'OVERFLOW' is not a number"):
        read(tmp_path / "log.csv", rig(tmp_path))


def test_no_header_gives_columns_by_number(tmp_path):
    (tmp_path / "log.txt").write_text("\n".join(lines(" ")))
    (run,) = read(tmp_path / "log.txt", rig(tmp_path, 'column = "1"', 'column = "2"', 'column = "3"'))
    np.testing.assert_allclose(run.signals["motor.torque"], M, atol=1e-6)


def _records():
    return [{"t": float(t), "motor": {"n": float(w)}, "m": float(m)} for t, w, m in zip(T, W, M)]


def _array(file, name, every):
    """An array of structures as MATLAB 7.3 has it."""
    import h5py

    for field in every[0]:
        table = file.create_dataset(f"{name}/{field}", (len(every), 1), dtype=h5py.ref_dtype)
        for k, one in enumerate(every):
            text = isinstance(one[field], str)
            value = np.array([[ord(c)] for c in one[field]], np.uint16) if text else one[field]
            held = file.create_dataset(f"#refs#/{name}{field}{k}", data=value)
            held.attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
            table[k, 0] = held.ref


def _write(path, how):
    matrix = np.column_stack([T, W, M])
    if how == "matrix.mat":
        scipy.io.savemat(path, {"data": matrix, "Ts": 0.01})
        return "data.1", "data.2", "data.3"
    if how == "lying.mat":
        scipy.io.savemat(path, {"t": T[None], "y": np.vstack([W, M])})
        return "t", "y.1", "y.2"
    if how == "struct.mat":
        scipy.io.savemat(path, {"log": {"t": T, "sig": {"n": W, "m": M}}})
        return "log.t", "log.sig.n", "log.sig.m"
    if how == "scope.mat":  # Simulink's "structure with time"
        signals = np.zeros(2, [("values", "O"), ("dimensions", "O"), ("label", "O")])
        signals[:] = [(W[:, None], 1.0, "omega [rad/s]"), (M[:, None], 1.0, "torque")]
        scipy.io.savemat(path, {"scope": {"time": T[:, None], "signals": signals, "blockName": "model/Scope"}})
        return "scope.time", "scope.signals.omega [rad/s]", "scope.signals.torque"
    if how == "unlabelled.mat":
        signals = np.zeros(2, [("values", "O"), ("label", "O")])
        signals[:] = [(W, ""), (M, "")]
        scipy.io.savemat(path, {"t": T, "signals": signals})
        return "t", "signals.1", "signals.2"
    if how == "ros.jsonl":
        stamps = [{"sec": int(t), "nanosec": round(1e9 * (t - int(t)))} for t in T]
        rows = [{"header": {"stamp": s}, "n": float(w), "m": float(m)} for s, w, m in zip(stamps, W, M)]
        path.write_text("\n".join(json.dumps(row) for row in rows))
        return "header.stamp", "n", "m"
    if how == "labview.lvm":
        head = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t.", "***End_of_Header***", "", "Channels\t2",
                f"Samples\t{N}\t{N}", "Y_Unit_Label\tdeg/s\tmN.m", "Delta_X\t0.01\t0.01", "***End_of_Header***", "X_Value\tn\tm\tComment"]  # fmt: skip
        rows = [f"{t:.2f}\t{np.degrees(w):.17g}\t{1000.0 * m:.17g}\t" for t, w, m in zip(T, W, M)]
        path.write_text("\n".join([*head, *rows]))
        return "X_Value", "n", "m"
    if how == "7.3.mat":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w", userblock_size=512) as file:
            file["log/t"], file["log/y"] = T[None], np.vstack([W, M]).T
            file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "x")
        return "log.t", "log.y.1", "log.y.2"
    if how == "scope7.3.mat":  # an array of structures, as dSPACE records, in version 7.3: tables of references
        with pytest.importorskip("h5py").File(path, "w", userblock_size=512) as file:
            file["X/Data"] = T[None]
            _array(file, "Y", [{"Name": "omega", "Unit": "rad/s", "Data": W[None]}, {"Name": "torque", "Unit": "N.m", "Data": M[None]}])  # fmt: skip
        return "X.Data", "Y.omega [rad/s]", "Y.torque [N.m]"
    if how == "columns.json":
        path.write_text(json.dumps({"info": {"kp": 3}, "t": T.tolist(), "n": W.tolist(), "m": M.tolist()}))
        return "t", "n", "m"
    if how == "records.json":
        path.write_text(json.dumps(_records()))
        return "t", "motor.n", "m"
    if how == "entries.json":
        path.write_text(json.dumps({"kp": 100, "entries": [{"t": r["t"], "y": [r["motor"]["n"], r["m"]]} for r in _records()]}))
        return "t", "y.1", "y.2"
    if how == "lines.jsonl":
        path.write_text("\n".join(json.dumps(r) for r in _records()))
        return "t", "motor.n", "m"
    if how == "plain.npy":
        np.save(path, matrix)
        return "1", "2", "3"
    if how == "named.npy":
        np.save(path, np.array([tuple(row) for row in matrix], dtype=[("t", "f8"), ("n", "f8"), ("m", "f8")]))
        return "t", "n", "m"
    if how == "several.npz":
        np.savez(path, t=T, y=matrix[:, 1:])
        return "t", "y.1", "y.2"
    if how == "lists.parquet":
        pd.DataFrame({"t": T, "y": [[float(a), float(b)] for a, b in zip(W, M)]}).to_parquet(path)
        return "t", "y.1", "y.2"
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.create_sheet("notes").append(["made by hand"])
    book.active.append(["Drive test", None, None])
    book.active.append([])
    book.active.append(["t", "n", "m"])
    book.active.append(["s", "rad/s", "N.m"])
    for row in matrix:
        book.active.append([float(v) for v in row])
    book.save(path)
    return "t", "n", "m"


FORMS = ["matrix.mat", "lying.mat", "struct.mat", "7.3.mat", "columns.json", "records.json", "entries.json", "lines.jsonl", "plain.npy",
         "named.npy", "several.npz", "lists.parquet", "book.xlsx", "scope.mat", "unlabelled.mat", "scope7.3.mat", "ros.jsonl", "labview.lvm"]  # fmt: skip


@pytest.mark.parametrize("how", FORMS)
def test_other_forms_give_the_same_channels(how, tmp_path):
    time, speed, torque = _write(tmp_path / how, how)
    (run,) = read(tmp_path / how, rig(tmp_path, f'column = "{time}"', f'column = "{speed}"', f'column = "{torque}"'))
    np.testing.assert_allclose(run.time, T, atol=1e-9)
    np.testing.assert_allclose(run.signals["reducer.input_speed"], W, atol=1e-12)
    np.testing.assert_allclose(run.signals["motor.torque"], M, atol=1e-12)


@pytest.mark.parametrize("version", ["7.3", "5"])
def test_an_array_of_structures_with_times_of_their_own_is_runs(version, tmp_path):
    cut = [slice(0, 150), slice(150, 400)]
    every = [{"t": T[part] - T[part.start], "n": W[part], "m": M[part]} for part in cut]
    path = tmp_path / "runs.mat"
    if version == "5":
        runs = np.zeros(2, [(name, "O") for name in "tnm"])
        runs[:] = [tuple(one.values()) for one in every]
        scipy.io.savemat(path, {"log": runs})
    else:
        with pytest.importorskip("h5py").File(path, "w", userblock_size=512) as file:
            _array(file, "log", every)
    given = rig(tmp_path, 'column = "log.t"', 'column = "log.n"', 'column = "log.m"')
    found = read(path, replace(given, run="log.run"))
    assert [len(run) for run in found] == [150, 250] and [run.time[0] for run in found] == [0.0, 0.0]
    np.testing.assert_array_equal(np.concatenate([run.signals["reducer.input_speed"] for run in found]), W)


def test_cells_and_nested_structures_of_7_3_have_names(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as file:
        file["#refs#/a"], file["#refs#/b"] = T[None], W[None]
        cells = file.create_dataset("cells", (2, 1), dtype=h5py.ref_dtype)
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
        cells[0, 0], cells[1, 0] = file["#refs#/a"].ref, file["#refs#/b"].ref
        file["log/motor/torque"] = M[None]
    assert list(table(tmp_path / "log.mat")) == ["cells.1", "cells.2", "log.motor.torque"]


def test_a_page_is_no_log(tmp_path):
    (tmp_path / "log.csv").write_text("\n<!DOCTYPE html>\n<html><body>Please log in</body></html>\n" * 40)
    with pytest.raises(DataError, match="holds a page or XML, and no table"):
        table(tmp_path / "log.csv")


def test_what_would_run_or_burst_is_refused(tmp_path, monkeypatch):
    np.save(tmp_path / "objects.npy", np.array([{"a": 1}], object), allow_pickle=True)
    with pytest.raises(DataError, match="cannot be read as .npy"):
        table(tmp_path / "objects.npy")
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", bytes(1 << 21))
    monkeypatch.setattr("selflock.diagnosis.data.table.LARGEST", 1 << 20)
    with pytest.raises(DataError, match="holds more than"):
        table(tmp_path / "bomb.npz")
    (tmp_path / "deep.json").write_text("[" * 100_000)
    with pytest.raises(DataError, match="deep.json"):
        table(tmp_path / "deep.json")
    with pytest.raises(DataError, match="before 2007"):
        (tmp_path / "old.xls").write_bytes(b"x")
        table(tmp_path / "old.xls")


def test_small_files_that_hold_much_take_no_memory(tmp_path, monkeypatch):
    """Limits are said of what a file becomes: numbers repeated, or compressed, or a cell far to the right, cost a file nothing."""
    wide = bytes(1 << 21)
    for name, most in (("LARGEST", 1 << 20), ("LARGEST_PACKED", 1 << 20), ("LARGEST_BOOK", 100_000)):
        monkeypatch.setattr(f"selflock.diagnosis.data.table.{name}", most)
    pd.DataFrame({"time": np.zeros(1 << 18)}).to_parquet(tmp_path / "same.parquet")
    scipy.io.savemat(tmp_path / "same.mat", {"x": np.frombuffer(wide, np.int8)}, do_compression=True)
    pd.DataFrame({"time": [0.0] * 8}).to_excel(tmp_path / "far.xlsx", index=False)
    with zipfile.ZipFile(tmp_path / "far.xlsx") as good:
        held = {name: good.read(name) for name in good.namelist()}
    far = b"".join(b'<row r="%d"><c r="XFD%d"><v>1</v></c></row>' % (k, k) for k in range(20, 40))
    with zipfile.ZipFile(tmp_path / "far.xlsx", "w", zipfile.ZIP_DEFLATED) as bad:
        for name, content in held.items():
            bad.writestr(name, content.replace(b"</sheetData>", far + b"</sheetData>").replace(b"A1:A9", b"A1:XFD40"))
    for name in ("same.parquet", "same.mat", "far.xlsx"):
        assert (tmp_path / name).stat().st_size < 20_000
        with pytest.raises(DataError, match=f"{name}: (holds more than 1 MiB|has more than 100000 cells)"):
            table(tmp_path / name)


def test_groups_that_hold_themselves_are_looked_at_once(tmp_path):
    """40 links in each of six levels were 4e9 looks."""
    import h5py

    with h5py.File(tmp_path / "log.h5", "w") as file:
        group = file.create_group("g")
        group["time"] = T
        for k in range(40):
            group[f"again{k}"] = group
    assert list(table(tmp_path / "log.h5")) == ["g.time"]


def frame(**more):
    return pd.DataFrame({"time": T, "n": W, "m": M} | more)


def test_a_torque_in_percent_of_its_nominal_one(tmp_path):
    frame(m=M / 0.00984 * 100.0).rename(columns={"m": "m [%]"}).to_csv(tmp_path / "log.csv", index=False)
    (run,) = read(tmp_path / "log.csv", rig(tmp_path, torque='column = "m", nominal = 0.00984'))
    np.testing.assert_allclose(run.signals["motor.torque"], M, rtol=1e-12)
    with pytest.raises(DataError, match="say in rig.toml what 100 % is, as nominal = ... in N.m"):
        read(tmp_path / "log.csv", rig(tmp_path))
    with pytest.raises(DataError, match="say what 100 % is, as nominal"):
        rig(tmp_path, torque='column = "m", unit = "%"')
    with pytest.raises(DataError, match="A sign belongs in factor"):
        rig(tmp_path, torque='column = "m", unit = "%", nominal = -1.0')


def test_increments_are_read_by_their_factor(tmp_path):
    frame(n=W / 0.003).rename(columns={"n": "n [inc/s]"}).to_csv(tmp_path / "log.csv", index=False)
    (run,) = read(tmp_path / "log.csv", rig(tmp_path, speed='column = "n", factor = 0.003'))
    np.testing.assert_allclose(run.signals["reducer.input_speed"], W, rtol=1e-12, atol=1e-12)
    for factor in ("", ", factor = -1.0"):  # a sign does not say what one of them is
        with pytest.raises(DataError, match="unit 'inc/s' is not known.* or as factor what one of it is in rad/s"):
            read(tmp_path / "log.csv", rig(tmp_path, speed=f'column = "n"{factor}'))


def test_times_that_are_written_too_coarsely_are_spread_where_the_rig_says_so(tmp_path):
    coarse = frame(time=np.floor(T / 0.07) * 0.07)  # 86 % of them repeat
    coarse.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(DataError, match="write spread = true under .time."):
        read(tmp_path / "log.csv", rig(tmp_path))
    (run,) = read(tmp_path / "log.csv", rig(tmp_path, "spread = true"))
    assert len(run) == N and np.ptp(np.diff(run.time)) < 1e-9
    np.testing.assert_allclose(np.diff(run.time), 0.01, rtol=0.01)


def test_rows_that_are_written_again_say_nothing_new(tmp_path):
    """A recorder that is faster than the drive that it reads: all of a row is repeated, time too."""
    whole = frame()
    whole.loc[np.repeat(whole.index, 7)].to_csv(tmp_path / "log.csv", index=False)
    runs, faults = gathered(tmp_path / "log.csv", rig(tmp_path))
    np.testing.assert_allclose(runs[0].time, T, atol=1e-12)
    assert not [f for f in faults if f.kind == "repeated"]


STAMPS = {
    "iso": lambda t: (pd.Timestamp("2026-05-01 23:59:59") + pd.to_timedelta(t, "s")).strftime("%Y-%m-%d %H:%M:%S.%f"),
    "german": lambda t: (pd.Timestamp("2026-05-01 12:00:00") + pd.to_timedelta(t, "s")).strftime("%d.%m.%Y %H:%M:%S,%f"),
    "zone": lambda t: (pd.Timestamp("2026-05-01 12:00:00") + pd.to_timedelta(t, "s")).strftime("%Y-%m-%dT%H:%M:%S.%f+0200"),
    "time of day": lambda t: (pd.Timestamp("2026-05-01 23:59:59") + pd.to_timedelta(t, "s")).strftime("%H:%M:%S.%f"),
}


@pytest.mark.parametrize("how", STAMPS)
def test_dates_and_times_of_day_are_times(how, tmp_path):
    rows = [f"{STAMPS[how](t)};{w:.6f};{m:.6f}" for t, w, m in zip(T, W, M)]
    (tmp_path / "log.csv").write_text("\n".join(["time;n;m", *rows]))
    (run,) = read(tmp_path / "log.csv", rig(tmp_path))
    np.testing.assert_allclose(run.time, T, atol=2e-6)


def test_a_date_with_its_time_of_day_is_one_cell_between_tabs(tmp_path):
    """A blank would make as many numbers of each line, and other columns."""
    stamps = STAMPS["german"](T).str.replace(",", ".")
    pd.DataFrame({"Date/Time": stamps, "n [1/min]": W, "M [mNm]": M}).to_csv(tmp_path / "log.txt", sep="\t", index=False)
    assert list(table(tmp_path / "log.txt")) == ["Date/Time", "n [1/min]", "M [mNm]"]
    lines = (tmp_path / "log.txt").read_text().replace("\t", " ").splitlines()[1:]
    (tmp_path / "blanks.txt").write_text("\n".join(["day clock n m", *lines]))
    assert list(table(tmp_path / "blanks.txt")) == ["day", "clock", "n", "m"]


def test_a_log_without_a_time_has_the_rigs_step(tmp_path):
    frame().drop(columns="time").to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(DataError, match=r"\[time\] step = 0.001"):
        read(tmp_path / "log.csv", rig(tmp_path, ""))
    (run,) = read(tmp_path / "log.csv", rig(tmp_path, "step = 0.01"))
    np.testing.assert_allclose(run.time, T, atol=1e-12)


def test_a_start_transient_is_cut_by_time_or_by_rows(tmp_path):
    frame().to_csv(tmp_path / "log.csv", index=False)
    for said in ("from = 0.495", "skip = 50"):
        (run,) = read(tmp_path / "log.csv", rig(tmp_path, said))
        assert run.time[0] == pytest.approx(0.5) and run.rows[0] == 50 and len(run) == N - 50
    (run,) = read(tmp_path / "log.csv", rig(tmp_path, "from = 0.5\nto = 1.0"))
    assert run.time[-1] == pytest.approx(1.0)
    with pytest.raises(DataError, match="nothing is left of it"):
        read(tmp_path / "log.csv", rig(tmp_path, "from = 100.0"))
    with pytest.raises(DataError, match="ends before"):
        rig(tmp_path, "from = 3.0\nto = 1.0")


def test_a_filter_of_ones_own_keeps_the_motion_and_takes_the_ripple(tmp_path):
    """A ripple at 40 Hz is halved in power at the corner of a filter that goes forward and backward: 20 Hz leaves (1 + 2^4)^-1."""
    frame(n=W + 2.0 * np.sin(2.0 * np.pi * 40.0 * T)).to_csv(tmp_path / "log.csv", index=False)
    runs, _ = gathered(tmp_path / "log.csv", rig(tmp_path, "lowpass = 10.0"))
    inside = slice(40, -40)
    assert np.max(abs(runs[0].signals["reducer.input_speed"] - W)[inside]) < 0.05
    with pytest.raises(DataError, match="beyond what its rows show, 50 Hz"):
        gathered(tmp_path / "log.csv", rig(tmp_path, "lowpass = 60.0"))


def test_rows_are_made_fewer_by_their_mean(tmp_path):
    frame(m=np.where(np.arange(N) == 17, np.nan, M)).to_csv(tmp_path / "log.csv", index=False)
    runs, faults = gathered(tmp_path / "log.csv", rig(tmp_path, "every = 5"))
    run = runs[0]
    np.testing.assert_allclose(run.signals["reducer.input_speed"], W.reshape(-1, 5).mean(axis=1), atol=1e-9)
    np.testing.assert_allclose(run.time, T.reshape(-1, 5).mean(axis=1), atol=1e-12)
    assert not run.good["motor.torque"][3] and run.good["motor.torque"].sum() == N // 5 - 1
    assert [f.first for f in faults] == [17]


def test_an_angle_that_begins_anew_goes_on(tmp_path):
    angle = 400.0 * T
    frame(n=np.mod(angle, 360.0)).to_csv(tmp_path / "log.csv", index=False)
    path = tmp_path / "rig.toml"
    rig(tmp_path)
    path.write_text(
        path.read_text().replace(
            '"reducer.input_speed" = { column = "n" }', '"load.angle" = { column = "n", unit = "deg", wraps = 360.0 }'
        )
    )
    (run,) = read(tmp_path / "log.csv", rigs.load(path))
    np.testing.assert_allclose(run.signals["load.angle"], np.radians(angle), atol=1e-9)


def test_a_commanded_torque_may_rest_and_jump(tmp_path):
    """In long steps: unsaid, nearly all of it is faulty, for no measured torque rests while its shaft turns."""
    t = np.arange(8000) * 0.005
    torque = np.floor(t / 5.0) % 3 - 1.0
    speed = np.cumsum(torque) * 0.05 + 0.01 * np.sin(40.0 * t)
    pd.DataFrame({"time": t, "n": speed, "m": torque}).to_csv(tmp_path / "log.csv", index=False)
    _, before = gathered(tmp_path / "log.csv", rig(tmp_path))
    runs, faults = gathered(tmp_path / "log.csv", rig(tmp_path, torque='column = "m", commanded = true'))
    assert {f.kind for f in before} == {"frozen"} and not faults and runs[0].good["motor.torque"].all()
