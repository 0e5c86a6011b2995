"""A formation: positions in the plane, wished relative to neighbours over any graph.

Positions y_i in m are taken relative to a point that moves at a constant velocity, which is the
agents' business. With an undirected graph of edges,

J_i = sum over neighbours j of w_ij |y_i - y_j - o_ij|^2 + v_i |y_i - r_i|^2,    o_ji = -o_ij,

where o_ij = r_i - r_j unless offsets are given by themselves; agents with v_i > 0 lead: they wish
to be at their place r_i, others keep their place among their neighbours. The shared constraints are
|y_i - y_j| <= R_ij along chosen links, as squares, then that each agent is in a convex region:
n.y_i <= b for each of the region's sides, and |y_i - c| <= r of its disc, as a square.

On each axis dF/dy = 2 (L + diag v) with the weights' Laplacian L: F is affine and symmetric, and
strongly monotone if and only if each connected part of the edges has a leader; else it is refused.

Parameters q = [N, links, sides, discs (0 or 1), sides (rows n_x, n_y, b), disc (c_x, c_y, r),
v (N), r (N rows x, y), links (rows i, j, R), where each agent's neighbours start (N + 1),
neighbours (rows j, w_ij, o_ij)].
"""

import sys
from functools import partial
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.bounds import MOST_ACTIONS, check_count
from gne_mj.errors import InvalidInput, part_of
from gne_mj.game_model import Game
from gne_mj.games import edges as graph
from gne_mj.games.region import Region, RegionTable
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.quantity import Quantity
from gne_mj.registry import GAMES
from gne_mj.toml_table import PerAgent, Unit, per_agent

Array = NDArray[np.float64]

HEADER, ROW = 4, 4  # numbers before the sides, and of each neighbour


def formation_game(
    desired_place: ArrayLike,
    edges: graph.Pairs,
    place_weight: ArrayLike,
    region: Region,
    *,
    edge_weight: ArrayLike = 1.0,
    desired_offset: ArrayLike | None = None,
    links: graph.Pairs | None = None,
    link_length: ArrayLike = 3.0,
) -> Game:
    """The game of N agents that form a shape in the plane without losing each other.

    Args:
        desired_place: r_i in m, shape (N, 2).
        edges: pairs of agents, numbered from 0; each pair once, in either order.
        place_weight: v_i >= 0, shape (N,); positive makes agent i a leader.
        region: where all must stay.
        edge_weight: w_ij > 0, one for all edges or one each.
        desired_offset: o_ij in m of each edge (i, j), what y_i - y_j is to be, shape (edges, 2);
            what the places say if left out.
        links: pairs that must stay within a length; the edges if left out.
        link_length: R > 0 in m, one for all links or one each.

    Raises:
        InvalidInput: a bad number or pair, or a connected part of the edges without a leader.
    """
    weight = np.atleast_1d(np.asarray(place_weight, dtype=np.float64))
    agents = len(weight)
    weight = graph.numbers("place_weight", weight, agents, "agent", "not negative")
    place = _vectors("desired_place", desired_place, agents, "agent")
    pairs = graph.checked("edges", edges, agents)
    graph.leaders("place_weight", pairs, weight)
    neighbours = graph.neighbours(pairs, agents)
    sides = len(region.offsets)
    each = sides + region.disc  # constraints of an agent's place
    tied = pairs if links is None else graph.checked("links", links, agents)
    check_count("links", len(tied) + each * agents, MOST_ACTIONS, "these and the region's bounds")
    length = graph.numbers("link_length", link_length, len(tied), "link", "positive")
    return Game(
        name="formation", kernels=sys.modules[__name__],
        parameters=np.concatenate([
            [agents, len(tied), sides, region.disc], *_region_rows(region),
            weight, place.ravel(), np.column_stack([_ends(tied), length]).ravel(),
            *_neighbour_rows(pairs, edge_weight, desired_offset, place),
        ], dtype=np.float64),
        sizes=(2,) * agents,
        in_cost=[[i, *near] for i, near in enumerate(neighbours)],
        in_constraint=[*map(list, tied), *([i] for i in range(agents) for _ in range(each))],
        constraint_names=_constraint_names(tied, agents, sides, region.disc),
        action_name="position", action_unit="m",
        affine=True,
        box=(np.tile(region.box[0], agents), np.tile(region.box[1], agents)),
        # with sides not all constraints are bounds on gaps
        gap_bounds=None if sides else np.concatenate([length, np.full(agents, region.radius)]),
        agent_name="robot", axes=("x", "y"),
        quantities=_quantities(tied, length, region, each * agents),
        constraint_class="quadratic" if tied or region.disc else "affine",
        smooth=True, tested=True,
    )  # fmt: skip


def _vectors(key: str, given: ArrayLike, count: int, what: str) -> Array:
    try:
        vectors = np.asarray(given, dtype=np.float64)
    except ValueError:  # lists of unequal lengths
        vectors = np.zeros(0)
    if vectors.shape != (count, 2) or not np.all(np.isfinite(vectors)):
        expected = f"it must list {count} times [x, y], one for each {what}, of finite numbers"
        raise InvalidInput(key, given, expected)
    return vectors


def _region_rows(region: Region) -> tuple[Array, list[float]]:
    """The numbers of its sides, and of its disc if it has one."""
    sides = np.column_stack([region.normals, region.offsets])
    return sides.ravel(), [*region.center, region.radius] * region.disc


def _ends(pairs: graph.Pairs) -> NDArray[np.int64]:
    """(pairs, 2) both agents of each."""
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _neighbour_rows(
    pairs: graph.Pairs, edge_weight: ArrayLike, desired_offset: ArrayLike | None, place: Array
) -> tuple[NDArray[np.int64], Array]:
    """Where each agent's neighbours start, and rows j, w_ij, o_ij of all, agent by agent."""
    first, second = _ends(pairs).T
    given = place[first] - place[second] if desired_offset is None else desired_offset
    offset = _vectors("desired_offset", given, len(pairs), "edge")
    weight = graph.numbers("edge_weight", edge_weight, len(pairs), "edge", "positive")
    rows: list[list[list[float]]] = [[] for _ in place]
    for (i, j), w, o in zip(pairs, weight, offset, strict=True):
        rows[i].append([j, w, *o])
        rows[j].append([i, w, *-o])
    numbers = [number for each in rows for row in each for number in row]
    return np.cumsum([0, *map(len, rows)]), np.array(numbers, dtype=np.float64)


def _constraint_names(links: graph.Pairs, agents: int, sides: int, disc: bool) -> tuple[str, ...]:
    names = [f"link of agents {i + 1} and {j + 1}" for i, j in links]
    for i in range(agents):
        names += [f"side {k + 1} of the region, agent {i + 1}" for k in range(sides)]
        names += [f"disc of the region, agent {i + 1}"] * disc
    return tuple(names)


def _quantities(
    links: graph.Pairs, length: Array, region: Region, others: int
) -> tuple[Quantity, ...]:
    """How long links are, if there are any, and how much of the region each agent uses.

    The constraints behind the links, ``others`` of them, have no length.
    """
    share = Quantity(
        name="region_share", long_name="share of the region", unit="",
        values=partial(_region_shares, region), each="agent", bound=1.0, outline=region.outline,
    )  # fmt: skip
    if not links:
        return (share,)
    nothing = np.full(others, np.nan)
    lengths = Quantity(
        name="link_length", long_name="link length", unit="m",
        values=partial(_link_lengths, _ends(links).T, nothing), each="constraint",
        symbol="|y_i - y_j|", bound=np.concatenate([length, nothing]),
        between=np.concatenate([_ends(links), np.full((others, 2), -1)]),
    )  # fmt: skip
    return lengths, share


def _region_shares(region: Region, y: Array) -> Array:
    return region.share(y.reshape(len(y), -1, 2))


def _link_lengths(links: NDArray[np.int64], others: Array, y: Array) -> Array:
    points = y.reshape(len(y), -1, 2)
    lengths = np.linalg.norm(points[:, links[0]] - points[:, links[1]], axis=2)
    return np.concatenate([lengths, np.broadcast_to(others, (len(y), len(others)))], axis=1)


@kernel
def agents_at(q):
    """Where v begins, behind the region."""
    return HEADER + 3 * int(q[2] + q[3])


@kernel
def links_at(q):
    """Where the links' rows begin, behind v and r."""
    return agents_at(q) + 3 * int(q[0])


@kernel
def neighbours_at(q, i):
    """Where agent i's neighbours' rows start, and where they end."""
    n = int(q[0])
    pointer = links_at(q) + 3 * int(q[1])
    rows = pointer + n + 1
    return rows + ROW * int(q[pointer + i]), rows + ROW * int(q[pointer + i + 1])


@kernel
def cost(q, i, y):
    """J_i = sum_j w_ij |y_i - y_j - o_ij|^2 + v_i |y_i - r_i|^2."""
    at = agents_at(q)
    place = at + int(q[0]) + 2 * i
    first, last = neighbours_at(q, i)
    total = 0.0
    for k in range(2):
        own = y[2 * i + k]
        total += q[at + i] * (own - q[place + k]) ** 2
        for row in range(first, last, ROW):
            total += q[row + 1] * (own - y[2 * int(q[row]) + k] - q[row + 2 + k]) ** 2
    return total


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_a = 2 sum_j w_ij (y_i - y_j - o_ij) + 2 v_i (y_i - r_i), entry a of agent i."""
    at, k = agents_at(q), a % 2
    first, last = neighbours_at(q, i)
    total = q[at + i] * (y[a] - q[at + int(q[0]) + a])
    for row in range(first, last, ROW):
        total += q[row + 1] * (y[a] - y[2 * int(q[row]) + k] - q[row + 2 + k])
    return 2.0 * total


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """2 (v_i + sum_j w_ij) for the entry itself, -2 w_ij for each neighbour's on that axis."""
    first, last = neighbours_at(q, i)
    out[a] += 2.0 * scale * q[agents_at(q) + i]
    for row in range(first, last, ROW):
        stiff = 2.0 * scale * q[row + 1]
        out[a] += stiff
        out[2 * int(q[row]) + a % 2] -= stiff


@kernel
def excess(x, y, bound):
    """x^2 + y^2 - bound^2; at the bound the greater entry is at least 0.7 of it, so that the
    difference of the two is exact and little is lost."""
    greater, rest = abs(x), abs(y)
    if rest > greater:
        greater, rest = rest, greater
    return (greater - bound) * (greater + bound) + rest * rest


@kernel
def of_region(q, l):
    """The agent of a constraint behind the links, and the number of the side (or of the disc)."""
    each = int(q[2] + q[3])
    number = l - int(q[1])
    return number // each, number % each


@kernel
def constraint(q, l, y):
    """|y_i - y_j|^2 - R^2 of a link, n.y_i - b of a side, |y_i - c|^2 - r^2 of the disc."""
    if l < int(q[1]):
        row = links_at(q) + 3 * l
        i, j = 2 * int(q[row]), 2 * int(q[row + 1])
        return excess(y[i] - y[j], y[i + 1] - y[j + 1], q[row + 2])
    i, k = of_region(q, l)
    row = HEADER + 3 * k
    if k < int(q[2]):
        return q[row] * y[2 * i] + q[row + 1] * y[2 * i + 1] - q[row + 2]
    return excess(y[2 * i] - q[row], y[2 * i + 1] - q[row + 1], q[row + 2])


@kernel
def constraint_gradient(q, l, a, y):
    """Of a link 2 (y_i - y_j) for the first agent and the opposite for the second, n of a side,
    2 (y_i - c) of the disc."""
    if l < int(q[1]):
        row = links_at(q) + 3 * l
        i, j = 2 * int(q[row]), 2 * int(q[row + 1])
        gap = y[i + a % 2] - y[j + a % 2]
        return 2.0 * gap if a // 2 == i // 2 else -2.0 * gap
    _, k = of_region(q, l)
    row = HEADER + 3 * k + a % 2
    return q[row] if k < int(q[2]) else 2.0 * (y[a] - q[row])


@kernel
def constraint_hessian(q, l, a, b, y):
    """Of a link, on one axis, 2 on the diagonal and -2 off it; of the disc 2 on the diagonal."""
    if l < int(q[1]):
        if a % 2 != b % 2:
            return 0.0
        return 2.0 if a == b else -2.0
    _, k = of_region(q, l)
    return 2.0 if a == b and k == int(q[2]) else 0.0


_Point = tuple[float, float]


@GAMES.register
class FormationTable(GameTable):
    """Positions in the plane; for agents whose output is a position on two axes."""

    type: Literal["formation"]
    desired_place: Annotated[list[_Point] | None, Unit("m")] = Field(
        None,
        description="r_i, [x, y] for each agent; if left out on a circle about 0, neighbours 1 m"
        " apart",
    )
    edges: graph.Edges = Field(
        "ring", description="a name, or pairs of agents numbered from 1: who looks at whose place"
    )
    edge_weight: Annotated[PerAgent, Unit("", "> 0")] = Field(
        1.0, description="w_ij; one or one for each edge"
    )
    desired_offset: Annotated[list[_Point] | None, Unit("m")] = Field(
        None, description="y_i - y_j, one for each edge; as the places are if left out"
    )
    place_weight: Annotated[PerAgent | None, Unit("", ">= 0")] = Field(
        None, description="v_i, positive for leaders and 0 for others; if left out agent 1 leads"
    )
    links: graph.Edges | None = Field(
        None, description="pairs that must stay within link_length; the edges if left out"
    )
    link_length: Annotated[PerAgent, Unit("m", "> 0")] = Field(
        3.0, description="R; one or one for each link"
    )
    region: RegionTable = Field(
        RegionTable(box=[[-5.0, -5.0], [5.0, 5.0]]), description="where all must stay"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        check_count("agents", 2 * count, MOST_ACTIONS, "the actions of all")
        given = self.place_weight
        weight = per_agent("place_weight", 0.0 if given is None else given, count)
        if given is None:
            weight[0] = 1.0
        with part_of("region"):
            region = self.region.build()
        return formation_game(
            _circle(count) if self.desired_place is None else self.desired_place,
            graph.pairs_of(self.edges, count),
            weight,
            region,
            edge_weight=self.edge_weight,
            desired_offset=self.desired_offset,
            links=None if self.links is None else graph.pairs_of(self.links, count),
            link_length=self.link_length,
        )

    def default_start(self, count: int) -> Array:
        """On a circle about the region's middle, half way to its boundary or less for the links."""
        region = self.region.build()
        radius = min(0.5 * region.depth, 0.25 * np.min(self.link_length, initial=np.inf))
        return (region.middle + radius * _directions(count)).ravel()


def _directions(count: int) -> Array:
    """(count, 2) unit vectors, evenly around."""
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _circle(count: int) -> Array:
    """(count, 2) places on a circle about 0, neighbours 1 m apart."""
    radius = 0.5 / np.sin(np.pi / count) if count > 1 else 0.0
    return radius * _directions(count)
