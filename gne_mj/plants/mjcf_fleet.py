"""Fleets of the user's own robots: any MJCF with a velocity to measure and an actuator to drive."""

import sys
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput, named, nearest
from gne_mj.native import kernel
from gne_mj.numbers import dtype_in
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plants import mjcf_file, mjcf_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.callbacks import callbacks, quiet
from gne_mj.plants.fleet import compile_model, read_model
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.plants.mjcf_actuator import make_force
from gne_mj.plants.mjcf_contacts import check_apart, owners_of, share_floors, sizes_of
from gne_mj.plants.mjcf_prediction import (
    SENSOR_FUNCTIONS,
    ChannelPlace,
    Prediction,
    actuator_of,
    add_forces,
    gather,
    refresh,
)
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile
from gne_mj.plants.mujoco import INTEGRATORS, Sizes, run_steps
from gne_mj.plants.native_mujoco import (
    KNOWN_STATE,
    PLANT_MARK,
    USERDATA_HEADER,
    check_warnings,
    offsets,
    passive_callback,
    step_address,
)
from gne_mj.records import by_name

__all__ = ["AGENT", "MjcfPlant", "actuator_of", "add_forces", "gather", "refresh", "stored"]

SPACING = 2.0  # m between robots, so that they do not touch
# What to do where they do
BESIDE = f", {SPACING:g} m beside it: make its file narrower, or its floor a plane, which all share"
TOGETHER = ": let their positions begin farther apart, or make its floor a plane, which all share"
SENSOR = mujoco.mjtSensor
VELOCITIES = (SENSOR.mjSENS_JOINTVEL, SENSOR.mjSENS_TENDONVEL, SENSOR.mjSENS_ACTUATORVEL)

AGENT = mjcf_robot


@kernel
def stored(channels, state, userdata):
    """Not known."""
    return 0.0


class MjcfPlant(FleetPlant):
    """A fleet of the user's own robots in MuJoCo.

    Each file's bodies are attached to one world, side by side, or at one place where their
    positions are what they decide; all must have the same options
    (gravity, density, flags and so on); contacts are between a robot's own geoms and whatever its
    file brings along, a floor that several bring being one. A fleet starts from the models'
    reference pose at the given outputs. An input is the force of its actuator, gain and gear
    divided out.

    Args:
        agents: which robots.
        timestep: in s.
        integrator: "rk4" or "euler".
        userdata: room to leave in ``userdata`` behind what this plant needs itself.
        memory: room for a law's memory in ``act``, behind what the robots have there.
        decorated: no matter here: files are kept as they are.

    Attributes:
        kernels: the module that says how a loop reads and drives the fleet.
        model, data: MuJoCo's own.

    Raises:
        InvalidInput: a file that MuJoCo cannot read, a name that it does not have, an actuator
            that is no force, or that would clamp inputs that the agents' limit allows.
    """

    agents: MjcfRobots

    def __init__(
        self,
        agents: MjcfRobots,
        timestep: float,
        integrator: str = "rk4",
        *,
        userdata: int = 0,
        memory: int = 0,
        decorated: bool = True,
    ) -> None:
        self.agents, self.timestep, self.integrator = agents, timestep, integrator
        self.kernels = sys.modules[__name__]
        numbers = self._lookahead(agents)
        self.passive = passive_callback(offsets(), self.kernels) if len(numbers) else None
        with named(path="agents.path"):
            world, sizes_of_robots, memory_asked = _world(agents)
        with named(world="agents.path"):
            self.model = compile_model(
                world, timestep=timestep, integrator=INTEGRATORS[integrator],
                userdata=USERDATA_HEADER + userdata, memory=memory, arena=memory_asked,
            )  # fmt: skip
        self.data = mujoco.MjData(self.model)
        with quiet():
            mujoco.mj_fwdPosition(self.model, self.data)
        self._owners = owners_of(self.model, sizes_of_robots)
        share_floors(self.model, self.data, self._owners)
        flat = np.array(
            [self._place(i, robot) for i, robot in enumerate(agents.robots)], dtype=np.int64
        )
        self.places = by_name(flat, dtype_in(ChannelPlace))
        model = self.model
        self._twin = mujoco.MjData(model)  # where mode implicit predicts
        self.sizes = Sizes(
            model.nq, model.nv, model.nu, model.nuserdata, model.na, USERDATA_HEADER,
            model.na - memory,
        )  # fmt: skip
        prediction = Prediction(
            model.nsensordata, self._twin._address, KNOWN_STATE, step_address(),
            step_address("mj_copyState"),
            0 if self.measures_every_stage else step_address("mj_forward"),
            *(step_address(name) for name in SENSOR_FUNCTIONS),
        )  # fmt: skip
        sizes = np.array([*self.sizes, *prediction], dtype=np.int64)
        self.parameter_arrays = [flat, numbers, sizes]
        self._parameter_block = ParameterBlock(self.parameter_arrays)

    def arrays_for(self, agents: Agents) -> list[NDArray[Any]]:
        """The table's arrays for agents with numbers of their own besides those in their files."""
        places, _, sizes = self.parameter_arrays
        return [places, self._lookahead(agents), sizes]

    @staticmethod
    def _lookahead(agents: Agents) -> NDArray[np.float64]:
        """tau, d and v_0 of each channel; nothing where outputs are velocities."""
        return np.ascontiguousarray(agents.parameters).ravel()

    def model_fields(
        self, parameters: NDArray[np.float64]
    ) -> list[tuple[str, NDArray[np.int64], NDArray[np.float64]]]:
        """None: what files say is not changed."""
        return []

    @property
    def configuration(self) -> int:
        """Joint positions to record: all, since the state has but the outputs' joints."""
        return int(self.model.nq)

    @property
    def measures_every_stage(self) -> bool:
        """Whether outputs are fresh at every stage: MuJoCo's sensors are so at the first only."""
        return bool(np.all(self.places.output >= 0))

    def _place(self, i: int, robot: RobotFile) -> tuple[int, int, int]:
        model, prefix = self.model, f"robot_{i // self.agents.dimension + 1}/"
        joint = _named(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + robot.output)
        sensor = _named(model, mujoco.mjtObj.mjOBJ_SENSOR, prefix + robot.output)
        actuator = _named(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + robot.input)
        if actuator < 0:
            names = _names(model, "actuator", prefix)
            raise InvalidInput("agents.input", robot.input, nearest(robot.input, names))
        kind = _check_sensor(model, robot, sensor) if sensor >= 0 else None
        own = kind == SENSOR.mjSENS_ACTUATORVEL and model.sensor_objid[sensor] == actuator
        with named(robot="agents"):
            least = make_force(model, self.data, robot, actuator, own_velocity=own)
        self._check_limit(i, robot, least)
        ctrl = int(model.actuator_ctrladr[actuator])
        if kind is not None:
            if kind != SENSOR.mjSENS_JOINTVEL and self.passive is not None:
                raise InvalidInput(
                    "agents.output", robot.output, "with a lookahead it must be a joint"
                )
            if kind != SENSOR.mjSENS_JOINTVEL:
                return -1 - int(model.sensor_adr[sensor]), -1, ctrl
            joint = int(model.sensor_objid[sensor])
        if joint < 0:
            names = [*_names(model, "joint", prefix), *_names(model, "sensor", prefix)]
            raise InvalidInput("agents.output", robot.output, nearest(robot.output, names))
        if mujoco.mjtJoint(model.jnt_type[joint]) not in (
            mujoco.mjtJoint.mjJNT_SLIDE,
            mujoco.mjtJoint.mjJNT_HINGE,
        ):
            raise InvalidInput("agents.output", robot.output, "it must be a slide or a hinge joint")
        return int(model.jnt_dofadr[joint]), int(model.jnt_qposadr[joint]), ctrl

    def _check_limit(self, i: int, robot: RobotFile, least: float) -> None:
        """MuJoCo clamps silently; what the law asks for must not be changed unseen."""
        if least <= 0:
            raise InvalidInput(
                "agents.input", robot.input, "its ranges must leave forces of both signs"
            )
        if self.agents.input_limit[i] > least:
            raise InvalidInput(
                "agents.input_limit",
                float(self.agents.input_limit[i]),
                f"actuator '{robot.input}' of agent"
                f" {i // self.agents.dimension + 1} clamps its force: give a limit of at"
                f" most {least:g}",
            )

    def refresh(self) -> None:
        """Bring sensors of velocities up to date, which are of the last step's start."""
        if not self.measures_every_stage:
            with quiet():
                for name in SENSOR_FUNCTIONS:
                    getattr(mujoco, name)(self.model, self.data)

    @property
    def outputs(self) -> list[str]:
        """See the base class."""
        return [robot.output for robot in self.agents.robots]

    @property
    def output_joints(self) -> NDArray[np.int64]:
        """(m,) the degree of freedom whose velocity is each output; -1 where it is no joint's."""
        return np.maximum(self.places.output, -1)

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, 2), a copy: outputs and positions."""
        self.refresh()
        at, sensor = self.places.output, self.data.sensordata
        output = [self.data.qvel[a] if a >= 0 else sensor[-1 - a] for a in at]
        position = [self.data.qpos[a] if a >= 0 else 0.0 for a in self.places.position]
        found = np.column_stack([output, position])
        if self.passive is not None:
            tau, _, reference = self.agents.parameters.T
            found[:, 1] -= reference * self.data.time
            found[:, 0] = found[:, 1] + tau * (found[:, 0] - reference)
        return found

    def reset(self, state: ArrayLike) -> None:
        """See the base class; of all joint velocities with these outputs the smallest are taken."""
        state = np.asarray(state, dtype=np.float64)
        mujoco.mj_resetData(self.model, self.data)
        for at, position in zip(self.places.position, state[:, 1], strict=True):
            if at >= 0:
                self.data.qpos[at] = position
        slopes = np.empty((len(state), self.model.nv))
        still = self.state[:, 0]
        for column in range(self.model.nv):
            self.data.qvel[:] = 0.0
            self.data.qvel[column] = 1.0
            slopes[:, column] = self.state[:, 0] - still
        self.data.qvel[:] = np.linalg.lstsq(slopes, state[:, 0] - still, rcond=None)[0]
        with quiet():
            mujoco.mj_forward(self.model, self.data)
        advice = TOGETHER if self.agents.together else BESIDE
        with named(robots="agents.path"):
            check_apart(self.model, self.data, self._owners, self.agents.files, advice)
        missed = np.abs(self.state[:, 0] - state[:, 0])
        if np.max(missed) > 1e-9 * max(1.0, float(np.max(np.abs(state[:, 0])))):
            raise InvalidInput(
                "agents.output",
                self.agents.robots[int(np.argmax(missed))].output,
                "in the file's reference pose no joint velocities give it its initial value",
            )

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        self.data.userdata[:USERDATA_HEADER] = PLANT_MARK, self._parameter_block.address
        self.data.ctrl[self.places.actuator] = u
        with callbacks(passive=self.passive):
            run_steps()(step_address(), self.model._address, self.data._address, steps)
        check_warnings(self.data)


PLANT = MjcfPlant


def _world(agents: MjcfRobots) -> tuple[Any, list[tuple[int, int]], int]:
    """A fleet's MjSpec, its robots' :func:`sizes_of`, and the memory that they ask for in bytes."""
    world = mujoco.MjSpec.from_string(read_model("lane.xml"))
    robots, spacing = agents.files, 0.0 if agents.together else SPACING
    floor, across = world.geom("floor"), 0.5 * spacing * (len(robots) - 1)
    floor.pos[1], floor.size[1] = across, floor.size[1] + across
    for path in dict.fromkeys(robot.path for robot in robots):
        mjcf_file.alone(path)  # which finds what is wrong with it
    sizes, memory = [], 0
    for i, robot in enumerate(robots):
        spec = mjcf_file.read(robot.path)
        if i == 0:
            mjcf_file.adopt_options(world, spec)
        mjcf_file.check_options(world, spec, robot.path)
        sizes.append(sizes_of(spec))
        memory += max(spec.memory, 0)
        place = (0.0, spacing * i, 0.0)
        mjcf_file.attach(world, spec, robot.path, prefix=f"robot_{i + 1}/", at=place)
    return world, sizes, memory


def _check_sensor(model: mujoco.MjModel, robot: RobotFile, sensor: int) -> Any:
    """The sensor's type; refused if it tells no velocity, or not the present one."""
    kind, expected = SENSOR(model.sensor_type[sensor]), ""
    if kind not in VELOCITIES:
        expected = "a sensor must be jointvel, tendonvel or actuatorvel"
    elif model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_SENSOR:
        expected = "the file's flags switch sensors off: name a joint, or leave the flag out"
    elif (
        model.sensor_cutoff[sensor]
        or model.sensor_delay[sensor]
        or model.sensor_interval[sensor, 0]
    ):
        expected = (
            "the sensor must tell the velocity as it is: leave out its cutoff, delay and interval,"
            " and declare late sensors as a fault instead"
        )
    if expected:
        raise InvalidInput("agents.output", robot.output, expected)
    return kind


def _named(model: mujoco.MjModel, kind: Any, name: str) -> int:
    return int(mujoco.mj_name2id(model, kind, name))


def _names(model: mujoco.MjModel, kind: str, prefix: str) -> list[str]:
    count = {"joint": model.njnt, "sensor": model.nsensor, "actuator": model.nu}[kind]
    names = [getattr(model, kind)(index).name for index in range(count)]
    return [name.removeprefix(prefix) for name in names if name.startswith(prefix)]
