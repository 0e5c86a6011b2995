"""Primal-dual gradient play under partial information, with consensus on multipliers.

After Bianchi and Grammatico (Continuous-time fully distributed generalized Nash equilibrium seeking
for multi-integrator agents, Automatica 129, 2021, arXiv 1911.12266), whose constraints are sums of
functions of one agent each; here A y <= b, a bound on both sides being two rows
(:mod:`gne_mj.controllers.affine_bounds`). Agent i knows its own columns A_i and its share b_i of b,
keeps estimates of all actions as under the paper's partial information, multipliers l^i of all
rows, and z^i that makes them agree. With sums over its neighbours j:

    u_i = -k (dJ_i/dy_i(y_i, **y**^i_-i) + A_i^T l^i) - c R_i sum_j (**y**^i - **y**^j)
    d/dt **y**^i_-i = -c S_i sum_j (**y**^i - **y**^j),   z^i' = kappa sum_j (l^i - l^j)
    l^i' = kappa [A_i y_i - b_i - sum_j (z^i - z^j) - sum_j (l^i - l^j)]^+

At rest all l^i are one l, and summing the last line over i gives A y <= b, l >= 0, l.(A y - b) = 0:
a variational equilibrium. With F strongly monotone, Lipschitz, and c / k large enough y tends to
it, of integrators as of the paper's agents (docs/rivals.md). Nothing keeps y inside meanwhile.

[.]^+ as steps have it: as under primal-dual play; in mode sampled l and z move by projected Euler
steps, the estimates exactly.

The law's memory: N rows of estimates, N rows of l^i, N rows of z^i, and room for N rows, which is
0. Where messages can be lost, l^i and z^i are lost with the estimates.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.bounds import check_room
from gne_mj.controllers.affine_bounds import (
    AffineBounds,
    affine_bounds,
    entry_of,
    own_part,
    rows_of,
)
from gne_mj.controllers.estimates import besides_at, estimate_rates, move_estimates, prepare
from gne_mj.controllers.law import ESTIMATES, Law, MemoryPart, check_positive, initial_estimates
from gne_mj.controllers.multipliers import PERIOD, held_for
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.partial_information import heard
from gne_mj.controllers.propagation import Propagator
from gne_mj.controllers.rival import Rival
from gne_mj.controllers.settings import COUNT, COUPLING, GAIN, RATE
from gne_mj.controllers.table import NetworkTable
from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.native import kernel
from gne_mj.registry import LAWS

DUAL_GAIN, BOUNDS = COUNT, COUNT + 1


@dataclass(frozen=True, eq=False)
class PrimalDualPartial(Rival):
    """Primal-dual gradient play on estimates, each agent with multipliers of its own.

    Args:
        graph: over which agents communicate.
        bounds: the constraints.
        gain: k, positive.
        coupling: c, positive.
        dual_gain: kappa, positive.
    """

    information: ClassVar[str] = "primal-dual-partial"
    promise: ClassVar[str] = (
        "constraints hold in the limit, if the coupling is strong enough; of what comes before"
        " nothing is proven"
    )
    own: ClassVar[tuple[str, ...]] = ("dual_gain",)
    graph: Graph = field()  # hides the base class's default
    bounds: AffineBounds = field()
    gain: float = 1.0
    coupling: float = 1.0
    dual_gain: float = 1.0

    def __post_init__(self) -> None:
        check_positive(self, "coupling")
        super().__post_init__()
        shape = (self.graph.agents, len(self.bounds.b))
        dims = ("holding_agent", "bound")
        multipliers = MemoryPart(
            "multiplier", "multipliers that agents hold", dims=dims, shape=shape
        )
        agreement = MemoryPart("agreement", "z, by which they agree", dims=dims, shape=shape)
        vars(self).update(
            memory_parts=(ESTIMATES, multipliers, agreement), sent_besides=len(self.bounds.b)
        )

    @property
    def estimate_rate(self) -> float:
        """c."""
        return self.coupling

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class, and the bounds behind these."""
        numbers = super().settings(rho)
        numbers[COUPLING] = self.coupling
        return np.append(numbers, self.bounds.numbers)

    def initial_memory(
        self,
        y: NDArray[np.float64],
        estimate: ArrayLike | None = None,
        filtered: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """l^i = 0 and z^i = 0; see the base class."""
        super().initial_memory(y, filtered=filtered)
        estimates = initial_estimates(self.graph.agents, y, estimate)
        return np.append(estimates, np.zeros(3 * self.graph.agents * len(self.bounds.b)))

    def step_propagator(self, timestep: float) -> Propagator:
        """See the base class; as of a control period, in time constants of the estimates."""
        return held_for(self.estimate_rate * timestep)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from own actions, rows of estimates and multipliers; no weights are read."""
    data, numbers = problem.data, problem.settings
    at, m, rows = data.offsets, len(y), rows_of(numbers, BOUNDS)
    agents = len(at) - 1
    prepare(problem, 0, agents, y, memory)
    for i in range(agents):
        row, held = memory[i * m : (i + 1) * m], agents * m + i * rows
        for a in range(at[i], at[i + 1]):
            total = game.cost_gradient(data.parameters, i, a, row)
            for r in range(rows):
                total += entry_of(numbers, BOUNDS, agents, m, r, a) * memory[held + r]
            u[a] = -numbers[GAIN] * total - numbers[COUPLING] * heard(problem, y, memory, i, a)
    return -1


@kernel
def disagreement(problem, m, memory, block, i, r):
    """sum_j (x^i - x^j)_r of the multipliers, block 0, or of z, block 1."""
    rows, agents = rows_of(problem.settings, BOUNDS), len(problem.data.offsets) - 1
    own, total = memory[agents * m + (block * agents + i) * rows + r], 0.0
    for link in range(problem.graph.pointer[i], problem.graph.pointer[i + 1]):
        total += own - memory[besides_at(problem, m, block, link) + r]
    return total


@kernel
def drive(problem, y, memory, i, r):
    """kappa (A_i y_i - b_i - sum_j (z^i - z^j) - sum_j (l^i - l^j))_r."""
    m, numbers = len(y), problem.settings
    total = own_part(problem.data, numbers, BOUNDS, i, r, y)
    total -= disagreement(problem, m, memory, 1, i, r) + disagreement(problem, m, memory, 0, i, r)
    return numbers[DUAL_GAIN] * total


@kernel
def rate(problem, y, memory, out):
    """Fill out with the rates of estimates, multipliers and z; the room stays 0."""
    numbers, m = problem.settings, len(y)
    rows, agents = rows_of(numbers, BOUNDS), len(problem.data.offsets) - 1
    estimate_rates(problem, y, memory, out)
    timestep = problem.propagator.numbers[PERIOD] / numbers[RATE]
    for i in range(agents):
        for r in range(rows):
            held = agents * m + i * rows + r
            out[held] = max(drive(problem, y, memory, i, r), -memory[held] / timestep)
            apart = disagreement(problem, m, memory, 0, i, r)
            out[held + agents * rows] = numbers[DUAL_GAIN] * apart
            out[held + 2 * agents * rows] = 0.0


@kernel
def propagate(problem, y, memory, scratch):
    """Move all of it over one control period with the outputs held at y."""
    numbers, m = problem.settings, len(y)
    rows, agents = rows_of(numbers, BOUNDS), len(problem.data.offsets) - 1
    size, period = agents * rows, problem.propagator.numbers[PERIOD] / numbers[RATE]
    for i in range(agents):  # multipliers into the room: those of before move z
        for r in range(rows):
            held = agents * m + i * rows + r
            moved = memory[held] + period * drive(problem, y, memory, i, r)
            memory[held + 2 * size] = max(moved, 0.0)
    for i in range(agents):
        for r in range(rows):
            apart = disagreement(problem, m, memory, 0, i, r)
            memory[agents * m + size + i * rows + r] += period * numbers[DUAL_GAIN] * apart
    for held in range(agents * m, agents * m + size):
        memory[held] = memory[held + 2 * size]
        memory[held + 2 * size] = 0.0
    move_estimates(problem, y, memory, scratch)


@LAWS.register
class PrimalDualPartialController(NetworkTable):
    """Gradient play with estimates and multipliers that neighbours exchange, a rival"""

    information: Literal["primal-dual-partial"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.3, 1.0), "coupling": (1.0, 5.0, 25.0), "dual_gain": (0.1, 0.5, 2.0, 10.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of the Lagrangian's gradient")
    coupling: float = Field(1.0, gt=0, description="c of the estimates")
    dual_gain: float = Field(1.0, gt=0, description="kappa of the multipliers' rates")

    def build(self, game: Game) -> Law:
        """The law."""
        bounds = affine_bounds(game)
        size = 3 * game.agents * len(bounds.b) + bounds.numbers.size
        check_room("agents.count", game.agents, size, f"what {game.agents} agents hold of bounds")
        return PrimalDualPartial(
            self.network(game.agents), bounds, self.gain, self.coupling, self.dual_gain
        )
