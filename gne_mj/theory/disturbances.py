"""What a system's faults do at most, to agents, their sensors and what they take others to do."""

import numpy as np
from numpy.typing import NDArray

from gne_mj.faults import Bias, Corruption, Noise, Push, sensor_delay
from gne_mj.margins import Disturbance
from gne_mj.system import System


def strength(system: System) -> Disturbance:
    """The most that faults do at once, each channel's pushes and sensor errors added up."""
    push, noise = np.zeros((2, system.game.actions))
    for fault in system.faults:
        if isinstance(fault, Push):
            at = fault.targets(system.game, system.law.graph)
            push[at] += abs(fault.force)
        elif isinstance(fault, Noise | Bias):
            at = fault.targets(system.game, system.law.graph)
            noise[at] += abs(fault.size)
    return Disturbance(push, noise, sensor_delay(system.faults))


def estimate_error(system: System) -> NDArray[np.float64]:
    """How far faults can shift what others take an action to be, (m,), beside what it has been.

    Own actions are told as they are read, and an estimate that is corrupted spreads.
    """
    corrupted = sum(fault.size for fault in system.faults if isinstance(fault, Corruption))
    return strength(system).noise + corrupted
