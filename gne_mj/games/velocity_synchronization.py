"""Velocity synchronisation with bounded gaps along a line of robots [eq:sensorNetGNE].

J_i = (y_i - y_{i-1})^2 + w_i (y_i - v_i^d)^2 and g_i = (y_i - y_{i-1})^2 - delta_i^2, where
y_0 := v_0; velocities in m/s. The constraints are shared: g_{i+1} contains y_i too, so agent i
feels its follower. The paper's game has no desired velocities v_i^d (w = 0), and the equilibrium
v_0 whatever the bounds are; with w_i > 0 some of them can bind.

Parameters q = [v_0, delta_1, ..., delta_N, v_1^d, ..., v_N^d, w_1, ..., w_N].
"""

import sys
from functools import partial
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.quantity import Quantity
from gne_mj.registry import GAMES
from gne_mj.toml_table import PerAgent, Unit, per_agent

LANES = True  # numbers or lanes


def velocity_game(
    agents: int,
    reference_velocity: float,
    gap_bound: ArrayLike,
    desired_velocity: ArrayLike | None = None,
    desired_weight: ArrayLike = 0.0,
) -> Game:
    """The game of N robots that follow each other, the first one a reference velocity.

    Args:
        agents: N.
        reference_velocity: v_0 in m/s.
        gap_bound: delta_i > 0 in m/s, one for all or one each.
        desired_velocity: v_i^d in m/s, one for all or one each; v_0 if left out.
        desired_weight: w_i >= 0, how much agent i weighs it, one for all or one each.

    Raises:
        InvalidInput: a number that is not finite, a bound that is not positive, a weight below 0.
    """
    bounds = np.broadcast_to(np.asarray(gap_bound, dtype=np.float64), (agents,))
    if not np.all(bounds > 0) or not np.all(np.isfinite(bounds)):
        raise InvalidInput("gap_bound", gap_bound, "every bound must be positive and finite")
    if desired_velocity is None:
        desired_velocity = reference_velocity
    desired, weights = _wishes(agents, desired_velocity, desired_weight)
    reach = np.cumsum(bounds)
    gaps = Quantity(
        name="gap",
        long_name="velocity gap",
        unit="m/s",
        values=partial(_gaps, reference_velocity),
        each="agent",
        symbol="y_i - y_{i-1}",
        bound=bounds,
        lower_bound=-bounds,
    )
    predecessors = [[] if i == 0 else [i - 1] for i in range(agents)]
    return Game(
        name="velocity synchronisation",
        kernels=sys.modules[__name__],
        parameters=np.concatenate([[reference_velocity], bounds, desired, weights]),
        sizes=(1,) * agents,
        in_cost=[[i, *before] for i, before in enumerate(predecessors)],
        in_constraint=[[*before, i] for i, before in enumerate(predecessors)],
        constraint_names=tuple(f"gap of agent {i + 1}" for i in range(agents)),
        action_name="velocity",
        action_unit="m/s",
        affine=True,
        box=(reference_velocity - reach, reference_velocity + reach),
        gap_bounds=bounds,
        affine_constraints=2 * agents,  # -delta_i <= gap_i <= delta_i
        agent_name="robot",
        quantities=(gaps,),
        constraint_class="quadratic",
        smooth=True,
        tested=True,
    )


def _gaps(reference_velocity: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
    """To the agent in front, of profiles (samples, N)."""
    gaps = y.copy()
    gaps[:, 0] -= reference_velocity
    gaps[:, 1:] -= y[:, :-1]
    return gaps


def _wishes(
    agents: int, desired_velocity: ArrayLike, desired_weight: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Desired velocities and their weights, one for each agent."""
    desired = np.broadcast_to(np.asarray(desired_velocity, dtype=np.float64), (agents,))
    if not np.all(np.isfinite(desired)):
        raise InvalidInput("desired_velocity", desired_velocity, "every velocity must be finite")
    weights = np.broadcast_to(np.asarray(desired_weight, dtype=np.float64), (agents,))
    if not np.all(weights >= 0) or not np.all(np.isfinite(weights)):
        raise InvalidInput(
            "desired_weight", desired_weight, "every weight must be finite and not negative"
        )
    return desired, weights


@kernel
def gap(q, i, y):
    """y_i - y_{i-1}, of the first agent y_1 - v_0."""
    return y[i] - (q[0] if i == 0 else y[i - 1])


@kernel
def desired_velocity(q, i):
    """v_i^d."""
    return q[1 + (len(q) - 1) // 3 + i]


@kernel
def desired_weight(q, i):
    """w_i."""
    return q[1 + (len(q) - 1) // 3 * 2 + i]


@kernel
def cost(q, i, y):
    """J_i = gap_i^2 + w_i (y_i - v_i^d)^2."""
    return gap(q, i, y) ** 2 + desired_weight(q, i) * (y[i] - desired_velocity(q, i)) ** 2


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_i = 2 gap_i + 2 w_i (y_i - v_i^d)."""
    return 2.0 * gap(q, i, y) + 2.0 * desired_weight(q, i) * (y[i] - desired_velocity(q, i))


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """2 + 2 w_i for the agent itself, -2 for its predecessor."""
    out[i] += 2.0 * scale + 2.0 * scale * desired_weight(q, i)
    if i > 0:
        out[i - 1] -= 2.0 * scale


@kernel
def constraint(q, l, y):
    """g_l = gap_l^2 - delta_l^2, as a product so that little is lost close to the bound."""
    difference = gap(q, l, y)
    return (difference - q[1 + l]) * (difference + q[1 + l])


@kernel
def constraint_gradient(q, l, a, y):
    """2 gap_l for the agent itself, -2 gap_l for its predecessor."""
    return (2.0 if a == l else -2.0) * gap(q, l, y)


@kernel
def constraint_hessian(q, l, a, b, y):
    """2 on the diagonal of the two agents' block, -2 off it."""
    return 2.0 if a == b else -2.0


# The paper gives no initial velocities, and from rest the first gap would lie on its bound.
DEFAULT_VELOCITIES = (1.0, 0.0, -1.0, 0.5, 2.0)


@GAMES.register
class VelocityTable(GameTable):
    """Velocities along a line, each following the one before [eq:sensorNetGNE]"""

    type: Literal["velocity-synchronization"]
    reference_velocity: Annotated[float, Unit("m/s")] = Field(3.0, description="v_0")
    gap_bound: Annotated[PerAgent, Unit("m/s", "> 0")] = Field(3.0, description="delta_i")
    desired_velocity: Annotated[PerAgent | None, Unit("m/s")] = Field(
        None, description="v_i^d; the reference velocity if left out"
    )
    desired_weight: Annotated[PerAgent, Unit("", ">= 0")] = Field(0.0, description="w_i")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        desired = self.desired_velocity
        return velocity_game(
            count,
            self.reference_velocity,
            per_agent("gap_bound", self.gap_bound, count, positive=True),
            None if desired is None else per_agent("desired_velocity", desired, count),
            per_agent("desired_weight", self.desired_weight, count),
        )

    def away(self, count: int) -> NDArray[np.float64]:
        """The reference velocity, which whoever follows an agent that is away follows then."""
        return np.full(count, self.reference_velocity)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """The named start for five agents; else everyone half a bound below the reference."""
        if count == len(DEFAULT_VELOCITIES):
            return np.array(DEFAULT_VELOCITIES)
        first = self.gap_bound if isinstance(self.gap_bound, float) else self.gap_bound[0]
        return np.full(count, self.reference_velocity - 0.5 * first)
