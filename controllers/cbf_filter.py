"""Gradient play through a safety filter that knows the plant: a control barrier function's program.

u = argmin of |u + k F(y)|^2 / 2 subject to J_g(y) (a(x) + B u) <= -alpha g(y), |u| <= limit

with y' = a(x) + B u the agents' own equations and all states known: of a flexible robot a is what
spring and damper do to the main mass, B = 1/M. Outputs have relative degree one, so that g is the
barrier function as it stands (Ames, Xu, Grizzle and Tabuada, Control barrier function based
quadratic programs for safety critical systems, IEEE TAC 62(8), 2017). Then g' <= -alpha g: in
continuous time the set is kept and approached from outside, as long as there is such an input and
the plant is what its equations say. Without limits of actuators there is one wherever convex
constraints hold at some y_s: the one that makes y' = alpha (y_s - y). Where there is none,
constraints are soft (:data:`gne_mj.quadratic_program.WEIGHT`) and limits are kept.

Inputs are weighed alike, whatever the agents' masses: where B is not the same for all, it rests
at another equilibrium than the variational one, or at none.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gne_mj.controllers.law import Law
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import rate as rate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.plant_model import output_rates
from gne_mj.controllers.programs import ProgramLaw, give, gradient_play, linearised, solver_in
from gne_mj.controllers.settings import COUNT
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel, released, reserved
from gne_mj.quadratic_program import QUADRATIC, clear, program_in, program_length, solve
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

ALPHA = COUNT


@dataclass(frozen=True, eq=False)
class CbfFilter(ProgramLaw):
    """The nearest input to gradient play under which, by the plant's equations, g' <= -alpha g.

    Args:
        gain: k, positive.
        alpha: in 1/s, positive.
    """

    information: ClassVar[str] = "cbf-filter"
    promise: ClassVar[str] = (
        "in continuous time the set is kept where its program has a solution, by agents that are"
        " what their equations say; where it rests may be no equilibrium"
    )
    knows_plant: ClassVar[bool] = True
    own: ClassVar[tuple[str, ...]] = ("alpha",)
    gain: float = 1.0
    alpha: float = 1.0


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); not a number where the program has no solution."""
    m, p, numbers, limit = len(u), len(problem.data.tightening), problem.settings, problem.limit
    length = program_length(m, p, m, 0)
    room = reserved(length + 3 * m)
    program, goal = program_in(room, 0, m, p, m, 0), room[length : length + m]
    drift, push = room[length + m : length + 2 * m], room[length + 2 * m :]
    clear(program)
    gradient_play(problem, y, goal)
    output_rates(problem, work, y, drift, push)
    values = program.upper[m:]
    linearised(problem, y, values, program.matrix)
    for k in range(p):  # the unknown is u - goal
        bound = -numbers[ALPHA] * values[k]
        for a in range(m):
            slope = program.matrix[k, a]
            bound -= slope * (drift[a] + push[a] * goal[a])
            program.matrix[k, a] = slope * push[a]
        values[k] = bound
    for a in range(m):
        program.lower[a], program.upper[a] = -limit[a] - goal[a], limit[a] - goal[a]
    left = give(program, solve(solver_in(problem), program, QUADRATIC), goal, u)
    released(room)
    return left


@LAWS.register
class CbfFilterController(LawTable):
    """Gradient play through a CBF-QP safety filter that knows the plant, a rival"""

    information: Literal["cbf-filter"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0, 8.0), "alpha": (0.5, 2.0, 8.0, 32.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of gradient play")
    alpha: Annotated[float, Unit("1/s")] = Field(
        1.0, gt=0, description="how fast bounds may be approached"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return CbfFilter(self.gain, self.alpha)
