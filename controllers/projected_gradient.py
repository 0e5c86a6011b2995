"""Projected gradient play: gradient play that the set itself stops.

In mode continuous u is the projection of -k F(y) on the cone of directions that lead not outside,
the classical projected dynamical system (Nagurney and Zhang, Projected dynamical systems and
variational inequalities with applications, 1996), for y' = u:

u = argmin over xi of |xi + k F(y)|^2 / 2 subject to J_g,l(y) xi <= -r max(g_l(y), 0)

for the constraints that bind, g_l(y) >= 0. The source's is on the boundary only, where it does not
ask for r. An integrator's step ends a little beyond a bound that it meets; there, and wherever a
run goes on outside, outputs come back at the rate r. In mode sampled it is the projection
algorithm of variational inequalities (Facchinei and Pang, Finite-dimensional variational
inequalities and complementarity problems, 2003, chapter 12):

u = (Proj_Y(y - T k F(y)) - y) / T, with the control period T

so that an integrator is at that projection a period later. It keeps all bounds of g, curved ones
too (:mod:`gne_mj.controllers.held_program`).

Of integrators both keep the set, but for what a step takes to meet a bound, in mode sampled at
every instant. They rest at variational equilibria; the flow leads there for strictly monotone F,
the algorithm for T k < 2 mu / L^2, F strongly monotone by mu and Lipschitz by L. Of other agents
nothing is promised.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gne_mj.controllers.held_program import nearest
from gne_mj.controllers.law import Law
from gne_mj.controllers.multipliers import PERIOD, held_for
from gne_mj.controllers.no_memory import propagate as propagate
from gne_mj.controllers.no_memory import rate as rate
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.programs import (
    ProgramLaw,
    gradient_play,
    linearised,
    nearest_direction,
    told,
)
from gne_mj.controllers.propagation import Propagator
from gne_mj.controllers.settings import COUNT
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.graph import GraphData
from gne_mj.native import kernel, released, reserved
from gne_mj.quadratic_program import UNBOUNDED, clear, program_in, program_length
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

TOUCHES = 1e-9  # a constraint binds from here, in its own unit, since rounding must not free it

RECOVERY = COUNT


@dataclass(frozen=True, eq=False)
class ProjectedGradient(ProgramLaw):
    """Gradient play, projected.

    Args:
        gain: k, positive.
        recovery: r in 1/s, positive; mode continuous.
    """

    information: ClassVar[str] = "projected-gradient"
    promise: ClassVar[str] = (
        "of integrators the set is kept, but for what a step takes to meet a bound, and outputs"
        " tend to a variational equilibrium for strictly monotone F; of others nothing is proven"
    )
    of_period: ClassVar[bool] = True
    own: ClassVar[tuple[str, ...]] = ("recovery",)
    gain: float = 1.0
    recovery: float = 10.0

    def propagator(self, period: float, lists: GraphData | None = None) -> Propagator:
        """How long an input is held; see the base class."""
        return held_for(period)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,): a period's if inputs are held; not a number where there is none."""
    m, p = len(u), len(problem.data.tightening)
    room = reserved(m + p)
    goal, bound, period = room[:m], room[m:], problem.propagator.numbers[PERIOD]
    gradient_play(problem, y, goal)
    if period > 0.0:
        for k in range(p):
            bound[k] = 0.0
        left = told(nearest(problem, work, y, period, goal, bound, u), u)
    else:
        left = along(problem, y, goal, u)
    released(room)
    return left


@kernel
def along(problem, y, goal, u):
    """Fill u (m,) with the direction nearest to goal (m,) that leads not outside; what an
    action returns."""
    m, p, recovery = len(u), len(problem.data.tightening), problem.settings[RECOVERY]
    room = reserved(program_length(m, p, 0, 0))
    program = program_in(room, 0, m, p, 0, 0)
    clear(program)
    linearised(problem, y, program.upper, program.matrix)
    for k in range(p):
        value = program.upper[k]
        program.upper[k] = -recovery * max(value, 0.0) if value >= -TOUCHES else UNBOUNDED
    left = nearest_direction(problem, program, goal, u)
    released(room)
    return left


@LAWS.register
class ProjectedGradientController(LawTable):
    """Gradient play, projected on the set, a rival"""

    information: Literal["projected-gradient"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0, 8.0), "recovery": (1.0, 3.0, 10.0, 30.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of gradient play")
    recovery: Annotated[float, Unit("1/s")] = Field(
        10.0, gt=0, description="mode continuous: how fast outputs come back that are outside"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return ProjectedGradient(self.gain, self.recovery)
