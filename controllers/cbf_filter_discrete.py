"""The safety filter in discrete time: what is kept is g at the end of the control period.

u = argmin of |u + k F(y)|^2 / 2 subject to g_l(y+(u)) <= (1 - alpha) g_l(y), |u| <= limit

with y+ the plant's own map over the coming period, all states known: the discrete-time barrier
condition of Agrawal and Sreenath (Discrete control barrier functions for safety-critical control
of discrete systems with application to bipedal robot navigation, RSS 2017). From one control
instant to the next no -g falls by more than its part alpha, so that the set is kept, and approached
from outside, wherever there is such an input and the plant is what its map says. Without limits of
actuators there is one for convex constraints that hold at some y_s: what leads to
y + alpha (y_s - y). Between instants nothing is promised. Neither g nor y+ need be affine
(:mod:`gne_mj.controllers.held_program`). Where there is no such input constraints are soft, and
limits are kept.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Literal

from pydantic import Field

from gne_mj import game_functions as games
from gne_mj.controllers.held_program import nearest
from gne_mj.controllers.law import Law
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.programs import ProgramLaw, gradient_play, told
from gne_mj.controllers.settings import COUNT
from gne_mj.controllers.table import HeldTable
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.native import kernel, released, reserved
from gne_mj.registry import LAWS

ALPHA = COUNT


@dataclass(frozen=True, eq=False)
class DiscreteCbfFilter(ProgramLaw):
    """The nearest input to gradient play that leads to g(y+) <= (1 - alpha) g(y).

    Args:
        gain: k, positive.
        alpha: the part of a slack that a period may use up, above 0 and at most 1.
    """

    information: ClassVar[str] = "discrete-cbf-filter"
    promise: ClassVar[str] = (
        "the set is kept at control instants where its program has a solution, by agents that are"
        " what their equations say; where it rests may be no equilibrium"
    )
    knows_plant: ClassVar[bool] = True
    of_period: ClassVar[bool] = True
    own: ClassVar[tuple[str, ...]] = ("alpha",)
    gain: float = 1.0
    alpha: float = 0.1

    def __post_init__(self) -> None:
        if not 0 < self.alpha <= 1:
            raise InvalidInput("alpha", self.alpha, "it must be above 0 and at most 1")
        super().__post_init__()


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); not a number where the last program has no solution."""
    m, data = len(u), problem.data
    room = reserved(m + len(data.tightening))
    goal, bound = room[:m], room[m:]
    gradient_play(problem, y, goal)
    games.values(data, data.all_constraints, y, bound)
    for k in range(len(bound)):  # of g + t, t the barrier's margin
        bound[k] = (1.0 - problem.settings[ALPHA]) * (bound[k] + data.tightening[k])
    left = told(nearest(problem, work, y, 0.0, goal, bound, u), u)
    released(room)
    return left


@LAWS.register
class DiscreteCbfFilterController(HeldTable):
    """Gradient play through a CBF-QP filter for a control period that knows the plant, a rival"""

    information: Literal["discrete-cbf-filter"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0, 8.0), "alpha": (0.02, 0.1, 0.3, 1.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of gradient play")
    alpha: float = Field(
        0.1, gt=0, le=1, description="the part of a slack that a period may use up"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return DiscreteCbfFilter(self.gain, self.alpha)
