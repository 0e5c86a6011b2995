"""The MJCF of a fleet: robots attached to the lane or the plane, each with its own numbers."""

import copy
from importlib.resources import as_file, files
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, named
from gne_mj.plants import mjcf_file

# By how many axes a robot moves along: where, which robot, and how its elements' names end
MODELS = {
    1: ("lane.xml", "flexible_robot.xml", ("",)),
    2: ("plane.xml", "planar_robot.xml", ("_x", "_y")),
}

HULL = "hull"  # the geom by which a robot's main mass collides

# Robots that are attached at a time: each attaching costs by what is there, each robot by its group
GROUP = 200
# Fleets of more have memory in bytes by their number
MANY = 500
_LEAST_ARENA, _ARENA_FOR_EACH = 2**24, 2**14
_ARENA_FOR_MEMORY = 10 * 8  # for each entry of act: Runge-Kutta 4 has nine copies


def element_names(what: str, channels: int, dimension: int = 1) -> list[str]:
    """Each channel's element: robot_2/position on the lane, robot_2/position_x on the plane."""
    ends = MODELS[dimension][2]
    return [f"robot_{r // dimension + 1}/{what}{ends[r % dimension]}" for r in range(channels)]


def compose(
    parameters: NDArray[np.float64],
    *,
    dimension: int = 1,
    decorated: bool = True,
    contacts: bool = False,
) -> mujoco.MjSpec:
    """The lane (or, of dimension 2, the plane) with its flexible robots.

    Args:
        parameters: (m, 5) rows [M, m, stiffness, atan_coefficient, damping] in kg, N/m, N and
            N s/m, one a channel. The atan term is no MJCF attribute: the plant adds it as passive
            force.
        dimension: axes that a robot moves along, 1 or 2; so many rows belong to each robot, and
            its masses are the same in all of them.
        decorated: keep what no step needs: shapes for the eye, a sensor of each velocity, and a
            body that holds a robot's masses together. Without them MuJoCo steps twice as fast, to
            the same states to the last bit.
        contacts: let the robots' main masses collide, by the geom ``hull`` of each.

    Returns:
        What MuJoCo compiles; robot i's elements are named ``robot_i/...``, from 1.

    Raises:
        InvalidInput: another dimension, or masses that differ between a robot's axes.
    """
    if dimension not in MODELS:
        raise InvalidInput(
            "dimension", dimension, "MuJoCo has flexible robots of one or two axes only"
        )
    robots = parameters.reshape(-1, dimension, parameters.shape[1])
    if not np.all(robots[:, :, :2] == robots[:, :1, :2]):
        raise InvalidInput(
            "parameters", "one a channel", "a robot's masses must be the same on all axes"
        )
    place, model, ends = MODELS[dimension]
    world = mujoco.MjSpec.from_string(read_model(place))
    if not decorated:
        for element in (*world.lights, *world.geoms):
            world.delete(element)
    robot = _robot(model, decorated, contacts)
    if contacts:
        off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        world.option.disableflags &= ~int(off)
    for first in range(0, len(robots), GROUP):
        group = _group(robot, robots[first : first + GROUP], first + 1, ends, decorated=decorated)
        frame = world.worldbody.add_frame()
        with named(path="world"):
            part = mjcf_file.of_text(group, "...")
        world.attach(part, prefix="robot_", frame=frame)
    if len(robots) > MANY:
        # Else so much as contacts of all with all would need; there are few.
        world.memory = _LEAST_ARENA + _ARENA_FOR_EACH * len(robots)
    return world


def _robot(model: str, decorated: bool, contacts: bool) -> ElementTree.Element:
    """The file of one robot, without its decoration or its hull where that is not wanted."""
    robot = ElementTree.fromstring(read_model(model))
    for parent in (*robot.iter("body"), robot.find("tendon")):
        for element in list(parent if parent is not None else ()):
            wanted = contacts if element.get("name") == HULL else decorated
            if element.tag in ("geom", "site", "spatial") and not wanted:
                parent.remove(element)  # type: ignore[union-attr]
    sensors = robot.find("sensor")
    if sensors is not None and not decorated:
        robot.remove(sensors)
    return robot


def _group(
    robot: ElementTree.Element,
    robots: NDArray[np.float64],
    first: int,
    ends: tuple[str, ...],
    *,
    decorated: bool,
) -> str:
    """MJCF of some robots, numbered from ``first``; elements' names lack "robot_" in front."""
    group = ElementTree.Element("mujoco")
    group.extend(copy.deepcopy(robot.findall("default")))
    sections = {part.tag: ElementTree.SubElement(group, part.tag) for part in robot}
    for number, rows in enumerate(robots, start=first):
        one = copy.deepcopy(robot)
        for element in one.iter():
            for reference in ("name", "joint", "site"):
                if reference in element.attrib and element.tag != "default":
                    element.set(reference, f"{number}/{element.get(reference)}")
        within = {element.get("name"): element for element in one.iter()}
        for kind, mass in (("main", rows[0, 0]), ("appendage", rows[0, 1])):
            inertial = within[f"{number}/{kind}"].find("inertial")
            assert inertial is not None
            inertial.set("mass", repr(float(mass)))
        for end, (_, _, stiffness, _, damping) in zip(ends, rows, strict=True):
            spring = within[f"{number}/spring{end}"]
            spring.set("stiffness", repr(float(stiffness)))
            spring.set("damping", repr(float(damping)))
        targets = dict(sections)
        if decorated:
            targets["worldbody"] = ElementTree.SubElement(
                sections["worldbody"], "body", name=f"{number}/"
            )
        for part in one:
            if part.tag != "default":
                targets[part.tag].extend(part)
    return ElementTree.tostring(group, encoding="unicode")


def compile_model(
    world: mujoco.MjSpec,
    *,
    timestep: float,
    integrator: str,
    userdata: int = 0,
    memory: int = 0,
    arena: int = 0,
) -> mujoco.MjModel:
    """Compile the world of a fleet.

    Args:
        world: with the robots attached, as :func:`compose` returns it.
        timestep: in s.
        integrator: MuJoCo's name of it.
        userdata: entries of mjData's ``userdata``.
        memory: entries of ``act`` for a law's memory, see :func:`add_memory`.
        arena: bytes of MuJoCo's own memory that it must have at least.

    Raises:
        InvalidInput: numbers that MuJoCo does not take, as a mass below its least.
    """
    if memory:
        add_memory(world, memory)
        if world.memory > 0:
            world.memory += _ARENA_FOR_MEMORY * memory
    world.option.timestep = timestep
    world.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    world.nuserdata = userdata
    with named(path="world"):
        model = mjcf_file.compiled(world, "...")
        if arena > model.narena:
            world.memory = arena
            model = mjcf_file.compiled(world, "...")
    return model


def add_memory(world: mujoco.MjSpec, memory: int) -> None:
    """An actuator without any force that holds a law's memory, last in ``act``.

    Its rates come from a callback.
    """
    holder = world.add_actuator(name="memory")
    holder.trntype = mujoco.mjtTrn.mjTRN_JOINT
    joint = world.joints[0]
    joint.name = joint.name or "memory"
    holder.target = joint.name
    holder.dyntype = mujoco.mjtDyn.mjDYN_USER
    holder.actdim = memory
    holder.gear = np.zeros(6)
    holder.gainprm = np.zeros(10)


def read_model(name: str) -> str:
    """The text of a packaged MJCF file."""
    with as_file(files("gne_mj.models").joinpath(name)) as path:
        return path.read_text(encoding="utf-8")
