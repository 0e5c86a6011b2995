"""What games that move say at samples: constraints and quantities as they are at each time.

Of a game that stands still it is what the game itself says of all samples at once.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Game
from gne_mj.motion import motion_of
from gne_mj.system.data import SystemData

Array = NDArray[np.float64]


def constraints(system: SystemData, time: Array, y: Array) -> Array:
    """(samples, p) g at times (samples,) in s and outputs (samples, m)."""
    if motion_of(system.game) is None:
        return system.game.constraints(y)
    rows = [system.game_at(t).constraints(each) for t, each in zip(time, y, strict=True)]
    return np.array(rows).reshape(len(y), system.game.constraints_count)


def quantity(system: SystemData, index: int, time: Array, y: Array) -> Array:
    """(samples, *entries) the values of one of the game's quantities."""
    found = system.game.quantities[index]
    entries = system.game.entries(found)
    motion = motion_of(system.game)
    if motion is None or not _moves(system.game, index)[0]:
        return found.at(y, entries)
    rows = [motion.at(t).quantities[index].at(each[None], entries)[0]
            for t, each in zip(time, y, strict=True)]  # fmt: skip
    return np.array(rows).reshape(len(y), *entries)


def bounds(system: SystemData, index: int, time: Array) -> dict[str, Array]:
    """The bounds of one of the quantities, each (samples, *entries), by the variable's name."""
    motion = motion_of(system.game)
    assert motion is not None
    entries = system.game.entries(system.game.quantities[index])
    rows = [motion.at(t).quantities[index].bounds(entries) for t in time]
    names = system.game.quantities[index].bounds(entries)
    return {name: np.array([row[name] for row in rows]).reshape(-1, *entries) for name in names}


def bounds_move(game: Game, index: int) -> bool:
    """Whether bounds of one of the game's quantities change in time."""
    if motion_of(game) is None:
        return game.quantities[index].moves
    return _moves(game, index)[1]


@lru_cache
def _moves(game: Game, index: int) -> tuple[bool, bool]:
    """Whether the values and the bounds of a quantity change with what moves."""
    motion = motion_of(game)
    assert motion is not None
    found, entries = game.quantities[index], game.entries(game.quantities[index])
    y = 1.0 + np.random.default_rng(0).random((2, game.actions))
    own = [found.at(y, entries), *found.bounds(entries).values()]
    others = [each.quantities[index] for each in motion.others]
    there = [[each.at(y, entries), *each.bounds(entries).values()] for each in others]
    same = [[np.array_equal(a, b, equal_nan=True) for a, b in zip(own, each, strict=True)]
            for each in there]  # fmt: skip
    return not all(each[0] for each in same), not all(all(each[1:]) for each in same)
