"""Effect files that are not ours: read, and looked at for what is wrong in them, before anything of them runs.

Such a file is what docs/extending.md shows. It lies in a folder of its user's and takes what it needs by

    from selflock.fmus.effect import AMPLITUDE, Effect, Parameter

An FMU carries it into hosts that have Python's standard library and nothing else: so it may import that and no more, and
the import above is made relative, as in our own files. Lines keep their numbers.
"""

from __future__ import annotations

import ast
import re
import sys
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from . import units
from .effect import CONSTANT, METAL, OF_DRIVE, ORDER, ROLES, SWITCH, VALUE, VARIABLES, Effect, Parameter
from .errors import EffectError
from .place import ending

LAWS = {
    "controller": "controller.pd",
    "motor": "motor.dc",
    "reducer": "reducer.law",
    "load": "load.load",
    "sensor": "sensor.sensor",
}
"""The module of each component that has its parameters, BASE, and where its hooks are asked."""

EFFECT_MODULE = "selflock.fmus.effect"
SHOWN_BY = "The page docs/extending.md shows an effect file"
MOST_FILES, MOST_BYTES = 200, 1 << 20


class EffectFile(NamedTuple):
    """One file, not run yet."""

    path: Path
    component: str
    text: bytes  # as an FMU carries it

    @property
    def inside(self) -> str:
        """Its place among the sources of the laws."""
        return f"{self.component}/effects/{self.path.name}"


def read_folder(folder: Path) -> tuple[EffectFile, ...]:
    """The effect files of a folder, in order of their names; those that begin with _ are none. Raises EffectError."""
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".py" and not path.name.startswith("_"))
    except (OSError, ValueError) as error:  # ValueError: a zero byte in its name
        raise EffectError(f"{folder}: cannot be read ({getattr(error, 'strerror', error)}). {SHOWN_BY}.") from None
    if not paths:
        raise EffectError(f"{folder}: holds no effect file (.py). {SHOWN_BY}.")
    if len(paths) > MOST_FILES:
        raise EffectError(f"{folder}: holds {len(paths)} effect files; {MOST_FILES} are the most.")
    return tuple(_read(path) for path in paths)


def _read(path: Path) -> EffectFile:
    try:
        with ending(path).open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
        text = raw.decode("utf-8-sig")
        tree = ast.parse(text)
    except OSError as error:
        raise EffectError(f"{path}: cannot be read ({error.strerror}).") from None
    except SyntaxError as error:
        raise EffectError(f"{path}, line {error.lineno}: {error.msg}; this is no Python.") from None
    except (ValueError, RecursionError, MemoryError):
        raise EffectError(f"{path}: is no Python in UTF-8. {SHOWN_BY}.") from None
    if len(raw) > MOST_BYTES:
        raise EffectError(f"{path}: is larger than {MOST_BYTES >> 20} MiB, which no effect file is.")
    if not path.stem.isidentifier():
        raise EffectError(f"{path}: its name becomes a module's; use letters, digits and _, such as tooth.py.")
    lines = text.splitlines(keepends=True)
    for node in ast.walk(tree):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            _import(path, node, lines)
    return EffectFile(path, _component(path, tree), "".join(lines).encode())


def _import(path: Path, node: ast.Import | ast.ImportFrom, lines: list[str]) -> None:
    """Refuse what an FMU cannot bring along; make the import of effect.py relative in `lines`."""
    if isinstance(node, ast.ImportFrom) and (node.level == 3 and node.module == "effect"):
        return
    if isinstance(node, ast.ImportFrom) and not node.level and node.module == EFFECT_MODULE:
        place = node.lineno - 1
        lines[place] = re.sub(r"\bselflock\.fmus\.effect\b", "...effect", lines[place], count=1)
        return
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else ["." * node.level + (node.module or "")]
    for name in names:
        if name.partition(".")[0] not in sys.stdlib_module_names:
            raise EffectError(
                f"{path}, line {node.lineno}: imports {name}; an FMU carries this file to where there is Python's standard "
                f"library alone. Beside that, write from {EFFECT_MODULE} import ..."
            )


def _component(path: Path, tree: ast.Module) -> str:
    """The component that the file names, told from its text."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        if any(isinstance(target, ast.Name) and target.id == "EFFECT" for target in targets):
            call: Any = getattr(node, "value", None)
            given = [key.value for key in getattr(call, "keywords", ()) if key.arg == "component"] + getattr(call, "args", [])[:1]
            named = next((one.value for one in given if isinstance(one, ast.Constant)), None)
            if named not in LAWS:
                said = f"component = {named!r}" if named is not None else "no component by a text"
                raise EffectError(
                    f'{path}, line {node.lineno}: EFFECT has {said}. Write component="reducer", or another of {", ".join(LAWS)}.'
                )
            return str(named)
    raise EffectError(f'{path}: has no EFFECT = Effect(component="...", ...) at its top level. {SHOWN_BY}.')


def gaps(effect: Any, base: tuple[Parameter, ...], hooks: Any) -> list[str]:
    """What an effect does not say, or says wrongly. base: parameters of its component's law; hooks: how its hooks join."""
    if getattr(effect, "_fields", ()) != Effect._fields:
        return ["EFFECT is no Effect"]
    found: list[str] = []

    def demand(met: object, what: str) -> None:
        found.extend([] if met else [what])

    names = {p.name for p in base}
    for field in ("name", "summary", "source", "advice", "parameters", "hooks"):
        demand(getattr(effect, field), f"no {field}")
    demand(effect.shown_over in VARIABLES, f"shown_over = {effect.shown_over!r} is none of {', '.join(VARIABLES)}")
    demand(set(effect.needs) <= {"time", "angle"}, f"needs {effect.needs}: there are time and angle")
    for hook in effect.hooks:
        demand(hook in hooks, f"no hook of the {effect.component} is {hook!r}: there are {', '.join(hooks)}")
    demand(
        "active" not in hooks or "active" in effect.hooks,
        f"no hook active: the {effect.component} asks no other hook of an effect that does not say when it is on",
    )
    for name in (*effect.frees, *effect.says, *effect.takes):
        demand(name in names, f"frees, says or takes {name!r}, which is no parameter of the {effect.component}'s law")
    for p in effect.parameters:
        found += _parameter_gaps(p)
    for p in effect.parameters:  # what belongs to a wave falls with it
        demand(not p.shaft or any(q.role == ORDER and q.shaft == p.shaft for q in effect.parameters), f"{p.name}: no order")
    return found


def _parameter_gaps(p: Any) -> list[str]:
    if getattr(p, "_fields", ()) != Parameter._fields:
        return [f"{p!r} in parameters is no Parameter"]
    found: list[str] = []

    def demand(met: object, what: str) -> None:
        found.extend([] if met else [what])

    demand(str(p.name).isidentifier() and not str(p.name).startswith("_"), f"a parameter is called {p.name!r}: use a name")
    demand(p.description, f"{p.name} has no description")
    allowed = [role for role in ROLES if role not in (VALUE, METAL, CONSTANT, SWITCH)]
    demand(p.role in allowed, f"{p.name} has no role of an effect's parameter: {p.role!r} is none of {', '.join(allowed)}")
    if not all(isinstance(x, (int, float)) for x in (p.off, p.low, p.high, *p.trials)):
        return [*found, f"{p.name}: off, low, high and trials are numbers"]
    demand(isfinite(p.low) and isfinite(p.high) and p.low < p.high, f"{p.name}: bounds [{p.low}, {p.high}]")
    demand(p.low <= p.off <= p.high, f"{p.name}: off at {p.off}, outside its bounds [{p.low}, {p.high}]")
    for trial in p.trials:
        demand(p.low <= trial <= p.high, f"{p.name}: trial at {trial}, outside its bounds [{p.low}, {p.high}]")
    demand(len(p.trials) <= MOST_TRIALS, f"{p.name}: {len(p.trials)} trials; {MOST_TRIALS} are the most")
    demand(
        p.of_drive >= 0.0 and (not p.of_drive or p.unit in OF_DRIVE),
        f"{p.name}: of_drive = {p.of_drive} is a share, above 0, of what a drive has in {', '.join(OF_DRIVE)}",
    )
    demand((p.role == ORDER) <= (p.shaft in ("input", "output")), f"{p.name}: waves of which shaft?")
    try:
        units.parse(p.unit or "1")
    except KeyError as error:
        found.append(f"{p.name}: {error.args[0]}")
    return found


MOST_TRIALS = 60
"""Of one parameter: each is a simulation of everything, in every step of a search."""
