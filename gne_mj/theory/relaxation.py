"""Bounds of sums over actions on an ellipsoid cut by a plane, by Lagrange's dual."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS = 120


class Cells(NamedTuple):
    """Where each action's deviation e_a from y* may be, cut into intervals.

    Attributes:
        lower, upper: ends of the intervals, each (K, m).
        inverse: q_a of the ellipsoid sum_a (e_a^2 / q_a + r_a^2 / p_a) <= room, (m,).
        others: p_a, of what moves besides, (m,).
        room: the right side.
    """

    lower: Array
    upper: Array
    inverse: Array
    others: Array
    room: float

    @property
    def left(self) -> Array:
        """The greatest r_a on each interval, (K, m)."""
        nearest = np.clip(0.0, self.lower, self.upper)
        return np.sqrt(np.maximum(self.room - nearest**2 / self.inverse, 0.0) * self.others)


def least_sum(values: Array, cells: Cells, slope: Array, plane: float, *, equality: bool) -> float:
    """A lower bound of sum_a (v_a(e_a) - |slope_a r_a|) where slope'e = plane (or <= plane).

    For all lambda (not negative with <=) and nu > 0 the sum is at least that of
    min (v_a + lambda slope_a e_a + nu e_a^2 / q_a) - slope_a^2 p_a / (4 nu), less
    lambda plane + nu room; each minimum is taken interval by interval, v_a being at least
    ``values`` there. Every choice is a bound.

    Args:
        values: lower bounds of v_a on each interval, (K, m); infinite where e_a cannot be.
        cells: the intervals.
        slope: (m,).
        plane: the right side.
        equality: whether slope'e = plane, else slope'e <= plane.
    """
    from scipy.optimize import minimize  # slow to load, and for certificates only

    lower, upper, inverse, others, room = cells
    if np.count_nonzero(slope) < 2:
        return float(np.sum(np.min(values - np.abs(slope) * cells.left, axis=0)))
    finite = np.where(np.isfinite(values), values, np.min(values, axis=0))
    beside = float(np.sum(slope**2 * others))
    size = float(np.max(np.ptp(finite, axis=0))) + np.sqrt(room * beside)
    radius = np.sqrt(room * float(np.max(inverse)))
    alone = float(np.sum(np.min(values, axis=0))) - np.sqrt(room * beside)
    if size == 0.0 or radius == 0.0:
        return alone

    def dual(point: Array) -> float:
        scaled = size / radius * (point[0] if equality else abs(point[0]))
        nu = size / room * np.exp(point[1])
        at = np.clip(-0.5 * scaled * slope * inverse / nu, lower, upper)
        penalised = values + scaled * slope * at + nu * at * at / inverse
        bound = float(np.sum(np.min(penalised, axis=0))) - beside / (4.0 * nu)
        return scaled * plane + nu * room - bound

    begin = np.array([[0.0, -1.0], [0.5, -1.0], [0.0, 0.5]])
    options = {"maxfev": _STEPS, "initial_simplex": begin}
    found = minimize(dual, begin[0], method="Nelder-Mead", options=options)
    return max(-float(found.fun), alone)
