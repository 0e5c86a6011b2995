"""The joints and actuators of a fleet's robots: what they are called, and their numbers."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.viewer.fleet import Fleet

MOST = 400_000  # numbers of joints in a replay; of more robots it has none
_AXES = "xyz"


class Joints:
    """What a page can show of each robot's joints and actuators.

    Args:
        fleet: the robots.

    Attributes:
        size: numbers of all joints and actuators: joint positions (nq), velocities (nv), controls
            (nu), one behind the other.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet, self._model = fleet, fleet.plant.model
        self.size = int(self._model.nq + self._model.nv + self._model.nu)

    def meta(self) -> list[list[dict[str, Any]]]:
        """Of each robot its rows: name, and index and unit of its "position", "velocity" and
        "control", those that it has."""
        found: list[list[dict[str, Any]]] = [[] for _ in range(self._fleet.agents)]
        for name, row in (*self._joints(), *self._actuators()):
            owner, _, own = name.partition("/")
            if owner.startswith("robot_") and owner[6:].isdecimal():
                found[int(owner[6:]) - 1].append({"name": own, **row})
        return found

    def live(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """(size,) the numbers of a simulation that goes on."""
        return np.concatenate([data.qpos, data.qvel, data.ctrl[: self._model.nu]])

    def recorded(self, values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """(T, size) those that a trajectory's variables say; not numbers where they do not."""
        model, plant = self._model, self._fleet.plant
        qpos = self._fleet.qpos(values)
        qvel, ctrl = np.full((len(qpos), model.nv), np.nan), np.full((len(qpos), model.nu), np.nan)
        at = plant.output_joints
        if not isinstance(plant, MjcfPlant) or not plant.agents.parameters.size:  # no look-ahead
            qvel[:, at[at >= 0]] = values["action"].reshape(len(qpos), -1)[:, at >= 0]
        inputs = values.get("input")
        if isinstance(plant, MujocoPlant):
            main, appendage = plant.joints[1]
            qvel[:, main], qvel[:, appendage] = values["state"][:, :, 1], values["state"][:, :, 2]
            if inputs is not None:
                ctrl[:, plant.places.actuator] = inputs.reshape(len(qpos), -1)
        elif isinstance(plant, MjcfPlant) and inputs is not None:
            for row, u in zip(ctrl, inputs.reshape(len(qpos), -1), strict=True):
                plant.controls(u, row)
        return np.concatenate([qpos, qvel, ctrl], axis=1)

    def _joints(self) -> list[tuple[str, dict[str, Any]]]:
        model, kinds, found = self._model, mujoco.mjtJoint, []
        for joint in range(model.njnt):
            kind, q = int(model.jnt_type[joint]), int(model.jnt_qposadr[joint])
            name, v = model.joint(joint).name or f"joint_{joint}", int(model.jnt_dofadr[joint])
            owner = _owner(model, int(model.jnt_bodyid[joint]))
            name = name if name.startswith(owner) else f"{owner}{name}"
            if kind in (kinds.mjJNT_SLIDE, kinds.mjJNT_HINGE):
                unit = "m" if kind == kinds.mjJNT_SLIDE else "rad"
                found.append((name, _row(v + model.nq, f"{unit}/s", position=(q, unit))))
                continue
            if kind == kinds.mjJNT_FREE:
                for k, axis in enumerate(_AXES):
                    row = _row(v + k + model.nq, "m/s", position=(q + k, "m"))
                    found.append((f"{name}, {axis}", row))
                v += 3
            for k, axis in enumerate(_AXES):  # an orientation is no three numbers
                found.append((f"{name}, about {axis}", _row(v + k + model.nq, "rad/s")))
        return found

    def _actuators(self) -> list[tuple[str, dict[str, Any]]]:
        model, found = self._model, []
        for actuator in range(model.nu):
            name, at = model.actuator(actuator).name, int(model.nq + model.nv + actuator)
            found.append((name, {"control": [at, _control_unit(model, actuator)]}))
        return found


def _row(velocity: int, unit: str, position: tuple[int, str] | None = None) -> dict[str, Any]:
    row: dict[str, Any] = {"velocity": [int(velocity), unit]}
    return row if position is None else {"position": list(position), **row}


def _owner(model: mujoco.MjModel, body: int) -> str:
    """``robot_1/`` of a body of the first robot."""
    name: str = model.body(body).name
    return name[: name.find("/") + 1]


def _control_unit(model: mujoco.MjModel, actuator: int) -> str:
    """Of an actuator that is a force N, at a hinge N m; of others what it is to its file."""
    if model.actuator_biastype[actuator] != mujoco.mjtBias.mjBIAS_NONE:
        return ""
    transmissions = mujoco.mjtTrn
    if int(model.actuator_trntype[actuator]) in (
        transmissions.mjTRN_JOINT, transmissions.mjTRN_JOINTINPARENT
    ):  # fmt: skip
        joint = model.actuator_trnid[actuator, 0]
        return "N" if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE else "N m"
    # a rotor's thrust has its drag's torque besides
    gear = model.actuator_gear[actuator]
    return "N m" if np.any(gear[3:]) and not np.any(gear[:3]) else "N"
