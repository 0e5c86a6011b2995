"""A policy of plain Python functions under the barrier: a safety filter as a law.

u = pull - dphi/dy(y), the pull being what the policy asks for. In mode implicit it is that at the
control instant's outputs, as they were predicted (which they are, where nothing disturbs), and is
held for the period, while the barrier is at the outputs of the period's end: what is inside then,
and why, is in docs/learning.md. In the other modes both are at the present outputs, and nothing is
promised. The law's memory is the pull.
"""

import sys
from types import ModuleType

import numpy as np

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers import plain_law
from gne_mj.controllers.measured import own_profile as own_profile
from gne_mj.controllers.plain_law import ACTION, Array, PlainLaw
from gne_mj.controllers.pulled import add_barrier_free_slope as add_barrier_free_slope
from gne_mj.controllers.pulled import barrier_free as barrier_free
from gne_mj.controllers.pulled import prepare as prepare
from gne_mj.controllers.pulled import rate as rate
from gne_mj.controllers.pulled import storage as storage
from gne_mj.native import copy, kernel
from gne_mj.plain import call_out


class FilteredLaw(PlainLaw):
    """A policy given by a plain function, without a memory of its own, beside the barrier."""

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]

    def first_memory(self, y: Array) -> Array:
        """What is pulled at first."""
        return self.asked(np.nan, y)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) by the policy's own function and the barrier's weights (p,), both at y (m,)."""
    plain_law.action(game, problem, y, weights, memory, work, u)
    data = problem.data
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            u[a] -= weighted_gradient(game, data, i, a, y, weights)
    return -1


@kernel
def propagate(problem, y, memory, scratch):
    """The pull of the next period: the policy's at y (m,)."""
    failed = call_out(np.int64(problem.settings[ACTION]), 0, 0, 0, 0.0, y, memory, memory)
    memory[0] += failed  # zero, or not a number


@kernel
def memory_outputs(prediction, held):
    """The memory moves with the outputs of the period's end."""
    copy(prediction, held)
