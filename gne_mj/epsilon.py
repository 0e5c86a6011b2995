"""What an agent could gain at most by deviating alone: the paper's lemma, and by measurement."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.equilibrium import Equilibrium, measured_epsilon
from gne_mj.errors import GneError
from gne_mj.game_model import Game

Array = NDArray[np.float64]

# Gains are differences of costs: relative to the costs, and to the bound
_ROUNDING, _ABOVE = 1e-12, 1e-6
_WIDER = 1e-9  # part of g by which bounds are widened beyond what a profile violates them by
NOT_CONVEX = "not every J_i is convex in y_i"


def epsilon_bounds(
    game: Game,
    rho: float,
    found: Equilibrium | None,
    *,
    gains: Array | None = None,
    refuted: str | None = None,
) -> dict[str, Any]:
    """What any agent could gain at most, by deviating alone in the set g <= 0 [lemma:epsilon].

    From a penalised equilibrium agent i's cost, convex in y_i, falls by at most
    sum_l lambda_l (-g_l) over the constraints l that contain y_i, which are convex. With
    lambda_l = rho/(-g_l - t_l) that is p_i rho + sum_l lambda_l t_l. All in the costs' unit.

    Args:
        game: with its tightening t.
        rho: the penalty.
        found: the penalised equilibrium; None if that is not known, and then None stands for all
            that needs it.
        gains: (n,) what agents were found to gain there; more than the bound refutes the lemma.
        refuted: why the lemma is known not to apply; then None stands for all bounds.

    Returns:
        ``p_rho`` for p constraints and ``of_margin``, sum_l lambda_l t_l of all of them; ``bound``,
        the two together; ``p_rho_affine`` and ``bound_affine``, the same where affine constraints
        describe the set (None if the game's own do, or none do); ``own_bound`` of each agent, the
        greatest of these ``largest_own_bound``, and the greatest p_i rho ``largest_own_p_rho``;
        ``refuted``, or None.
    """
    affine, p_rho = game.affine_constraints, game.constraints_count * rho
    unknown = np.where(game.margins > 0, np.nan, 0.0)
    costs = unknown if found is None else found.multipliers * game.margins
    of_margin = float(np.sum(costs))
    member = np.repeat(np.arange(game.agents), game.own_constraints)
    own = np.bincount(member, rho + costs[game.data.own_index], game.agents)
    if gains is not None and found is not None and refuted is None:
        noise = _ROUNDING * float(np.max(np.abs(game.costs(found.action))))
        refuted = NOT_CONVEX if np.any(gains > (1.0 + _ABOVE) * own + noise) else None
    bound = p_rho + of_margin
    if refuted is not None:
        bound, own = np.nan, np.full(game.agents, np.nan)
    found_numbers = {
        "p_rho": p_rho,
        "of_margin": of_margin,
        "bound": bound,
        "p_rho_affine": None if affine is None else affine * rho,
        "bound_affine": None if affine is None else affine * rho + (bound - p_rho),
        "largest_own_bound": float(np.max(own)),
        "largest_own_p_rho": float(np.max(game.own_constraints)) * rho,
    }
    return {
        **{
            name: None if value is None or np.isnan(value) else value
            for name, value in found_numbers.items()
        },
        "own_bound": [None if np.isnan(each) else each for each in own.tolist()],
        "refuted": refuted,
    }


def epsilon_at(game: Game, y: Array) -> float | None:
    """What an agent could gain at most by deviating alone from a profile (m,), as measured.

    That is in the set itself; of a profile that is not strictly inside, in the set whose violated
    bounds are wider by what it violates them by. None where a best response is not found, or the
    game cannot be computed where it is looked for.

    Args:
        game: without tightening.
        y: finite.
    """
    g = game.constraints(y)
    wider = np.where(g < 0.0, 0.0, g + _WIDER * (1.0 + np.abs(g)))
    if np.any(wider > 0.0):
        game = game.widened(wider)
    try:
        found = float(np.max(measured_epsilon(game, y)))
    except GneError:
        return None
    return found if np.isfinite(found) else None
