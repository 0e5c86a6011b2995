"""Estimates of the others' actions, spread by consensus over the communication graph.

A law's memory holds the estimates as N rows of length m: row i is agent i's full-length vector
**y**^i, which it sends to its neighbours. Its own block is no estimate but its own action, which
the law writes there before anything else at every evaluation (:func:`write_own_actions`).
"""

from gne_mj.controllers.settings import RATE
from gne_mj.native import kernel


@kernel
def write_own_actions(data, y, memory):
    """Put each agent's own action into its own block of its row."""
    m = len(y)
    for r in range(m):
        memory[data.owner[r] * m + r] = y[r]


@kernel
def estimate_rates(problem, y, memory, out):
    """Fill out (N m,) with -RATE S_i sum_j (**y**^i - **y**^j), j being agent i's neighbours.

    The rows must have their own actions in place; own blocks of out become zero.
    """
    data, graph = problem.data, problem.graph
    m, agents = len(y), len(data.offsets) - 1
    scale = -problem.settings[RATE]
    for i in range(agents):
        own, row = memory[i * m : (i + 1) * m], out[i * m : (i + 1) * m]
        first, last = graph.pointer[i], graph.pointer[i + 1]
        heard = scale * (last - first)
        for r in range(m):
            row[r] = heard * own[r]
        for entry in range(first, last):
            j = graph.neighbour[entry]
            sent = memory[j * m : (j + 1) * m]
            for r in range(m):
                row[r] -= scale * sent[r]
    for r in range(m):
        out[data.owner[r] * m + r] = 0.0


@kernel
def barrier_profile(data, i, own_action, estimates, profile):
    """Fill the profile (own action, **y**^i_-i) where agent i's constraints read it.

    Args:
        data: the game's.
        i: the agent.
        own_action: (m_i,) what stands in its own block.
        estimates: its row (m,).
        profile: (m,), filled in the blocks of all agents in a constraint with y_i.
    """
    at = data.offsets
    for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
        k = data.own_index[entry]
        for member in range(data.member_pointer[k], data.member_pointer[k + 1]):
            j = data.member_index[member]
            for r in range(at[j], at[j + 1]):
                profile[r] = estimates[r]
    for r in range(len(own_action)):
        profile[at[i] + r] = own_action[r]
