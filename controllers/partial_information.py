"""Partial information: costs at estimates, a measured barrier [eq:nonlinearPIFeedback].

tau d/dt **y**^i_-i = -c S_i sum_j (**y**^i - **y**^j) over the neighbours j of agent i, and
u_i = -dJ_i/dy_i(y_i, **y**^i_-i) - dphi/dy_i(y) - c R_i sum_j (**y**^i - **y**^j).
The paper has c = tau = 1. The coupling gain c scales the Laplacian in both places. A small tau
takes away the inertia that estimates add to the agents: each of them acts on agent j as tau more
mass tied to it. The storage function is that of the agents plus tau/2 times the squared distance
of all estimates from the equilibrium, and decreases as with tau = 1.

The law's memory: N rows of estimates (see :mod:`gne_mj.controllers.estimates`); or, where agents
keep only those that matter, what :mod:`gne_mj.controllers.kept` has, and the kernels are those of
:mod:`gne_mj.controllers.partial_kept`.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType, ModuleType
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers import partial_kept
from gne_mj.controllers.estimates import (
    clear_others,
    estimate_rates,
    heard_at,
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
from gne_mj.controllers.measured import memory_outputs as memory_outputs
from gne_mj.controllers.measured import own_profile as own_profile
from gne_mj.controllers.settings import COUPLING, TIME_CONSTANT
from gne_mj.controllers.table import EstimatesTable
from gne_mj.controllers.theorem import LawTheorem
from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.native import kernel
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

LANES = True  # numbers or lanes


@dataclass(frozen=True, eq=False)
class PartialInformation(Law):
    """Gradient play on estimates that consensus spreads, with a measured barrier.

    Args:
        graph: over which agents communicate.
        coupling: c, positive.
        time_constant: tau in s, positive.
        kept: which estimates agents keep; all if left out.
    """

    information: ClassVar[str] = "partial"
    proven: ClassVar[LawTheorem] = LawTheorem(
        "partial information, lemma:nonlinearPI and the theorem after it",
        strong=True,
        at_estimates=True,
    )
    memory_parts: ClassVar[tuple[MemoryPart, ...]] = (ESTIMATES,)
    guarded: ClassVar[bool] = True
    graph: Graph = field()  # hides the base class's default
    coupling: float = 1.0
    time_constant: float = 1.0
    kept: Kept | None = None

    def __post_init__(self) -> None:
        check_positive(self, "coupling", "time_constant")
        if self.kept is not None:
            vars(self).update(memory_parts=(KEPT_ESTIMATES,))

    @property
    def kernels(self) -> ModuleType:
        """This module; of kept estimates that for these."""
        return sys.modules[__name__] if self.kept is None else partial_kept

    @property
    def estimate_rate(self) -> float:
        """c / tau."""
        return self.coupling / self.time_constant

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class."""
        numbers = super().settings(rho)
        numbers[COUPLING], numbers[TIME_CONSTANT] = self.coupling, self.time_constant
        return numbers

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
        found = [self.estimates_in(row, owner) for row in memory]
        total = [np.sum((values - equilibrium[of]) ** 2) for of, values in found]
        return 0.5 * self.time_constant * np.array(total)

    def initial_memory(
        self,
        y: NDArray[np.float64],
        estimate: ArrayLike | None = None,
        filtered: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """See the base class."""
        super().initial_memory(y, filtered=filtered)
        if self.kept is not None:
            return self.kept.initial(y, estimate)
        return initial_estimates(self.graph.agents, y, estimate)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from the true barrier's weights (p,) and each agent's own profile."""
    data = problem.data
    at = data.offsets
    prepare(problem, 0, len(at) - 1, y, memory)
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            barrier = weighted_gradient(game, data, i, a, y, weights)
            u[a] = -barrier_free(game, problem, i, a, y, memory) - barrier
    return -1


@kernel
def barrier_free(game, problem, i, a, y, memory):
    """What drives entry a of agent i's action besides the barrier, its row having y_i (m,)."""
    m = len(y)
    row = memory[i * m : (i + 1) * m]
    cost = game.cost_gradient(problem.data.parameters, i, a, row)
    return cost + problem.settings[COUPLING] * heard(problem, y, memory, i, a)


@kernel
def heard(problem, y, memory, i, a):
    """R_i sum_j (**y**^i - **y**^j): an own action less what the neighbours take it to be."""
    total = 0.0
    for link in range(problem.graph.pointer[i], problem.graph.pointer[i + 1]):
        total += y[a] - memory[heard_at(problem, len(y), link) + a]
    return total


@kernel
def add_barrier_free_slope(game, problem, i, a, y, memory, out):
    """Add dpull/dy to out (m,): the estimates stay, so that only own actions count."""
    data, graph, m = problem.data, problem.graph, len(y)
    game.add_cost_hessian(data.parameters, i, a, memory[i * m : (i + 1) * m], 1.0, out)
    clear_others(data, i, out)
    out[a] += problem.settings[COUPLING] * (graph.pointer[i + 1] - graph.pointer[i])


@kernel
def rate(problem, y, memory, out):
    """Fill out with the estimates' rates."""
    estimate_rates(problem, y, memory, out)


@kernel
def propagate(problem, y, memory, scratch):
    """Move the estimates over one control period with the outputs held at y."""
    move_estimates(problem, y, memory, scratch)


@kernel
def storage(problem, memory):
    """tau / 2 times the squared distance of all estimates from the equilibrium."""
    at, y = problem.data.offsets, problem.equilibrium
    agents = len(at) - 1
    m = at[agents]
    total = 0.0
    for i in range(agents):
        for r in range(at[i]):
            total += (memory[i * m + r] - y[r]) ** 2
        for r in range(at[i + 1], m):
            total += (memory[i * m + r] - y[r]) ** 2
    return 0.5 * problem.settings[TIME_CONSTANT] * total


@LAWS.register
class PartialController(EstimatesTable):
    """Costs at estimates that neighbours exchange [eq:nonlinearPIFeedback]"""

    information: Literal["partial"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"coupling": (1.0, 3.0, 10.0, 30.0), "barrier.rho": (0.003, 0.01, 0.03, 0.1)}
    )
    coupling: float = Field(1.0, gt=0, description="c; the paper has 1")
    time_constant: Annotated[float, Unit("s")] = Field(
        1.0, gt=0, description="tau of the estimates; the paper has 1"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        graph = self.network(game.agents)
        kept = self.kept_of(game, graph, constraints=False)
        return PartialInformation(graph, self.coupling, self.time_constant, kept)
