"""Fleets of the user's own robots: any MJCF with a velocity to measure and an actuator to drive."""

import copy
import sys
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput, nearest
from gne_mj.native import kernel
from gne_mj.plants import mjcf_ahead, mjcf_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.fleet import add_memory, read_model
from gne_mj.plants.mjcf_ahead import (
    ACTUATOR,
    OUTPUT_AT,
    POSITION_AT,
    SENSOR_FUNCTIONS,
    actuator_of,
    gather,
    refresh,
)
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile
from gne_mj.plants.mujoco import INTEGRATORS, run_steps
from gne_mj.plants.native_mujoco import (
    PLANT_MARK,
    USERDATA_HEADER,
    callbacks,
    step_address,
)
from gne_mj.table import Table

__all__ = ["AGENT", "AHEAD", "MjcfPlant", "actuator_of", "gather", "refresh", "stored"]

SPACING = 2.0  # m between robots, so that they do not touch

AGENT, AHEAD = mjcf_robot, mjcf_ahead


@kernel
def stored(channels, state, userdata):
    """Not known."""
    return 0.0


class MjcfPlant(Plant):
    """A fleet of the user's own robots in MuJoCo.

    Each file's bodies are attached to one world, side by side; all must have one gravity and the
    same flags; contacts are between a robot's own geoms and whatever its file brings along. A fleet
    starts from the models' reference pose at the given outputs.

    Args:
        agents: which robots.
        timestep: in s.
        integrator: "rk4" or "euler".
        userdata: room to leave in ``userdata`` behind what this plant needs itself.
        memory: room for a law's memory in ``act``, behind what the robots have there.

    Attributes:
        kernels: the module that says how a loop reads and drives the fleet.
        model, data: MuJoCo's own.

    Raises:
        InvalidInput: a file that MuJoCo cannot read, a name that it does not have, or an actuator
            that would clamp inputs that the agents' limit allows.
    """

    passive = None
    agents: MjcfRobots

    def __init__(
        self,
        agents: MjcfRobots,
        timestep: float,
        integrator: str = "rk4",
        *,
        userdata: int = 0,
        memory: int = 0,
    ) -> None:
        self.agents, self.timestep, self.integrator = agents, timestep, integrator
        self.kernels = sys.modules[__name__]
        world = _world(agents.robots)
        world.option.timestep = timestep
        world.option.integrator = getattr(
            mujoco.mjtIntegrator, f"mjINT_{INTEGRATORS[integrator].upper()}"
        )
        world.nuserdata = USERDATA_HEADER + userdata
        if memory:
            add_memory(world, memory)
        try:
            self.model = world.compile()
        except ValueError as error:
            raise InvalidInput("agents.file", "...", f"MuJoCo must compile it: {error}") from None
        self.data = mujoco.MjData(self.model)
        self.places = np.array(
            [self._place(i, robot) for i, robot in enumerate(agents.robots)], dtype=np.int64
        )
        model = self.model
        self._twin = mujoco.MjData(model)  # where mode implicit looks ahead
        sizes = (
            model.nq, model.nv, model.nu, model.nuserdata, model.na, USERDATA_HEADER,
            model.na - memory, model.nsensordata, self._twin._address, step_address(),
            0 if self.measures_every_stage else step_address("mj_forward"),
            *(step_address(name) for name in SENSOR_FUNCTIONS),
        )  # fmt: skip
        self.table_arrays = [self.places, np.zeros(0), np.array(sizes, dtype=np.int64)]
        self._table = Table(self.table_arrays)

    def arrays_for(self, agents: Agents) -> list[NDArray[Any]]:
        """The table's arrays; such robots have no numbers but those in their files."""
        return self.table_arrays

    def model_fields(
        self, parameters: NDArray[np.float64]
    ) -> list[tuple[str, NDArray[np.int64], NDArray[np.float64]]]:
        """No numbers, no fields."""
        return []

    @property
    def configuration(self) -> int:
        """Joint positions to record: all, since the state has but the outputs' joints."""
        return int(self.model.nq)

    @property
    def measures_every_stage(self) -> bool:
        """Whether outputs are fresh at every stage: MuJoCo's sensors are so at the first only."""
        return bool(np.all(self.places[:, OUTPUT_AT] >= 0))

    def _place(self, i: int, robot: RobotFile) -> tuple[int, int, int]:
        model, prefix = self.model, f"robot_{i + 1}/"
        joint = _named(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + robot.output)
        sensor = _named(model, mujoco.mjtObj.mjOBJ_SENSOR, prefix + robot.output)
        actuator = _named(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + robot.input)
        if actuator < 0:
            names = _names(model, "actuator", prefix)
            raise InvalidInput("agents.input", robot.input, nearest(robot.input, names))
        self._check_limit(i, robot, actuator)
        if sensor >= 0:
            kind = mujoco.mjtSensor(model.sensor_type[sensor])
            if kind == mujoco.mjtSensor.mjSENS_JOINTVEL:
                joint = int(model.sensor_objid[sensor])
            elif kind in (
                mujoco.mjtSensor.mjSENS_TENDONVEL,
                mujoco.mjtSensor.mjSENS_ACTUATORVEL,
            ):
                return -1 - int(model.sensor_adr[sensor]), -1, actuator
            else:
                raise InvalidInput(
                    "agents.output", robot.output, "a sensor must be jointvel, tendonvel or"
                    " actuatorvel",
                )  # fmt: skip
        if joint < 0:
            names = [*_names(model, "joint", prefix), *_names(model, "sensor", prefix)]
            raise InvalidInput("agents.output", robot.output, nearest(robot.output, names))
        if mujoco.mjtJoint(model.jnt_type[joint]) not in (
            mujoco.mjtJoint.mjJNT_SLIDE,
            mujoco.mjtJoint.mjJNT_HINGE,
        ):
            raise InvalidInput("agents.output", robot.output, "it must be a slide or a hinge joint")
        return int(model.jnt_dofadr[joint]), int(model.jnt_qposadr[joint]), actuator

    def _check_limit(self, i: int, robot: RobotFile, actuator: int) -> None:
        """MuJoCo clamps silently; what the law asks for must not be changed unseen."""
        model, limit = self.model, float(self.agents.input_limit[i])
        ranges = []
        if model.actuator_ctrllimited[actuator]:
            ranges.append(model.actuator_ctrlrange[actuator])
        if model.actuator_forcelimited[actuator]:
            gain = model.actuator_gainprm[actuator, 0] or 1.0
            ranges.append(np.sort(model.actuator_forcerange[actuator] / gain))
        least = min((min(-low, high) for low, high in ranges), default=np.inf)
        if limit > least:
            raise InvalidInput(
                "agents.input_limit",
                limit,
                f"actuator '{robot.input}' of agent {i + 1} clamps its input: give a limit of at"
                f" most {least:g}",
            )

    def twin(self) -> Self:
        """The same fleet with a model and data of its own, for another thread."""
        other = copy.copy(self)
        other.model = copy.copy(self.model)
        other.data = mujoco.MjData(other.model)
        return other

    def refresh(self) -> None:
        """Bring sensors of velocities up to date, which are of the last step's start."""
        if not self.measures_every_stage:
            for name in SENSOR_FUNCTIONS:
                getattr(mujoco, name)(self.model, self.data)

    @property
    def output_joints(self) -> NDArray[np.int64]:
        """(m,) the degree of freedom whose velocity is each output; -1 where it is no joint's."""
        return np.maximum(self.places[:, OUTPUT_AT], -1)

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, 2), a copy: outputs and positions."""
        self.refresh()
        at, sensor = self.places[:, OUTPUT_AT], self.data.sensordata
        output = [self.data.qvel[a] if a >= 0 else sensor[-1 - a] for a in at]
        position = [self.data.qpos[a] if a >= 0 else 0.0 for a in self.places[:, POSITION_AT]]
        return np.column_stack([output, position])

    def reset(self, state: ArrayLike) -> None:
        """See the base class; of all joint velocities with these outputs the smallest are taken."""
        state = np.asarray(state, dtype=np.float64)
        mujoco.mj_resetData(self.model, self.data)
        for at, position in zip(self.places[:, POSITION_AT], state[:, 1], strict=True):
            if at >= 0:
                self.data.qpos[at] = position
        slopes = np.empty((len(state), self.model.nv))
        for column in range(self.model.nv):
            self.data.qvel[:] = 0.0
            self.data.qvel[column] = 1.0
            slopes[:, column] = self.state[:, 0]
        self.data.qvel[:] = np.linalg.lstsq(slopes, state[:, 0], rcond=None)[0]
        mujoco.mj_forward(self.model, self.data)
        missed = np.abs(self.state[:, 0] - state[:, 0])
        if np.max(missed) > 1e-9 * max(1.0, float(np.max(np.abs(state[:, 0])))):
            raise InvalidInput(
                "agents.output",
                self.agents.robots[int(np.argmax(missed))].output,
                "in the file's reference pose no joint velocities give it its initial value",
            )

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        self.data.userdata[:USERDATA_HEADER] = PLANT_MARK, self._table.address
        self.data.ctrl[self.places[:, ACTUATOR]] = u
        with callbacks():
            run_steps()(step_address(), self.model._address, self.data._address, steps)


def _world(robots: tuple[RobotFile, ...]) -> Any:
    world = mujoco.MjSpec.from_string(read_model("lane.xml"))
    floor, across = world.geom("floor"), 0.5 * SPACING * (len(robots) - 1)
    floor.pos[1], floor.size[1] = across, floor.size[1] + across
    for i, robot in enumerate(robots):
        try:
            spec = mujoco.MjSpec.from_file(str(robot.path))
        except (ValueError, OSError) as error:
            raise InvalidInput(
                "agents.file", str(robot.path), f"MuJoCo must read it: {error}"
            ) from None
        for name in ("gravity", "disableflags", "enableflags"):
            own = getattr(spec.option, name)
            if i == 0:
                setattr(world.option, name, own)
            elif np.any(own != getattr(world.option, name)):
                raise InvalidInput(
                    "agents.file", str(robot.path), f"its {name} must be that of the first file"
                )
        for key in list(spec.keys):
            spec.delete(key)
        frame = world.worldbody.add_frame(pos=[0.0, SPACING * i, 0.0])
        world.attach(spec, prefix=f"robot_{i + 1}/", frame=frame)
    # a state that is not a number must be seen, not be reset
    world.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return world


def _named(model: mujoco.MjModel, kind: Any, name: str) -> int:
    return int(mujoco.mj_name2id(model, kind, name))


def _names(model: mujoco.MjModel, kind: str, prefix: str) -> list[str]:
    count = {"joint": model.njnt, "sensor": model.nsensor, "actuator": model.nu}[kind]
    names = [getattr(model, kind)(index).name for index in range(count)]
    return [name.removeprefix(prefix) for name in names if name.startswith(prefix)]
