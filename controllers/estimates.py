"""Estimates of the others' actions, spread by consensus over the communication graph.

A law's memory holds the estimates as N rows of length m: row i is agent i's full-length vector
**y**^i. Its own block is not an estimate; what stands there is never read, since agent i uses its
own action and its neighbours receive that action in the same message.
"""

import numpy as np

from gne_mj.graph import Graph
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
def propagate_estimates(data, maps, y, memory, scratch):
    """Replace the estimates by their exact solution over a period with the outputs held at y.

    maps[j] (N, N) moves the errors of all agents' estimates of agent j (its own row and column
    are zero); scratch has at least length N.
    """
    at = data.offsets
    agents = len(at) - 1
    m = at[agents]
    for j in range(agents):
        for r in range(at[j], at[j + 1]):
            for i in range(agents):
                total = 0.0
                for other in range(agents):
                    if other != j:
                        total += maps[j, i, other] * (memory[other * m + r] - y[r])
                scratch[i] = total
            for i in range(agents):
                if i != j:
                    memory[i * m + r] = y[r] + scratch[i]


def estimate_propagators(graph: Graph, duration: float) -> np.ndarray:
    """exp(-L_j duration) for each agent j, L_j the Laplacian without row and column j; (N, N, N).

    The estimates of agent j's action obey d/ds e = -L_j e for their errors e, with s the time in
    units of the estimates' time constant. Row and column j of the j-th map are zero.
    """
    agents = graph.agents
    maps = np.zeros((agents, agents, agents))
    for j in range(agents):
        others = np.delete(np.arange(agents), j)
        values, vectors = np.linalg.eigh(graph.laplacian[np.ix_(others, others)])
        decay = (vectors * np.exp(-values * duration)) @ vectors.T
        maps[j][np.ix_(others, others)] = decay
    return maps
