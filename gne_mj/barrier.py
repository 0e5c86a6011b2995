"""Log barrier of the shared constraints [eq:logbarrier]: phi(y) = -rho sum_l log(-g_l(y)).

Its gradient is sum_l w_l dg_l/dy with the weights w_l = rho / (-g_l(y)), which at the penalised
equilibrium are the multipliers. Outside the interior phi is infinite and has no gradient: the
kernels report that and never clip a constraint's value.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput
from gne_mj.game import Game
from gne_mj.native import kernel


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
            raise InvalidInput("barrier.rho", self.rho, "it must be positive and finite")

    def margin(self, y: ArrayLike) -> float:
        """min_l -g_l(y): positive strictly inside, in the constraints' own units."""
        return -self.game.tightest(y)[1]

    def value(self, y: ArrayLike) -> float:
        """phi(y), infinite on and outside the boundary."""
        g = self.game.constraints(y)
        if not np.all(g < 0):
            return np.inf
        return float(-self.rho * np.sum(np.log(-g)))

    def weights(self, y: ArrayLike) -> NDArray[np.float64]:
        """rho / (-g_l(y)), shape (p,): the multipliers if y is the penalised equilibrium.

        Raises:
            ValueError: y is not strictly inside.
        """
        g = self.game.constraints(y)
        if not np.all(g < 0):
            worst, value = self.game.tightest(y)
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
def evaluate_constraints(game, data, rho, y, g, weights):
    """Fill g with g(y) and weights with rho / (-g); return -1, or the first g_l not negative.

    A value that is not a number counts as not negative.
    """
    outside = -1
    for k in range(len(g)):
        value = game.constraint(data.parameters, k, y)
        g[k] = value
        weights[k] = rho / -value
        if not value < 0.0 and outside < 0:
            outside = k
    return outside


@kernel
def weighted_gradient(game, data, i, a, y, weights):
    """Sum over the constraints l that contain y_i of weights[l] * dg_l/dy_a(y)."""
    total = 0.0
    for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
        k = data.own_index[entry]
        total += weights[k] * game.constraint_gradient(data.parameters, k, a, y)
    return total
