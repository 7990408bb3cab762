"""Effects of a user's own join the laws as ours do, while they are asked for, and a wrong file is one sentence."""

import re
import subprocess
import sys
import zipfile
from math import exp

import pytest
from fmpy import read_model_description

from selflock.fmus import effect_file, laws
from selflock.fmus.build import build, face_of
from selflock.fmus.errors import EffectError
from selflock.fmus.reducer import law as ours

from .own_effects import NOT_TO_BE_LOADED, TOOTH, wrong


@pytest.fixture
def own(tmp_path):
    """own(text): a folder with this as its one effect file."""

    def make(text=TOOTH, name="tooth.py"):
        (tmp_path / "my_laws").mkdir(exist_ok=True)
        (tmp_path / "my_laws" / name).write_text(text)
        return tmp_path / "my_laws"

    return make


def names(law):
    return [effect.name for effect in law.EFFECTS]


def test_it_joins_while_it_is_asked_for(own):
    before = names(ours)
    assert laws.module("reducer.law") is ours
    with laws.joined(own()):
        law = laws.module("reducer.law")
        assert names(law) == sorted([*before, "tooth"]) and laws.module("motor.dc").EFFECTS
        p = law.Parameters(tooth_depth=0.3, tooth_place=1.0, tooth_width=0.2)
        x = law.Condition(1.0, 0.0, 0.0, 1.1, 0.0, 0.0, 0.0, 0.0)
        assert law.extended(p, 0.02, x, 0.0).torque == pytest.approx(0.3 * exp(-0.25))
        assert "tooth_depth" in face_of("Reducer")._place
        with laws.joined(None):
            assert laws.module("reducer.law") is law
    assert laws.module("reducer.law") is ours and names(ours) == before
    assert "tooth_depth" not in face_of("Reducer")._place


def test_two_folders_one_after_the_other(own):
    with laws.joined(own()):
        first = laws.in_force()
    with laws.joined(own(TOOTH.replace("exp(-away * away)", "exp(-abs(away))"))):
        assert laws.in_force() != first
        law = laws.module("reducer.law")
        p = law.Parameters(tooth_depth=1.0, tooth_place=0.0, tooth_width=0.5)
        assert law.extended(p, 0.02, law.Condition(1.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0), 0.0).torque == pytest.approx(
            exp(-0.2)
        )


@pytest.mark.slow
def test_its_fmu_runs_where_the_folder_is_not(own, tmp_path):
    """The torque that holds the input shaft at rest in the middle of the tooth is the tooth's, in a process without our package."""
    folder = own()
    with laws.joined(folder):
        path = build("Reducer", tmp_path, kinematic=True, tooth_depth=0.125, tooth_place=0.5, tooth_width=0.2)
    for file in folder.iterdir():
        file.unlink()
    rows = {v.name: v for v in read_model_description(path).modelVariables}
    assert (rows["tooth_depth"].unit, float(rows["tooth_depth"].start), rows["tooth_depth"].min) == ("N.m", 0.125, None)
    with zipfile.ZipFile(path) as archive:
        page = archive.read("documentation/index.html").decode()
        assert ">tooth<" in page and "seen with the housing open" in page
        assert not [name for name in archive.namelist() if str(tmp_path).encode() in archive.read(name)]
        assert b"selflock.fmus" not in archive.read(next(n for n in archive.namelist() if n.endswith("effects/tooth.py")))
    ask = (
        "import sys; sys.modules['selflock'] = None; from fmpy import simulate_fmu; "
        f"out = simulate_fmu({str(path)!r}, stop_time=0.01, output_interval=0.01, output=['motor_torque_required'], "
        "start_values={'output_angle': 0.5, 'imposed_angle': 25.0}); print(out['motor_torque_required'][-1])"
    )
    told = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    assert float(told.stdout) == pytest.approx(0.125, rel=1e-9)


def test_line_numbers_and_the_import_are_kept(own):
    (file,) = effect_file.read_folder(own())
    assert file.inside == "reducer/effects/tooth.py"
    assert file.text.decode() == TOOTH.replace("from selflock.fmus.effect import", "from ...effect import")


@pytest.mark.alike
@pytest.mark.parametrize("what", NOT_TO_BE_LOADED)
def test_what_is_wrong_is_one_sentence(own, what):
    change = NOT_TO_BE_LOADED[what]
    with pytest.raises(EffectError) as told, laws.joined(own(wrong(change))):
        pass
    said = str(told.value)
    assert re.search(change[2], said) and "my_laws/tooth.py" in said and "\n" not in said and len(said) < 400, said
    assert laws.module("reducer.law") is ours


def test_nothing_runs_before_it_is_read(own, tmp_path):
    mark = tmp_path / "mark"
    with pytest.raises(EffectError, match="imports numpy"), laws.joined(own(f"open({str(mark)!r}, 'w')\nimport numpy\n" + TOOTH)):
        pass
    effect_file.read_folder(own(f"open({str(mark)!r}, 'w')\n" + TOOTH))
    assert not mark.exists()


def test_folders_that_are_none(tmp_path, own):
    for folder, words in ((tmp_path / "nowhere", "cannot be read"), (tmp_path, "no effect file")):
        with pytest.raises(EffectError, match=words), laws.joined(folder):
            pass
    with pytest.raises(EffectError, match="ripple.py: has the name of our own"), laws.joined(own(name="ripple.py")):
        pass


def test_an_installed_package_needs_no_word(own, tmp_path, monkeypatch):
    package = tmp_path / "site" / "somebodys"
    (package / "laws").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "laws" / "tooth.py").write_text(TOOTH)
    about = tmp_path / "site" / "somebodys-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: somebodys\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[selflock.effects]\ntheirs = somebodys.laws\n")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    caches = laws._installed, laws._of_packages
    try:
        for cache in caches:
            cache.cache_clear()
        assert "tooth" in names(laws.module("reducer.law")) and "tooth_depth" in face_of("Reducer")._place
        more = TOOTH.replace("tooth", "gap").replace("output_angle", "angle")
        (tmp_path / "more").mkdir()
        (tmp_path / "more" / "gap.py").write_text(more)
        with laws.joined(tmp_path / "more"):
            assert {"tooth", "gap"} <= set(names(laws.module("reducer.law")))
        with pytest.raises(EffectError, match="has the name of .*somebodys"), laws.joined(own()):
            pass
    finally:
        monkeypatch.undo()
        for cache in caches:
            cache.cache_clear()
    assert laws.module("reducer.law") is ours
