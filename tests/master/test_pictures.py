"""What a notebook shows of a system and of a result."""

import re

import numpy as np
import pytest
from lxml import html

from selflock import examples, master
from selflock.master.diagram import MOST, svg
from selflock.master.glance import POINTS, curve


def drawn(text):
    """The tree of what a notebook shows: it loads nothing and runs nothing."""
    tree = html.fragment_fromstring(text)
    assert not tree.xpath("//script|//img|//a|//iframe|//@href|//@src|//@*[starts-with(name(), 'on')]|//@*[contains(., 'url(')]")
    return tree


def wires(tree):
    return [path.xpath("string(title)") for path in tree.xpath("//path[@class='wire']")]


@pytest.mark.parametrize("name", ["bench", "robot"])
def test_every_component_and_every_connection_is_in_the_picture(name):
    system = master.load(examples.files()[name])
    tree = drawn(system._repr_html_())
    words = tree.xpath("//svg//text/text()")
    assert all(component in words for component in system.components)
    told = wires(tree)
    assert len(told) == len(system.connections)
    for target, connection in system.connections.items():
        assert any(one.startswith(f"{target} = {connection.source}") for one in told), target
    for port in {name.rpartition(".")[2] for target, c in system.connections.items() for name in (target, c.source)}:
        assert port in words


def test_lines_run_to_the_right_but_for_those_of_the_step_before(system):
    """a -> b -> c and c -> a: under Gauss-Seidel what c gives to a is of the step before, and dashed."""
    parts = {"a": "Gain", "b": "Gain", "c": "Integrator"}
    made = system(parts, {"b.u": "a.y", "c.u": "b.y", "a.u": "c.y"})
    tree = html.fragment_fromstring(svg(made))
    places = {box.xpath("string(.)"): float(box.get("x")) for box in tree.xpath("//text[@font-weight]")}
    assert places["a"] < places["b"] < places["c"]
    dashed = tree.xpath("//path[@stroke-dasharray]/title/text()")
    assert dashed == ["a.u = c.y"]
    made.run.order = ["c", "a", "b"]
    assert html.fragment_fromstring(svg(made)).xpath("//path[@stroke-dasharray]/title/text()") == ["c.u = b.y"]


def test_lines_end_at_their_ports(system):
    tree = html.fragment_fromstring(svg(system({"a": "Gain", "b": "Gain"}, {"b.u": "a.y", "a.u": "b.y"})))
    x, y, width, height = np.array(
        [[float(box.get(k)) for k in ("x", "y", "width", "height")] for box in tree.xpath("//rect[@rx]")]
    ).T
    for path in tree.xpath("//path[@class='wire']"):
        begin = [float(n) for n in re.match(r"M([\d.]+) ([\d.]+)", path.get("d")).groups()]
        assert any(np.isclose(begin[0], x + width) & (y < begin[1]) & (begin[1] < y + height))
        end = float(re.search(r"([\d.]+)(?: [\d.]+)?$", path.get("d"))[1])
        assert np.isclose(end + 5.0, x).any()
    outer = tree.get("viewbox").split()
    assert (x + width <= float(outer[2])).all() and (y + height <= float(outer[3])).all()


def test_names_of_strangers_stay_words(hostile):
    system = master.System(hostile, hostile, values={hostile: 1.0})
    system.components = {hostile: master.Component(fmu=f"{hostile}.fmu"), "b": master.Component(part=hostile)}
    system.connections = {f"{hostile}.{hostile}": master.Connection(f"b.{hostile}"), hostile: master.Connection(hostile)}
    system.faults = [master.Fault(f"b.{hostile}", hostile, 0.0), master.Fault(hostile, hostile, 0.0)]
    tree = drawn(system._repr_html_())
    assert hostile in tree.xpath("string(b)") and len(wires(tree)) == 1 and "not drawn" in tree.xpath("string(//svg)")


def test_a_picture_is_bounded_and_of_anything():
    many = {f"c{k}": master.Component(part="m:C") for k in range(MOST + 40)}
    tree = drawn(master.System(components=many)._repr_html_())
    assert len(tree.xpath("//rect[@rx]")) == MOST and "40 components more" in tree.xpath("string(//svg)")
    assert not drawn(master.System()._repr_html_()).xpath("//rect[@rx]")


def test_a_fault_is_seen():
    tree = drawn(master.load(examples.files()["bench"])._repr_html_())
    assert tree.xpath("//text[title='voltage: drop-out']/@fill") == ["#b3261e"]


# --- results -------------------------------------------------------------------------------------------------------


@pytest.fixture
def result(system):
    parts = {"c": "Clock", "i": ("Integrator", {}), "t": ("Types", {"flag": True, "count": 1, "word": "a"})}
    return master.run(system(parts, {"i.u": "c.angle"}, stop=10.0, step=0.01))


def test_a_result_is_a_table_with_curves(result):
    tree = drawn(result._repr_html_())
    rows = {row.xpath("string(td[1])"): row for row in tree.xpath("//tbody/tr")}
    assert list(rows) == list(result.peaks.index)
    cells = rows["c.angle"].xpath("td/text()")
    assert cells[1] == "rad" and [float(x) for x in cells[2:5]] == pytest.approx([-1.0, 1.0, np.sin(10.0)], abs=1e-4)
    assert len(tree.xpath("//polyline")) == len(rows) and result.summary().splitlines()[0] in tree.xpath("string(details)")


def test_a_curve_keeps_its_peaks():
    time, values = np.arange(10_000.0), np.zeros(10_000)
    values[1234], values[8765] = 5.0, -5.0
    points = np.array([p.split(",") for p in re.search('points="([^"]*)"', curve(time, values))[1].split()], dtype=float)
    assert len(points) <= 2 * POINTS and points[:, 1].min() == 2.0 and points[:, 1].max() == 28.0
    assert points[points[:, 1].argmin(), 0] == pytest.approx(2.0 + 176.0 * 0.1234, abs=1.5)
    values[:] = np.nan
    assert curve(time, values) == ""


@pytest.mark.slow
def test_a_plot_has_an_axes_for_each_unit(result):
    from matplotlib import pyplot

    try:
        axes = result.plot("c.*", "i.y", "t.count_out")
        assert [one.get_ylabel() for one in axes] == ["rad", ""]
        assert [[line.get_label() for line in one.lines] for one in axes] == [["c.angle"], ["i.y", "t.count_out"]]
        assert np.array_equal(axes[0].lines[0].get_ydata(), result.table["c.angle"])
        assert result.plot(ax=axes[0]) == [axes[0]] and axes[0].lines[1].get_label() == "c.angle [rad]"
        with pytest.raises(master.ResultError, match="no column c.angel. Did you mean c.angle?"):
            result.plot("c.angel")
    finally:
        pyplot.close("all")


def test_a_system_saves_itself_by_the_ending(system, tmp_path):
    made = system({"g": ("Gain", {"u": np.float64(2.0)}), "t": ("Types", {"count": np.int32(3)})}, stop=np.float64(1.0), step=0.5)
    again = master.load(made.save(tmp_path / "x.toml"), allow_code=True)
    assert again.components == made.components and again.run == made.run
    with pytest.raises(master.ResultError, match=".toml or .ssp"):
        made.save(tmp_path / "x.yaml")
    del made.components["t"]
    with pytest.raises(master.DescriptionError, match="runs inside our master only"):
        made.save(tmp_path / "x.ssp")
