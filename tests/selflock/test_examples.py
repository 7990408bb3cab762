"""Examples in docstrings do what they show."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("fmus", "master", "vehicle", "view", "study", "diagnosis", "sweep", "examples")


def modules():
    """Those that show something, by name."""
    for room in ("", *ROOMS):
        folder = ROOT / (room or "selflock")
        for path in sorted(folder.rglob("*.py")):
            if ">>> " in path.read_text(encoding="utf-8"):
                inside = path.relative_to(folder).with_suffix("").as_posix().replace("/", ".")
                yield ".".join(filter(None, ("selflock", room, inside))).removesuffix(".__init__")


@pytest.mark.parametrize("name", list(modules()))
def test_an_example_gives_what_it_shows(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = doctest.testmod(import_module(name))
    assert done.attempted and not done.failed
