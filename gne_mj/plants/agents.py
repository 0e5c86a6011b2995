"""A group of agents of one type: what has state, and knows nothing of games and controllers."""

from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.native import compiled, source_key


@dataclass(frozen=True, eq=False)
class Agents:
    """Agents of one type, as m channels of one output and one input each.

    Args:
        kind: module that describes a channel (:mod:`gne_mj.plants.integrator` says how).
        parameters: (m, numbers of the type), one row a channel.
        input_limit: (m,) greatest |u| that the actuators deliver, infinite for no limit.
    """

    kind: ModuleType
    parameters: NDArray[np.float64]
    input_limit: NDArray[np.float64]

    @property
    def channels(self) -> int:
        """m."""
        return len(self.parameters)

    @property
    def states(self) -> int:
        """States of a channel."""
        return len(self.kind.STATES)

    def equilibrium(self, y: ArrayLike) -> NDArray[np.float64]:
        """pi(y): the states (m, states) that rest at the outputs y (m,) with u = 0."""
        return self._each(_native(self.kind)[0], y)

    def storage(self, state: ArrayLike, rest: ArrayLike) -> NDArray[np.float64]:
        """V^{x*} of each channel; states (..., m, states), equilibrium (m, states): (..., m)."""
        state = np.ascontiguousarray(state, dtype=np.float64)
        out = np.empty(state.shape[:-1])
        rows = state.reshape(-1, self.channels, self.states)
        rest = np.ascontiguousarray(rest, dtype=np.float64)
        _native(self.kind)[1](self.parameters, rows, rest, out.reshape(len(rows), self.channels))
        return out

    def _each(self, native: Any, y: ArrayLike) -> NDArray[np.float64]:
        out = np.zeros((self.channels, self.states))
        native(self.parameters, np.ascontiguousarray(y, dtype=np.float64), out)
        return out


@cache
def _native(kind: ModuleType) -> tuple[Any, Any]:
    source = source_key(kind)

    @compiled
    def equilibrium(parameters, y, out):
        _ = source
        for r in range(len(out)):
            kind.equilibrium(parameters[r], y[r], out[r])

    @compiled
    def storage(parameters, state, rest, out):
        _ = source
        for sample in range(len(out)):
            for r in range(out.shape[1]):
                out[sample, r] = kind.storage(parameters[r], state[sample, r], rest[r])

    return equilibrium, storage
