"""What cars and boats share: a wish in the plane becomes a force ahead and a moment, and these two
forces of two actuators.

The input is F, ahead; or F and M, about the vertical; or a force f in the plane at a point l ahead
of the body's frame, F = f . t and M = l f . n, with the body's own directions t ahead and n to its
left. With F alone, M is 0 or holds the heading psi that it starts with, by
M = -k_1 sin(psi - psi_0) - k_2 psi'. The two actuators give what their places make of F and M.
"""

import sys
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.native import kernel
from gne_mj.plants.low_level.table import Controller, ControllerTable, along, orientation
from gne_mj.toml_table import Unit

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot

Array = NDArray[np.float64]

FORWARD, FORCE_AND_MOMENT, IN_THE_PLANE = range(3)
# q: which of these, l, k_1, k_2, then what the actuators give for F and M, a row of two each
_KIND, _AHEAD, _STIFF, _DAMP, _ROWS = range(5)


@kernel
def control(q, readings, memory, u, out):
    """Fill out (2,); readings: the body's x in the world's x and y, and its turning rate."""
    tx, ty = readings[0], readings[1]
    size = np.sqrt(tx * tx + ty * ty)
    tx, ty = tx / size, ty / size
    force, moment = u[0], 0.0
    if q[_KIND] == FORWARD:
        moment = -q[_STIFF] * (memory[0] * ty - memory[1] * tx) - q[_DAMP] * readings[2]
    elif q[_KIND] == FORCE_AND_MOMENT:
        moment = u[1]
    else:
        force = u[0] * tx + u[1] * ty
        moment = q[_AHEAD] * (u[1] * tx - u[0] * ty)
    for k in range(2):
        out[k] = q[_ROWS + 2 * k] * force + q[_ROWS + 2 * k + 1] * moment


@kernel
def start(q, readings, out):
    """The heading at the start, as a direction."""
    size = np.sqrt(readings[0] ** 2 + readings[1] ** 2)
    out[0], out[1] = readings[0] / size, readings[1] / size


class PlanarDriveTable(ControllerTable):
    """What the tables of both have: a site, and a heading that is held."""

    site: str | None = Field(
        None, description="ahead of where the forces act, at which a force in the plane acts"
    )
    hold_heading: Annotated[float | None, Unit("rad/s")] = Field(
        None, gt=0, description="of a force ahead alone: how fast it comes back to the heading that"
        " it starts with; not held if left out",
    )  # fmt: skip

    def drive(
        self, robot: "Robot", axes: int, actuators: list[str], body: tuple[str, int],
        origin: float, rows: Array,
    ) -> Controller:  # fmt: skip
        """The controller.

        Args:
            robot: its file.
            axes: entries of the input.
            actuators: the two.
            body: the key that says it, and the body that they drive.
            origin: in m, where on its x axis the forces act.
            rows: (2, 2) what each actuator gives for F and M.

        Raises:
            InvalidInput: keys do not fit to so many entries, the site is not there or not ahead, or
                the body has no name; names ``input`` and the key.
        """
        key, index = body
        kind, ahead = self._kind(robot, axes), self._ahead(robot, index, origin)
        inertia, rate = robot.yaw_inertia(index), self.hold_heading or 0.0
        numbers = [kind, ahead, inertia * rate**2, inertia * 2.0 * rate, *rows.ravel()]
        name = robot.name(key, "body", index)
        turns = along("velocity", "body", name, angular=True, axes=(2,))
        seen = (*orientation("body", name)[0:4:3], *turns)
        return Controller(
            sys.modules[__name__], tuple(actuators), seen, np.array(numbers), axes, held=2
        )

    def _kind(self, robot: "Robot", axes: int) -> int:
        """Which of the three inputs it is.

        Raises:
            InvalidInput: the keys do not fit to so many entries; names ``input`` and the key.
        """
        if axes > 2:
            entries = f"an action of {axes} entries"
            raise robot.refused("controller", entries, "it takes one or two")
        if axes == 1 and self.site is not None:
            raise robot.refused("site", self.site, "it is for actions with two entries")
        if axes == 2 and self.hold_heading is not None:
            raise robot.refused(
                "hold_heading", self.hold_heading, "it is for actions with one entry"
            )
        return (FORWARD, FORCE_AND_MOMENT if self.site is None else IN_THE_PLANE)[axes - 1]

    def _ahead(self, robot: "Robot", body: int, origin: float) -> float:
        """l in m: how far the site is ahead of where the forces act; 0 without one."""
        if self.site is None:
            return 0.0
        index = robot.find("site", "site", self.site)
        place: Any = robot.axes(body).T @ (robot.data.site_xpos[index] - robot.data.xpos[body])
        if abs(place[0] - origin) < 1e-9:
            raise robot.refused("site", self.site, "it must be ahead of where the forces act")
        return float(place[0]) - origin
