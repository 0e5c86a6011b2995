"""Estimates of the others' actions, spread by consensus over the communication graph.

A law's memory holds the estimates as N rows of length m: row i is agent i's full-length vector
**y**^i. Its own block is not an estimate; what stands there is never read, since agent i uses its
own action and its neighbours receive that action in the same message.
"""

from gne_mj.controllers.settings import RATE
from gne_mj.native import kernel


@kernel
def add_disagreement(data, graph, y, memory, i, scale, out):
    """out += scale * sum_{j in N_i} (**y**^i - **y**^j) in the blocks that agent i estimates.

    out has the length of a profile; the agent's own block is left alone. Agent i reads its own
    row and what its neighbours send: their rows with their own actions in place.
    """
    at = data.offsets
    m = at[len(at) - 1]
    own = memory[i * m : (i + 1) * m]
    for entry in range(graph.pointer[i], graph.pointer[i + 1]):
        j = graph.neighbour[entry]
        sent = memory[j * m : (j + 1) * m]
        for r in range(at[j]):
            out[r] += scale * (own[r] - sent[r])
        for r in range(at[j], at[j + 1]):
            out[r] += scale * (own[r] - y[r])
        for r in range(at[j + 1], m):
            out[r] += scale * (own[r] - sent[r])
    for r in range(at[i], at[i + 1]):
        out[r] = 0.0


@kernel
def estimate_rates(problem, y, memory, out):
    """Fill out (N m,) with -RATE S_i sum_j (**y**^i - **y**^j); own blocks: zero."""
    at = problem.data.offsets
    agents = len(at) - 1
    m = at[agents]
    scale = -problem.settings[RATE]
    for i in range(agents):
        row = out[i * m : (i + 1) * m]
        for r in range(m):
            row[r] = 0.0
        add_disagreement(problem.data, problem.graph, y, memory, i, scale, row)


@kernel
def own_profile(data, i, own_action, estimates, profile):
    """Fill an agent's profile (y_i, **y**^i_-i) where its cost or its constraints read it.

    Args:
        data: the game's.
        i: the agent.
        own_action: (m_i,) what stands in its own block.
        estimates: its row (m,).
        profile: (m,), filled in the blocks of all agents in J_i or in a constraint with y_i.
    """
    at = data.offsets
    for entry in range(data.cost_pointer[i], data.cost_pointer[i + 1]):
        j = data.cost_index[entry]
        for r in range(at[j], at[j + 1]):
            profile[r] = estimates[r]
    for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
        k = data.own_index[entry]
        for member in range(data.member_pointer[k], data.member_pointer[k + 1]):
            j = data.member_index[member]
            for r in range(at[j], at[j + 1]):
                profile[r] = estimates[r]
    for r in range(len(own_action)):
        profile[at[i] + r] = own_action[r]
