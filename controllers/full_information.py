"""Full information: every agent measures all actions [eq:nonlinFIfeedback].

u_i = -dJ_i/dy_i(y) - dphi/dy_i(y). A static law: it has no memory.
"""

import sys
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers.law import Law
from gne_mj.native import kernel


@dataclass(frozen=True, eq=False)
class FullInformation(Law):
    """Gradient feedback of the penalised costs, all actions measured."""

    information: ClassVar[str] = "full"

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from the true profile y (m,) and the barrier's weights (p,) there."""
    data = problem.data
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            gradient = game.cost_gradient(data.parameters, i, a, y)
            u[a] = -gradient - weighted_gradient(game, data, i, a, y, weights)
    return -1


@kernel
def rate(problem, y, memory, out):
    """No memory, no rate."""


@kernel
def propagate(problem, y, memory, scratch):
    """No memory to propagate."""


@kernel
def storage(problem, memory):
    """No memory, no storage."""
    return 0.0
