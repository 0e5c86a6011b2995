"""Derivatives by central differences, with an estimate of their own error."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Steps of one stencil: h, h/4, h/16, ...
STEPS = 8
_RATIO = 4.0
# Values are taken to be right to so many units of their last place
_ROUNDING = 16.0 * np.finfo(np.float64).eps


def steps(reach: float) -> Array:
    """The steps h of a stencil whose greatest is ``reach``, shape (STEPS,)."""
    return np.array([reach / _RATIO**n for n in range(STEPS)])


def derivative(ahead: Array, behind: Array, h: Array, around: float = 0.0) -> tuple[float, float]:
    """The derivative of f at 0, and an estimate of its error.

    One step of Richardson's extrapolation for each pair of neighbouring steps. Long steps suffer
    from curvature and short ones from rounding; the error is how much three extrapolations in a row
    differ, with what rounding of values and arguments can do, and the result where that is least.

    Args:
        ahead: f(h), shape (STEPS,).
        behind: f(-h), shape (STEPS,).
        h: as :func:`steps` gives them.
        around: size of the arguments, or of what f subtracts from them: near a bound f is small
            because terms of that size cancel.
    """
    quotients = (ahead - behind) / (2.0 * h)
    weight = _RATIO**2
    better = (weight * quotients[1:] - quotients[:-1]) / (weight - 1.0)
    change = np.abs(np.diff(better))
    spread = np.maximum(change[1:], change[:-1])
    size = max(float(np.max(np.abs(ahead))), float(np.max(np.abs(behind))))
    sizes = np.maximum(size, around * np.abs(better[1:-1]))
    error = spread + _ROUNDING * sizes / h[2 : 2 + len(spread)]
    best = int(np.argmin(error))
    return float(better[best + 1]), float(error[best])
