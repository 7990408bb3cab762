"""Whose a log is and when it was recorded, by its name."""

import pytest

from selflock.diagnosis import DataError
from selflock.diagnosis.tracking.logs import logs_of


def put(folder, *paths):
    for path in paths:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text("time\n0\n")
    return folder


def told(folder, pattern=""):
    return [(one.unit, one.recorded, one.path) for one in logs_of(folder, pattern)]


def test_a_folder_for_each_unit_and_dates_in_names(tmp_path):
    put(
        tmp_path,
        "7/run_2026-05-31_a.csv",
        "7/20260401T1230.csv",
        "7/warm.csv",
        "b/x 2026-05.mat",
        "7/notes.md",
        "top.csv",
        "7/a/deep.csv",
    )
    assert told(tmp_path) == [
        ("7", "", "7/warm.csv"),
        ("7", "2026-04-01T12:30:00", "7/20260401T1230.csv"),
        ("7", "2026-05-31T00:00:00", "7/run_2026-05-31_a.csv"),
        ("b", "2026-05-01T00:00:00", "b/x 2026-05.mat"),
    ]


def test_a_pattern_says_it_otherwise(tmp_path):
    put(tmp_path, "2026-05-31/drive (3).csv", "2026-06-30/drive (3).csv", "2026-06-30/other.csv")
    assert told(tmp_path, "{date}/drive ({unit}).csv") == [
        ("3", "2026-05-31T00:00:00", "2026-05-31/drive (3).csv"),
        ("3", "2026-06-30T00:00:00", "2026-06-30/drive (3).csv"),
    ]


def test_what_is_no_date_is_none(tmp_path):
    put(tmp_path, "7/serial_20269999.csv", "7/1234567890.csv")
    assert [date for _, date, _ in told(tmp_path)] == ["", ""]


@pytest.mark.parametrize(
    "pattern, words",
    [
        ("", "no log in it fits"),
        ("{date}.csv", "write {unit} once"),
        ("{unit}-{unit}.csv", "write {unit} once"),
        ("x{unit}", "there is top.csv"),
    ],
)
def test_slips_are_told(tmp_path, pattern, words):
    with pytest.raises(DataError, match=words):
        logs_of(put(tmp_path, "top.csv"), pattern)
