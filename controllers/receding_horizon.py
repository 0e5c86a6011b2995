"""A receding-horizon Nash controller: the first input of an open-loop equilibrium over a horizon.

Once a control period the agents' open-loop generalized Nash equilibrium over K knots is found, the
variational one, of the costs sum_j J_i(Y_j) + effort |u_i,j|^2 / 2 under g(Y_j) <= 0, with Y_j the
outputs at the knots' ends that the plant's own map leads to; its first input is applied, and all is
done again (:mod:`gne_mj.controllers.horizon`). All states are known. Bounds of g are soft, by an
exact penalty of slacks: they are kept at the knots of the plan wherever that can be. For quadratic
costs and linear plants and constraints NashLinearMPC of NashOpt is such a controller (Bemporad,
NashOpt, arXiv 2512.23636). Here these are linearised where the last solution leads, and of plants
that are not linear sensitivities are those of the present state.

Where inputs rest at zero it rests at a variational equilibrium: G = 0 at all knots asks for
F + J_g^T l = 0 at each. That the closed loop comes to rest, and keeps the set, is not proven.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Literal

from pydantic import Field

from gne_mj.controllers.horizon import first_input
from gne_mj.controllers.law import Law
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.programs import ProgramLaw, room_of, told
from gne_mj.controllers.settings import COUNT
from gne_mj.controllers.table import HeldTable
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS

KNOTS, PERIODS, EFFORT = range(COUNT, COUNT + 3)
MOST_KNOTS = 100


@dataclass(frozen=True, eq=False)
class RecedingHorizon(ProgramLaw):
    """The first input of an open-loop generalized Nash equilibrium over a horizon.

    Args:
        knots: K.
        periods: how many control periods a knot lasts.
        effort: what inputs cost beside the costs, positive.
    """

    information: ClassVar[str] = "receding-horizon"
    promise: ClassVar[str] = (
        "plans keep bounds at their knots where that can be; of the closed loop nothing is proven"
    )
    knows_plant: ClassVar[bool] = True
    of_period: ClassVar[bool] = True
    own: ClassVar[tuple[str, ...]] = ("knots", "periods", "effort")
    knots: int = 8
    periods: int = 1
    effort: float = 0.1

    def __post_init__(self) -> None:
        for key, most in (("knots", MOST_KNOTS), ("periods", 10**6)):
            value = getattr(self, key)
            if not (1 <= value <= most and value == int(value)):
                raise InvalidInput(key, value, f"it must be a whole number from 1 to {most}")
        super().__post_init__()

    def room(self, game: Game) -> float:
        """A program of all inputs and slacks of a plan; see the base class."""
        return room_of(self.knots * (game.actions + 1), self.knots * game.constraints_count)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); not a number where there is no plan."""
    numbers = problem.settings
    shape = int(numbers[KNOTS]), int(numbers[PERIODS])
    return told(first_input(problem, work, y, shape, numbers[EFFORT], u), u)


@LAWS.register
class RecedingHorizonController(HeldTable):
    """The first input of an open-loop Nash equilibrium over a horizon, a rival"""

    information: Literal["receding-horizon"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"effort": (0.01, 0.1, 1.0), "knots": (4, 8, 16), "periods": (1, 5)}
    )
    knots: int = Field(8, ge=1, le=MOST_KNOTS, description="how many inputs a plan has")
    periods: int = Field(1, ge=1, le=10**6, description="how many control periods each is held")
    effort: float = Field(0.1, gt=0, description="what inputs cost: effort |u_i|^2 / 2 a knot")

    def build(self, game: Game) -> Law:
        """The law."""
        return RecedingHorizon(self.knots, self.periods, self.effort)
