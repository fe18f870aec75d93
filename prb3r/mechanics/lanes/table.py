"""Records whose numbers are in lanes: the parameters of a chain once for all lanes, and its state in each of them.

To compiled code such a record has the fields of the plain one (`records.py`).  Fields that all lanes share, and those
that are not floating point numbers, are read from the plain record; all others lie in an array of their own, lane
beside lane.
"""

import math
import operator
from functools import cache

import numpy as np
from numba.core import cgutils, types
from numba.core.cgutils import ir
from numba.core.datamodel import models, register_default
from numba.core.imputils import impl_ret_borrowed, lower_builtin, lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import intrinsic
from numba.np.numpy_support import from_dtype

from prb3r.mechanics.lanes.number import IN_LANES, LANE_VECTOR, LANES

SHARED_BY_LANES = {
    *{"arc", "clamp", "stiffness", "cable_stiffness", "curvature", "rest", "knee", "contact_angle"},
    *{"contact_stiffness", "extra", "load", "yields", "slider", "relaxed", "offset", "friction", "pulley"},
}
"""Fields of records that are the same in all lanes."""


@cache
def record_type(layout: np.dtype) -> types.Record:
    """Numba's type of records of a `layout`; to make one takes as long as to solve a hundred loads."""
    return from_dtype(layout)


@cache
def in_lanes_of(record: types.Record) -> dict[str, tuple[int, tuple[int, ...]]]:
    """Position (in numbers) and shape of each field of a `record` that differs from lane to lane, by its name."""
    places, place = {}, 0
    for name in record.fields:
        kind = record.typeof(name)
        shape = kind.shape if isinstance(kind, types.NestedArray) else ()
        number = kind.dtype if isinstance(kind, types.NestedArray) else kind
        if name not in SHARED_BY_LANES and number == types.float64:
            places[name] = place, tuple(shape)
            place += math.prod(shape)
    return places


def room_in_lanes(records: np.ndarray) -> np.ndarray:
    """(..., width, `LANES`) array of zeros for those numbers of `records` that differ from lane to lane.

    The width is the count of such numbers in a record.
    """
    width = sum(math.prod(shape) for _, shape in in_lanes_of(record_type(records.dtype)).values())
    return np.zeros((*records.shape, width, LANES))


class LaneArray(types.Type):
    """Numba's type of a field of several numbers in lanes."""

    def __init__(self, shape: tuple[int, ...]):
        self.dims = shape
        super().__init__(f"lane array {shape}")


class LaneRecord(types.Type):
    """Numba's type of a record whose numbers are in lanes."""

    in_lanes = True

    def __init__(self, record: types.Record):
        self.record, self.places = record, in_lanes_of(record)
        self.width = sum(math.prod(shape) for _, shape in self.places.values())
        super().__init__(f"lane record({record})")


class LaneTable(types.Type):
    """Numba's type of an array of records in lanes, of one or more dimensions."""

    def __init__(self, array: types.Array):
        self.array, self.entry = array, LaneRecord(array.dtype)  # type: ignore[arg-type]
        super().__init__(f"lane table({array})")


POINTER = types.CPointer(types.float64)


@register_default(LaneArray)
class LaneArrayModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.DoubleType().as_pointer())


@register_default(LaneRecord)
class LaneRecordModel(models.StructModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, [("shared", kind.record), ("numbers", POINTER)])


@register_default(LaneTable)
class LaneTableModel(models.StructModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, [("shared", kind.array), ("numbers", POINTER)])


@intrinsic
def lane_table(typingctx, shared, numbers):
    """Records in lanes, from the plain records `shared` and an array `numbers` of `room_in_lanes`, in compiled code."""
    kind = LaneTable(shared)

    def code(context, builder, sig, args):
        table = cgutils.create_struct_proxy(kind)(context, builder)
        table.shared = args[0]
        table.numbers = context.make_array(numbers)(context, builder, args[1]).data
        return table._getvalue()

    return kind(shared, numbers), code


def _apart(builder, pointer, numbers):
    """Generate code for the address that lies so many numbers in lanes behind `pointer`."""
    return builder.gep(pointer, [builder.mul(numbers, ir.Constant(numbers.type, LANES))])


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    key = operator.getitem

    def generic(self, args, kws):
        kind, place = args
        if isinstance(kind, LaneTable) and isinstance(place, types.Integer):
            array = kind.array
            inner = kind.entry if array.ndim == 1 else LaneTable(types.Array(array.dtype, array.ndim - 1, array.layout))
            return signature(inner, kind, types.intp)
        if isinstance(kind, LaneArray):
            wanted = types.intp if len(kind.dims) == 1 else types.UniTuple(types.intp, len(kind.dims))
            return signature(IN_LANES, kind, wanted)
        return None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    key = operator.setitem

    def generic(self, args, kws):
        kind, _, _ = args
        if isinstance(kind, LaneArray):
            wanted = types.intp if len(kind.dims) == 1 else types.UniTuple(types.intp, len(kind.dims))
            return signature(types.void, kind, wanted, IN_LANES)
        return None


@lower_builtin(operator.getitem, LaneTable, types.intp)
def _entry(context, builder, sig, args):
    kind = sig.args[0]
    table = cgutils.create_struct_proxy(kind)(context, builder, args[0])
    result = cgutils.create_struct_proxy(sig.return_type)(context, builder)
    inner = sig.return_type.record if isinstance(sig.return_type, LaneRecord) else sig.return_type.array
    plain = context.get_function(operator.getitem, signature(inner, kind.array, types.intp))
    result.shared = plain(builder, [table.shared, args[1]])
    count = ir.Constant(args[1].type, kind.entry.width)
    if kind.array.ndim > 1:
        shape = context.make_array(kind.array)(context, builder, table.shared).shape
        for d in range(1, kind.array.ndim):
            count = builder.mul(count, builder.extract_value(shape, d))
    result.numbers = _apart(builder, table.numbers, builder.mul(args[1], count))
    return result._getvalue()


def _address(context, builder, kind, pointer, place):
    """Generate code for the address of one number, at the index `place`, of an array in lanes."""
    if len(kind.dims) == 1:
        index = place
    else:
        parts = cgutils.unpack_tuple(builder, place)
        index = parts[0]
        for part, size in zip(parts[1:], kind.dims[1:], strict=True):
            index = builder.add(builder.mul(index, ir.Constant(index.type, size)), part)
    return builder.bitcast(_apart(builder, pointer, index), LANE_VECTOR.as_pointer())


def _get(context, builder, sig, args):
    return builder.load(_address(context, builder, sig.args[0], *args), align=8)


def _set(context, builder, sig, args):
    builder.store(args[2], _address(context, builder, sig.args[0], *args[:2]), align=8)


for _place in (types.intp, types.UniTuple):
    lower_builtin(operator.getitem, LaneArray, _place)(_get)
    lower_builtin(operator.setitem, LaneArray, _place, IN_LANES)(_set)


@infer_global(len)
class _Length(AbstractTemplate):
    key = len

    def generic(self, args, kws):
        return signature(types.intp, args[0]) if isinstance(args[0], LaneTable | LaneArray) else None


@lower_builtin(len, LaneTable)
def _rows(context, builder, sig, args):
    table = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    return builder.extract_value(context.make_array(sig.args[0].array)(context, builder, table.shared).shape, 0)


@lower_builtin(len, LaneArray)
def _length(context, builder, sig, args):
    return context.get_constant(types.intp, sig.args[0].dims[0])


@infer_getattr
class _Fields(AttributeTemplate):
    key = LaneRecord

    def generic_resolve(self, value, attr):  # type: ignore[override]
        if attr in value.places:
            _, shape = value.places[attr]
            return LaneArray(shape) if shape else IN_LANES
        return self.context.resolve_getattr(value.record, attr)


@infer_getattr
class _Shape(AttributeTemplate):
    key = LaneArray

    def resolve_shape(self, value):
        return types.UniTuple(types.intp, len(value.dims))


def _field(builder, kind, record, name):
    """Generate code for the address of the field `name` in lanes."""
    place, _ = kind.places[name]
    return builder.gep(record.numbers, [ir.Constant(ir.IntType(64), place * LANES)])


@lower_getattr_generic(LaneRecord)
def _get_field(context, builder, kind, value, name):
    record = cgutils.create_struct_proxy(kind)(context, builder, value)
    if name in kind.places:
        there = _field(builder, kind, record, name)
        return (
            there if kind.places[name][1] else builder.load(builder.bitcast(there, LANE_VECTOR.as_pointer()), align=8)
        )
    return context.get_getattr(kind.record, name)(context, builder, kind.record, record.shared, name)


@lower_setattr_generic(LaneRecord)
def _set_field(context, builder, sig, args, name):
    kind, (value, number) = sig.args[0], args
    record = cgutils.create_struct_proxy(kind)(context, builder, value)
    there = builder.bitcast(_field(builder, kind, record, name), LANE_VECTOR.as_pointer())
    builder.store(context.cast(builder, number, sig.args[1], IN_LANES), there, align=8)


@lower_getattr_generic(LaneArray)
def _get_shape(context, builder, kind, value, name):
    sizes = [context.get_constant(types.intp, size) for size in kind.dims]
    return impl_ret_borrowed(
        context, builder, types.UniTuple(types.intp, len(sizes)), cgutils.pack_array(builder, sizes)
    )
