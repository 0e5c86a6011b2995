"""The tables of flexible robots, whose outputs are velocities or positions with a look-ahead."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.plants import flexible_robot, position_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.lookahead import RESERVE, LookaheadKeys
from gne_mj.plants.table import AgentsTable, check_sizes
from gne_mj.registry import AGENTS
from gne_mj.toml_table import PerAgent, Sizes, Unit


class _RobotTable(AgentsTable, LookaheadKeys):
    """Two masses, a spring and a damper [eq:MobileRobot]"""

    axes: ClassVar[int]
    main_mass: Annotated[PerAgent, Unit("kg", "> 0")] = Field(1.0, description="M")
    appendage_mass: Annotated[PerAgent, Unit("kg", "> 0")] = Field(1.0, description="m")
    stiffness: Annotated[PerAgent, Unit("N/m")] = Field(1.0, description="linear part of psi")
    atan_coefficient: Annotated[PerAgent, Unit("N")] = Field(1.0, description="atan part of psi")
    damping: Annotated[PerAgent, Unit("N s/m", ">= 0")] = Field(1.0, description="gamma")
    output: Literal["velocity", "position"] = Field(
        "velocity", description="y: the velocity v, or the position with a look-ahead, q + tau v"
    )
    contacts: bool = Field(
        False, description="whether main masses collide in MuJoCo; contacts are counted then"
    )

    @property
    def positions(self) -> bool:
        """See the base class."""
        return self.output == "position"

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        check_sizes(self.type, self.axes, sizes)  # type: ignore[attr-defined]
        names = flexible_robot.PARAMETERS
        table = self.rows(sizes, *names, positive=("main_mass", "appendage_mass"))
        if np.any(table[:, 4] < 0):
            raise InvalidInput("damping", self.damping, "no entry may be negative")
        if not self.positions:
            self.check_unused("it is for output = 'position'")
            return Agents(flexible_robot, table, self.limits(sizes), self.axes, self.contacts)
        if self.lookahead is None:
            raise InvalidInput("lookahead", None, "output = 'position' needs it, in s")
        tau, reference = np.full(len(table), self.lookahead), self.reference_rows(sizes)
        table = np.column_stack([table, tau, np.zeros(len(table)), reference])
        default = RESERVE * position_robot.least_damping(table)
        if self.local_damping is None and not np.all(np.isfinite(default)):
            raise InvalidInput(
                "local_damping", None, "it must be given where damping = 0: none is proven there"
            )
        table[:, 6] = self.damping_rows(sizes, default)
        return Agents(position_robot, table, self.limits(sizes), self.axes, self.contacts)


@AGENTS.register
class RobotAgents(_RobotTable):
    """Robots on a lane."""

    axes: ClassVar[int] = 1
    type: Literal["flexible-robot"]


@AGENTS.register
class PlanarRobotAgents(_RobotTable):
    """Robots in the plane, with the same masses, spring and damper along both axes."""

    axes: ClassVar[int] = 2
    type: Literal["planar-flexible-robot"]
