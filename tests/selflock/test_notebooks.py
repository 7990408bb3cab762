"""The notebooks run from their first cell to their last, and say what they say; whatever they show shows itself."""

import ast
import json
import re
from pathlib import Path

import pytest

from selflock import examples

NOTEBOOKS = {name: path for name, path in examples.files().items() if path.suffix == ".ipynb"}


def run(path):
    """What the cells leave behind, and what each shows: the value of an expression at a cell's end, as a notebook has it."""
    names, shown = {"__name__": "__main__"}, []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        assert cell["cell_type"] in ("markdown", "code") and not cell.get("outputs")
        if cell["cell_type"] == "markdown":
            continue
        text = "".join(cell["source"])
        tree = ast.parse(text)
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, path.name, "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), path.name, "eval"), names)
            shown.append(value)
            if hasattr(value, "_repr_html_"):
                assert value._repr_html_().startswith("<")
    return names, shown


@pytest.fixture
def played(tmp_path, monkeypatch):
    """played("design_study"): the notebook run in an empty folder, without a screen."""
    import matplotlib

    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    yield lambda name: run(NOTEBOOKS[f"notebooks/{name}"])
    from matplotlib import pyplot

    pyplot.close("all")


def test_there_are_notebooks_and_they_say_what_they_are():
    assert len(NOTEBOOKS) == 3
    assert examples.about(NOTEBOOKS["notebooks/foreign_fmus"]) == "FMUs of others"


@pytest.mark.slow
def test_design_study(played, tmp_path):
    names, shown = played("design_study")
    table = shown[1]
    assert table["locks itself"].tolist() == [False, False, True]
    assert table["loss in the gear [J]"].astype(float).idxmin() == 0.0
    assert abs(table["speed at the end [rad/s]"][0.03]) < 0.5 < table["speed at the end [rad/s]"][[0.0, 0.01]].min()
    tried = shown[-1]
    assert tried["highest [rad]"].is_monotonic_decreasing and tried["highest [rad]"].iloc[0] > 0.2
    assert (tmp_path / "last.parquet").is_file() and names["s"].time == pytest.approx(0.4)


@pytest.mark.slow
def test_foreign_fmus(played, tmp_path, capsys):
    names, _ = played("foreign_fmus")
    said = capsys.readouterr().out
    assert "Did you mean resistance?" in said and "FMU Battery, FMI 2.0 co-simulation" in said
    last = names["result"].table.iloc[-1]
    drop = 19.8 + 5.4 * last["battery.charge"] - 0.2 * last["motor.current"]
    assert last["battery.voltage"] == pytest.approx(drop, rel=1e-3) and last["wheel.speed"] > 10.0
    assert (tmp_path / "drive.ssp").is_file()


@pytest.mark.slow
def test_from_log_to_model(played):
    names, shown = played("from_log_to_model")
    assert "reducer viscous" in [cause.label for cause in names["found"].causes]
    torque = shown[-1]
    assert abs(torque["extended"] / torque["the drive"] - 1.0) < 0.02 < abs(torque["data sheet"] / torque["the drive"] - 1.0)


@pytest.mark.slow
def test_what_docs_show_of_python_runs(tmp_path, monkeypatch):
    """docs/python.md from its first block to its last; what its class and its generator do by hand."""
    import matplotlib
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    text = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
    names = {"__name__": "__main__"}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "docs/python.md", "exec"), names)
    pyplot.close("all")
    assert len(names["heat"]) == 401 and (tmp_path / "run.parquet").is_file()
    wheel, adding = names["Flywheel"].function(), names["integrating"].function(0.0, 1.0)
    assert [wheel(t, 0.01)[0] for t in (0.0, 0.5, 1.0)] == [0.0, 0.5, 1.0]
    assert [next(adding), adding.send((0.5, 2.0)), adding.send((1.0, -1.0))] == [0.0, 50.0, 25.0]
