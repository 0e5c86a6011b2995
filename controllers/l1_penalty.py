"""l1 exact penalty: gradient play with a price s on every constraint that is violated.

u = -k (F(y) + s sum_l p(g_l(y)) dg_l), where p rises from 0 to 1 while g_l rises from 0 to a width
w, the gradient of s sum_l max(0, g_l) but for its corner, which is smoothed as Pinar and Zenios do
(On smoothing exact penalty functions for convex constrained optimization, SIAM Journal on
Optimization 4, 1994). Without smoothing it rests at the variational equilibrium for every s above
that one's greatest multiplier (exact penalties of games: Ba and Pang, Exact penalization of
generalized Nash equilibrium problems, arXiv 1811.10674); with it constraints that bind are violated
by w l_l / s < w there. A static law.
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
from gne_mj.controllers.quadratic_penalty import excess, priced
from gne_mj.controllers.rival import Rival
from gne_mj.controllers.settings import COUNT
from gne_mj.controllers.table import LawTable
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.registry import LAWS
from gne_mj.toml_table import Unit

STRENGTH, WIDTH = COUNT, COUNT + 1


@dataclass(frozen=True, eq=False)
class L1Penalty(Rival):
    """Gradient play with an l1 penalty, smoothed.

    Args:
        gain: k, positive.
        strength: s, positive; exact above the greatest multiplier.
        width: w of the smoothing, in the constraints' units, positive.
    """

    information: ClassVar[str] = "l1-penalty"
    promise: ClassVar[str] = (
        "it rests where binding constraints are violated by less than its width, if its strength is"
        " above every multiplier; of what comes before nothing is proven"
    )
    own: ClassVar[tuple[str, ...]] = ("strength", "width")
    gain: float = 1.0
    strength: float = 10.0
    width: float = 0.1


@kernel
def price(game, problem, k, y):
    """s p(g_k)."""
    numbers = problem.settings
    return numbers[STRENGTH] * min(excess(game, problem.data, k, y) / numbers[WIDTH], 1.0)


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from y (m,); the barrier's weights are not read."""
    return priced(price, game, problem, y, u)


@LAWS.register
class L1PenaltyController(LawTable):
    """Gradient play with a smoothed l1 penalty on violations, a rival"""

    information: Literal["l1-penalty"]
    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType(
        {"gain": (0.5, 1.0, 2.0, 4.0), "strength": (3.0, 10.0, 30.0), "width": (0.01, 0.1)}
    )
    gain: float = Field(1.0, gt=0, description="k of the input")
    strength: float = Field(10.0, gt=0, description="s of the penalty")
    width: Annotated[float, Unit("the constraints'")] = Field(
        0.1, gt=0, description="over which the price of a violation rises to s"
    )

    def build(self, game: Game) -> Law:
        """The law."""
        return L1Penalty(self.gain, self.strength, self.width)
