"""A law compiled by numba, from the very source that the FMUs run as plain Python.

The package of the laws is loaded a second time under another name (its modules import each other relatively, so they
find their second selves), and every function in it is wrapped by `numba.njit`, those inside closures included. The
plain modules stay as they are, and need neither a decorator nor numba.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from types import FunctionType, ModuleType

from numba import njit

PREFIX = "_compiled_"


def compiled(module_name: str) -> ModuleType:
    """The module, such as "fmus.reducer.shaft", with all functions of its package compiled on first use.

    Named tuples of the plain module are not those of the compiled one: take Parameters and State from what is returned.
    """
    package, _, rest = module_name.partition(".")
    if PREFIX + package not in sys.modules:
        _second(package)
    module = import_module(f"{PREFIX}{package}.{rest}" if rest else PREFIX + package)
    wrapped: dict[FunctionType, object] = {}
    for name, other in list(sys.modules.items()):
        if name.startswith(f"{PREFIX}{package}.") and not name.endswith(".effect"):  # fmus.effect joins laws while they load
            for key, value in list(vars(other).items()):
                if _ours(value, package):
                    setattr(other, key, _compile(value, package, wrapped))
    return module


def _second(package: str) -> None:
    """Register the package a second time under its other name."""
    first = import_module(package)
    spec = spec_from_file_location(PREFIX + package, first.__file__, submodule_search_locations=list(first.__path__))
    sys.modules[PREFIX + package] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[PREFIX + package])


def _ours(value: object, package: str) -> bool:
    return isinstance(value, FunctionType) and value.__module__.partition(".")[0] == PREFIX + package


def _compile(function: FunctionType, package: str, wrapped: dict[FunctionType, object]) -> object:
    """The function wrapped, after those in its closure: numba takes a closure's functions only when they are compiled."""
    if function not in wrapped:
        for cell in function.__closure__ or ():
            if _ours(cell.cell_contents, package):
                cell.cell_contents = _compile(cell.cell_contents, package, wrapped)
        wrapped[function] = njit(function, nogil=True)
    return wrapped[function]
