"""Feedback laws, one information structure a file."""

from gne_mj.controllers.cbf_filter import CbfFilter
from gne_mj.controllers.cbf_filter_discrete import DiscreteCbfFilter
from gne_mj.controllers.feedback_seeking import FeedbackSeeking
from gne_mj.controllers.full_information import FullInformation
from gne_mj.controllers.fully_distributed import FullyDistributed
from gne_mj.controllers.l1_penalty import L1Penalty
from gne_mj.controllers.law import Law
from gne_mj.controllers.partial_information import PartialInformation
from gne_mj.controllers.plain_law import PlainLaw
from gne_mj.controllers.primal_dual_partial import PrimalDualPartial
from gne_mj.controllers.primal_dual_play import PrimalDual
from gne_mj.controllers.projected_gradient import ProjectedGradient
from gne_mj.controllers.quadratic_penalty import QuadraticPenalty
from gne_mj.controllers.receding_horizon import RecedingHorizon
from gne_mj.controllers.recursive_safe_flow import RecursiveSafeFlow
from gne_mj.controllers.safe_monotone_flow import SafeMonotoneFlow

__all__ = [
    "CbfFilter",
    "DiscreteCbfFilter",
    "FeedbackSeeking",
    "FullInformation",
    "FullyDistributed",
    "L1Penalty",
    "Law",
    "PartialInformation",
    "PlainLaw",
    "PrimalDual",
    "PrimalDualPartial",
    "ProjectedGradient",
    "QuadraticPenalty",
    "RecedingHorizon",
    "RecursiveSafeFlow",
    "SafeMonotoneFlow",
]
