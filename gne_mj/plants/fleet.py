"""The MJCF of a fleet: robots attached to the lane or the plane, each with its own numbers."""

import warnings
from importlib.resources import as_file, files
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput

# By how many axes a robot moves along: where, which robot, and how its elements' names end
MODELS = {
    1: ("lane.xml", "flexible_robot.xml", ("",)),
    2: ("plane.xml", "planar_robot.xml", ("_x", "_y")),
}


def element_names(what: str, channels: int, dimension: int = 1) -> list[str]:
    """Each channel's element: robot_2/position on the lane, robot_2/position_x on the plane."""
    ends = MODELS[dimension][2]
    return [f"robot_{r // dimension + 1}/{what}{ends[r % dimension]}" for r in range(channels)]


def compose(parameters: NDArray[np.float64], *, dimension: int = 1, decorated: bool = True) -> Any:
    """The lane (or, of dimension 2, the plane) with its flexible robots.

    Args:
        parameters: (m, 5) rows [M, m, stiffness, atan_coefficient, damping] in kg, N/m, N and
            N s/m, one a channel. The atan term is no MJCF attribute: the plant adds it as passive
            force.
        dimension: axes that a robot moves along, 1 or 2; so many rows belong to each robot, and
            its masses are the same in all of them.
        decorated: keep what is for the eye only; without it MuJoCo steps somewhat faster.

    Returns:
        A ``dm_control.mjcf.RootElement``; robot i's elements are named ``robot_i/...``, from 1.

    Raises:
        InvalidInput: another dimension, or masses that differ between a robot's axes.
    """
    if dimension not in MODELS:
        raise InvalidInput(
            "agents.dimension", dimension, "MuJoCo has flexible robots of one or two axes only"
        )
    robots = parameters.reshape(-1, dimension, parameters.shape[1])
    if not np.all(robots[:, :, :2] == robots[:, :1, :2]):
        raise InvalidInput(
            "agents.main_mass", "one a channel", "a robot's masses must be the same on all axes"
        )
    place, robot_model, ends = MODELS[dimension]
    mjcf = _import_mjcf()
    lane = mjcf.from_xml_string(read_model(place))
    robot_xml = read_model(robot_model)
    if not decorated:
        lane.worldbody.light.clear()
        lane.worldbody.geom.clear()
    for i, rows in enumerate(robots, start=1):
        robot = mjcf.from_xml_string(robot_xml)
        robot.model = f"robot_{i}"
        robot.find("body", "main").inertial.mass = rows[0, 0]
        robot.find("body", "appendage").inertial.mass = rows[0, 1]
        for end, (_, _, stiffness, _, damping) in zip(ends, rows, strict=True):
            spring = robot.find("tendon", f"spring{end}")
            spring.stiffness, spring.damping = stiffness, damping
        if not decorated:
            robot.find("tendon", "coil").remove()
            for kind in ("geom", "site"):
                for element in robot.find_all(kind):
                    element.remove()
        lane.attach(robot)
    return lane


def compile_model(
    lane: Any, *, timestep: float, integrator: str, userdata: int = 0, memory: int = 0
) -> mujoco.MjModel:
    """Compile a composed fleet.

    Args:
        lane: what :func:`compose` returned.
        timestep: in s.
        integrator: MuJoCo's name of it.
        userdata: entries of mjData's ``userdata``.
        memory: entries of ``act`` for a law's memory; an actuator without any force, ``memory``,
            holds them, and its rates come from a callback.

    Raises:
        InvalidInput: numbers that MuJoCo does not take, as a mass below its least.
    """
    if memory:
        lane.actuator.add(
            "general", name="memory", joint=lane.find_all("joint")[0], dyntype="user",
            actdim=memory, gear=[0], gainprm=[0],
        )  # fmt: skip
    lane.option.timestep = timestep
    lane.option.integrator = integrator
    lane.size.nuserdata = userdata
    try:
        return mujoco.MjModel.from_xml_string(lane.to_xml_string())
    except ValueError as error:
        said = " ".join(str(error).split())
        raise InvalidInput("agents", "...", f"MuJoCo must compile it: {said}") from None


def read_model(name: str) -> str:
    """The text of a packaged MJCF file."""
    with as_file(files("gne_mj.models").joinpath(name)) as path:
        return path.read_text(encoding="utf-8")


def _import_mjcf() -> Any:
    # Late, since it is slow; quiet, since glfw warns wherever there is no display.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from dm_control import mjcf
    return mjcf
