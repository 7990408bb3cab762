"""The example in docs/calibrate.md is what a reader would see: its blocks are run as they stand."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[3] / "docs" / "calibrate.md"


def blocks(kind):
    return re.findall(rf"```{kind}\n(.*?)```", PAGE.read_text(), re.S)


@pytest.mark.slow
def test_the_example_finds_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    nature, call = blocks("python")
    (rig,), (told,) = blocks("toml"), blocks("text")
    Path("rig.toml").write_text(rig)
    names: dict = {}
    exec(nature, names)
    exec(call, names)
    result, said = names["result"], capsys.readouterr().out
    hidden = {"Motor.resistance": 0.75, "Motor.voltage_constant": 0.028, "Motor.inductance": 0.9e-3}
    for name, value in hidden.items():
        number = result.table.loc[name]
        assert abs(value - number.value) < number.high - number.low and f"{name}:" in told
    assert [n.name for n in result.numbers if n.silent] == ["Motor.cogging_periods"]
    words = lambda text: re.findall(r"\[\[.*?\]\]|^    \S+:", text, re.M)
    assert words(said) == words(told)  # the page's numbers are of one machine
