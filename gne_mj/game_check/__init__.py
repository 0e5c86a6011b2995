"""Whether what a game's author wrote agrees with itself: functions, lists and declarations.

A wrong derivative, or an agent left out of a list, leaves a game that runs and certificates that
are wrong. Both are seen at a few profiles strictly inside the set. Games of one's own are looked
at when a system is made of them (:func:`refuse`, a few milliseconds), all of a scenario by
``gne-mj check`` (:func:`examine`).
"""

from gne_mj.game_check.examine import examine, refuse
from gne_mj.game_check.report import Comparison, Report

__all__ = ["Comparison", "Report", "examine", "refuse"]
