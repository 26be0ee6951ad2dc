"""Lanes in memory: NumPy records and arrays whose last axis, of length `WIDTH`, holds the joints."""

import numpy as np
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.extending import intrinsic, register_model
from numba.np.arrayobj import make_array, populate_array

from tolstat.kernel.simd.lane import DOUBLES, LANE, WIDTH

ALIGNMENT = 8 * WIDTH
"""Alignment of every lane in memory, bytes."""


class LaneRecord(types.Record):
    """A record of lanes: a NumPy record whose float fields have a last axis of length `WIDTH`."""

    @property
    def dtype(self):
        """Equivalent NumPy type: bytes without structure."""
        return np.dtype((np.void, self.size))


@register_model(LaneRecord)
class LaneRecordModel(models.RecordModel):
    """A pointer, as for any record."""


def record_of_lanes(record):
    """Numba type of a record whose float fields are lanes; `record` is the type of the NumPy record."""
    fields = []
    for name, field in record.fields.items():
        ty = field.type
        if isinstance(ty, types.NestedArray) and ty.dtype == types.float64:
            shape = ty.shape[:-1]
            ty = types.NestedArray(LANE, shape) if shape else LANE
        fields.append((name, {"type": ty, "offset": field.offset}))
    return LaneRecord(fields, record.size, record.aligned)


@intrinsic
def as_lanes(typingctx, memory):
    """View a NumPy record or array, whose last axis holds the joints, as one of lanes; it must be aligned."""
    if isinstance(memory, types.Record):
        out = record_of_lanes(memory)

        def codegen(context, builder, sig, args):
            return args[0]

        return out(memory), codegen
    out = types.Array(LANE, memory.ndim - 1, "C")

    def of_array(context, builder, sig, args):
        source = make_array(memory)(context, builder, args[0])
        view = make_array(out)(context, builder)
        shape = cgutils.unpack_tuple(builder, source.shape)[:-1]
        strides = cgutils.unpack_tuple(builder, source.strides)[:-1]
        size = context.get_constant(types.intp, 8 * WIDTH)
        data = builder.bitcast(source.data, DOUBLES.as_pointer())
        populate_array(
            view, data=data, shape=shape, strides=strides, itemsize=size, meminfo=source.meminfo, parent=source.parent
        )
        value = view._getvalue()
        if context.enable_nrt:
            context.nrt.incref(builder, out, value)
        return value

    return out(memory), of_array


def aligned_zeros(shape, dtype):
    """Array of zeros at an address that is a multiple of `ALIGNMENT`."""
    dtype = np.dtype(dtype)
    nbytes = int(np.prod(shape)) * dtype.itemsize
    raw = np.zeros(nbytes + ALIGNMENT, np.uint8)
    start = -raw.ctypes.data % ALIGNMENT
    return raw[start : start + nbytes].view(dtype).reshape(shape)


def lane_dtype(dtype):
    """Layout of `WIDTH` records of `dtype` in lanes: float fields get a last axis, others are shared by all lanes."""
    names, formats, offsets, offset = [], [], [], 0
    for name in dtype.names:
        base, shape = dtype[name].base, dtype[name].shape
        formats.append((base, (*shape, WIDTH) if base == np.float64 else shape))
        names.append(name)
        offsets.append(offset)
        offset += -(-np.dtype(formats[-1]).itemsize // ALIGNMENT) * ALIGNMENT
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": offset})
