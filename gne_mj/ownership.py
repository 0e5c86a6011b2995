"""Private constraints: what each agent's barrier has of dg/dy where not all are shared.

With a constraint that is agent i's alone, F + (each agent's gradient of its own barrier) is the
gradient of no common function phi any more. The equilibrium is then a generalized Nash equilibrium
at which each constraint has one multiplier, shared by its owners.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.game_model import Game

Array = NDArray[np.float64]


def own_slopes(game: Game, y: ArrayLike) -> Array:
    """dg_l/dy_a at one profile (m,) where a's agent owns constraint l, else 0: (p, m)."""
    slopes = game.constraint_jacobian(y)
    for k in game.private:
        slopes[k, ~np.isin(game.agent_of_action, game.owned_by[k])] = 0.0
    return slopes


def own_curvature(game: Game, y: ArrayLike, weights: Array) -> Array:
    """sum_l w_l d2g_l/dy2, row a of the constraints that a's agent owns: (m, m)."""
    if not game.private:
        return game.weighted_constraint_hessian(y, weights)
    found = np.zeros((game.actions, game.actions))
    at = game.data.offsets
    for i in range(game.agents):
        own = np.array([i in owners for owners in game.owned_by])
        rows = slice(at[i], at[i + 1])
        found[rows] = game.weighted_constraint_hessian(y, own * weights)[rows]
    return found
