"""Random starts strictly inside a game's set."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gne_mj.equilibrium import middle
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.separation import Separation

HALVINGS = 60
TRIES = 1000  # of a seed's starts, where agents must be apart
DEPTHS = (1e-4, 1e-8)  # of an interior profile before it is moved, in lengths of the profile
LEAST_SQUARES = 60  # steps for each


def random_starts(
    game: Game, middle: NDArray[np.float64], seeds: Sequence[int | tuple[int, ...]], spread: float
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


def separated_starts(
    game: Game,
    middle: NDArray[np.float64],
    seeds: Sequence[int],
    spread: float,
    separation: Separation,
) -> NDArray[np.float64]:
    """The same of agents that keep apart: the first one of a seed that is so, at rest.

    Raises:
        InvalidInput: of a seed none was found.
    """
    found = []
    for seed in seeds:
        for number in range(TRIES):
            (y,) = random_starts(game, middle, [(seed, number)], spread)
            points = y.reshape(game.agents, -1)
            if separation.nearest(points, points)[2] > separation.distance:
                break
        else:
            raise InvalidInput(
                "separation.distance",
                separation.distance,
                f"of {TRIES} random starts in none all agents are so far apart",
            )
        found.append(y)
    return np.array(found).reshape(len(seeds), game.actions)


def interior_profile(game: Game, start: NDArray[np.float64]) -> NDArray[np.float64]:
    """A profile strictly inside (and inside the tightened set), from one that need not be.

    The distances to the bounds, to first order, by which a profile is short of being inside by some
    depth are made small by least squares (Levenberg and Marquardt), less deep if that fails; what
    is found is moved to the middle along each action. Sure for convex constraints alone.

    Args:
        game: whose set.
        start: (m,) where to begin; the middle of the game's box and zero are tried after it.

    Raises:
        InvalidInput: none was found.
    """
    begins = [start, np.zeros(game.actions)]
    if game.box is not None:
        begins.insert(1, 0.5 * (game.box[0] + game.box[1]))
    with np.errstate(all="ignore"):  # a profile that is no number is not inside either
        for y in begins:
            for depth in DEPTHS:
                y = _towards(game, y, depth)
                if _inside(game, y):
                    return middle(game, y)
    raise InvalidInput("game", game.name, "no profile strictly inside its constraints was found")


def _inside(game: Game, y: NDArray[np.float64]) -> bool:
    return bool(np.all(game.constraints(y) + game.margins < 0.0))


def _towards(game: Game, y: NDArray[np.float64], depth: float) -> NDArray[np.float64]:
    """The first profile inside on the way to one that is ``depth`` lengths inside, or the last."""
    depth *= float(np.max(np.abs(y))) or 1.0
    damping = 1e-6
    for _ in range(LEAST_SQUARES):
        jacobian = game.constraint_jacobian(y)
        steep = np.linalg.norm(jacobian, axis=1)
        steep[~(steep > 0.0)] = np.inf  # nothing to be learnt from this one here
        short = _short(game, y, steep, depth)
        rows = jacobian[short > 0.0] / steep[short > 0.0, None]
        right = rows.T @ short[short > 0.0]
        square = rows.T @ rows
        while damping < 1e12:
            step = np.linalg.solve(square + damping * np.eye(len(y)), right)
            found = _short(game, y - step, steep, depth)
            if np.sum(found**2) < np.sum(short**2):
                break
            damping *= 10.0
        else:
            return y
        y, damping = y - step, max(0.1 * damping, 1e-12)
        if _inside(game, y):
            return y
    return y


def _short(
    game: Game, y: NDArray[np.float64], steep: NDArray[np.float64], depth: float
) -> NDArray[np.float64]:
    """By what distance a profile is short of being ``depth`` inside each constraint, (p,)."""
    g = game.constraints(y) + game.margins
    return np.maximum(np.where(np.isnan(g), np.inf, g / steep + depth), 0.0)
