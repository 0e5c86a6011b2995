"""Modes: how the law's inputs are found and how long they act, one mode a file.

In the order in which reports and exit maps have them; plug-ins register others.
"""

from gne_mj.registry import MODES
from gne_mj.system.modes.continuous import Continuous
from gne_mj.system.modes.implicit import Implicit
from gne_mj.system.modes.mode import Figure, Mode, mode_of
from gne_mj.system.modes.sampled import Sampled

__all__ = ["Continuous", "Figure", "Implicit", "Mode", "Sampled", "mode_of"]

for _mode in (Continuous(), Sampled(), Implicit()):
    MODES.register(_mode)
