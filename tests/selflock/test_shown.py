"""Names of strangers on pages, in figures and in the terminal: they stay words."""

import warnings
import zipfile

import numpy as np
import pandas as pd
import pytest
from lxml import html
from rich.console import Console

from selflock import cli, master
from selflock.commands import terminal
from selflock.diagnosis import diagnose
from selflock.diagnosis.data.table import table
from selflock.fmus.build import build
from selflock.fmus.shown import policy, visible
from selflock.master import toml
from selflock.master.ssp import export
from selflock.sweep import report, sweep


def quoted(text: str) -> str:
    """As a TOML string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


@pytest.fixture(scope="module")
def pages(tmp_path_factory, hostile):
    """Every page that we write, with hostile names wherever a person can put one."""
    folder = tmp_path_factory.mktemp("pages")
    return {
        "diagnosis": diagnosis(folder / "d", hostile),
        "sweep": swept(folder / "s", hostile),
        "ssp": structure(folder / "x", hostile),
    }


def diagnosis(folder, hostile):
    folder.mkdir()
    name = hostile.replace("/", "")  # a file's
    rig = f"""
    [rig]
    kind = "inverse"
    name = {quoted(hostile)}
    run = {quoted("run " + hostile)}
    [columns]
    "reducer.input_speed" = {quoted("speed " + hostile)}
    "motor.torque" = {quoted("torque " + hostile)}
    {quoted("room " + hostile)} = {quoted("extra " + hostile)}
    [parameters]
    "reducer.gear_ratio" = 50.0
    "reducer.friction_kinetic" = 0.03
    "reducer.shaft_inertia" = 1e-4
    "load.inertia" = 0.05
    "load.constant_torque" = 2.0
    """
    (folder / "rig.toml").write_text(rig)
    logs = []
    rng = np.random.default_rng(5)
    for k in range(2):
        time = np.arange(6000) * 1e-3
        speed, acceleration = 60.0 * np.sin((1.3 + k) * time), 60.0 * (1.3 + k) * np.cos((1.3 + k) * time)
        load, alpha, phi = 2.0 + 0.05 * acceleration / 50.0, np.arctan(1 / 50.0), np.arctan(0.05)
        torque = load * np.where(load * speed > 0.0, np.tan(alpha + phi), np.tan(alpha - phi)) + 1e-4 * acceleration
        torque += 1e-3 * rng.standard_normal(len(time))
        torque[100:140] = np.nan  # a fault, to be named in its table
        log = {"time": time, "run " + hostile: f"run {k} {hostile}", "speed " + hostile: speed, "torque " + hostile: torque}
        path = folder / f"{k}{name}.csv"
        pd.DataFrame(log | {"extra " + hostile: np.sin(time)}).to_csv(path, index=False)
        logs.append(path)
    diagnose(folder / "rig.toml", logs, out=folder / "out", seed=1)
    return folder / "out" / "report.html"


def swept(folder, hostile):
    folder.mkdir()
    (folder / "system.toml").write_text(
        f"[run]\nstop = 0.01\nstep = 0.001\n[components.{quoted('m' + hostile.replace('.', ''))}]\n"
        'fmu = "selflock:Motor"\nstart = { voltage = 12.0, speed = 0.0 }\n'
    )
    component = "m" + hostile.replace(".", "")
    (folder / "study.toml").write_text(
        f'name = {quoted(hostile)}\ndescription = {quoted(hostile)}\nsystem = "system.toml"\n'
        f"[vary.ohm]\nset = {quoted(component + '.resistance')}\nvalues = [0.5, 1.0]\nlabel = {quoted(hostile)}\nunit = {quoted(hostile)}\n"
        f"[vary.kind.choices]\n{quoted(hostile)} = {{ x = 1.0 }}\nother = {{ x = 2.0 }}\n"
        f"[record]\ncurrent = {{ final = {quoted('`' + component + '.current`')}, unit = {quoted(hostile)} }}\n"
        f'[report]\nmargins = {{ by = ["kind", "ohm"], figures = ["current"] }}\n'
    )
    sweep(folder / "study.toml", folder / "out", workers=0)
    with warnings.catch_warnings():  # names as long as these leave no room for the axes
        warnings.filterwarnings("ignore", "constrained_layout not applied", UserWarning)
        return report(folder / "out")


def structure(folder, hostile):
    folder.mkdir()
    made = master.from_dict(
        {
            "system": {"name": hostile, "description": hostile},
            "run": {"open_inputs": True},
            "components": {hostile: {"fmu": "selflock:Motor", "start": {"resistance": 0.5}}, "g": {"fmu": "selflock:Reducer"}},
            "connections": {f"{hostile}.speed": "g.input_speed"},
        }
    )
    with zipfile.ZipFile(export(made, folder / "a.ssp")) as archive:
        (folder / "index.html").write_bytes(archive.read("documentation/index.html"))
    return folder / "index.html"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diagnosis", "sweep", "ssp"])
def test_names_stay_words_on_every_page(pages, harmless, hostile, name):
    tree = harmless(pages[name], scripts=int(name != "ssp"))
    assert hostile in tree.text_content()


@pytest.mark.parametrize("name", ["diagnosis", "sweep", "ssp"])
@pytest.mark.slow
def test_no_name_runs_in_a_browser(pages, browser, hostile, name):
    shown = browser(pages[name])
    assert "data-owned" not in shown.partition("<body")[0] and hostile in html.fromstring(shown).text_content()


@pytest.mark.slow
def test_the_policy_alone_would_have_stopped_them(tmp_path, browser, hostile):
    """Even where a page forgets to escape; and without a policy the name does run, so the test above sees something."""
    for name, head in (("without", ""), ("with", policy())):
        page = tmp_path / f"{name}.html"
        page.write_text(f"<!doctype html><html><head>{head}<title>x</title></head><body><p>{hostile}</p></body></html>")
        assert ("data-owned" in browser(page).partition(">")[0] + browser(page)[:400]) == (name == "without")


@pytest.mark.slow
def test_documentation_of_fmus(tmp_path, harmless):
    with zipfile.ZipFile(build("Motor", tmp_path)) as archive:
        (tmp_path / "index.html").write_bytes(archive.read("documentation/index.html"))
    harmless(tmp_path / "index.html")


def test_a_terminal_is_told_names_as_they_are(monkeypatch, capsys):
    for console in ("console", "errors"):
        monkeypatch.setattr(
            terminal, console, Console(markup=False, emoji=False, force_terminal=True, width=200, stderr=console == "errors")
        )
    terminal.say(
        "a [link=http://x]b[/link] [red]c :smile: \x1b]8;;http://x\x07d\x1b[2J \u202eback \udce9.csv\ntwo", highlight=False
    )
    said = capsys.readouterr().out
    assert "\x1b" not in said and said.splitlines()[1] == "two"
    assert "[link=http://x]b[/link] [red]c :smile: \\x1b]8;;http://x\\x07d\\x1b[2J \\u202eback \\udce9.csv" in said
    assert visible("µ = 3 Ω\tok\n") == "µ = 3 Ω\tok\n"


TWO = "log\nVerdict: explained.csv"  # whose second line would pass for one of ours


def test_a_file_whose_name_has_two_lines_is_refused(tmp_path, monkeypatch, capsys):
    """Wherever its name comes from: a word of the command line, a program's call, a folder that is looked through."""
    (tmp_path / TWO).write_text("time,a\n0,1\n1,2\n")
    inside = tmp_path / "x\ny" / "diagnosis.json"
    inside.parent.mkdir()
    inside.write_text("{}")
    for words in (
        ["info", tmp_path / TWO],
        ["view", tmp_path / TWO],
        ["replay", "rig.toml", tmp_path / TWO],
        ["track", tmp_path],
    ):
        monkeypatch.setattr("sys.argv", ["selflock", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            cli.carry_out()
        said = capsys.readouterr()
        assert end.value.code == 2 and "line break" in said.err and len((said.out + said.err).splitlines()) == 1, said
    for read in (table, master.read, toml.read):
        with pytest.raises(OSError, match="line break") as refused:
            read(tmp_path / TWO)
        assert "\n" not in str(refused.value.filename)
