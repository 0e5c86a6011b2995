"""How agents in the plane or in space keep apart: a least distance between any two positions.

That is not convex, and no constraint of a game. It is kept by half-planes (in space half-spaces)
that turn (:mod:`gne_mj.loops.separation`, docs/positions.md). Points are arrays (N, 2) or (N, 3).
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.loops.separation import Rule, half_plane, push
from gne_mj.toml_table import Table, Unit

REACH, TURN = 2.5, 0.5  # where they are left out: in distances, and in rad
MOST_TURN = 1.5
HOLDS = 0.01  # of the greatest push, what a pair that holds another has at least


@dataclass(frozen=True)
class Separation:
    """At least a distance between the positions of any two agents.

    Args:
        distance: r in m, positive.
        reach: in m, more than the distance; only pairs that are nearer than this are looked at and
            push each other.
        turn: how far half-planes are turned at most, in rad from 0 to 1.5, all the same way about
            the vertical, so that agents which meet head on pass.

    Raises:
        InvalidInput: a number that is not so.
    """

    distance: float
    reach: float
    turn: float = TURN

    def __post_init__(self) -> None:
        if not 0.0 < self.distance < np.inf:
            raise InvalidInput("distance", self.distance, "it must be positive and finite")
        if not self.distance < self.reach < np.inf:
            expected = f"it must be more than the distance, {self.distance:g} m, and finite"
            raise InvalidInput("reach", self.reach, expected)
        if not 0.0 <= self.turn <= MOST_TURN:
            raise InvalidInput("turn", self.turn, f"it must be from 0 to {MOST_TURN:g} rad")

    @property
    def numbers(self) -> NDArray[np.float64]:
        """For native code: those of :class:`gne_mj.loops.separation.Rule`."""
        return np.array([self.distance, self.reach, self.turn])

    def nearest(
        self, position: NDArray[np.float64], output: NDArray[np.float64]
    ) -> tuple[int, int, float]:
        """The two agents, from 0, that are nearest on their ways, and how near in m.

        Args:
            position: q (N, axes) in m.
            output: y (N, axes) in m.
        """
        i, j, size = _distances(position, output)
        at = int(np.argmin(size))
        return int(i[at]), int(j[at]), float(size[at])

    def pushes(
        self, position: NDArray[np.float64], output: NDArray[np.float64], rho: float
    ) -> dict[tuple[int, int], NDArray[np.float64]]:
        """What pairs of agents, from 0, that are near push the first one with, each (axes,).

        The second one feels the opposite.

        Args:
            position: q (N, axes) in m.
            output: y (N, axes) in m.
            rho: the penalty.
        """
        i, j, size = _distances(position, output)
        axes, found = position.shape[1], {}
        rule = Rule(self.distance, self.reach, self.turn, (0.0,) * axes)
        q, y = _in_space(position), _in_space(output)
        for k in np.flatnonzero((size < self.reach) & (size > self.distance)):
            first, second = int(i[k]), int(j[k])
            ahead = y[first] - y[second]
            n = np.array(half_plane(rule, tuple(q[first] - q[second]), tuple(ahead))[0])
            most = self.reach - self.distance
            found[first, second] = push(rho, n @ ahead - self.distance, most) * n[:axes]
        return found

    def holding(
        self, position: NDArray[np.float64], output: NDArray[np.float64], rho: float
    ) -> list[tuple[int, int]]:
        """The pairs of agents, from 0, that push each other, the hardest first.

        Those that push less than 1% of the hardest are left out. Arguments are those of
        :meth:`pushes`.
        """
        pushes = self.pushes(position, output, rho)
        sizes = {pair: float(np.linalg.norm(push)) for pair, push in pushes.items()}
        least = HOLDS * max(sizes.values(), default=0.0)
        return sorted((pair for pair in sizes if sizes[pair] > least), key=lambda p: -sizes[p])


def nearest_distances(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, N) in m how far each agent is from the one nearest to it, of positions (T, N, axes) in m.

    Infinite of one agent alone; not a number where a position is none.
    """
    from scipy.spatial import cKDTree  # late: few runs need it

    found = np.full(points.shape[:2], np.nan)
    for row in np.flatnonzero(np.all(np.isfinite(points), axis=(1, 2))):
        found[row] = cKDTree(points[row]).query(points[row], k=2)[0][:, 1]
    return found


def _distances(
    position: NDArray[np.float64], output: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """All pairs of agents, and how near each is on its way from positions to outputs, in m."""
    i, j = np.triu_indices(len(position), 1)
    start = position[i] - position[j]
    way = (output[i] - output[j]) - start
    length = np.maximum(np.sum(way**2, axis=1), np.finfo(float).tiny)
    share = np.clip(-np.sum(start * way, axis=1) / length, 0.0, 1.0)
    return i, j, np.linalg.norm(start + share[:, None] * way, axis=1)


def _in_space(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) of points (N, axes), as native code has them."""
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


class SeparationTable(Table):
    """Agents in the plane or in space keep at least a distance from each other."""

    distance: Annotated[float, Unit("m")] = Field(
        gt=0, description="r, between the positions of any two agents"
    )
    reach: Annotated[float | None, Unit("m", "> distance")] = Field(
        None,
        gt=0,
        description="pairs that are farther apart on their ways are not looked at; 2.5 distances if"
        " left out",
    )
    turn: Annotated[float, Unit("rad")] = Field(
        TURN,
        ge=0,
        le=MOST_TURN,
        description="how far half-planes (half-spaces) turn, so that agents pass",
    )

    def build(self) -> Separation:
        """The separation."""
        reach = REACH * self.distance if self.reach is None else self.reach
        return Separation(self.distance, reach, self.turn)
