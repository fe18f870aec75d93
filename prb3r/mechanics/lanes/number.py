"""Numbers in lanes (SIMD): the same arithmetic on several equilibria at once, in the wide registers of the processor.

A number in lanes is one type for compiled code, so that the same text of a kernel serves one equilibrium and several.
Where lanes differ, kernels use three functions: `where` takes one of two numbers lane by lane, `some` and `every` tell
whether a condition holds in at least one lane or in all.  For plain numbers they work as with a single lane.
"""

import math
import operator
from typing import Any

from numba.core import cgutils, types
from numba.core.cgutils import ir
from numba.core.datamodel import models, register_default
from numba.core.imputils import (
    lower_builtin,
    lower_cast,
)
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

LANES = 8
"""Number of lanes: as many doubles as the widest registers hold; on narrower ones they are split into several parts."""
LANE_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
MASK_VECTOR = ir.VectorType(ir.IntType(1), LANES)


class Lanes(types.Type):
    """Numba's type of a number in lanes: one double in each lane."""

    in_lanes = True

    def __init__(self):
        super().__init__("lanes")

    def can_convert_from(self, typingctx, other):
        """A plain number converts to the same number in every lane."""
        return Conversion.safe if isinstance(other, types.Number) else None

    def unify(self, typingctx, other):
        """A variable that is a plain number in one branch and a number in lanes in another is one in lanes."""
        return self if isinstance(other, types.Number) else None


class LaneMask(types.Type):
    """Numba's type of a condition in lanes: one truth value in each lane."""

    def __init__(self):
        super().__init__("lane mask")


IN_LANES, LANE_MASK = Lanes(), LaneMask()


@register_default(Lanes)
class LanesModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, LANE_VECTOR)


@register_default(LaneMask)
class LaneMaskModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, MASK_VECTOR)


def spread(builder, value):
    """Generate code for a vector with the plain double `value` in every lane."""
    first = builder.insert_element(ir.Constant(LANE_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    order = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(LANE_VECTOR, ir.Undefined), order)


@lower_cast(types.Float, Lanes)
@lower_cast(types.Integer, Lanes)
def number_to_lanes(context, builder, fromty, toty, value):
    return spread(builder, context.cast(builder, value, fromty, types.float64))


# Arithmetic -----------------------------------------------------------------------------------------------------------


def _in_lanes(args) -> bool:
    """Whether all types `args` are numbers, at least one of them in lanes."""
    return IN_LANES in args and all(kind is IN_LANES or isinstance(kind, types.Number) for kind in args)


def _define(function: Any, count: int, result: types.Type, emit: Any) -> None:
    """Let compiled code call `function` with `count` arguments in lanes; `emit` generates the code of the call."""
    kinds = (IN_LANES,) * count

    class Template(AbstractTemplate):
        key = function

        def generic(self, args, kws):
            return signature(result, *kinds) if len(args) == count and _in_lanes(args) else None

    infer_global(function)(Template)
    lower_builtin(function, *kinds)(lambda context, builder, sig, args: emit(context, builder, *args))


def _intrinsic(name: str, count: int) -> Any:
    """A code generator that calls the LLVM operation `name` on `count` vectors."""

    def emit(context, builder, *args):
        kind = ir.FunctionType(LANE_VECTOR, [LANE_VECTOR] * count)
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{LANES}f64"), args)

    return emit


def _one_by_one(function: Any, count: int) -> Any:
    """A code generator that calls a function of `count` plain numbers for one lane after the other."""

    def emit(context, builder, *args):
        plain = context.get_function(function, signature(types.float64, *(types.float64,) * count))
        result = ir.Constant(LANE_VECTOR, ir.Undefined)
        for lane in range(LANES):
            place = ir.Constant(ir.IntType(32), lane)
            value = plain(builder, [builder.extract_element(vector, place) for vector in args])
            result = builder.insert_element(result, value, place)
        return result

    return emit


for _operators, _emit in (
    ((operator.add, operator.iadd), lambda context, builder, a, b: builder.fadd(a, b)),
    ((operator.sub, operator.isub), lambda context, builder, a, b: builder.fsub(a, b)),
    ((operator.mul, operator.imul), lambda context, builder, a, b: builder.fmul(a, b)),
    ((operator.truediv, operator.itruediv), lambda context, builder, a, b: builder.fdiv(a, b)),
    ((operator.pow, operator.ipow), _one_by_one(operator.pow, 2)),
):
    for _operator in _operators:
        _define(_operator, 2, IN_LANES, _emit)
for _operator, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _define(_operator, 2, LANE_MASK, lambda context, builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))
_define(operator.ne, 2, LANE_MASK, lambda context, builder, a, b: builder.fcmp_unordered("!=", a, b))
_define(operator.neg, 1, IN_LANES, lambda context, builder, a: builder.fneg(a))
_define(abs, 1, IN_LANES, _intrinsic("llvm.fabs", 1))
_define(math.sqrt, 1, IN_LANES, _intrinsic("llvm.sqrt", 1))
_define(math.copysign, 2, IN_LANES, _intrinsic("llvm.copysign", 2))
for _function, _count in ((math.exp, 1), (math.cos, 1), (math.sin, 1), (math.tanh, 1), (math.atan2, 2)):
    _define(_function, _count, IN_LANES, _one_by_one(_function, _count))


# Where lanes part ways ------------------------------------------------------------------------------------------------


def where(condition, a, b):
    """In each lane `a` if the condition holds there, else `b`; both are evaluated."""
    return a if condition else b


def some(condition):
    """Whether the condition holds in at least one lane."""
    return condition


def every(condition):
    """Whether the condition holds in all lanes."""
    return condition


@infer_global(where)
class _Where(AbstractTemplate):
    key = where

    def generic(self, args, kws):
        condition, *numbers = args
        if condition is LANE_MASK and all(kind is IN_LANES or isinstance(kind, types.Number) for kind in numbers):
            return signature(IN_LANES, LANE_MASK, IN_LANES, IN_LANES)
        if isinstance(condition, types.Boolean):
            return signature(types.float64, types.boolean, types.float64, types.float64)
        return None


@lower_builtin(where, LANE_MASK, IN_LANES, IN_LANES)
@lower_builtin(where, types.boolean, types.float64, types.float64)
def _select(context, builder, sig, args):
    return builder.select(*args)


class _Test(AbstractTemplate):
    def generic(self, args, kws):
        return signature(types.boolean, types.boolean if isinstance(args[0], types.Boolean) else args[0])


for _function, _sign, _bits in ((some, "!=", 0), (every, "==", 2**LANES - 1)):
    infer_global(_function)(type("_Test", (_Test,), {"key": _function}))
    lower_builtin(_function, types.boolean)(lambda context, builder, sig, args: args[0])
    lower_builtin(_function, LANE_MASK)(
        lambda context, builder, sig, args, sign=_sign, bits=_bits: builder.icmp_unsigned(
            sign, builder.bitcast(args[0], ir.IntType(LANES)), ir.Constant(ir.IntType(LANES), bits)
        )
    )
