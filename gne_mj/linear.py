"""Vectors and rows, for native loops that allocate nothing."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from gne_mj.native import intrinsic_or, kernel, kernel_as

LANES = 8  # numbers that are added at once


@kernel
def add_multiple(scale, source, target):
    """target += scale * source, over the length of target."""
    for r in range(len(target)):
        target[r] += scale * source[r]


@kernel
def add_multiples(scales, count, vectors, first, target):
    """target += sum_j scales[j] * vectors[j, first:], over the first ``count`` vectors in order.

    Four of them in one pass, to the bit as one by one.
    """
    n, j = len(target), 0
    for _ in range(count // 4):
        s0, s1, s2, s3 = scales[j], scales[j + 1], scales[j + 2], scales[j + 3]
        v0, v1 = vectors[j][first : first + n], vectors[j + 1][first : first + n]
        v2, v3 = vectors[j + 2][first : first + n], vectors[j + 3][first : first + n]
        for r in range(n):
            target[r] = target[r] + s0 * v0[r] + s1 * v1[r] + s2 * v2[r] + s3 * v3[r]
        j += 4
    for _ in range(count % 4):
        add_multiple(scales[j], vectors[j][first : first + n], target)
        j += 1


def _weighted_sum(out: Any, matrix: Any, weights: Any) -> None:
    out[:] = 0.0
    for row, factors in zip(matrix, weights, strict=True):
        out += row * factors


@intrinsic_or(_weighted_sum)
def weighted_sum(typingctx: Any, out: Any, matrix: Any, weights: Any) -> Any:
    """out (m,) = sum_a matrix[a] * weights[a], both (n, m), added in this order.

    Rows are short, so that a loop over each would mostly begin and end. This one takes LANES
    entries at a time, fewer by a mask at the end.
    """

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, rows, factors = (
            make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args, arguments, strict=True)
        )
        vectors, whole = _Vectors(builder), cgutils.intp_t
        count, width = cgutils.unpack_tuple(builder, rows.shape)
        begin, step = whole(0), whole(LANES)
        with cgutils.for_range_slice(builder, begin, width, step) as (first, _):
            mask = vectors.below(builder.sub(width, first))
            total = cgutils.alloca_once_value(builder, vectors.zero)
            builder.store(vectors.zero, total)
            with cgutils.for_range(builder, count) as loop:
                at = builder.add(builder.mul(loop.index, width), first)
                a, b = (vectors.load(each.data, at, mask) for each in (rows, factors))
                builder.store(builder.fadd(builder.load(total), builder.fmul(a, b)), total)
            vectors.store(builder.load(total), target.data, first, mask)
        return context.get_dummy_value()

    return types.none(out, matrix, weights), codegen


def add_part(factor: float, source: Any, first: int, target: Any, begin: int, count: int) -> None:
    """target[begin + c] += factor * source[first + c] for c < count, both taken as flat.

    Arrays are contiguous. Native code does it as :func:`weighted_sum`, and looks at no number.
    """
    row, out = source.reshape(-1), target.reshape(-1)
    for c in range(count):
        out[begin + c] += factor * row[first + c]


@intrinsic
def _add_part(
    typingctx: Any, factor: Any, source: Any, first: Any, target: Any, begin: Any, count: Any
) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        scale, given, first, taken, begin, count = arguments
        rows, out = (
            make_array(signature.args[k])(context, builder, value).data
            for k, value in ((1, given), (3, taken))
        )
        vectors, whole = _Vectors(builder), cgutils.intp_t
        scales = vectors.everywhere(scale)
        with cgutils.for_range_slice(builder, whole(0), count, whole(LANES)) as (c, _):
            mask = vectors.below(builder.sub(count, c))
            at = builder.add(begin, c)
            old = vectors.load(out, at, mask)
            more = vectors.load(rows, builder.add(first, c), mask)
            vectors.store(builder.fadd(old, builder.fmul(scales, more)), out, at, mask)
        return context.get_dummy_value()

    place = types.intp
    return types.none(types.float64, source, place, target, place, place), codegen


@kernel
def _add_native(factor, source, first, target, begin, count):
    _add_part(factor, source, first, target, begin, count)


kernel_as(_add_native, add_part)


class _Vectors:
    """LLVM code for LANES numbers at once."""

    def __init__(self, builder: Any) -> None:
        self.builder = builder
        self.kind = ir.VectorType(ir.DoubleType(), LANES)
        self.mask = ir.VectorType(ir.IntType(1), LANES)
        self.zero = ir.Constant(self.kind, [0.0] * LANES)
        self.align = ir.IntType(32)(8)

    def below(self, count: Any) -> Any:
        """Which lanes are among the first ``count``."""
        lanes = ir.VectorType(cgutils.intp_t, LANES)
        numbers = ir.Constant(lanes, [cgutils.intp_t(lane) for lane in range(LANES)])
        return self.builder.icmp_signed("<", numbers, self.everywhere(count))

    def everywhere(self, value: Any) -> Any:
        """A vector that has a value in each place."""
        kind = ir.VectorType(value.type, LANES)
        one = self.builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.IntType(32)(0))
        first = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return self.builder.shuffle_vector(one, one, first)

    def load(self, data: Any, at: Any, mask: Any) -> Any:
        """Those entries from ``at`` on that the mask has, zeros elsewhere."""
        arguments = [self.builder.gep(data, [at]), self.align, mask, self.zero]
        return self._call("load", self.kind, arguments)

    def store(self, values: Any, data: Any, at: Any, mask: Any) -> None:
        """Put those that the mask has."""
        arguments = [values, self.builder.gep(data, [at]), self.align, mask]
        self._call("store", ir.VoidType(), arguments)

    def _call(self, what: str, result: Any, arguments: list[Any]) -> Any:
        kind = ir.FunctionType(result, [each.type for each in arguments])
        name = f"llvm.masked.{what}.v{LANES}f64.p0"
        function = cgutils.get_or_insert_function(self.builder.module, kind, name)
        return self.builder.call(function, arguments)
