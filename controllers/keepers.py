"""Who keeps estimates of whom: no more agents than costs and the graph ask for.

Agent i needs an estimate of agent j where j is in its cost (and, where its barrier is at estimates,
in its constraints). Estimates of j's action spread among those that keep one, so that these, with j
itself, must form a connected part of the graph: some keep what they only pass on. The fewest are a
Steiner tree's vertices. That is solved exactly on trees and rings, and wherever what is found is no
larger than a bound from below; elsewhere it is the shortest-path heuristic of Takahashi and
Matsuyama, less what can be left out, and said not to be known as the smallest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.game_model import GameData
from gne_mj.graph import Graph

Neighbours = list[list[int]]


@dataclass(frozen=True, eq=False)
class Keepers:
    """Who keeps what.

    Attributes:
        of: for each agent j those that keep its action, (k_j,), j itself first, then by number.
        smallest: (N,) whether that is known to be the smallest set that will do.
    """

    of: tuple[NDArray[np.int64], ...]
    smallest: NDArray[np.bool_]

    @property
    def everyone(self) -> bool:
        """Whether every agent keeps an estimate of every other one."""
        return all(len(each) == len(self.of) for each in self.of)


def readers(data: GameData, *, constraints: bool) -> list[set[int]]:
    """For each agent j those whose costs, and own constraints if so, contain its action; and j."""
    found = [{j} for j in range(len(data.offsets) - 1)]
    for i, (first, last) in enumerate(pairwise(data.cost_pointer)):
        for j in data.cost_index[first:last].tolist():
            found[j].add(i)
    for i, (first, last) in enumerate(pairwise(data.own_pointer)):
        for k in data.own_index[first:last].tolist() if constraints else ():
            for j in data.member_index[
                data.member_pointer[k] : data.member_pointer[k + 1]
            ].tolist():
                found[j].add(i)
    return found


def fewest(graph: Graph, wanted: Sequence[set[int]]) -> Keepers:
    """The smallest sets of keepers, as far as they can be found.

    Args:
        graph: over which estimates spread.
        wanted: for each agent those that must keep its action, itself among them.
    """
    near = _neighbours(graph)
    shape = _has_one_way(graph, near)
    sets, smallest = [], []
    for j, must in enumerate(wanted):
        kept, proven = _fewest(near, j, must)
        sets.append(_ordered(j, kept))
        smallest.append(proven or shape)
    return Keepers(tuple(sets), np.array(smallest))


def given(graph: Graph, wanted: Sequence[set[int]], kept: Sequence[Sequence[int]]) -> Keepers:
    """A user's own sets, looked at.

    Args:
        graph: over which estimates spread.
        wanted: for each agent those that must keep its action, itself among them.
        kept: for each agent of whom it keeps estimates, numbered from 0; itself or not.

    Raises:
        InvalidInput: names ``estimates``; an agent keeps too little for its own cost, or what it
            keeps cannot reach it.
    """
    key, agents = "estimates", graph.agents
    if len(kept) != agents:
        raise InvalidInput(key, f"{len(kept)} lists", f"there must be {agents}, one an agent")
    sets: list[set[int]] = [{j} for j in range(agents)]
    for i, row in enumerate(kept):
        for j in row:
            if not 0 <= j < agents:
                raise InvalidInput(key, j + 1, f"agents are numbered 1 to {agents}")
            sets[j].add(i)
    near = _neighbours(graph)
    for j, (have, must) in enumerate(zip(sets, wanted, strict=True)):
        row_of = min(must - have, default=None)
        if row_of is not None:
            raise InvalidInput(
                key, [r + 1 for r in kept[row_of]],
                f"agent {row_of + 1} must keep an estimate of agent {j + 1}, whose action its cost"
                " or constraints have",
            )  # fmt: skip
        reached = set(_reached(near, j, have))
        if len(reached) < len(have):
            i = min(have - reached)
            relays = sorted(v + 1 for v in _path(near, reached, {i})[1:-1] if v not in have)
            raise InvalidInput(
                key, [r + 1 for r in kept[i]],
                f"agent {i + 1} cannot hear of agent {j + 1}: those that keep estimates of agent"
                f" {j + 1} must form, with it, a connected part of the graph; let"
                f" agent{'s' * (len(relays) > 1)} {', '.join(map(str, relays))} keep one too",
            )  # fmt: skip
    return Keepers(
        tuple(_ordered(j, have) for j, have in enumerate(sets)), np.zeros(agents, dtype=np.bool_)
    )


def _ordered(j: int, kept: set[int]) -> NDArray[np.int64]:
    return np.array([j, *sorted(kept - {j})], dtype=np.int64)


def _neighbours(graph: Graph) -> Neighbours:
    heard = graph.data.neighbour.tolist()
    return [heard[first:last] for first, last in pairwise(graph.data.pointer.tolist())]


def _has_one_way(graph: Graph, near: Neighbours) -> bool:
    """Whether the heuristic is exact: on a tree paths are unique, on a ring it grows from both ends
    over the shorter gap and so leaves out the longest."""
    tree = len(graph.edges) == graph.agents - 1
    return tree or all(len(each) == 2 for each in near)


def _fewest(near: Neighbours, j: int, must: set[int]) -> tuple[set[int], bool]:
    """A small connected set around agents that holds j, and whether none is smaller."""
    if len(must) == len(near) or len(_reached(near, j, must)) == len(must):
        return set(must), True
    kept, missing = {j}, must - {j}
    while missing:
        kept |= set(_path(near, kept, missing))
        missing -= kept
    for relay in sorted(kept - must, key=lambda v: (len(near[v]), v)):
        without = kept - {relay}
        if len(_reached(near, j, without)) == len(without):
            kept = without
    farthest = max(_distances(near, j, must).items(), key=lambda each: (each[1], each[0]))[0]
    apart = max(_distances(near, farthest, must).values())
    return kept, len(kept) == max(len(must) + 1, apart + 1)


def _reached(near: Neighbours, start: int, inside: set[int]) -> dict[int, int]:
    """Whom one reaches from an agent without leaving a set that holds it, and from whom."""
    return dict(_walk(near, {start}, inside))


def _walk(
    near: Neighbours, starts: set[int], inside: set[int] | None = None
) -> Iterator[tuple[int, int]]:
    """Agents by their distance from some, each with the one before it; starts with themselves."""
    seen = {start: start for start in sorted(starts)}
    layer = list(seen)
    while layer:
        yield from ((each, seen[each]) for each in layer)
        following = []
        for each in layer:
            for other in near[each]:
                if other not in seen and (inside is None or other in inside):
                    seen[other] = each
                    following.append(other)
        layer = following


def _path(near: Neighbours, starts: set[int], ends: set[int]) -> list[int]:
    """A shortest path from one of some agents to one of others, both included."""
    before: dict[int, int] = {}
    for each, previous in _walk(near, starts):
        before[each] = previous
        if each in ends:
            way = [each]
            while before[way[-1]] != way[-1]:
                way.append(before[way[-1]])
            return way[::-1]
    raise AssertionError("the graph is connected")


def _distances(near: Neighbours, start: int, ends: set[int]) -> dict[int, int]:
    """How many edges away each of some agents is."""
    far: dict[int, int] = {}
    left = len(ends)
    for each, previous in _walk(near, {start}):
        far[each] = 0 if each == start else far[previous] + 1
        left -= each in ends
        if not left:
            break
    return {end: far[end] for end in ends}
