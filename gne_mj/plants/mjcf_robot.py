"""A robot that is known by its MJCF alone: for each of its axes a measured velocity and an input.

Such agents run in MuJoCo only. Nothing is known of their storage function, so nothing is claimed
of it; :mod:`gne_mj.passivity` examines them by experiment. Channel parameters: none.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field

from gne_mj.errors import InvalidInput, named
from gne_mj.native import kernel
from gne_mj.plants import mjcf_position
from gne_mj.plants.agents import Agents
from gne_mj.plants.lookahead import LookaheadKeys
from gne_mj.plants.low_level.table import Controlled, InputGiven
from gne_mj.plants.mjcf_input import Input, inputs_of
from gne_mj.plants.mjcf_output import Output, OutputTable, channels_of
from gne_mj.plants.mjcf_pose import APART, Pose, PoseTable, beside, poses_of, repeated
from gne_mj.plants.mjcf_source import located
from gne_mj.plants.table import AgentsTable, check_sizes
from gne_mj.registry import AGENTS
from gne_mj.toml_table import Fills, Sizes, Unit, dimension_of

NAME = "MJCF robot"
PARAMETERS: tuple[str, ...] = ()
STATES = (("output", ""), ("position", "m or rad"))
OUTPUT = 0
INPUT_UNIT = "N or N m"
KNOWS_STORAGE = False
FLEET = "gne_mj.plants.mjcf_fleet"


@dataclass(frozen=True)
class RobotFile:
    """One robot of a fleet, along one of its axes.

    Args:
        path: its MJCF file.
        output: y_i: the name of a joint (slide or hinge) or of a sensor of one velocity, or a
            declared one.
        input: what u_i drives: the name of the actuator whose force it is, at the joint or tendon
            that it drives (at an ``actuatorvel`` sensor of its own the force before the gear), or
            a declared one; or that a low-level controller takes it.
    """

    path: Path
    output: str | Output
    input: str | Input | Controlled


@dataclass(frozen=True, eq=False)
class MjcfRobots(Agents):
    """A fleet of a user's own robots, which may differ from each other.

    Args:
        robots: one a channel; those of an agent name the same file.
        together: whether all are put at one place, since their positions are what they decide;
            else beside each other.
        poses: of each agent's robot; empty where ``together`` or ``spacing`` say them.
        spacing: in m from one to the next, then.
        terrain: a file that they stand on; None for the floors of their own files.
        touching: which contacts there are, see :func:`gne_mj.plants.mjcf_contacts.let_touch`.
        keyframes: of each agent's file the one that it starts in; None for the file's pose.
        settle: in s, how long they come to rest before they start; 0 for not at all.
    """

    robots: tuple[RobotFile, ...] = ()
    together: bool = False
    poses: tuple[Pose, ...] = ()
    spacing: float = APART
    terrain: Path | None = None
    touching: str = "all"
    keyframes: tuple[str | None, ...] = ()
    settle: float = 0.0

    @property
    def world(self) -> tuple[object, ...]:
        """What tells their model from others of the same kind."""
        start = self.keyframes, self.settle, self.parameters.tobytes() if self.settle else b""
        return self.robots, self.places, self.terrain, self.touching, *start

    def stood(self, timestep: float, integrator: str) -> Self:
        """See the base class: a keyframe says it, and settling."""
        if not (any(self.keyframes) or self.settle):
            return self
        from gne_mj.plants.mjcf_fleet import MjcfPlant  # which knows this module

        return replace(self, standing=MjcfPlant(self, timestep, integrator).standing)

    @property
    def places(self) -> tuple[Pose, ...]:
        """Where each agent's robot is attached."""
        return self.poses or beside(self.count, 0.0 if self.together else self.spacing)

    @property
    def files(self) -> tuple[RobotFile, ...]:
        """One an agent."""
        return self.robots[:: self.dimension]

    def one(self, agent: int) -> Self:
        """That agent, from 0, by itself, where and as it starts."""
        own, only = (
            slice(agent * self.dimension, (agent + 1) * self.dimension),
            slice(agent, agent + 1),
        )
        return replace(
            self, robots=self.robots[own], parameters=self.parameters[own],
            input_limit=self.input_limit[own], poses=self.poses[only],
            keyframes=self.keyframes[only],
        )  # fmt: skip

    def repeated(self, copies: int) -> Self:
        """See the base class; several copies are put beside each other.

        Raises:
            InvalidInput: on a terrain, which is another ground there.
        """
        if self.terrain is not None and copies > 1:
            raise InvalidInput(
                "agents.terrain", str(self.terrain), "trials put copies of a fleet beside each"
                " other, where it is another ground: leave it out of them",
            )  # fmt: skip
        poses = repeated(self.poses, copies) if self.poses else ()
        return replace(
            super().repeated(copies), robots=self.robots * copies, poses=poses,
            keyframes=self.keyframes * copies,
            together=self.together and copies == 1,
        )  # fmt: skip


def mjcf_robots(robots: tuple[RobotFile, ...], input_limit: np.ndarray) -> MjcfRobots:
    """The fleet of one axis each, with the greatest |u| (N,), infinite for no limit."""
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

    model_config = ConfigDict(defer_build=True)  # controllers may register after this module

    engine: ClassVar[str] = "mujoco"
    type: Literal["mjcf-robot"]
    file: Annotated[str | list[str], Fills("path")] = Field(
        description="MJCF file, one for all or one each; or a package's, as gne_mj:car.xml,"
        " dm_control:walker, gymnasium:ant, menagerie:unitree_go2"
    )
    output: str | OutputTable | list[str | OutputTable] | list[list[str | OutputTable]] = Field(
        description="joint or velocity sensor that is y_i, or of y = q + tau v; or a table that"
        " says what; of vectors a list of these, for all agents or each"
    )
    input: str | InputGiven | list[str | InputGiven] | list[list[str | InputGiven]] = Field(
        description="actuator that u_i drives, or a table of several, of a force at a body, or of a"
        " low-level controller; likewise"
    )

    spacing: Annotated[float | None, Unit("m")] = Field(
        None, ge=0, description="along y from one robot to the next; 2 if left out"
    )
    poses: list[PoseTable | list[float]] | None = Field(
        None, description="in place of a spacing: of each agent's robot, or lists of x, y, z"
    )
    terrain: str | None = Field(
        None, description="MJCF file of what they stand on, in place of their own files' floors"
    )
    keyframe: str | list[str] | None = Field(
        None, description="of their files that they start in, one for all or one each"
    )
    settle: Annotated[float | None, Unit("s")] = Field(
        None, gt=0, le=1000, description="how long they come to rest before, under inputs of zero"
    )
    contacts: Literal["all", "floor", "agents", "none"] = Field(
        "all",
        description="of robots with the floor and each other, as files say; or but one of these",
    )

    @property
    def positions(self) -> bool:
        """See the base class."""
        return self.lookahead is not None

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        axes = dimension_of(sizes)
        check_sizes(self.type, axes, sizes)
        files = [self.file] * self.count if isinstance(self.file, str) else self.file
        if len(files) != self.count:
            raise InvalidInput("file", self.file, f"it must be one name or a list of {self.count}")
        outputs = channels_of(self.output, self.count, axes)
        inputs = inputs_of(self.input, self.count, axes)
        channels = zip(np.repeat(files, axes), outputs, inputs, strict=True)
        robots = tuple(
            RobotFile(located(str(path)), output, input) for path, output, input in channels
        )
        kind, numbers = sys.modules[__name__], np.zeros((len(robots), 0))
        if self.positions:
            tau = np.full(len(robots), self.lookahead)
            parts = tau, self.damping_rows(sizes, None), self.reference_rows(sizes)
            kind, numbers = mjcf_position, np.column_stack(parts)
        else:
            self.check_unused("it is for robots with a lookahead, whose outputs are positions")
        if self.spacing is not None and (self.positions or self.poses is not None):
            say = "with a lookahead positions" if self.positions else "poses"
            raise InvalidInput("spacing", self.spacing, f"{say} say where they are")
        return MjcfRobots(
            kind, numbers, self.limits(sizes), axes, robots=robots, together=self.positions,
            poses=() if self.poses is None else poses_of(self.poses, self.count),
            spacing=APART if self.spacing is None else self.spacing, touching=self.contacts,
            terrain=self._terrain, keyframes=self._keyframes, settle=self._settle(numbers),
            contacts=self.contacts in ("all", "agents"),
        )  # fmt: skip

    @property
    def _keyframes(self) -> tuple[str | None, ...]:
        found: tuple[str | None, ...] = (
            tuple(self.keyframe)
            if isinstance(self.keyframe, list)
            else (self.keyframe,) * self.count
        )
        if len(found) != self.count:
            raise InvalidInput(
                "keyframe", self.keyframe, f"it must be one name or a list of {self.count}"
            )
        return found

    def _settle(self, numbers: NDArray[np.float64]) -> float:
        if self.settle is not None and self.positions and np.any(numbers[:, 2]):
            raise InvalidInput(
                "settle", self.settle, "agents come to rest, and reference_velocity moves theirs"
            )
        return self.settle or 0.0

    @property
    def _terrain(self) -> Path | None:
        with named(file="terrain"):
            return None if self.terrain is None else located(self.terrain)
