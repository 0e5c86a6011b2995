"""A quadrotor's controller: a force in the world's axes becomes an attitude and thrusts.

After Lee, Leok and McClamroch (2010), "Geometric tracking control of a quadrotor UAV on SE(3)",
49th IEEE Conference on Decision and Control, with a desired attitude that is taken to stand still:

    F = u + m g z,   b_3 = F / |F|,   b_2 ~ b_3 x (cos psi, sin psi, 0),   b_1 = b_2 x b_3
    R_d = [b_1, b_2, b_3],   e_R = 1/2 (R_d^T R - R^T R_d)^,   T = F . R z
    M = -J (w_n^2 e_R + 2 zeta w_n w) + w x J w

The rotors give thrust T and moment M by least squares. Along an axis that the input does not have
the place at the start is held, F = -m (k^2 (p - p_0) + 2 k v), and so is the heading psi.
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

COUNTS_LIMITS = True
LEAST_LIFT = 0.2  # part of the weight that F has upwards at least
# q: mass, weight, tan of the greatest tilt, w_n, zeta, k, for x, y, z the input's entry (-1: held)
_MASS, _WEIGHT, _TILT, _FREQUENCY, _DAMPING, _HOLD, _AXES = 0, 1, 2, 3, 4, 5, 6
_INERTIA, _MIXER = 9, 18  # J (3, 3), then one row of (T, M_x, M_y, M_z) for each rotor


@kernel
def control(q, readings, memory, u, out):
    """Fill out (rotors,); readings: R, velocity, angular velocity in its own axes, place."""
    mass = q[_MASS]
    limited = 0
    fx = fy = fz = 0.0
    for axis in range(3):
        entry = int(q[_AXES + axis])
        if entry >= 0:
            force = u[entry]
        else:
            k = q[_HOLD]
            away = readings[15 + axis] - memory[2 + axis]
            force = -mass * (k * k * away + 2.0 * k * readings[9 + axis])
        if axis == 0:
            fx = force
        elif axis == 1:
            fy = force
        else:
            fz = force + q[_WEIGHT]
    if fz < LEAST_LIFT * q[_WEIGHT]:
        fz, limited = LEAST_LIFT * q[_WEIGHT], 1
    across, most = np.sqrt(fx * fx + fy * fy), q[_TILT] * fz
    if across > most:
        fx, fy, limited = fx * most / across, fy * most / across, 1
    thrust = fx * readings[2] + fy * readings[5] + fz * readings[8]
    size = np.sqrt(fx * fx + fy * fy + fz * fz)
    ax, ay, az = fx / size, fy / size, fz / size  # b_3
    cx, cy = memory[0], memory[1]
    # b_2 = b_3 x c, b_1 = b_2 x b_3
    bx, by, bz = -az * cy, az * cx, ax * cy - ay * cx
    size = np.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx / size, by / size, bz / size
    dx, dy, dz = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
    r = readings
    # columns of R_d^T R; e_R is the skew part
    ex = 0.5 * ((ax * r[1] + ay * r[4] + az * r[7]) - (bx * r[2] + by * r[5] + bz * r[8]))
    ey = 0.5 * ((dx * r[2] + dy * r[5] + dz * r[8]) - (ax * r[0] + ay * r[3] + az * r[6]))
    ez = 0.5 * ((bx * r[0] + by * r[3] + bz * r[6]) - (dx * r[1] + dy * r[4] + dz * r[7]))
    wx, wy, wz = r[12], r[13], r[14]
    stiff, damp = q[_FREQUENCY] ** 2, 2.0 * q[_DAMPING] * q[_FREQUENCY]
    px, py, pz = -stiff * ex - damp * wx, -stiff * ey - damp * wy, -stiff * ez - damp * wz
    j = q[_INERTIA : _INERTIA + 9]
    hx = j[0] * wx + j[1] * wy + j[2] * wz
    hy = j[3] * wx + j[4] * wy + j[5] * wz
    hz = j[6] * wx + j[7] * wy + j[8] * wz
    mx = j[0] * px + j[1] * py + j[2] * pz + wy * hz - wz * hy
    my = j[3] * px + j[4] * py + j[5] * pz + wz * hx - wx * hz
    mz = j[6] * px + j[7] * py + j[8] * pz + wx * hy - wy * hx
    for k in range(len(out)):
        row = q[_MIXER + 4 * k : _MIXER + 4 * k + 4]
        out[k] = row[0] * thrust + row[1] * mx + row[2] * my + row[3] * mz
    return limited


@kernel
def start(q, readings, out):
    """The heading (its direction) and the place at the start."""
    size = np.sqrt(readings[0] ** 2 + readings[3] ** 2)
    out[0], out[1] = readings[0] / size, readings[3] / size
    for axis in range(3):
        out[2 + axis] = readings[15 + axis]


@LOW_LEVEL.register
class QuadrotorTable(ControllerTable):
    """A force in the world's axes, by tilting: the rest of the four rotors' forces keeps it up."""

    controller: Literal["quadrotor"]
    rotors: list[str] = Field(min_length=4, description="actuators: thrusts, or thrust and moments")
    body: str | None = Field(
        None, description="that they carry; if left out the one with the free joint"
    )
    axes: list[Literal["x", "y", "z"]] | None = Field(
        None, min_length=1, description="of the input's entries; x, y, z if left out"
    )
    attitude: Annotated[float, Unit("rad/s")] = Field(
        20.0, gt=0, description="w_n, how fast it tilts"
    )
    damping: Annotated[float, Unit("")] = Field(1.0, gt=0, description="zeta of that")
    most_tilt: Annotated[float, Unit("rad")] = Field(0.6, gt=0, lt=1.4, description="it takes")
    hold: Annotated[float, Unit("rad/s")] = Field(
        2.0, gt=0, description="k, of the axes that the input does not have"
    )

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        entries = robot.entries_of_axes(self.axes, axes)
        body = robot.free_body("body", self.body)
        name = robot.name("body", "body", body)
        mass, centre, inertia = robot.composite(body)
        wrenches = np.column_stack(
            [robot.wrench("rotors", each, body, centre) for each in self.rotors]
        )
        if np.linalg.matrix_rank(wrenches[2:]) < 4:
            raise robot.refused(
                "rotors", self.rotors, "together they must give thrust along the body's z and all"
                " three moments",
            )  # fmt: skip
        gravity = -float(robot.model.opt.gravity[2])
        numbers = [
            mass, mass * gravity, np.tan(self.most_tilt), self.attitude, self.damping, self.hold,
            *entries, *inertia.ravel(), *np.linalg.pinv(wrenches[2:]).ravel(),
        ]  # fmt: skip
        seen = (
            *orientation("body", name), *along("velocity", "body", name),
            *along("velocity", "body", name, angular=True, own=True),
            *along("position", "body", name),
        )  # fmt: skip
        return Controller(
            sys.modules[__name__], tuple(self.rotors), seen, np.array(numbers), axes, held=5,
            holds_weight=True,
        )  # fmt: skip
