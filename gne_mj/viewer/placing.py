"""Where what is drawn of a MuJoCo model is at given joint positions: the loop over samples."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.native import compiled, copy, kernel, source_key
from gne_mj.plants.native_mujoco import call

APART = 1e-3  # m between joints that a fixed tendon is drawn between

# An item's entries in an array of poses
POSITION, QUATERNION, LENGTH = slice(0, 3), slice(3, 7), 7


class Placing(NamedTuple):
    """What :func:`place` reads: of mjData, which it moves, and of a mirror."""

    functions: NDArray[np.int64]  # addresses: mj_kinematics, mj_tendon or 0, mjModel, mjData
    qpos: NDArray[np.float64]
    xpos: NDArray[np.float64]
    xquat: NDArray[np.float64]
    xanchor: NDArray[np.float64]
    wraps: NDArray[np.int32]  # (tendons,) wrap points that each has now
    wrapped: NDArray[np.int32]  # (n, 2) what they touch, in twos; -2 is a pulley
    wrap_points: NDArray[np.float64]  # (2 n, 3)
    rest: NDArray[np.float64]  # (K, 8) before anything is put in its place
    bodies: NDArray[np.int64]  # of the first items
    joints: NDArray[np.int64]  # (n, 2) that segments of fixed tendons go between
    joint_rows: NDArray[np.int64]  # and the items that they are
    first: NDArray[np.int64]  # (tendons,) of each one's items
    segments: NDArray[np.int64]  # (tendons,) at most; 0 of a tendon that is not spatial


@cache
def place() -> Any:
    """The native function that fills poses: (Placing, qpos, x, y, poses), see Mirror.samples."""
    source = source_key()

    @compiled
    def move(seen, qpos, x, y, found):
        _ = source
        kinematics, tendon = seen.functions[0], seen.functions[1]
        model, data = seen.functions[2], seen.functions[3]
        for sample in range(len(found)):
            poses = found[sample]
            copy(qpos[sample], seen.qpos)
            call(kinematics, model, data)
            for item in range(len(poses)):
                copy(seen.rest[item], poses[item])
            _put(poses, seen)
            if tendon != 0:
                call(tendon, model, data)
                _stretch_spatial(poses, seen)
            _hide(poses)
            for item in range(len(poses)):
                poses[item, 0] += x
                poses[item, 1] += y

    return move


@kernel
def _put(poses, seen):
    """Put bodies, the first rows of poses, where MuJoCo has them, and fixed tendons."""
    for row in range(len(seen.bodies)):
        body = seen.bodies[row]
        for k in range(3):
            poses[row, k] = seen.xpos[body, k]
        for k in range(4):
            poses[row, 3 + k] = seen.xquat[body, k]
    for n in range(len(seen.joints)):
        start, end = seen.xanchor[seen.joints[n, 0]], seen.xanchor[seen.joints[n, 1]]
        _stretch(poses[seen.joint_rows[n]], start, end, APART)


@kernel
def _stretch_spatial(poses, seen):
    """Put segments of spatial tendons between their wrap points, but for those at pulleys."""
    point = 0
    for tendon in range(len(seen.wraps)):
        row = seen.first[tendon]
        for n in range(seen.wraps[tendon] - 1 if seen.segments[tendon] > 0 else 0):
            start, end = point + n, point + n + 1
            if _touched(seen.wrapped, start) != -2 and _touched(seen.wrapped, end) != -2:
                _stretch(poses[row], seen.wrap_points[start], seen.wrap_points[end], 0.0)
                row += 1
        point += seen.wraps[tendon]


@kernel
def _touched(wrapped, point):
    return wrapped[point // 2, point % 2]


@kernel
def _hide(poses):
    """Hide what is not a number in the place of the first that is there."""
    first = -1
    for item in range(len(poses)):
        if first < 0 and _is_there(poses[item]):
            first = item
    for item in range(len(poses)):
        if not _is_there(poses[item]):
            for k in range(8):
                poses[item, k] = poses[first, k] if k < 3 and first >= 0 else 0.0
            poses[item, 3] = 1.0


@kernel
def _is_there(pose):
    there = True
    for k in range(len(pose)):
        there = there and np.isfinite(pose[k])
    return there


@kernel
def _stretch(pose, start, end, least):
    """Lay a segment from a point to another; hide one that is shorter than least."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = np.sqrt(x * x + y * y + z * z)
    for k in range(3):
        pose[k] = start[k]
    if length > 0.0:
        pose[3], pose[4], pose[5], pose[6] = turn_z_to(x / length, y / length, z / length)
    pose[7] = length if length >= least else 0.0


@kernel
def turn_z_to(x, y, z):
    """The quaternion w x y z that takes z the shortest way to a unit vector.

    It depends continuously on the direction but at -z, where no choice would.
    """
    across = x * x + y * y
    w = 1.0 + z if z >= 0.0 else across / (1.0 - z)  # 1 + z would lose all digits near -z
    size = np.sqrt(w * w + across)
    if size <= 1e-15:
        return 0.0, 1.0, 0.0, 0.0
    return w / size, -y / size, x / size, 0.0
