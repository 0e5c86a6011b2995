"""Laws of others that solve a program at each instant, as objects (docs/rivals.md).

They come with the extra ``arena``. ``mode`` is "continuous" or "sampled".
"""

from __future__ import annotations

from gne_mj.arguments import answering
from gne_mj.controllers.cbf_filter import CbfFilterController
from gne_mj.controllers.cbf_filter_discrete import DiscreteCbfFilterController
from gne_mj.controllers.projected_gradient import ProjectedGradientController
from gne_mj.controllers.receding_horizon import RecedingHorizonController
from gne_mj.controllers.safe_monotone_flow import SafeMonotoneFlowController
from gne_mj.controllers.table import LawTable
from gne_mj.interface.tables import made


@answering
def safe_monotone_flow(
    *, gain: float = 1.0, alpha: float = 1.0, mode: str = "continuous"
) -> LawTable:
    """The input nearest to gradient play under which constraints rise at most as -alpha g.

    Args:
        gain: k of gradient play, u = -k F.
        alpha: in 1/s.
        mode: when the law is evaluated.
    """
    return made(SafeMonotoneFlowController, information="safe-monotone-flow", **locals())


@answering
def cbf_filter(*, gain: float = 1.0, alpha: float = 1.0, mode: str = "continuous") -> LawTable:
    """Gradient play through a safety filter that knows the plant: g' <= -alpha g by its equations.

    Args:
        gain: k of gradient play, u = -k F.
        alpha: in 1/s.
        mode: when the law is evaluated.
    """
    return made(CbfFilterController, information="cbf-filter", **locals())


@answering
def discrete_cbf_filter(
    *, gain: float = 1.0, alpha: float = 0.1, mode: str = "sampled"
) -> LawTable:
    """The same for a control period: g <= (1 - alpha) g at its end, by the plant's own map.

    Args:
        gain: k of gradient play, u = -k F.
        alpha: the part of a slack that a period may use up, at most 1.
        mode: "sampled".
    """
    return made(DiscreteCbfFilterController, information="discrete-cbf-filter", **locals())


@answering
def projected_gradient(
    *, gain: float = 1.0, recovery: float = 10.0, mode: str = "continuous"
) -> LawTable:
    """Gradient play, projected on the directions that lead not outside, or on the set itself.

    Args:
        gain: k of gradient play, u = -k F.
        recovery: mode continuous: how fast outputs come back that are outside, in 1/s.
        mode: when the law is evaluated; in "sampled" u = (Proj(y - T k F) - y) / T.
    """
    return made(ProjectedGradientController, information="projected-gradient", **locals())


@answering
def receding_horizon(
    *, knots: int = 8, periods: int = 1, effort: float = 0.1, mode: str = "sampled"
) -> LawTable:
    """The first input of an open-loop generalized Nash equilibrium over a horizon.

    Args:
        knots: how many inputs a plan has.
        periods: for how many control periods each of them is held.
        effort: what inputs cost: effort |u_i|^2 / 2 at each knot.
        mode: "sampled".
    """
    return made(RecedingHorizonController, information="receding-horizon", **locals())
