"""What agents could gain alone, found by a grid and not by the program's own best responses."""

import numpy as np

from gne_mj.system import System


def gains_alone(system: System, y: np.ndarray) -> dict[int, float]:
    """What each agent of one action can gain alone within the set itself: a grid, refined."""
    game, gains = system.game, {}
    for i in np.flatnonzero(np.array(game.sizes) == 1):
        a = int(game.data.offsets[i])
        now = float(game.costs(y)[i])

        def costs(points: np.ndarray, a: int = a, i: int = i) -> np.ndarray:
            rows = np.tile(y, (len(points), 1))
            rows[:, a] = points
            inside = np.all(game.constraints(rows) <= 0, axis=1)
            with np.errstate(all="ignore"):
                return np.where(inside, game.costs(rows)[:, i], np.inf)

        reach = 10.0 if game.box is None else float(np.max(game.box[1] - game.box[0]))
        points = np.linspace(y[a] - reach, y[a] + reach, 2001)
        for _ in range(6):
            best = float(points[np.argmin(costs(points))])
            width = points[1] - points[0]
            points = np.linspace(best - width, best + width, 201)
        gains[int(i)] = max(0.0, now - float(np.min(costs(points))))
    return gains
