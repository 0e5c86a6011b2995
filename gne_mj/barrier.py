"""Log barrier of the shared constraints [eq:logbarrier]: phi(y) = -rho sum_l log(-g_l(y)).

Its gradient is sum_l w_l dg_l/dy with the weights w_l = rho / (-g_l(y)), which at the penalised
equilibrium are the multipliers. Outside the interior phi is infinite and has no gradient: the
kernels report that and never clip a constraint's value. A game that is tightened by t >= 0 has a
barrier of g + t < 0 in place of g < 0. The penalty may fall in time (:class:`Schedule`), in one of
the ways that are registered (:class:`Fall`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.ownership import own_curvature, own_slopes
from gne_mj.registry import SCHEDULES
from gne_mj.toml_table import Fills, Table, Unit

# Entries of a schedule's numbers
START, FLOOR, FALL = range(3)


@dataclass(frozen=True)
class Fall:
    """A way for the penalty to fall, registered by its name.

    Args:
        name: in scenario files.
        rho: kernel (start, elapsed) that gives the penalty, elapsed being t/T.
    """

    name: str
    rho: Callable[[float, float], float]


@dataclass(frozen=True)
class Schedule:
    """How the penalty falls from its value at the start to a floor, with time constant T.

    Args:
        kind: "exponential", rho(t) = start exp(-t/T); "reciprocal", start / (1 + t/T); "halving",
            start / 2^k from k T to (k + 1) T; or another registered :class:`Fall`. Never below
            the floor.
        start: rho(0), positive.
        floor: positive, at most ``start``.
        time_constant: T in s, positive.
    """

    kind: str
    start: float
    floor: float
    time_constant: float

    def __post_init__(self) -> None:
        _ = self.fall  # refuses a kind that there is not
        for key in ("floor", "time_constant"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(key, value, "it must be positive and finite")
        if self.floor > self.start:
            raise InvalidInput("floor", self.floor, f"it must not exceed rho(0), {self.start:g}")

    @property
    def fall(self) -> Callable[[float, float], float]:
        """The kernel (start, t/T) that says how it falls."""
        found: Fall = SCHEDULES[self.kind]
        return found.rho

    @property
    def numbers(self) -> NDArray[np.float64]:
        """For native code: [START, FLOOR, FALL]."""
        return np.array([self.start, self.floor, 1.0 / self.time_constant])

    def at(self, time: ArrayLike) -> NDArray[np.float64]:
        """rho at times in s, of any shape."""
        fall, numbers = self.fall, self.numbers
        return np.vectorize(lambda t: scheduled(fall, numbers, t), otypes=[np.float64])(time)


class BarrierTable(Table):
    """phi = -rho sum_l log(-g_l) [eq:logbarrier]"""

    rho: Annotated[float, Unit("the costs'")] = Field(
        0.1, gt=0, description="the penalty; at the start, if it has a schedule"
    )
    schedule: Annotated[Annotated[str, SCHEDULES] | None, Fills("kind")] = Field(
        None, description="how rho falls in time; constant if left out"
    )
    time_constant: Annotated[float | None, Unit("s")] = Field(
        None, gt=0, description="T of the schedule; 1 if left out"
    )
    floor: float | None = Field(
        None,
        gt=0,
        description="what rho falls to; if left out 1e-9 in mode implicit, else the least that the"
        " period allows at the equilibrium",
    )

    def build(self, floor: float) -> Schedule | None:
        """The schedule, falling to ``floor`` unless that is given."""
        if self.schedule is None:
            for key in ("floor", "time_constant"):
                if getattr(self, key) is not None:
                    raise InvalidInput(key, getattr(self, key), "it goes with barrier.schedule")
            return None
        lowest = min(floor, self.rho) if self.floor is None else self.floor
        return Schedule(self.schedule, self.rho, lowest, self.time_constant or 1.0)


@dataclass(frozen=True, eq=False)
class LogBarrier:
    """The barrier of one game.

    Args:
        game: whose constraints it guards.
        rho: the penalty parameter, positive; the penalised equilibrium is an epsilon-vGNE with
            epsilon = p * rho [lemma:epsilon].
    """

    game: Game
    rho: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rho) and self.rho > 0):
            raise InvalidInput("rho", self.rho, "it must be positive and finite")

    def margin(self, y: ArrayLike) -> float:
        """min_l -g_l(y): positive strictly inside, in the constraints' own units."""
        return -self.game.tightest(y)[1]

    def value(self, y: ArrayLike) -> float:
        """phi(y), infinite on and outside the boundary."""
        g = self.game.constraints(y) + self.game.margins
        if not np.all(g < 0):
            return np.inf
        return float(-self.rho * np.sum(np.log(-g)))

    def weights(self, y: ArrayLike) -> NDArray[np.float64]:
        """rho / (-g_l(y)), shape (p,): the multipliers if y is the penalised equilibrium.

        Raises:
            ValueError: y is not strictly inside.
        """
        g = self.game.constraints(y) + self.game.margins
        if not np.all(g < 0):
            worst = int(np.argmax(np.where(np.isnan(g), np.inf, g)))
            value = float(g[worst])
            raise ValueError(
                f"the barrier has no gradient at a profile with"
                f" {self.game.constraint_names[worst]} at g = {value:.6g}"
            )
        return self.rho / -g

    def gradient(self, y: ArrayLike) -> NDArray[np.float64]:
        """dphi/dy, shape (m,): of each agent's own constraints where some are private."""
        return self.weights(y) @ own_slopes(self.game, y)

    def hessian(self, y: ArrayLike) -> NDArray[np.float64]:
        """d2phi/dy2, shape (m, m): sum_l w_l d2g_l + (w_l^2 / rho) dg_l dg_l'.

        The gradient's derivative, which is not symmetric where constraints are private.
        """
        weights = self.weights(y)
        jacobian = self.game.constraint_jacobian(y)
        curvature = own_curvature(self.game, y, weights)
        return curvature + (own_slopes(self.game, y).T * (weights**2 / self.rho)) @ jacobian


@kernel
def scheduled(fall, numbers, time):
    """The penalty at a time in s, by a schedule's kernel and numbers."""
    return max(fall(numbers[START], time * numbers[FALL]), numbers[FLOOR])


@kernel
def exponential(start, elapsed):
    """start exp(-t/T)."""
    return start * np.exp(-elapsed)


@kernel
def reciprocal(start, elapsed):
    """start / (1 + t/T)."""
    return start / (1.0 + elapsed)


@kernel
def halving(start, elapsed):
    """start / 2^k from k T to (k + 1) T."""
    return start * 2.0 ** -np.floor(elapsed)


@kernel
def unchanging(start, elapsed):
    """A penalty that does not change, beside a game that does."""
    return start


for _fall in (exponential, reciprocal, halving):
    SCHEDULES.register(Fall(_fall.__name__, _fall))


@kernel
def weighted_gradient(game, data, i, a, y, weights):
    """Sum over agent i's constraints l of weights[l] * dg_l/dy_a(y)."""
    total = 0.0
    for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
        k = data.own_index[entry]
        total += weights[k] * game.constraint_gradient(data.parameters, k, a, y)
    return total
