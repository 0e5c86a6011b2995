"""What the paper's theorems guarantee for a system, before it is run."""

from gne_mj.theory.constants import Constant, Slopes
from gne_mj.theory.epsilon import EpsilonSearch, search_epsilon
from gne_mj.theory.guarantees import Guarantees, Theorem, certify
from gne_mj.theory.words import words

__all__ = [
    "Constant",
    "EpsilonSearch",
    "Guarantees",
    "Slopes",
    "Theorem",
    "certify",
    "search_epsilon",
    "words",
]
