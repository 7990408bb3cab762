"""An effect is written once: one small file beside the physics of its component.

From the `EFFECT` that such a file declares come the parameters of the FMU, a hypothesis of the diagnosis
and a row of the documentation. Adding an effect is adding a file to the component's `effects` folder:

    EFFECT = Effect(
        component="reducer", name="viscous", summary="torque proportional to speed",
        parameters=(Parameter("viscous_damping", "N.m.s/rad", 0.0, 0.0, 1.0, "viscous friction of the input shaft"),),
        source="...", hooks={"active": active, "damping": damping},
    )

A hook is a pure function `hook(p, x)` of the component's Parameters and of the condition it is in; what hooks
a component has, and what `x` holds, is told in its `effects/__init__.py`. A component joins the hooks of its
effects by `total`, `product` or `largest`. The joined function is made of closures over plain functions alone,
so that numba can compile it like the rest of a law.
"""

import sys
from collections import namedtuple
from collections.abc import Mapping
from importlib import import_module
from pkgutil import iter_modules
from typing import Callable, NamedTuple


class Parameter(NamedTuple):
    """One number of a law."""

    name: str  # unique within the component
    unit: str  # FMI name of the unit, "" for a pure number
    off: float  # an effect's: the value that switches it off; a base parameter's: its nominal value
    low: float  # bounds: physics' own, or of what a fit may search
    high: float
    description: str


class Effect(NamedTuple):
    """A law beyond the published equations, off by default."""

    component: str
    name: str  # the vocabulary's name
    summary: str  # the formula in one line
    parameters: tuple[Parameter, ...]
    source: str  # literature
    hooks: Mapping[str, Callable]  # where it acts: hook name -> function(p, x)
    frees: tuple[str, ...] = ()  # the component's base parameters that a fit of this effect frees as well


def discover(package: str, path) -> tuple[Effect, ...]:
    """The effects of the package `package` with search path `path`, one per module, in order of the file names."""
    names = sorted(module.name for module in iter_modules(path))
    return tuple(import_module(f"{package}.{name}").EFFECT for name in names)


def parameters_type(base, effects=(), name="Parameters"):
    """A named tuple of floats: the base parameters, then those of the effects; defaults nominal, every effect off.

    A base parameter that an effect declares as well is the same number, once. The type belongs to the module that asks.
    """
    every = {parameter.name: float(parameter.off) for effect in effects for parameter in effect.parameters}
    first = {parameter.name: float(parameter.off) for parameter in base}
    every = first | {key: value for key, value in every.items() if key not in first}
    return namedtuple(name, list(every), defaults=list(every.values()), module=sys._getframe(1).f_globals["__name__"])


def total(effects, hook):
    """The sum over all effects that have the hook; 0 where none has."""

    def join(first, rest):
        def added(p, x):
            return first(p, x) + rest(p, x)

        return added

    return _joined(effects, hook, join, _zero)


def product(effects, hook):
    """The product over all effects that have the hook; 1 where none has."""

    def join(first, rest):
        def multiplied(p, x):
            return first(p, x) * rest(p, x)

        return multiplied

    return _joined(effects, hook, join, _one)


def largest(effects, hook):
    """The largest value over all effects that have the hook; 0 where none has."""

    def join(first, rest):
        def greater(p, x):
            return max(first(p, x), rest(p, x))

        return greater

    return _joined(effects, hook, join, _zero)


def _joined(effects, hook, join, empty):
    hooks = [effect.hooks[hook] for effect in effects if hook in effect.hooks]
    if not hooks:
        return empty
    joined = hooks.pop()
    while hooks:
        joined = join(hooks.pop(), joined)
    return joined


def _zero(p, x):
    return 0.0


def _one(p, x):
    return 1.0
