"""The recursive safe monotone flow, which needs no quadratic program.

The safe monotone flow moves by the direction xi nearest to -k F(y) with J_g xi <= -alpha g
(Allibhoy and Cortes, Anytime solvers for variational inequalities: the (recursive) safe monotone
flows, Automatica 177, 2025, arXiv 2311.09527). That is xi = -k F - J_g^T v, with v >= 0 the
multipliers of the program: J_g xi + alpha g <= 0, and = 0 where v > 0. The recursive flow lets v
follow in place of solving: u = -k F - J_g^T v and tau v' = [J_g u + alpha g]^+_v, the ascent of the
program's dual. It rests where k F + J_g^T v = 0, g <= 0, v >= 0, v.g = 0: at variational
equilibria, v being k times their multipliers. For small tau the set is kept up to an amount that
tends to 0 with tau, of integrators, whose y' is u.

[.]^+ as steps have it: in mode continuous as under primal-dual play; in mode sampled v moves, with
y held, by projected Euler steps that are as long as that ascent allows, tau over the trace of J_g
J_g^T, or shorter.

The law's memory: v (p,), and room for a direction (m,), which is 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj import game_functions as games
from gne_mj.barrier import weighted_gradient
from gne_mj.controllers.law import Law
from gne_mj.controllers.multipliers import PERIOD, MultiplierLaw, rising
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.settings import COUNT, GAIN
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

ALPHA, TAU = COUNT, COUNT + 1
MOST_STEPS = 1000.0  # in a control period; they become no longer where more were needed


@dataclass(frozen=True, eq=False)
class RecursiveSafeFlow(MultiplierLaw):
    """The recursive safe monotone flow.

    Args:
        constraints: p, how many there are.
        gain: k of F, positive.
        alpha: how fast a constraint may be approached, in 1/s, positive.
        time_constant: tau of the multipliers in s, positive.
    """

    information: ClassVar[str] = "recursive-safe-flow"
    promise: ClassVar[str] = (
        "of integrators, for a small time constant, the set is nearly kept and the equilibrium"
        " reached; of others only where it rests is known"
    )
    own: ClassVar[tuple[str, ...]] = ("alpha", "time_constant")
    constraints: int
    gain: float = 1.0
    alpha: float = 1.0
    time_constant: float = 1.0

    def first_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """See the base class."""
        return np.zeros(self.constraints + len(y))


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from y (m,) and the multipliers; the barrier's weights are not read."""
    data, gain = problem.data, problem.settings[GAIN]
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            cost = gain * game.cost_gradient(data.parameters, i, a, y)
            u[a] = -cost - weighted_gradient(game, data, i, a, y, memory)
    return -1


@kernel
def direction(problem, y, memory, out):
    """Fill out (m,) with the same."""
    data, gain = problem.data, problem.settings[GAIN]
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            total = gain * games.cost_gradient(data, i, a, y)
            for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
                k = data.own_index[entry]
                if memory[k] > 0.0:
                    total += memory[k] * games.constraint_gradient(data, k, a, y)
            out[a] = -total


@kernel
def ascent(problem, k, y, u):
    """(J_g u + alpha g)_k, the slope of the program's dual, divided by tau."""
    data, numbers = problem.data, problem.settings
    total = numbers[ALPHA] * (games.constraint(data, k, y) + data.tightening[k])
    for entry in range(data.member_pointer[k], data.member_pointer[k + 1]):
        j = data.member_index[entry]
        for a in range(data.offsets[j], data.offsets[j + 1]):
            total += games.constraint_gradient(data, k, a, y) * u[a]
    return total / numbers[TAU]


@kernel
def trace(problem, y):
    """Of J_g J_g^T."""
    data, total = problem.data, 0.0
    for k in range(len(data.tightening)):
        for entry in range(data.member_pointer[k], data.member_pointer[k + 1]):
            j = data.member_index[entry]
            for a in range(data.offsets[j], data.offsets[j + 1]):
                total += games.constraint_gradient(data, k, a, y) ** 2
    return total


@kernel
def rate(problem, y, memory, out):
    """Fill out with the multipliers' rates; the room stays 0."""
    p = len(problem.data.tightening)
    u = out[p : p + len(y)]
    direction(problem, y, memory, u)
    for k in range(p):
        out[k] = rising(problem, ascent(problem, k, y, u), memory[k])
    for a in range(len(y)):
        u[a] = 0.0


@kernel
def propagate(problem, y, memory, scratch):
    """Move the multipliers over one control period with y held."""
    p = len(problem.data.tightening)
    period, u = problem.propagator.numbers[PERIOD], memory[p : p + len(y)]
    allowed = problem.settings[TAU] / trace(problem, y)
    count = int(min(max(np.ceil(period / allowed), 1.0), MOST_STEPS))
    step = min(period / count, allowed)
    for _ in range(count):
        direction(problem, y, memory, u)
        for k in range(p):
            memory[k] = max(memory[k] + step * ascent(problem, k, y, u), 0.0)
    for a in range(len(y)):
        u[a] = 0.0


@LAWS.register
class RecursiveSafeFlowController(LawTable):
    """The recursive safe monotone flow, a rival"""

    information: Literal["recursive-safe-flow"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0), "alpha": (1.0, 5.0), "time_constant": (0.1, 1.0, 10.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of the pseudo-gradient")
    alpha: Annotated[float, Unit("1/s")] = Field(
        1.0, gt=0, description="how fast a constraint may be approached"
    )
    time_constant: Annotated[float, Unit("s")] = Field(
        1.0, gt=0, description="tau of the multipliers"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return RecursiveSafeFlow(
            game.constraints_count, self.gain, self.alpha, self.time_constant
        )  # fmt: skip
