"""Positions with a look-ahead as outputs: what is the same for all agents that have them.

Such an agent's output is y = q + tau v, q being its position and v its velocity, both relative to a
reference that moves at a constant v_0. Since q' = (y - q)/tau, a position stays in every convex set
that holds it at the start and the output always (docs/positions.md). The agent's own damping acts
beside its input: the force at its joint is u - d v.
"""

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.toml_table import PerAgent, Sizes, Table, Unit, per_agent

Array = NDArray[np.float64]

RESERVE = 1.2  # a damping that is not given, over the least that is proven


class LookaheadKeys(Table):
    """The keys of agents whose outputs are positions.

    Attributes:
        lookahead: tau, the same for all, since sets that couple agents are kept only then.
    """

    lookahead: Annotated[float | None, Unit("s")] = Field(
        None, gt=0, description="tau of y = q + tau v, one for all agents"
    )
    local_damping: Annotated[PerAgent | None, Unit("N s/m", ">= 0")] = Field(
        None,
        description="d: the force at an agent's joint is u - d v; for outputs that are positions",
    )
    reference_velocity: Annotated[float | list[float] | None, Unit("m/s")] = Field(
        None, description="v_0, to which q and v are relative, likewise; in the plane a vector"
    )

    def check_unused(self, expected: str) -> None:
        """Refuse these keys where outputs are velocities."""
        for key in LookaheadKeys.model_fields:
            if getattr(self, key) is not None:
                raise InvalidInput(key, getattr(self, key), expected)

    def damping_rows(self, sizes: Sizes, default: Array | None) -> Array:
        """(m,) d of each channel.

        Args:
            sizes: entries of each agent's action.
            default: (m,) where none is given; None where one must be.
        """
        if self.local_damping is None:
            if default is None:
                raise InvalidInput(
                    "local_damping",
                    None,
                    "it must be given: of these robots no least one is known",
                )
            return default
        damping = per_agent("local_damping", self.local_damping, len(sizes))
        if np.any(damping < 0):
            raise InvalidInput("local_damping", self.local_damping, "no entry may be negative")
        return np.repeat(damping, sizes)

    def reference_rows(self, sizes: Sizes) -> Array:
        """(m,) v_0 of each channel."""
        given = 0.0 if self.reference_velocity is None else self.reference_velocity
        axes = np.atleast_1d(np.asarray(given, dtype=np.float64))
        if len(axes) == 1 and not isinstance(given, list):
            axes = np.repeat(axes, sizes[0])
        if len(axes) != sizes[0]:
            raise InvalidInput(
                "reference_velocity", given, f"it must be one number or a list of {sizes[0]}"
            )
        return np.tile(axes, len(sizes))


def velocity(tau: Array, output: Array, position: Array) -> Array:
    """v of outputs and positions (..., m), tau being (m,)."""
    found: Array = (output - position) / tau
    return found


def start(
    tau: Array, rest: Array, given: Mapping[str, Array], at: tuple[int, int]
) -> tuple[Array, Array]:
    """Where agents start: states with outputs and positions, and velocities (m,) in m/s.

    Args:
        tau: (m,) in s.
        rest: (m, states) at rest at the default or given outputs.
        given: which of ``action``, ``position`` and ``velocity`` are given, each (m,): two say the
            third, and what only one leaves open rests.
        at: the columns of output and position.

    Raises:
        InvalidInput: all three are given.
    """
    if len(given.keys() & {"action", "position", "velocity"}) == 3:
        raise InvalidInput(
            "velocity", given["velocity"].tolist(), "action and position say what it is"
        )
    output, position = at
    state = rest.copy()
    moving = given.get("velocity", np.zeros(len(tau)))
    if "position" in given:
        state[:, position] = given["position"]
        if "action" in given:
            moving = velocity(tau, state[:, output], given["position"])
        else:
            state[:, output] = given["position"] + tau * moving
    else:
        state[:, position] = state[:, output] - tau * moving
    return state, moving
