"""An effect is written once: one small file beside the physics of its component.

From the `EFFECT` that such a file declares come the parameters of the FMU, a hypothesis of the diagnosis
and a row of the documentation. Adding an effect is adding a file to the component's `effects` folder:

    EFFECT = Effect(
        component="reducer", name="viscous", summary="torque proportional to speed",
        parameters=(Parameter("viscous_damping", "N.m.s/rad", 0.0, 0.0, 1.0, "b, at the input shaft", AMPLITUDE),),
        source="...", hooks={"active": active, "viscous": viscous}, shown_over="speed",
        advice="constant speeds up to the highest, at one load",
    )

A hook is a pure function `hook(p, x)` of the component's Parameters and of the condition it is in; what hooks
a component has, and what `x` holds, is told in its `effects/__init__.py`, with the way in which those of several
effects are joined: by `total`, `product` or `largest`. The joined function is made of closures over plain functions
alone, so that numba can compile it like the rest of a law.
"""

import sys
from collections import namedtuple
from collections.abc import Iterable, Mapping
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, Callable, NamedTuple, Optional

VALUE = "value"  # of the published law, from a data sheet
SWITCH = "switch"  # 1 or 0, in an FMU true or false: no number to look for
CONSTANT = "constant"  # of nature, or agreed on: nobody doubts it
METAL = "metal"  # a value that is cut in metal: doubted last
AMPLITUDE = "amplitude"  # how much there is of an effect: acts by itself
SHAPE = "shape"  # what an effect looks like while an amplitude is on
PHASE = "phase"  # of a wave at angle 0; a shape
ORDER = "order"  # of a wave: how many there are in a turn; a shape
DELAY = "delay"  # something acts later by this time
OFFSET = "offset"  # what is read where there is nothing; acts by itself
LAG = "lag"  # time constant of a first-order lag
PERIOD = "period"  # something happens only so often: looked for in whole samples
STEP = "step"  # between two readings: looked for where the channel has it
ROLES = (VALUE, SWITCH, CONSTANT, METAL, AMPLITUDE, OFFSET, SHAPE, PHASE, ORDER, DELAY, LAG, PERIOD, STEP)
"""What a parameter is to its law, and so to whoever searches for its value."""

SHAPES = (SHAPE, PHASE, ORDER)
"""Roles of what changes nothing while the effect's other parameters are off."""

LATE = (DELAY, LAG, PERIOD)
"""Roles of what acts late: told from a log to a sample at best."""


OF_DRIVE = ("N.m", "N.m.s/rad", "rad/N.m", "kg.m2", "kg", "m", "Ohm", "1/A", "1/W", "1/rad")
"""Units of which a drive has an amount of its own: what its motor gives and takes at rest, how that falls with speed, what it yields and holds,
and how far its shafts went."""


class Above(NamedTuple):
    """A parameter that never falls below another one: what is searched for is how far it lies above."""

    name: str  # of the other
    most: float  # of the difference
    description: str  # of the difference


class Parameter(NamedTuple):
    """One number of a law."""

    name: str  # unique within the component
    unit: str  # FMI name of the unit, "" for a pure number
    off: float  # an effect's: the value that switches it off; a base parameter's: its nominal value
    low: float  # bounds: physics' own, or of what a fit may search
    high: float
    description: str
    role: str = VALUE  # one of ROLES
    shaft: str = ""  # of a wave's numbers: the shaft whose angle it goes with, "input" or "output"
    above: Optional[Above] = None
    on_request: bool = False  # looked for only where somebody asks for it
    of_value: bool = False  # a sensor's: in the unit of what it measures
    trials: tuple[float, ...] = ()  # where to look first, of a place or a width that matters: all of them are tried
    of_drive: float = 0.0  # above 0, of a unit of OF_DRIVE: a fit searches up to so many times what the drive has, not all bounds


VARIABLES = ("speed", "load", "acceleration", "position", "output position", "current", "time", "set-point change")
"""Over which an effect may be seen best; position: angle of the input shaft."""


def nothing(p: Any) -> str:
    """Nothing is wrong with these parameters."""
    return ""


def positive(*names: str) -> Callable[[Any], str]:
    """A check that these parameters are above 0."""

    def check(p: Any) -> str:
        return next((f"{name} = {getattr(p, name):.9g} must be above 0" for name in names if getattr(p, name) <= 0.0), "")

    return check


class Effect(NamedTuple):
    """A law beyond the published equations, off by default, and all that is known of it."""

    component: str
    name: str  # the vocabulary's name
    summary: str  # the formula in one line
    parameters: tuple[Parameter, ...]
    source: str  # literature
    hooks: Mapping[str, Callable]  # where it acts: hook name -> function(p, x)
    frees: tuple[str, ...] = ()  # the component's base parameters that a fit of this effect frees as well
    advice: str = ""  # the run that would tell it from others
    shown_over: str = ""  # the variable over which it is seen best, one of VARIABLES
    needs: tuple[str, ...] = ()  # "time", "angle": without these, in steady-state points, nothing is seen of it
    drifts: bool = False  # it changes in time: where nothing was seen to, a constant does as much
    says: tuple[str, ...] = ()  # base parameters whose error this effect is: no causes beside it
    takes: tuple[str, ...] = ()  # base parameters that are others where it acts: one that is off beside it is a number of it
    check: Callable[[Any], str] = nothing  # what is wrong with its parameters, as a sentence; "" when they are fit


def discover(package: str, path: Iterable[str]) -> tuple[Effect, ...]:
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


def join(effects, hooks, hook):
    """The function of this hook of all effects that have it; `hooks`: how those of a component are joined."""
    return hooks[hook](effects, hook)


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
