"""The ground of a fleet of users' robots: a lane, or a file of the user's that stands still."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from gne_mj.errors import InvalidInput, named
from gne_mj.plants import mjcf_file
from gne_mj.plants.fleet import read_model
from gne_mj.plants.mjcf_pose import Pose

PREFIX = "terrain/"  # of the names of its elements


def ground(terrain: Path | None, poses: tuple[Pose, ...]) -> Any:
    """The ``mujoco.MjSpec`` that robots are attached to.

    Args:
        terrain: a file; the lane if left out.
        poses: of the robots, over which the lane's floor reaches.

    Raises:
        InvalidInput: a file that cannot be read, or whose parts move; names ``agents.terrain``.
    """
    world = mujoco.MjSpec.from_string(read_model("lane.xml"))
    if terrain is None:
        floor, across = world.geom("floor"), [pose.position[1] for pose in poses]
        floor.pos[1] = 0.5 * (min(across) + max(across))
        floor.size[1] += 0.5 * (max(across) - min(across))
        return world
    with named(path="agents.terrain"):
        mjcf_file.alone(terrain)
        spec = mjcf_file.read(terrain)
        _check_stands(spec, terrain)
        world.delete(world.geom("floor"))
        make_way(world, spec)
        mjcf_file.attach(world, spec, terrain, prefix=PREFIX, at=Pose())
    return world


def make_way(world: Any, spec: Any) -> None:
    """Take the lane's own sun and sky out, if they are there, where a file brings its own."""
    skies = [each for each in spec.textures if each.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX]
    for own, brought in ((world.light("sun"), spec.lights), (world.texture("sky"), skies)):
        if own is not None and brought:
            world.delete(own)


def check_options(world: Any, terrain: Path) -> None:
    """Refuse a terrain whose options are neither MuJoCo's own nor those of a fleet's world.

    Raises:
        InvalidInput: names ``agents.terrain`` and the option.
    """
    spec, plain = mjcf_file.read(terrain), mujoco.MjSpec()
    plain.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    for name in mjcf_file.options_of(spec):
        if name in mjcf_file.CLOCK or np.all(
            getattr(spec.option, name) == getattr(plain.option, name)
        ):
            continue
        with named(path="agents.terrain"):
            mjcf_file.check_option(world, spec, terrain, name)


def without_floors(spec: Any, path: Path) -> None:
    """Take the planes that stand in the world out of a robot's file, which has a terrain.

    Raises:
        InvalidInput: pairs of contacts name one; names ``path``.
    """
    named_in_pairs = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    for geom in list(spec.worldbody.geoms):
        if geom.type != mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        if geom.name and geom.name in named_in_pairs:
            raise InvalidInput(
                "path", str(path), f"a terrain takes the place of its floor '{geom.name}', which a"
                " <pair> of its contacts names: leave the pair or the terrain out",
            )  # fmt: skip
        spec.delete(geom)


def _check_stands(spec: Any, path: Path) -> None:
    moving = [f"joint '{joint.name}'" for joint in spec.joints]
    moving += [f"mocap body '{body.name}'" for body in spec.bodies if body.mocap]
    moving += [f"actuator '{actuator.name}'" for actuator in spec.actuators]
    if moving:
        raise InvalidInput("path", str(path), f"a terrain stands still, and it has {moving[0]}")
