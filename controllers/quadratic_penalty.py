"""Quadratic penalty: gradient play of costs with a price on what constraints are violated by.

u = -k (F(y) + s sum_l max(0, g_l(y)) dg_l), the gradient of s/2 sum_l max(0, g_l)^2 beside F
(Courant's penalty; Fiacco and McCormick, Nonlinear Programming: Sequential Unconstrained
Minimization Techniques, 1968). Constraints that bind are violated by l*_l / s to first order where
it rests. A static law.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Literal

from pydantic import Field

from gne_mj.controllers.law import Law
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import rate as rate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.rival import Rival
from gne_mj.controllers.settings import COUNT, GAIN
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS

STRENGTH = COUNT


@dataclass(frozen=True, eq=False)
class QuadraticPenalty(Rival):
    """Gradient play with a quadratic penalty.

    Args:
        gain: k, positive.
        strength: s, positive.
    """

    information: ClassVar[str] = "quadratic-penalty"
    promise: ClassVar[str] = (
        "it rests where binding constraints are violated, by O(1/strength); of what comes before"
        " nothing is proven"
    )
    own: ClassVar[tuple[str, ...]] = ("strength",)
    gain: float = 1.0
    strength: float = 10.0


@kernel
def excess(game, data, k, y):
    """max(0, g_k + t_k) at y (m,)."""
    return max(0.0, game.constraint(data.parameters, k, y) + data.tightening[k])


@kernel
def priced(price, game, problem, y, u):
    """Fill u (m,) with -k (F + sum_l p_l dg_l); p_l = price(game, problem, l, y)."""
    data = problem.data
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            total = game.cost_gradient(data.parameters, i, a, y)
            for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
                k = data.own_index[entry]
                paid = price(game, problem, k, y)
                if paid > 0.0:
                    total += paid * game.constraint_gradient(data.parameters, k, a, y)
            u[a] = -problem.settings[GAIN] * total
    return -1


@kernel
def price(game, problem, k, y):
    """s max(0, g_k)."""
    return problem.settings[STRENGTH] * excess(game, problem.data, k, y)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from y (m,); the barrier's weights are not read."""
    return priced(price, game, problem, y, u)


@LAWS.register
class QuadraticPenaltyController(LawTable):
    """Gradient play with a quadratic penalty on violations, a rival"""

    information: Literal["quadratic-penalty"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0, 8.0), "strength": (1.0, 10.0, 100.0, 1000.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of the input")
    strength: float = Field(10.0, gt=0, description="s of the penalty")

    def build(self, game: Game) -> Law:
        """The law."""
        return QuadraticPenalty(self.gain, self.strength)
