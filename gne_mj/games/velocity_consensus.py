"""Velocity consensus with leaders: velocity vectors synchronised over any graph, gaps bounded.

With y_i in R^d (m/s) and an undirected graph of edges,

J_i = sum over neighbours j of |y_i - y_j|^2 + w_i |y_i - v_0|^2,

|y_i - y_j| <= delta along every edge and |y_i - v_0| <= delta for every leader (w_i > 0), as
squares, edges first. It generalises [eq:sensorNetGNE], whose agents each look at one other only.

Parameters q = [d, N, p, v_0 (d), w (N), constraints (p rows i, j, delta; j = N stands for v_0),
where each agent's neighbours start (N + 1), neighbours].
"""

import sys
from collections.abc import Sequence
from functools import partial
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.bounds import MOST_ACTIONS, check_count
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Box, Game
from gne_mj.games import edges as graph
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.quantity import Quantity
from gne_mj.registry import GAMES
from gne_mj.toml_table import PerAgent, Unit, per_agent

HEADER = 3


def velocity_consensus_game(
    edges: Sequence[tuple[int, int]],
    leader_weight: Sequence[float],
    reference_velocity: Sequence[float],
    gap_bound: ArrayLike,
    leader_gap_bound: ArrayLike,
) -> Game:
    """The game of N agents whose velocities agree along edges, leaders knowing v_0.

    Args:
        edges: pairs of agents, numbered from 0; each pair once, in either order.
        leader_weight: w_i >= 0, shape (N,); positive makes agent i a leader.
        reference_velocity: v_0 in m/s, shape (d,).
        gap_bound: delta > 0 in m/s of the edges, one for all or one each.
        leader_gap_bound: delta > 0 in m/s of the leaders to v_0, one for all or one each.

    Raises:
        InvalidInput: a bad number or edge, or a connected part of the graph without a leader.
    """
    reference = _finite("reference_velocity", reference_velocity)
    weight = _weights(leader_weight)
    agents, dimension = len(weight), len(reference)
    pairs = graph.checked("edges", edges, agents)
    leaders = graph.leaders("leader_weight", pairs, weight)
    of_edges = graph.numbers("gap_bound", gap_bound, len(pairs), "edge", "positive")
    own = graph.numbers("leader_gap_bound", leader_gap_bound, len(leaders), "leader", "positive")
    rows, bounds = [*pairs, *((int(i), agents) for i in leaders)], np.concatenate([of_edges, own])
    neighbours, (first, second) = graph.neighbours(pairs, agents), np.array(rows).T
    gaps = Quantity(
        name="gap", long_name="velocity gap", unit="m/s",
        values=partial(_distances, first, second, reference), each="constraint",
        symbol="|y_i - y_j|", bound=bounds,
    )  # fmt: skip
    each = np.column_stack([first, second, bounds]).ravel()
    head = np.concatenate([[dimension, agents, len(rows)], reference, weight, each])
    return Game(
        name="velocity consensus",
        kernels=sys.modules[__name__],
        parameters=np.concatenate([head, *_lists(neighbours)]),
        sizes=(dimension,) * agents,
        in_cost=[[i, *members] for i, members in enumerate(neighbours)],
        in_constraint=[[i] if j == agents else [i, j] for i, j in rows],
        constraint_names=_constraint_names(rows, agents),
        action_name="velocity",
        action_unit="m/s",
        affine=True,
        box=_box(first, second, bounds, reference, agents),
        gap_bounds=bounds,
        # A disc is no polygon; only on a line are its bounds affine.
        affine_constraints=2 * len(rows) if dimension == 1 else None,
        agent_name="robot",
        constraint_class="quadratic",
        smooth=True,
        tested=True,
        axes=("x", "y", "z")[:dimension] if 1 < dimension <= 3 else (),
        quantities=(gaps,),
    )


def _lists(rows: Sequence[Sequence[int]]) -> list[NDArray[np.int64]]:
    """Where each row begins, and all rows one behind the other."""
    whole = [entry for row in rows for entry in row]
    return [np.cumsum([0, *map(len, rows)]), np.array(whole, dtype=np.int64)]


def _constraint_names(rows: Sequence[tuple[int, int]], agents: int) -> tuple[str, ...]:
    return tuple(
        f"gap of agent {i + 1} to v_0" if j == agents else f"gap of agents {i + 1} and {j + 1}"
        for i, j in rows
    )


def _distances(
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    reference: NDArray[np.float64],
    y: NDArray[np.float64],
) -> NDArray[np.float64]:
    """|y_i - y_j| of each constraint, shape (len(y), p); agent N is the reference v_0."""
    points = np.concatenate(
        [
            y.reshape(len(y), -1, len(reference)),
            np.broadcast_to(reference, (len(y), 1, len(reference))),
        ],
        axis=1,
    )
    return np.linalg.norm(points[:, first] - points[:, second], axis=2)


def _finite(key: str, given: Sequence[float]) -> NDArray[np.float64]:
    values = np.asarray(given, dtype=np.float64)
    if values.ndim != 1 or not len(values) or not np.all(np.isfinite(values)):
        raise InvalidInput(key, given, "it must be a list of finite numbers")
    return values


def _weights(leader_weight: Sequence[float]) -> NDArray[np.float64]:
    weight = _finite("leader_weight", leader_weight)
    if np.any(weight < 0):
        raise InvalidInput("leader_weight", leader_weight, "no entry may be negative")
    return weight


def _box(
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    bounds: NDArray[np.float64],
    reference: NDArray[np.float64],
    agents: int,
) -> Box:
    """No agent is farther from v_0 than the shortest way there over edges of length delta."""
    from scipy.sparse import csr_array  # slow to load, and for this game only
    from scipy.sparse.csgraph import dijkstra

    lengths = csr_array((bounds, (first, second)), shape=(agents + 1, agents + 1))
    reach = dijkstra(lengths, directed=False, indices=agents)[:agents, None]
    return (reference - reach).ravel(), (reference + reach).ravel()


@kernel
def gap(q, l, k, y):
    """Entry k of y_i - y_j, or of y_i - v_0, in constraint l."""
    d, n = int(q[0]), int(q[1])
    row = HEADER + d + n + 3 * l
    i, j = int(q[row]), int(q[row + 1])
    return y[i * d + k] - (q[HEADER + k] if j == n else y[j * d + k])


@kernel
def neighbours_at(q, i):
    """Where agent i's neighbours start in q, and where they end."""
    d, n, p = int(q[0]), int(q[1]), int(q[2])
    pointer = HEADER + d + n + 3 * p
    index = pointer + n + 1
    return index + int(q[pointer + i]), index + int(q[pointer + i + 1])


@kernel
def cost(q, i, y):
    """J_i = sum_j |y_i - y_j|^2 + w_i |y_i - v_0|^2."""
    d = int(q[0])
    first, last = neighbours_at(q, i)
    weight = q[HEADER + d + i]
    total = 0.0
    for k in range(d):
        own = y[i * d + k]
        total += weight * (own - q[HEADER + k]) ** 2
        for entry in range(first, last):
            total += (own - y[int(q[entry]) * d + k]) ** 2
    return total


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_a = 2 sum_j (y_i - y_j) + 2 w_i (y_i - v_0), entry a of agent i."""
    d = int(q[0])
    k = a - i * d
    first, last = neighbours_at(q, i)
    total = q[HEADER + d + i] * (y[a] - q[HEADER + k])
    for entry in range(first, last):
        total += y[a] - y[int(q[entry]) * d + k]
    return 2.0 * total


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """2 (w_i + neighbours) for the entry itself, -2 for each neighbour's entry on that axis."""
    d = int(q[0])
    k = a - i * d
    first, last = neighbours_at(q, i)
    out[a] += 2.0 * scale * (q[HEADER + d + i] + (last - first))
    for entry in range(first, last):
        out[int(q[entry]) * d + k] -= 2.0 * scale


@kernel
def constraint(q, l, y):
    """g_l = |gap_l|^2 - delta_l^2.

    The greatest entry's square and delta^2 are taken as a product, which cancels nothing where it
    is most of the gap: of two entries it is at least 0.7 delta at the bound, so their difference
    is exact.
    """
    d, n = int(q[0]), int(q[1])
    bound = q[HEADER + d + n + 3 * l + 2]
    greatest, rest = 0.0, 0.0
    for k in range(d):
        size = abs(gap(q, l, k, y))
        if size > greatest:
            size, greatest = greatest, size
        rest += size * size
    return (greatest - bound) * (greatest + bound) + rest


@kernel
def constraint_gradient(q, l, a, y):
    """2 gap_l on a's axis for the first agent of the pair, -2 gap_l for the second."""
    d, n = int(q[0]), int(q[1])
    first = int(q[HEADER + d + n + 3 * l])
    i = a // d
    return (2.0 if i == first else -2.0) * gap(q, l, a - i * d, y)


@kernel
def constraint_hessian(q, l, a, b, y):
    """On one axis 2 on the diagonal of the pair's block and -2 off it; 0 between axes."""
    d = int(q[0])
    if a % d != b % d:
        return 0.0
    return 2.0 if a == b else -2.0


@GAMES.register
class VelocityConsensusTable(GameTable):
    """Velocity vectors synchronised over any graph, some agents knowing the reference."""

    type: Literal["velocity-consensus"]
    reference_velocity: Annotated[list[float], Unit("m/s")] = Field([1.0, 1.0], description="v_0")
    edges: graph.Edges = Field(
        "ring",
        description="a name, or pairs of agents numbered from 1; of the game, not of who hears"
        " whom",
    )
    leader_weight: Annotated[PerAgent | None, Unit("", ">= 0")] = Field(
        None, description="w_i, positive for leaders and 0 for others; if left out agent 1 leads"
    )
    gap_bound: Annotated[PerAgent, Unit("m/s", "> 0")] = Field(
        3.0, description="one or one for each edge"
    )
    leader_gap_bound: Annotated[PerAgent, Unit("m/s", "> 0")] = Field(
        3.0, description="to v_0, one or one for each leader"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        check_count(
            "agents", count * len(self.reference_velocity), MOST_ACTIONS, "the actions of all"
        )
        given = self.leader_weight
        weight = per_agent("leader_weight", 0.0 if given is None else given, count)
        if given is None:
            weight[0] = 1.0
        return velocity_consensus_game(
            graph.pairs_of(self.edges, count),
            weight.tolist(),
            self.reference_velocity,
            self.gap_bound,
            self.leader_gap_bound,
        )

    def away(self, count: int) -> NDArray[np.float64]:
        """The reference velocity."""
        return np.tile(np.array(self.reference_velocity), count)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """Everyone half a leader's bound below the reference, along the first axis."""
        start = np.tile(np.array(self.reference_velocity), (count, 1))
        start[:, 0] -= 0.5 * np.min(self.leader_gap_bound)
        return start.ravel()
