"""Full information: every agent measures all actions [eq:nonlinFIfeedback].

u_i = -dJ_i/dy_i(y) - dphi/dy_i(y). A static law: it has no memory.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType, ModuleType
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers.law import Law
from gne_mj.controllers.measured import memory_outputs as memory_outputs
from gne_mj.controllers.measured import own_profile as own_profile
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import rate as rate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.table import LawTable
from gne_mj.controllers.theorem import LawTheorem
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS

LANES = True  # numbers or lanes


@dataclass(frozen=True, eq=False)
class FullInformation(Law):
    """Gradient feedback of the penalised costs, all actions measured."""

    information: ClassVar[str] = "full"
    proven: ClassVar[LawTheorem] = LawTheorem("full information, lemma:FI and thm:FI")
    guarded: ClassVar[bool] = True

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]

    def among(self, there: NDArray[np.bool_]) -> Law:
        """See the base class."""
        return self


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from the true profile y (m,) and the barrier's weights (p,) there."""
    data = problem.data
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            barrier = weighted_gradient(game, data, i, a, y, weights)
            u[a] = -barrier_free(game, problem, i, a, y, memory) - barrier
    return -1


@kernel
def action_of_all(game, problem, y, weights, memory, work, u):
    """The same of a game that knows F as a whole, and forms once what all costs share."""
    data = problem.data
    at = data.offsets
    game.pseudo_gradient(data.parameters, y, u)
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            u[a] = -u[a] - weighted_gradient(game, data, i, a, y, weights)
    return -1


@kernel
def prepare(problem, first, last, y, memory):
    """Nothing to prepare."""


@kernel
def barrier_free(game, problem, i, a, y, memory):
    """What entry a of agent i's action is driven by besides the barrier, at y (m,)."""
    return game.cost_gradient(problem.data.parameters, i, a, y)


@kernel
def add_barrier_free_slope(game, problem, i, a, y, memory, out):
    """Add dpull/dy to out (m,), which is touched for agents in the cost only."""
    game.add_cost_hessian(problem.data.parameters, i, a, y, 1.0, out)


@LAWS.register
class FullController(LawTable):
    """All actions are measured [eq:nonlinFIfeedback]"""

    information: Literal["full"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"barrier.rho": (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)}
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return FullInformation()
