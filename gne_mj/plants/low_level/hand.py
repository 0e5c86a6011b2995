"""An arm's hand: a force at a site in the world's axes becomes torques of the joints that carry it.

    tau = J' f - sum over bodies of J_b' m_b g

with the Jacobians J of the site and J_b of each body's centre, so that f . v = tau_f . q', and at
f = 0 the arm stays where it is. A hinge with the axis a through the point o moves a point p by
a x (p - o), a slide by a; what a joint carries weighs as its whole mass at its centre does.
"""

import sys
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from gne_mj.native import kernel
from gne_mj.plants.low_level.table import Controller, ControllerTable, three
from gne_mj.registry import LOW_LEVEL

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot

# q: for x, y, z the input's entry (-1: none), gravity, then of each joint whether it slides and
# what it carries in kg (0: its weight is not held)
_AXES, _GRAVITY, _JOINTS = 0, 3, 6


@kernel
def control(q, readings, memory, u, out):
    """Fill out (joints,); readings: p, then of each joint a, o and its load's centre."""
    force = (_entry(q, u, 0), _entry(q, u, 1), _entry(q, u, 2))
    gravity = q[_GRAVITY : _GRAVITY + 3]
    for k in range(len(out)):
        joint = readings[3 + 9 * k : 12 + 9 * k]
        slides, mass = q[_JOINTS + 2 * k], q[_JOINTS + 2 * k + 1]
        torque = 0.0
        for axis in range(3):
            n, last = (axis + 1) % 3, (axis + 2) % 3
            move, carried = joint[axis], joint[axis]
            if slides == 0.0:
                move = joint[n] * (readings[last] - joint[3 + last])
                move -= joint[last] * (readings[n] - joint[3 + n])
                carried = joint[n] * (joint[6 + last] - joint[3 + last])
                carried -= joint[last] * (joint[6 + n] - joint[3 + n])
            torque += force[axis] * move - mass * gravity[axis] * carried
        out[k] = torque


@kernel
def _entry(q, u, axis):
    entry = int(q[_AXES + axis])
    return u[entry] if entry >= 0 else 0.0


@LOW_LEVEL.register
class HandTable(ControllerTable):
    """A force at an arm's hand, in the world's axes."""

    controller: Literal["hand"]
    joints: list[str] = Field(
        min_length=1, description="actuators of all hinges and slides that carry the site"
    )
    site: str = Field(description="the hand")
    axes: list[Literal["x", "y", "z"]] | None = Field(
        None, min_length=1, description="of the input's entries; x, y, z if left out"
    )
    hold_weight: bool = Field(True, description="whether the joints also hold the arm's weight")

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        numbers = robot.entries_of_axes(self.axes, axes)
        model = robot.model
        site = robot.find("site", "site", self.site)
        joints = [robot.joint_of("joints", name, slides=True) for name in self.joints]
        carrying = robot.joints_above(int(model.site_bodyid[site]))
        for joint in carrying:
            if joint not in joints:
                name = model.joint(joint).name or f"joint {joint}"
                raise robot.refused(
                    "joints", self.joints, f"'{name}' carries the site as well: name its actuator"
                )
        bodies = [int(model.jnt_bodyid[joint]) for joint in joints]
        numbers += model.opt.gravity.tolist()
        seen = three("site", self.site, "site_xpos")
        for joint, body in zip(joints, bodies, strict=True):
            if joint not in carrying:
                name = model.joint(joint).name
                raise robot.refused("joints", self.joints, f"'{name}' does not carry the site")
            mass = float(model.body_subtreemass[body]) * self.hold_weight
            numbers += [float(robot.slides(joint)), mass]
            name = robot.name("joints", "joint", joint)
            seen += three("joint", name, "xaxis") + three("joint", name, "xanchor")
            seen += three("body", robot.name("joints", "body", body), "subtree_com")
        return Controller(
            sys.modules[__name__], tuple(self.joints), seen, np.array(numbers), axes,
            holds_weight=self.hold_weight,
        )  # fmt: skip
