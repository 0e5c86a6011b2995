"""What the paper's theorems guarantee for a system, before it is run."""

from gne_mj.theory.constants import Constant, Slopes
from gne_mj.theory.epsilon import EpsilonSearch, search_epsilon
from gne_mj.theory.guarantees import Guarantees, certify
from gne_mj.theory.report_text import report_text
from gne_mj.theory.theorem import Theorem
from gne_mj.theory.trials import PeriodSearch, PushSearch, search_period, search_push
from gne_mj.theory.zero_order_hold import ZeroOrderHold

__all__ = [
    "Constant",
    "EpsilonSearch",
    "Guarantees",
    "PeriodSearch",
    "PushSearch",
    "Slopes",
    "Theorem",
    "ZeroOrderHold",
    "certify",
    "report_text",
    "search_epsilon",
    "search_period",
    "search_push",
]
