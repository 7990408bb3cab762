"""The page in a real browser: it opens, plays, is picked from, zoomed, and nothing is cut or complained of."""

import numpy as np
import pytest

from selflock.diagnosis import track
from selflock.diagnosis.data.finding import Finding
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.data.sanity import Box
from selflock.diagnosis.pipeline.replay import Comparison, Replay
from selflock.vehicle import Robot
from selflock.view import view
from selflock.view.figures import axis, line

from ..diagnosis.tracking.drawn import write as write_fleet

pytestmark = pytest.mark.slow

OUTSIDE = """[...document.querySelectorAll('main *')].filter(e => !e.closest('.wide, .stage, .plot, details:not([open])'))
    .filter(e => { const r = e.getBoundingClientRect(); return r.width && (r.left < -1 || r.right > innerWidth + 1); })
    .map(e => e.outerHTML.slice(0, 80))"""
INKED = """[...document.querySelectorAll('canvas')].every(c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
    return d.some((v, k) => k % 4 === 3 && v > 0); })"""


@pytest.fixture
def page(write, rolling, tmp_path):
    said = {"system": "a robot that rolls", "drawings": {"robot": Robot("robot", ground="stairs:0.1,0.3,3,0.8").drawing()}}
    return view([write("a.parquet", rolling(), said), write("b.parquet", rolling(0.1), said)], tmp_path / "p.html")


@pytest.mark.parametrize("width, dark", [(360, False), (1400, True)])
def test_it_opens_and_nothing_is_cut(tab, page, width, dark):
    shown = tab(page, width=width, dark=dark)
    assert shown.js("document.documentElement.scrollWidth") == width
    assert shown.js(OUTSIDE) == []
    assert shown.js(INKED)
    assert shown.js("document.querySelector('.legend').textContent").count("N·m") == 3  # the axis, and a number of each run
    assert shown.complaints() == []


def test_peaks_stand_one_below_another_on_a_phone(tab, write, drive, limits, tmp_path):
    columns = {name.replace("gear.", "front_sprocket_gear_of_the_robot."): column for name, column in drive().items()}
    page = view([write(f"{name}.parquet", columns, limits) for name in ("before", "after the repair")], tmp_path / "p.html")
    shown = tab(page, width=360)
    assert shown.js("document.querySelector('.peaks').textContent").count("4 A stall") == 2
    assert shown.js("document.querySelector('.peaks').offsetWidth <= document.querySelector('.peaks').parentElement.clientWidth")


def test_it_plays_and_steps_by_keys(tab, page):
    shown = tab(page)
    shown.key(" ", " ")
    shown.js("new Promise(done => { const wait = () => board.time > 0.05 ? done() : requestAnimationFrame(wait); wait(); })")
    shown.key(" ", " ")
    assert not shown.js("board.playing") and shown.js("document.querySelector('.play').textContent").endswith("Play")
    shown.key("Home")
    assert shown.js("board.time") == 0.0
    shown.key("ArrowRight")
    assert shown.js("board.time") == pytest.approx(0.02)
    assert shown.js("document.querySelector('.bar output').textContent") == "0.02 s"
    shown.key("End")
    assert shown.js("Number(document.querySelector('.bar input').value)") == 1000
    assert shown.complaints() == []


def test_curves_are_picked_zoomed_and_read(tab, page):
    shown = tab(page)
    shown.key("/")
    shown.call("Input.insertText", text="chassis y")
    assert shown.js("[...document.querySelectorAll('.picker label')].filter(l => l.offsetParent).map(l => l.textContent)") == [
        "chassis_ym"
    ]
    shown.js("[...document.querySelectorAll('.picker label')].find(l => l.offsetParent).click()")
    told = shown.js("document.querySelector('.curves').textContent")
    assert "length in m" in told and "robot.chassis_y 0.06 m" in told
    shown.js("document.activeElement.blur()")
    x, y, w, h = shown.js("(r => [r.x, r.y, r.width, r.height])(document.querySelector('.plot').getBoundingClientRect())")
    inside = w - 68  # beside the axis
    at = lambda share: x + 58 + share * inside
    shown.mouse("mouseMoved", at(0.25), y + h / 2)
    assert shown.js("board.hover") == pytest.approx(0.5, abs=0.01)
    shown.mouse("mousePressed", at(0.25), y + h / 2, True)
    shown.mouse("mouseMoved", at(0.5), y + h / 2, True)
    shown.mouse("mouseReleased", at(0.5), y + h / 2, True)
    assert shown.js("board.view") == pytest.approx([0.5, 1.0], abs=0.01)
    shown.key("0", "0")
    assert shown.js("board.view") == [0, 2]
    shown.mouse("mousePressed", at(0.75), y + h / 2, True)
    shown.mouse("mouseReleased", at(0.75), y + h / 2, True)
    assert shown.js("board.time") == pytest.approx(1.5, abs=0.01)
    assert shown.complaints() == []


def test_a_component_has_one_colour_on_all_axes(tab, write, drive):
    """Torque, current and power of a motor; a second curve of it on one axis has another."""
    shown = tab(view(write("a.csv", drive()), show=["motor.*", "gear.output_torque"]))
    colours = dict(shown.js("board.picked.map(one => [one.name, one.colour])"))
    assert colours["motor.torque"] == colours["motor.current"] == colours["motor.power"] != colours["gear.output_torque"]
    assert shown.complaints() == []


def test_no_name_runs(tab, write, hostile, rolling):
    columns = {name.replace("drive", hostile): (hostile if "drive" in name else unit, x) for name, (unit, x) in rolling().items()}
    shown = tab(view(write("a.parquet", columns, {"system": hostile}), show=["*torque"]), width=360)
    assert not shown.js("document.documentElement.dataset.owned") and not shown.js("document.images.length")
    assert hostile in shown.js("document.querySelector('.legend').textContent")
    assert shown.complaints() == []


@pytest.mark.parametrize("width", [360, 1400])
def test_a_fleet_is_shown_over_dates_with_intervals(tmp_path, rng, tab, width):
    track(write_fleet(tmp_path / "found", rng, units=12, worn={3: 0.4}), tmp_path / "p.html")
    shown = tab(tmp_path / "p.html", width=width)
    assert shown.js("document.documentElement.scrollWidth") == width
    legend = shown.js("document.querySelector('.legend').textContent")
    assert "unit 3" in legend and "unit unit" not in legend and "11 others" in legend and "N·m·s/rad" in legend
    x, y, w, h = shown.js("(r => [r.x, r.y, r.width, r.height])(document.querySelector('.plot').getBoundingClientRect())")
    shown.mouse("mouseMoved", x + 0.99 * w, y + 10.0)
    assert shown.js("day(runs[0].time[runs[0].near('reducer.viscous_damping', board.hover)])") == "2026-09-28"
    assert not shown.js("document.querySelector('.play')")
    assert shown.complaints() == []


@pytest.mark.parametrize("width", [360, 1400])
def test_a_replay_shows_each_comparison_and_what_the_log_says(tmp_path, tab, hostile, width):
    x = np.linspace(0.0, 1.0, 200)
    plot = {
        "x": axis("time", "s"),
        "y": axis("torque", "N.m"),
        "marks": [line(x, np.sin(9.0 * x), "measured", "ink")],
        "shares": "x",
    }
    names = ["gear", "whole motor.current", hostile]
    compared = [Comparison(name, name, "N.m", 0.1, 0.2, 0.0, ["reducer"]) for name in names]
    sanity = Box(("10 s",), (Finding(f"A remark on {hostile}.", False),), {})
    fault = {"log": "log.csv", "run": "", "channel": hostile, "kind": "frozen", "first": 1, "last": 9, "detail": ""}
    told = Replay(compared, [fault], tmp_path, {name: [plot, plot] for name in names}, sanity=sanity)
    told.write(Rig(tmp_path / "rig.toml", hostile, "forward", (LogColumn("load.angle", "a"),), {}))
    shown = tab(told.page, width=width)
    assert shown.js("document.documentElement.scrollWidth") == width
    assert shown.js("document.querySelectorAll('.plot').length") == 6
    assert shown.js(INKED.replace("'canvas'", "'.plot canvas:first-of-type'"))
    assert hostile in shown.js("document.querySelector('.verdict').textContent")
    assert not shown.js("document.documentElement.dataset.owned") and shown.complaints() == []


def test_a_name_whose_units_are_none_of_each_other_has_an_axis_of_each(tab, write, tmp_path):
    t = np.linspace(0.0, 1.0, 50)
    files = [write(f"{name}.csv", {"time": ("s", t), "x": (of, t)}) for name, of in {"a": "N.m", "b": "A", "c": "mA"}.items()]
    shown = tab(view(files, tmp_path / "p.html", show=["x"]))
    assert shown.js("document.querySelectorAll('.panel').length") == 3
    assert shown.complaints() == []
