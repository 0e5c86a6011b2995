"""Laws of others as objects, to compare with: one function each (docs/rivals.md).

``mode`` is "continuous" or "sampled". None of them has a barrier: rho is not read.
"""

from __future__ import annotations

from gne_mj.arguments import answering
from gne_mj.controllers.primal_dual_play import PrimalDualController
from gne_mj.controllers.table import LawTable
from gne_mj.interface.tables import made


@answering
def primal_dual_play(
    *, gain: float = 1.0, dual_gain: float = 1.0, mode: str = "continuous"
) -> LawTable:
    """Gradient play in which all share the constraints' multipliers.

    u = -k (F(y) + J_g(y)^T l), l' = kappa [g(y)]^+. Constraints hold in the limit.

    Args:
        gain: k.
        dual_gain: kappa.
        mode: when the law is evaluated.
    """
    return made(PrimalDualController, information="primal-dual", **locals())
