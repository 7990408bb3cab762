"""A system, a rig, a sweep are a stranger's: their parts run only when they are this package's, or allowed."""

import subprocess
import sys
import textwrap

import pytest

from selflock import master
from selflock.diagnosis import diagnose, replay
from selflock.diagnosis.data.rig import load as load_rig
from selflock.master import code
from selflock.master.ssp import export
from selflock.sweep import sweep

SYSTEM = '[run]\nstop = 0.01\nstep = 0.001\n[components.p]\npart = "{part}"\n'
STUDY = 'system = "system.toml"\ntable = true\n[vary.x]\nvalues = [1.0]\n'
RIG = '[rig]\nsystem = "system.toml"\n[columns]\n"p.y" = "y"\n'
EVIL = """
import pathlib
pathlib.Path({mark!r}).write_text("run")
from small_parts import Gain
"""


@pytest.fixture
def evil(tmp_path, monkeypatch):
    """A module that leaves a mark when it is imported; its system file, and the mark."""
    mark = tmp_path / "mark"
    (tmp_path / "lib" / "parent").mkdir(parents=True)
    for name in ("evil_module.py", "parent/__init__.py", "parent/child.py"):
        (tmp_path / "lib" / name).write_text(EVIL.format(mark=str(mark)))
    monkeypatch.syspath_prepend(str(tmp_path / "lib"))
    for name in ("evil_module", "parent", "parent.child"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    code._say.cache_clear()
    return tmp_path, mark


def every_way(folder):
    """All that loads a system."""
    (folder / "study.toml").write_text(STUDY)
    (folder / "rig.toml").write_text(RIG)
    (folder / "log.csv").write_text("time,y\n0,0\n0.1,0\n")
    system, out, rig, log = folder / "system.toml", folder / "out", folder / "rig.toml", folder / "log.csv"
    yield lambda: master.run(system)
    yield lambda: export(system, folder / "out.ssp")
    yield lambda: sweep(folder / "study.toml", out, workers=0)
    yield lambda: replay(rig, log, out)
    yield lambda: diagnose(rig, [log], out=out)


@pytest.mark.parametrize("part", ["evil_module:Gain", "parent.child:Gain", "os:system", "posix:system", "builtins:exec"])
def test_nobody_elses_code_runs_without_being_asked(evil, part):
    folder, mark = evil
    (folder / "system.toml").write_text(SYSTEM.format(part=part) + f'[components.p.options]\ncommand = "touch {mark}"\n')
    for way in every_way(folder):
        with pytest.raises(
            master.DescriptionError, match="(?s)code from outside this package.*Nothing of it was run.*--allow-code"
        ):
            way()
        assert not mark.exists()


def test_no_rig_runs_its_effects_without_being_asked(evil):
    folder, mark = evil
    (folder / "laws").mkdir()
    (folder / "laws" / "tooth.py").write_text(EVIL.format(mark=str(mark)))
    text = '[rig]\nkind = "inverse"\neffects = "laws"\n[columns]\n"load.angle" = "y"\n'
    (folder / "rig.toml").write_text(text)
    (folder / "log.csv").write_text("time,y\n0,0\n0.1,0\n")
    rig, log = folder / "rig.toml", folder / "log.csv"
    for way in (lambda: replay(rig, log, None), lambda: diagnose(rig, [log], out=None)):
        with pytest.raises(
            master.DescriptionError, match="(?s)code from outside this package.*Nothing of them was run.*--allow-code"
        ):
            way()
    assert not mark.exists()


def test_a_file_cannot_allow_itself(evil):
    folder, mark = evil
    for more in ("allow_code = true", "[run]\nallow_code = true", "[components.p]\nallow_code = true"):
        (folder / "system.toml").write_text(f'{more}\n[components.q]\npart = "evil_module:Gain"\n')
        with pytest.raises(master.DescriptionError, match="allow_code"):
            master.load(folder / "system.toml")
    (folder / "rig.toml").write_text(RIG.replace("[rig]", "[rig]\nallow_code = true"))
    with pytest.raises(Exception, match="allow_code"):
        load_rig(folder / "rig.toml")
    assert not mark.exists()


def test_what_is_allowed_is_shown_before_it_runs(evil, caplog):
    folder, mark = evil
    (folder / "system.toml").write_text(SYSTEM.format(part="parent.child:Gain") + "[components.p.start]\nu = 1.0\n")
    before = []

    class Look(code.logging.Handler):
        def emit(self, record):
            before.append((record.getMessage(), mark.exists()))

    code.log.addHandler(look := Look())
    try:
        master.run(folder / "system.toml", allow_code=True)
        master.run(folder / "system.toml", allow_code=True)
    finally:
        code.log.removeHandler(look)
    assert mark.exists()
    child = folder / "lib" / "parent" / "child.py"
    assert before == [(f"running code from outside this package: parent.child:Gain from {child}", False)]


@pytest.mark.parametrize(
    "part",
    [
        "selflock.cli:main",
        "selflock.cli:app",
        "selflock.cli:Path",
        "selflock.master.code:import_module",
        "selflock.master.simulation:run",
        "selflock.master.system:System",
        "selflock.fmus.build:os",
        "selflock.master.process:os",
        "selflock.master.face:Part",
        "selflock.fmus.build:Path",
        "selflock:master",
        "selflock.vehicle:Robot.step",
        "selflock.os:system",
        "selflock.",
        "selflock.vehicle:",
        ":",
        "selflock..os:system",
        "selflock.vehicle:Robot\0",
    ],
)
@pytest.mark.parametrize("allowed", [False, True])
def test_of_this_package_only_parts(part, allowed):
    with pytest.raises(master.DescriptionError):
        code.load_part(part, "[components.p]", allowed)


@pytest.mark.parametrize(
    "part",
    [
        "selflock.vehicle:Robot",
        "master.vehicle:Robot",
        "selflock.study.manoeuvre:Setpoints",
        "master.study.manoeuvre:Setpoints",
        "diagnosis.playback:Playback",
        "selflock.diagnosis.output.playback:PowerStage",
        "selflock.diagnosis.systems.parts:Signals",
    ],
)
def test_parts_of_this_package_need_no_leave(part):
    assert isinstance(code.load_part(part, "", False), type)


def test_a_system_structure_has_no_say(tmp_path):
    """The annotation of an SSP cannot make a component a part."""
    made = master.from_dict({"components": {"m": {"fmu": "selflock:Motor"}}, "run": {"open_inputs": True}})
    path = export(made, tmp_path / "a.ssp")
    import zipfile

    hostile = tmp_path / "b.ssp"
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(hostile, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "SystemStructure.ssd":
                assert b'"components": {}' in data
                data = data.replace(b'"components": {}', b'"components": {"m": {"part": "os:system", "fmu": ""}}')
            target.writestr(name, data)
    with pytest.raises(master.DescriptionError):
        master.run(hostile, stop=0.001, step=0.001, allow_code=True)


@pytest.mark.slow
def test_the_command_line_asks(tmp_path):
    (tmp_path / "mine.py").write_text(
        textwrap.dedent(f"""
        import sys
        sys.path.insert(0, {str(__import__("pathlib").Path(__file__).parent)!r})
        from small_parts import Gain
        """)
    )
    (tmp_path / "system.toml").write_text(SYSTEM.format(part="mine:Gain") + "[components.p.start]\nu = 1.0\n")
    command = [sys.executable, "-m", "selflock.cli", "run", "system.toml", "-o", "out.csv"]
    environment = {**__import__("os").environ, "PYTHONPATH": str(tmp_path)}
    asked = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert asked.returncode == 2 and "--allow-code" in asked.stderr and "Traceback" not in asked.stderr
    allowed = subprocess.run([*command, "--allow-code"], cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert allowed.returncode == 0, allowed.stderr
    assert "running code from outside this package: mine:Gain" in allowed.stderr and (tmp_path / "out.csv").exists()
