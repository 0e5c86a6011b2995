"""What laws share whose memory has multipliers: they never fall below 0."""

import numpy as np
from numpy.typing import NDArray

from gne_mj import game_functions as games
from gne_mj.controllers.law import MemoryPart
from gne_mj.controllers.propagation import Propagator
from gne_mj.controllers.rival import Rival
from gne_mj.graph import GraphData
from gne_mj.native import kernel

PERIOD = 1  # entry of a propagator's numbers: the control period or, mode continuous, the timestep


class MultiplierLaw(Rival):
    """A rival whose memory begins with the multipliers (p,) that all agents share, 0 at the start.

    Attributes:
        constraints: p, how many there are.
    """

    constraints: int

    def __post_init__(self) -> None:
        super().__post_init__()
        shared = MemoryPart(
            "multiplier", "multipliers of the constraints", dims=("constraint",),
            shape=(self.constraints,),
        )  # fmt: skip
        vars(self).update(memory_parts=(shared, *type(self).memory_parts))

    def first_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """See the base class."""
        return np.zeros(self.constraints)

    def propagator(self, period: float, lists: GraphData | None = None) -> Propagator:
        """See the base class."""
        return held_for(period)

    def step_propagator(self, timestep: float) -> Propagator:
        """See the base class."""
        return held_for(timestep)


def held_for(period: float) -> Propagator:
    """A propagator that says how long outputs are held, in s."""
    return Propagator(np.zeros((0, 0, 0)), np.zeros(0), np.array([0.0, period, 0.0]))


@kernel
def rising(problem, value, multiplier):
    """[value]^+ at a multiplier: its rate, which takes it to 0 in a timestep at the soonest."""
    return max(value, -multiplier / problem.propagator.numbers[PERIOD])


@kernel
def ascend(problem, gain, y, memory):
    """Move the multipliers that a memory begins with over one control period with y (m,) held."""
    data, period = problem.data, problem.propagator.numbers[PERIOD]
    for k in range(len(data.tightening)):
        value = games.constraint(data, k, y) + data.tightening[k]
        memory[k] = max(memory[k] + period * gain * value, 0.0)
