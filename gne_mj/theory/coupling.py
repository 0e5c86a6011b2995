"""How strongly agents must be coupled under partial information [eq:nonlinearPIFeedback].

With e the distance of all profiles from 1 (x) y*, the storage function V (the agents' own plus
tau/2 |estimates - y*|^2, whatever tau) falls at least as fast as the quadratic form

    -dV/dt >= c e'(L (x) I)e + sum_i e_i^i' (mean of agent i's rows of dF/dy) e^i.

With p the mean profile of e and w the rest, that is at least
mu |p|^2 - (theta_1 + theta_2) |p| |w| + (c lambda_2 - theta_2) |w|^2, which is positive if
4 mu (c lambda_2 - theta_2) > (theta_1 + theta_2)^2: the *rigorous* condition. The paper's,
mu (c lambda_2 - theta_2) > theta_2^2, leaves theta_1 out: the *printed* one. Where F is affine, or
the rows of dF/dy only change in length, the form itself is looked at, with what every such matrix
has at least. That it is positive definite is sufficient for V to fall.

Where agents keep only some estimates, all this holds column by column: L is that of the graph of
those that keep the action, and lambda_2 the least of these graphs'.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.kept import Kept
from gne_mj.graph import Graph
from gne_mj.theory.constants import Slopes
from gne_mj.theory.spectra import positive_definite

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = NDArray[np.float64]

# Greatest number of operations for the quadratic form, and where iteration is quicker
_WORK = 1.3e11
_DENSE = 500
# Greatest number of rows of the form itself
_FORM = 500


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
        quadratic: the quadratic form is positive definite, which is sufficient for V to fall; None
            where it is not computed.
        label: how its least gain is known: "exact" for affine F, else "bounded" (from above).
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


def coupling(slopes: Slopes, graph: Graph, gain: float, kept: Kept | None = None) -> Coupling:
    """What the gain c must exceed on a graph, and whether it does.

    Args:
        slopes: what is known of dF/dy.
        graph: over which agents communicate; of one that changes the worst counts.
        gain: c.
        kept: which estimates there are; all if left out.
    """
    connectivity = graph.algebraic_connectivity if kept is None else kept.connectivity
    sure = slopes.monotone

    def condition(least: float, certified: bool) -> Condition:
        return Condition(least, bool(gain > least), certified)

    if graph.agents == 1 or connectivity == np.inf:  # nobody to estimate
        nothing = condition(0.0, sure)
        return Coupling(gain, nothing, nothing, None, slopes.label)
    printed, rigorous = (needed / connectivity for needed in needed_connectivity(slopes))
    quadratic = None
    bound, members = slopes.between, graph.members
    if bound is not None and members is not None:
        owner = slopes.game.agent_of_action
        if len(members) * len(_entries(bound.base, bound.loss, owner)[0]) ** 3 <= _WORK:
            least = max(
                least_coupling(bound.base, each, owner, loss=bound.loss, kept=kept)
                for each in members
            )
            quadratic = condition(least, sure)
    return Coupling(
        gain, condition(printed, False), condition(rigorous, sure), quadratic, slopes.label
    )


def form_at(slopes: Slopes, graph: Graph, gain: float) -> Array | None:
    """What the quadratic form in all profiles, agent by agent, certainly has at least.

    Args:
        slopes: what is certain of dF/dy.
        graph: that stays, of N >= 2 agents that keep all estimates.
        gain: c.

    Returns:
        (N m, N m); None if dF/dy is not known so well, or that is too large.
    """
    bound, m = slopes.between, slopes.game.actions
    if bound is None or graph.agents * m > _FORM:
        return None
    owner = slopes.game.agent_of_action
    agent, column = _entries(bound.base, bound.loss, owner)
    at = agent * m + column
    form = gain * np.kron(graph.laplacian, np.eye(m))
    form[np.ix_(at, at)] += _second_term(bound.base, bound.loss, owner, agent, column).toarray()
    return form


def least_of_form(slopes: Slopes, graph: Graph, gain: float) -> float:
    """q with Q(e) >= q |e|^2 for all e, by mu, theta_1 and theta_2 alone.

    That of mu |p|^2 - (theta_1 + theta_2) |p| |w| + (c lambda_2 - theta_2) |w|^2, where
    |e|^2 = N |p|^2 + |w|^2.
    """
    mu, theta_1, theta_2 = slopes.mu.value, slopes.theta_1.value, slopes.theta_2.value
    between = -0.5 * (theta_1 + theta_2) / np.sqrt(graph.agents)
    apart = gain * graph.algebraic_connectivity - theta_2
    return float(np.linalg.eigvalsh([[mu / graph.agents, between], [between, apart]])[0])


def least_coupling(
    slope: Array,
    graph: Graph,
    owner: NDArray[np.int64],
    *,
    loss: Array | None = None,
    kept: Kept | None = None,
) -> float:
    """The c above which the quadratic form with this dF/dy is positive definite.

    Of column r of **y**, what the agents take action r to be, only the owner's entry and those of
    agents whose rows of dF/dy have an r-th entry are in the second term. The others are minimised
    over: that leaves Kron's reduction of the graph to those agents, whose pseudo-inverse is the
    part of L's that belongs to them, but for constants. With a basis 1, V_r of such a column,
    V_r' L_r V_r = I, the form has the blocks B11 (of the consensus), B21 and c I + B22. By Schur's
    complement it is positive definite if B11 is and c > lambda_max(B21 B11^-1 B21' - B22).

    Args:
        slope: dF/dy, (m, m).
        graph: of N >= 2 agents.
        owner: the agent that each action belongs to, (m,).
        loss: (m, m) rows w_r, by each of which w_r w_r' is taken from the part of r's owner.
        kept: which estimates there are; all if left out.

    Returns:
        infinity if no c suffices.
    """
    from scipy.linalg import cho_factor, cho_solve  # slow to load, and for certificates only
    from scipy.sparse import csr_array

    if loss is None:
        loss = np.zeros_like(slope)
    agent, column = _entries(slope, loss, owner)
    part = _second_term(slope, loss, owner, agent, column)
    apart = _disagreements(_inverses(graph, owner, kept), agent, column)
    consensus = csr_array((np.ones(len(agent)), (np.arange(len(agent)), column)))
    try:
        factor = cho_factor((consensus.T @ part @ consensus).toarray())
    except np.linalg.LinAlgError:
        return np.inf
    between = (apart.T @ part @ consensus).toarray()
    needed = between @ cho_solve(factor, between.T) - (apart.T @ part @ apart).toarray()
    return max(0.0, _greatest(needed)) if len(needed) else 0.0


def _entries(
    slope: Array, loss: Array, owner: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Agents i and actions r of the entries of **y** in the form's second term, by action."""
    used = np.zeros((int(owner[-1]) + 1, len(owner)), dtype=bool)
    np.logical_or.at(used, owner, (slope != 0.0) | (loss != 0.0))
    used[owner, np.arange(len(owner))] = True
    column, agent = np.nonzero(used.T)
    return agent, column


def _second_term(
    slope: Array,
    loss: Array,
    owner: NDArray[np.int64],
    agent: NDArray[np.int64],
    column: NDArray[np.int64],
) -> "csr_array":
    """sum_r (e_r s_r' + s_r e_r')/2 - w_r w_r' in the owners' entries of **y**, symmetric."""
    from scipy.sparse import csr_array

    rows, columns, values = [], [], []
    for i in range(int(owner[-1]) + 1):
        mine = np.flatnonzero(agent == i)
        at, own = column[mine], np.flatnonzero(owner == i)
        block = np.zeros((len(mine), len(mine)))
        block[np.searchsorted(at, own)] = slope[np.ix_(own, at)]
        lost = loss[np.ix_(own, at)]
        block = 0.5 * (block + block.T) - lost.T @ lost
        rows.append(np.repeat(mine, len(mine)))
        columns.append(np.tile(mine, len(mine)))
        values.append(block.ravel())
    shape = (len(agent), len(agent))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return csr_array(entries, shape=shape)


# Of an action and some of the agents that keep it, the part of the Laplacian's pseudo-inverse
_Inverses = Callable[[int, NDArray[np.int64]], NDArray[Any]]


def _inverses(graph: Graph, owner: NDArray[np.int64], kept: Kept | None) -> _Inverses:
    """Pseudo-inverses but for a constant, which differences do not see."""
    if kept is None:
        inverse = np.linalg.inv(graph.laplacian + 1.0 / graph.agents)
        return lambda _, known: inverse[np.ix_(known, known)]
    found: dict[int, NDArray[Any]] = {}  # by graph, which many actions share

    def of_keepers(r: int, known: NDArray[np.int64]) -> NDArray[Any]:
        j = int(owner[r])
        among, keepers = kept.among(j), kept.keepers.of[j]
        if id(among) not in found:
            found[id(among)] = np.linalg.inv(among.laplacian + 1.0 / among.agents)
        order = np.argsort(keepers)
        at = order[np.searchsorted(keepers, known, sorter=order)]
        return found[id(among)][np.ix_(at, at)]

    return of_keepers


def _disagreements(
    inverse: _Inverses, agent: NDArray[np.int64], column: NDArray[np.int64]
) -> "csr_array":
    """The bases V_r side by side, (entries, entries - m)."""
    from scipy.linalg import helmert
    from scipy.sparse import block_diag, csr_array

    bases = []
    for r in range(int(column[-1]) + 1):
        known = agent[column == r]
        apart = helmert(len(known)).T if len(known) > 1 else np.zeros((1, 0))
        bases.append(apart @ np.linalg.cholesky(apart.T @ inverse(r, known) @ apart))
    return csr_array(block_diag(bases))


def _greatest(matrix: NDArray[np.float64]) -> float:
    """The greatest eigenvalue of a symmetric matrix, rounded up where it is found by iteration."""
    from scipy.linalg import eigvalsh
    from scipy.sparse.linalg import eigsh

    size = len(matrix)
    if size > _DENSE:
        start = np.random.default_rng(0).normal(size=size)
        found = eigsh(matrix, k=1, which="LA", v0=start, return_eigenvectors=False)[0]
        found += 1e-9 * abs(found)
        if positive_definite(found * np.eye(size) - matrix):  # so that none was missed
            return float(found)
    return float(eigvalsh(matrix, subset_by_index=[size - 1, size - 1])[0])
