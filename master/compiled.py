"""A law compiled by numba, from the very source that the FMUs run as plain Python.

The package of the laws is loaded a second time under another name (its modules import each other relatively, so they
find their second selves), and every function in it is wrapped by `numba.njit`, those inside closures included. The
plain modules stay as they are, and need neither a decorator nor numba.

The laws are those in force (fmus.laws): a user's own effects are compiled with ours, and looked at by themselves before, so
that what numba cannot compile is told in one sentence.

The second self is a copy of the sources in the user's cache, in a folder named by their content. Beside it numba keeps
what it compiled, which is therefore never older than any source it came from. Loops around the laws, which are not of
their package, are kept in the same way.

Compiled loops alone call the laws. numba would give each of these functions a face to Python and one to C, too, which take
most of the time that compiling takes: only loops have them, and what `compiled` hands out. The laws, and what serves a loop, are
put into the code of whoever calls them: to hand some fifty parameters from function to function, each by itself, took a third to
half of a step. Compiling the loops takes twice as long for it, once on a machine.
"""

from __future__ import annotations

import hashlib
import logging
import re
import sys
from functools import cache as once
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba
from numba import njit, typeof, types
from numba.core.errors import NumbaError

from selflock.fmus import cache, laws
from selflock.fmus.effect_file import LAWS as OF_COMPONENTS
from selflock.fmus.effect_file import EffectFile
from selflock.fmus.errors import EffectError

log = logging.getLogger(__name__)

LAWS = laws.OURS
INLINED: dict[str, Any] = {"forceinline": True}
FACELESS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True} | INLINED
PREFIX = "_compiled_"
ANSI = re.compile(r"\x1b\[[0-9;]*m")


def compiled(module_name: str) -> SimpleNamespace:
    """What is in the module, such as "selflock.fmus.reducer.shaft", with all functions of its package compiled on first use.

    Named tuples of the plain module are not those of the compiled one: take Parameters and State from what is returned.
    Where the plain law raises ZeroDivisionError, the compiled one gives inf or NaN: a fit may try any value.
    """
    return _faced(_compiled(module_name, _second().__name__))


def parameters(module_name: str) -> Any:
    """The class of a law's Parameters as compiled loops take them, for which nothing is compiled."""
    return import_module(_second().__name__ + module_name.removeprefix(LAWS)).Parameters


@once
def _faced(module: ModuleType) -> SimpleNamespace:
    """A module of compiled functions as Python may call them."""
    return SimpleNamespace(**{name: _face(value) if hasattr(value, "py_func") else value for name, value in vars(module).items()})


def _face(function: Any) -> Any:
    return njit(lambda *given: function(*given), nogil=True, error_model="numpy")


def _compiled(module_name: str, second: str) -> ModuleType:
    module = import_module(second + module_name.removeprefix(LAWS))
    wrapped: dict[FunctionType, object] = {}
    for name, other in list(sys.modules.items()):
        if name.startswith(second + ".") and name.count(".") > 1:  # the components', not the helpers that join their hooks
            for key, value in list(vars(other).items()):
                if _ours(value, second):
                    setattr(other, key, _wrap(value, second, wrapped, FACELESS))
    return module


def compiled_loops(path: Path) -> dict[str, object]:
    """The functions of a source file, by name, compiled on first use, with the compiled selves of the laws that it imports.

    Those whose names begin with _ serve the others.
    """
    second = _second()
    name = f"{second.__name__}_{path.parent.name}_{path.stem}"
    if name not in sys.modules:
        beside = _folder(second).name
        _load(name, _copied({Path(path.name): path.read_bytes()}, f"{beside} {name}") / path.name)
        module = sys.modules[name]
        for key, value in list(vars(module).items()):
            if isinstance(value, ModuleType) and value.__name__.startswith(LAWS + "."):
                setattr(module, key, _compiled(value.__name__, second.__name__))
            elif isinstance(value, FunctionType):
                setattr(module, key, _wrap(value, name, {}, INLINED if key.startswith("_") else {}))
    made = vars(sys.modules[name]).items()
    return {key: value for key, value in made if hasattr(value, "py_func") and not key.startswith("_")}


def _folder(module: ModuleType) -> Path:
    """Where a package's sources lie."""
    return Path(next(iter(module.__path__)))


def _second() -> ModuleType:
    """The laws' second self, loaded if it is not yet."""
    package = laws.in_force()
    second = PREFIX + package.removeprefix(LAWS.partition(".")[0] + ".").replace(".", "_")
    if second not in sys.modules:
        log.info("loading the laws to be compiled by numba; the first time on a machine that takes a minute or two")
        folder = _folder(import_module(package))
        sources = {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*.py"))}
        # what numba keeps of them names their modules: two packages of the same laws must not share it
        beside = "" if package == LAWS else second
        _load(second, _copied({path: content for path, content in sources.items() if _law(path)}, beside) / "__init__.py")
        try:
            for inside, file in laws.files(package).items():
                _look(second, inside, file)
        except EffectError:
            for name in [name for name in sys.modules if f"{name}.".startswith(f"{second}.")]:
                del sys.modules[name]
            raise
    return sys.modules[second]


def _look(second: str, inside: str, file: EffectFile) -> None:
    """Compile each hook of an effect that is not ours by itself: EffectError names the function that numba cannot compile."""
    law = _compiled(f"{LAWS}.{OF_COMPONENTS[file.component]}", second)
    effect = import_module(f"{second}.{inside[:-3].replace('/', '.')}").EFFECT
    p, x = law.Parameters(), laws.conditions(law, file.component)[0]
    for name, function in effect.hooks.items():
        hook: Any = _wrap(function, second, {}, FACELESS)
        given = typeof(p), typeof(x)
        said = f"{file.path}: {function.__name__}(p, x), its hook {name}, cannot be compiled by numba, as a fit needs it"
        try:
            hook.compile(given)
        except NumbaError as error:
            raise EffectError(f"{said}: {_reason(str(error))}. Use floats, math, if and loops.") from error
        except Exception as error:
            raise EffectError(f"{said}: {type(error).__name__}: {' '.join(str(error).split())[:200]}.") from error
        gives = hook.overloads[given].signature.return_type
        if not isinstance(gives, (types.Float, types.Integer, types.Boolean)):
            raise EffectError(f"{said}: it gives {gives}. Give one number, on every way through it.")


def _reason(told: str) -> str:
    """What numba complains about, of all that it says: the first words that are no heading, and the last line it names."""
    lines = [line.strip() for line in ANSI.sub("", told).splitlines()]
    words = [line for line in lines if line and not line.startswith(("Failed in", "File ", "-", ">", "During:", "def "))]
    places = re.findall(r'File "[^"]*", line (\d+)', told)
    where = f"line {places[-1]}: " if places else ""
    return where + (words[0].rstrip(".:") if words else "it gives no reason")[:300]


def _copied(sources: dict[Path, bytes], beside: str = "") -> Path:
    """The folder of a copy of these sources, made if it is not there yet, safe beside others that make it.

    It is named by their content, by what they stand `beside`: the copy of the laws, under which name they are loaded, and by
    how they are compiled: a function without a face must not be met where one is called, nor what another numba kept.
    """
    digest = hashlib.sha256(f"{beside} {FACELESS} numba {numba.__version__}".encode())
    for path, content in sources.items():
        digest.update(f"{path.as_posix()} {len(content)}\n".encode() + content)
    return cache.copied(f"laws_{digest.hexdigest()[:16]}", {path.as_posix(): content for path, content in sources.items()})


def _law(path: Path) -> bool:
    """Whether a law may import it: what lies in the components' folders but their FMU faces, and what joins the effects."""
    return str(path) in ("__init__.py", "effect.py") or (len(path.parts) > 1 and path.name != "fmu.py")


def _load(name: str, path: Path) -> None:
    inside = [str(path.parent)] if path.name == "__init__.py" else None
    spec = spec_from_file_location(name, path, submodule_search_locations=inside)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded")
    sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])


def _ours(value: object, second: str) -> bool:
    return isinstance(value, FunctionType) and value.__module__.startswith(second + ".")


def _wrap(function: FunctionType, second: str, wrapped: dict[FunctionType, object], how: dict[str, Any]) -> object:
    """The function compiled, after those in its closure: numba takes a closure's functions only when they are compiled."""
    if function not in wrapped:
        cells = function.__closure__ or ()
        for cell in cells:
            if _ours(cell.cell_contents, second):
                cell.cell_contents = _wrap(cell.cell_contents, second, wrapped, how)
        wrapped[function] = cache.sealed(njit(function, nogil=True, error_model="numpy", cache=not cells, **how))
    return wrapped[function]
