"""Pages of results: what they carry, against closed forms; what is refused; what strangers write stays words."""

import base64
import json
import math
import re
import sys

import numpy as np
import pytest
from jinja2 import Environment
from lxml import html

from selflock import master
from selflock.master import Part, Variable, about, read
from selflock.master.errors import ResultError
from selflock.master.files import told
from selflock.vehicle import Robot
from selflock.view import page as pages
from selflock.view import shown, thin, view


def carried(page):
    """What a page's script has."""
    return json.loads(re.search(r"<script>const D = (.*?);\n", page.read_text("utf-8"))[1])


def numbers(column, rows):
    return np.full(rows, column["same"]) if "same" in column else np.frombuffer(base64.b64decode(column["values"]), "<f4")


def test_a_page_carries_time_and_columns_as_they_are(write, drive, tmp_path):
    page = view(write("a.parquet", drive()), tmp_path / "p.html")
    data = carried(page)
    (run,) = data["runs"]
    t = np.frombuffer(base64.b64decode(run["time"]), "<f8")
    assert np.array_equal(t, np.linspace(0.0, 4.0, 401))
    of = {one["name"]: one for one in run["columns"]}
    assert set(of) == set(drive()) - {"time"} and of["motor.torque"]["unit"] == "N.m"
    assert numbers(of["motor.torque"], 401) == pytest.approx(3.0 * np.sin(t), abs=1e-6)


def test_templates_are_read_once_on_a_machine(tmp_path, monkeypatch):
    monkeypatch.setenv("SELFLOCK_CACHE", str(tmp_path / "cache"))
    read_by_jinja = []
    compile_one = Environment.compile
    monkeypatch.setattr(Environment, "compile", lambda self, *given: read_by_jinja.append(given[1]) or compile_one(self, *given))
    first, again = (pages.environment("selflock.view").get_template("view.html.j2") for _ in range(2))
    assert read_by_jinja == ["view.html.j2"] and first.root_render_func.__code__ == again.root_render_func.__code__
    (kept,) = (tmp_path / "cache" / "pages").iterdir()
    kept.write_bytes(kept.read_bytes()[:-9] + b"torn here")
    pages.environment("selflock.view").get_template("view.html.j2")
    assert read_by_jinja == ["view.html.j2"] * 2


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_peaks_their_times_energies_and_limits(write, drive, limits, tmp_path, ending):
    page = view(write(f"a.{ending}", drive(), limits), tmp_path / "p.html")
    rows = {row[0]: row[1:] for row in table(page)}
    assert rows["motor.torque"][:2] == ["3 N·m", "1.57 s"]  # at a quarter turn
    assert rows["motor.power"] == ["4 W", "4 s", "–", "–", "8 J"]  # half of 4 s times 4 W
    current = ["4 A stall", "50 %"] if ending == "parquet" else ["–", "–"]  # a CSV file says nothing of limits
    assert rows["motor.current"] == ["2 A", "0 s", *current, "–"]
    assert ("Limits are not known" in page.read_text("utf-8")) == (ending == "csv")


def test_a_gap_has_no_peak_and_leaves_no_energy(write, drive, tmp_path):
    columns = drive()
    columns["motor.power"] = ("W", np.where(columns["time"][1] > 3.0, np.nan, columns["motor.power"][1]))
    rows = {row[0]: row[1:] for row in table(view(write("a.csv", columns), tmp_path / "p.html"))}
    assert rows["motor.power"] == ["3 W", "3 s", "–", "–", "–"]


def table(page):
    tree = html.fromstring(page.read_text("utf-8"))
    return [[" ".join(cell.text_content().split()) for cell in row] for row in tree.xpath("//table//tbody/tr")]


def test_two_runs_stand_beside_each_other(write, drive, tmp_path):
    page = view([write("a.parquet", drive()), write("b.csv", drive(2.0))], tmp_path / "p.html")
    rows = table(page)
    assert [row[:3] for row in rows[:2]] == [["motor.torque", "a.parquet", "3 N·m"], ["", "b.csv", "6 N·m"]]
    assert [run["label"] for run in carried(page)["runs"]] == ["a.parquet", "b.csv"]


def test_what_is_drawn_at_first(write, drive, tmp_path):
    path = write("a.parquet", drive())
    assert carried(view(path))["picked"][:3] == [
        "motor.torque",
        "motor.current",
        "motor.power",
    ]  # the gear's is 50 times as large
    assert carried(view(path, show=["gear.*"]))["picked"] == ["gear.output_torque", "gear.angle"]
    with pytest.raises(ResultError, match="--show geer: no column is called so. There are motor.torque"):
        view(path, show=["geer"])


def test_of_each_stretch_the_least_and_the_greatest(rng):
    x = rng.standard_normal(1003)
    x[200:260] = np.nan
    for every in (1, 2, 7, 100, 2000):
        kept, t = thin.values(x, every), thin.times(np.arange(1003.0), every)
        assert len(kept) == len(t) and (np.diff(t) >= 0.0).all() and (t[0], t[-1]) == (0.0, 1002.0)
        for k in range(0, 1003, every) if every > 1 else ():
            part, pair = x[k : k + every], kept[2 * (k // every) :][:2]
            if np.isnan(part).all():
                assert np.isnan(pair).all()
            else:
                assert sorted(pair) == [np.nanmin(part), np.nanmax(part)]
                assert (pair[0] == np.nanmin(part)) == (np.nanargmin(part) <= np.nanargmax(part))
    assert thin.stride(1000, 1000) == 1 and math.ceil(1001 / thin.stride(1001, 1000)) * 2 <= 1000


def test_a_page_does_not_grow_beyond_its_limit_and_says_so(write, drive, tmp_path, monkeypatch):
    monkeypatch.setattr(shown, "BUDGET", 30_000)
    monkeypatch.setattr(shown, "LEAST", 50)
    path = write("a.parquet", drive())
    page = view(path, tmp_path / "p.html")
    run = carried(page)["runs"][0]
    assert len(json.dumps(run)) < 31_000 and len(run["columns"]) == 5
    assert "rows: of each" not in page.read_text("utf-8")  # all 401 rows of 7 columns' room are there
    monkeypatch.setattr(shown, "BUDGET", 5_000)
    page = view(path, tmp_path / "p.html")
    run = carried(page)["runs"][0]
    assert len(json.dumps(run)) < 6_000
    assert len(base64.b64decode(run["columns"][0]["values"])) == 4 * 116  # 133 numbers fit, so that a stretch is 7 rows
    assert "of each 7 rows the least and the greatest value are drawn" in page.read_text("utf-8")
    monkeypatch.setattr(shown, "BUDGET", 1_500)
    assert "5 columns that vary; the first 3 are on the page" in view(path, tmp_path / "p.html").read_text("utf-8")


@pytest.mark.parametrize("content, words", [
    ("a,b\n1,2\n2,3\n", "no column `time`, in s. It has a, b."),
    ("time,b\n1,2\n", "one row"),
    ("time,b\n", "no row"),
    ("time,b\n0,nan\n1,nan\n", "no number beside its time"),
    ("time,b\n0,x\n1,y\n", "no number beside its time"),
    ("time,b\n0,1\n2,1\n1,1\n", "its time falls from 2 to 1 s at row 3"),
    ("time,b\n0,1\nnan,1\n1,1\n", "no number in row 2"),
    ("time,b\nnow,1\nthen,1\n", "column time holds what is no number"),
    ("time,b\n0,1,2\n1,1\n", "is no table of results"),
    ("", "is no table of results"),
])  # fmt: skip
def test_a_wrong_file_is_told_in_a_sentence(tmp_path, content, words):
    path = tmp_path / "x.csv"
    path.write_text(content)
    with pytest.raises(ResultError) as told:
        view(path)
    assert words in str(told.value) and "x.csv" in str(told.value) and "\n" not in str(told.value)


@pytest.mark.parametrize(
    "name, words", [("x.txt", "csv or .parquet"), ("no.csv", "no result file"), ("torn.parquet", "no table")]
)
def test_what_is_no_result_is_told(tmp_path, name, words):
    (tmp_path / "x.txt").write_text("time,b\n0,1\n")
    (tmp_path / "torn.parquet").write_bytes(b"PAR1\0\0\0")
    with pytest.raises(ResultError, match=words):
        view(tmp_path / name)
    with pytest.raises(ResultError, match="the page is an .html file"):
        view(master.run(master.from_dict(MOTOR)), tmp_path / "x.png")


def test_a_torn_last_line_is_left_out_and_told(write, drive, tmp_path, caplog):
    path = write("a.csv", drive())
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b",", 0, -30)])
    page = view(path)
    assert "The last line of a.csv is torn" in page.read_text("utf-8") and "torn" in caplog.text
    assert ", 400 rows" in page.read_text("utf-8")


def test_columns_without_numbers_are_named(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("time,word,none,x\n0,a,nan,1\n1,b,nan,\n")  # an empty cell is no word
    text = view(path).read_text("utf-8")
    assert "hold words: word." in text and "no number at all: none." in text and [c["name"] for c in carried(tmp_path / "x.html")["runs"][0]["columns"]] == ["x"]  # fmt: skip


MOTOR = {
    "system": {"name": "spin"},
    "run": {"stop": 0.01},
    "components": {
        "motor": {"fmu": "selflock:Motor", "start": {"voltage": 12.0}},
        "weight": {"fmu": "selflock:Load", "start": {"mass": 2.0, "arm": 0.3, "start_angle": 0.1}},
    },
    "connections": {"motor.speed": "weight.speed", "weight.torque": "motor.torque"},
}


def test_a_run_says_what_it_was_of_and_so_does_its_system(tmp_path):
    system = master.from_dict(MOTOR)
    result = master.run(system, out=tmp_path / "a.parquet")
    assert told(tmp_path / "a.parquet") == json.loads(json.dumps(result.about))
    assert result.about["system"] == "spin" and set(result.about["drawings"]) == {"weight"}
    (limit,) = result.about["limits"]
    assert (limit["column"], limit["voltage"], limit["high"]) == ("motor.current", 12.0, 12.0)
    columns = [master.Variable(name, unit) for name, unit in result.units.items()]
    assert about.of_system(master.from_dict(MOTOR), columns) == result.about  # without a run
    seen = about.seen_of(columns, result.about)
    table, _ = read(tmp_path / "a.parquet")
    seen.add(table.to_numpy())
    assert seen.lines() == result.sink.seen.lines()  # a page tells what the summary told


def test_a_weight_on_an_arm_moves(tmp_path):
    result = master.run(master.from_dict(MOTOR))
    (stage,) = carried(view(result, tmp_path / "p.html"))["stages"]
    (drawn,) = stage["of"]
    assert stage["label"] == "weight" and {"turn": {"weight.angle": 1.0}, "plus": 0.0} in drawn["shapes"][-1]["moves"]
    tip = drawn["shapes"][2]["points"][-1]
    assert tip == [0.3, 0.0]


class Ball(Part):
    """One that rolls, and says how it looks."""

    described = (Variable("x", "m", 0.0, causality="output", depends_on=()),)
    looks = {"width": 1.0, "shapes": [{"points": np.zeros((2, 2)), "style": "wheel", "moves": [{"shift": np.ones(2)}]}]}

    def drawing(self):
        return self.looks

    def step(self, time, size):
        self.values["x"] += size


def test_a_part_of_ones_own_says_how_it_looks(tmp_path, monkeypatch):
    system = master.from_dict({"run": {"stop": 0.01}, "components": {"ball": {"part": "test_view:Ball"}}})
    system.allow_code = True
    monkeypatch.setitem(sys.modules, "test_view", sys.modules[__name__])
    page = view(master.run(system, out=tmp_path / "a.parquet"), tmp_path / "p.html")
    assert carried(page)["stages"][0]["of"][0]["shapes"][0]["points"] == [[0.0, 0.0], [0.0, 0.0]]
    monkeypatch.setattr(Ball, "looks", {"width": object()})
    with pytest.raises(master.DescriptionError, match="ball: drawing\\(\\) gives what is no plain data"):
        master.run(system)


def test_angles_of_any_result_have_dials(write, drive):
    (stage,) = carried(view(write("a.csv", drive())))["stages"]
    assert [shape["label"] for shape in stage["of"][0]["shapes"] if "label" in shape] == ["gear.angle"]


BAD = [
    [],
    {"w": None},
    {"w": {"shapes": 3}},
    {"w": {"width": 1.0, "shapes": [{"points": [[0, 1, 2]], "style": "limb", "moves": []}]}},
    {"w": {"width": 1e400, "shapes": []}},
    {"w": {"width": -1.0, "shapes": []}},
    {"w": {"width": 1.0, "ground": [[1, 0], [0, 0]], "shapes": []}},
    {"w": {"width": 1.0, "shapes": [{"points": [[0, 0]], "style": "limb", "moves": [{"turn": {"nothing": 1.0}}]}]}},
    {"w": {"width": 1.0, "shapes": [{"points": [], "style": "track", "moves": [], "runs": {"by": {}, "per": 1.0, "pitch": 0}}]}},
]


@pytest.mark.parametrize("drawings", BAD)
def test_a_drawing_that_is_none_is_not_drawn(write, drive, drawings):
    said = {
        "drawings": drawings,
        "limits": [3, {"name": 1}, {"name": "m", "column": "motor.current", "high": "x"}, {"name": "m", "column": []}],
        "remarks": 7,
        "inputs": [[]],
    }
    text = view(write("a.parquet", drive(), said)).read_text("utf-8")
    assert not any("w" == stage["label"] for stage in json.loads(re.search(r"const D = (.*?);\n", text)[1])["stages"])


def test_names_of_strangers_stay_words(write, hostile, harmless, tmp_path):
    t = np.linspace(0.0, 1.0, 11)
    drawing = {
        "width": 1.0,
        "shapes": [{"points": [[0, 0]], "style": "limb", "moves": [], "label": hostile, "foot": [0, 0], "room": 1.0}],
    }
    said = {"system": hostile, "remarks": [hostile, "{0.__class__}"], "drawings": {hostile: drawing}}
    path = write("a.parquet", {"time": ("s", t), f"{hostile}.{hostile}": (hostile, t), "m.torque": ("N.m", t)}, said)
    tree = harmless(view(path), scripts=1)
    assert hostile in tree.text_content() and tree.xpath("//title/text()") == [hostile]
    assert "{0.__class__}" in tree.text_content()


def test_a_time_is_in_the_unit_that_its_header_says(tmp_path):
    (tmp_path / "a.csv").write_text("time [ms];x [V]\n0;0,5\n250;0,7\n500;1,5\n")
    assert "0 to 0.5 s, 3 rows" in view(tmp_path / "a.csv", tmp_path / "p.html").read_text()


@pytest.mark.parametrize("first", ["N.m", "mN.m"])
def test_the_same_signal_in_other_units_is_drawn_in_that_of_the_first(write, tmp_path, first):
    """Numbers of mN.m lay on the axis of N.m, a thousand times as large, and had no peak."""
    t = np.linspace(0.0, 1.0, 50)
    tables = {"N.m": ("a", 2.0 * t), "mN.m": ("b", 2000.0 * t)}
    order = sorted(tables, key=lambda unit: unit != first)
    files = [write(f"{tables[u][0]}.csv", {"time": ("s", t), "m.torque": (u, tables[u][1])}) for u in order]
    page = view(files, tmp_path / "p.html")
    one, other = (run["columns"][0] for run in carried(page)["runs"])
    assert one["unit"] == other["unit"] == first
    assert numbers(other, 50) == pytest.approx(numbers(one, 50), rel=1e-6)
    peak = "2 N·m" if first == "N.m" else "2000 mN·m"
    assert [row[2] for row in table(page)] == [peak, peak]


def test_what_cannot_be_converted_keeps_its_unit_and_what_has_none_is_noted(write, tmp_path):
    t = np.linspace(0.0, 1.0, 50)
    units = {"a": ("N.m", "rad"), "b": ("A", "deg"), "c": ("", "quux")}
    files = [write(f"{name}.csv", {"time": ("s", t), "x": (x, t), "y": (y, 180.0 * t)}) for name, (x, y) in units.items()]
    page = view(files, tmp_path / "p.html")
    data = carried(page)["runs"]
    assert [[column["unit"] for column in run["columns"]] for run in data] == [["N.m", "rad"], ["A", "rad"], ["N.m", "quux"]]
    assert numbers(data[1]["columns"][1], 50) == pytest.approx(np.pi * t, abs=1e-6)
    assert "c.csv says no unit of x: drawn as if in that of the others." in page.read_text("utf-8")


def test_a_limit_is_held_against_the_numbers_that_it_was_written_for(write, drive, limits, tmp_path):
    columns = drive()
    small = columns | {"motor.current": ("mA", 1000.0 * columns["motor.current"][1])}
    page = view([write("a.csv", small), write("b.parquet", columns, limits)], tmp_path / "p.html")
    row = next(row for row in table(page) if "b.parquet" in row and "stall" in row[4])
    assert row[2:6] == ["2000 mA", "0 s", "4000 mA stall", "50 %"]


def test_what_moves_a_drawing_stays_in_the_unit_that_it_was_written_in(write, rolling, tmp_path):
    other = {name: ("mm" if unit == "m" else unit, x) for name, (unit, x) in rolling().items()}
    said = {"drawings": {"robot": Robot("robot").drawing()}}
    page = view([write("a.csv", other), write("b.parquet", rolling(), said)], tmp_path / "p.html")
    assert {column["unit"] for column in carried(page)["runs"][1]["columns"]} >= {"m"}
