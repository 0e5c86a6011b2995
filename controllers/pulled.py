"""The barrier alone, beside whatever somebody else wants: the law of a safety filter.

u_i = pull_i - dphi/dy_i(y). The pull (m,) is the law's memory, which whoever steps the loop sets
before each control period, as a policy does; in mode implicit the barrier is at the outputs of the
period's end, so that these are inside whatever is pulled (docs/learning.md). A static law: nothing
of itself moves its memory.
"""

import sys
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers.law import Law
from gne_mj.controllers.measured import memory_outputs as memory_outputs
from gne_mj.controllers.measured import own_profile as own_profile
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.theorem import LawTheorem
from gne_mj.native import kernel


@dataclass(frozen=True, eq=False)
class Pulled(Law):
    """Another's wish and the barrier's gradient; the costs have no part in it."""

    proven: ClassVar[LawTheorem] = LawTheorem("docs/learning.md, Theorem 11")
    guarded: ClassVar[bool] = True

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]

    def first_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Nothing is pulled at first."""
        return np.zeros(len(y))


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from the true profile y (m,) and the barrier's weights (p,) there."""
    data = problem.data
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            u[a] = memory[a] - weighted_gradient(game, data, i, a, y, weights)
    return -1


@kernel
def rate(problem, y, memory, out):
    """The pull stays as it is."""
    for r in range(len(memory)):
        out[r] = 0.0


@kernel
def prepare(problem, first, last, y, memory):
    """Nothing to prepare."""


@kernel
def barrier_free(game, problem, i, a, y, memory):
    """What entry a of agent i's action is driven by besides the barrier, with its sign turned."""
    return -memory[a]


@kernel
def add_barrier_free_slope(game, problem, i, a, y, memory, out):
    """It does not depend on y."""
