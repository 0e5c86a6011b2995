"""How strongly agents must be coupled under partial information [eq:nonlinearPIFeedback].

With e the distance of all profiles from 1 (x) y*, the storage function V (the agents' own plus
tau/2 |estimates - y*|^2, whatever tau) falls at least as fast as the quadratic form

    -dV/dt >= c e'(L (x) I)e + sum_i e_i^i' (mean of agent i's rows of dF/dy) e^i.

With p the mean profile of e and w the rest, that is at least
mu |p|^2 - (theta_1 + theta_2) |p| |w| + (c lambda_2 - theta_2) |w|^2, which is positive if
4 mu (c lambda_2 - theta_2) > (theta_1 + theta_2)^2: the *rigorous* condition. The paper's,
mu (c lambda_2 - theta_2) > theta_2^2, leaves theta_1 out: the *printed* one. Where the matrices
that dF/dy may be are few, the form's own least eigenvalue tells *exactly* when it is positive.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigvalsh
from scipy.sparse.linalg import eigsh

from gne_mj.graph import Graph
from gne_mj.theory.constants import Slopes, positive_definite

# Greatest number of operations for the quadratic form, and where iteration is quicker
_WORK = 2e10
_DENSE = 500


@dataclass(frozen=True)
class Condition:
    """One condition on the coupling gain.

    Attributes:
        least: the gain c that must be exceeded; infinite if none suffices, nan if not known.
        holds: whether the given gain exceeds it.
        certified: whether the constants it rests on may be relied on and it proves stability.
    """

    least: float
    holds: bool
    certified: bool


@dataclass(frozen=True)
class Coupling:
    """The three conditions for a given coupling gain and graph.

    Attributes:
        gain: c.
        printed: mu (c lambda_2 - theta_2) > theta_2^2; never certified, since V can rise
            all the same (docs/certificates.md has a case).
        rigorous: 4 mu (c lambda_2 - theta_2) > (theta_1 + theta_2)^2.
        quadratic: the quadratic form is positive definite; None where it is not computed.
        label: what ``quadratic`` is: "exact" for affine F, else "bounded".
    """

    gain: float
    printed: Condition
    rigorous: Condition
    quadratic: Condition | None
    label: str

    @property
    def certified(self) -> bool:
        """Whether V is certain to fall."""
        conditions = [self.rigorous, *([self.quadratic] if self.quadratic else [])]
        return any(condition.holds and condition.certified for condition in conditions)


def needed_connectivity(slopes: Slopes) -> tuple[float, float]:
    """The values that c lambda_2 must exceed by the printed and by the rigorous condition."""
    mu, theta_1, theta_2 = slopes.mu.value, slopes.theta_1.value, slopes.theta_2.value
    if not mu > 0:
        return np.inf, np.inf
    return theta_2**2 / mu + theta_2, (theta_1 + theta_2) ** 2 / (4.0 * mu) + theta_2


def coupling(slopes: Slopes, graph: Graph, gain: float) -> Coupling:
    """What the gain c must exceed on a graph, and whether it does."""
    connectivity = graph.algebraic_connectivity
    sure = slopes.monotone

    def condition(least: float, certified: bool) -> Condition:
        return Condition(least, bool(gain > least), certified)

    if graph.agents == 1:  # nobody to estimate
        nothing = condition(0.0, sure)
        return Coupling(gain, nothing, nothing, None, slopes.label)
    printed, rigorous = (needed / connectivity for needed in needed_connectivity(slopes))
    quadratic = None
    ends = slopes.ends
    if ends is not None and len(ends) * (graph.agents * slopes.game.actions) ** 3 <= _WORK:
        owner = slopes.game.agent_of_action
        quadratic = condition(max(least_coupling(slope, graph, owner) for slope in ends), sure)
    return Coupling(
        gain, condition(printed, False), condition(rigorous, sure), quadratic, slopes.label
    )


def least_coupling(slope: NDArray[np.float64], graph: Graph, owner: NDArray[np.int64]) -> float:
    """The c above which the quadratic form with this dF/dy is positive definite.

    In the basis of consensus (first) and the Laplacian's other eigenvectors the form has the blocks
    B11, B21 and c Lambda + B22, of which only the last depends on c. By Schur's complement it is
    positive definite if B11 is and c Lambda > B21 B11^-1 B21' - B22.

    Args:
        slope: dF/dy, (m, m).
        graph: of N >= 2 agents.
        owner: the agent that each action belongs to, (m,).
    """
    agents, m = graph.agents, len(slope)
    values, vectors = np.linalg.eigh(graph.laplacian)
    # Eigenvectors at the action's owner, scaled so that Lambda becomes the identity: (m, N - 1)
    basis = (vectors[:, 1:] / np.sqrt(values[1:]))[owner]
    consensus = (slope + slope.T) / (2.0 * agents)
    try:
        factor = cho_factor(consensus)
    except np.linalg.LinAlgError:
        return np.inf
    size = (agents - 1) * m
    between = np.einsum("ra,rs->ars", basis, slope) + np.einsum("sa,sr->ars", basis, slope)
    between = between.reshape(size, m) / (2.0 * np.sqrt(agents))
    apart = np.einsum("ra,rb,rs->arbs", basis, basis, 0.5 * slope, optimize=True)
    apart = apart.reshape(size, size)
    needed = between @ cho_solve(factor, between.T) - (apart + apart.T)
    return max(0.0, _greatest(needed))


def _greatest(matrix: NDArray[np.float64]) -> float:
    """The greatest eigenvalue of a symmetric matrix, rounded up where it is found by iteration."""
    size = len(matrix)
    if size > _DENSE:
        start = np.random.default_rng(0).normal(size=size)
        found = eigsh(matrix, k=1, which="LA", v0=start, return_eigenvectors=False)[0]
        found += 1e-9 * abs(found)
        if positive_definite(found * np.eye(size) - matrix):  # so that none was missed
            return float(found)
    return float(eigvalsh(matrix, subset_by_index=[size - 1, size - 1])[0])
