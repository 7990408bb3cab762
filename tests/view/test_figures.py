"""Figures over any variable: what the page carries of them, and in a real browser that they are zoomed and read."""

import base64
import json
import re

import numpy as np
import pytest

from selflock.view import figures, page
from selflock.view.figures import axis, band, field, line, points, rule

from .test_browser import INKED, OUTSIDE

TEMPLATE = """{% extends "page.html.j2" %}{% import "pictures.html.j2" as picture %}{% block body %}
{% for name in names %}{{ picture.figure(name, "A figure") }}{% endfor %}{{ picture.bars(bars) }}{{ picture.shares(grid) }}
{% endblock %}"""


@pytest.fixture
def drawn(tmp_path):
    """drawn(figures, word): a page with them, and with bars and a table of shares that say `word`."""

    def write(plots, word="gear"):
        made = page.environment("selflock.view")
        made.loader.loaders.insert(0, type(made.loader.loaders[0])("selflock.view", "."))
        made.globals["names"] = list(plots)
        bars = [{"label": word, "share": 0.5, "said": f"50 % {word}", "kind": "won"}]
        grid = {"title": word, "columns": [word], "rows": [(word, [{"share": 0.25, "said": "25 %", "kind": "bad"}])]}
        template = made.from_string(TEMPLATE)
        return page.write(tmp_path / "p.html", made, template, figures.carried(plots), bars=bars, grid=grid)

    return write


def carried(path):
    """Figures of a page, and its numbers."""
    data = json.loads(re.search(r"<script>const D = (.*?);\n", path.read_text("utf-8"))[1])
    return data["figures"], [np.frombuffer(base64.b64decode(text), "<f8") for text in data["numbers"]]


def test_a_page_carries_numbers_once_and_as_they_are(drawn):
    x, y = np.linspace(0.0, 1.0, 11), np.linspace(0.0, 1.0, 11) ** 2
    marks = [line(x, y, "a"), points(x, x, "b"), rule(np.inf), rule(0.5)]
    made, numbers = carried(drawn({"one": [{"x": axis("x", "s"), "y": axis("y"), "marks": marks}], "none": []}))
    assert set(made) == {"one"} and len(numbers) == 2
    curve, dots, where = made["one"]["plots"][0]["marks"]  # a rule at no number is not drawn
    assert (numbers[curve["x"]] == x).all() and (numbers[curve["y"]] == y).all() and dots["y"] == curve["x"]
    assert where["at"] == 0.5


def test_long_curves_and_clouds_keep_their_peaks_and_are_bounded(rng):
    x, y = np.arange(100_000.0), rng.standard_normal(100_000)
    y[[777, 70_001]] = 30.0, -40.0
    for mark in (line(x, y), points(x, y)):
        assert len(mark["x"]) == len(mark["y"]) <= figures.POINTS
        assert (mark["y"].max(), mark["y"].min()) == (30.0, -40.0) and (mark["x"][0], mark["x"][-1]) == (0.0, 99_999.0)


def everything(word="gear"):
    x = np.linspace(-1.0, 1.0, 41)
    marks = [band(x, x**2 - 0.1, x**2 + 0.1, f"band {word}"), line(x, x**2, word, 1), rule(0.25, "y", f"limit {word}")]
    marks.append(points(x[::5], x[::5] ** 2, f"read {word}", "ink", (x[::5] ** 2 - 0.1, x[::5] ** 2 + 0.1)))
    grid = axis(word, "W", low=0.0, high=4.0, log=False)
    named = axis(word, names=[word, "other"])
    return {
        "one": [
            {"title": word, "x": axis(f"speed {word}", "rad/s"), "y": axis("torque", "N.m"), "marks": marks, "shares": "x"},
            {"x": axis("speed", "rad/s"), "y": axis("error", word), "marks": [line(x, x, "", 0)], "shares": "x"},
        ],
        "two": [
            {"x": axis("mu"), "y": axis("r"), "scale": grid, "marks": [field(np.arange(3.0), np.arange(2.0), np.arange(6.0), word)]},
            {"x": named, "y": axis("y"), "marks": [points(np.array([0.0, 1.0]), np.array([1.0, 2.0]))]},
        ],
    }  # fmt: skip


@pytest.mark.slow
def test_names_in_figures_stay_words(drawn, harmless, hostile):
    tree = harmless(drawn(everything(hostile), hostile), scripts=1)
    assert tree.text_content().count(hostile) >= 4


@pytest.mark.slow
@pytest.mark.parametrize("width, dark", [(360, True), (1400, False)])
def test_figures_are_drawn_zoomed_and_read(tab, drawn, hostile, width, dark):
    shown = tab(drawn(everything(hostile), hostile), width=width, dark=dark)
    assert shown.js("document.documentElement.scrollWidth") == width and shown.js(OUTSIDE) == []
    assert shown.js("[...document.querySelectorAll('canvas')].filter(c => !c.ariaHidden).length") == 4
    assert shown.js(INKED.replace("'canvas'", "'canvas[role=img]'"))
    assert not shown.js("document.documentElement.dataset.owned") and not shown.js("document.images.length")
    words = shown.js("document.querySelector('.plots').textContent")
    assert "torque in N·m" in words and "speed in rad/s" in words
    x, y, w, h = shown.js("(r => [r.x, r.y, r.width, r.height])(document.querySelector('.plot').getBoundingClientRect())")
    at = lambda share: x + 58 + share * (w - 68)
    shown.mouse("mousePressed", at(0.25), y + h / 2, True)
    shown.mouse("mouseMoved", at(0.5), y + h / 2, True)
    shown.mouse("mouseReleased", at(0.5), y + h / 2, True)
    low, high = shown.js("figures[0].views[0].ends")
    seen = pytest.approx([low + 0.25 * (high - low), low + 0.5 * (high - low)], abs=0.02)
    assert (
        shown.js("figures[0].views[0].view") == seen and shown.js("figures[0].plots[1].board.view") == seen
    )  # one axis for both
    shown.js("document.querySelector('.plot').focus()")
    shown.key("0", "0")
    assert shown.js("figures[0].views[0].view") == [low, high]
    assert shown.js("(p => p.near(p.X(0.5), p.Y(0.25)).where)(figures[0].plots[0])") == "0.25 N·m at 0.5 rad/s"
    told = shown.js("(p => p.near(p.X(2), p.Y(1)))(figures[1].plots[0])")
    assert (told["where"], told["what"]) == ("mu 2, r 1", "5 W")
    shown.mouse("mouseMoved", at(0.5), y + h / 2)
    assert shown.js("figures[0].views[0].hover") == pytest.approx((low + high) / 2, abs=0.02)
    assert shown.complaints() == []
