"""Random starts strictly inside a game's set."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from gne_mj.errors import InvalidInput
from gne_mj.game import Game

HALVINGS = 60


def random_starts(
    game: Game, middle: NDArray[np.float64], seeds: Sequence[int], spread: float
) -> NDArray[np.float64]:
    """Profiles strictly inside, one a seed, shape (seeds, m).

    Each lies in a random direction from the middle, at a random share, of up to ``spread``, of the
    way to the boundary; shares crowd towards the boundary as uniform points of a ball do. Where
    a direction has no boundary, that of ten times the middle's own size stands for one.

    Args:
        game: whose set; where the barrier is tightened, the tightened one.
        middle: (m,) a profile strictly inside.
        seeds: of each start; the same seed gives the same direction and share in other games of
            as many actions.
        spread: between 0 and 1.
    """
    m = game.actions
    rays, shares = np.empty((len(seeds), m)), np.empty(len(seeds))
    for at, seed in enumerate(seeds):
        rng = np.random.default_rng(seed)
        ray = rng.normal(size=m)
        rays[at] = ray / np.linalg.norm(ray)
        shares[at] = spread * rng.random() ** (1.0 / m)

    def inside(lengths: NDArray[np.float64]) -> NDArray[np.bool_]:
        g = game.constraints(middle + lengths[:, None] * rays) + game.margins
        return np.all(g < 0.0, axis=1)

    farthest = 10.0 * max(1.0, float(np.max(np.abs(middle))))
    low, high = np.zeros(len(seeds)), np.full(len(seeds), farthest)
    open_ended = inside(high)
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        good = inside(half)
        low, high = np.where(good, half, low), np.where(good, high, half)
    low = np.where(open_ended, farthest, low)
    found = middle + (shares * low)[:, None] * rays
    return np.where(inside(shares * low)[:, None], found, middle)


def interior_profile(game: Game, start: NDArray[np.float64]) -> NDArray[np.float64]:
    """A profile strictly inside (and inside the tightened set), from one that need not be.

    Raises:
        InvalidInput: none was found.
    """

    def slack(point: NDArray[np.float64]) -> NDArray[np.float64]:
        return point[-1] - (game.constraints(point[:-1]) + game.margins)

    worst = float(np.max(game.constraints(start) + game.margins))
    found = minimize(
        lambda point: point[-1],
        np.append(start, worst + 1.0),
        jac=lambda point: np.append(np.zeros(game.actions), 1.0),
        method="SLSQP",
        # deep is deep enough: sets may have no deepest point
        bounds=[(None, None)] * game.actions + [(-1.0, None)],
        constraints={"type": "ineq", "fun": slack},
    )
    y: NDArray[np.float64] = found.x[:-1]
    if not np.all(game.constraints(y) + game.margins < 0.0):
        raise InvalidInput(
            "game", game.name, "no profile strictly inside its constraints was found"
        )
    return y
