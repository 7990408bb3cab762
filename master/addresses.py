"""Numbers at addresses, for compiled loops: numba's own arrays are not there where C calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic as numba_intrinsic

DOUBLE = ir.DoubleType()


def intrinsic(function: Callable) -> Callable[..., Any]:
    """numba's intrinsic; called without the typing context, which numba's own annotation counts among the arguments."""
    return numba_intrinsic(function)


def memory(kind, numba_kind):
    """Functions that load and store a number at an address."""

    @intrinsic
    def load(context, address):
        def code(context, builder, signature, args):
            return builder.load(builder.inttoptr(args[0], kind.as_pointer()))

        return numba_kind(types.int64), code

    @intrinsic
    def store(context, address, value):
        def code(context, builder, signature, args):
            builder.store(args[1], builder.inttoptr(args[0], kind.as_pointer()))
            return context.get_dummy_value()

        return types.void(types.int64, numba_kind), code

    return load, store


load, store = memory(DOUBLE, types.float64)
load_int, store_int = memory(ir.IntType(32), types.int32)


def _place(builder, address, k):
    return builder.inttoptr(builder.add(address, ir.Constant(ir.IntType(64), 8 * k)), DOUBLE.as_pointer())


@intrinsic
def tuple_at(context, address, kind):
    """The named tuple of this class whose fields, doubles, lie at an address."""
    made = types.NamedUniTuple(types.float64, len(kind.instance_class._fields), kind.instance_class)

    def code(context, builder, signature, args):
        values = [builder.load(_place(builder, args[0], k)) for k in range(made.count)]
        return context.make_tuple(builder, made, values)

    return made(types.int64, kind), code


@intrinsic
def put(context, address, values):
    """Store a tuple's numbers at an address, as doubles."""

    def code(context, builder, signature, args):
        for k, kind in enumerate(values.types):
            one = builder.extract_value(args[1], k)
            builder.store(context.cast(builder, one, kind, types.float64), _place(builder, args[0], k))
        return context.get_dummy_value()

    return types.void(types.int64, values), code
