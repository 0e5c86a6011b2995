"""What cars and boats share: a wish in the plane becomes a force ahead and a moment, and these two
forces of two actuators.

The input is F, ahead; or F and M, about the vertical; or a force f in the plane at a point l ahead
of the body's frame, F = f . t and M = l f . n, with the body's own directions t ahead and n to its
left. With F alone, M is 0 or holds the heading psi that it starts with, by
M = -k_1 sin(psi - psi_0) - k_2 psi'. The two actuators give what their places make of F and M.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from gne_mj.native import kernel
from gne_mj.plants.low_level.table import Seen, along, orientation

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot

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


def seen(body: str) -> tuple[Seen, ...]:
    """What it reads of a body."""
    turns = along("velocity", "body", body, angular=True, axes=(2,))
    return (*orientation("body", body)[0:4:3], *turns)


def kind_of(
    robot: "Robot", axes: int, site: str | None, hold_heading: float | None
) -> tuple[int, tuple[float, float]]:
    """Which of the three it is; and of a heading that is held w^2 and 2 w, else zeros.

    Raises:
        InvalidInput: the keys do not fit to so many entries; names ``input`` and the key.
    """
    if axes > 2:
        raise robot.refused("controller", f"an action of {axes} entries", "it takes one or two")
    if axes == 1 and site is not None:
        raise robot.refused("site", site, "it is for actions with two entries")
    if axes == 2 and hold_heading is not None:
        raise robot.refused("hold_heading", hold_heading, "it is for actions with one entry")
    kind = (FORWARD, FORCE_AND_MOMENT if site is None else IN_THE_PLANE)[axes - 1]
    rate = hold_heading or 0.0
    return kind, (rate**2, 2.0 * rate)


def ahead_of(robot: "Robot", body: int, site: str | None, origin: float) -> float:
    """l in m: how far a site is ahead of a point on a body's x axis; 0 without one.

    Raises:
        InvalidInput: there is no such site, or it is not ahead; names ``input.site``.
    """
    if site is None:
        return 0.0
    index = robot.find("site", "site", site)
    place: Any = robot.axes(body).T @ (robot.data.site_xpos[index] - robot.data.xpos[body])
    if abs(place[0] - origin) < 1e-9:
        raise robot.refused("site", site, "it must be ahead of where the forces act")
    return float(place[0]) - origin
