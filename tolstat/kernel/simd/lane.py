"""Lanes: one value for each of several joints, in one SIMD register. Kernels accept plain numbers or lanes.

`Lane` is a Numba type whose value is an LLVM vector of doubles, `Mask` one of booleans. Arithmetic, square root and
comparison act on each lane separately with the instructions that plain numbers use, so that a joint has the same bits
in any lane, beside any other joints, or alone. A mask cannot be the condition of an ``if``: kernels select values with
`where`, and skip work with `any_of`, `all_of`.
"""

import math
import operator

from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, overload, register_model

WIDTH = 8 if get_host_cpu_features().get("avx512f") else 4
"""Number of lanes: doubles in a register of 512 or 256 bits. No result depends on it."""

DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
BOOLS = ir.VectorType(ir.IntType(1), WIDTH)


class LaneType(types.Type):
    """`WIDTH` doubles, one per joint."""

    bitwidth = 64 * WIDTH

    def __init__(self):
        super().__init__(name=f"Lane{WIDTH}")

    def unify(self, typingctx, other):
        """Common type of lanes and plain numbers: lanes."""
        return self if isinstance(other, types.Integer | types.Float) else None

    def can_convert_from(self, typingctx, other):
        """Plain numbers convert to lanes: the same value in every lane."""
        from numba.core.typeconv import Conversion

        return Conversion.safe if isinstance(other, types.Integer | types.Float) else None


class MaskType(types.Type):
    """`WIDTH` booleans."""

    def __init__(self):
        super().__init__(name=f"Mask{WIDTH}")

    def unify(self, typingctx, other):
        """Common type of masks and plain booleans: masks."""
        return self if isinstance(other, types.Boolean) else None

    def can_convert_from(self, typingctx, other):
        """Plain booleans convert to masks: the same value in every lane."""
        from numba.core.typeconv import Conversion

        return Conversion.safe if isinstance(other, types.Boolean) else None


LANE, MASK = LaneType(), MaskType()


@register_model(LaneType)
class LaneModel(models.PrimitiveModel):
    """A vector of doubles, in registers and in memory."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, DOUBLES)


@register_model(MaskType)
class MaskModel(models.PrimitiveModel):
    """A vector of bits."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, BOOLS)


def _splat(builder, value, vector_type):
    one = builder.insert_element(ir.Constant(vector_type, ir.Undefined), value, ir.IntType(32)(0))
    first = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, ir.Constant(vector_type, ir.Undefined), first)


@lower_cast(types.Float, LaneType)
@lower_cast(types.Integer, LaneType)
def _number_to_lane(context, builder, fromty, toty, val):
    return _splat(builder, context.cast(builder, val, fromty, types.float64), DOUBLES)


@lower_cast(types.Boolean, MaskType)
def _boolean_to_mask(context, builder, fromty, toty, val):
    return _splat(builder, builder.trunc(val, ir.IntType(1)) if val.type.width > 1 else val, BOOLS)


def _number(ty):
    return isinstance(ty, LaneType | types.Integer | types.Float)


def _operator(function, returns, operands, allowed, emit):
    """Define a Python operator or function for lanes or masks; `emit` (builder, *values) generates its code."""

    class Template(AbstractTemplate):
        def generic(self, args, kws):
            if len(args) == operands and allowed in args and all(_fits(allowed, a) for a in args):
                return signature(returns, *[allowed] * operands)

    infer_global(function)(Template)

    @lower_builtin(function, *[type(allowed)] * operands)
    def lower(context, builder, sig, args):
        return emit(builder, *args)


def _fits(allowed, ty):
    return ty == allowed or isinstance(ty, types.Boolean if allowed == MASK else types.Integer | types.Float)


def _intrinsic_of(name):
    def emit(builder, value):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(DOUBLES, [DOUBLES]), f"llvm.{name}.v{WIDTH}f64"
        )
        return builder.call(function, [value])

    return emit


for _name, _instruction in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    for _function in (getattr(operator, _name), getattr(operator, f"i{_name}")):
        _operator(_function, LANE, 2, LANE, lambda builder, a, b, name=_instruction: getattr(builder, name)(a, b))
_operator(operator.neg, LANE, 1, LANE, lambda builder, a: builder.fneg(a))
for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _operator(_function, MASK, 2, LANE, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))
_operator(operator.ne, MASK, 2, LANE, lambda builder, a, b: builder.fcmp_unordered("!=", a, b))
_operator(operator.and_, MASK, 2, MASK, lambda builder, a, b: builder.and_(a, b))
_operator(operator.or_, MASK, 2, MASK, lambda builder, a, b: builder.or_(a, b))
_operator(operator.invert, MASK, 1, MASK, lambda builder, a: builder.not_(a))
_operator(math.sqrt, LANE, 1, LANE, _intrinsic_of("sqrt"))
_operator(abs, LANE, 1, LANE, _intrinsic_of("fabs"))
_operator(max, LANE, 2, LANE, lambda builder, a, b: builder.select(builder.fcmp_ordered(">", b, a), b, a))
_operator(min, LANE, 2, LANE, lambda builder, a, b: builder.select(builder.fcmp_ordered("<", b, a), b, a))


def _each(function_name):
    """Code generator: a scalar libm call for each lane."""

    def emit(builder, value):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.DoubleType(), [ir.DoubleType()]), function_name
        )
        out = ir.Constant(DOUBLES, ir.Undefined)
        for i in range(WIDTH):
            index = ir.IntType(32)(i)
            out = builder.insert_element(out, builder.call(function, [builder.extract_element(value, index)]), index)
        return out

    return emit


for _function in (math.sin, math.cos, math.tan):
    _operator(_function, LANE, 1, LANE, _each(_function.__name__))


@infer_global(math.atan2)
class _Atan2(AbstractTemplate):
    def generic(self, args, kws):
        if LANE in args:
            return signature(LANE, LANE, LANE)


@lower_builtin(math.atan2, LaneType, LaneType)
def _atan2(context, builder, sig, args):
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(ir.DoubleType(), [ir.DoubleType()] * 2), "atan2"
    )
    out = ir.Constant(DOUBLES, ir.Undefined)
    for i in range(WIDTH):
        index = ir.IntType(32)(i)
        value = builder.call(function, [builder.extract_element(a, index) for a in args])
        out = builder.insert_element(out, value, index)
    return out


@intrinsic
def _select(typingctx, mask, a, b):
    def codegen(context, builder, sig, args):
        return builder.select(*args)

    return LANE(MASK, LANE, LANE), codegen


def _reduce(name):
    def typing(typingctx, mask):
        def codegen(context, builder, sig, args):
            function = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(ir.IntType(1), [BOOLS]), f"llvm.vector.reduce.{name}.v{WIDTH}i1"
            )
            return builder.call(function, args)

        return types.boolean(MASK), codegen

    return intrinsic(typing)


_any, _all = _reduce("or"), _reduce("and")


@intrinsic
def _extract(typingctx, lanes, lane):
    def codegen(context, builder, sig, args):
        return builder.extract_element(*args)

    return types.float64(LANE, types.intp), codegen


ALL = None
"""In place of the number of a lane: the values of all lanes."""


def pick(value, lane):
    """Value of the joint in `lane`, or those in `ALL` lanes; a plain number is returned as it is."""
    return value


@overload(pick)
def _pick(value, lane):
    one = value == LANE and lane != types.none
    return (lambda value, lane: _extract(value, lane)) if one else (lambda value, lane: value)


def fma(a, b, c):
    """Return a b + c; compiled code rounds once."""
    return a * b + c


@intrinsic
def _fused(typingctx, a, b, c):
    vector = LANE in (a, b, c)
    name, ty, emitted = (f"v{WIDTH}f64", LANE, DOUBLES) if vector else ("f64", types.float64, ir.DoubleType())

    def codegen(context, builder, sig, args):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(emitted, [emitted] * 3), f"llvm.fma.{name}"
        )
        return builder.call(function, args)

    return ty(ty, ty, ty), codegen


@overload(fma)
def _fma(a, b, c):
    return lambda a, b, c: _fused(a, b, c)


def where(condition, a, b):
    """`a` where the condition holds, else `b`; both are evaluated."""
    return a if condition else b


def retain(condition, new, old):
    """`new` where the condition holds, else `old`, the value now stored at the place of the result.

    All lanes are stored, which is cheap. With `where`, the compiler would make a masked store, which takes many cycles
    on some processors.
    """
    return new if condition else old


def any_of(condition):
    """Whether the condition holds in any lane."""
    return condition


def all_of(condition):
    """Whether the condition holds in all lanes."""
    return condition


@overload(where, inline="never")
def _where(condition, a, b):
    if condition == MASK:
        return lambda condition, a, b: _select(condition, a, b)
    return lambda condition, a, b: a if condition else b


@intrinsic
def _fenced_select(typingctx, mask, new, old):
    def codegen(context, builder, sig, args):
        fence = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(DOUBLES, [DOUBLES]), f"llvm.arithmetic.fence.v{WIDTH}f64"
        )
        return builder.select(args[0], args[1], builder.call(fence, [args[2]]))

    return LANE(MASK, LANE, LANE), codegen


@overload(retain, inline="never")
def _retain(condition, new, old):
    if condition == MASK:
        return lambda condition, new, old: _fenced_select(condition, new, old)
    return lambda condition, new, old: new if condition else old


@overload(any_of)
def _any_of(condition):
    return (lambda condition: _any(condition)) if condition == MASK else (lambda condition: condition)


@overload(all_of)
def _all_of(condition):
    return (lambda condition: _all(condition)) if condition == MASK else (lambda condition: condition)


def bits_of(condition):
    """Integer whose bit i is the mask's lane i."""
    return int(condition)


def count_of(condition):
    """Number of lanes in which the mask is true."""
    return int(condition)


@intrinsic
def _bits(typingctx, mask):
    def codegen(context, builder, sig, args):
        return builder.zext(builder.bitcast(args[0], ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(MASK), codegen


@intrinsic
def _count(typingctx, mask):
    def codegen(context, builder, sig, args):
        return builder.zext(builder.ctpop(builder.bitcast(args[0], ir.IntType(WIDTH))), ir.IntType(64))

    return types.int64(MASK), codegen


@overload(bits_of)
def _bits_of(condition):
    return (lambda condition: _bits(condition)) if condition == MASK else (lambda condition: int(condition))


@overload(count_of)
def _count_of(condition):
    return (lambda condition: _count(condition)) if condition == MASK else (lambda condition: int(condition))
