"""Laws of others as objects, to compare with: one function each (docs/rivals.md).

``mode`` is "continuous" or "sampled". None of them has a barrier: rho is not read.
"""

from __future__ import annotations

from gne_mj.arguments import answering
from gne_mj.controllers.feedback_seeking import FeedbackSeekingController
from gne_mj.controllers.l1_penalty import L1PenaltyController
from gne_mj.controllers.primal_dual_partial import PrimalDualPartialController
from gne_mj.controllers.primal_dual_play import PrimalDualController
from gne_mj.controllers.quadratic_penalty import QuadraticPenaltyController
from gne_mj.controllers.recursive_safe_flow import RecursiveSafeFlowController
from gne_mj.controllers.table import LawTable
from gne_mj.interface.laws import Network
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


@answering
def primal_dual_partial(
    graph: Network = "ring",
    *,
    gain: float = 1.0,
    coupling: float = 1.0,
    dual_gain: float = 1.0,
    mode: str = "continuous",
) -> LawTable:
    """The same under partial information: neighbours exchange estimates and multipliers.

    Constraints must be affine, or bounds on both sides of something affine.

    Args:
        graph: over which agents communicate.
        gain: k.
        coupling: c of the estimates.
        dual_gain: kappa.
        mode: when the law is evaluated.
    """
    return made(PrimalDualPartialController, information="primal-dual-partial", **locals())


@answering
def l1_penalty(
    *, gain: float = 1.0, strength: float = 10.0, width: float = 0.1, mode: str = "continuous"
) -> LawTable:
    """Gradient play with an l1 penalty on violations, whose corner is smoothed.

    u = -k (F + s sum_l p(g_l) dg_l), p from 0 at g_l = 0 to 1 at w. Exact but for w, at rest.

    Args:
        gain: k.
        strength: s; it must be above the multipliers.
        width: w, in the constraints' units.
        mode: when the law is evaluated.
    """
    return made(L1PenaltyController, information="l1-penalty", **locals())


@answering
def quadratic_penalty(
    *, gain: float = 1.0, strength: float = 10.0, mode: str = "continuous"
) -> LawTable:
    """Gradient play with a quadratic penalty on violations.

    u = -k (F + s sum_l max(0, g_l) dg_l). At rest violations are of O(1/s).

    Args:
        gain: k.
        strength: s.
        mode: when the law is evaluated.
    """
    return made(QuadraticPenaltyController, information="quadratic-penalty", **locals())


@answering
def recursive_safe_flow(
    *,
    gain: float = 1.0,
    alpha: float = 1.0,
    time_constant: float = 1.0,
    mode: str = "continuous",
) -> LawTable:
    """The recursive safe monotone flow, which approaches constraints no faster than -alpha g.

    u = -k F - J_g^T v, tau v' = [J_g u + alpha g]^+.

    Args:
        gain: k.
        alpha: in 1/s.
        time_constant: tau in s.
        mode: when the law is evaluated.
    """
    return made(RecursiveSafeFlowController, information="recursive-safe-flow", **locals())


@answering
def feedback_seeking(
    *, gain: float = 2.0, seeking: float = 0.3, dual_gain: float = 0.3, mode: str = "sampled"
) -> LawTable:
    """Set-points that follow the Lagrangians' gradients at measured outputs, once a period.

    r+ = Proj(r - T gamma (F + J_g^T l)), l+ = max(0, l + T kappa g), u = k (r - y).

    Args:
        gain: k.
        seeking: gamma in 1/s.
        dual_gain: kappa.
        mode: only "sampled".
    """
    return made(FeedbackSeekingController, information="feedback-seeking", **locals())
