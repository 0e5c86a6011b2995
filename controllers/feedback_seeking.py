"""Online feedback equilibrium seeking: a sampled algorithm for the game of steady states.

An algorithm that would seek the equilibrium of a game gets the outputs that are measured in place
of those that its own iterate would lead to (Belgioioso, Liao-McPherson, Hudoba de Badyn, Bolognani,
Smith, Lygeros and Dorfler, Online feedback equilibrium seeking, IEEE Transactions on Automatic
Control). That is a frame for many algorithms; this one is a projected gradient step of every
Lagrangian, once a control period T, and what it moves are set-points r:

    r+ = Proj_R(r - T gamma (F(y) + J_g(y)^T l)),  l+ = max(0, l + T kappa g(y)),  u = k (r - y).

The plant with the loop u = k (r - y) rests at y = r, for the paper's agents rest with u = 0 at any
y: the sensitivity of its steady state is 1. R are the set-points that ask of no actuator more than
its limit at these outputs, |k (r - y)| <= limit; a period later y is another one. It rests at the
variational equilibrium; to get there it must be slow against the plant's own loop, and constraints
hold in the limit.

The law's memory: l (p,), r (m,).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj import game_functions as games
from gne_mj.controllers.law import Law, MemoryPart
from gne_mj.controllers.multipliers import PERIOD, MultiplierLaw, ascend
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.settings import COUNT, GAIN
from gne_mj.controllers.table import HeldTable
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

SEEKING, DUAL_GAIN = COUNT, COUNT + 1
SET_POINT = MemoryPart("set_point", "outputs that each agent is led to")


@dataclass(frozen=True, eq=False)
class FeedbackSeeking(MultiplierLaw):
    """Set-points that a sampled algorithm moves by measured outputs.

    Args:
        constraints: p, how many there are.
        gain: k of each agent's own loop, positive.
        seeking: gamma, positive.
        dual_gain: kappa, positive.
    """

    information: ClassVar[str] = "feedback-seeking"
    promise: ClassVar[str] = (
        "constraints hold in the limit if it is slow against the agents' own loops; of what comes"
        " before nothing is proven"
    )
    own: ClassVar[tuple[str, ...]] = ("seeking", "dual_gain")
    memory_parts: ClassVar[tuple[MemoryPart, ...]] = (SET_POINT,)
    constraints: int
    gain: float = 2.0
    seeking: float = 0.3
    dual_gain: float = 0.3

    def first_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """l = 0 and r = y; see the base class."""
        return np.append(super().first_memory(y), y)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from y (m,) and the set-points; the barrier's weights are not read."""
    p, gain = len(problem.data.tightening), problem.settings[GAIN]
    for a in range(len(u)):
        u[a] = gain * (memory[p + a] - y[a])
    return -1


@kernel
def propagate(problem, y, memory, scratch):
    """A step of the algorithm, with the outputs y (m,) that it measured."""
    data, numbers, period = problem.data, problem.settings, problem.propagator.numbers[PERIOD]
    at, p = data.offsets, len(data.tightening)
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            slope = games.cost_gradient(data, i, a, y)
            for entry in range(data.own_pointer[i], data.own_pointer[i + 1]):
                k = data.own_index[entry]
                slope += memory[k] * games.constraint_gradient(data, k, a, y)
            reach = problem.limit[a] / numbers[GAIN]
            wanted = memory[p + a] - period * numbers[SEEKING] * slope
            memory[p + a] = min(max(wanted, y[a] - reach), y[a] + reach)
    ascend(problem, numbers[DUAL_GAIN], y, memory)


@LAWS.register
class FeedbackSeekingController(HeldTable):
    """Online feedback equilibrium seeking, a rival for mode sampled"""

    information: Literal["feedback-seeking"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (1.0, 3.0, 10.0), "seeking": (0.3, 1.0), "dual_gain": (0.1, 0.3, 1.0, 3.0)}
    )
    gain: float = Field(2.0, gt=0, description="k of each agent's own loop")
    seeking: Annotated[float, Unit("1/s")] = Field(
        0.3, gt=0, description="gamma of the set-points' steps"
    )
    dual_gain: float = Field(0.3, gt=0, description="kappa of the multipliers' steps")

    def build(self, game: Game) -> Law:
        """The law."""
        return FeedbackSeeking(game.constraints_count, self.gain, self.seeking, self.dual_gain)
