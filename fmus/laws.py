"""The laws in force: ours, and beside them the effects of installed packages and of a folder that a user gives.

Effects that are not ours are put where ours lie: a copy of the sources, kept in the user's cache and named by its content,
has them in their components' `effects` folders. While they are in force everything takes the laws from that copy: FMUs and
their pages (fmus.build), the laws that are compiled (master.compiled), the vocabulary of a diagnosis. Ours stay untouched.

An installed package gives effects by an entry point that names a package of it, whose folder holds them:

    [project.entry-points."selflock.effects"]
    my_laws = "my_package.laws"
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from . import cache as kept
from .effect import SHAPES
from .effect_file import LAWS, EffectFile, gaps, read_folder
from .errors import EffectError

OURS = __name__.rpartition(".")[0]
GROUP = "selflock.effects"
MOST_NAMED = 20  # names in a message
JOINED = "_joined_"  # begins the names of copies with more effects than ours

_given: list[str] = []  # packages of laws put in force, the last one counts
_files: dict[str, dict[str, EffectFile]] = {}  # of each such package the files that are not ours, by their place inside


def in_force() -> str:
    """The package of the laws that are in force, such as selflock.fmus."""
    return _given[-1] if _given else _installed()


def module(name: str) -> ModuleType:
    """A module of the laws in force, such as "reducer.shaft"."""
    return import_module(f"{in_force()}.{name}")


def root(package: str | None = None) -> Path:
    """The folder that holds fmus, the sources of the laws in force or of a package of laws."""
    return Path(next(iter(import_module(package or in_force()).__path__))).parent


def files(package: str | None = None) -> dict[str, EffectFile]:
    """The effect files that are not ours of the laws in force or of a package of laws, by their place below fmus."""
    return _files.get(package or in_force(), {})


@contextmanager
def joined(folder: Path | None) -> Iterator[None]:
    """The laws with the effects of a user's folder in force, for this process; with None as they are. Raises EffectError.

    It runs the folder's files: who calls has asked (docs/security.md).
    """
    if folder is None:
        yield
        return
    _given.append(_join((*_of_packages(), *read_folder(folder))))
    try:
        yield
    finally:
        _given.pop()


@cache
def _installed() -> str:
    return _join(_of_packages())


@cache
def _of_packages() -> tuple[EffectFile, ...]:
    """The effect files of installed packages."""
    found: list[EffectFile] = []
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            spec = find_spec(entry.value)
        except Exception as error:
            raise EffectError(
                f"The installed effects {entry.name!r} ({entry.value}): {type(error).__name__}: {error}."
            ) from error
        folders = list((spec.submodule_search_locations or ()) if spec else ())
        if not folders:
            raise EffectError(f"The installed effects {entry.name!r}: {entry.value} is no package. Name the one with the files.")
        found += [file for folder in folders for file in read_folder(Path(folder))]
    return tuple(found)


def _join(given: Iterable[EffectFile]) -> str:
    """The package of our laws with these effects among them, looked at and tried; ours where there are none."""
    ours = Path(__file__).parent
    sources = {path.relative_to(ours).as_posix(): path.read_bytes() for path in sorted(ours.rglob("*.py"))}
    theirs: dict[str, EffectFile] = {}
    for file in given:
        if file.inside in sources:
            other = theirs[file.inside].path if file.inside in theirs else f"our own {file.inside}"
            raise EffectError(f"{file.path}: has the name of {other}. Give it another.")
        sources[file.inside], theirs[file.inside] = file.text, file
    if not theirs:
        return OURS
    digest = hashlib.sha256()
    for name, content in sorted(sources.items()):
        digest.update(f"{name} {len(content)}\n".encode() + content)
    around = f"{JOINED}{digest.hexdigest()[:16]}"
    package = f"{around}.fmus"
    if package not in _files:
        house = ModuleType(around)
        house.__path__ = [str(kept.copied(f"effects{around}", {f"fmus/{name}": content for name, content in sources.items()}))]
        sys.modules[around] = house
        try:
            _look(package, theirs)
        except BaseException:
            for name in [name for name in sys.modules if name.partition(".")[0] == around]:
                del sys.modules[name]
            raise
    _files[package] = theirs  # what is told names the files as they were given last
    return package


def _look(package: str, theirs: dict[str, EffectFile]) -> None:
    """Load what was joined, and refuse what does not keep to the rules of effects, in one sentence."""
    effects: dict[str, Any] = {}
    for component in dict.fromkeys(file.component for file in theirs.values()):
        with _blamed(package, theirs):
            import_module(f"{package}.{component}.effects")
    for inside, file in theirs.items():
        effects[inside] = sys.modules[f"{package}.{inside[:-3].replace('/', '.')}"].EFFECT
        base = import_module(f"{OURS}.{LAWS[file.component]}").BASE
        hooks = import_module(f"{OURS}.{file.component}.effects").HOOKS
        if wrong := gaps(effects[inside], base, hooks):
            raise EffectError(f"{file.path}: {wrong[0]}.")
        _unlike(package, file, effects[inside], base)
    for inside, file in theirs.items():
        with _blamed(package, theirs):
            _try(package, file, effects[inside])


def _unlike(package: str, file: EffectFile, effect: Any, base: tuple) -> None:
    """Refuse names that another effect, or the law itself, has."""
    of_law = {p.name: "the published law" for p in base}
    for other in import_module(f"{package}.{file.component}.effects").EFFECTS:
        if other is effect:
            continue
        if other.name == effect.name:
            raise EffectError(f"{file.path}: another effect of the {file.component} is called {effect.name!r}. Rename it.")
        of_law |= {p.name: f"the effect {other.name}" for p in other.parameters}
    for number, p in enumerate(effect.parameters):
        if p.name in of_law or p.name in [q.name for q in effect.parameters[:number]]:
            owner = of_law.get(p.name, "this effect itself")
            raise EffectError(f"{file.path}: the parameter {p.name!r} belongs to {owner} already. Rename it.")


def _try(package: str, file: EffectFile, effect: Any) -> None:
    """Ask each hook: while the effect is off it does nothing, and while it is on it says so."""
    law = import_module(f"{package}.{LAWS[file.component]}")
    hooks = import_module(f"{package}.{file.component}.effects").HOOKS
    off = law.Parameters()
    shapes = [p for p in effect.parameters if p.role in SHAPES]
    shaped = [off, *(off._replace(**{p.name: 0.5 * (p.off + end)}) for p in shapes for end in (p.low, p.high))]
    for x in conditions(law, file.component):
        for name, hook in effect.hooks.items():
            nothing = hooks[name]((), name)(off, x)
            for p in shaped:
                if not (value := _number(file, name, hook(p, x))) == nothing:
                    raise EffectError(
                        f"{file.path}: {hook.__name__}(p, x), its hook {name}, gives {value:.6g} while the effect is off; "
                        f"give {nothing:g} there, so that nothing changes for those who do not ask for it."
                    )
        for p in effect.parameters if "active" in effect.hooks else ():
            if p not in shapes and not _number(file, "active", effect.hooks["active"](_on(off, p), x)) > 0.0:
                raise EffectError(
                    f"{file.path}: {effect.hooks['active'].__name__}(p, x), its hook active, is 0 while {p.name} is not at "
                    f"{p.off:g}: then no other hook of it is asked. Give 1.0 there, or 2.0 where it varies in a step."
                )


def _number(file: EffectFile, name: str, value: Any) -> Any:
    if not isinstance(value, (int, float)):
        raise EffectError(f"{file.path}: its hook {name} gives {value!r}, which is no number.")
    return value


def _on(off: Any, p: Any) -> Any:
    """Parameters with an amount of p."""
    return off._replace(**{p.name: 0.5 * (p.off + (p.high if p.high > p.off else p.low))})


def conditions(law: Any, component: str) -> list[Any]:
    """A few conditions in which a component's hooks may be asked."""
    if component == "sensor":
        return [0.7, -1.3]
    kind = law.State if component == "load" else law.Condition
    return [kind(*(sign * (0.3 + 0.1 * n) for n in range(len(kind._fields)))) for sign in (1.0, -1.0)]


@contextmanager
def _blamed(package: str, theirs: dict[str, EffectFile]) -> Iterator[None]:
    """What a user's file raises as a sentence that names it, its line and its function."""
    try:
        yield
    except EffectError:
        raise
    except Exception as error:
        places = {str(root(package) / "fmus" / inside): file for inside, file in theirs.items()}
        trace, found = error.__traceback__, None
        while trace is not None:
            code = trace.tb_frame.f_code
            if code.co_filename in places:
                found = places[code.co_filename].path, trace.tb_lineno, code.co_name
            trace = trace.tb_next
        if found is None:
            raise
        path, line, name = found
        within = f", in {name}" if name != "<module>" else ""
        fields = getattr(getattr(error, "obj", None), "_fields", ())
        there = f" There are {', '.join(fields)}" if 0 < len(fields) <= MOST_NAMED else ""
        raise EffectError(f"{path}, line {line}{within}: {type(error).__name__}: {error}.{there}".rstrip(".") + ".") from error
