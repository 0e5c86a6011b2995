"""Communication graphs that change during a run: by a schedule, or with agents' distances.

The storage function of partial information does not know the graph, so that it falls over every
graph for which it is certified, however the graph switches among those (docs/networks.md).
"""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.graph import Graph, GraphData, complete

ROUNDING = 1e-9  # of a time, relative to what lies between two changes
MOST_ENUMERATED = 6  # agents of which all trees are looked at: there are 1296


class ChangingGraph(Graph):
    """A graph that is another one from time to time; ``edges`` are all that it can have."""

    changes: ClassVar[bool] = True

    @property
    @abstractmethod
    def times(self) -> tuple[float, ...]:
        """How long in s it stays as it is, each of the lengths that there are."""

    @property
    @abstractmethod
    def table(self) -> dict[str, Any]:
        """As a scenario has it."""

    @abstractmethod
    def next_look(self, time: float) -> float:
        """The first time in s after ``time`` at which it can have become another one."""

    @abstractmethod
    def lists_at(self, time: float, places: NDArray[np.float64] | None, seed: int) -> GraphData:
        """Who hears whom from a time on.

        Args:
            time: in s, a time at which it can become another one, or later before the next.
            places: (N, d) of the agents then, in m; None where they have none.
            seed: of the run, for what is random.
        """

    @abstractmethod
    def edges_at(
        self, time: NDArray[np.float64], places: NDArray[np.float64] | None, seed: int
    ) -> NDArray[np.bool_]:
        """(samples, edges): which of ``edges`` there are at times (samples,), with the agents then
        at ``places`` (samples, N, d)."""


@dataclass(frozen=True, eq=False)
class SwitchingGraph(ChangingGraph):
    """One graph after the other, over and over; made by :func:`switching`.

    Args:
        agents, edges: of the union.
        graphs: each on all agents, connected.
        durations: of each in s.
        random: whether the next one is drawn, each time anew; durations are then equal.
    """

    graphs: tuple[Graph, ...] = ()
    durations: tuple[float, ...] = ()
    random: bool = False

    @property
    def members(self) -> tuple[Graph, ...]:
        """See the base class."""
        return self.graphs

    @property
    def times(self) -> tuple[float, ...]:
        """See the base class."""
        return self.durations

    @property
    def table(self) -> dict[str, Any]:
        """See the base class."""
        every = self.durations[0] if self.random else list(self.durations)
        order = "random" if self.random else "given"
        return {"type": "switching", "graphs": list(self.graphs), "every": every, "order": order}

    def among(self, there: NDArray[np.bool_]) -> "SwitchingGraph":
        """See the base class."""
        every = self.durations[0] if self.random else self.durations
        return switching([graph.among(there) for graph in self.graphs], every, random=self.random)

    @cached_property
    def data(self) -> GraphData:
        """Those of the first graph."""
        return self.graphs[0].data

    @cached_property
    def algebraic_connectivity(self) -> float:
        """The least of all members."""
        return min(graph.algebraic_connectivity for graph in self.graphs)

    @cached_property
    def largest_eigenvalue(self) -> float:
        """The greatest of all members."""
        return max(graph.largest_eigenvalue for graph in self.graphs)

    @cached_property
    def _ends(self) -> NDArray[np.float64]:
        return np.cumsum(self.durations)

    def _turn(self, time: float) -> tuple[int, int]:
        """How often all were there before a time, and which one it is since."""
        whole = self._ends[-1]
        rounds = int(np.floor(time / whole + ROUNDING))
        within = time - rounds * whole + ROUNDING * whole
        return rounds, int(np.searchsorted(self._ends, within, side="right"))

    def number_at(self, time: float, seed: int) -> int:
        """Which of the graphs it is at a time; the first one at 0 if the order is given."""
        rounds, turn = self._turn(time)
        if not self.random:
            return turn
        count = rounds * len(self.graphs) + turn
        return int(np.random.default_rng([seed, count]).integers(len(self.graphs)))

    def next_look(self, time: float) -> float:
        """See the base class."""
        rounds, turn = self._turn(time)
        return float(rounds * self._ends[-1] + self._ends[turn])

    def lists_at(self, time: float, places: NDArray[np.float64] | None, seed: int) -> GraphData:
        """See the base class."""
        return self.graphs[self.number_at(time, seed)].data

    def edges_at(
        self, time: NDArray[np.float64], places: NDArray[np.float64] | None, seed: int
    ) -> NDArray[np.bool_]:
        """See the base class."""
        of = np.array([[edge in set(graph.edges) for edge in self.edges] for graph in self.graphs])
        found: NDArray[np.bool_] = of[[self.number_at(float(each), seed) for each in time]]
        return found.reshape(len(time), len(self.edges))


def switching(
    graphs: Sequence[Graph], every: float | Sequence[float], *, random: bool = False
) -> SwitchingGraph:
    """A graph that is each of these in turn.

    Args:
        graphs: on the same agents; each is connected.
        every: how long each of them is there, in s; one number for all, or one each.
        random: the next one is drawn by the run's seed in place of the one that follows; ``every``
            is then one number.

    Raises:
        InvalidInput: no graphs, or of different sizes; times that are not positive.
    """
    if not graphs:
        raise InvalidInput("graphs", [], "there must be at least one")
    sizes = sorted({graph.agents for graph in graphs})
    if len(sizes) > 1:
        raise InvalidInput("graphs", f"of {sizes} agents", "all must have the same agents")
    given = np.asarray(every, dtype=np.float64)
    if given.ndim > 1 or (given.ndim == 1 and (len(given) != len(graphs) or random)):
        one = "one number, since the order is random" if random else (
            f"one number or {len(graphs)} of them, one for each graph")  # fmt: skip
        raise InvalidInput("every", every, f"it must be {one}")
    if not np.all((given > 0) & np.isfinite(given)):
        raise InvalidInput("every", every, "it must be positive and finite")
    edges = tuple(sorted({edge for graph in graphs for edge in graph.edges}))
    durations = tuple(np.broadcast_to(given, (len(graphs),)).tolist())
    return SwitchingGraph(sizes[0], edges, tuple(graphs), durations, random)


@dataclass(frozen=True, eq=False)
class DiscGraph(ChangingGraph):
    """Agents hear each other within a radius; made by :func:`disc`.

    Args:
        agents, edges: of the complete graph.
        radius: in m.
        interval: how often distances are looked at, in s.
    """

    radius: float = np.inf
    interval: float = 0.1

    @property
    def members(self) -> tuple[Graph, ...] | None:
        """All trees, of up to 6 agents: a connected graph has one of them, and its Laplacian is
        at least that tree's."""
        if self.agents > MOST_ENUMERATED:
            return None
        return tuple(Graph(self.agents, edges) for edges in _trees(self.agents))

    @property
    def times(self) -> tuple[float, ...]:
        """See the base class."""
        return (self.interval,)

    @property
    def table(self) -> dict[str, Any]:
        """See the base class."""
        return {"type": "disc", "radius": self.radius, "interval": self.interval}

    def among(self, there: NDArray[np.bool_]) -> "DiscGraph":
        """See the base class."""
        return disc(int(np.sum(there)), self.radius, self.interval)

    @cached_property
    def algebraic_connectivity(self) -> float:
        """That of a path, the least of all connected graphs (Fiedler, 1973)."""
        return 2.0 * (1.0 - np.cos(np.pi / self.agents)) if self.agents > 1 else 0.0

    @cached_property
    def largest_eigenvalue(self) -> float:
        """N, that of the complete graph."""
        return float(self.agents) if self.agents > 1 else 0.0

    def next_look(self, time: float) -> float:
        """See the base class."""
        return float((np.floor(time / self.interval + ROUNDING) + 1.0) * self.interval)

    def lists_at(self, time: float, places: NDArray[np.float64] | None, seed: int) -> GraphData:
        """See the base class."""
        assert places is not None
        near = self._near(places[None])[0]
        np.fill_diagonal(near, False)
        hearer, heard = np.nonzero(near)
        pointer = np.searchsorted(hearer, np.arange(self.agents + 1))
        return GraphData(pointer.astype(np.int64), heard.astype(np.int64))

    def edges_at(
        self, time: NDArray[np.float64], places: NDArray[np.float64] | None, seed: int
    ) -> NDArray[np.bool_]:
        """See the base class."""
        assert places is not None
        first, second = np.array(self.edges, dtype=np.int64).reshape(-1, 2).T
        return self._near(places)[:, first, second]

    def _near(self, places: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(samples, N, N): who is within reach of whom."""
        apart = places[:, :, None, :] - places[:, None, :, :]
        return np.asarray(np.sum(apart * apart, axis=-1) <= self.radius**2)


def disc(agents: int, radius: float, interval: float = 0.1) -> DiscGraph:
    """Agents hear those within a radius.

    Args:
        agents: N.
        radius: in m.
        interval: how often distances are looked at, in s.

    Raises:
        InvalidInput: a number that is not positive.
    """
    for key, value in (("radius", radius), ("interval", interval)):
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(key, value, "it must be positive and finite")
    return DiscGraph(agents, complete(agents).edges, float(radius), float(interval))


def _trees(agents: int) -> Iterator[tuple[tuple[int, int], ...]]:
    """All trees on so many labelled vertices, from their Pruefer sequences."""
    if agents <= 2:
        yield ((0, 1),) if agents == 2 else ()
        return
    for sequence in product(range(agents), repeat=agents - 2):
        degree = np.bincount(sequence, minlength=agents) + 1
        edges = []
        for vertex in sequence:
            leaf = int(np.flatnonzero(degree == 1)[0])
            edges.append((leaf, vertex))
            degree[[leaf, vertex]] -= 1
        first, second = np.flatnonzero(degree == 1)
        yield (*edges, (int(first), int(second)))
