"""Shared constraints as affine ones, A y <= b, of which each agent knows its own columns.

A constraint of a game is affine, or (a.y + c)^2 <= delta^2, a bound on both sides of something
affine: two affine ones. Others have no such rows.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.native import kernel

Row = tuple[NDArray[np.float64], float, float]  # a, b and half
_TOLERANCE = 1e-9  # of what is found affine, relative to the terms' sizes


class AffineBounds(NamedTuple):
    """Affine constraints that mean the same as a game's.

    Attributes:
        A: (rows, m).
        b: (rows,).
        share: (N, rows), the part of b that is each agent's: equal ones of those that appear.
        source: (rows,), the game's constraint that each row is of.
        half: (rows,), delta of a bound on two sides; 0 of others.
    """

    A: NDArray[np.float64]
    b: NDArray[np.float64]
    share: NDArray[np.float64]
    source: NDArray[np.float64]
    half: NDArray[np.float64]

    @property
    def numbers(self) -> NDArray[np.float64]:
        """For native code: [rows, b, source, half, share, A]."""
        parts = self.b, self.source, self.half, self.share.ravel(), self.A.ravel()
        return np.concatenate([[len(self.b)], *parts])


def affine_bounds(game: Game) -> AffineBounds:
    """The rows of a game.

    Raises:
        InvalidInput: names ``game``: it moves, a constraint has no rows, or is not everybody's.
    """
    if game.motion is not None:
        raise InvalidInput("game", game.name, "agents know their parts of A y <= b, and it moves")
    if game.private:
        name = game.constraint_names[game.private[0]]
        raise InvalidInput("game", game.name, f"{name} is not the constraint of all in it")
    zero = np.zeros(game.actions)
    at_zero, slopes = game.constraints(zero), game.constraint_jacobian(zero)
    start, actions = game.actions_in_constraints
    rows = []
    for k in range(game.constraints_count):
        members = actions[start[k] : start[k + 1]]
        curvature = game.constraint_hessian(k, zero)
        found = _rows(at_zero[k], slopes[k], members, curvature)
        if not _same(game, k, found):
            expected = (
                f"{game.constraint_names[k]} is neither affine nor a bound on both sides of"
                " something affine, and this law's agents know such bounds only"
            )
            raise InvalidInput("game", game.name, expected)
        rows += [(k, *each) for each in found]
    source, A, b, half = zip(*rows, strict=True)
    share = np.zeros((game.agents, len(rows)))
    for r, k in enumerate(source):
        share[list(game.in_constraint[k]), r] = 1.0 / len(game.in_constraint[k])
    return AffineBounds(
        np.array(A), np.array(b), share, np.array(source, dtype=np.float64), np.array(half)
    )


def _rows(
    value: float,
    slope: NDArray[np.float64],
    members: NDArray[np.int64],
    curvature: NDArray[np.float64],
) -> list[Row]:
    """The rows, from g, dg/dy and d2g of a constraint at y = 0."""
    most = int(np.argmax(np.diag(curvature)))
    steep = curvature[most, most]
    if not steep > _TOLERANCE * np.max(np.abs(slope), initial=0.0):
        return [(slope, -value, 0.0)]
    a = np.zeros(len(slope))
    a[members] = curvature[most] / np.sqrt(2.0 * steep)
    offset = slope[members[most]] / (2.0 * a[members[most]])
    half = np.sqrt(max(offset**2 - value, 0.0))
    return [(a, half - offset, half), (-a, half + offset, half)]


def _same(game: Game, k: int, rows: list[Row]) -> bool:
    """Whether the rows are the constraint at some profiles: g, or its two factors' product."""
    draw = np.random.default_rng(k)
    for size in (1.0, 10.0):
        y = size * draw.normal(size=game.actions)
        beyond = [a @ y - b for a, b, _ in rows]
        terms = [np.abs(a) @ np.abs(y) + abs(b) for a, b, _ in rows]
        expected = beyond[0] if len(rows) == 1 else -beyond[0] * beyond[1]
        if not abs(game.constraints(y)[k] - expected) <= _TOLERANCE * np.prod(terms):
            return False
    return True


# ------------------------------------------------------------------------ for native code

_ROWS = 0


@kernel
def rows_of(numbers, at):
    """How many rows there are, of numbers that begin at an entry."""
    return int(numbers[at + _ROWS])


@kernel
def entry_of(numbers, at, agents, m, r, a):
    """A_ra."""
    rows = rows_of(numbers, at)
    return numbers[at + 1 + (3 + agents) * rows + r * m + a]


@kernel
def own_part(data, numbers, at, i, r, y):
    """What agent i knows of (A y - b)_r: its columns, and its share of b, nearer by the margin."""
    rows, agents, m = rows_of(numbers, at), len(data.offsets) - 1, len(y)
    bound, source = numbers[at + 1 + r], int(numbers[at + 1 + rows + r])
    half, margin = numbers[at + 1 + 2 * rows + r], data.tightening[source]
    if half > 0.0:  # (a.y)^2 - half^2 + margin <= 0
        margin = half - np.sqrt(max(half * half - margin, 0.0))
    total = -numbers[at + 1 + (3 + i) * rows + r] * (bound - margin)
    for a in range(data.offsets[i], data.offsets[i + 1]):
        total += entry_of(numbers, at, agents, m, r, a) * y[a]
    return total
