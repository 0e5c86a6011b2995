"""Estimates of some actions only: who keeps which, and how they spread among those that do.

What agents take action j to be lies together: the action itself (agent j's own entry), then the
estimate of each of its keepers. Each estimate is coupled to those of neighbours that keep one too:
it follows the Laplacian of the graph that :class:`gne_mj.controllers.keepers.Keepers` leaves.
Behind all of them are m entries of room, for the profile at which an agent's cost is evaluated.

Where messages can be lost or late, the memory has what came last for each of these couplings, and
behind it a ring of what all agents kept at the last control instants.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.bounds import check_room
from gne_mj.controllers.estimates import given_estimates
from gne_mj.controllers.keepers import Keepers
from gne_mj.controllers.kept_propagation import kept_propagator
from gne_mj.controllers.propagation import Propagator
from gne_mj.graph import Graph

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class KeptData(NamedTuple):
    """Who keeps what, for native code; index lists are in compressed rows.

    A pair is an agent and an action that it keeps, its own among them.
    """

    pointer: Annotated[np.ndarray, "n", int]  # agent j -> the pairs of its action, its own first
    place: Annotated[np.ndarray, "n", int]  # pair -> its entries of the memory
    # pair -> where neighbours' entries of the same action begin
    near_pointer: Annotated[np.ndarray, "n", int]
    near: Annotated[np.ndarray, "n", int]
    row_pointer: Annotated[np.ndarray, "n", int]  # agent i -> the entries that are its estimates
    entry: Annotated[np.ndarray, "n", int]
    action: Annotated[np.ndarray, "n", int]  # and which entry of a profile each of them is
    link_pointer: Annotated[np.ndarray, "n", int]  # link -> what comes over it: entries of near
    item: Annotated[np.ndarray, "n", int]
    came: Annotated[np.ndarray, "n", int]  # entry of near -> where what came last is, behind LINKS


EVERYTHING = KeptData(*[np.zeros(0, dtype=np.int64)] * 10)  # of laws that keep all, or nothing


@dataclass(frozen=True, eq=False)
class Kept:
    """The estimates that a law keeps.

    Args:
        graph: over which agents communicate.
        offsets: where each agent's action starts in a profile, (N + 1,).
        keepers: who keeps whose action.
    """

    graph: Graph
    offsets: Indices
    keepers: Keepers

    def __post_init__(self) -> None:
        check_room("estimates", "needed", 4.0 * self._count_items(), "who passes on which estimate")

    @cached_property
    def data(self) -> KeptData:
        """For native code (read-only arrays)."""
        near_pointer, near, link = self._couplings
        widths = np.diff(self.offsets)[self.owner]
        place = _pointer(widths)
        order = np.argsort(link, kind="stable")
        counts = np.bincount(link, minlength=len(self.graph.data.neighbour))
        estimates = np.flatnonzero(self.estimated)
        holder = self.holder[estimates]
        rows = estimates[np.argsort(holder, kind="stable")]
        arrays = (
            _pointer([len(each) for each in self.keepers.of]),
            place,
            near_pointer,
            place[near],
            _pointer(np.bincount(holder, minlength=self.graph.agents)),
            rows,
            self.action[rows],
            _pointer(counts),
            order,
            _pointer(np.repeat(widths, np.diff(near_pointer))),
        )
        for array in arrays:
            array.flags.writeable = False
        return KeptData(*arrays)

    @cached_property
    def _graphs(self) -> dict[bytes, Graph]:
        return {}

    @cached_property
    def keeper(self) -> Indices:
        """The agent of each pair."""
        return np.concatenate(self.keepers.of)

    @cached_property
    def owner(self) -> Indices:
        """The agent whose action each pair is about."""
        return np.repeat(np.arange(self.graph.agents), [len(each) for each in self.keepers.of])

    @cached_property
    def holder(self) -> Indices:
        """The agent that has each entry of the memory, (size,)."""
        return np.repeat(self.keeper, np.diff(self.offsets)[self.owner])

    @cached_property
    def action(self) -> Indices:
        """Which entry of a profile each entry of the memory is, (size,)."""
        at = self.offsets
        each = [np.arange(at[j], at[j + 1]) for j in range(self.graph.agents)]
        rows = zip(each, self.keepers.of, strict=True)
        return np.concatenate([np.tile(block, len(kept)) for block, kept in rows])

    @cached_property
    def estimated(self) -> NDArray[np.bool_]:
        """Which entries of the memory are estimates: of others' actions, (size,)."""
        return self.holder != np.repeat(self.owner, np.diff(self.offsets)[self.owner])

    @property
    def size(self) -> int:
        """How many entries of the memory they are, own actions among them."""
        return len(self.holder)

    @property
    def links(self) -> Indices:
        """How many neighbours keep each agent's action, (N,)."""
        data = self.data
        own = data.pointer[:-1]
        return data.near_pointer[own + 1] - data.near_pointer[own]

    @cached_property
    def connectivity(self) -> float:
        """lambda_2 of the worst of the graphs that keepers form; infinite if nobody keeps any."""
        for j in range(self.graph.agents):
            self.among(j)
        shared = (graph for graph in self._graphs.values() if graph.agents > 1)
        return min((graph.algebraic_connectivity for graph in shared), default=np.inf)

    def among(self, j: int) -> Graph:
        """The graph of agent j's keepers, in their order."""
        data = self.data
        first, last = data.pointer[j], data.pointer[j + 1]
        pointer, near, _ = self._couplings
        heard = near[pointer[first] : pointer[last]] - first
        hearer = np.repeat(np.arange(last - first), np.diff(pointer[first : last + 1]))
        edges = np.column_stack([hearer, heard])[hearer < heard]
        key = edges.tobytes()  # many agents' keepers are connected in the same way
        if key not in self._graphs:
            self._graphs[key] = Graph(int(last - first), tuple(map(tuple, edges.tolist())))
        return self._graphs[key]

    def initial(self, y: Array, estimate: ArrayLike | None) -> Array:
        """The memory at the start, (size + m,); see :meth:`gne_mj.controllers.law.Law`."""
        m = len(y)
        given = given_estimates(self.graph.agents, y, estimate)
        if given.ndim == 2:
            kept = given[self.holder, self.action]
        else:
            kept = np.broadcast_to(given, (m,))[self.action]
        return np.concatenate([kept, np.zeros(m)])

    def propagator(self, duration: float) -> Propagator:
        """The exact maps over ``duration`` (rate times period)."""
        return kept_propagator(self.data, self.among, duration)

    def heard(self, memory: Array, delay: int) -> Array:
        """What a memory needs behind it where messages can be lost or late, flat.

        For every coupling what the neighbour kept, as if it had come just before the start; then
        room for all that was kept at the last ``delay`` + 1 control instants.
        """
        data, kept = self.data, memory[: self.size]
        widths = np.diff(data.came)
        came = np.arange(data.came[-1]) + np.repeat(data.near - data.came[:-1], widths)
        return np.concatenate([kept[came], np.tile(kept, delay + 1)])

    @property
    def heard_size(self) -> int:
        """How many entries what came last has."""
        return int(self.data.came[-1])

    def _count_items(self) -> int:
        """A bound on the couplings: each keeper of an action with all its neighbours."""
        degrees = np.diff(self.graph.data.pointer)
        return int(sum(min(len(k) ** 2, int(np.sum(degrees[k]))) for k in self.keepers.of))

    @cached_property
    def _couplings(self) -> tuple[Indices, Indices, Indices]:
        """For each pair those of neighbours, in compressed rows; and over which links they come."""
        pointer, neighbour = self.graph.data
        counts, pairs, links = [], [], []
        local, first = np.full(self.graph.agents, -1), 0
        for kept in self.keepers.of:
            local[kept] = first + np.arange(len(kept))
            over = np.concatenate([np.arange(pointer[i], pointer[i + 1]) for i in kept])
            found = local[neighbour[over]]
            by = np.repeat(np.arange(len(kept)), pointer[kept + 1] - pointer[kept])
            known = found >= 0
            counts.append(np.bincount(by[known], minlength=len(kept)))
            pairs.append(found[known])
            links.append(over[known])
            local[kept] = -1
            first += len(kept)
        return _pointer(np.concatenate(counts)), np.concatenate(pairs), np.concatenate(links)


def _pointer(counts: ArrayLike) -> Indices:
    found: Indices = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return found
