"""A door into pymunk's compiled part: bodies read and written, and the space stepped, without leaving compiled code.

pymunk's C functions are reached by their address (cffi hands it out), and the state of a body by its address
plus the place of each quantity in the C structure. The places are not assumed: known values are set on a
body through pymunk's own interface and looked up in memory. Where they cannot be found the door stays shut
and the vehicle uses pymunk's batch interface, slower and with the same numbers.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pymunk
from llvmlite import ir
from numba import njit, types
from pymunk._chipmunk_cffi import ffi, lib

from ..fmus.cache import sealed
from ..master.addresses import intrinsic

WORDS = 27  # doubles of a C body that are looked through: up to the bias velocities
JOINT_WORDS = 28  # the same of a pivot joint, up to its accumulated impulse


def compiled(function, **options):
    """numba's njit with a cache on disk where a place for it can be written, without one where not."""
    options["error_model"] = "numpy"
    try:
        return sealed(njit(function, cache=True, **options))
    except RuntimeError:  # numba found no writable place
        return njit(function, **options)


def inlined(function):
    """`compiled`, and put into the code of whoever calls it."""
    return compiled(function, forceinline=True)


class Layout(NamedTuple):
    """Where the quantities stand in a C body, in bytes from its address."""

    position: int
    velocity: int
    force: int
    angle: int
    angular_velocity: int
    torque: int
    transform: int
    impulse: int  # in a pivot joint: its accumulated impulse, the warm start of the next step


def address(pointer) -> int:
    return int(ffi.cast("uintptr_t", pointer))


def space_step() -> int:
    """Address of cpSpaceStep(space, dt)."""
    return address(ffi.addressof(lib, "cpSpaceStep"))


@cache
def layout() -> Layout | None:
    """The places found by calibration; None where they do not come out as one expects."""
    body = pymunk.Body(2.0, 3.0)
    body.position, body.velocity, body.force = (1.25, 2.375), (3.625, 4.875), (5.125, 6.25)
    body.angle, body.angular_velocity, body.torque = 0.75, 8.5, 9.5
    words = np.frombuffer(ffi.buffer(ffi.cast("char *", body._body), 8 * WORDS), float)
    c, s = math.cos(0.75), math.sin(0.75)
    wanted = ((1.25, 2.375, 3.625), (3.625, 4.875), (5.125, 6.25), (0.75,), (8.5,), (9.5,), (c, s, -s, c, 1.25, 2.375))
    places = [_place(words, values) for values in wanted]

    space = pymunk.Space()
    space.gravity = (0.0, -9.81)
    mate = pymunk.Body(1.0, 1.0)
    joint = pymunk.PivotJoint(body, mate, (0.0, 0.0), (0.0, 0.0))
    space.add(body, mate, joint)
    space.step(0.01)
    jolt = np.frombuffer(ffi.buffer(ffi.cast("char *", joint._constraint), 8 * JOINT_WORDS), float)
    norms = np.hypot(jolt[:-1], jolt[1:])
    found = [i for i in range(len(norms)) if joint.impulse > 0.0 and norms[i] == joint.impulse]
    places.append(found[0] if len(found) == 1 else None)
    known = [8 * place for place in places if place is not None]
    return Layout(*known) if len(known) == len(places) else None


def _place(words: np.ndarray, values: tuple[float, ...]) -> int | None:
    """The one place where these values stand in a row."""
    n = len(values)
    found = [i for i in range(len(words) - n + 1) if all(words[i + k] == values[k] for k in range(n))]
    return found[0] if len(found) == 1 else None


def doubles(pointer, offset: int, count: int) -> np.ndarray:
    """A view of `count` doubles in C memory."""
    return np.frombuffer(ffi.buffer(ffi.cast("char *", pointer) + offset, 8 * count), float)


@intrinsic
def call_step(typing, function, space, dt):
    """Calls void function(space, dt) at an address."""

    def code(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64), ir.DoubleType()])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), [args[1], args[2]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64), code
