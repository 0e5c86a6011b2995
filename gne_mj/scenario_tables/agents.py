"""The tables ``[systems.NAME.agents]``, one a type of agent."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.bounds import MOST_AGENTS
from gne_mj.errors import InvalidInput, part_of
from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.scenario_tables.table import (
    Fills,
    PerAction,
    PerAgent,
    Sizes,
    Table,
    dimension_of,
    per_action,
    per_agent,
)

# Of N a game and a graph are told as well
Count = Annotated[int, Fills("game.agents"), Fills("game.count"), Fills("controller.agents")]


class _AgentsTable(Table):
    count: Count = Field(gt=0, le=MOST_AGENTS, description="N")
    input_limit: PerAction | None = Field(
        None, description="greatest |u| that the actuators deliver; no limit if left out"
    )

    def limits(self, sizes: Sizes) -> NDArray[np.float64]:
        """(m,) limits, infinite where none is given."""
        if self.input_limit is None:
            return np.full(sum(sizes), np.inf)
        limits = per_action("input_limit", self.input_limit, sizes)
        if np.any(limits <= 0):
            raise InvalidInput("input_limit", self.input_limit, "it must be positive")
        return limits

    def rows(self, sizes: Sizes, *names: str, positive: Iterable[str]) -> NDArray[np.float64]:
        """(m, len(names)) parameters, the same for all channels of an agent."""
        columns = [
            per_agent(n, getattr(self, n), self.count, positive=n in positive) for n in names
        ]
        return np.repeat(np.column_stack(columns), sizes, axis=0)


class _RobotTable(_AgentsTable):
    """[eq:MobileRobot]"""

    axes: ClassVar[int]
    main_mass: PerAgent = Field(1.0, description="M in kg, positive")
    appendage_mass: PerAgent = Field(1.0, description="m in kg, positive")
    stiffness: PerAgent = Field(1.0, description="linear part of psi in N/m")
    atan_coefficient: PerAgent = Field(1.0, description="atan part of psi in N")
    damping: PerAgent = Field(1.0, description="gamma in N s/m")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        _check_sizes(self.type, self.axes, sizes)  # type: ignore[attr-defined]
        names = flexible_robot.PARAMETERS
        table = self.rows(sizes, *names, positive=("main_mass", "appendage_mass"))
        if np.any(table[:, 4] < 0):
            raise InvalidInput("damping", self.damping, "no entry may be negative")
        return Agents(flexible_robot, table, self.limits(sizes), self.axes)


class RobotAgents(_RobotTable):
    """Robots on a lane."""

    axes: ClassVar[int] = 1
    type: Literal["flexible-robot"]


class PlanarRobotAgents(_RobotTable):
    """Robots in the plane, with the same masses, spring and damper along both axes."""

    axes: ClassVar[int] = 2
    type: Literal["planar-flexible-robot"]


class IntegratorAgents(_AgentsTable):
    """[eq:int]"""

    type: Literal["integrator"]

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        table = np.zeros((sum(sizes), 0))
        return Agents(integrator, table, self.limits(sizes), dimension_of(sizes))


class PiCascadeAgents(_AgentsTable):
    """[eq:cascadePI]"""

    type: Literal["pi-cascade"]
    decay_rate: PerAgent = Field(1.0, description="v in 1/s")
    integral_gain: PerAgent = Field(0.5, description="k in 1/s, 0 < k < v")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        table = self.rows(sizes, *pi_cascade.PARAMETERS, positive=pi_cascade.PARAMETERS)
        if np.any(table[:, 1] >= table[:, 0]):
            raise InvalidInput(
                "integral_gain",
                self.integral_gain,
                "it must be below decay_rate (0 < k < v)",
            )
        return Agents(pi_cascade, table, self.limits(sizes), dimension_of(sizes))


class MjcfAgents(_AgentsTable):
    """Robots of the user's own."""

    type: Literal["mjcf-robot"]
    file: Annotated[str | list[str], Fills("path")] = Field(
        description="MJCF file, one for all or one each"
    )
    output: str | list[str] = Field(description="joint or velocity sensor that is y_i")
    input: str | list[str] = Field(description="actuator that u_i drives")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of one entry each."""
        _check_sizes(self.type, 1, sizes)
        columns = []
        for key in ("file", "output", "input"):
            given = getattr(self, key)
            each = [given] * self.count if isinstance(given, str) else given
            if len(each) != self.count:
                raise InvalidInput(key, given, f"it must be one name or a list of {self.count}")
            columns.append(each)
        robots = tuple(RobotFile(Path(f), o, i) for f, o, i in zip(*columns, strict=True))
        return mjcf_robots(robots, self.limits(sizes))


class MixedAgents(Table):
    """Agents of several types."""

    type: Literal["mixed"]
    groups: list[
        Annotated[
            RobotAgents | PlanarRobotAgents | IntegratorAgents | PiCascadeAgents,
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
                built.append(group.build(sizes[first : first + group.count]))
            first += group.count
        return mixed.join(built, dimension_of(sizes))


def _check_sizes(kind: str, axes: int, sizes: Sizes) -> None:
    for size in sizes:
        if size != axes:
            raise InvalidInput(
                "type",
                kind,
                f"its agents act along {axes} {'axis' if axes == 1 else 'axes'}, and the game's"
                f" actions have {size}",
            )
