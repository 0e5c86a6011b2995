"""Cournot competition: firms of one product choose how much of it to make.

J_i = c_i y_i - y_i (D - sum_j y_j), with quantities y, unit costs c_i and a price that falls from
the demand's intercept D by 1 for each unit on the market; lower_i <= y_i <= upper_i, as the
constraints lower_i - y_i <= 0 (i = 1..N), then y_i - upper_i <= 0 (i = 1..N). The numbers of
Salehisadaghiani, Shi and Pavel are N = 10, c_i = N (1 + (i - 1) / 2), D = 60 N and
7 <= y_i <= 100.

F = y + (sum y) 1 + c - D 1 is affine, with dF/dy = I + 1 1^T: mu = 1, theta_1 = N + 1.

Parameters q = [N, D, c (N), lower (N), upper (N)].
"""

import sys
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.bounds import MOST_COUPLED, check_count
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.registry import GAMES
from gne_mj.toml_table import PerAgent, Unit

LANES = True  # numbers or lanes


def cournot_game(
    agents: int,
    unit_cost: Sequence[float] | None = None,
    demand_intercept: float | None = None,
    lower_bound: ArrayLike = 7.0,
    upper_bound: ArrayLike = 100.0,
) -> Game:
    """The Cournot game of N firms; what is left out has the published numbers.

    Args:
        agents: N, at most 2,000, since each one's cost depends on all.
        unit_cost: c_i, cost of one unit; N (1 + (i - 1) / 2) if left out.
        demand_intercept: D, the price of an empty market; 60 N if left out.
        lower_bound: least quantities, one for all or one each.
        upper_bound: greatest quantities, above the least ones.
    """
    check_count("agents", agents, MOST_COUPLED)
    cost_of = agents * (1.0 + 0.5 * np.arange(agents)) if unit_cost is None else unit_cost
    columns = {"unit_cost": cost_of, "lower_bound": lower_bound, "upper_bound": upper_bound}
    arrays = {key: np.asarray(values, dtype=np.float64) for key, values in columns.items()}
    for key, array in arrays.items():
        if array.shape != (agents,) and (array.ndim or key == "unit_cost"):
            raise InvalidInput(key, columns[key], f"it must list {agents} numbers")
        if not np.all(np.isfinite(array)):
            raise InvalidInput(key, columns[key], "every entry must be finite")
    costs, lower, upper = (np.broadcast_to(array, (agents,)) for array in arrays.values())
    if not np.all(lower < upper):
        raise InvalidInput("upper_bound", upper_bound, "every entry must be above the lower bound")
    intercept = 60.0 * agents if demand_intercept is None else demand_intercept
    if not np.isfinite(intercept):
        raise InvalidInput("demand_intercept", intercept, "it must be finite")
    everyone = list(range(agents))
    return Game(
        name="Cournot",
        kernels=sys.modules[__name__],
        parameters=np.concatenate([[agents, intercept], costs, lower, upper], dtype=np.float64),
        sizes=(1,) * agents,
        in_cost=[everyone] * agents,
        in_constraint=[[i] for i in everyone] * 2,
        constraint_names=(
            *(f"least quantity of firm {i + 1}" for i in everyone),
            *(f"greatest quantity of firm {i + 1}" for i in everyone),
        ),
        action_name="quantity",
        affine=True,
        box=(lower.copy(), upper.copy()),
        agent_name="firm",
        constraint_class="affine",
        smooth=True,
        tested=True,
    )


@kernel
def price(q, y):
    """D - sum y, of one unit."""
    total = q[1]
    for j in range(int(q[0])):
        total -= y[j]
    return total


@kernel
def cost(q, i, y):
    """J_i = (c_i - price) y_i."""
    return (q[2 + i] - price(q, y)) * y[i]


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_i = c_i - price + y_i."""
    return q[2 + i] - price(q, y) + y[i]


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """2 for the firm itself, 1 for every other."""
    for j in range(int(q[0])):
        out[j] += scale
    out[i] += scale


@kernel
def constraint(q, l, y):
    """lower_l - y_l for l < N, then y - upper."""
    n = int(q[0])
    if l < n:
        return q[2 + n + l] - y[l]
    return y[l - n] - q[2 + n + l]


@kernel
def constraint_gradient(q, l, a, y):
    """-1 for a least quantity, 1 for a greatest one."""
    return -1.0 if l < int(q[0]) else 1.0


@kernel
def constraint_hessian(q, l, a, b, y):
    """All constraints are affine."""
    return 0.0


@GAMES.register
class CournotTable(GameTable):
    """Firms of one product; what is left out has the published numbers for ``count`` firms."""

    type: Literal["cournot"]
    unit_cost: list[float] | None = Field(None, description="c_i; N (1 + (i - 1) / 2) if left out")
    demand_intercept: float | None = Field(
        None, description="D, price of an empty market; 60 N if left out"
    )
    lower_bound: Annotated[PerAgent, Unit("", "< upper_bound")] = Field(
        7.0, description="least quantity of each firm"
    )
    upper_bound: Annotated[PerAgent, Unit("", "> lower_bound")] = Field(
        100.0, description="greatest quantity of each firm"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return cournot_game(count, **self.model_dump(exclude={"type"}))

    def away(self, count: int) -> NDArray[np.float64]:
        """A firm that is away makes nothing."""
        return np.zeros(count)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """Every firm half way between its bounds."""
        middle = 0.5 * (np.asarray(self.lower_bound) + np.asarray(self.upper_bound))
        return np.broadcast_to(middle, (count,)).copy()
