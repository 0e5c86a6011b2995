"""Agents as ordinary differential equations, stepped natively."""

import ctypes
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.native import call
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.functions import METHODS, ROLL, compiled_functions


class Channels(NamedTuple):
    """A group of agents for native code, read-only."""

    parameters: Annotated[np.ndarray, "m, n // m"]  # (m, numbers of the agent type)
    equilibrium_state: Annotated[
        np.ndarray, "m, n // m"
    ]  # (m, states) equilibrium, from which V is measured
    functions: Annotated[np.ndarray, "n", int]  # addresses, see gne_mj.plants.functions
    output: int  # which of a channel's states is its output
    position: int = -1  # and which a position that follows it; -1 without


class OdePlant(Plant):
    """Agents integrated with a fixed step.

    Args:
        agents: which.
        timestep: in s.
        integrator: "rk4" or "euler".
    """

    def __init__(self, agents: Agents, timestep: float, integrator: str = "rk4") -> None:
        self.agents, self.timestep, self.integrator = agents, timestep, integrator
        self._state = np.zeros(agents.channels * agents.states)
        self._scratch = np.zeros(5 * agents.states)
        self._roll = int(compiled_functions(agents.kind)[ROLL])

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""
        return self._state.reshape(self.agents.channels, self.agents.states).copy()

    def reset(self, state: ArrayLike) -> None:
        """See the base class."""
        self._state[:] = np.asarray(state, dtype=np.float64).ravel()

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        agents = self.agents
        inputs = np.ascontiguousarray(np.broadcast_to(u, agents.channels), dtype=np.float64)
        call(
            ctypes.c_int64, self._roll,
            (
                agents.parameters.ctypes.data, agents.channels, METHODS[self.integrator],
                float(self.timestep), steps, self._state.ctypes.data, inputs.ctypes.data,
                self._scratch.ctypes.data,
            ),
        )  # fmt: skip
