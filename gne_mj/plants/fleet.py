"""The MJCF of a fleet: robots attached to the lane, each with its own numbers."""

import warnings
from importlib.resources import as_file, files
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray


def compose(parameters: NDArray[np.float64], *, decorated: bool = True) -> Any:
    """The lane with one flexible robot for each row of ``parameters``.

    Args:
        parameters: (N, 5) rows [M, m, stiffness, atan_coefficient, damping] in kg, N/m, N and
            N s/m. The atan term is no MJCF attribute: the plant adds it as passive force.
        decorated: keep what is for the eye only; without it MuJoCo steps somewhat faster.

    Returns:
        A ``dm_control.mjcf.RootElement``; robot i's elements are named ``robot_i/...``, from 1.
    """
    mjcf = _import_mjcf()
    lane = mjcf.from_xml_string(read_model("lane.xml"))
    robot_xml = read_model("flexible_robot.xml")
    if not decorated:
        lane.worldbody.light.clear()
        lane.worldbody.geom.clear()
    for i, (main_mass, appendage_mass, stiffness, _, damping) in enumerate(parameters, start=1):
        robot = mjcf.from_xml_string(robot_xml)
        robot.model = f"robot_{i}"
        robot.find("body", "main").inertial.mass = main_mass
        robot.find("body", "appendage").inertial.mass = appendage_mass
        spring = robot.find("tendon", "spring")
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
    """
    if memory:
        lane.actuator.add(
            "general", name="memory", joint=lane.find_all("joint")[0], dyntype="user",
            actdim=memory, gear=[0], gainprm=[0],
        )  # fmt: skip
    lane.option.timestep = timestep
    lane.option.integrator = integrator
    lane.size.nuserdata = userdata
    return mujoco.MjModel.from_xml_string(lane.to_xml_string())


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
