"""Arrays without reference counts, and prefetching of records.

Arrays without an owner pass between kernels without reference counting, which took an eighth of the time in lanes. The
sampled revolutions of all lanes do not fit the cache of a core: without prefetching, each lane would wait for its
samples; with it, memory is read while other lanes compute.
"""

from llvmlite import ir
from numba.core import cgutils, config, types
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array


def _borrow(context, builder, ty, value):
    if isinstance(ty, types.Array):
        array = make_array(ty)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        return array._getvalue()
    if isinstance(ty, types.BaseTuple):
        for i, member in enumerate(ty):
            borrowed = _borrow(context, builder, member, builder.extract_value(value, i))
            value = builder.insert_value(value, borrowed, i)
    return value


@intrinsic
def _borrowed(typingctx, value):
    """Array, or tuple with arrays in it, without an owner; the caller must keep the memory alive meanwhile."""

    def codegen(context, builder, sig, args):
        return _borrow(context, builder, value, args[0])

    return value(value), codegen


def _as_it_is(value):
    return value


without_refcount = _as_it_is if config.DISABLE_JIT else _borrowed  # an overload could not return records in tuples
CACHE_LINE = 64
"""Bytes that the processor fetches at a time."""


def fetch(record):
    """Prefetch a record that will be read and written soon."""


@intrinsic
def _fetch(typingctx, record):
    def codegen(context, builder, sig, args):
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [byte, number, number, number]), "llvm.prefetch.p0"
        )
        start = builder.bitcast(args[0], byte)
        for offset in range(0, sig.args[0].size, CACHE_LINE):
            line = builder.gep(start, [number(offset)])
            builder.call(function, [line, number(1), number(3), number(1)])  # for writing, all cache levels, data
        return context.get_dummy_value()

    return types.void(record), codegen


@overload(fetch)
def _fetch_record(record):
    return lambda record: _fetch(record)
