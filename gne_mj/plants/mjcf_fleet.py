"""Fleets of the user's own robots: any MJCF with a velocity to measure and an actuator to drive."""

import sys
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput, named
from gne_mj.native import compiled, kernel, source_key
from gne_mj.numbers import dtype_in
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plain import raise_pending
from gne_mj.plants import mjcf_robot, mjcf_start
from gne_mj.plants.agents import Agents
from gne_mj.plants.callbacks import callbacks, quiet
from gne_mj.plants.fleet import compile_model
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.plants.mjcf_contacts import counted_owners, let_touch, owners_of
from gne_mj.plants.mjcf_drive import driving
from gne_mj.plants.mjcf_floors import show_one_floor
from gne_mj.plants.mjcf_low_level import (
    controllers_of,
    fleet_controls,
    limits_met,
    own_entries,
    read_all,
)
from gne_mj.plants.mjcf_pose import check_leaves
from gne_mj.plants.mjcf_prediction import (
    ChannelPlace,
    Prediction,
    add_forces,
    controls_of,
    drive,
    drive_again,
    gather,
    prediction_in,
    refresh,
)
from gne_mj.plants.mjcf_push import push, way_of
from gne_mj.plants.mjcf_reading import Term, array_word, fresh_by, terms_of
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile
from gne_mj.plants.mjcf_world import world_of
from gne_mj.plants.mujoco import INTEGRATORS, Sizes, run_steps
from gne_mj.plants.native_mujoco import (
    KNOWN_STATE,
    PLANT_MARK,
    STATE,
    USERDATA_HEADER,
    check_warnings,
    offsets,
    passive_callback,
    step_address,
    timed_step,
)
from gne_mj.plants.way import Way, way_of_joint
from gne_mj.records import by_name

__all__ = [
    "AGENT",
    "MjcfPlant",
    "add_forces",
    "drive",
    "drive_again",
    "gather",
    "push",
    "refresh",
    "stored",
]

AGENT = mjcf_robot


@kernel
def stored(channels, state, userdata):
    """Not known."""
    return 0.0


class MjcfPlant(FleetPlant):
    """A fleet of the user's own robots in MuJoCo.

    Each file's bodies are attached to one world, where poses say, side by side, or at one place
    where their positions are what they decide; all must have the same options
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
        lookahead = agents.parameters.size
        self.passive = passive_callback(offsets(), self.kernels) if lookahead else None
        with named(path="agents.path"):
            controllers = controllers_of(agents)
            world, parts, floors, memory_asked = world_of(agents, controllers)
        own = own_entries(controllers)
        with named(world="agents.path"):
            self.model = compile_model(
                world, timestep=timestep, integrator=INTEGRATORS[integrator],
                userdata=USERDATA_HEADER + own + userdata, memory=memory, arena=memory_asked,
            )  # fmt: skip
        self.data = mujoco.MjData(self.model)
        with quiet():
            mujoco.mj_fwdPosition(self.model, self.data)
        self.owners = owners_of(self.model, parts, floors)
        show_one_floor(self.model, self.data, self.owners)
        let_touch(self.model, self.owners, agents.touching)
        self._terms: list[Term] = []  # of all outputs that are no joint's
        with named(input="agents.input", output="agents.output"):
            self._driving = driving(self.model, self.data, agents)
            self.low_level = fleet_controls(self.model, self.data, agents, controllers)
        flat = np.array(
            [self._place(i, robot) for i, robot in enumerate(agents.robots)], dtype=np.int64
        )
        self.places = by_name(flat, dtype_in(ChannelPlace))
        model = self.model
        self.reference = mjcf_start.reference(model, agents, parts)
        self.settled: dict[Any, NDArray[np.float64]] = {}
        self._twin = mujoco.MjData(model)  # where mode implicit predicts
        self._geom_owners = counted_owners(model, self.owners)
        self.pushes = np.zeros(1 + agents.channels)
        self.sizes = Sizes(
            model.nq, model.nv, model.nu, model.nuserdata, model.na, USERDATA_HEADER + own,
            model.na - memory, self._geom_owners.ctypes.data, agents.channels,
            self.pushes.ctypes.data,
        )  # fmt: skip
        numbers = self._numbers(agents)
        self.parameter_arrays = [flat, numbers, self._sizes(lookahead)]
        self._parameter_block = ParameterBlock(self.parameter_arrays)

    def _sizes(self, lookahead: int) -> NDArray[np.int64]:
        """What compiled code has in SIZES."""
        terms = [*self._terms, *self.low_level.terms]
        controls = self.low_level.behind(
            len(self._terms), lookahead + len(terms) + len(self._driving.factors)
        )
        functions = [
            step_address(name) if name else 0
            for names in (self._refreshing, fresh_by(self.low_level.terms))
            for name in (names or ("", "", ""))
        ]
        prediction = Prediction(
            self._twin._address, KNOWN_STATE, lookahead, array_word(self.data, "cvel"),
            array_word(self.data, "subtree_com"), len(terms), len(self._driving.factors),
            len(controls.controllers), controls.room, step_address(),
            step_address("mj_copyState"), *functions,
        )  # fmt: skip
        readings = [number for term in terms for number in term.numbers(self.data)]
        drives = self._driving.numbers
        return np.array(
            [*self.sizes, *prediction, *readings, *drives, *controls.places], dtype=np.int64
        )

    def arrays_for(self, agents: Agents) -> list[NDArray[Any]]:
        """The table's arrays for agents with numbers of their own besides those in their files."""
        places, _, sizes = self.parameter_arrays
        return [places, self._numbers(agents), sizes]

    def _numbers(self, agents: Agents) -> NDArray[np.float64]:
        """tau, d and v_0 of each channel, nothing where outputs are velocities; then factors, of
        readings and of drives, and the controllers' numbers."""
        factors = [term.factor for term in (*self._terms, *self.low_level.terms)]
        return np.concatenate(
            [np.ravel(agents.parameters), factors, self._driving.factors, self.low_level.numbers]
        )

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
    def state_bits(self) -> int:
        """See the base class; controllers keep in userdata what they began with."""
        return STATE | int(mujoco.mjtState.mjSTATE_USERDATA) * bool(self.low_level.controllers)

    @property
    def lets_through(self) -> NDArray[np.float64]:
        """(m,) the greatest |u| that the files' clamps let through unchanged."""
        return self._driving.lets_through(self.agents.channels)

    @property
    def measures_every_stage(self) -> bool:
        """Whether outputs are fresh at every stage: MuJoCo's sensors are so at the first only."""
        return all(term.fresh for term in self._terms)

    @property
    def _refreshing(self) -> tuple[str, ...]:
        """The functions of MuJoCo's that bring outputs up to date after a step."""
        return fresh_by(self._terms)

    def _place(self, i: int, robot: RobotFile) -> tuple[int, int, int]:
        model, prefix = self.model, f"robot_{i // self.agents.dimension + 1}/"
        with named(output="agents.output"):
            terms = terms_of(model, prefix, robot.output)
        only = terms[0]
        if len(terms) == 1 and only.source == "qvel" and only.factor == 1.0:
            if self.passive is not None:
                agent = i // self.agents.dimension
                check_leaves(model, self.data, only.entry, agent, self.agents.places[agent])
            return only.entry, only.place_entry, 0
        self._check_ahead(i, robot, terms)
        self._terms += terms
        return -1 - (len(self._terms) - len(terms)), -1, len(terms)

    def _check_ahead(self, i: int, robot: RobotFile, terms: list[Term]) -> None:
        """With a look-ahead outputs must have positions, and but joints a damping of their own."""
        if self.passive is None:
            return
        expected = ""
        if any(term.place_entry < 0 for term in terms):
            expected = (
                "with a lookahead it must have a position, as a joint, a tendon, or a body's linear"
                " velocity in the world has"
            )
        elif self.agents.parameters[i, 1]:
            expected = (
                "with a lookahead local_damping acts at joints: name one, or set local_damping to"
                " 0 and leave the damping to the file"
            )
        if expected:
            raise InvalidInput("agents.output", str(robot.output), expected)

    def refresh(self) -> None:
        """Bring up to date what is read besides joints, which is of the last step's start."""
        with quiet():
            for name in self._refreshing:
                getattr(mujoco, name)(self.model, self.data)

    @property
    def outputs(self) -> list[str]:
        """See the base class."""
        return [str(robot.output) for robot in self.agents.robots]

    @property
    def output_joints(self) -> NDArray[np.int64]:
        """(m,) the degree of freedom whose velocity is each output; -1 where it is no joint's."""
        return np.maximum(self.places.output, -1)

    def way(self, channel: int) -> Way | None:
        """See the base class."""
        place = self.places[channel]
        if place.output >= 0:
            return way_of_joint(self.model, int(place.output))
        first = -1 - int(place.output)
        return way_of(self.model, self.data, self._terms[first : first + int(place.readings)])

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, 2), a copy: outputs and positions."""
        self.refresh()
        found = np.empty((self.agents.channels, 2))
        _gather()(self.data._address, self._parameter_block.address, found.ravel())
        return found

    def reset(self, state: ArrayLike) -> None:
        """See the base class, and :mod:`gne_mj.plants.mjcf_start`."""
        mjcf_start.reset(self, np.asarray(state, dtype=np.float64))

    def prepare(self, state: NDArray[np.float64]) -> None:
        """See the base class: a fleet that settles moves before it starts."""
        if self.agents.settle:
            mjcf_start.settled(self, state[:, 1])

    @property
    def standing(self) -> NDArray[np.float64]:
        """(m, 2) where it starts if nothing is said of it; it is left there."""
        return mjcf_start.standing(self)

    def read(self, which: int, out: NDArray[np.float64]) -> None:
        """Fill out with what a controller reads, in a state that is evaluated."""
        _readings()(self.data._address, self._parameter_block.address, which, out)

    @property
    def limits_met(self) -> dict[int, dict[str, float]]:
        """See the base class."""
        return limits_met(self.data, self.low_level)

    @property
    def holds_weight(self) -> dict[int, bool]:
        """See the base class."""
        return {i: each.holds_weight for i, each in self.low_level.controllers.items()}

    @property
    def output_moves(self) -> NDArray[np.float64]:
        """See the base class."""
        return mjcf_start.output_moves(self)

    def controls(self, u: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Write into out (nu,) what inputs u (m,) make of the controls that follow from them."""
        self._driving.set(out, u)

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        block = self._parameter_block.address
        self.data.userdata[:USERDATA_HEADER] = PLANT_MARK, block
        given = np.array(u, dtype=np.float64)
        self._driving.set(self.data.ctrl, given)
        with callbacks(passive=self.passive):
            if self.low_level.controllers:
                _driven_steps()(self.model._address, self.data._address, block, given, steps)
                raise_pending()
            else:
                run_steps()(step_address(), self.model._address, self.data._address, steps)
        check_warnings(self.data)


PLANT = MjcfPlant


@cache
def _gather() -> Any:
    """The kernel that fills a flat state: (address of mjData, of the parameter block, state)."""
    at, source = offsets(), source_key()

    @compiled
    def read(data, parameter_block, state):
        _ = source
        gather(at, data, parameter_block, state)

    return read


@cache
def _readings() -> Any:
    """Fills what a controller reads: (address of mjData, of the parameter block, which, out)."""
    source = source_key()

    @compiled
    def read(data, parameter_block, which, out):
        _ = source
        read_all(data, controls_of(parameter_block), which, out)

    return read


@cache
def _driven_steps() -> Any:
    """The native loop of steps under held inputs that controllers drive with at each of them."""
    at, source = offsets(), source_key()

    @compiled
    def run(model, data, parameter_block, u, steps):
        _ = source
        for _step in range(steps):
            drive_again(at, model, data, parameter_block, u)
            timed_step(at, prediction_in(parameter_block).step, model, data)

    return run
