"""What the paper's theorems guarantee for a system, before it is run."""

from gne_mj.theory.constants import Constant, Slopes
from gne_mj.theory.epsilon import EpsilonSearch, search_epsilon
from gne_mj.theory.guarantees import Guarantees, certify
from gne_mj.theory.held import Held
from gne_mj.theory.theorem import Theorem
from gne_mj.theory.trials import PeriodSearch, PushSearch, search_period, search_push
from gne_mj.theory.words import words

__all__ = [
    "Constant",
    "EpsilonSearch",
    "Guarantees",
    "Held",
    "PeriodSearch",
    "PushSearch",
    "Slopes",
    "Theorem",
    "certify",
    "search_epsilon",
    "search_period",
    "search_push",
    "words",
]
