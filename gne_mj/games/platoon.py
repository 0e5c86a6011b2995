"""A platoon: positions along a line, each spacing between neighbours bounded from both sides.

Positions y_i in m are taken relative to a point that moves at a constant velocity, which is the
agents' business: the game does not know it. With the spacing s_i = y_{i-1} - y_i of agent i > 1
to the one ahead,

J_i = w_i (s_i - d_i)^2 + v_i (y_i - r_i)^2    (of agent 1, which leads, the second term only)

and the shared constraints lower_i <= s_i <= upper_i, and lower_1 <= y_1 <= upper_1 of the leader,
without which the set would have no end: the N lower ones come first, then the N upper ones.

F is affine and, since a follower looks ahead and is not looked at, not symmetric. It is strongly
monotone if and only if the symmetric part of dF/dy is positive definite: the tridiagonal matrix of
2 (w_i + v_i) on the diagonal and -w_i beside it. With w_1 = w_{N+1} = 0 that matrix's form is

sum_i (2 v_i + w_i - w_{i+1}) x_i^2 + sum_{i>1} w_i (x_i - x_{i-1})^2,

so that w_{i+1} <= w_i + 2 v_i for all i suffices (if w_i + v_i > 0): with equal spacing weights w,
that the leader's v_1 is w / 2 or more. Weights for which F is not strongly monotone are refused.

Parameters q = [lower (N), upper (N), d (N), w (N), r (N), v (N)]; d_1 is not used and w_1 is 0.
"""

import sys
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.bounds import MOST_AGENTS, check_count
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games.edges import numbers
from gne_mj.games.table import GameTable
from gne_mj.native import kernel
from gne_mj.quantity import Quantity
from gne_mj.registry import GAMES
from gne_mj.toml_table import PerAgent, Unit

Array = NDArray[np.float64]

DEFAULT_SPACING, DEFAULT_RANGE = (0.8, 3.0), (-5.0, 5.0)


def platoon_game(
    agents: int,
    least_spacing: ArrayLike = DEFAULT_SPACING[0],
    greatest_spacing: ArrayLike = DEFAULT_SPACING[1],
    *,
    desired_spacing: ArrayLike | None = None,
    spacing_weight: ArrayLike = 1.0,
    desired_place: ArrayLike | None = None,
    place_weight: ArrayLike | None = None,
    leader_range: tuple[float, float] = DEFAULT_RANGE,
) -> Game:
    """The game of N agents one behind the other, the first one near a point.

    What is of spacings is one number for all, or N - 1, from the one between agents 1 and 2 on;
    what is of places is one number for all agents, or one each.

    Args:
        agents: N.
        least_spacing: in m, of y_{i-1} - y_i.
        greatest_spacing: in m, above the least one.
        desired_spacing: d_i in m, what a follower wishes; half way between the bounds if left out.
        spacing_weight: w_i >= 0, how much it weighs that.
        desired_place: r_i in m; if left out 0 for the leader, and for each other one the place at
            which all spacings are as desired.
        place_weight: v_i >= 0, how much agent i weighs it; 1 for the leader alone if left out.
        leader_range: (least, greatest) y_1 in m.

    Raises:
        InvalidInput: a number that is not finite, bounds without a room between them, a weight
            below 0, or weights with which F is not strongly monotone.
    """
    check_count("agents", agents, MOST_AGENTS)
    pairs = agents - 1
    lower, upper = _bounds(pairs, least_spacing, greatest_spacing, leader_range)
    given = 0.5 * (lower + upper)[1:] if desired_spacing is None else desired_spacing
    desired = numbers("desired_spacing", given, pairs, "pair of neighbours")
    behind = -np.cumsum([0.0, *desired])
    given = behind if desired_place is None else desired_place
    place = numbers("desired_place", given, agents, "agent")
    own = numbers("spacing_weight", spacing_weight, pairs, "pair of neighbours", "not negative")
    given = np.append(1.0, np.zeros(pairs)) if place_weight is None else place_weight
    weight = numbers("place_weight", given, agents, "agent", "not negative")
    _check_monotone(own, weight, spacing_weight)
    ahead = [[] if i == 0 else [i - 1] for i in range(agents)]
    columns = (lower, upper, [0.0, *desired], [0.0, *own], place, weight)
    return Game(
        name="platoon", kernels=sys.modules[__name__],
        parameters=np.concatenate(columns, dtype=np.float64),
        sizes=(1,) * agents,
        in_cost=[[i, *near] for i, near in enumerate(ahead)],
        in_constraint=[[*near, i] for i, near in enumerate(ahead)] * 2,
        constraint_names=_constraint_names(agents),
        action_name="position", action_unit="m",
        affine=True,
        box=(lower[0] - np.cumsum([0.0, *upper[1:]]), upper[0] - np.cumsum([0.0, *lower[1:]])),
        agent_name="robot",
        quantities=_quantities(lower, upper),
        constraint_class="affine",
        smooth=True, tested=True,
    )  # fmt: skip


def _constraint_names(agents: int) -> tuple[str, ...]:
    each = ("place of agent 1", *(f"spacing of agents {i} and {i + 1}" for i in range(1, agents)))
    return tuple(f"{word} {name}" for word in ("least", "greatest") for name in each)


def _bounds(
    pairs: int, least: ArrayLike, greatest: ArrayLike, leader: tuple[float, float]
) -> tuple[Array, Array]:
    """(N,) lower and upper bounds: of the leader's place, then of the spacings."""
    if pairs < 0:
        raise InvalidInput("agents", pairs + 1, "there must be one at least")
    ends = np.asarray(leader, dtype=np.float64)
    if ends.shape != (2,) or not np.all(np.isfinite(ends)) or not ends[0] < ends[1]:
        expected = "it must be [least, greatest], two finite numbers, the first one below"
        raise InvalidInput("leader_range", leader, expected)
    lower = numbers("least_spacing", least, pairs, "pair of neighbours")
    upper = numbers("greatest_spacing", greatest, pairs, "pair of neighbours")
    if not np.all(lower < upper):
        raise InvalidInput("greatest_spacing", greatest, "every one must be above the least one")
    return np.concatenate([ends[:1], lower]), np.concatenate([ends[1:], upper])


def _check_monotone(own: Array, weight: Array, given: ArrayLike) -> None:
    """Refuse weights of spacings (N - 1,) and places (N,) without a strongly monotone F."""
    from scipy.linalg import eigvalsh_tridiagonal  # slow to load, and for this game only

    size = max(np.max(weight), np.max(own, initial=0.0), 1e-300)
    diagonal = 2.0 * (np.concatenate([[0.0], own]) / size + weight / size)
    least = diagonal[0]
    if len(own):
        (least,) = eigvalsh_tridiagonal(diagonal, -own / size, select="i", select_range=(0, 0))
    if not least > 1e-12:
        raise InvalidInput(
            "spacing_weight",
            given,
            f"F must be strongly monotone, and mu is {least * size:.3g}; it is where each spacing's"
            " weight is at most that of the spacing before it (0 before the first) plus twice the"
            " place_weight of the agent ahead",
        )


def _quantities(lower: Array, upper: Array) -> tuple[Quantity, ...]:
    """The followers' spacings, if there are any, and the leader's place."""
    nothing = np.full(len(lower), np.nan)

    def followers(values: Array) -> Array:
        return np.concatenate([nothing[:1], values[1:]])

    def leader(values: Array) -> Array:
        return np.concatenate([values[:1], nothing[1:]])

    place = Quantity(
        name="leader_place", long_name="place of the leader", unit="m",
        values=lambda y: np.where(np.arange(y.shape[1]) == 0, y, np.nan), each="agent",
        symbol="y_1", bound=leader(upper), lower_bound=leader(lower),
    )  # fmt: skip
    if len(lower) == 1:
        return (place,)
    spacing = Quantity(
        name="spacing", long_name="spacing", unit="m",
        values=lambda y: np.concatenate(
            [np.full((len(y), 1), np.nan), y[:, :-1] - y[:, 1:]], axis=1
        ),
        each="agent", symbol="y_{i-1} - y_i", bound=followers(upper),
        lower_bound=followers(lower),
        between=[(-1, -1), *((i, i + 1) for i in range(len(lower) - 1))],
    )  # fmt: skip
    return spacing, place


@kernel
def column(q, c, i):
    """Entry i of column c of the parameters."""
    return q[c * (len(q) // 6) + i]


@kernel
def bounded(q, i, y):
    """What agent i has bounds of: the spacing ahead of it, of the leader its place."""
    return y[0] if i == 0 else y[i - 1] - y[i]


@kernel
def cost(q, i, y):
    """J_i = w_i (s_i - d_i)^2 + v_i (y_i - r_i)^2."""
    total = column(q, 5, i) * (y[i] - column(q, 4, i)) ** 2
    if i > 0:
        total += column(q, 3, i) * (y[i - 1] - y[i] - column(q, 2, i)) ** 2
    return total


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_i = -2 w_i (s_i - d_i) + 2 v_i (y_i - r_i)."""
    total = column(q, 5, i) * (y[i] - column(q, 4, i))
    if i > 0:
        total -= column(q, 3, i) * (y[i - 1] - y[i] - column(q, 2, i))
    return 2.0 * total


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """2 (w_i + v_i) for the agent itself, -2 w_i for the one ahead."""
    own = column(q, 3, i)
    out[i] += 2.0 * scale * (own + column(q, 5, i))
    if i > 0:
        out[i - 1] -= 2.0 * scale * own


@kernel
def constraint(q, l, y):
    """lower_l less what it bounds for l < N, then that less upper."""
    n = len(q) // 6
    if l < n:
        return column(q, 0, l) - bounded(q, l, y)
    return bounded(q, l - n, y) - column(q, 1, l - n)


@kernel
def constraint_gradient(q, l, a, y):
    """1 for the leader's greatest place and for the agent ahead in a greatest spacing, -1 for the
    agent behind; the other way round for least ones."""
    n = len(q) // 6
    i = l if l < n else l - n
    rises = 1.0 if i == 0 or a < i else -1.0
    return -rises if l < n else rises


@kernel
def constraint_hessian(q, l, a, b, y):
    """All constraints are affine."""
    return 0.0


@GAMES.register
class PlatoonTable(GameTable):
    """Positions along a line; for agents whose output is a position."""

    type: Literal["platoon"]
    least_spacing: Annotated[PerAgent, Unit("m")] = Field(
        DEFAULT_SPACING[0], description="one or one for each pair of neighbours"
    )
    greatest_spacing: Annotated[PerAgent, Unit("m", "> least_spacing")] = Field(
        DEFAULT_SPACING[1], description="likewise"
    )
    desired_spacing: Annotated[PerAgent | None, Unit("m")] = Field(
        None, description="d_i, likewise; half way between the bounds if left out"
    )
    spacing_weight: Annotated[PerAgent, Unit("", ">= 0")] = Field(1.0, description="w_i, likewise")
    desired_place: Annotated[PerAgent | None, Unit("m")] = Field(
        None,
        description="r_i; if left out 0 for the leader, the others behind it as spacings are"
        " desired",
    )
    place_weight: Annotated[PerAgent | None, Unit("", ">= 0")] = Field(
        None, description="v_i; 1 for the leader and 0 for others if left out"
    )
    leader_range: Annotated[tuple[float, float], Unit("m", "rising")] = Field(
        DEFAULT_RANGE, description="[least, greatest] place of the leader"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return platoon_game(count, **self.model_dump(exclude={"type"}))

    def default_start(self, count: int) -> Array:
        """Three quarters of the way to the greatest spacings, the leader a quarter of its range."""
        low, high = self.leader_range
        least, greatest = np.asarray(self.least_spacing), np.asarray(self.greatest_spacing)
        spacing = np.broadcast_to(0.25 * least + 0.75 * greatest, (count - 1,))
        return 0.75 * low + 0.25 * high - np.cumsum([0.0, *spacing])
