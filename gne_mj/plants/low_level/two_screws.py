"""A boat with two screws: a force on the hull becomes their thrusts.

The force F ahead and the moment M about the vertical through the hull's frame
(:mod:`planar_drive`) are what the two give at their sites: [F, M] = B [T_left, T_right], inverted.
Thrusts along the hull's x give F v + M omega, v being the frame's velocity ahead. Of a force in the
plane at a site, what it asks for sideways is given by turning alone; sway and drag are the hull's.
"""

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field

from gne_mj.plants.low_level import planar_drive
from gne_mj.plants.low_level.table import Controller, ControllerTable
from gne_mj.registry import LOW_LEVEL
from gne_mj.toml_table import Unit

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot


@LOW_LEVEL.register
class TwoScrewsTable(ControllerTable):
    """A force on a boat's hull: ahead, with a moment, or in the plane at a site ahead."""

    controller: Literal["two-screws"]
    screws: list[str] = Field(
        min_length=2, max_length=2, description="actuators, at sites, whose force is ahead"
    )
    body: str | None = Field(None, description="the hull; if left out what the free joint moves")
    site: str | None = Field(
        None, description="ahead of the hull's frame, at which a force in the plane acts"
    )
    hold_heading: Annotated[float | None, Unit("rad/s")] = Field(
        None, gt=0, description="of a force ahead alone: how fast it comes back to the heading that"
        " it starts with; not held if left out",
    )  # fmt: skip

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        kind, holding = planar_drive.kind_of(robot, axes, self.site, self.hold_heading)
        hull = robot.free_body("body", self.body)
        wrenches = np.column_stack(
            [robot.wrench("screws", name, hull, np.zeros(3)) for name in self.screws]
        )
        thrust, moment = wrenches[0], wrenches[5]
        aside = np.max(np.abs(wrenches[1]))
        if np.min(thrust) <= 0 or aside > 0.01 * np.min(thrust):
            raise robot.refused(
                "screws", self.screws, "their force must be ahead, along the hull's x"
            )
        if abs(moment[0] / thrust[0] - moment[1] / thrust[1]) < 1e-6:
            raise robot.refused("screws", self.screws, "one must be on the left of the other")
        rows = np.linalg.inv(np.array([thrust, moment]))
        ahead = planar_drive.ahead_of(robot, hull, self.site, 0.0)
        inertia = robot.yaw_inertia(hull)
        numbers = np.array([kind, ahead, *(inertia * gain for gain in holding), *rows.ravel()])
        body = robot.name("body", "body", hull)
        return Controller(
            planar_drive, tuple(self.screws), planar_drive.seen(body), numbers, axes, held=2
        )
