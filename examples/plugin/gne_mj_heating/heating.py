"""Game ``heating``: each house wants a power d_i (kW), and the district has only so much.

J_i = (y_i - d_i)^2 / 2; shared constraints y_i >= 0 and sum y <= capacity.
q = [capacity, d_1, d_2, ...]
"""

import sys
from typing import Literal

import numpy as np
from pydantic import Field

from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.registry import GAMES
from gne_mj.toml_table import PerAgent, per_agent


@kernel
def cost(q, i, y):
    """J_i(y)."""
    return 0.5 * (y[i] - q[1 + i]) ** 2


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_i."""
    return y[i] - q[1 + i]


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """out[b] += scale * d2J_i/dy_i dy_b."""
    out[i] += scale


@kernel
def constraint(q, k, y):
    """-y_k for the houses, then all their heat above the capacity."""
    if k < len(y):
        return -y[k]
    total = 0.0
    for j in range(len(y)):
        total += y[j]
    return total - q[0]


@kernel
def constraint_gradient(q, k, a, y):
    """dg_k/dy_a."""
    return -1.0 if k < len(y) else 1.0


@kernel
def constraint_hessian(q, k, a, b, y):
    """All constraints are affine."""
    return 0.0


@GAMES.register
class HeatingTable(GameTable):
    """Houses behind one district heating."""

    type: Literal["heating"]
    capacity: float = Field(10.0, gt=0, description="of the district, in kW")
    wanted: PerAgent = Field(4.0, description="d_i in kW")

    def build(self, count):
        """The game for ``count`` houses."""
        everyone = list(range(count))
        wanted = per_agent("wanted", self.wanted, count, positive=True)
        return Game(
            name="heating",
            kernels=sys.modules[__name__],
            parameters=np.array([self.capacity, *wanted]),
            sizes=(1,) * count,
            in_cost=[[i] for i in everyone],
            in_constraint=[*([i] for i in everyone), everyone],
            constraint_names=(*(f"heat of house {i + 1}" for i in everyone), "district"),
            action_name="heat",
            action_unit="kW",
            affine=True,
        )

    def default_start(self, count):
        """Half of the capacity, shared equally."""
        return np.full(count, 0.5 * self.capacity / count)
