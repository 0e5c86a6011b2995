"""A differential drive: a force on the car becomes torques of its two wheels.

With wheels of radius r, w apart, the force F ahead and the moment M (:mod:`planar_drive`) are

    tau_right = r (F/2 + M/w),   tau_left = r (F/2 - M/w)

so that where wheels roll, F v + M omega = tau_right omega_right + tau_left omega_left: the wheels
give the power that the input asks for. M is about the axle's middle.
"""

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field

from gne_mj.plants.low_level.planar_drive import PlanarDriveTable
from gne_mj.plants.low_level.table import Controller
from gne_mj.registry import LOW_LEVEL
from gne_mj.toml_table import Unit

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot


@LOW_LEVEL.register
class DifferentialDriveTable(PlanarDriveTable):
    """A force on a car with two driven wheels: ahead, with a moment, or in the plane at a site."""

    controller: Literal["differential-drive"]
    wheels: list[str] = Field(
        min_length=2, max_length=2, description="actuators of the left and the right wheel's joint"
    )
    radius: Annotated[float | None, Unit("m")] = Field(
        None, gt=0, description="of the wheels; if left out that of their geoms"
    )

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        model, data = robot.model, robot.data
        joints = [robot.joint_of("wheels", name) for name in self.wheels]
        bodies = [int(model.jnt_bodyid[joint]) for joint in joints]
        car = int(model.body_parentid[bodies[0]])
        if car == 0 or car != model.body_parentid[bodies[1]]:
            raise robot.refused("wheels", self.wheels, "one body must carry both")
        own = robot.axes(car)
        left, right = (own.T @ (data.xanchor[joint] - data.xpos[car]) for joint in joints)
        apart = float(left[1] - right[1])
        turning = [float(own[:, 1] @ data.xaxis[joint]) for joint in joints]
        if apart <= 0 or min(map(abs, turning)) < 0.999:
            raise robot.refused(
                "wheels", self.wheels, "they must turn about the car's y axis, x being ahead, and"
                " the first one must be on its left, at the greater y",
            )  # fmt: skip
        radii = [self.radius or robot.round_size("radius", body) for body in bodies]
        rows = [
            side * radius * part
            for side, radius, sign in zip(np.sign(turning), radii, (-1.0, 1.0), strict=True)
            for part in (0.5, sign / apart)
        ]
        axle = float(left[0])
        return self.drive(robot, axes, self.wheels, ("wheels", car), axle, np.array(rows))
