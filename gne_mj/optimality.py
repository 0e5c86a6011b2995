"""Whether a profile at which F + sum_l lambda_l dg_l vanishes is an equilibrium, and the only one.

Such a profile is one if each agent's own problem is convex. Where it is not, the agents' own second
derivatives tell, within the bounds that bind, and best responses (:mod:`gne_mj.equilibrium`).
Sizes are relative ones, so that nothing depends on units.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.equilibrium import Equilibrium
from gne_mj.game_model import Game
from gne_mj.ownership import own_curvature, own_slopes

# Relative to what it acts on: a push below is none, and likewise room for an action.
NEGLIGIBLE = 1e-8
FLAT = 1e-9  # curvatures below, relative to the greatest second derivative, are zero
MOST_ACTIONS = 1500  # beyond which F's monotonicity is not looked at: dense eigenvalues


@dataclass(frozen=True)
class Optimality:
    """What a stationary profile is.

    Attributes:
        active: the constraints that bind with a positive multiplier.
        weakly_active: those that bind with none.
        curvature: least eigenvalue of each agent's own second derivatives of its Lagrangian along
            the bounds that bind, shape (N,), relative to the greatest second derivative in it;
            infinite where bounds leave the agent no direction. Negative: what it does is no
            minimum.
        monotonicity: least eigenvalue of the symmetric part of dF/dy there, relative to the
            greatest magnitude of one; None if it was not looked at.
    """

    active: tuple[int, ...]
    weakly_active: tuple[int, ...]
    curvature: NDArray[np.float64]
    monotonicity: float | None

    @property
    def not_minima(self) -> tuple[int, ...]:
        """The agents, from 0, whose own second derivatives are negative somewhere."""
        return tuple(int(i) for i in np.flatnonzero(self.curvature < -FLAT))


def examine(game: Game, point: Equilibrium) -> Optimality:
    """What a variational GNE, or what was found in its place, is."""
    y, multipliers = point.action, point.multipliers
    jacobian, owned = game.constraint_jacobian(y), own_slopes(game, y)
    slopes = game.pseudo_gradient_jacobian(y)
    length = float(np.max(np.abs(y))) or 1.0
    pushes = multipliers[:, None] * np.abs(owned)
    rows = np.abs(game.pseudo_gradient(y)) + pushes.sum(axis=0)
    rows += length * np.abs(slopes).sum(axis=1)
    push = np.max(np.divide(pushes, rows, out=np.zeros_like(pushes), where=rows > 0), axis=1)
    width = length * np.abs(jacobian).sum(axis=1)
    slack = -(game.constraints(y) + game.margins)
    room = np.divide(slack, width, out=np.full_like(slack, np.inf), where=width > 0)
    near = room < NEGLIGIBLE
    active = near & (push >= NEGLIGIBLE)
    return Optimality(
        active=tuple(np.flatnonzero(active).tolist()),
        weakly_active=tuple(np.flatnonzero(near & ~active).tolist()),
        curvature=_curvature(game, slopes, multipliers, owned[active], y),
        monotonicity=_monotonicity(slopes),
    )


def _curvature(
    game: Game,
    slopes: NDArray[np.float64],
    multipliers: NDArray[np.float64],
    binding: NDArray[np.float64],
    y: NDArray[np.float64],
) -> NDArray[np.float64]:
    bends = own_curvature(game, y, multipliers)
    at, found = game.data.offsets, np.empty(game.agents)
    for i in range(game.agents):
        own = slice(at[i], at[i + 1])
        second, bend = slopes[own, own], bends[own, own]
        along = _null_space(binding[:, own])
        size = max(float(np.max(np.abs(second))), float(np.max(np.abs(bend))))
        least = np.inf
        if along.shape[1]:
            reduced = along.T @ (0.5 * (second + second.T) + bend) @ along
            least = float(np.linalg.eigvalsh(reduced)[0]) / size if size > 0.0 else 0.0
        found[i] = least
    return found


def _null_space(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal columns that span the directions along which no row (each scaled) changes."""
    sizes = np.linalg.norm(rows, axis=1)
    rows = rows[sizes > 0.0] / sizes[sizes > 0.0, None]
    if not len(rows):
        return np.eye(rows.shape[1])
    _, values, directions = np.linalg.svd(rows)
    return directions[int(np.sum(values > NEGLIGIBLE)) :].T


def _monotonicity(slopes: NDArray[np.float64]) -> float | None:
    if len(slopes) > MOST_ACTIONS:
        return None
    values = np.linalg.eigvalsh(0.5 * (slopes + slopes.T))
    size = float(np.max(np.abs(values)))
    return float(values[0]) / size if size > 0.0 else 0.0
