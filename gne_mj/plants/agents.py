"""A group of agents of one type: what has state, and knows nothing of games and controllers."""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from types import ModuleType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput
from gne_mj.native import compiled, source_key
from gne_mj.plants.agent_type import has_ode, knows_storage


@dataclass(frozen=True, eq=False)
class Agents:
    """Agents of one type, as m channels of one output and one input each.

    Args:
        kind: module that describes a channel (:mod:`gne_mj.plants.integrator` says how).
        parameters: (m, numbers of the type), one row a channel.
        input_limit: (m,) greatest |u| that the actuators deliver, infinite for no limit.
        dimension: channels of each agent; all channels are numbered agent by agent.
        contacts: whether bodies of different agents collide, in MuJoCo.
        standing: (m, states) where they start if nothing is said of it; None for at rest at the
            game's own outputs.
    """

    kind: ModuleType
    parameters: NDArray[np.float64]
    input_limit: NDArray[np.float64]
    dimension: int = 1
    contacts: bool = False
    standing: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        width = len(self.kind.PARAMETERS)
        parameters = np.array(self.parameters, dtype=np.float64)
        if parameters.ndim != 2 or parameters.shape[1] != width:
            raise InvalidInput(
                "parameters", parameters.shape, f"its shape must be (channels, {width})"
            )
        if self.dimension < 1 or len(parameters) % self.dimension:
            raise InvalidInput(
                "dimension",
                self.dimension,
                f"it must be positive and divide the {len(parameters)} channels",
            )
        limit = np.array(self.input_limit, dtype=np.float64)
        if limit.shape != parameters.shape[:1] or not np.all(limit > 0):
            raise InvalidInput(
                "input_limit", limit, f"it must be {len(parameters)} positive numbers"
            )
        parameters.flags.writeable = limit.flags.writeable = False
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "input_limit", limit)

    @property
    def channels(self) -> int:
        """m."""
        return len(self.parameters)

    @property
    def count(self) -> int:
        """N."""
        return self.channels // self.dimension

    @property
    def states(self) -> int:
        """States of a channel."""
        return len(self.kind.STATES)

    def repeated(self, copies: int) -> Self:
        """The same agents ``copies`` times in a row, each by itself: without contacts."""
        return replace(
            self,
            contacts=False,
            standing=None,
            parameters=np.tile(self.parameters, (copies, 1)),
            input_limit=np.tile(self.input_limit, copies),
        )

    def stood(self, timestep: float, integrator: str) -> Self:
        """The same, knowing where they start if a simulator has to find out.

        Args:
            timestep: of a run, in s.
            integrator: of it.
        """
        return self

    def among(self, channels: NDArray[np.bool_]) -> Self:
        """The agents of these channels, (m,)."""
        return replace(
            self, parameters=self.parameters[channels], input_limit=self.input_limit[channels]
        )

    @cached_property
    def mobility(self) -> NDArray[np.float64] | None:
        """dy'/du of each channel, shape (m,), as 1/M of a robot; None where no ODE is known."""
        if not has_ode(self.kind):
            return None
        return input_columns(self.kind, self.parameters)[:, self.kind.OUTPUT]

    @property
    def knows_storage(self) -> bool:
        """Whether the type has a storage function; without one, ``storage`` is zero."""
        return knows_storage(self.kind)

    def equilibrium(self, y: ArrayLike) -> NDArray[np.float64]:
        """pi(y): the states (m, states) that rest at the outputs y (m,) with u = 0."""
        y = np.ascontiguousarray(y, dtype=np.float64)
        if y.shape != (self.channels,):
            raise ValueError(f"y must be ({self.channels},), not {y.shape}")
        out = np.zeros((self.channels, self.states))
        _native(self.kind)[0](self.parameters, y, out)
        return out

    def storage(self, state: ArrayLike, equilibrium_state: ArrayLike) -> NDArray[np.float64]:
        """V^{x*} of each channel; states (..., m, states), equilibrium (m, states): (..., m)."""
        shape = (self.channels, self.states)
        state = np.ascontiguousarray(state, dtype=np.float64)
        equilibrium_state = np.ascontiguousarray(equilibrium_state, dtype=np.float64)
        if state.shape[-2:] != shape or equilibrium_state.shape != shape:
            raise ValueError(f"states must be (..., {shape[0]}, {shape[1]}), not {state.shape}")
        out = np.empty(state.shape[:-1])
        rows = state.reshape(-1, *shape)
        _native(self.kind)[1](
            self.parameters, rows, equilibrium_state, out.reshape(len(rows), self.channels)
        )
        return out


def input_columns(kind: ModuleType, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """G of each channel, shape (m, states): x' is affine in u, with constant G."""
    columns = np.zeros((len(parameters), len(kind.STATES)))
    origin = np.zeros(len(kind.STATES))
    for q, column in zip(parameters, columns, strict=True):
        without = np.zeros_like(origin)
        kind.rate(q, origin, 0.0, without)
        kind.rate(q, origin, 1.0, column)
        column -= without
    columns.flags.writeable = False
    return columns


@cache
def _native(kind: ModuleType) -> tuple[Any, Any]:
    source = source_key(kind)

    @compiled
    def equilibrium(parameters, y, out):
        _ = source
        for r in range(len(out)):
            kind.equilibrium(parameters[r], y[r], out[r])

    @compiled
    def storage(parameters, state, equilibrium_state, out):
        _ = source
        for sample in range(len(out)):
            for r in range(out.shape[1]):
                out[sample, r] = kind.storage(parameters[r], state[sample, r], equilibrium_state[r])

    return equilibrium, storage
