"""The floors of a fleet: planes that several files bring are one.

A robot then stands on one floor, so that contacts grow with the number of robots, and MuJoCo has no
other to look at: each geom of the world is compared with every body that moves.
"""

from typing import Any

import mujoco
import numpy as np

from gne_mj.plants.mjcf_pose import Pose

# What of a geom says how it is touched
SURFACE = (
    "contype", "conaffinity", "condim", "priority", "friction", "solmix", "solref", "solimp",
    "margin", "gap",
)  # fmt: skip
HIDDEN = 5  # a group that neither the page nor MuJoCo's viewer shows unless told


class Floors:
    """The planes that touch something and stand in the world.

    Attributes:
        owners: the robots, from 0, that bring each of those that stay, by its name.
    """

    def __init__(self) -> None:
        self.owners: dict[str, set[int]] = {}
        self._names: dict[tuple[float, ...], str] = {}

    def doubles(
        self, spec: Any, alone: mujoco.MjModel, place: Pose, robot: int, prefix: str
    ) -> dict[str, str]:
        """Those of a file that are there already: their names to the names of these.

        Args:
            spec: the file's; planes without a name are given one.
            alone: the model that it is by itself.
            place: where it is attached.
            robot: its number, from 0.
            prefix: of its names in the fleet.
        """
        geoms = list(spec.worldbody.geoms)
        found: dict[str, str] = {}
        if len(geoms) != np.count_nonzero(alone.geom_bodyid == 0):  # some were discarded
            return found
        for k, geom in enumerate(geoms):
            touches = alone.geom_contype[k] | alone.geom_conaffinity[k]
            if alone.geom_type[k] != mujoco.mjtGeom.mjGEOM_PLANE or not touches:
                continue
            geom.name = geom.name or f"gne_mj floor {k + 1}"
            name = prefix + geom.name
            kept = self._names.setdefault(_key(alone, k, place), name)
            self.owners.setdefault(kept, set()).add(robot)
            if kept != name:
                found[name] = kept
        return found


def leave_out(world: Any, doubles: dict[str, str]) -> None:
    """Take planes out of a fleet's ``mujoco.MjSpec``; what names them names others."""
    for pair in world.pairs:
        pair.geomname1 = doubles.get(pair.geomname1, pair.geomname1)
        pair.geomname2 = doubles.get(pair.geomname2, pair.geomname2)
    for sensor in world.sensors:
        if sensor.objtype == mujoco.mjtObj.mjOBJ_GEOM:
            sensor.objname = doubles.get(sensor.objname, sensor.objname)
        if sensor.reftype == mujoco.mjtObj.mjOBJ_GEOM:
            sensor.refname = doubles.get(sensor.refname, sensor.refname)
    for name in doubles:
        world.delete(world.geom(name))


def show_one_floor(model: mujoco.MjModel, data: mujoco.MjData, owners: list[set[int]]) -> None:
    """Hide but one of the planes that lie in each other: a floor that all bring is seen once.

    Args:
        model: of the fleet; those that are hidden change their group.
        data: positions evaluated.
        owners: of each geom; a robot's own floor is seen before the lane's.
    """
    stands = (model.geom_bodyid == 0) & (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    planes = sorted(np.flatnonzero(stands).tolist(), key=lambda geom: not owners[geom])
    seen: set[tuple[float, ...]] = set()
    for geom in planes:
        normal = data.geom_xmat[geom].reshape(3, 3)[:, 2]
        place = tuple(np.round([*normal, normal @ data.geom_xpos[geom]], 9).tolist())
        if place in seen:
            model.geom_group[geom] = HIDDEN
        seen.add(place)


def _key(alone: mujoco.MjModel, geom: int, place: Pose) -> tuple[float, ...]:
    """The same for planes that are the same: their normal, how far they are along it, surface."""
    turn, normal, point = np.array(place.quaternion), np.empty(3), np.empty(3)
    mujoco.mju_rotVecQuat(normal, np.array([0.0, 0.0, 1.0]), alone.geom_quat[geom])
    mujoco.mju_rotVecQuat(normal, normal.copy(), turn)
    mujoco.mju_rotVecQuat(point, alone.geom_pos[geom], turn)
    surface = [np.atleast_1d(getattr(alone, f"geom_{name}")[geom]) for name in SURFACE]
    numbers = np.concatenate([normal, [normal @ (place.position + point)], *surface])
    return tuple((np.round(numbers, 9) + 0.0).tolist())
