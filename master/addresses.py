"""Numbers at addresses, for compiled loops: numba's own arrays are not there where C calls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic as numba_intrinsic
from numba.np.arrayobj import make_array, populate_array

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


place_at, _ = memory(ir.IntType(64), types.int64)  # what lies there is an address


def arrays_of(kinds: Sequence[Any]) -> Callable[..., Any]:
    """A function that makes arrays of these numba types, contiguous, of what `described` wrote at an address; whoever has them keeps them."""
    made = types.Tuple(kinds)

    @intrinsic
    def take(context, address):
        def code(context, builder, signature, args):
            found, word = [], iter(range(sum(1 + kind.ndim for kind in kinds)))
            size = lambda: builder.load(_place(builder, args[0], next(word), ir.IntType(64)))
            for kind in kinds:
                array = make_array(kind)(context, builder)
                data, shape = builder.inttoptr(size(), array.data.type), [size() for _ in range(kind.ndim)]
                itemsize = ir.Constant(ir.IntType(64), context.get_abi_sizeof(context.get_data_type(kind.dtype)))
                strides = [itemsize]
                for length in shape[:0:-1]:
                    strides.insert(0, builder.mul(strides[0], length))
                populate_array(array, data=data, shape=shape, strides=strides, itemsize=itemsize, meminfo=None)
                found.append(array._getvalue())
            return context.make_tuple(builder, made, found)

        return made(types.int64), code

    return take


def described(arrays: Sequence[np.ndarray]) -> list[int]:
    """Where each array lies, and its shape, for `arrays_of`."""
    return [word for array in arrays for word in (array.ctypes.data, *array.shape)]


def entry(function: Any, signature: Any) -> int:
    """Where the machine code of a compiled function begins, as C calls it with these types."""
    function.compile(signature.args)
    made = function.overloads[signature.args]
    return made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)


def _place(builder, address, k, kind=DOUBLE):
    return builder.inttoptr(builder.add(address, ir.Constant(ir.IntType(64), 8 * k)), kind.as_pointer())


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
