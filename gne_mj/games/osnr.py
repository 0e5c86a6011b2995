"""Optical signal-to-noise ratio: power control of channels that share a link [eq:osnrGNE].

J_i = a_i y_i - b_i ln(1 + c_i y_i / (n0_i + sum_{j != i} Gamma_ij y_j)) with powers y in mW and
the shared constraints y_i >= 0 (i = 1..N) and sum y <= P_0, in this order.

Parameters q = [N, P_0, a (N), b (N), c (N), n0 (N), Gamma (N x N, by rows, its diagonal zero)].
"""

import json
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.resources import files
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.bounds import MOST_COUPLED, check_count
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Box, Game
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.quantity import Quantity
from gne_mj.registry import GAMES
from gne_mj.toml_table import Unit

LANES = True  # numbers or lanes


def osnr_game(
    price: Sequence[float],
    utility_weight: Sequence[float],
    gain: Sequence[float],
    noise_power: Sequence[float],
    system_matrix: ArrayLike,
    total_power_limit: float,
) -> Game:
    """The OSNR game of N channels, at most 2,000, since each one's cost depends on all.

    Args:
        price: a_i > 0, per mW.
        utility_weight: b_i > 0.
        gain: c_i > 0.
        noise_power: n0_i > 0 in mW.
        system_matrix: Gamma >= 0, shape (N, N); its diagonal is not used.
        total_power_limit: P_0 > 0 in mW.
    """
    agents = np.size(price)
    check_count("price", agents, MOST_COUPLED, "its channels")
    columns = {
        "price": price, "utility_weight": utility_weight, "gain": gain,
        "noise_power": noise_power,
    }  # fmt: skip
    _check_columns(columns, agents)
    matrix = _crosstalk(system_matrix, agents)
    if not (np.isfinite(total_power_limit) and total_power_limit > 0):
        raise InvalidInput("total_power_limit", total_power_limit, "it must be positive")
    everyone = list(range(agents))
    total = Quantity(
        name="total_power", long_name="total power", unit="mW",
        values=lambda y: np.sum(y, axis=1), bound=total_power_limit,
    )  # fmt: skip
    weight = np.prod([columns["utility_weight"], columns["gain"]], axis=0)
    noise, response = np.asarray(columns["noise_power"]), matrix + np.diag(columns["gain"])
    return Game(
        name="OSNR",
        kernels=sys.modules[__name__],
        parameters=np.concatenate(
            [[agents, total_power_limit], *columns.values(), matrix.ravel()], dtype=np.float64
        ),
        sizes=(1,) * agents,
        in_cost=[everyone] * agents,
        in_constraint=[*([i] for i in everyone), everyone],
        constraint_names=(*(f"power of channel {i + 1} >= 0" for i in everyone), "total power"),
        action_name="power",
        action_unit="mW",
        box=(np.zeros(agents), np.full(agents, total_power_limit)),
        agent_name="channel",
        quantities=(total,),
        jacobian_bounds=partial(_jacobian_bounds, weight, noise, response),
        row_scaled=True,
        # All of the power in the channel that is heard most: no feasible profile gives more.
        feasible_jacobian_bounds=_slope_bounds(
            weight, response, noise, noise + total_power_limit * np.max(response, axis=1)
        ),
        constraint_class="affine",
        smooth=True,
        tested=True,
    )


def _check_columns(columns: Mapping[str, Sequence[float]], agents: int) -> None:
    for key, values in columns.items():
        array = np.asarray(values, dtype=np.float64)
        if array.shape != (agents,):
            raise InvalidInput(key, values, f"it must list {agents} numbers")
        if not np.all(np.isfinite(array)) or not np.all(array > 0):
            raise InvalidInput(key, values, "every entry must be positive and finite")


def _crosstalk(system_matrix: ArrayLike, agents: int) -> NDArray[np.float64]:
    """The system matrix, checked, with a zero diagonal."""
    matrix = np.array(system_matrix, dtype=np.float64)
    if matrix.shape != (agents, agents):
        raise InvalidInput("system_matrix", matrix.shape, f"its shape must be ({agents}, {agents})")
    np.fill_diagonal(matrix, 0.0)
    if not np.all(np.isfinite(matrix)) or np.any(matrix < 0):
        raise InvalidInput("system_matrix", "...", "no entry may be negative or not finite")
    return matrix


def _jacobian_bounds(
    weight: NDArray[np.float64], noise: NDArray[np.float64], response: NDArray[np.float64], box: Box
) -> Box:
    """Bounds of dF/dy over a box.

    response >= 0, so that what is received is least and greatest at two corners of the box.
    Without bounds (infinite) where it need not be positive.
    """
    least, most = noise + response @ box[0], noise + response @ box[1]
    if np.any(least <= 0):
        return np.full_like(response, -np.inf), np.full_like(response, np.inf)
    return _slope_bounds(weight, response, least, most)


def _slope_bounds(
    weight: NDArray[np.float64],
    response: NDArray[np.float64],
    least: NDArray[np.float64],
    most: NDArray[np.float64],
) -> Box:
    """Bounds of dF/dy = diag(weight / received^2) response, each channel receiving least to most.

    What it receives is noise + response y, noise included.
    """
    with np.errstate(over="ignore"):  # a square beyond all floats leaves a slope of 0
        return (weight / most**2)[:, None] * response, (weight / least**2)[:, None] * response


def ten_channels() -> dict[str, Any]:
    """Parameters of a ten-channel link, a stand-in for the paper's (which cites them elsewhere)."""
    text = files("gne_mj.games").joinpath("osnr_10_channels.json").read_text(encoding="utf-8")
    parameters: dict[str, Any] = json.loads(text)
    del parameters["note"]
    return parameters


@kernel
def disturbance(q, i, y):
    """n0_i + sum_{j != i} Gamma_ij y_j: noise and crosstalk on channel i."""
    n = int(q[0])
    row = 2 + 4 * n + i * n
    total = q[2 + 3 * n + i]
    for j in range(n):
        total += q[row + j] * y[j]  # Gamma_ii is zero
    return total


@kernel
def cost(q, i, y):
    """J_i = a_i y_i - b_i ln(1 + c_i y_i / disturbance_i)."""
    n = int(q[0])
    ratio = q[2 + 2 * n + i] * y[i] / disturbance(q, i, y)
    return q[2 + i] * y[i] - q[2 + n + i] * np.log1p(ratio)


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_i = a_i - b_i c_i / (disturbance_i + c_i y_i)."""
    n = int(q[0])
    b, c = q[2 + n + i], q[2 + 2 * n + i]
    return q[2 + i] - b * c / (disturbance(q, i, y) + c * y[i])


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """b_i c_i / (disturbance_i + c_i y_i)^2 times c_i (for y_i) or Gamma_ij (for y_j)."""
    n = int(q[0])
    b, c = q[2 + n + i], q[2 + 2 * n + i]
    received = disturbance(q, i, y) + c * y[i]
    factor = scale * b * c / (received * received)
    row = 2 + 4 * n + i * n
    for j in range(n):
        out[j] += factor * q[row + j]
    out[i] += factor * c


@kernel
def constraint(q, l, y):
    """-y_l for l < N, the total power's excess over P_0 for l = N."""
    n = int(q[0])
    if l < n:
        return -y[l]
    total = -q[1]
    for j in range(n):
        total += y[j]
    return total


@kernel
def constraint_gradient(q, l, a, y):
    """-1 for a channel's own sign constraint, 1 for the total power."""
    return -1.0 if l < int(q[0]) else 1.0


@kernel
def constraint_hessian(q, l, a, b, y):
    """All constraints are affine."""
    return 0.0


@GAMES.register
class OsnrTable(GameTable):
    """Power control [eq:osnrGNE]; what is left out is taken from the ten-channel link."""

    keeps: ClassVar[tuple[str, ...]] = ("total power",)
    type: Literal["osnr"]
    total_power_limit: Annotated[float | None, Unit("mW")] = Field(None, gt=0, description="P_0")
    price: Annotated[list[float] | None, Unit("1/mW", "> 0")] = Field(None, description="a_i")
    utility_weight: Annotated[list[float] | None, Unit("", "> 0")] = Field(None, description="b_i")
    gain: Annotated[list[float] | None, Unit("", "> 0")] = Field(None, description="c_i")
    noise_power: Annotated[list[float] | None, Unit("mW", "> 0")] = Field(None, description="n0_i")
    system_matrix: Annotated[list[list[float]] | None, Unit("", ">= 0")] = Field(
        None, description="Gamma_ij, whose diagonal is not used"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        parameters = ten_channels()
        if self.system_matrix is not None and len({len(row) for row in self.system_matrix}) > 1:
            raise InvalidInput("system_matrix", "...", "its rows must be of one length")
        given = self.model_dump(exclude={"type"}, exclude_none=True)
        parameters.update(given)
        for key in ("price", "utility_weight", "gain", "noise_power", "system_matrix"):
            if len(parameters[key]) != count:
                raise InvalidInput(
                    key,
                    f"{len(parameters[key])} channels",
                    f"agents.count is {count}; every list must have that many entries",
                )
        return osnr_game(**parameters)

    def away(self, count: int) -> NDArray[np.float64]:
        """A channel that is away sends nothing."""
        return np.zeros(count)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """80% of the power limit, shared equally."""
        limit = self.total_power_limit or ten_channels()["total_power_limit"]
        return np.full(count, 0.8 * limit / count)
