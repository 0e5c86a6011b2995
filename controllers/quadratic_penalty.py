"""Quadratic penalty: gradient play of costs with a price on what constraints are violated by.

u = -k (F(y) + s sum_l max(0, g_l(y)) dg_l), the gradient of s/2 sum_l max(0, g_l)^2 beside F
(Courant's penalty; Fiacco and McCormick, Nonlinear Programming: Sequential Unconstrained
Minimization Techniques, 1968). Constraints that bind are violated by l*_l / s to first order where
it rests. A static law.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType, ModuleType
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.controllers.law import Law, check_positive
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import rate as rate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.settings import COUNT, GAIN
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS

STRENGTH = COUNT


@dataclass(frozen=True, eq=False)
class QuadraticPenalty(Law):
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
    acts_outside: ClassVar[bool] = True
    gain: float = 1.0
    strength: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, "gain", "strength")

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class; rho is not read."""
        numbers = super().settings(rho)
        numbers[GAIN] = self.gain
        return np.append(numbers, self.strength)


@kernel
def excess(game, data, k, y):
    """max(0, g_k + t_k) at y (m,)."""
    return max(0.0, game.constraint(data.parameters, k, y) + data.tightening[k])


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from y (m,); the barrier's weights are not read."""
    data, numbers = problem.data, problem.settings
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            total = game.cost_gradient(data.parameters, i, a, y)
            for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
                k = data.own_index[entry]
                price = numbers[STRENGTH] * excess(game, data, k, y)
                if price > 0.0:
                    total += price * game.constraint_gradient(data.parameters, k, a, y)
            u[a] = -numbers[GAIN] * total
    return -1


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
