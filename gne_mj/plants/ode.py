"""Agents as ordinary differential equations, stepped natively."""

from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.native import compiled, kernel, source_key
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant

EULER, RK4 = 0, 1
METHODS = {"euler": EULER, "rk4": RK4}


class Channels(NamedTuple):
    """A group of agents for native code, read-only."""

    parameters: np.ndarray  # (m, numbers of the agent type)
    rest: np.ndarray  # (m, states) equilibrium, from which V is measured


@kernel
def held_step(agent, parameters, states, method, h, state, u, scratch):
    """Move all channels by one step under the held input u (m,): the plant's discrete map.

    state is flat, channel after channel; scratch has at least 5 * states entries.
    """
    k1, k2 = scratch[:states], scratch[states : 2 * states]
    k3, k4 = scratch[2 * states : 3 * states], scratch[3 * states : 4 * states]
    trial = scratch[4 * states : 5 * states]
    for r in range(len(u)):
        q, x = parameters[r], state[r * states : (r + 1) * states]
        if method == EULER:
            agent.euler_step(q, x, u[r], h, trial)
            for s in range(states):
                x[s] = trial[s]
        else:
            agent.rate(q, x, u[r], k1)
            for s in range(states):
                trial[s] = x[s] + 0.5 * h * k1[s]
            agent.rate(q, trial, u[r], k2)
            for s in range(states):
                trial[s] = x[s] + 0.5 * h * k2[s]
            agent.rate(q, trial, u[r], k3)
            for s in range(states):
                trial[s] = x[s] + h * k3[s]
            agent.rate(q, trial, u[r], k4)
            for s in range(states):
                x[s] += h / 6.0 * (k1[s] + 2.0 * k2[s] + 2.0 * k3[s] + k4[s])


@cache
def _native(agent: ModuleType) -> Any:
    source = source_key(agent)

    @compiled
    def run(parameters, states, method, h, state, u, steps, scratch):
        _ = source
        for _step in range(steps):
            held_step(agent, parameters, states, method, h, state, u, scratch)

    return run


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

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""
        return self._state.reshape(self.agents.channels, self.agents.states).copy()

    def reset(self, state: ArrayLike) -> None:
        """See the base class."""
        self._state[:] = np.asarray(state, dtype=np.float64).ravel()

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        _native(self.agents.kind)(
            self.agents.parameters,
            self.agents.states,
            METHODS[self.integrator],
            self.timestep,
            self._state,
            np.ascontiguousarray(np.broadcast_to(u, self.agents.channels), dtype=np.float64),
            steps,
            self._scratch,
        )
