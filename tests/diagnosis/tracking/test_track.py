"""Diagnoses on disk become a page, a table, sentences and an exit code."""

import json
from datetime import date, timedelta

import pandas as pd
import pytest
from typer.testing import CliRunner

from selflock.cli import app
from selflock.diagnosis import DataError, track


def test_a_change_is_a_sentence_and_an_exit_code(drawn, tmp_path):
    page = tmp_path / "page.html"
    answer = CliRunner().invoke(app, ["track", str(drawn(worn={3: 0.4})), "-o", str(page)])
    assert answer.exit_code == 5, answer.output
    assert "1 of 8 units changed beyond chance" in answer.output
    (line,) = [line for line in answer.output.splitlines() if "unit unit 3" in line]
    assert "reducer.viscous_damping +" in line and "N·m·s/rad" in line
    began = date.fromisoformat(
        line.partition("since ")[2][:10]
    )  # a log's date: that of May 1, of its neighbour in 1 of 3000 draws
    assert abs(began - date(2026, 5, 1)) <= timedelta(days=30)
    table = pd.read_csv(page.with_suffix(".csv"))
    assert len(table) == 80 and set(table["unit"]) == {f"unit {k}" for k in range(8)}


def test_what_was_before_a_repair_is_left_out(drawn):
    folder = drawn(worn={3: 0.4})
    with_it, without = track(folder, None), track([folder], None, since="2026-08-01")
    assert with_it.exit_code == 5 and with_it.page is None
    assert without.exit_code == 0 and "64 diagnoses of what was recorded before 2026-08-01 are left out." in without.notes
    assert any("fewer than 4 values" in note for note in without.notes)


def test_a_log_counts_once(drawn, tmp_path):
    folder = drawn(units=2, told_by="file")
    twice = tmp_path / "again"
    twice.mkdir()
    (twice / "diagnosis.json").write_text((folder / "1" / "3" / "diagnosis.json").read_text())
    found = track([folder, twice], None)
    assert len(found.diagnoses.table) == len(found.diagnoses.values) == 20
    assert found.notes[0].startswith("1 logs were diagnosed more than once")
    assert "20 of 20 dates are when a file was last changed" in found.notes[1]


def test_the_page_runs_its_own_script_alone_and_names_stay_words(drawn, tmp_path, harmless, hostile):
    page = tmp_path / "page.html"
    track(drawn(units=3, name=hostile + "{}"), page)
    tree = harmless(page, scripts=1)
    assert any(hostile in text for text in tree.xpath("//td/text()"))


@pytest.mark.parametrize(
    "change, words",
    [
        ({"about": None}, "does not say when its logs were recorded"),
        ({"causes": 3}, "is not what a diagnosis writes"),
        ({"uncertain": [{"name": "x"}]}, "is not what a diagnosis writes"),
    ],
)
def test_files_of_others_are_told(drawn, change, words):
    file = drawn(units=1, months=1) / "0" / "0" / "diagnosis.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    with pytest.raises(DataError, match=words):
        track(file.parent, None)


def test_what_cannot_be_tracked_is_told(tmp_path):
    with pytest.raises(DataError, match="is no folder"):
        track(tmp_path / "none", None)
    with pytest.raises(DataError, match="there is no diagnosis"):
        track(tmp_path, None)
    with pytest.raises(DataError, match="is no date"):
        track(tmp_path, None, since="May")


@pytest.mark.parametrize("units, months, told", [(2, 6, True), (12, 12, False)])
def test_of_few_logs_it_is_told_how_far_a_change_has_to_go(units, months, told, drawn):
    summary = track(drawn(units=units, months=months), None).summary()
    assert ("So few logs tell little: beyond chance is a change of " in summary) == told
