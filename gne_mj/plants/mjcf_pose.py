"""Where each robot of a fleet stands: its pose, declared, and what it is beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from gne_mj.errors import InvalidInput, part_of
from gne_mj.toml_table import Table, Unit

if TYPE_CHECKING:
    import mujoco

APART = 2.0  # m between robots, so that they do not touch


@dataclass(frozen=True)
class Pose:
    """Where the world of a robot's file lies in the fleet's.

    Args:
        position: of its origin, in m.
        quaternion: its unit quaternion, w first.
    """

    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)


class PoseTable(Table):
    """Where an agent's robot stands."""

    position: Annotated[list[float], Unit("m")] = Field(
        [0.0, 0.0, 0.0], min_length=3, max_length=3, description="of its file's origin"
    )
    yaw: Annotated[float | None, Unit("rad")] = Field(
        None, description="turned about the vertical, from x to y"
    )
    quaternion: Annotated[list[float] | None, Unit("")] = Field(
        None, min_length=4, max_length=4, description="turned so, w first, in place of a yaw"
    )

    def pose(self) -> Pose:
        """As data.

        Raises:
            InvalidInput: two turns, or a quaternion of length 0.
        """
        if self.quaternion is None:
            half = 0.5 * (self.yaw or 0.0)
            return Pose(tuple(self.position), (float(np.cos(half)), 0.0, 0.0, float(np.sin(half))))
        if self.yaw is not None:
            raise InvalidInput("yaw", self.yaw, "give it or a quaternion")
        size = float(np.linalg.norm(self.quaternion))
        if not size > 0.0:
            raise InvalidInput("quaternion", self.quaternion, "its length must not be 0")
        return Pose(tuple(self.position), tuple(part / size for part in self.quaternion))


def poses_of(given: Sequence[PoseTable | list[float]], count: int) -> tuple[Pose, ...]:
    """One an agent, where a list is a position.

    Raises:
        InvalidInput: another number of them, or numbers that are no pose; names ``poses``.
    """
    if len(given) != count:
        raise InvalidInput("poses", f"{len(given)} of them", f"there must be {count}, one an agent")
    found = []
    for i, each in enumerate(given):
        if isinstance(each, list):
            if len(each) != 3:
                raise InvalidInput(
                    "poses", each, f"that of agent {i + 1} must be a table, or a list of x, y, z"
                )
            each = PoseTable(position=each)
        with part_of(f"poses.{i}"):
            found.append(each.pose())
    return tuple(found)


def beside(count: int, spacing: float) -> tuple[Pose, ...]:
    """So many robots beside each other along y, ``spacing`` (m) from one to the next."""
    return tuple(Pose((0.0, spacing * i, 0.0)) for i in range(count))


def repeated(poses: tuple[Pose, ...], copies: int) -> tuple[Pose, ...]:
    """Of so many fleets beside each other along y."""
    across = [pose.position[1] for pose in poses]
    width = max(across) - min(across) + APART
    return tuple(
        Pose((x, y + copy * width, z), pose.quaternion)
        for copy in range(copies)
        for pose in poses
        for x, y, z in [pose.position]
    )


def check_leaves(
    model: mujoco.MjModel, data: mujoco.MjData, dof: int, agent: int, pose: Pose
) -> None:
    """Refuse a pose along, or turning, a slide joint whose position is an output.

    Where robots are along it is what they decide, each from the same place.

    Args:
        model, data: of the fleet, positions evaluated.
        dof: the joint's degree of freedom.
        agent: from 0.
        pose: its robot's.

    Raises:
        InvalidInput: names ``agents.poses``.
    """
    import mujoco  # which reading a scenario does not need

    joint = model.dof_jntid[dof]
    if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_SLIDE:
        return
    axis, unturned = data.xaxis[joint], np.empty(3)
    back = np.array(pose.quaternion) * [1.0, -1.0, -1.0, -1.0]
    mujoco.mju_rotVecQuat(unturned, axis, back)
    if abs(axis @ pose.position) > 1e-9 or np.max(np.abs(axis - unturned)) > 1e-9:
        name = model.joint(joint).name.partition("/")[2]
        raise InvalidInput(
            "agents.poses", list(pose.position),
            f"the position of joint '{name}' says where agent {agent + 1} is along it: leave that"
            " out of its pose, and do not turn it",
        )  # fmt: skip
