"""Who hears whom: undirected communication graphs (paper, section II-C)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.bounds import MOST_EDGES, check_count
from gne_mj.errors import InvalidInput

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Up to this many agents eigenvalues come from dense matrices
_DENSE = 300


class GraphData(NamedTuple):
    """Neighbour lists for native code: agent i hears ``neighbour[pointer[i]:pointer[i + 1]]``."""

    pointer: Annotated[np.ndarray, "N + 1", int]
    neighbour: Annotated[np.ndarray, "n", int]


@dataclass(frozen=True, eq=False)
class Graph:
    """An undirected, connected graph on N agents (Assumption [asmp:graph]).

    Args:
        agents: N.
        edges: pairs of agents, numbered from 0; order and repetition do not matter.
        rest_of: the graph that this is what is left of, where links were lost; it need not be
            connected then.

    Attributes:
        changes: whether it becomes another one during a run, ``edges`` being all that it can have.

    Raises:
        InvalidInput: an agent that does not exist, a loop, or a graph that is not connected.
    """

    changes: ClassVar[bool] = False
    agents: int
    edges: tuple[tuple[int, int], ...]
    rest_of: "Graph | None" = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        unique = set()
        for i, j in self.edges:
            if not (0 <= i < self.agents and 0 <= j < self.agents):
                raise InvalidInput(
                    "edges", [i + 1, j + 1], f"agents are numbered 1 to {self.agents}"
                )
            if i == j:
                raise InvalidInput("edges", [i + 1, j + 1], "an edge joins two agents")
            unique.add((min(i, j), max(i, j)))
        object.__setattr__(self, "edges", tuple(sorted(unique)))
        first, second = np.array(self.edges, dtype=np.int64).reshape(-1, 2).T
        part = parts(first, second, self.agents)
        if np.any(part > 0) and self.rest_of is None:
            apart = [int(i) + 1 for i in np.flatnonzero(part > 0)]
            shown = ", ".join(map(str, apart[:5])) + (", ..." if len(apart) > 5 else "")
            raise InvalidInput(
                "edges",
                f"{len(self.edges)} edges in {len(set(part.tolist()))} parts",
                f"the graph must be connected; agent 1 cannot reach"
                f" agent{'s' if len(apart) > 1 else ''} {shown}",
            )

    def __repr__(self) -> str:
        connectivity = f", lambda_2 = {self.algebraic_connectivity:.4g}" * (self.agents <= _DENSE)
        return f"<Graph of {self.agents} agents, {len(self.edges)} edges{connectivity}>"

    @cached_property
    def laplacian(self) -> np.ndarray:
        """L = D - A, shape (N, N), dense and read-only."""
        matrix = laplacian_of(self.data)
        matrix.flags.writeable = False
        return matrix

    @cached_property
    def sparse_laplacian(self) -> "csr_array":
        """L = D - A, shape (N, N), sparse."""
        from scipy.sparse import csr_array  # slow to load, and for many agents only

        agents, (pointer, neighbour) = np.arange(self.agents), self.data
        at = np.concatenate([self._hearer, agents]), np.concatenate([neighbour, agents])
        values = np.concatenate([np.full(len(neighbour), -1.0), np.diff(pointer)])
        return csr_array((values, at), shape=(self.agents, self.agents))

    @cached_property
    def algebraic_connectivity(self) -> float:
        """lambda_2 of the Laplacian (0 for a single agent)."""
        if self.agents == 1:
            return 0.0
        if self.agents <= _DENSE:
            return float(np.linalg.eigvalsh(self.laplacian)[1])
        from scipy.sparse.linalg import eigsh

        # Inverse iteration about a point below zero, where L is regular.
        near = eigsh(self.sparse_laplacian.tocsc(), k=2, sigma=-1e-4, return_eigenvectors=False)
        return float(np.max(near))

    @cached_property
    def largest_eigenvalue(self) -> float:
        """lambda_max of the Laplacian (0 for a single agent); of many agents to 1e-4 relative."""
        if self.agents == 1:
            return 0.0
        if self.agents <= _DENSE:
            return float(np.linalg.eigvalsh(self.laplacian)[-1])
        from scipy.sparse.linalg import eigsh

        # A ring's or line's greatest eigenvalues crowd: full accuracy takes half a minute there.
        start = np.random.default_rng(0).normal(size=self.agents)
        largest = eigsh(
            self.sparse_laplacian, k=1, which="LA", tol=1e-4, v0=start, return_eigenvectors=False
        )
        return float(largest[0])

    @cached_property
    def data(self) -> GraphData:
        """Neighbour lists for native code."""
        pairs = np.array(self.edges, dtype=np.int64).reshape(-1, 2)
        hearer, heard = np.concatenate([pairs, pairs[:, ::-1]]).T
        order = np.lexsort((heard, hearer))
        degrees = np.bincount(hearer, minlength=self.agents)
        return GraphData(np.concatenate([[0], np.cumsum(degrees)]), heard[order])

    def among(self, there: NDArray[np.bool_]) -> "Graph":
        """The graph among some agents, (N,), with numbers of their own.

        Raises:
            InvalidInput: it is not connected.
        """
        number = np.cumsum(there) - 1
        kept = tuple(
            (int(number[i]), int(number[j])) for i, j in self.edges if there[i] and there[j]
        )
        return Graph(int(np.sum(there)), kept)

    @property
    def whole(self) -> "Graph":
        """The graph with the links that were lost."""
        return self if self.rest_of is None else self.rest_of

    def without(self, lost: Iterable[tuple[int, int]]) -> "Graph":
        """The whole graph without these edges."""
        whole, gone = self.whole, set(lost)
        if not gone:
            return whole
        kept = tuple(edge for edge in whole.edges if edge not in gone)
        return Graph(whole.agents, kept, rest_of=whole)

    @property
    def members(self) -> "tuple[Graph, ...] | None":
        """The graphs that it can be, or of which it always has one's edges: itself.

        None where they are too many to be looked at.
        """
        return (self,)

    @property
    def _hearer(self) -> NDArray[np.int64]:
        """Who hears each of the neighbours of `data`."""
        return _hearer_of(self.data)


def _hearer_of(lists: GraphData) -> NDArray[np.int64]:
    return np.repeat(np.arange(len(lists.pointer) - 1), np.diff(lists.pointer))


def laplacian_of(lists: GraphData) -> NDArray[np.float64]:
    """L = D - A of neighbour lists, shape (N, N), dense."""
    matrix = np.diag(np.diff(lists.pointer).astype(np.float64))
    matrix[_hearer_of(lists), lists.neighbour] = -1.0
    return matrix


def connected(lists: GraphData) -> bool:
    """Whether everyone can be reached over these neighbour lists."""
    return bool(np.all(parts(_hearer_of(lists), lists.neighbour, len(lists.pointer) - 1) == 0))


def parts(first: ArrayLike, second: ArrayLike, count: int) -> NDArray[np.int64]:
    """The connected parts of ``count`` vertices, each named by its least vertex, shape (count,).

    Args:
        first, second: the ends of the edges, numbered from 0.
    """
    ends = np.asarray(first, dtype=np.int64), np.asarray(second, dtype=np.int64)
    part = np.arange(count)
    while True:
        least = np.minimum(*(part[end] for end in ends))
        joined = part.copy()
        for end in ends:
            np.minimum.at(joined, part[end], least)
        joined = joined[joined]
        if np.array_equal(joined, part):
            return part
        part = joined


def line(agents: int) -> Graph:
    """Agent i hears i - 1 and i + 1."""
    return Graph(agents, tuple((i, i + 1) for i in range(agents - 1)))


def ring(agents: int) -> Graph:
    """A line whose ends hear each other."""
    closing = ((0, agents - 1),) if agents > 2 else ()
    return Graph(agents, line(agents).edges + closing)


def star(agents: int) -> Graph:
    """Agent 1 hears all others, who hear it alone."""
    return Graph(agents, tuple((0, i) for i in range(1, agents)))


def complete(agents: int) -> Graph:
    """Everyone hears everyone: up to 1,000 agents."""
    check_count("agents", agents * (agents - 1) // 2, MOST_EDGES, "the edges of a complete graph")
    return Graph(agents, tuple((i, j) for i in range(agents) for j in range(i + 1, agents)))


# The 23 edges that the paper's figure [fig:GraphOSNR] draws, channels numbered from 1. Their
# Laplacian has lambda_2 = 2.38907, not the 2.6158 that the caption states.
_PRINTED = (
    (1, 8), (1, 5), (1, 4), (1, 9), (1, 10), (2, 4), (2, 5), (2, 6), (2, 9), (2, 10), (3, 5),
    (3, 6), (3, 7), (3, 9), (3, 10), (4, 5), (4, 7), (4, 9), (5, 7), (5, 8), (6, 8), (6, 9),
    (8, 10),
)  # fmt: skip
# The only one or two added edges that give the caption's value (2.61583).
_CAPTION = (*_PRINTED, (4, 6), (4, 8))


def printed(agents: int = 10) -> Graph:
    """The ten-channel graph as drawn in the paper (lambda_2 = 2.38907)."""
    return _ten_channels("printed", _PRINTED, agents)


def caption(agents: int = 10) -> Graph:
    """The ten-channel graph completed so that lambda_2 matches the paper's caption (2.61583)."""
    return _ten_channels("caption", _CAPTION, agents)


def _ten_channels(name: str, edges: Sequence[tuple[int, int]], agents: int) -> Graph:
    if agents != 10:
        raise InvalidInput("agents", agents, f"the graph '{name}' has 10 agents")
    return Graph(10, tuple((i - 1, j - 1) for i, j in edges))


NAMED = {
    "line": line,
    "ring": ring,
    "star": star,
    "complete": complete,
    "printed": printed,
    "caption": caption,
}
