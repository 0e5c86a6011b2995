"""Floors that several files bring are drawn as one: planes at one place would flicker through each
other. The lowest one has no end, as MuJoCo has it: robots stand on it wherever they go."""

from collections.abc import Iterable, Set

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.viewer.shapes import ENDLESS

ROUNDED = 6  # digits of what is taken for the same place
UPRIGHT = 1.0 - 1e-6  # the least z of a level plane's normal


def _standing(model: mujoco.MjModel, geoms: Iterable[int]) -> list[int]:
    """The planes among these that never move."""
    kind, welded = mujoco.mjtGeom.mjGEOM_PLANE, model.body_weldid
    return [g for g in geoms if model.geom_type[g] == kind and not welded[model.geom_bodyid[g]]]


def _look(model: mujoco.MjModel, geom: int) -> tuple[object, ...]:
    """Name, colour and material, as the file calls them: copies of it have a prefix before."""
    material = int(model.geom_matid[geom])
    names = [model.geom(geom).name, model.mat(material).name if material >= 0 else ""]
    return (*model.geom_rgba[geom].tolist(), *(name.rpartition("/")[2] for name in names))


def ground(model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int]) -> set[int]:
    """The lowest of the planes that never move and face upward, if all of them look alike.

    Args:
        model: whose.
        data: its kinematics evaluated.
        geoms: those shown.
    """
    floors = [g for g in _standing(model, geoms) if data.geom_xmat[g, 8] > UPRIGHT]
    height = np.round(data.geom_xpos[floors, 2], ROUNDED)
    lowest = {g for g, z in zip(floors, height, strict=True) if z == np.min(height)}
    return lowest if len({_look(model, g) for g in lowest}) == 1 else set()


def joined(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int], endless: Set[int]
) -> dict[int, tuple[NDArray[np.float64], NDArray[np.float64]] | None]:
    """Of planes that never move what is drawn.

    Args:
        model: whose.
        data: its kinematics evaluated.
        geoms: those shown.
        endless: those drawn without an end.

    Returns:
        By geom the middle (3,) in m and ``size`` (3,), half its sides in m (0: without an end), of
        the plane that stands for all of its place, which the first one does; None of the others.
    """
    found: dict[int, tuple[NDArray[np.float64], NDArray[np.float64]] | None] = {}
    places: dict[tuple[object, ...], list[int]] = {}
    for geom in _standing(model, geoms):
        turn = data.geom_xmat[geom].reshape(3, 3)
        height = turn[:, 2] @ data.geom_xpos[geom]
        key = (np.round([*turn.ravel(), height], ROUNDED) + 0.0).tolist()
        places.setdefault((*key, *_look(model, geom)), []).append(geom)
    for first, *others in places.values():
        found |= dict.fromkeys(others)
        turn = data.geom_xmat[first].reshape(3, 3)
        middles = (data.geom_xpos[[first, *others]] - data.geom_xpos[first]) @ turn
        sizes = model.geom_size[[first, *others]]
        halves = np.where(sizes[:, :2] > 0, sizes[:, :2], ENDLESS)
        low, high = np.min(middles[:, :2] - halves, axis=0), np.max(middles[:, :2] + halves, axis=0)
        ends = np.all(sizes[:, :2] > 0, axis=0) & (first not in endless)
        middle = np.append(np.where(ends, (low + high) / 2, 0.0), 0.0)
        size = np.append(np.where(ends, (high - low) / 2, 0.0), sizes[0, 2])
        found[first] = data.geom_xpos[first] + turn @ middle, size
    return found


def of_the_lane(model: mujoco.MjModel) -> list[str]:
    """The lane's own floor, where robots bring what they stand on: not to be drawn then."""
    others = [g for g in range(model.ngeom) if model.geom(g).name != "floor"]
    ground = mujoco.mjtGeom.mjGEOM_HFIELD
    standing = _standing(model, others)
    terrain = bool(np.any(model.geom_type[others] == ground))
    return ["floor"] if standing or terrain else []
