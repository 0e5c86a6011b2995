"""A law with a memory, of plain Python functions: gradient play with gains and a damping filter.

Agent i keeps a slow copy z_i of its own action, tau z' = y - z, and acts by

    u_i = -k_i (dJ_i/dy_i(y) + dphi/dy_i(y)) - d (y_i - z_i).

The filter resists fast motion only: at rest z = y, so the equilibrium stays where it was. Agents
whose robots swing settle sooner.
"""

import numpy as np

from gne_mj.barrier import LogBarrier


def initial_memory(y, gains, damping, tau):
    """z(0) = y(0)."""
    return y


def action(game, rho, y, memory, gains, damping, tau):
    """u, shape (m,)."""
    gradient = game.pseudo_gradient(y) + LogBarrier(game, rho).gradient(y)
    return -np.array(gains) * gradient - damping * (y - memory)


def rate(game, rho, y, memory, gains, damping, tau):
    """z'."""
    return (y - memory) / tau
