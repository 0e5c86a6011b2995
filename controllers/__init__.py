"""Feedback laws, one information structure a file."""

from gne_mj.controllers.full_information import FullInformation
from gne_mj.controllers.fully_distributed import FullyDistributed
from gne_mj.controllers.law import Law
from gne_mj.controllers.partial_information import PartialInformation
from gne_mj.controllers.plain_law import PlainLaw
from gne_mj.controllers.primal_dual_play import PrimalDual

__all__ = [
    "FullInformation",
    "FullyDistributed",
    "Law",
    "PartialInformation",
    "PlainLaw",
    "PrimalDual",
]
