"""The world of a fleet of users' robots: all their files attached to one, with what is added."""

from typing import Any

from gne_mj.plants import mjcf_file
from gne_mj.plants.low_level.table import Controller
from gne_mj.plants.mjcf_contacts import Part, part_of
from gne_mj.plants.mjcf_drive import add_effort
from gne_mj.plants.mjcf_floors import Floors, leave_out
from gne_mj.plants.mjcf_low_level import add_memory
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.plants.mjcf_terrain import check_options, ground, make_way, without_floors


def world_of(
    agents: MjcfRobots, controllers: dict[int, Controller]
) -> tuple[Any, list[Part], dict[str, set[int]], int]:
    """A fleet's ``mujoco.MjSpec``, and what is told of it.

    Args:
        agents: which robots.
        controllers: the low-level controllers of those that have one, by agent from 0.

    Returns:
        It, not yet compiled; what of it is each robot's; the robots that bring each floor, by its
        name; and the memory that the files ask for in bytes, 0 if they do not.

    Raises:
        InvalidInput: a file cannot be used, or not beside the others; names ``path`` or a key of
            the agents.
    """
    robots, places, terrain = agents.files, agents.places, agents.terrain
    world = ground(terrain, places)
    # which finds what is wrong with them
    alone = {path: mjcf_file.alone(path) for path in dict.fromkeys(r.path for r in robots)}
    parts, floors, memory = [], Floors(), 0
    for i, robot in enumerate(robots):
        spec = mjcf_file.read(robot.path)
        if i == 0:
            mjcf_file.adopt_options(world, spec)
            if terrain is not None:
                check_options(world, terrain)
        mjcf_file.check_options(world, spec, robot.path)
        if terrain is not None:
            without_floors(spec, robot.path)
        for channel in range(i * agents.dimension, (i + 1) * agents.dimension):
            add_effort(spec, agents.robots[channel].input, channel, robot.path)
        if i in controllers:
            add_memory(spec, controllers[i])
        prefix, part = f"robot_{i + 1}/", part_of(spec)
        doubles: dict[str, str] = {}
        if terrain is None:
            doubles = floors.doubles(spec, alone[robot.path], places[i], i, prefix)
        parts.append(part._replace(geoms=part.geoms - len(doubles)))
        memory += max(spec.memory, 0)
        if terrain is None:
            make_way(world, spec)
        mjcf_file.attach(world, spec, robot.path, prefix=prefix, at=places[i])
        leave_out(world, doubles)
    return world, parts, floors.owners, memory
