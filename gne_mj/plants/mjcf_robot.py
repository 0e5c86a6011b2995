"""A robot that is known by its MJCF alone: one measured velocity, one input.

Such agents run in MuJoCo only. Nothing is known of their storage function, so nothing is claimed
of it; :mod:`gne_mj.passivity` examines them by experiment. Channel parameters: none.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.native import kernel
from gne_mj.plants import mjcf_position
from gne_mj.plants.agents import Agents
from gne_mj.plants.lookahead import LookaheadKeys
from gne_mj.plants.table import AgentsTable, check_sizes
from gne_mj.registry import AGENTS
from gne_mj.toml_table import Fills, Sizes

NAME = "MJCF robot"
PARAMETERS: tuple[str, ...] = ()
STATES = (("output", ""), ("position", "m or rad"))
OUTPUT = 0
INPUT_UNIT = "N or N m"
KNOWS_STORAGE = False
FLEET = "gne_mj.plants.mjcf_fleet"


@dataclass(frozen=True)
class RobotFile:
    """One robot of a fleet.

    Args:
        path: its MJCF file.
        output: name of the joint (slide or hinge) or of the velocity sensor (jointvel, tendonvel
            or actuatorvel) that is the output y_i.
        input: name of the actuator whose force u_i is, at the joint or tendon that it drives; at
            an ``actuatorvel`` sensor of its own the force before the gear.
    """

    path: Path
    output: str
    input: str


@dataclass(frozen=True, eq=False)
class MjcfRobots(Agents):
    """A fleet of a user's own robots, which may differ from each other.

    Args:
        robots: one an agent.
    """

    robots: tuple[RobotFile, ...] = ()

    def repeated(self, copies: int) -> Self:
        """See the base class."""
        return replace(super().repeated(copies), robots=self.robots * copies)


def mjcf_robots(robots: tuple[RobotFile, ...], input_limit: np.ndarray) -> MjcfRobots:
    """The fleet, with the greatest |u| (N,) that the actuators deliver, infinite for no limit."""
    module = sys.modules[__name__]
    return MjcfRobots(module, np.zeros((len(robots), 0)), input_limit, robots=robots)


def is_passive(parameters: NDArray[np.float64]) -> bool:
    """Not known."""
    return False


@kernel
def equilibrium(q, y, out):
    """The output y; the position is free."""
    out[0] = y
    out[1] = 0.0


@kernel
def storage(q, x, equilibrium_state):
    """Not known: nothing is measured."""
    return 0.0


@AGENTS.register
class MjcfAgents(AgentsTable, LookaheadKeys):
    """Robots of the user's own; with a lookahead their outputs are positions."""

    engine: ClassVar[str] = "mujoco"
    type: Literal["mjcf-robot"]
    file: Annotated[str | list[str], Fills("path")] = Field(
        description="MJCF file, one for all or one each"
    )
    output: str | list[str] = Field(
        description="joint or velocity sensor that is y_i; the joint of y = q + tau v"
    )
    input: str | list[str] = Field(description="actuator that u_i drives")

    @property
    def positions(self) -> bool:
        """See the base class."""
        return self.lookahead is not None

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of one entry each."""
        check_sizes(self.type, 1, sizes)
        columns = []
        for key in ("file", "output", "input"):
            given = getattr(self, key)
            each = [given] * self.count if isinstance(given, str) else given
            if len(each) != self.count:
                raise InvalidInput(key, given, f"it must be one name or a list of {self.count}")
            columns.append(each)
        robots = tuple(RobotFile(Path(f), o, i) for f, o, i in zip(*columns, strict=True))
        if self.lookahead is None:
            self.check_unused("it is for robots with a lookahead, whose outputs are positions")
            return mjcf_robots(robots, self.limits(sizes))
        tau = np.full(len(robots), self.lookahead)
        columns_of = tau, self.damping_rows(sizes, None), self.reference_rows(sizes)
        return MjcfRobots(
            mjcf_position, np.column_stack(columns_of), self.limits(sizes), robots=robots
        )
