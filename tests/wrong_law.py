"""A law that is wrong on purpose: agents ignore the constraint that they share with a follower."""

from gne_mj.controllers.full_information import propagate, rate
from gne_mj.native import kernel

__all__ = ["action", "propagate", "rate"]


@kernel
def action(game, problem, y, weights, memory, scratch, u):
    data = problem.data
    at = data.offsets
    for i in range(len(at) - 1):
        block = u[at[i] : at[i + 1]]
        block[0] = 0.0
        game.add_cost_gradient(data.parameters, i, y, 1.0, block)
        game.add_constraint_gradient(data.parameters, i, i, y, weights[i], block)
        block[0] = -block[0]
    return -1
