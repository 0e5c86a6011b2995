"""Elementary functions of numbers and of lanes (:mod:`gne_mj.lanes`), the same bits of both.

A library's functions know numbers only, and choose among formulas by branches. These have one
formula, and choose what goes into it: 1 ulp from the exact value at most (tests measure it against
mpmath). Polynomials are interpolants at Chebyshev's nodes, found with 60 digits.
"""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from gne_mj.lanes import LANE, NUMBERS, WIDTH, spread, where
from gne_mj.native import KERNEL, kernel

QUARTER, QUARTER_REST = 0.7853981633974483, 3.061616997868383e-17  # pi/4, and what is left of it
HALF, HALF_REST = 1.5707963267948966, 6.123233995736766e-17
LEAST, MOST = 0.41421356237309503, 2.414213562373095  # tan(pi/8), and 1 over it


@kernel
def arctangent(x):
    """arctan(x): of a quotient t between -tan(pi/8) and that, beyond which pi/4 or pi/2 is added.

    arctan t = t + t z P(z) with z = t^2; P is of degree 10, to 6e-18 of t.
    """
    size = abs(x)
    small, large = size <= LEAST, size > MOST
    above = where(small, size, where(large, -1.0, size - 1.0))
    below = where(small, 1.0, where(large, size, size + 1.0))
    start = where(small, 0.0, where(large, HALF, QUARTER))
    rest = where(small, 0.0, where(large, HALF_REST, QUARTER_REST))
    t = above / below
    z = t * t
    w = z * z
    even = -0.3333333333333333 + w * (
        -0.14285714284666542 + w * (
            -0.09090904578123903 + w * (
                -0.06664511447381948 + w * (-0.0508544973794026 + w * -0.01917688711906226)
            )
        )
    )  # fmt: skip
    odd = 0.1999999999999552 + w * (
        0.11111111015256361 + w * (
            0.07692183190826087 + w * (0.0585814891280221 + w * 0.03923165829558719)
        )
    )  # fmt: skip
    angle = start + (t + (rest + t * (z * (even + z * odd))))
    return where(x < 0.0, -angle, angle)


_ROOT_OF_HALF = 0x3FE6A09E667F3BCD  # the bits of the least double above sqrt(1/2)
LOG_2, LOG_2_REST = 0.6931471803691238, 1.9082149292705877e-10  # ln 2: 32 bits, and the rest


def mantissa_and_exponent(x: float) -> tuple[float, float]:
    """x = mantissa * 2^exponent, the mantissa between sqrt(1/2) and sqrt(2); positive, not tiny."""
    mantissa, exponent = math.frexp(x)
    if mantissa < math.sqrt(0.5):
        return 2.0 * mantissa, exponent - 1.0
    return mantissa, float(exponent)


@overload(mantissa_and_exponent, jit_options=KERNEL)
def _mantissa_and_exponent(x):
    return lambda x: _parts(x)


@intrinsic
def _parts(typingctx: Any, x: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (value,), whole = arguments, ir.IntType(64)
        first, places = whole(_ROOT_OF_HALF), whole(52)
        if value.type == NUMBERS:
            whole = ir.VectorType(whole, WIDTH)
            first, places = spread(builder, first), spread(builder, places)
        bits = builder.bitcast(value, whole)
        exponent = builder.ashr(builder.sub(bits, first), places)
        mantissa = builder.bitcast(builder.sub(bits, builder.shl(exponent, places)), value.type)
        found = mantissa, builder.sitofp(exponent, value.type)
        return context.make_tuple(builder, signature.return_type, found)

    kind = LANE if x == LANE else types.float64
    return types.UniTuple(kind, 2)(kind), codegen


@kernel
def logarithm(x):
    """ln x of a positive, finite number that is not below 1e-300.

    With x = (1 + f) 2^k and s = f/(2 + f): ln(1 + f) = 2 artanh s = 2 s + s z R(z), z = s^2; R is
    of degree 6, to 9e-18 of s. It is summed as f - f^2/2 + s (f^2/2 + z R), where f is exact.
    """
    mantissa, exponent = mantissa_and_exponent(x)
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = 0.666666666666667 + w * (
        0.28571428625975487 + w * (0.18182889125261723 + w * 0.14616449685043406)
    )
    odd = 0.39999999999899505 + w * (0.2222221113479508 + w * 0.15331721600556042)
    half = 0.5 * f * f
    series = s * (half + z * (even + z * odd)) + exponent * LOG_2_REST
    return exponent * LOG_2 - ((half - series) - f)
