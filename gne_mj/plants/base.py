"""What every plant offers: measured outputs, and a step under an input held meanwhile."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.plants.agents import Agents


class Plant(ABC):
    """Agents and an engine that moves them.

    Attributes:
        agents: the agents.
        timestep: integration step in s.
        integrator: "rk4" or "euler" (semi-implicit for robots: velocities before positions).
    """

    agents: Agents
    timestep: float
    integrator: str

    @property
    @abstractmethod
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""

    @property
    def output(self) -> NDArray[np.float64]:
        """y, shape (m,)."""
        return self.state[:, self.agents.kind.OUTPUT]

    @abstractmethod
    def reset(self, state: ArrayLike) -> None:
        """Start anew at time 0 from (m, states)."""

    @abstractmethod
    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """Move on by ``steps`` integration steps under the held input u (m,)."""
