"""Laws beside each other: the same starts, faults and periods, each tuned by the same budget."""

from gne_mj.comparison.comparing import REPLAY, compare
from gne_mj.comparison.report import table

__all__ = ["REPLAY", "compare", "table"]
