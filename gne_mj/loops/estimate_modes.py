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
from gne_mj.linear import weighted_sum
from gne_mj.native import kernel


class Modes(NamedTuple):
    """Eigenbases of all columns, read-only; modes are kept flat, as (N - 1, m)."""

    owner: Annotated[np.ndarray, "m", int]  # the agent that each column belongs to
    rates: Annotated[np.ndarray, "N - 1, m"]  # eigenvalues lambda of the owner's L_j
    rest: Annotated[np.ndarray, "N - 1, m"]  # Q'1, the modes at rest for an action of 1
    # Q, by agent, mode and column; zero for the owner itself
    vectors: Annotated[np.ndarray, "N, N - 1, m"]


def modes_of(graph: Graph, owner: NDArray[np.int64]) -> Modes:
    """The eigenbases, for a graph and the agent that each column belongs to, owner (m,)."""
    agents, m = graph.agents, len(owner)
    rates, rest = np.zeros((agents - 1, m)), np.zeros((agents - 1, m))
    vectors = np.zeros((agents, agents - 1, m))
    if agents > 1:
        others = np.array([np.delete(np.arange(agents), j) for j in range(agents)])
        grounded = graph.laplacian[others[:, :, None], others[:, None, :]]
        values, bases = np.linalg.eigh(grounded)
        rates[:] = values[owner].T
        rest[:] = bases.sum(axis=1)[owner].T
        for r, j in enumerate(owner):
            vectors[others[j], :, r] = bases[j]
    return Modes(owner, rates, rest, vectors)


def to_modes(modes: Modes, estimates: NDArray[np.float64]) -> NDArray[np.float64]:
    """The modes, flat, of estimates (N m,)."""
    agents, _, m = modes.vectors.shape
    rows = estimates.reshape(agents, m)
    return np.einsum("iar,ir->ar", modes.vectors, rows).ravel()


@kernel
def from_modes(vectors, modes, estimates):
    """Fill estimates (N, m) with those of modes (N - 1, m), the agents' own blocks with zeros."""
    for i in range(len(estimates)):
        weighted_sum(estimates[i], vectors[i], modes)
