"""A law that is wrong on purpose: agents ignore the constraint that they share with a follower."""

from gne_mj.controllers.full_information import propagate, rate, storage
from gne_mj.native import kernel

__all__ = ["action", "propagate", "rate", "storage"]


@kernel
def action(game, problem, y, weights, memory, work, u):
    q = problem.data.parameters
    for i in range(len(u)):
        own = weights[i] * game.constraint_gradient(q, i, i, y)
        u[i] = -game.cost_gradient(q, i, i, y) - own
    return -1
