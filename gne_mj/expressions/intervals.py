"""Bounds of dF/dy over a box: a game's kernels as plain Python, given intervals for numbers."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Box

_WIDER = 1e-12  # relative, beyond all rounding of some thousand operations
_RISING = ("exp", "expm1", "log", "log1p", "sqrt", "arctan", "sinh", "tanh", "arcsinh")


class Interval:
    """All numbers from ``low`` to ``high``; what need not be a number is unbounded."""

    def __init__(self, low: float, high: float) -> None:
        known = low <= high  # false of what is not a number
        self.low, self.high = (float(low), float(high)) if known else (-np.inf, np.inf)

    def __add__(self, other: Any) -> "Interval":
        o = interval(other)
        return Interval(self.low + o.low, self.high + o.high)

    def __neg__(self) -> "Interval":
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Any) -> "Interval":
        return self + -interval(other)

    def __rsub__(self, other: Any) -> "Interval":
        return interval(other) - self

    def __mul__(self, other: Any) -> "Interval":
        o = interval(other)
        with np.errstate(all="ignore"):
            ends = [np.float64(a) * b for a in (self.low, self.high) for b in (o.low, o.high)]
        return Interval(min(ends), max(ends)) if np.all(np.isfinite(ends)) else EVERYTHING

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other: Any) -> "Interval":
        o = interval(other)
        if o.low <= 0.0 <= o.high:
            return EVERYTHING
        return self * Interval(1.0 / o.high, 1.0 / o.low)

    def __rtruediv__(self, other: Any) -> "Interval":
        return interval(other) / self

    def __pow__(self, exponent: Any) -> "Interval":
        whole = not isinstance(exponent, Interval) and exponent == int(exponent) >= 0
        if not whole:
            return (self.log() * exponent).exp()
        ends = sorted([self.low ** int(exponent), self.high ** int(exponent)])
        over = exponent % 2 == 0 and self.low <= 0.0 <= self.high
        return Interval(0.0 if over else ends[0], ends[1])

    def __rpow__(self, base: Any) -> "Interval":
        return interval(base) ** self

    def __abs__(self) -> "Interval":
        ends = sorted([abs(self.low), abs(self.high)])
        return Interval(0.0 if self.low <= 0.0 <= self.high else ends[0], ends[1])

    def cos(self) -> "Interval":
        """Its least and greatest value, at ends or at multiples of pi between."""
        ends = [np.cos(self.low), np.cos(self.high)]
        if not self.high - self.low < 2.0 * np.pi:
            return Interval(-1.0, 1.0)
        between = range(int(np.ceil(self.low / np.pi)), int(np.floor(self.high / np.pi)) + 1)
        ends += [1.0 if k % 2 == 0 else -1.0 for k in between]
        return Interval(min(ends), max(ends))

    def sin(self) -> "Interval":
        """As the cosine of what is a quarter turn before."""
        return (self - 0.5 * np.pi).cos()

    def __getattr__(self, name: str) -> Any:
        """Functions that only rise, by their ends; of others nothing is known."""
        if name.startswith("_"):
            raise AttributeError(name)

        def function() -> Interval:
            if name not in _RISING:
                return EVERYTHING
            with np.errstate(all="ignore"):
                return Interval(getattr(np, name)(self.low), getattr(np, name)(self.high))

        return function


EVERYTHING = Interval(-np.inf, np.inf)


def interval(value: Any) -> Interval:
    """A number as an interval."""
    return value if isinstance(value, Interval) else Interval(value, value)


def jacobian_bounds(
    kernels: ModuleType, q: NDArray[np.float64], sizes: tuple[int, ...]
) -> Callable[[Box], Box]:
    """What maps a box of actions to bounds of every entry of dF/dy over it, each (m, m)."""
    owner = np.repeat(np.arange(len(sizes)), sizes)

    def bounds(box: Box) -> Box:
        y = np.array([Interval(*ends) for ends in zip(*box, strict=True)], dtype=object)
        lower, upper = np.zeros((2, len(owner), len(owner)))
        for a, i in enumerate(owner.tolist()):
            row: list[Any] = [0.0] * len(owner)
            kernels.add_cost_hessian(q, i, a, y, 1.0, row)
            found = [interval(entry) for entry in row]
            lower[a], upper[a] = [f.low for f in found], [f.high for f in found]
        return lower - _WIDER * np.abs(lower), upper + _WIDER * np.abs(upper)

    return bounds
