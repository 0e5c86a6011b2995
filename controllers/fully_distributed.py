"""Fully distributed: only neighbours' messages are used [eq:CenterFeedback].

epsilon z_i' = y_i - z_i, epsilon d/dt **y**^i_-i = -S_i sum_j (**y**^i - **y**^j) and
u_i = -k [dJ_i/dy_i(y_i, **y**^i_-i) + dphi/dy_i(z_i, **y**^i_-i)]. The barrier is evaluated at
estimates, which can leave the interior: then no action exists, and that is reported.

The law's memory: N rows of estimates (see :mod:`gne_mj.controllers.estimates`), then z (m,). Where
agents keep only the estimates that matter, kernels and memory are those of
:mod:`gne_mj.controllers.distributed_kept`.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType, ModuleType
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.controllers.estimates import (
    clear_others,
    estimate_rates,
    move_estimates,
    prepare,
)
from gne_mj.controllers.kept import Kept
from gne_mj.controllers.law import (
    ESTIMATES,
    KEPT_ESTIMATES,
    Law,
    MemoryPart,
    check_positive,
    initial_estimates,
)
from gne_mj.controllers.settings import EPSILON, FAST_WEIGHT, GAIN
from gne_mj.controllers.table import EstimatesTable
from gne_mj.controllers.theorem import LawTheorem
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.native import copy, kernel
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit


@dataclass(frozen=True, eq=False)
class FullyDistributed(Law):
    """Two time scales: estimates spread fast, actions follow the estimated penalised gradient.

    Args:
        graph: over which agents communicate.
        epsilon: time constant of estimates and z in s, positive.
        gain: k, positive.
        kept: which estimates agents keep; all if left out.
        fast_weight: omega of W = V + omega V_fast, V_fast being half the squared errors of
            estimates and z; positive. The law does not read it: W is what epsilon* is computed for
            (:mod:`gne_mj.theory.epsilon_star`) and what a run monitors.
    """

    information: ClassVar[str] = "distributed"
    proven: ClassVar[LawTheorem] = LawTheorem(
        "fully distributed, lemma:centreInv and the theorem after it",
        strong=True,
        singular_perturbation=True,
    )
    memory_parts: ClassVar[tuple[MemoryPart, ...]] = (
        ESTIMATES,
        MemoryPart("filtered_action", "z"),
    )
    alone: ClassVar[bool] = True
    rosenbrock: ClassVar[bool] = True
    graph: Graph = field()  # these two hide the base class's defaults
    epsilon: float = field()
    gain: float = 1.0
    kept: Kept | None = None
    fast_weight: float = 3.0

    def __post_init__(self) -> None:
        check_positive(self, "epsilon", "gain", "fast_weight")
        if self.kept is not None:
            parts = KEPT_ESTIMATES, self.memory_parts[1]
            vars(self).update(memory_parts=parts, rosenbrock=False)

    @property
    def kernels(self) -> ModuleType:
        """This module; of kept estimates that for these."""
        if self.kept is None:
            return sys.modules[__name__]
        from gne_mj.controllers import distributed_kept  # which uses this module

        return distributed_kept

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class."""
        numbers = super().settings(rho)
        numbers[EPSILON], numbers[FAST_WEIGHT] = self.epsilon, self.fast_weight
        return numbers

    @property
    def estimate_rate(self) -> float:
        """1 / epsilon."""
        return 1.0 / self.epsilon

    def among(self, there: NDArray[np.bool_]) -> Law:
        """See the base class."""
        return self._over_fewer(there)

    def memory_storage(
        self,
        memory: NDArray[np.float64],
        owner: NDArray[np.int64],
        equilibrium: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """See the base class."""
        if self.kept is not None:  # of which nothing is claimed
            return np.zeros(len(memory))
        m = len(owner)
        rows = memory[:, : (owner[-1] + 2) * m].reshape(len(memory), -1, m)
        own = rows[:, owner, np.arange(m)]
        return 0.5 * self.fast_weight * np.sum((rows - own[:, None]) ** 2, axis=(1, 2))

    def initial_memory(
        self,
        y: NDArray[np.float64],
        estimate: ArrayLike | None = None,
        filtered: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """See the base class."""
        z = np.asarray(y if filtered is None else filtered, dtype=np.float64)
        if z.shape not in ((), y.shape):
            raise InvalidInput(
                "filtered",
                f"shape {z.shape}",
                f"it must be one number or a list of {len(y)}",
            )
        if self.kept is None:
            estimates = initial_estimates(self.graph.agents, y, estimate)
        else:
            estimates = self.kept.initial(y, estimate)
        return np.concatenate([estimates, np.broadcast_to(z, y.shape)])

    def barrier_profiles(
        self, game_actions: NDArray[np.int64], memory: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(z_i, **y**^i_-i) of all agents."""
        agents, m = self.graph.agents, len(game_actions)
        z = memory[-m:]
        if self.kept is None:
            profiles = memory[: agents * m].reshape(agents, m).copy()
        else:  # of what an agent does not keep its barrier has nothing
            profiles = np.tile(z, (agents, 1))
            profiles[self.kept.holder, self.kept.action] = memory[: self.kept.size]
        profiles[game_actions, np.arange(m)] = z
        return profiles


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); return -1, or agent * p + constraint of the first estimate outside.

    The true profile's weights are not read: in their place agents use those of their estimates, at
    the penalty of work.now, which may fall in time. If an agent's filtered profile (z_i,
    **y**^i_-i) is on or outside a boundary, work.profile is that profile.
    """
    data, gain = problem.data, problem.settings[GAIN]
    at = data.offsets
    agents = len(at) - 1
    m = at[agents]
    z = memory[agents * m : agents * m + m]
    prepare(problem, 0, agents, y, memory)
    for i in range(agents):
        for a in range(at[i], at[i + 1]):
            u[a] = game.cost_gradient(data.parameters, i, a, memory[i * m : (i + 1) * m])
    prepare(problem, 0, agents, z, memory)  # z_i stands in agent i's row for its barrier
    found = -1
    for i in range(agents):
        row = memory[i * m : (i + 1) * m]
        outside = add_barrier(game, data, i, work.now.penalty, row, u[at[i] : at[i + 1]])
        if outside >= 0:
            copy(row, work.profile)
            found = i * len(weights) + outside
            break
    prepare(problem, 0, agents, y, memory)
    for r in range(m):
        u[r] *= -gain
    return found


@kernel
def add_barrier(game, data, i, rho, profile, u):
    """Add the gradient of agent i's barrier at a profile (m,) to u (m_i,); -1, or the first
    constraint that is not inside."""
    first, q = data.offsets[i], data.parameters
    for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
        k = data.own_index[entry]
        room = -game.constraint(q, k, profile) - data.tightening[k]
        if not room > 0.0:
            return k
        weight = rho / room
        for r in range(len(u)):
            u[r] += weight * game.constraint_gradient(q, k, first + r, profile)
    return -1


@kernel
def barrier_free(game, problem, i, a, y, memory):
    """What drives entry a of agent i's action besides the barrier, its row having y_i."""
    m = len(y)
    row = memory[i * m : (i + 1) * m]
    return problem.settings[GAIN] * game.cost_gradient(problem.data.parameters, i, a, row)


@kernel
def add_barrier_free_slope(game, problem, i, a, y, memory, out):
    """Add dpull/dy to out (m,): the estimates stay, so that only own actions count."""
    m = len(y)
    row = memory[i * m : (i + 1) * m]
    game.add_cost_hessian(problem.data.parameters, i, a, row, problem.settings[GAIN], out)
    clear_others(problem.data, i, out)


@kernel
def own_profile(problem, i, y, memory, profile):
    """Fill profile (m,) with what agent i's barrier reads: its estimates, and where z_i will be.

    Its own block is z_i after a control period with y_i held. Returns by how much that moves with
    the action it is held at.
    """
    at, m = problem.data.offsets, len(y)
    agents = len(at) - 1
    stays = problem.propagator.numbers[2]
    copy(memory[i * m : (i + 1) * m], profile)
    for r in range(at[i], at[i + 1]):
        profile[r] = y[r] + stays * (memory[agents * m + r] - y[r])
    return 1.0 - stays


@kernel
def memory_outputs(prediction, held):
    """In mode implicit the memory moves with the outputs of the period's end, as solved for."""
    copy(prediction, held)


@kernel
def rate(problem, y, memory, out):
    """Fill out with the rates of estimates and z (own blocks of the estimates: zero)."""
    at = problem.data.offsets
    agents = len(at) - 1
    m = at[agents]
    faster = 1.0 / problem.settings[EPSILON]
    estimate_rates(problem, y, memory, out)
    for r in range(m):
        out[agents * m + r] = faster * (y[r] - memory[agents * m + r])


@kernel
def propagate(problem, y, memory, scratch):
    """Move estimates and z over one control period with the outputs held at y."""
    data = problem.data
    agents = len(data.offsets) - 1
    m = data.offsets[agents]
    move_estimates(problem, y, memory, scratch)
    remaining = problem.propagator.numbers[2]
    for r in range(agents * m, agents * m + m):
        own = y[r - agents * m]
        memory[r] = own + remaining * (memory[r] - own)


@kernel
def storage(problem, memory):
    """omega V_fast: half the squared errors of all estimates and z, times their weight.

    The rows must have their own actions in place.
    """
    owner, at = problem.data.owner, problem.data.offsets
    agents, m, total = len(at) - 1, len(owner), 0.0
    for r in range(m):
        y = memory[owner[r] * m + r]
        total += (memory[agents * m + r] - y) ** 2
        for i in range(agents):
            total += (memory[i * m + r] - y) ** 2
    return 0.5 * problem.settings[FAST_WEIGHT] * total


@LAWS.register
class DistributedController(EstimatesTable):
    """Neighbours' messages and nothing else [eq:CenterFeedback]"""

    information: Literal["distributed"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"epsilon": (0.003, 0.01, 0.03), "gain": (0.1, 0.3, 1.0), "barrier.rho": (0.01, 0.1)}
    )
    epsilon: Annotated[float, Unit("s")] = Field(
        gt=0, description="time constant of estimates and z"
    )
    gain: float = Field(1.0, gt=0, description="k")
    fast_weight: float = Field(
        3.0,
        gt=0,
        description="weight of the squared errors of estimates and z in the Lyapunov function",
    )

    def build(self, game: Game) -> Law:
        """The law."""
        graph = self.network(game.agents)
        kept = self.kept_of(game, graph, constraints=True)
        return FullyDistributed(graph, self.epsilon, self.gain, kept, self.fast_weight)
