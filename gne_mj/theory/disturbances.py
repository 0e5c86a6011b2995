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


def unknown_at_start(system: System) -> NDArray[np.float64]:
    """How far the load at the start can be from what agents take it to be then, (m,)."""
    known = np.zeros(system.game.actions) if system.load is None else system.load
    steady, others = np.zeros((2, system.game.actions))
    for fault in system.faults:
        if not isinstance(fault, Push) or fault.start > 0.0:
            continue
        at = fault.targets(system.game, system.law.graph)
        if fault.profile == "constant":
            steady[at] += fault.force
        elif fault.profile != "sine" or fault.start < 0.0:  # which begins at nothing
            others[at] += abs(fault.force)
    return np.abs(steady - known) + others


def greatest_change(system: System, span: float) -> NDArray[np.float64]:
    """The most that each channel's pushes together change within so many s, (m,)."""
    change = np.zeros(system.game.actions)
    for fault in system.faults:
        if not isinstance(fault, Push):
            continue
        size, jumps = abs(fault.force), fault.start > 0.0 or np.isfinite(fault.end)
        most = 2.0 * size
        if fault.profile == "constant":
            most = size * jumps
        elif fault.profile == "sine" and not jumps:
            most = min(most, 2.0 * np.pi * size * span / fault.period)
        change[fault.targets(system.game, system.law.graph)] += most
    return change


def estimate_error(system: System) -> NDArray[np.float64]:
    """How far faults can shift what others take an action to be, (m,), beside what it has been.

    Own actions are told as they are read, and an estimate that is corrupted spreads.
    """
    corrupted = sum(fault.size for fault in system.faults if isinstance(fault, Corruption))
    return strength(system).noise + corrupted
