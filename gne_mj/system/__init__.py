"""One game with its agents, law, engine and start, checked; and the clock that it runs on."""

from gne_mj.system.clock import Clock
from gne_mj.system.modes import mode_of
from gne_mj.system.system import System

__all__ = ["Clock", "System", "mode_of"]
