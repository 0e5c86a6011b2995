"""Where the penalised equilibrium y*(t) is while a game or its penalty moves, and how fast it goes.

    (dF/dy + d2phi) dy*/dt = -(dF/dt + d(grad phi)/dt),   |dy*/dt| <= |right-hand side| / mu,

time derivatives being taken with y held. A profile inside is asked for at each time: where the set
has none, no run can be.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.barrier import LogBarrier
from gne_mj.equilibrium import Equilibrium, middle, penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput, SolverError
from gne_mj.game_model import Game
from gne_mj.motion import motion_of
from gne_mj.starts import interior_profile

Array = NDArray[np.float64]

_STEP, _BESIDE = 1e-5, 1e-9  # s, of time derivatives, which begin beside a jump at the time itself
_DENSE = 500  # actions, beyond which no matrix is made for a rate


@dataclass(frozen=True)
class Point:
    """The penalised equilibrium of one time.

    Attributes:
        equilibrium: what was found; None if nothing was.
        push: |dF/dt + d(grad phi)/dt| there, the greater of both sides of the time; not a number
            where it is not known.
        rate: |dy*/dt|, likewise.
    """

    equilibrium: Equilibrium | None
    push: float
    rate: float


class EquilibriumPath:
    """The penalised equilibria of a game over time, each found from the one before.

    Args:
        game: which may move.
        penalty: rho at a time in s.
        start: (m,) strictly inside at time 0.
    """

    def __init__(self, game: Game, penalty: Callable[[float], float], start: ArrayLike) -> None:
        motion = motion_of(game)
        self._frame = None if motion is None else motion.frame()
        self._game, self._penalty = game, penalty
        self._last: Equilibrium | None = None
        self._start = np.asarray(start, dtype=np.float64)
        self._equilibria: dict[float, Equilibrium | None] = {}
        self._points: dict[float, Point] = {}

    @property
    def size(self) -> int:
        """m, the entries of y*."""
        return self._game.actions

    @property
    def knots(self) -> tuple[float, ...]:
        """Times in s at which the game's numbers, or their rates, jump."""
        motion = motion_of(self._game)
        return () if motion is None else motion.knots

    def game(self, time: float) -> Game:
        """The game at a time in s, until another time is asked for."""
        return self._game if self._frame is None else self._frame.to(time)

    def equilibrium(self, time: float) -> Equilibrium | None:
        """y* at a time in s; None where it was not found.

        Raises:
            InvalidInput: no profile strictly inside was found.
        """
        time = float(time)
        if time not in self._equilibria:
            found = self._solved(time)
            self._last = found if found is not None else self._last
            self._equilibria[time] = found
        return self._equilibria[time]

    def at(self, time: float) -> Point:
        """The same with its rates; raises as :meth:`equilibrium` does."""
        time = float(time)
        if time not in self._points:
            found = self.equilibrium(time)
            self._points[time] = Point(found, *self._rates(time, found))
        return self._points[time]

    def actions(self, times: Iterable[float]) -> Array:
        """y* (times, m) at times in s, not a number where none was found."""
        nothing = np.full(self._game.actions, np.nan)
        found = [self.equilibrium(time) for time in times]
        return np.array([nothing if each is None else each.action for each in found])

    def _solved(self, time: float) -> Equilibrium | None:
        game, rho = self.game(time), self._penalty(time)
        begin: Equilibrium | Array = self._start if self._last is None else self._last
        y = begin.action if isinstance(begin, Equilibrium) else begin
        if not np.all(game.constraints(y) + game.margins < 0.0):
            begin = y = self._inside(game, time, y)
        for start in (begin, None):
            try:
                return penalised_equilibrium(game, rho, middle(game, y) if start is None else start)
            except (SolverError, InfeasibleStart):
                continue
        return None

    def _inside(self, game: Game, time: float, y: Array) -> Array:
        try:
            return interior_profile(game, y)
        except InvalidInput as error:
            raise InvalidInput(
                "game", self._game.name, "its set must have an interior at all times of the run;"
                f" at {time:g} s no profile strictly inside was found",
            ) from error  # fmt: skip

    def _rates(self, time: float, found: Equilibrium | None) -> tuple[float, float]:
        """|dF/dt + d(grad phi)/dt| and |dy*/dt|, the greater ones of both sides of a time."""
        if found is None:
            return np.nan, np.nan
        y = found.action
        sides = [
            (self._pull(time + step, y) - self._pull(time + beside, y)) / (step - beside)
            for step, beside in ((_STEP, _BESIDE), (-_STEP, -_BESIDE))
        ]
        push = max(float(np.linalg.norm(side)) for side in sides)
        if len(y) > _DENSE or not np.isfinite(push):
            return push, np.nan
        game = self.game(time)
        slope = game.pseudo_gradient_jacobian(y) + LogBarrier(game, self._penalty(time)).hessian(y)
        rates = np.linalg.solve(slope, np.array(sides).T)
        return push, float(np.max(np.linalg.norm(rates, axis=0)))

    def _pull(self, time: float, y: Array) -> Array:
        """F + grad phi at a time, which is zero at y* then; not a number outside."""
        game = self.game(time)
        if not np.all(game.constraints(y) + game.margins < 0.0):
            return np.full(len(y), np.nan)
        return game.pseudo_gradient(y) + LogBarrier(game, self._penalty(time)).gradient(y)
