"""Episodes of fleets beside each other: what Gymnasium's and PettingZoo's environments play."""

from typing import NamedTuple

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from gne_mj.cores import cores
from gne_mj.environment.observation import View, finite_costs
from gne_mj.environment.picture import Picture, drawn
from gne_mj.environment.setting import Setting, action_of, check_begun
from gne_mj.errors import InvalidInput

Array = NDArray[np.float64]
BOUND = 1e3  # of what is observed, if nothing else is said


class Taken(NamedTuple):
    """What a control period has brought, a row for each fleet.

    Attributes:
        reward: (E, N) minus each agent's cost at the period's end, less its part of an exit's.
        left: (E,) whether the set was left.
        over: (E,) whether the time is up, and the set was not left.
    """

    reward: Array
    left: NDArray[np.bool_]
    over: NDArray[np.bool_]


class Episodes:
    """Episodes of a setting.

    Args:
        setting: what an episode is.
        count: how many at once.
        threads: how many of the processor's cores step them; all if left out.
        bound: of the magnitude of what is observed, but of outputs of which the game declares
            bounds; what is beyond is cut.

    Attributes:
        setting: as given.
        fleets: of the episodes.
        view: who sees what.
        bounds: (lower, upper) of the columns of :meth:`observed`.
    """

    def __init__(
        self, setting: Setting, count: int = 1, threads: int | None = None, bound: float = BOUND
    ) -> None:
        if not bound > 0.0:
            raise InvalidInput("bound", bound, "it must be positive")
        self.setting = setting
        self.fleets = setting.fleets(count, cores() if threads is None else threads)
        self.view = View(setting.system.game, self.fleets.plants[0], setting.information)
        self.bounds = self.view.bounds(bound)
        self._done = np.zeros(count, dtype=np.int64)
        self._not_begun = set(range(count))

    def begin(self, row: int, rng: np.random.Generator) -> None:
        """Let an episode start anew; what is random of its start comes from ``rng``."""
        fleets, moves = self.fleets, self.fleets.rows.moves
        fleets.place(row, self.setting.first_state(rng))
        moves[:] = 0
        moves[row] = 1
        fleets.look()
        check_begun(fleets, row)
        self._done[row] = 0
        self._not_begun.discard(row)

    def step(self, actions: ArrayLike, going: NDArray[np.bool_] | None = None) -> Taken:
        """Hold these actions (E, m) for a control period.

        Args:
            actions: within their limits; what is beyond is cut.
            going: (E,) which episodes go on; the others are left as they are.

        Raises:
            ResetNeeded: one has not begun.
            InvalidInput: another shape, or an entry that is not a number.
            UserCodeError, NotFinite: costs that are none, inside.
        """
        self._check_begun()
        setting, fleets, rows = self.setting, self.fleets, self.fleets.rows
        rows.pull[:] = action_of(actions, setting.limit, rows.pull.shape)
        goes = np.ones(fleets.count, dtype=bool) if going is None else going
        rows.moves[:] = goes
        fleets.advance(setting.steps)
        self._done[goes] += 1
        left = np.array([exit is not None for exit in fleets.exits])
        for row in np.flatnonzero(left & goes).tolist():
            self.view.settle(fleets, row)
        reward = -finite_costs(setting.system.game, rows.y)
        reward[left] -= setting.exit_cost / reward.shape[1]
        return Taken(reward, left, ~left & (self._done >= setting.periods))

    def observed(self) -> Array:
        """What is observed now, (E, columns), each entry cut to its bounds.

        Raises:
            ResetNeeded: one has not begun.
            NotFinite: an entry that is not a number.
        """
        self._check_begun()
        return np.clip(self.view.check(self.view.table(self.fleets)), *self.bounds)

    def drawn(self, mode: str | None, row: int) -> Picture | str | None:
        """A picture or a line of text of one of them, see :func:`gne_mj.environment.picture.drawn`.

        Raises:
            ResetNeeded: one has not begun.
        """
        self._check_begun()
        return drawn(mode, self.setting.system, self.fleets, row)

    def _check_begun(self) -> None:
        if self._not_begun:
            raise ResetNeeded("call reset() first: an episode has not begun")
