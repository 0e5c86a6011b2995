"""Equalities as narrow bands: a barrier needs an inside, and the band's multiplier is theirs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Equality:
    """An equality e(y) = 0 that a constraint, e^2 - w^2 <= 0, keeps up to w.

    Attributes:
        name: of the equality.
        constraint: number of the constraint that is its band.
        error: maps profiles (samples, m) to e, (samples,).
        width: w > 0.
    """

    name: str
    constraint: int
    error: Callable[[Array], Array]
    width: float


def multipliers(equalities: Sequence[Equality], y: Array, weights: Array) -> Array:
    """The multiplier of each equality, of either sign: its upper side's less its lower side's.

    With the band's multiplier lambda the equality's push is lambda d(e^2 - w^2) = 2 lambda e de.

    Args:
        equalities: of a game.
        y: (m,) where.
        weights: (p,) multipliers of the game's constraints.
    """
    return np.array([2.0 * weights[each.constraint] * error_of(each, y) for each in equalities])


def error_of(equality: Equality, y: Array) -> float:
    """e at one profile (m,)."""
    return float(equality.error(np.asarray(y)[None])[0])
