"""Lanes: as many runs' numbers side by side as a vector of the processor holds.

A kernel that is compiled for arrays of lanes does for eight runs at once what it does for one when
it is compiled for arrays of doubles, and to the same bits: every operation of a lane is that of
IEEE 754 on its own number, in the order that the kernel is written in. So what becomes of a run
depends neither on which others share its vector nor on whether any do.

Lanes know arithmetic, comparisons, ``abs``, ``min``, ``max``, squares, ``np.sqrt``, ``np.floor``
and the functions of :mod:`gne_mj.elementary`. A comparison of lanes is a mask, which ``&``, ``|``
and ``not`` know and no ``if`` does: where a kernel must choose by what it computes, it says
:func:`where`, which takes numbers too. A kernel that branches on lanes is refused by the compiler.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, lower_cast, models, overload, register_model
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from gne_mj.native import KERNEL
from gne_mj.parameter_block import array_of, entry_of

WIDTH = 8  # doubles in a vector
NUMBERS = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)


class _Lane(types.Type):
    """So many doubles, one of each run."""

    def __init__(self) -> None:
        super().__init__(name="lane")

    def can_convert_from(self, _typing: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, _typing: Any, other: Any) -> Any:
        return self if isinstance(other, types.Float | types.Integer) else None


class _Mask(types.Type):
    """So many truth values."""

    def __init__(self) -> None:
        super().__init__(name="mask")

    def can_convert_from(self, _typing: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, types.Boolean) else None

    def unify(self, _typing: Any, other: Any) -> Any:
        return self if isinstance(other, types.Boolean) else None


LANE, MASK = _Lane(), _Mask()


@register_model(_Lane)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, NUMBERS)


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


def spread(builder: Any, value: Any) -> Any:
    """For intrinsics: LLVM code for a vector that has a value in each place."""
    kind = ir.VectorType(value.type, WIDTH)
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, one, everywhere)


@lower_cast(types.Float, LANE)
@lower_cast(types.Integer, LANE)
@lower_cast(types.IntegerLiteral, LANE)
def _to_lane(context: Any, builder: Any, given: Any, kind: Any, value: Any) -> Any:
    return spread(builder, context.cast(builder, value, given, types.float64))


@lower_cast(types.Boolean, MASK)
@lower_cast(types.BooleanLiteral, MASK)
def _to_mask(context: Any, builder: Any, given: Any, kind: Any, value: Any) -> Any:
    return spread(builder, context.cast(builder, value, given, types.boolean))


def _is_lane(kind: Any) -> bool:
    return isinstance(kind, _Lane)


def _is_number(kind: Any) -> bool:
    return isinstance(kind, _Lane | types.Float | types.Integer)


def _is_truth(kind: Any) -> bool:
    return isinstance(kind, _Mask | types.Boolean)


def _declare(
    function: Any, of: Any, result: Any, fits: Callable[[Any], bool], count: int, write: Any
) -> None:
    """Teach numba an operation whose arguments all become ``of``, one at least being it."""

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != count or of not in args or not all(map(fits, args)):
                return None
            return signature(result, *[of] * count)

    Template.key = function
    infer_global(function)(Template)
    lower_builtin(function, *[of] * count)(
        lambda context, builder, kind, arguments: write(builder, *arguments)
    )


for _names, _write in (
    (("add", "iadd"), lambda builder, a, b: builder.fadd(a, b)),
    (("sub", "isub"), lambda builder, a, b: builder.fsub(a, b)),
    (("mul", "imul"), lambda builder, a, b: builder.fmul(a, b)),
    (("truediv", "itruediv"), lambda builder, a, b: builder.fdiv(a, b)),
):
    for _name in _names:
        _declare(getattr(operator, _name), LANE, LANE, _is_number, 2, _write)
for _name, _sign in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("eq", "==")):
    _declare(
        getattr(operator, _name), LANE, MASK, _is_number, 2,
        lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b),
    )  # fmt: skip
_declare(
    operator.ne, LANE, MASK, _is_number, 2,
    lambda builder, a, b: builder.fcmp_unordered("!=", a, b),
)  # fmt: skip
_declare(operator.neg, LANE, LANE, _is_number, 1, lambda builder, a: builder.fneg(a))
for _names, _write in (
    (("and_", "iand"), lambda builder, a, b: builder.and_(a, b)),
    (("or_", "ior"), lambda builder, a, b: builder.or_(a, b)),
):
    for _name in _names:
        _declare(getattr(operator, _name), MASK, MASK, _is_truth, 2, _write)
_declare(operator.not_, MASK, MASK, _is_truth, 1, lambda builder, a: builder.not_(a))


def _of_llvm(name: str) -> Any:
    """What calls one of LLVM's own functions of a vector."""

    def write(builder: Any, value: Any) -> Any:
        kind = ir.FunctionType(NUMBERS, [NUMBERS])
        function = cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{WIDTH}f64")
        return builder.call(function, [value])

    return write


_declare(abs, LANE, LANE, _is_number, 1, _of_llvm("llvm.fabs"))
_declare(np.sqrt, LANE, LANE, _is_number, 1, _of_llvm("llvm.sqrt"))
_declare(np.floor, LANE, LANE, _is_number, 1, _of_llvm("llvm.floor"))


def where(mask: Any, there: Any, elsewhere: Any) -> Any:
    """``there`` where the mask holds, else ``elsewhere``; both are computed, lanes or not."""
    return there if mask else elsewhere


@overload(where, jit_options=KERNEL)
def _where(mask, there, elsewhere):
    if isinstance(mask, _Mask):
        return lambda mask, there, elsewhere: _select(mask, there, elsewhere)
    if isinstance(mask, types.Boolean):
        return lambda mask, there, elsewhere: there if mask else elsewhere
    return None


@intrinsic
def _select(typingctx: Any, mask: Any, there: Any, elsewhere: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    kind = MASK if _is_truth(there) else LANE
    return kind(MASK, kind, kind), codegen


@overload(max, jit_options=KERNEL)
def _max(a, b):
    """As numba has it of numbers: the second one where they do not compare."""
    if (_is_lane(a) or _is_lane(b)) and _is_number(a) and _is_number(b):
        return lambda a, b: _select(a > b, a, b)
    return None


@overload(min, jit_options=KERNEL)
def _min(a, b):
    if (_is_lane(a) or _is_lane(b)) and _is_number(a) and _is_number(b):
        return lambda a, b: _select(a < b, a, b)
    return None


@overload(operator.pow, jit_options=KERNEL)
def _power(a, b):
    if _is_lane(a) and getattr(b, "literal_value", None) == 2:
        return lambda a, b: a * a
    return None


@overload(int, jit_options=KERNEL)
def _int(x):
    """A whole number among the parameters, which all runs of one structure share."""
    return (lambda x: _first(x)) if _is_lane(x) else None


@intrinsic
def _first(typingctx: Any, x: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first = builder.extract_element(arguments[0], ir.IntType(32)(0))
        return builder.fptosi(first, cgutils.intp_t)

    return types.int64(LANE), codegen


@intrinsic
def bits_of(typingctx: Any, mask: Any) -> Any:
    """A mask as a whole number: bit l is lane l."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.zext(bits, cgutils.intp_t)

    return types.int64(MASK), codegen


@intrinsic
def mask_of(typingctx: Any, bits: Any) -> Any:
    """And back."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(builder.trunc(arguments[0], ir.IntType(WIDTH)), _BITS)

    return MASK(types.int64), codegen


@intrinsic
def power_of_two(typingctx: Any, exponent: Any) -> Any:
    """2^exponent of lanes that hold whole numbers, exactly."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole = ir.VectorType(ir.IntType(64), WIDTH)
        biased = builder.add(
            builder.fptosi(arguments[0], whole), spread(builder, ir.IntType(64)(1023))
        )
        bits = builder.shl(biased, spread(builder, ir.IntType(64)(52)))
        return builder.bitcast(bits, NUMBERS)

    return LANE(LANE), codegen


_ARRAY = types.Array(LANE, 1, "C")


def _place(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
    """Where an entry is: from the start, unless the kernel says a negative number itself."""
    array = make_array(_ARRAY)(context, builder, arguments[0])
    index = context.cast(builder, arguments[1], kind, types.intp)
    if getattr(kind, "literal_value", 0) < 0:
        index = builder.add(index, array.nitems)
    return builder.gep(array.data, [index])


@lower_builtin(operator.getitem, _ARRAY, types.Integer)
def _get(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Numba would ask at every entry whether the index is negative, half of a loop's time."""
    return builder.load(_place(context, builder, signature.args[1], arguments))


@lower_builtin(operator.setitem, _ARRAY, types.Integer, LANE)
def _set(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    builder.store(arguments[2], _place(context, builder, signature.args[1], arguments))


@intrinsic
def lanes_at(typingctx: Any, address: Any, length: Any) -> Any:
    """The array of so many lanes at an address, a multiple of a lane's 64 bytes."""
    return array_of(_ARRAY)


@intrinsic
def lanes(typingctx: Any, parameter_block: Any, index: Any) -> Any:
    """The array of lanes at this index of the parameter block at an address."""
    return entry_of(_ARRAY)


def empty(length: int) -> NDArray[np.float64]:
    """Room (length, WIDTH) for so many lanes, where lanes may lie."""
    flat = np.empty((length + 1) * WIDTH)
    first = -(flat.ctypes.data // 8) % WIDTH
    return flat[first : first + length * WIDTH].reshape(length, WIDTH)
