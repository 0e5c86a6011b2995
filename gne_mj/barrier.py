"""Log barrier of the shared constraints [eq:logbarrier]: phi(y) = -rho sum_l log(-g_l(y)).

Its gradient is sum_l w_l dg_l/dy with the weights w_l = rho / (-g_l(y)), which at the penalised
equilibrium are the multipliers. Outside the interior phi is infinite and has no gradient: the
kernels report that and never clip a constraint's value. A game that is tightened by t >= 0 has a
barrier of g + t < 0 in place of g < 0. The penalty may fall in time (:class:`Schedule`).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput
from gne_mj.game import Game
from gne_mj.native import kernel

# Entries of a schedule's numbers, and its kinds
KIND, START, FLOOR, FALL = range(4)
CONSTANT, EXPONENTIAL, RECIPROCAL, HALVING = range(4)
SCHEDULES = {"exponential": EXPONENTIAL, "reciprocal": RECIPROCAL, "halving": HALVING}


@dataclass(frozen=True)
class Schedule:
    """How the penalty falls from its value at the start to a floor, with time constant T.

    Args:
        kind: "exponential", rho(t) = start exp(-t/T); "reciprocal", start / (1 + t/T); "halving",
            start / 2^k from k T to (k + 1) T. Never below the floor.
        start: rho(0), positive.
        floor: positive, at most ``start``.
        time_constant: T in s, positive.
    """

    kind: Literal["exponential", "reciprocal", "halving"]
    start: float
    floor: float
    time_constant: float

    def __post_init__(self) -> None:
        if self.kind not in SCHEDULES:
            raise InvalidInput("kind", self.kind, f"choose from {list(SCHEDULES)}")
        for key in ("floor", "time_constant"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(key, value, "it must be positive and finite")
        if self.floor > self.start:
            raise InvalidInput("floor", self.floor, f"it must not exceed rho(0), {self.start:g}")

    @property
    def numbers(self) -> NDArray[np.float64]:
        """For native code: [KIND, START, FLOOR, FALL]."""
        return np.array([SCHEDULES[self.kind], self.start, self.floor, 1.0 / self.time_constant])

    def at(self, time: ArrayLike) -> NDArray[np.float64]:
        """rho at times in s, of any shape."""
        numbers = self.numbers
        return np.vectorize(lambda t: rho_at(numbers, t), otypes=[np.float64])(time)


def constant(rho: float) -> NDArray[np.float64]:
    """The numbers of a penalty that does not change."""
    return np.array([CONSTANT, rho, rho, 0.0])


@dataclass(frozen=True, eq=False)
class LogBarrier:
    """The barrier of one game.

    Args:
        game: whose constraints it guards.
        rho: the penalty parameter, positive; the penalised equilibrium is an epsilon-vGNE with
            epsilon = p * rho [lemma:epsilon].
    """

    game: Game
    rho: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rho) and self.rho > 0):
            raise InvalidInput("rho", self.rho, "it must be positive and finite")

    def margin(self, y: ArrayLike) -> float:
        """min_l -g_l(y): positive strictly inside, in the constraints' own units."""
        return -self.game.tightest(y)[1]

    def value(self, y: ArrayLike) -> float:
        """phi(y), infinite on and outside the boundary."""
        g = self.game.constraints(y) + self.game.margins
        if not np.all(g < 0):
            return np.inf
        return float(-self.rho * np.sum(np.log(-g)))

    def weights(self, y: ArrayLike) -> NDArray[np.float64]:
        """rho / (-g_l(y)), shape (p,): the multipliers if y is the penalised equilibrium.

        Raises:
            ValueError: y is not strictly inside.
        """
        g = self.game.constraints(y) + self.game.margins
        if not np.all(g < 0):
            worst = int(np.argmax(np.where(np.isnan(g), np.inf, g)))
            value = float(g[worst])
            raise ValueError(
                f"the barrier has no gradient at a profile with"
                f" {self.game.constraint_names[worst]} at g = {value:.6g}"
            )
        return self.rho / -g

    def gradient(self, y: ArrayLike) -> NDArray[np.float64]:
        """dphi/dy, shape (m,)."""
        return self.weights(y) @ self.game.constraint_jacobian(y)

    def hessian(self, y: ArrayLike) -> NDArray[np.float64]:
        """d2phi/dy2, shape (m, m): sum_l w_l d2g_l + (w_l^2 / rho) dg_l dg_l'."""
        weights = self.weights(y)
        jacobian = self.game.constraint_jacobian(y)
        curvature = self.game.weighted_constraint_hessian(y, weights)
        return curvature + (jacobian.T * (weights**2 / self.rho)) @ jacobian


@kernel
def rho_at(schedule, time):
    """The penalty at a time in s, from a schedule's numbers."""
    kind, start = schedule[KIND], schedule[START]
    if kind == CONSTANT:
        return start
    elapsed = time * schedule[FALL]
    if kind == EXPONENTIAL:
        value = start * np.exp(-elapsed)
    elif kind == RECIPROCAL:
        value = start / (1.0 + elapsed)
    else:
        value = start * 2.0 ** -np.floor(elapsed)
    return max(value, schedule[FLOOR])


@kernel
def weighted_gradient(game, data, i, a, y, weights):
    """Sum over the constraints l that contain y_i of weights[l] * dg_l/dy_a(y)."""
    total = 0.0
    for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
        k = data.own_index[entry]
        total += weights[k] * game.constraint_gradient(data.parameters, k, a, y)
    return total
