"""The estimates' eigenbases, in which their fast dynamics are diagonal.

A column of the estimates holds all other agents' estimates of one entry y_r of agent j's action.
Its errors e obey epsilon e' = -L_j e [eq:CentreDynamics2], L_j being the Laplacian without row and
column j, which is symmetric and positive definite. With L_j Q = Q diag(lambda) the column's modes
w = Q'(estimates) obey epsilon w' = lambda (Q'1 y_r - w), each by itself.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.graph import Graph
from gne_mj.native import kernel


class Modes(NamedTuple):
    """Eigenbases of all columns, read-only; modes are kept flat, as (N - 1, m)."""

    owner: Annotated[np.ndarray, "m", int]  # the agent that each column belongs to
    rates: Annotated[np.ndarray, "N - 1, m"]  # eigenvalues lambda of the owner's L_j
    rest: Annotated[np.ndarray, "N - 1, m"]  # Q'1, the modes at rest for an action of 1
    # Q, by mode, agent and column; zero for the owner itself
    vectors: Annotated[np.ndarray, "N - 1, N, m"]


def modes_of(graph: Graph, owner: NDArray[np.int64]) -> Modes:
    """The eigenbases, for a graph and the agent that each column belongs to, owner (m,)."""
    agents, m = graph.agents, len(owner)
    rates, rest = np.zeros((agents - 1, m)), np.zeros((agents - 1, m))
    vectors = np.zeros((agents - 1, agents, m))
    if agents > 1:
        others = np.array([np.delete(np.arange(agents), j) for j in range(agents)])
        grounded = graph.laplacian[others[:, :, None], others[:, None, :]]
        values, bases = np.linalg.eigh(grounded)
        rates[:] = values[owner].T
        rest[:] = bases.sum(axis=1)[owner].T
        for r, j in enumerate(owner):
            vectors[:, others[j], r] = bases[j].T
    return Modes(owner, rates, rest, vectors)


def to_modes(modes: Modes, estimates: NDArray[np.float64]) -> NDArray[np.float64]:
    """The modes, flat, of estimates (N m,)."""
    _, agents, m = modes.vectors.shape
    rows = estimates.reshape(agents, m)
    return np.einsum("air,ir->ar", modes.vectors, rows).ravel()


@kernel
def add_from_modes(vectors, amounts, estimates):
    """estimates (N m,) += those that belong to the modes amounts ((N - 1) m,).

    Nothing is added to the agents' own blocks.
    """
    count, agents, m = vectors.shape
    rows, modes = estimates.reshape((agents, m)), amounts.reshape((count, m))
    for a in range(count):
        for i in range(agents):
            for r in range(m):
                rows[i, r] += vectors[a, i, r] * modes[a, r]
