"""Safe monotone flow: of all inputs that let no constraint rise too fast, the one nearest to -k F.

u = argmin over xi of |xi + k F(y)|^2 / 2 subject to J_g(y) xi <= -alpha g(y)

Allibhoy and Cortes, Anytime solvers for variational inequalities: the (recursive) safe monotone
flows, arXiv 2311.09527. They make y' = u of it, which is for integrators. Then g' <= -alpha g, so
that the set is kept and approached from outside; where it rests is a variational equilibrium, and
with monotone F and convex g all runs lead there. Of other agents it promises nothing. There is such
an input wherever convex constraints hold at some y_s: alpha (y_s - y) is one.
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
from gne_mj.controllers.programs import ProgramLaw, gradient_play, linearised, nearest_direction
from gne_mj.controllers.settings import COUNT
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel, released, reserved
from gne_mj.quadratic_program import clear, program_in, program_length
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

ALPHA = COUNT


@dataclass(frozen=True, eq=False)
class SafeMonotoneFlow(ProgramLaw):
    """The nearest input to gradient play under which no constraint rises faster than -alpha g.

    Args:
        gain: k, positive.
        alpha: in 1/s, positive.
    """

    information: ClassVar[str] = "safe-monotone-flow"
    promise: ClassVar[str] = (
        "of integrators in continuous time the set is kept and approached from outside, and outputs"
        " tend to a variational equilibrium; of other agents nothing is proven"
    )
    own: ClassVar[tuple[str, ...]] = ("alpha",)
    gain: float = 1.0
    alpha: float = 1.0


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,); not a number where the program has no solution."""
    m, p = len(u), len(problem.data.tightening)
    length = program_length(m, p, 0, 0)
    room = reserved(length + m)
    program, goal = program_in(room, 0, m, p, 0, 0), room[length:]
    clear(program)
    gradient_play(problem, y, goal)
    linearised(problem, y, program.upper, program.matrix)
    for k in range(p):
        program.upper[k] *= -problem.settings[ALPHA]
    left = nearest_direction(problem, program, goal, u)
    released(room)
    return left


@LAWS.register
class SafeMonotoneFlowController(LawTable):
    """The input nearest to -k F under which constraints rise at most as -alpha g, a rival"""

    information: Literal["safe-monotone-flow"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0, 8.0), "alpha": (0.5, 2.0, 8.0, 32.0)}
    )
    gain: float = Field(1.0, gt=0, description="k of gradient play")
    alpha: Annotated[float, Unit("1/s")] = Field(
        1.0, gt=0, description="how fast bounds may be approached"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return SafeMonotoneFlow(self.gain, self.alpha)
