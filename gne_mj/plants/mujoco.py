"""Flexible robots in MuJoCo: the fleet's model and data, its atan springs as native forces."""

import sys
from functools import cache
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.elementary import arctangent
from gne_mj.errors import InvalidInput, named, part_of
from gne_mj.native import compiled, kernel, part, source_key
from gne_mj.numbers import Numbers, dtype_in, names_of, numbers_in
from gne_mj.parameter_block import ParameterBlock, floats, integers
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet import HULL, compile_model, compose, element_names
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.plants.native_mujoco import (
    PLANT_MARK,
    USERDATA_HEADER,
    field,
    offsets,
    passive_callback,
    step_address,
    timed_step,
)
from gne_mj.plants.way import Way, way_of_joint
from gne_mj.records import by_name, in_numbers

INTEGRATORS = {"euler": "Euler", "rk4": "RK4"}
STAGES = {"euler": 1, "rk4": 4}  # evaluations of the dynamics in one step

# A fleet's arrays at the start of every table
PLACES, ATAN, SIZES = range(3)


class RobotPlace(Numbers):
    """Where a robot's numbers lie in qpos, qvel and ctrl: what PLACES has of each."""

    main_q: int
    appendage_q: int
    main_v: int
    appendage_v: int
    actuator: int


class Sizes(NamedTuple):
    """Lengths of mjData's arrays, and where parts of them begin."""

    nq: int
    nv: int
    nu: int
    nuserdata: int
    na: int
    workspace: int  # a loop's, in userdata
    memory: int  # in act
    owners: int  # address of the agent that each geom belongs to, from 0, -1 of none; or 0
    channels: int  # m
    pushes: int  # address of those at outputs, as FleetPlant has them


PLACE = len(names_of(RobotPlace))
sizes_in, _place_in = in_numbers(Sizes, SIZES), numbers_in(RobotPlace)

# A fleet's userdata: mark and table, then the springs' arctangents at the last evaluation
ARCTANGENTS = USERDATA_HEADER

# What a loop asks of a module of fleets: its agents' type and the kernels that follow
AGENT = flexible_robot


@kernel
def place_of(places, r):
    """Where the numbers of channel r lie."""
    return _place_in(places, r * PLACE)


@kernel
def gather(at, data, parameter_block, state):
    """Fill the flat state (m channels of flexible_robot.STATES) from mjData."""
    sizes = sizes_in(parameter_block)
    qpos, qvel = field(data, at.qpos, sizes.nq), field(data, at.qvel, sizes.nv)
    places = integers(parameter_block, PLACES)
    for r in range(len(places) // PLACE):
        place = place_of(places, r)
        position = qpos[place.main_q]
        state[4 * r] = position - qpos[place.appendage_q]
        state[4 * r + 1] = qvel[place.main_v]
        state[4 * r + 2] = qvel[place.appendage_v]
        state[4 * r + 3] = position


@kernel
def refresh(model, data, parameter_block):
    """Bring sensors up to date: none is read."""


@kernel
def actuator_of(places, r):
    """Which entry of ctrl is the input of channel r."""
    return place_of(places, r).actuator


@kernel
def drive(at, data, parameter_block, u, on):
    """Make inputs u (m,) mjData's controls; zero if not ``on``."""
    places = integers(parameter_block, PLACES)
    ctrl = field(data, at.ctrl, sizes_in(parameter_block).nu)
    for r in range(len(u)):
        ctrl[actuator_of(places, r)] = u[r] if on else 0.0


@kernel
def push(where, model, data, parameter_block, forces, applied):
    """Add to joint forces (nv,) what forces (m,) at the outputs' joints are: themselves."""
    places = integers(parameter_block, PLACES)
    for r in range(len(forces)):
        applied[place_of(places, r).main_v] += forces[r]


@kernel
def drive_again(at, model, data, parameter_block, u):
    """What is to be done where another step begins under the same inputs: nothing."""


@kernel
def stored(channels, state, userdata):
    """V^{x*} of all robots, with the arctangents that the passive callback has just kept."""
    return stored_of(flexible_robot, channels, state, userdata)


@kernel
def stored_of(kind, channels, state, userdata):
    """The same, of robots of a type with these springs, ``kind`` being its module."""
    total = 0.0
    for r in range(len(channels.equilibrium_state)):
        x = state[4 * r : 4 * r + 4]
        total += kind.storage_given(
            channels.parameters[r], x, channels.equilibrium_state[r], userdata[ARCTANGENTS + r]
        )
    return total


@kernel
def add_forces(at, data, parameter_block):
    """Add the atan term of every spring to mjData's passive forces."""
    add_atan_forces(at, data, parameter_block, len(floats(parameter_block, ATAN)))


@kernel
def add_atan_forces(at, data, parameter_block, m):
    """The same, of m springs whose coefficients are the first m numbers in ATAN."""
    sizes = sizes_in(parameter_block)
    qpos = field(data, at.qpos, sizes.nq)
    force = field(data, at.qfrc_passive, sizes.nv)
    places, coefficient = integers(parameter_block, PLACES), floats(parameter_block, ATAN)
    angles = part(field(data, at.userdata, ARCTANGENTS + m), ARCTANGENTS, m)
    for r in range(m):
        place = place_of(places, r)
        angles[r] = qpos[place.main_q] - qpos[place.appendage_q]
    for r in range(len(angles)):  # by itself, so that it takes vectors; kept for V as well
        angles[r] = arctangent(angles[r])
    for r in range(m):
        place = place_of(places, r)
        spring_force = coefficient[r] * angles[r]
        force[place.main_v] -= spring_force
        force[place.appendage_v] += spring_force


@cache
def run_steps() -> Any:
    """The native loop of plain mj_step: (address of mj_step, of the model, of the data, steps)."""

    at, source = offsets(), source_key()

    @compiled
    def run(mj_step, model, data, steps):
        _ = source
        for _step in range(steps):
            timed_step(at, mj_step, model, data)

    return run


@compiled
def _gather(qpos, qvel, at_q, at_v, state):
    """Fill a state (m, 4); joints are (2, m), main masses' and appendages'."""
    for r in range(len(state)):
        position = qpos[at_q[0, r]]
        state[r, 0], state[r, 3] = position - qpos[at_q[1, r]], position
        state[r, 1], state[r, 2] = qvel[at_v[0, r]], qvel[at_v[1, r]]


class MujocoPlant(FleetPlant):
    """A fleet of flexible robots in the lane, or of planar ones in the plane.

    Args:
        agents: flexible robots, of one channel each or (planar) of two.
        timestep: in s.
        integrator: "rk4" or "euler". MuJoCo's implicit integrators drop the damping of a tendon
            between sibling bodies, and are not offered.
        userdata: room to leave in ``userdata`` behind what this plant needs itself.
        memory: room for a law's memory in ``act``.
        decorated: keep what no step needs, see :func:`gne_mj.plants.fleet.compose`.

    Attributes:
        kernels: the module that says how a loop reads and drives the fleet.
        model, data: MuJoCo's own. Step them through this class or a simulation: without its
            callbacks the springs lack their atan term.
        joints: (2, m) main masses' and appendages' entries of qpos, and of qvel.
    """

    def __init__(
        self,
        agents: Agents,
        timestep: float,
        integrator: str = "rk4",
        *,
        userdata: int = 0,
        memory: int = 0,
        decorated: bool = True,
    ) -> None:
        kernels: Any = sys.modules[type(self).__module__]
        if agents.kind is not kernels.AGENT:
            raise InvalidInput(
                "agents", agents.kind.NAME, f"this fleet is of {kernels.AGENT.NAME}s"
            )
        self.agents, self.timestep, self.integrator = agents, timestep, integrator
        self.kernels = kernels
        self.passive = passive_callback(offsets(), kernels)
        with part_of("agents"), named(world="agents"):
            self.model = compile_model(
                compose(
                    agents.parameters[:, :5],
                    dimension=agents.dimension,
                    decorated=decorated,
                    contacts=agents.contacts,
                ),
                timestep=timestep,
                integrator=INTEGRATORS[integrator],
                userdata=ARCTANGENTS + agents.channels + userdata,
                memory=memory,
            )
        self.data = mujoco.MjData(self.model)
        self.parameter_arrays = self._parameter_arrays()
        self._parameter_block = ParameterBlock(self.parameter_arrays)

    def _parameter_arrays(self) -> list[NDArray[Any]]:
        def names(what: str) -> list[str]:
            return element_names(what, self.agents.channels, self.agents.dimension)

        def joints(what: str) -> list[Any]:
            return [self.model.joint(name) for name in names(what)]

        main, appendage = joints("position"), joints("appendage_position")
        flat = np.empty((self.agents.channels, PLACE), dtype=np.int64)
        self.places = by_name(flat, dtype_in(RobotPlace))
        self.places.main_q = [joint.qposadr[0] for joint in main]
        self.places.appendage_q = [joint.qposadr[0] for joint in appendage]
        self.places.main_v = [joint.dofadr[0] for joint in main]
        self.places.appendage_v = [joint.dofadr[0] for joint in appendage]
        self.places.actuator = [self.model.actuator(name).id for name in names("force")]
        self.joints = flat[:, :2].T.copy(), flat[:, 2:4].T.copy()
        model, channels = self.model, self.agents.channels
        self._geom_owners, self.pushes = self._owners(), np.zeros(1 + channels)
        self.sizes = Sizes(
            model.nq, model.nv, model.nu, model.nuserdata, model.na, ARCTANGENTS + channels, 0,
            self._geom_owners.ctypes.data, channels, self.pushes.ctypes.data,
        )  # fmt: skip
        return [flat, self._forces(self.agents), np.array(self.sizes, dtype=np.int64)]

    def _owners(self) -> NDArray[np.int64]:
        """(geoms,) which agent each that collides belongs to, from 0; -1 for all others."""
        model, found = self.model, np.full(self.model.ngeom, -1, dtype=np.int64)
        if self.agents.contacts:
            hulls = [model.geom(f"robot_{i + 1}/{HULL}").id for i in range(self.agents.count)]
            found[hulls] = np.arange(self.agents.count)
        return found

    @staticmethod
    def _forces(agents: Agents) -> NDArray[np.float64]:
        """What ``add_forces`` needs of the agents, flat: ATAN."""
        return np.ascontiguousarray(agents.parameters[:, 3])

    def arrays_for(self, agents: Agents) -> list[NDArray[Any]]:
        """The table's arrays for agents with numbers of their own, as in a batch of runs."""
        places, _, sizes = self.parameter_arrays
        return [places, self._forces(agents), sizes]

    def model_fields(
        self, parameters: NDArray[np.float64]
    ) -> list[tuple[str, NDArray[np.int64], NDArray[np.float64]]]:
        """What robots' numbers (runs, m, ...) are in mjModel: field, its entries, values (runs, k).

        What MuJoCo derives from them (``mj_setConst``) is not among them, nor is the atan term.
        """
        d, bodies = self.agents.dimension, range(1, self.agents.count + 1)
        springs = element_names("spring", self.agents.channels, d)
        tendons = np.array([self.model.tendon(name).id for name in springs])
        main = np.array([self.model.body(f"robot_{i}/main").id for i in bodies])
        appendage = np.array([self.model.body(f"robot_{i}/appendage").id for i in bodies])
        return [
            ("body_mass", main, parameters[:, ::d, 0]),
            ("body_mass", appendage, parameters[:, ::d, 1]),
            ("tendon_stiffness", tendons, parameters[:, :, 2]),
            ("tendon_damping", tendons, parameters[:, :, 4]),
        ]

    def refresh(self) -> None:
        """Bring the springs' arctangents up to date, which are of the last step's start.

        The callback must be installed. Contacts, where there are such, likewise.
        """
        if self.agents.contacts:
            mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_passive(self.model, self.data)

    @property
    def outputs(self) -> list[str]:
        """See the base class."""
        return element_names("position", self.agents.channels, self.agents.dimension)

    @property
    def output_joints(self) -> NDArray[np.int64]:
        """(m,) the degree of freedom whose velocity is each output."""
        found: NDArray[np.int64] = self.places.main_v
        return found

    def way(self, channel: int) -> Way | None:
        """See the base class."""
        return way_of_joint(self.model, int(self.output_joints[channel]))

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""
        found = np.empty((self.agents.channels, 4))
        _gather(self.data.qpos, self.data.qvel, *self.joints, found)
        return found

    def reset(self, state: ArrayLike) -> None:
        """See the base class."""
        state = np.asarray(state, dtype=np.float64)
        mujoco.mj_resetData(self.model, self.data)
        position, (qpos, qvel) = state[:, 3], self.joints
        self.data.qpos[qpos] = position, position - state[:, 0]
        self.data.qvel[qvel] = state[:, 1], state[:, 2]

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        self.data.userdata[:USERDATA_HEADER] = PLANT_MARK, self._parameter_block.address
        self.data.ctrl[self.places.actuator] = u
        with callbacks(passive=self.passive):
            run_steps()(step_address(), self.model._address, self.data._address, steps)


PLANT = MujocoPlant
