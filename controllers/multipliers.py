"""What laws share whose memory has multipliers: they never fall below 0."""

import numpy as np

from gne_mj.controllers.law import MemoryPart
from gne_mj.controllers.propagation import Propagator
from gne_mj.native import kernel

PERIOD = 1  # entry of a propagator's numbers: the control period or, mode continuous, the timestep


def multipliers(constraints: int) -> MemoryPart:
    """A memory's multipliers of so many constraints."""
    return MemoryPart(
        "multiplier", "multipliers of the constraints", dims=("constraint",), shape=(constraints,)
    )


def held_for(period: float) -> Propagator:
    """A propagator that says how long outputs are held, in s."""
    return Propagator(np.zeros((0, 0, 0)), np.zeros(0), np.array([0.0, period, 0.0]))


@kernel
def rising(problem, value, multiplier):
    """[value]^+ at a multiplier: its rate, which takes it to 0 in a timestep at the soonest."""
    return max(value, -multiplier / problem.propagator.numbers[PERIOD])
