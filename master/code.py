"""Which Python a system may run: the parts of this package, and what its user allows by name; nothing else is imported.

A system file, a rig, a sweep come from others, and `part = "os:system"` would be a command of theirs. So would a folder of
effects that a rig names.
"""

from __future__ import annotations

import logging
import re
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

from ..fmus.effect_file import read_folder
from ..fmus.shown import visible
from .errors import DescriptionError
from .face import Part

HOUSE = __name__.partition(".")[0] + "."
RENAMED = {
    "master.vehicle": "selflock.vehicle",
    "master.study": "selflock.study",
    "diagnosis.playback": "selflock.diagnosis.output.playback",
}
"""Modules of parts as system files of earlier versions have them, and what they are called now."""

NAMED = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*")

log = logging.getLogger("selflock")  # where nobody set up logging, Python prints warnings to stderr


def load_part(part: str, where: str, allow_code: bool) -> Callable[..., Any]:
    """What makes the part that `part`, as "package.module:Class", names. Only where it is allowed is a module of another package imported.

    where: of the system file, for messages. Raises DescriptionError.
    """
    name = _renamed(part)
    if not NAMED.fullmatch(name):
        raise DescriptionError(f'{where} part = "{part}": write "package.module:Class".')
    module, _, attribute = name.partition(":")
    ours = f"{module}.".startswith(HOUSE)
    if not ours and not allow_code:
        raise DescriptionError(
            f'{where} part = "{part}" is code from outside this package ({_origin(module)}). Nothing of it was run. '
            "If you trust it, give --allow-code, or allow_code=True in Python."
        )
    if not ours:
        _say(f"{name} from {_origin(name.partition(':')[0])}")
    try:
        kind = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise DescriptionError(f'{where} part = "{part}": {error}. Write "package.module:Class".') from error
    if ours and not _is_part(kind):
        raise DescriptionError(f'{where} part = "{part}" is no part: {attribute} is no class derived from Part.')
    return kind


def named(part: str | type[Part]) -> str:
    """A part as a system file names it: "package.module:Class"."""
    return part if isinstance(part, str) else f"{part.__module__}:{part.__qualname__}"


def importable(part: type[Part]) -> bool:
    """Whether another Python finds the class by its name: it is in a module, and no script's or notebook's own."""
    module, _, name = named(part).partition(":")
    return module != "__main__" and getattr(sys.modules.get(module), name, None) is part


def allowed_effects(folder: Path | None, where: str, allow_code: bool) -> Path | None:
    """The folder of effects that a rig names, where its files may run; they are told first. Raises DescriptionError.

    where: of the rig's file, for messages.
    """
    if folder is None:
        return None
    if not allow_code:
        raise DescriptionError(
            f"{where} effects: the files in {folder} are code from outside this package. Nothing of them was run. "
            "If you trust them, give --allow-code, or allow_code=True in Python."
        )
    for file in read_folder(folder):
        _say(f"the {file.component}'s effects in {file.path}")
    return folder


def _is_part(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Part) and kind is not Part and kind.__module__.startswith(HOUSE)


@cache
def _say(what: str) -> None:
    """Tell, once in a process and before it happens, what is run."""
    log.warning("running code from outside this package: %s", visible(what))


def _origin(module: str) -> str:
    """The file that a module would be loaded from, found without running anything of it or of its parents."""
    path, spec = None, None
    names = module.split(".")
    for count in range(1, len(names) + 1):
        spec = _spec(".".join(names[:count]), path)
        if spec is None:
            return f"no module {'.'.join(names[:count])} is found"
        path = spec.submodule_search_locations
    return str(spec.origin) if spec and spec.origin else f"package {module}"


def _spec(name: str, path: Any) -> ModuleSpec | None:
    if (loaded := sys.modules.get(name)) is not None and getattr(loaded, "__spec__", None) is not None:
        return loaded.__spec__
    for finder in sys.meta_path:
        if (spec := finder.find_spec(name, path)) is not None:
            return spec
    return None


def _renamed(part: str) -> str:
    """A part's name as it is now."""
    old = next((old for old in RENAMED if part.startswith((f"{old}:", f"{old}."))), "")
    return RENAMED[old] + part.removeprefix(old) if old else part
