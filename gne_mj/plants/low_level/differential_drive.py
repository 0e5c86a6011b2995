"""A differential drive's controller: a force on the car becomes torques of its two wheels.

With wheels of radius r, w apart, a force F forward and a moment M about the vertical are

    tau_right = r (F/2 + M/w),   tau_left = r (F/2 - M/w)

so that where wheels roll, F v + M omega = tau_right omega_right + tau_left omega_left: the wheels
give the power that the input asks for. At a point l ahead of the axle, F = f . t and M = l f . n,
with the car's own directions t ahead and n to its left; that point's velocity is the output that
goes with f. An input of one entry is F, and M is 0 or holds the heading that it starts with.
"""

import sys
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field

from gne_mj.native import kernel
from gne_mj.plants.low_level.table import Controller, ControllerTable, along, orientation
from gne_mj.registry import LOW_LEVEL
from gne_mj.toml_table import Unit

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot

# q: l, r of the left and of the right wheel (signed by their axes), w, and of the heading's
# holding its stiffness and damping
_AHEAD, _LEFT, _RIGHT, _APART, _STIFF, _DAMP = range(6)


@kernel
def control(q, readings, memory, u, out):
    """Fill out: the torques of the left and the right wheel; readings: R, turning rate."""
    tx, ty = readings[0], readings[3]
    size = np.sqrt(tx * tx + ty * ty)
    tx, ty = tx / size, ty / size
    if len(u) == 1:
        force = u[0]
        # the sine of how far it has turned to the left
        turned = memory[0] * ty - memory[1] * tx
        moment = -q[_STIFF] * turned - q[_DAMP] * readings[9]
    else:
        force = u[0] * tx + u[1] * ty
        moment = q[_AHEAD] * (u[1] * tx - u[0] * ty)
    out[0] = q[_LEFT] * (0.5 * force - moment / q[_APART])
    out[1] = q[_RIGHT] * (0.5 * force + moment / q[_APART])
    return 0


@kernel
def start(q, readings, out):
    """The heading at the start, as a direction."""
    size = np.sqrt(readings[0] ** 2 + readings[3] ** 2)
    out[0], out[1] = readings[0] / size, readings[3] / size


@LOW_LEVEL.register
class DifferentialDriveTable(ControllerTable):
    """A force on a car with two driven wheels: forward, or in the plane at a point ahead."""

    controller: Literal["differential-drive"]
    wheels: list[str] = Field(
        min_length=2, max_length=2, description="actuators of the left and the right wheel's joint"
    )
    site: str | None = Field(
        None, description="the point ahead of the axle that a force in the plane acts at"
    )
    radius: Annotated[float | None, Unit("m")] = Field(
        None, gt=0, description="of the wheels; if left out that of their geoms"
    )
    hold_heading: Annotated[float | None, Unit("rad/s")] = Field(
        None, gt=0, description="of a forward force: how fast the heading at the start is come"
        " back to; not held if left out",
    )  # fmt: skip

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        if axes > 2 or (axes == 2) != (self.site is not None):
            needs = "a site ahead of the axle" if axes == 2 else "no site"
            raise robot.refused(
                "site", self.site, f"an action has {axes} entries: with one give no site, with two"
                f" {needs}" if axes <= 2 else "an action must have one entry or two",
            )  # fmt: skip
        if axes == 2 and self.hold_heading is not None:
            raise robot.refused("hold_heading", self.hold_heading, "a force in the plane turns it")
        model, data = robot.model, robot.data
        joints = [robot.joint_of("wheels", name) for name in self.wheels]
        bodies = [int(model.jnt_bodyid[joint]) for joint in joints]
        car = int(model.body_parentid[bodies[0]])
        if car == 0 or car != model.body_parentid[bodies[1]]:
            raise robot.refused("wheels", self.wheels, "one body must carry both")
        name = robot.name("wheels", "body", car)
        own = robot.axes(car)
        places = [own.T @ (data.xanchor[joint] - data.xpos[car]) for joint in joints]
        apart = float(places[0][1] - places[1][1])
        turning = [float(own[:, 1] @ data.xaxis[joint]) for joint in joints]
        if apart <= 0 or min(map(abs, turning)) < 0.999:
            raise robot.refused(
                "wheels", self.wheels, "they must turn about the car's y axis, x being ahead, and"
                " the first one must be on its left, at the greater y",
            )  # fmt: skip
        ahead = 0.0
        if self.site is not None:
            site = robot.find("site", "site", self.site)
            ahead = float((own.T @ (data.site_xpos[site] - data.xpos[car]) - places[0])[0])
            if ahead == 0.0:
                raise robot.refused("site", self.site, "it must be ahead of the axle")
        radii = [self.radius or robot.round_size("radius", body) for body in bodies]
        stiff = damp = 0.0
        if self.hold_heading is not None:
            turns = robot.yaw_inertia(car)
            stiff, damp = turns * self.hold_heading**2, 2.0 * turns * self.hold_heading
        numbers = [
            ahead, turning[0] * radii[0], turning[1] * radii[1], apart, stiff, damp
        ]  # fmt: skip
        seen = (
            *orientation("body", name),
            *along("velocity", "body", name, angular=True, axes=(2,)),
        )
        return Controller(
            sys.modules[__name__], tuple(self.wheels), seen, np.array(numbers), axes, held=2
        )
