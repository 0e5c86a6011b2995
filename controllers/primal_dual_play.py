"""Primal-dual gradient play: each agent descends its Lagrangian, all share the multipliers.

u = -k (F(y) + J_g(y)^T l) and l' = kappa [g(y)]^+_l, where [a]^+_l is a, but not negative where l =
0; constraints that belong to some agents alone are priced for these only. Of integrators it is the
flow of Arrow, Hurwicz and Uzawa (Studies in Linear and Non-Linear Programming, 1958), with F for
the gradient: Rosen's weights being equal, its equilibria are the variational ones (Existence and
uniqueness of equilibrium points for concave N-person games, Econometrica 33, 1965).

|y - y*|^2 / k + |l - l*|^2 / kappa does not rise where F is monotone and g convex, and y tends to
the only variational equilibrium where F is strictly monotone; storage functions add up, so that the
same holds of the paper's agents in place of integrators. Nothing keeps y inside meanwhile.

[.]^+ as steps have it: in mode sampled l + T kappa g, not below 0, which is exact for outputs held
over the period T. In mode continuous l' = max(kappa g, -l / h), h the timestep: no multiplier falls
below 0, Euler's method is the projected one, and the flow is [.]^+ up to times of h.

The law's memory: l (p,).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Literal

from pydantic import Field

from gne_mj import game_functions as games
from gne_mj.barrier import weighted_gradient
from gne_mj.controllers.law import Law
from gne_mj.controllers.multipliers import MultiplierLaw, ascend, rising
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.settings import COUNT, GAIN
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS

DUAL_GAIN = COUNT


@dataclass(frozen=True, eq=False)
class PrimalDual(MultiplierLaw):
    """Primal-dual gradient play with shared multipliers.

    Args:
        constraints: p, how many there are.
        gain: k, positive.
        dual_gain: kappa, positive.
    """

    information: ClassVar[str] = "primal-dual"
    promise: ClassVar[str] = "constraints hold in the limit, of what comes before nothing is proven"
    own: ClassVar[tuple[str, ...]] = ("dual_gain",)
    constraints: int
    gain: float = 1.0
    dual_gain: float = 1.0


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from y (m,) and the multipliers; the barrier's weights are not read."""
    data, gain = problem.data, problem.settings[GAIN]
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            cost = game.cost_gradient(data.parameters, i, a, y)
            u[a] = -gain * (cost + weighted_gradient(game, data, i, a, y, memory))
    return -1


@kernel
def rate(problem, y, memory, out):
    """Fill out (p,) with the multipliers' rates."""
    data, gain = problem.data, problem.settings[DUAL_GAIN]
    games.values(data, data.all_constraints, y, out)
    for k in range(len(data.tightening)):
        out[k] = rising(problem, gain * (out[k] + data.tightening[k]), memory[k])


@kernel
def propagate(problem, y, memory, scratch):
    """Move the multipliers over one control period with y held."""
    ascend(problem, problem.settings[DUAL_GAIN], y, memory)


@LAWS.register
class PrimalDualController(LawTable):
    """Gradient play with shared multipliers, a rival"""

    information: Literal["primal-dual"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0, 8.0), "dual_gain": (0.1, 1.0, 5.0, 25.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of the input")
    dual_gain: float = Field(1.0, gt=0, description="kappa of the multipliers' rates")

    def build(self, game: Game) -> Law:
        """The law."""
        return PrimalDual(game.constraints_count, self.gain, self.dual_gain)
