"""Fleets of several agent types at once: every channel says which type it is.

The state has the flexible robot's four places; an integrator uses the second one, a PI cascade the
second and third, and what a type does not use stays zero. Channel parameters are the type's code
and the type's own numbers, padded with zeros.
"""

import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput, part_of
from gne_mj.native import kernel
from gne_mj.plants import flexible_robot, integrator, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.plants.robot_tables import PlanarRobotAgents, RobotAgents
from gne_mj.registry import AGENTS
from gne_mj.toml_table import Sizes, Table, dimension_of

NAME = "mixed fleet"
STATES = (
    ("extension", "m, robots"),
    ("output", ""),
    ("second", "appendage velocity of robots in m/s, integral of PI cascades"),
    ("position", "m, robots"),
)
OUTPUT = 1
INPUT_UNIT = "N for robots, else the output's per second"
TYPES: tuple[ModuleType, ...] = (flexible_robot, integrator, pi_cascade)
ROBOT, INTEGRATOR, PI_CASCADE = range(3)
PARAMETERS = ("type", *(f"number_{n}" for n in range(1, 6)))


def join(groups: Sequence[Agents], dimension: int = 1) -> Agents:
    """One fleet of all groups' channels, in their order; so many channels are an agent's."""
    rows = []
    for group in groups:
        block = np.zeros((group.channels, len(PARAMETERS)))
        block[:, 0] = TYPES.index(group.kind)
        block[:, 1 : 1 + group.parameters.shape[1]] = group.parameters
        rows.append(block)
    limits = np.concatenate([group.input_limit for group in groups])
    return Agents(sys.modules[__name__], np.concatenate(rows), limits, dimension)


def by_type(
    parameters: NDArray[np.float64],
) -> list[tuple[ModuleType, NDArray[np.float64]]]:
    """The types that occur, each with the numbers (channels, ...) of its own channels."""
    found: list[tuple[ModuleType, NDArray[np.float64]]] = []
    for code, kind in enumerate(TYPES):
        own = parameters[parameters[:, 0] == code]
        if len(own):
            found.append((kind, own[:, 1 : 1 + len(kind.PARAMETERS)]))
    return found


def is_passive(parameters: NDArray[np.float64]) -> bool:
    """Whether every channel's type meets the assumption; parameters (m, 6)."""
    return all(kind.is_passive(own) for kind, own in by_type(parameters))


@kernel
def rate(q, x, u, out):
    """Fill out with x'."""
    if q[0] == ROBOT:
        flexible_robot.rate(q[1:], x, u, out)
    else:
        out[0] = 0.0
        out[2] = 0.0
        out[3] = 0.0
        if q[0] == INTEGRATOR:
            integrator.rate(q[1:], x[1:2], u, out[1:2])
        else:
            pi_cascade.rate(q[1:], x[1:3], u, out[1:3])


@kernel
def euler_step(q, x, u, h, out):
    """One Euler step, semi-implicit for robots."""
    if q[0] == ROBOT:
        flexible_robot.euler_step(q[1:], x, u, h, out)
    else:
        out[0] = 0.0
        out[2] = 0.0
        out[3] = 0.0
        if q[0] == INTEGRATOR:
            integrator.euler_step(q[1:], x[1:2], u, h, out[1:2])
        else:
            pi_cascade.euler_step(q[1:], x[1:3], u, h, out[1:3])


@kernel
def jacobian(q, x, out):
    """Fill out with df/dx."""
    if q[0] == ROBOT:
        flexible_robot.jacobian(q[1:], x, out)
        return
    for r in range(4):
        for s in range(4):
            out[r, s] = 0.0
    if q[0] == PI_CASCADE:
        pi_cascade.jacobian(q[1:], x[1:3], out[1:3, 1:3])


@kernel
def equilibrium(q, y, out):
    """The state pi(y) that rests at the output y with u = 0."""
    if q[0] == ROBOT:
        flexible_robot.equilibrium(q[1:], y, out)
    else:
        out[0] = 0.0
        out[2] = 0.0
        out[3] = 0.0
        if q[0] == INTEGRATOR:
            integrator.equilibrium(q[1:], y, out[1:2])
        else:
            pi_cascade.equilibrium(q[1:], y, out[1:3])


@kernel
def storage(q, x, equilibrium_state):
    """V^{x*}(x) of the channel's type."""
    if q[0] == ROBOT:
        return flexible_robot.storage(q[1:], x, equilibrium_state)
    if q[0] == INTEGRATOR:
        return integrator.storage(q[1:], x[1:2], equilibrium_state[1:2])
    return pi_cascade.storage(q[1:], x[1:3], equilibrium_state[1:3])


@kernel
def shared(q, x):
    """What both the rate and V need of the channel's type."""
    if q[0] == ROBOT:
        return flexible_robot.shared(q[1:], x)
    return 0.0


@kernel
def rate_given(q, x, u, known, out):
    """As :func:`rate`, with what :func:`shared` returned."""
    if q[0] == ROBOT:
        flexible_robot.rate_given(q[1:], x, u, known, out)
    else:
        rate(q, x, u, out)


@kernel
def storage_given(q, x, equilibrium_state, known):
    """As :func:`storage`, likewise."""
    if q[0] == ROBOT:
        return flexible_robot.storage_given(q[1:], x, equilibrium_state, known)
    return storage(q, x, equilibrium_state)


@AGENTS.register
class MixedAgents(Table):
    """Agents of several types."""

    engine: ClassVar[str] = "ode"
    type: Literal["mixed"]
    groups: list[
        Annotated[
            RobotAgents
            | PlanarRobotAgents
            | integrator.IntegratorAgents
            | pi_cascade.PiCascadeAgents,
            Field(discriminator="type"),
        ]
    ] = Field(min_length=1, description="tables of agents, one behind the other")

    @property
    def count(self) -> int:
        """N."""
        return sum(group.count for group in self.groups)

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        first, built = 0, []
        for index, group in enumerate(self.groups):
            with part_of(f"groups.{index}"):
                if group.positions:
                    raise InvalidInput(
                        "output", "position", "in a mixed fleet robots' outputs are velocities"
                    )
                built.append(group.build(sizes[first : first + group.count]))
            first += group.count
        return join(built, dimension_of(sizes))
