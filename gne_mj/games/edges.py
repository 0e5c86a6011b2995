"""Edges of games that are played over a graph: who looks at whom, numbers for each, who leads."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj import graph as graphs
from gne_mj.errors import InvalidInput

# Pairs of agents, numbered from 0
Pairs = Sequence[tuple[int, int]]
# As scenarios give them: a name, or pairs of agents numbered from 1
Edges = Literal["line", "ring", "star", "complete", "printed", "caption"] | list[tuple[int, int]]


def pairs_of(given: Edges, count: int) -> list[tuple[int, int]]:
    """What a scenario gives as edges of ``count`` agents, as pairs numbered from 0."""
    if isinstance(given, str):
        return list(graphs.NAMED[given](count).edges)
    return [(i - 1, j - 1) for i, j in given]


def checked(key: str, pairs: Pairs, agents: int) -> list[tuple[int, int]]:
    """The pairs, each of two different agents and listed once.

    Raises:
        InvalidInput: naming ``key`` and the first pair that is not.
    """
    seen = set()
    for i, j in pairs:
        shown = [i + 1, j + 1]
        if not (0 <= i < agents and 0 <= j < agents):
            raise InvalidInput(key, shown, f"agents are numbered 1 to {agents}")
        if i == j:
            raise InvalidInput(key, shown, "an edge joins two agents")
        if frozenset((i, j)) in seen:
            raise InvalidInput(key, shown, "each pair may be listed once only")
        seen.add(frozenset((i, j)))
    return [(int(i), int(j)) for i, j in pairs]


def numbers(
    key: str,
    given: ArrayLike,
    count: int,
    what: str,
    sign: Literal["any", "not negative", "positive"] = "any",
) -> NDArray[np.float64]:
    """(count,) numbers from one for all or one for each.

    Args:
        key: what they are called in errors.
        given: one number or ``count``.
        count: how many.
        what: each is for, e.g. "edge".
        sign: which of them are allowed; all must be finite.
    """
    values = np.asarray(given, dtype=np.float64)
    if values.shape not in ((), (count,)):
        raise InvalidInput(
            key, given, f"it must be one number or a list of {count}, one for each {what}"
        )
    allowed = np.isfinite(values)
    if sign != "any":
        allowed &= (values > 0) if sign == "positive" else (values >= 0)
    if not np.all(allowed):
        words = {"any": "finite", "positive": "positive and finite"}
        needed = words.get(sign, "finite and not negative")
        raise InvalidInput(key, given, f"every entry must be {needed}")
    return np.broadcast_to(values, (count,))


def neighbours(pairs: Pairs, agents: int) -> list[list[int]]:
    """Of each agent those that it has an edge with."""
    found: list[list[int]] = [[] for _ in range(agents)]
    for i, j in pairs:
        found[i].append(j)
        found[j].append(i)
    return found


def leaders(key: str, pairs: Pairs, weight: NDArray[np.float64]) -> NDArray[np.int64]:
    """Agents of positive weight, of which each connected part must have one.

    Args:
        key: what the weights are called in errors.
        pairs: the edges.
        weight: (N,), of which those that are positive make leaders.
    """
    part = graphs.parts([i for i, _ in pairs], [j for _, j in pairs], len(weight))
    led = np.isin(part, part[weight > 0])
    if not np.all(led):
        apart = [int(i) + 1 for i in np.flatnonzero(part == part[np.argmin(led)])]
        shown = ", ".join(map(str, apart[:5])) + (", ..." if len(apart) > 5 else "")
        raise InvalidInput(
            key,
            weight.tolist(),
            "each connected part of the edges needs a leader, an agent of positive weight, and"
            f" that of agent{'s' * (len(apart) > 1)} {shown} has none",
        )
    return np.flatnonzero(weight > 0)
