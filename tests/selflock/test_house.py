"""The order of the house: who may import whom, what the physics may know, and that the packages told are those there.

`FLOORS` is the order of imports: a room imports rooms of floors above it in the list, never of its own floor or below.
A room is a package or a module; what is not named itself belongs to the package around it.
"""

import ast
import importlib.util
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]

FLOORS = (
    ("selflock.fmus", "selflock.rooms"),
    ("selflock.master",),
    ("selflock.vehicle",),
    ("selflock.view",),
    ("selflock.study",),
    ("selflock.sweep", "selflock.diagnosis.errors", "selflock.diagnosis.rules"),
    ("selflock.diagnosis.data",),
    ("selflock.diagnosis.residuals",),
    ("selflock.diagnosis.search",),
    ("selflock.diagnosis.judge",),
    ("selflock.diagnosis.output",),
    ("selflock.diagnosis.pipeline",),
    ("selflock.diagnosis.planning", "selflock.diagnosis.systems"),
    ("selflock.diagnosis.calibration",),
    ("selflock.diagnosis.naming", "selflock.diagnosis.begin", "selflock.diagnosis.tracking"),
    ("selflock.diagnosis",),
    ("selflock.examples", "selflock.packing", "selflock.errors"),
    ("selflock",),  # the command line, and what a user imports
)
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
APART = ("selflock.sweep", "selflock.diagnosis")  # these know nothing of one another

FMI = ("fmus.slave", "fmus.build", "fmus.description", "fmus.documentation", "fmus.fmu", "pythonfmu", "fmpy")
LAWS = [
    path
    for path in sorted((ROOT / "fmus").glob("*/**/*.py"))
    if path.name != "fmu.py" and path.relative_to(ROOT / "fmus").parts[0] != "loader"
]


def modules() -> dict[str, Path]:
    """Every module of the project by its name."""
    found = {}
    for package, folder in PROJECT["package-dir"].items():
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            found[".".join((package, *parts)).removesuffix(".__init__")] = path
    return found


MODULES = modules()


def imports(name: str, path: Path) -> set[str]:
    """What a module imports, at its top or later: names of modules where it takes modules, else what they are taken from."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    taken = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            taken |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            given = "." * node.level + (node.module or "")
            source = importlib.util.resolve_name(given, package) if node.level else given
            taken |= {f"{source}.{alias.name}" if f"{source}.{alias.name}" in MODULES else source for alias in node.names}
    return taken


def room(name: str) -> str:
    """The innermost room that a module belongs to."""
    while name not in FLOOR:
        name = name.rpartition(".")[0]
    return name


def apart(a: str, b: str) -> bool:
    sides = [next((side for side in APART if f"{name}.".startswith(f"{side}.")), None) for name in (a, b)]
    return None not in sides and sides[0] != sides[1]


def test_a_room_imports_those_before_it_alone():
    wrong = []
    for name, path in MODULES.items():
        here = room(name)
        for taken in imports(name, path):
            if f"{taken}.".startswith("selflock.") and (there := room(taken)) != here:
                if FLOOR[there] >= FLOOR[here] or apart(here, there):
                    wrong.append(f"{name} imports {taken}: {here} may not know {there}.")
    assert not wrong


@pytest.mark.parametrize("path", LAWS, ids=lambda path: str(path.relative_to(ROOT)))
def test_physics_knows_nothing_of_fmi(path):
    name = next(name for name, known in MODULES.items() if known == path)
    for taken in imports(name, path):
        assert not any(f".{taken}.".find(f".{word}.") >= 0 for word in FMI), f"{name} imports {taken}"


def test_lower_floors_do_not_name_upper_ones():
    """Not even as text for a later import. What parts were once called is told in master.code, and there alone."""
    rooms = ("selflock.fmus", "selflock.master", "selflock.vehicle", "selflock.study")
    for name, path in MODULES.items():
        if room(name) in rooms and name != "selflock.master.code":
            text = path.read_text(encoding="utf-8")
            upper = [other for other, floor in FLOOR.items() if floor > FLOOR[room(name)] and other != "selflock"]
            assert not [other for other in upper if other in text], f"{name} names an upper room"


def test_the_packages_told_are_those_there():
    there = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    of_data = {"selflock.examples.rigs", "selflock.examples.notebooks"}  # no Python in it
    assert set(PROJECT["packages"]) == there | of_data


@pytest.mark.slow
def test_no_class_name_stands_for_two_things():
    """But for the words of a law, which every component's law has of its own."""
    of_a_law = {"State", "Output", "Condition"}
    where: dict[str, list[str]] = {}
    for name, path in MODULES.items():
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and node.name not in of_a_law and not node.name.startswith("_"):
                where.setdefault(node.name, []).append(name)
    assert not {word: modules for word, modules in where.items() if len(modules) > 1}
