"""Fully distributed: only neighbours' messages are used [eq:CenterFeedback].

epsilon z_i' = y_i - z_i, epsilon d/dt **y**^i_-i = -S_i sum_j (**y**^i - **y**^j) and
u_i = -k [dJ_i/dy_i(y_i, **y**^i_-i) + dphi/dy_i(z_i, **y**^i_-i)]. The barrier is evaluated at
estimates, which can leave the interior: then no action exists, and that is reported.

The law's memory: N rows of estimates (see :mod:`gne_mj.controllers.estimates`), then z (m,).
"""

import sys
from dataclasses import dataclass, field
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import own_weights, weighted_gradient
from gne_mj.controllers.estimates import (
    add_disagreement,
    estimate_propagators,
    propagate_estimates,
)
from gne_mj.controllers.law import Law
from gne_mj.controllers.settings import EPSILON, GAIN, RHO
from gne_mj.errors import InvalidInput
from gne_mj.graph import Graph
from gne_mj.native import copy, kernel


@dataclass(frozen=True, eq=False)
class FullyDistributed(Law):
    """Two time scales: estimates spread fast, actions follow the estimated penalised gradient.

    Args:
        graph: over which agents communicate.
        epsilon: time constant of estimates and z in s, positive.
        gain: k, positive.
    """

    information: ClassVar[str] = "distributed"
    graph: Graph = field()  # hides the base class's default
    epsilon: float
    gain: float = 1.0

    def __post_init__(self) -> None:
        for key in ("epsilon", "gain"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"controller.{key}", value, "it must be positive and finite")

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class."""
        numbers = super().settings(rho)
        numbers[GAIN], numbers[EPSILON] = self.gain, self.epsilon
        return numbers

    def initial_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Estimates and z equal to y (m,)."""
        return np.concatenate([np.tile(y, self.graph.agents), y])

    def propagators(self, period: float) -> NDArray[np.float64]:
        """Maps of the estimates' errors, then the factor that remains of z - y; (N + 1, N, N)."""
        agents = self.graph.agents
        maps = np.zeros((agents + 1, agents, agents))
        maps[:agents] = estimate_propagators(self.graph, period / self.epsilon)
        maps[agents] = np.exp(-period / self.epsilon)
        return maps


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); return -1, or agent * p + constraint of the first estimate outside.

    The true profile's weights are not read: in their place agents use those of their estimates.
    """
    data, settings = problem.data, problem.settings
    at = data.offsets
    agents = len(at) - 1
    m = at[agents]
    z = memory[agents * m :]
    for i in range(agents):
        first, last = at[i], at[i + 1]
        outside = agent_action(
            game, data, settings, i, y[first:last], z[first:last], memory[i * m : (i + 1) * m],
            work, u[first:last],
        )  # fmt: skip
        if outside >= 0:
            return i * len(weights) + outside
    return -1


@kernel
def agent_action(game, data, settings, i, own_action, own_filter, estimates, work, u):
    """Action of agent i from what it has: y_i, z_i (m_i,) and its estimates (m,).

    work.profile and work.own_weights are overwritten. Returns -1, or the constraint on or outside
    whose boundary the agent's filtered profile (z_i, **y**^i_-i) lies.
    """
    first = data.offsets[i]
    profile, weights = work.profile, work.own_weights
    copy(estimates, profile)
    copy(own_action, profile[first : first + len(u)])
    for r in range(len(u)):
        u[r] = game.cost_gradient(data.parameters, i, first + r, profile)
    copy(own_filter, profile[first : first + len(u)])
    outside = own_weights(game, data, settings[RHO], i, profile, weights)
    if outside >= 0:
        return outside
    for r in range(len(u)):
        barrier = weighted_gradient(game, data, i, first + r, profile, weights)
        u[r] = -settings[GAIN] * (u[r] + barrier)
    return -1


@kernel
def rate(problem, y, memory, out):
    """Fill out with the rates of estimates and z (own blocks of the estimates: zero)."""
    data, graph, settings = problem.data, problem.graph, problem.settings
    at = data.offsets
    agents = len(at) - 1
    m = at[agents]
    faster = 1.0 / settings[EPSILON]
    for i in range(agents):
        row = out[i * m : (i + 1) * m]
        for r in range(m):
            row[r] = 0.0
        add_disagreement(data, graph, y, memory, i, -faster, row)
    for r in range(m):
        out[agents * m + r] = faster * (y[r] - memory[agents * m + r])


@kernel
def propagate(problem, y, memory, scratch):
    """Move estimates and z over one control period with the outputs held at y.

    problem.propagators is (N + 1, N, N): the estimates' maps, then in its last entry the factor
    that remains of z - y.
    """
    data = problem.data
    agents = len(data.offsets) - 1
    m = data.offsets[agents]
    propagate_estimates(data, problem.propagators, y, memory, scratch)
    remaining = problem.propagators[agents, 0, 0]
    for r in range(agents * m, agents * m + m):
        own = y[r - agents * m]
        memory[r] = own + remaining * (memory[r] - own)
