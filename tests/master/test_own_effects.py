"""Effects of a user's own are compiled with our laws; what numba cannot compile is told in one sentence."""

import re
from math import exp

import pytest

from selflock.fmus import laws
from selflock.fmus.errors import EffectError
from selflock.master import DescriptionError, code
from selflock.master.compiled import compiled

from ..fmus.own_effects import NOT_TO_BE_COMPILED, TOOTH, wrong


@pytest.fixture
def own(tmp_path, monkeypatch):
    """own(text): a folder with this as its one effect file; what is compiled of it is kept beside it alone."""
    monkeypatch.setenv("SELFLOCK_CACHE", str(tmp_path / "cache"))

    def make(text=TOOTH):
        (tmp_path / "my_laws").mkdir(exist_ok=True)
        (tmp_path / "my_laws" / "tooth.py").write_text(text)
        return tmp_path / "my_laws"

    return make


@pytest.mark.slow
def test_it_is_compiled_with_ours(own):
    with laws.joined(own()):
        law = compiled("selflock.fmus.reducer.law")
        p = law.Parameters(tooth_depth=0.3, tooth_place=1.0, tooth_width=0.2)
        x = law.Condition(1.0, 0.0, 0.0, 1.1, 0.0, 0.0, 0.0, 0.0)
        assert law._torque(p, x) == pytest.approx(0.3 * exp(-0.25), rel=1e-14) and hasattr(law._torque, "py_func")
    assert "tooth_depth" not in compiled("selflock.fmus.reducer.law").Parameters._fields


@pytest.mark.parametrize("what", NOT_TO_BE_COMPILED)
@pytest.mark.slow
def test_what_cannot_be_compiled_is_one_sentence(own, what):
    change = NOT_TO_BE_COMPILED[what]
    with laws.joined(own(wrong(change))):
        for _ in range(2):  # nothing of it is left that would be taken for good
            with pytest.raises(EffectError) as told:
                compiled("selflock.fmus.reducer.law")
    said = str(told.value)
    assert re.search(change[2], said) and "my_laws/tooth.py" in said and "\n" not in said and len(said) < 500, said


def test_a_rig_s_effects_are_code(own, tmp_path, caplog):
    mark = tmp_path / "mark"
    folder = own(f"open({str(mark)!r}, 'w')\n" + TOOTH)
    assert code.allowed_effects(None, "rig.toml:", False) is None
    with pytest.raises(DescriptionError, match="(?s)rig.toml.*my_laws.*outside this package.*Nothing.*--allow-code"):
        code.allowed_effects(folder, "rig.toml:", False)
    code._say.cache_clear()
    assert code.allowed_effects(folder, "rig.toml:", True) == folder
    assert not mark.exists() and "running code from outside this package" in caplog.text and "tooth.py" in caplog.text
