"""Random starts strictly inside the constraint set."""

import numpy as np
from numpy.typing import NDArray

from gne_mj.game import Game


def random_start(
    game: Game, middle: NDArray[np.float64], rng: np.random.Generator, spread: float
) -> NDArray[np.float64]:
    """Outputs (m,) on a random ray from ``middle``, at a random part of its way to the boundary.

    Args:
        game: whose constraints, tightened ones as they are, must hold strictly.
        middle: (m,) strictly inside, such as the penalised equilibrium.
        rng: the only source of what is random.
        spread: greatest part of the way, between 0 and 1.
    """
    ray = rng.normal(size=game.actions)
    share = rng.uniform(0.0, spread)

    def inside(length: float) -> bool:
        return bool(np.all(game.constraints(middle + length * ray) + game.margins < 0))

    low, high = 0.0, 1.0
    while inside(high) and high < 1e12:
        high *= 2.0
    for _ in range(60):
        length = 0.5 * (low + high)
        low, high = (length, high) if inside(length) else (low, length)
    return middle + share * low * ray
