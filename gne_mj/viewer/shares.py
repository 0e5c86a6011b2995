"""How much of their bounds agents use, and the least margin: what colours and gauges show.

Loops over samples and entries are compiled: a live page asks at every frame, for one sample.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Game, compressed
from gne_mj.moving_values import bounds_move
from gne_mj.native import compiled, kernel
from gne_mj.quantity import Quantity

Array = NDArray[np.float64]
Values = Mapping[str, Array]


def shares(game: Game, values: Values, room: Array | None = None) -> Array:
    """(T, N) how much each agent uses of its bounds: 0 none, 1 on one; nan where none is known.

    A quantity's bounds count for the agent or for the owners of the constraint that it is of, and
    for all agents if it is one number. Those that move are of each sample. An agent of which no
    quantity says anything has the share of the bounds of its own constraints, 1 + g(y) / room.

    Args:
        game: whose.
        values: of the samples.
        room: (p,) -g(0), what there is to use of each constraint; not a number where it is none.
    """
    found = np.empty((len(values["action"]), game.agents))
    found.fill(np.nan)
    for index, quantity in enumerate(game.quantities):
        entries, ways, pointer, agents = _range(game, quantity)
        if bounds_move(game, index):
            names = quantity.bounds(entries)
            if not all(name in values for name in names):  # as of an older trajectory
                continue
            ways = _ways(quantity, values, (math.prod(entries),))
        rows = values[quantity.name]
        _use(rows if rows.ndim == 2 else rows.reshape(len(found), -1), ways, pointer, agents, found)
    if room is not None:
        _use_of_constraints(values["constraint"], room, *_owned(game), found)
    return found


def margins(constraint: Array) -> NDArray[np.float32]:
    """(T,) the least margin -g of the constraints that there are, of g (T, p)."""
    found = np.empty(len(constraint), dtype=np.float32)
    _least_margin(constraint, found)
    return found


class _Range(NamedTuple):
    """What of a quantity never changes: the shape of its entries, the ways to its bounds where they
    stand still (:func:`_ways`), and for whom each entry counts, as lists end to end."""

    entries: tuple[int, ...]
    ways: Array
    pointer: NDArray[np.int64]
    agents: NDArray[np.int64]


@lru_cache
def _owned(game: Game) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Each agent's own constraints, as lists end to end."""
    return compressed(
        [[k for k, owners in enumerate(game.owned_by) if i in owners] for i in range(game.agents)]
    )


@lru_cache
def _range(game: Game, quantity: Quantity) -> _Range:
    entries = game.entries(quantity)
    count = math.prod(entries)
    whose = {"agent": [[i] for i in range(game.agents)], "constraint": game.owned_by}
    lists = whose.get(quantity.each, [range(game.agents)])
    return _Range(entries, _ways(quantity, quantity.bounds(entries), (count,)), *compressed(lists))


def _ways(quantity: Quantity, bounds: Values, entries: tuple[int, ...]) -> Array:
    """(3, T or 1, n): from where it is how far up, and down, to a quantity's bounds.

    From the middle of two bounds, or from 0 to the one that there is; nan where none says anything.
    """
    nothing = np.full(entries, np.nan)
    high, low = (
        np.reshape(bounds.get(f"{quantity.name}_{key}", nothing), (-1, *entries))
        for key in ("bound", "lower_bound")
    )
    middle = np.where(np.isnan(high + low), 0.0, 0.5 * (high + low))
    up, down = high - middle, low - middle
    return np.array([middle, np.where(up > 0, up, np.nan), np.where(down < 0, down, np.nan)])


@compiled
def _use(values, ways, pointer, agents, found):
    """Raise what agents use, found (T, N), to what values (T, n) use of the ways to bounds."""
    middle, up, down = ways[0], ways[1], ways[2]
    for sample in range(len(found)):
        row = min(sample, ways.shape[1] - 1)
        for entry in range(values.shape[1]):
            away = values[sample, entry] - middle[row, entry]
            used = _greater(away / up[row, entry], away / down[row, entry])
            for k in range(pointer[entry], pointer[entry + 1]):
                agent = agents[k]
                found[sample, agent] = _greater(found[sample, agent], used)


@compiled
def _use_of_constraints(constraint, room, pointer, own, found):
    """Fill agents' columns of found (T, N) that know nothing with what they use of the rooms of
    their own constraints, 1 + g / room of g (T, p)."""
    for agent in range(found.shape[1]):
        if _is_known(found[:, agent]):
            continue
        for sample in range(len(found)):
            for k in range(pointer[agent], pointer[agent + 1]):
                used = 1.0 + constraint[sample, own[k]] / room[own[k]]
                used = 0.0 if used < 0.0 else used
                found[sample, agent] = _greater(found[sample, agent], used)


@compiled
def _least_margin(constraint, found):
    for sample in range(len(found)):
        greatest = np.nan
        for value in constraint[sample]:
            greatest = _greater(greatest, value)
        found[sample] = -greatest


@kernel
def _is_known(column):
    known = False
    for value in column:
        known = known or not np.isnan(value)
    return known


@kernel
def _greater(a, b):
    """The greater of two; of a number and what is none the number."""
    return b if np.isnan(a) or b > a else a
