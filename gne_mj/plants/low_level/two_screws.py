"""A boat with two screws: a force on the hull becomes their thrusts.

The force F ahead and the moment M about the vertical through the hull's frame
(:mod:`planar_drive`) are what the two give at their sites: [F, M] = B [T_left, T_right], inverted.
Thrusts along the hull's x give F v + M omega, v being the frame's velocity ahead. Of a force in the
plane at a site, what it asks for sideways is given by turning alone; sway and drag are the hull's.
"""

from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from gne_mj.plants.low_level.planar_drive import PlanarDriveTable
from gne_mj.plants.low_level.table import Controller
from gne_mj.registry import LOW_LEVEL

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot


@LOW_LEVEL.register
class TwoScrewsTable(PlanarDriveTable):
    """A force on a boat's hull: ahead, with a moment, or in the plane at a site ahead."""

    controller: Literal["two-screws"]
    screws: list[str] = Field(
        min_length=2, max_length=2, description="actuators, at sites, whose force is ahead"
    )
    body: str | None = Field(None, description="the hull; if left out what the free joint moves")

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
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
        return self.drive(robot, axes, self.screws, ("body", hull), 0.0, rows)
