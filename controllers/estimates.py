"""Estimates of the others' actions, spread by consensus over the communication graph.

A law's memory holds the estimates as N rows of length m: row i is agent i's full-length vector
**y**^i, which it sends to its neighbours. Its own block is no estimate but its own action, which
the law writes there before anything else at every evaluation (:func:`prepare`).

Where messages can be lost or late, the memory has one more row for each link of the graph (each
agent's neighbours in turn): what came over it last. Then that is what an agent has of a neighbour.
A law can have two rows more an agent, behind all estimates, that are sent with them
(``sent_besides``).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.controllers.propagation import propagate_estimates
from gne_mj.controllers.settings import BESIDES, LINKS, RATE
from gne_mj.errors import InvalidInput
from gne_mj.native import kernel


def given_estimates(
    agents: int, y: NDArray[np.float64], estimate: ArrayLike | None
) -> NDArray[np.float64]:
    """What a start says of N agents' estimates: one number (), a profile (m,) or one each (N, m).

    Args:
        agents: N.
        y: (m,) the actions, which are taken where ``estimate`` is None.
        estimate: as given.

    Raises:
        InvalidInput: another shape.
    """
    m = len(y)
    expected = f"it must be one number, a list of {m}, or {agents} lists of {m}"
    try:
        given = np.asarray(y if estimate is None else estimate, dtype=np.float64)
    except ValueError:
        raise InvalidInput("estimate", "lists of different lengths", expected) from None
    if given.shape not in ((), (m,), (agents, m)):
        raise InvalidInput("estimate", f"shape {given.shape}", expected)
    return given


@kernel
def heard_at(problem, m, link):
    """Where in the memory an agent has a neighbour's row: the row itself, or what came last."""
    links = int(problem.settings[LINKS])
    message = m + 2 * int(problem.settings[BESIDES])
    return links + link * message if links > 0 else problem.graph.neighbour[link] * m


@kernel
def besides_at(problem, m, block, link):
    """Where it has the neighbour's row of the first or second block behind the estimates."""
    links, size = int(problem.settings[LINKS]), int(problem.settings[BESIDES])
    if links > 0:
        return links + link * (m + 2 * size) + m + block * size
    agents = len(problem.data.offsets) - 1
    return agents * m + (block * agents + problem.graph.neighbour[link]) * size


@kernel
def move_estimates(problem, y, memory, scratch):
    """Move the estimates over one control period with the outputs held at y (m,).

    By the exact solution, or, where messages are sent once a period and can be lost, by the exact
    solution of each agent's own row with what it heard last.
    """
    if problem.settings[LINKS] > 0.0:
        _relax(problem, len(y), memory)
    else:
        propagate_estimates(problem.data, problem.graph, problem.propagator, y, memory, scratch)


@kernel
def _relax(problem, m, memory):
    """Each row towards the mean of what its agent heard last; own blocks stay."""
    at, graph = problem.data.offsets, problem.graph
    for i in range(len(at) - 1):
        first, last = graph.pointer[i], graph.pointer[i + 1]
        if last > first:
            stays = np.exp(-problem.propagator.numbers[1] * (last - first))
            for r in range(m):
                if problem.data.owner[r] != i:
                    mean = _mean_heard(problem, m, i, r, memory)
                    memory[i * m + r] = mean + stays * (memory[i * m + r] - mean)


@kernel
def _mean_heard(problem, m, i, r, memory):
    """What those that agent i hears said last of action r, on average."""
    first, last = problem.graph.pointer[i], problem.graph.pointer[i + 1]
    mean = 0.0
    for link in range(first, last):
        mean += memory[heard_at(problem, m, link) + r]
    return mean / (last - first)


@kernel
def prepare(problem, first, last, y, memory):
    """Put the actions of agents ``first`` to ``last`` - 1 into their own rows."""
    at, m = problem.data.offsets, len(y)
    for r in range(at[first], at[last]):
        memory[problem.data.owner[r] * m + r] = y[r]


@kernel
def clear_others(data, i, out):
    """Zero the entries of out (m,) that belong to other agents in the cost of agent i."""
    for member in range(data.cost_pointer[i], data.cost_pointer[i + 1]):
        j = data.cost_index[member]
        if j != i:
            for r in range(data.offsets[j], data.offsets[j + 1]):
                out[r] = 0.0


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
