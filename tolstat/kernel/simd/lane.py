"""Lanes: one value for each of several joints, in one SIMD register. Kernels accept plain numbers or lanes.

`Lane` is a Numba type whose value is an LLVM vector of doubles, `Single` one of single-precision numbers, `Mask` one of
booleans. Arithmetic, square root and comparison act on each lane separately with the instructions that plain numbers
use, so that a joint has the same bits in any lane, beside any other joints, or alone. A mask cannot be the condition of
an ``if``: kernels select values with `where`, and skip work with `any_of`, `all_of`.
"""

import math
import operator

import numpy as np
from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import cgutils, config, types
from numba.core.datamodel import models
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, overload, register_model

FEATURES = (config.CPU_FEATURES if config.CPU_FEATURES is not None else get_host_cpu_features().flatten()).split(",")
"""What the processor that Numba compiles for can do; ``NUMBA_CPU_NAME`` and ``NUMBA_CPU_FEATURES`` name another one."""
WIDTH = 8 if "+avx512f" in FEATURES else 4 if "+avx" in FEATURES else 2
"""Number of lanes: doubles in a register of 512, 256 or 128 bits (SSE2, NEON). No result depends on it."""

DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
SINGLES = ir.VectorType(ir.FloatType(), WIDTH)
BOOLS = ir.VectorType(ir.IntType(1), WIDTH)


class LaneType(types.Type):
    """`WIDTH` doubles, one per joint."""

    bitwidth = 64 * WIDTH

    def __init__(self):
        super().__init__(name=f"Lane{WIDTH}")

    def unify(self, typingctx, other):
        """Common type of lanes and plain numbers, or lanes of single precision: lanes."""
        return self if isinstance(other, types.Integer | types.Float | SingleType) else None

    def can_convert_from(self, typingctx, other):
        """Plain numbers convert to lanes: the same value in every lane; those of single precision do, too."""
        from numba.core.typeconv import Conversion

        return Conversion.safe if isinstance(other, types.Integer | types.Float | SingleType) else None


class SingleType(types.Type):
    """`WIDTH` numbers of single precision, one per joint."""

    bitwidth = 32 * WIDTH

    def __init__(self):
        super().__init__(name=f"Single{WIDTH}")

    def can_convert_from(self, typingctx, other):
        """Lanes and plain numbers convert by rounding."""
        from numba.core.typeconv import Conversion

        return Conversion.unsafe if isinstance(other, types.Integer | types.Float | LaneType) else None


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


LANE, SINGLE, MASK = LaneType(), SingleType(), MaskType()


def _stored_as(vector):
    """Data model of a type whose values are LLVM's `vector`, in registers and in memory."""

    class Model(models.PrimitiveModel):
        def __init__(self, dmm, fe_type):
            super().__init__(dmm, fe_type, vector)

    return Model


for _type, _vector in ((LaneType, DOUBLES), (SingleType, SINGLES), (MaskType, BOOLS)):
    register_model(_type)(_stored_as(_vector))


def _splat(builder, value, vector_type):
    one = builder.insert_element(ir.Constant(vector_type, ir.Undefined), value, ir.IntType(32)(0))
    first = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, ir.Constant(vector_type, ir.Undefined), first)


@lower_cast(types.Float, LaneType)
@lower_cast(types.Integer, LaneType)
def _number_to_lane(context, builder, fromty, toty, val):
    return _splat(builder, context.cast(builder, val, fromty, types.float64), DOUBLES)


@lower_cast(types.Float, SingleType)
@lower_cast(types.Integer, SingleType)
def _number_to_single(context, builder, fromty, toty, val):
    return _splat(builder, context.cast(builder, val, fromty, types.float32), SINGLES)


@lower_cast(SingleType, LaneType)
def _widen(context, builder, fromty, toty, val):
    return builder.fpext(val, DOUBLES)


@lower_cast(LaneType, SingleType)
def _round(context, builder, fromty, toty, val):
    return builder.fptrunc(val, SINGLES)


@lower_cast(types.Boolean, MaskType)
def _boolean_to_mask(context, builder, fromty, toty, val):
    return _splat(builder, builder.trunc(val, ir.IntType(1)) if val.type.width > 1 else val, BOOLS)


def _operator(function, returns, operands, allowed, emit):
    """Define a Python operator or function for lanes, singles or masks; `emit` (builder, *values) generates code."""

    class Template(AbstractTemplate):
        def generic(self, args, kws):
            if len(args) == operands and _fit(allowed, function, args):
                return signature(returns, *[allowed] * operands)

    infer_global(function)(Template)

    @lower_builtin(function, *[type(allowed)] * operands)
    def lower(context, builder, sig, args):
        return emit(builder, *args)


ARITHMETIC = {
    getattr(operator, f"{prefix}{name}"): f"f{instruction}"
    for name, instruction in (("add", "add"), ("sub", "sub"), ("mul", "mul"), ("truediv", "div"))
    for prefix in ("", "i")
}
"""LLVM's instruction for each operator of singles, beside the minus sign; other functions convert singles to lanes."""


def _fit(allowed, function, args):
    """Whether operands convert to `allowed`. As with plain numbers, a single and a double make a double."""
    if allowed == MASK:
        return MASK in args and all(isinstance(a, MaskType | types.Boolean) for a in args)
    singles = all(a == SINGLE for a in args) and (function in ARITHMETIC or function == operator.neg)
    if allowed == SINGLE:
        return singles
    lanes = (LANE in args or SINGLE in args) and not singles
    return lanes and all(isinstance(a, LaneType | SingleType | types.Integer | types.Float) for a in args)


def _intrinsic_of(name):
    def emit(builder, value):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(DOUBLES, [DOUBLES]), f"llvm.{name}.v{WIDTH}f64"
        )
        return builder.call(function, [value])

    return emit


for _type in (LANE, SINGLE):
    for _function, _instruction in ARITHMETIC.items():
        _operator(_function, _type, 2, _type, lambda builder, a, b, name=_instruction: getattr(builder, name)(a, b))
    _operator(operator.neg, _type, 1, _type, lambda builder, a: builder.fneg(a))
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

    def emit(builder, *values):
        double = ir.DoubleType()
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(double, [double] * len(values)), function_name
        )
        out = ir.Constant(DOUBLES, ir.Undefined)
        for i in range(WIDTH):
            index = ir.IntType(32)(i)
            value = builder.call(function, [builder.extract_element(one, index) for one in values])
            out = builder.insert_element(out, value, index)
        return out

    return emit


for _function, _operands in ((math.sin, 1), (math.cos, 1), (math.tan, 1), (math.atan2, 2)):
    _operator(_function, LANE, _operands, LANE, _each(_function.__name__))


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


def pick(value, lane):
    """Value of the joint in `lane`; a plain number is returned as it is."""
    return value


@overload(pick)
def _pick(value, lane):
    return (lambda value, lane: _extract(value, lane)) if value == LANE else (lambda value, lane: value)


def fma(a, b, c):
    """Return a b + c; compiled code rounds once."""
    return a * b + c


FUSED = {
    (True, False): (f"v{WIDTH}f64", LANE, DOUBLES),
    (True, True): (f"v{WIDTH}f32", SINGLE, SINGLES),
    (False, False): ("f64", types.float64, ir.DoubleType()),
    (False, True): ("f32", types.float32, ir.FloatType()),
}
"""By whether operands are lanes, and all of single precision: LLVM's name, Numba's type, LLVM's type."""


@intrinsic
def _fused(typingctx, a, b, c):
    operands = {a, b, c}
    name, ty, emitted = FUSED[bool(operands & {LANE, SINGLE}), operands <= {SINGLE, types.float32}]

    def codegen(context, builder, sig, args):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(emitted, [emitted] * 3), f"llvm.fma.{name}"
        )
        return builder.call(function, args)

    return ty(ty, ty, ty), codegen


@overload(fma)
def _fma(a, b, c):
    return lambda a, b, c: _fused(a, b, c)


def reciprocal(x):
    """Return 1 / x, in the precision of `x`."""
    return x.dtype.type(1) / x if isinstance(x, np.floating) else 1 / x


@intrinsic
def _inverse(typingctx, x):
    def codegen(context, builder, sig, args):
        (value,) = args
        one = ir.Constant(value.type, [1.0] * WIDTH if x in (LANE, SINGLE) else 1.0)
        return builder.fdiv(one, value)

    return x(x), codegen


@overload(reciprocal)
def _reciprocal(x):
    return lambda x: _inverse(x)


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
    return (lambda condition, a, b: _select(condition, a, b)) if condition == MASK else where


def _fenced_select(ty, emitted, suffix):
    def typing(typingctx, mask, new, old):
        def codegen(context, builder, sig, args):
            fence = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(emitted, [emitted]), f"llvm.arithmetic.fence.v{WIDTH}{suffix}"
            )
            return builder.select(args[0], args[1], builder.call(fence, [args[2]]))

        return ty(MASK, ty, ty), codegen

    return intrinsic(typing)


_retained, _retained_single = _fenced_select(LANE, DOUBLES, "f64"), _fenced_select(SINGLE, SINGLES, "f32")


@overload(retain, inline="never")
def _retain(condition, new, old):
    of_mask = _retained_single if old == SINGLE else _retained
    return (lambda condition, new, old: of_mask(condition, new, old)) if condition == MASK else retain


def bits_of(condition):
    """Integer whose bit i is the mask's lane i."""
    return int(condition)


def count_of(condition):
    """Number of lanes in which the mask is true."""
    return int(condition)


def _integer_of(emit):
    def typing(typingctx, mask):
        def codegen(context, builder, sig, args):
            bits = builder.bitcast(args[0], ir.IntType(WIDTH))
            return builder.zext(emit(builder, bits), ir.IntType(64))

        return types.int64(MASK), codegen

    return intrinsic(typing)


_bits, _count = _integer_of(lambda builder, bits: bits), _integer_of(lambda builder, bits: builder.ctpop(bits))


def _define(function, of_mask):
    """Let compiled code evaluate `function` of a mask by `of_mask`, of a plain boolean as Python does."""

    @overload(function)
    def choose(condition):
        return (lambda condition: of_mask(condition)) if condition == MASK else function


for _function, _of_mask in ((any_of, _any), (all_of, _all), (bits_of, _bits), (count_of, _count)):
    _define(_function, _of_mask)
