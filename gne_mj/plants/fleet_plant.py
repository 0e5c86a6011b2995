"""Fleets in MuJoCo, whatever their agents are: how one is built, and what all of them offer."""

import copy
from abc import abstractmethod
from types import ModuleType
from typing import TYPE_CHECKING, Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.plants.agent_type import fleet_module
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.native_mujoco import STATE
from gne_mj.plants.way import Way

if TYPE_CHECKING:
    from gne_mj.plants.mujoco import Sizes


class FleetPlant(Plant):
    """A fleet in MuJoCo.

    Attributes:
        kernels: the module that says how a loop reads and drives the fleet.
        passive: the C callback of its passive forces; None without.
        model, data: MuJoCo's own.
        places: where native code finds each channel's numbers, (m,) by name.
        sizes: of MuJoCo's arrays.
        pushes: (1 + m,) the address of a loop's control callback, and the forces at outputs, while
            there are any (:mod:`gne_mj.plants.push`).
        parameter_arrays: the fleet's arrays at the start of every table.
    """

    kernels: ModuleType
    passive: Any
    model: mujoco.MjModel
    data: mujoco.MjData
    places: Any
    sizes: "Sizes"
    pushes: NDArray[np.float64]
    parameter_arrays: list[NDArray[Any]]

    @property
    def configuration(self) -> int:
        """Joint positions to record besides the state: none where the state says them."""
        return 0

    @property
    def measures_every_stage(self) -> bool:
        """Whether outputs are fresh at every stage of a step."""
        return True

    @property
    def limits_met(self) -> dict[int, dict[str, float]]:
        """Since the start, for each agent (from 0) with a low-level controller: the actuators that
        it asked for more than they give, by name, and in what part of all evaluations; and
        "controller" where it gave less by limits of its own."""
        return {}

    @property
    def holds_weight(self) -> dict[int, bool]:
        """For each agent (from 0) with a low-level controller whether that holds its weight."""
        return {}

    @property
    def output_moves(self) -> NDArray[np.float64]:
        """(m, nv) how outputs' velocities are made of joint velocities; these are zero then.

        Raises:
            NotImplementedError: of a fleet without low-level controllers, where nobody asks.
        """
        raise NotImplementedError

    @property
    def state_bits(self) -> int:
        """Of mjtState, what puts a fleet back to where it was, but for what a loop keeps."""
        return STATE

    @property
    @abstractmethod
    def output_joints(self) -> NDArray[np.int64]:
        """(m,) the degree of freedom whose velocity is each output; -1 where it is no joint's."""

    @abstractmethod
    def way(self, channel: int) -> Way | None:
        """How an output (from 0) can be pushed; None if it is a sensor's of which no force is
        known."""

    def push_unit(self, channel: int) -> str:
        """What forces at an output are measured in: N, or N m where it turns."""
        way = self.way(channel)
        return "N" if way is None else way.unit

    @property
    @abstractmethod
    def outputs(self) -> list[str]:
        """What each agent's output is called, for messages."""

    @abstractmethod
    def arrays_for(self, agents: Agents) -> list[NDArray[Any]]:
        """The table's arrays for agents with numbers of their own, as in a batch of runs."""

    @abstractmethod
    def model_fields(
        self, parameters: NDArray[np.float64]
    ) -> list[tuple[str, NDArray[np.int64], NDArray[np.float64]]]:
        """What agents' numbers (runs, m, ...) are in mjModel: field, its entries, values (runs, k).

        What MuJoCo derives from them (``mj_setConst``) is not among them.
        """

    def go_to_time(self, time: float) -> None:
        """Let it be another time in s; what is told of the state stays."""
        self.data.time = time

    def prepare(self, state: NDArray[np.float64]) -> None:
        """Do what a reset to (m, states) needs that cannot be done while others are stepped."""

    @abstractmethod
    def refresh(self) -> None:
        """Bring up to date what is read and of the last step's start."""

    def twin(self) -> Self:
        """The same fleet with a model and data of its own, for another thread."""
        other = copy.copy(self)
        other.model = copy.copy(self.model)
        other.data = mujoco.MjData(other.model)
        return other


def build_fleet(
    agents: Agents,
    timestep: float,
    integrator: str = "rk4",
    *,
    userdata: int = 0,
    memory: int = 0,
    decorated: bool = True,
) -> FleetPlant:
    """The fleet of these agents, by the module that their type names.

    Args:
        agents: of a type that has bodies.
        timestep: in s.
        integrator: "rk4" or "euler".
        userdata: room to leave in ``userdata`` behind what the fleet needs itself.
        memory: room for a law's memory in ``act``.
        decorated: keep what no step needs, see :func:`gne_mj.plants.fleet.compose`; files of a
            user's own are kept as they are.

    Raises:
        InvalidInput: agents that have no bodies, or numbers or files that make none.
    """
    module = fleet_module(agents.kind)
    if module is None:
        raise InvalidInput("agents", agents.kind.NAME, "they have no model in MuJoCo")
    plant: FleetPlant = module.PLANT(
        agents, timestep, integrator, userdata=userdata, memory=memory, decorated=decorated
    )
    return plant
