"""Tables on a narrow screen: rows of many cells stand one below another, and nothing is read by scrolling sideways."""

import re

import pytest
from jinja2 import DictLoader

from selflock.view.page import environment, write
from selflock.view.stacked import stacked

ROWS = '<div class="wide"><table>\n<tr><th>{0}</th><th class="n">be<br>fore</th><th class="n">after</th><th>unit</th></tr>\n<tr class="worse"><td>whole</td><td class="n">1</td><td class="n">2</td><td></td></tr>\n</table></div>'


def labels(html):
    return re.findall(r'<td[^>]* data-is="([^"]*)">([^<]*)<', html)


def test_each_cell_says_what_it_is_of():
    made = stacked(ROWS.format("channel"))
    assert labels(made) == [("before", "1"), ("after", "2")]  # neither the name of the row nor what is empty
    assert (
        '<table class="rows">' in made
        and '<tr class="head"><th>channel</th>' in made
        and '<tr class="worse"><td>whole</td>' in made
    )


def test_heads_in_two_rows_and_cells_over_several_columns():
    head = '<tr><th rowspan="2">of</th><th colspan="2">error</th><th rowspan="2">unit</th></tr><tr><th>before</th><th>after</th></tr>'
    made = stacked(
        f'<div class="wide"><table>{head}<tr><td>a</td><td>1</td><td>2</td><td>V</td></tr>'
        '<tr><td>b</td><td colspan="2">none</td><td>A</td></tr></table></div>'
    )
    assert labels(made) == [("error, before", "1"), ("error, after", "2"), ("unit", "V"), ("unit", "A")]


@pytest.mark.parametrize(
    "table",
    [
        ROWS.format("x").replace("<table>", '<table class="shares">'),
        ROWS.format("x").replace("<table>", '<table class="params">'),
        ROWS.format("x").replace('<th class="n">after</th>', "").replace('<td class="n">2</td>', ""),
        ROWS.format("speed").replace("<td>whole</td>", '<td class="n">3</td>'),
        ROWS.format("x").replace('<div class="wide">', "<div>"),
    ],
    ids=["a matrix", "lines of its own", "three columns", "numbers from the first on", "not wide"],
)
def test_what_has_room_or_is_read_along_its_columns_stays(table):
    assert stacked(table) == table


def test_what_a_stranger_calls_a_column_ends_no_attribute(hostile):
    text = (
        environment("selflock.view")
        .from_string(ROWS.replace("after", "{{ name }}").replace("{0}", "channel"))
        .render(name=hostile + ' " onclick="x')
    )
    label = labels(stacked(text))[1][0]
    assert '"' not in label and "<" not in label


@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 400, 1400])
def test_no_table_of_a_page_scrolls_sideways_on_a_phone(tab, tmp_path, width):
    name = "recorded_reducer.viscous_damping_of_the_second_axis"
    rows = "".join(f"<tr><td>{name}</td>{''.join(f'<td class=n>{k}.2345678</td>' for k in range(9))}</tr>" for _ in range(3))
    rows = rows.replace("class=n", 'class="n"')
    head = "".join(
        f"<th>held out, as {word}</th>" for word in "number given fitted calibrated known told asked again at last".split()
    )
    two = f"<tr><th>number</th><th>and</th><th>correlation</th></tr><tr><td>{name}</td><td>{name}</td><td class='n'>0.9</td></tr>"
    made = environment("selflock.view")
    made.loader.loaders.insert(0, DictLoader({"x.j2": (
        "{% extends 'page.html.j2' %}{% block body %}"
        f'<div class="wide"><table><tr>{head}</tr>{rows}</table></div><div class="wide"><table>{two}</table></div>'
        "{% endblock %}"
    )}))  # fmt: skip
    shown = tab(write(tmp_path / "x.html", made, "x.j2"), width=width)
    wide = shown.js("[...document.querySelectorAll('.wide')].map(e => e.scrollWidth - e.clientWidth)")
    assert shown.js("document.documentElement.scrollWidth") == width
    assert wide == [0, 0] or width > 600
    told = shown.js("getComputedStyle(document.querySelector('td[data-is]'), '::before').content")
    assert ("held out, as given" in told) == (width < 600)
