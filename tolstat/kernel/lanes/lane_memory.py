"""Lanes in memory: NumPy records whose float fields have a last axis that holds the joints.

A record of one joint, of width 1, is read as plain numbers.
"""

from types import MappingProxyType

import numpy as np
from numba import typeof
from numba.core import types
from numba.core.datamodel import models
from numba.extending import intrinsic, lower_getattr, overload, register_model

from tolstat.common.cardan import CARDAN
from tolstat.common.parameters import numbers, numbers_of
from tolstat.kernel.simd.lane import LANE, SINGLE, WIDTH

ALIGNMENT = 8 * WIDTH
"""Alignment of every lane in memory, bytes."""


class LaneRecord(types.Record):
    """A record of lanes: a NumPy record whose float fields have a last axis of joints.

    The numbers of the mechanism are `constants` of the code, which loops over its parts are unrolled with.
    """

    constants = MappingProxyType({})

    @property
    def dtype(self):
        """Equivalent NumPy type: bytes without structure."""
        return np.dtype((np.void, self.size))

    def typeof(self, key):
        """Numba type of a constant or a field."""
        if key not in self.constants:
            return super().typeof(key)
        constant = typeof(self.constants[key])
        return constant.copy(readonly=True) if isinstance(constant, types.Array) else types.intp


@register_model(LaneRecord)
class LaneRecordModel(models.RecordModel):
    """A pointer, as for any record."""


def record_of_lanes(record):
    """Numba type of a record whose float fields are lanes; `record` is the type of the NumPy record."""
    fields, lanes_of = [], {types.float64: LANE, types.float32: SINGLE}
    constants = numbers_of(record)
    for name, field in record.fields.items():
        if name in constants:
            continue
        ty = field.type
        if isinstance(ty, types.NestedArray) and ty.dtype in lanes_of:
            shape, value = ty.shape[:-1], lanes_of[ty.dtype] if ty.shape[-1] == WIDTH else ty.dtype
            ty = types.NestedArray(value, shape) if shape else value
        fields.append((name, {"type": ty, "offset": field.offset}))
    of_lanes = LaneRecord(fields, record.size, record.aligned)
    of_lanes.constants = {name: value if value.ndim > 0 else int(value) for name, value in constants.items()}
    return of_lanes


def _constant(name):
    """Code of an attribute of `LaneRecord` that is one of its constants."""

    def lower(context, builder, record, value):
        return context.get_constant_generic(builder, record.typeof(name), record.constants[name])

    return lower


for _name in numbers(CARDAN):
    lower_getattr(LaneRecord, _name)(_constant(_name))


def as_lanes(memory):
    """View a NumPy record whose float fields' last axis holds the joints as one of lanes; it must be aligned.

    Without compilation the record has one joint, and is the only one of its array.
    """
    fields = {name: (_without_last_axis(field[0]), field[1]) for name, field in memory.dtype.fields.items()}
    names, (formats, offsets) = list(fields), zip(*fields.values(), strict=True)
    plain = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": memory.dtype.itemsize})
    return memory.base.view(plain).view(np.recarray)[0]


def _without_last_axis(dtype):
    return np.dtype((dtype.base, dtype.shape[:-1])) if dtype.base.kind == "f" else dtype


@intrinsic
def _as_lanes(typingctx, memory):
    def codegen(context, builder, sig, args):
        return args[0]

    return record_of_lanes(memory)(memory), codegen


@overload(as_lanes)
def _as_lanes_of(memory):
    return lambda memory: _as_lanes(memory)


def aligned_zeros(shape, dtype):
    """Array of zeros at an address that is a multiple of `ALIGNMENT`."""
    dtype = np.dtype(dtype)
    nbytes = int(np.prod(shape)) * dtype.itemsize
    raw = np.zeros(nbytes + ALIGNMENT, np.uint8)
    start = -raw.ctypes.data % ALIGNMENT
    return raw[start : start + nbytes].view(dtype).reshape(shape)


def lane_dtype(dtype, width=WIDTH):
    """Layout of `width` records of `dtype` in lanes: float fields get a last axis, others are shared by all lanes."""
    names, formats, offsets, offset = [], [], [], 0
    for name in dtype.names:
        base, shape = dtype[name].base, dtype[name].shape
        formats.append((base, (*shape, width) if base.kind == "f" else shape))
        names.append(name)
        offsets.append(offset)
        offset += -(-np.dtype(formats[-1]).itemsize // ALIGNMENT) * ALIGNMENT
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": offset})
