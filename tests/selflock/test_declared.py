"""What the package imports is what pyproject.toml declares: in the base, or in the extras that the room may ask for."""

import ast
import re
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from selflock import extras

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = {
    "fmus": [],
    "selflock": [],
    "examples": [],
    "master": ["diagnosis"],  # compiled laws and loops, where numba is installed
    "vehicle": ["vehicle"],
    "view": [],
    "study": ["vehicle"],
    "diagnosis": ["diagnosis", "files"],
    "sweep": ["sweep"],
}


def declared(extra=None):
    lines = PROJECT["dependencies"] if extra is None else PROJECT["optional-dependencies"][extra]
    return {re.match(r"[\w.-]+", line)[0].lower() for line in lines}


brought = cache(packages_distributions)  # which asks every package that is installed: once, and not of whoever only collects


def imported(path):
    """The modules that a file imports from outside its room, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module.partition(".")[0]


@pytest.mark.parametrize("room", EXTRAS)
@pytest.mark.slow
def test_what_a_room_imports_is_declared(room):
    brings = brought()
    allowed = declared().union(*map(declared, EXTRAS[room]))
    for path in (ROOT / room).rglob("*.py"):
        for module in {*imported(path)} - sys.stdlib_module_names - {"selflock"}:
            assert {name.lower() for name in brings[module]} & allowed, f"{path.relative_to(ROOT)} imports {module}"


def test_every_room_is_looked_at():
    rooms = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests"}
    assert rooms == set(EXTRAS)


def missing(name, where="selflock.diagnosis.fit"):
    """The error of a module of ours that imports `name`."""
    try:
        exec(f"raise ModuleNotFoundError('No module named {name}', name='{name}')", {"__name__": where})
    except ModuleNotFoundError as error:
        return error


def test_a_missing_extra_is_told_by_the_room_that_asks():
    assert "pip install 'selflock[diagnosis]'" in extras.told(missing("scipy.optimize"))
    assert "pip install 'selflock[sweep]'" in extras.told(missing("scipy", "selflock.sweep.study"))
    assert "pip install 'selflock[vehicle]'" in extras.told(missing("pymunk", "selflock.vehicle.model"))
    assert extras.told(missing("nobody")) is None and extras.told(ValueError()) is None
    caused = ValueError()
    caused.__cause__ = missing("numba", "selflock.vehicle.munk")
    assert "selflock[vehicle]" in extras.told(caused)
