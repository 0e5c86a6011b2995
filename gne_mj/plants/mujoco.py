"""Flexible robots in MuJoCo: the fleet's model and data, its atan springs as native forces."""

from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput
from gne_mj.native import callback, compiled, source_key, view
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.plants.native_mujoco import (
    CALLBACK,
    Offsets,
    Table,
    call,
    callbacks,
    field,
    floats,
    integers,
    offsets,
    pointer_as_address,
    step_address,
    table_of,
)

INTEGRATORS = {"euler": "Euler", "rk4": "RK4"}
STAGES = {"euler": 1, "rk4": 4}  # evaluations of the dynamics in one step

# A fleet's arrays at the start of every table
MAIN_QPOS, APPENDAGE_QPOS, MAIN_DOF, APPENDAGE_DOF, ACTUATOR, ATAN, SIZES = range(7)
PLANT_TABLE = 7


@view
def gather(at, data, table, state):
    """Fill the flat state (m channels of flexible_robot.STATES) from mjData."""
    sizes = integers(table, SIZES)
    qpos, qvel = field(data, at.qpos, sizes[0]), field(data, at.qvel, sizes[1])
    main, appendage = integers(table, MAIN_QPOS), integers(table, APPENDAGE_QPOS)
    main_dof, appendage_dof = integers(table, MAIN_DOF), integers(table, APPENDAGE_DOF)
    for r in range(len(main)):
        state[4 * r] = qpos[main[r]] - qpos[appendage[r]]
        state[4 * r + 1] = qvel[main_dof[r]]
        state[4 * r + 2] = qvel[appendage_dof[r]]
        state[4 * r + 3] = qpos[main[r]]


@cache
def passive_callback(at: Offsets) -> Any:
    """The C callback that adds the atan term of every spring."""
    source = source_key()

    def passive(model, data):
        _ = source
        struct = pointer_as_address(data)
        table = table_of(at, pointer_as_address(model), struct, PLANT_TABLE)
        if len(table) == 0:
            return
        sizes = integers(table, SIZES)
        qpos = field(struct, at.qpos, sizes[0])
        force = field(struct, at.qfrc_passive, sizes[1])
        main, appendage = integers(table, MAIN_QPOS), integers(table, APPENDAGE_QPOS)
        main_dof, appendage_dof = integers(table, MAIN_DOF), integers(table, APPENDAGE_DOF)
        coefficient = floats(table, ATAN)
        for r in range(len(main)):
            pull = coefficient[r] * np.arctan(qpos[main[r]] - qpos[appendage[r]])
            force[main_dof[r]] -= pull
            force[appendage_dof[r]] += pull

    return callback(CALLBACK, passive)


@cache
def _native() -> Any:
    @compiled
    def run(mj_step, model, data, steps):
        for _step in range(steps):
            call(mj_step, model, data)

    return run


class MujocoPlant(Plant):
    """A fleet of flexible robots in the lane.

    Args:
        agents: flexible robots, one channel each.
        timestep: in s.
        integrator: "rk4" or "euler". MuJoCo's implicit integrators drop the damping of a tendon
            between sibling bodies, and are not offered.
        userdata: room to leave in ``userdata`` behind the entry that this plant needs.
        decorated: keep what is for the eye only.

    Attributes:
        model, data: MuJoCo's own. Step them through this class or a simulation: without its
            callbacks the springs lack their atan term.
    """

    def __init__(
        self,
        agents: Agents,
        timestep: float,
        integrator: str = "rk4",
        *,
        userdata: int = 0,
        decorated: bool = True,
    ) -> None:
        if agents.kind is not flexible_robot:
            raise InvalidInput(
                "plant.engine", "mujoco", f"only flexible robots have a model, not {agents.kind.NAME}s"
            )
        self.agents, self.timestep, self.integrator = agents, timestep, integrator
        self.model = compile_model(
            compose(agents.parameters, decorated=decorated),
            timestep=timestep,
            integrator=INTEGRATORS[integrator],
            userdata=1 + userdata,
        )
        self.data = mujoco.MjData(self.model)
        self.table_arrays = self._table_arrays()
        self._table = Table(self.table_arrays)

    def _table_arrays(self) -> list[NDArray[Any]]:
        def joints(name: str) -> list[Any]:
            return [self.model.joint(f"robot_{i + 1}/{name}") for i in range(self.agents.channels)]

        def each(values: list[Any]) -> NDArray[np.int64]:
            return np.array(values, dtype=np.int64)

        main, appendage = joints("position"), joints("appendage_position")
        actuators = [f"robot_{i + 1}/force" for i in range(self.agents.channels)]
        return [
            each([joint.qposadr[0] for joint in main]),
            each([joint.qposadr[0] for joint in appendage]),
            each([joint.dofadr[0] for joint in main]),
            each([joint.dofadr[0] for joint in appendage]),
            each([self.model.actuator(name).id for name in actuators]),
            np.ascontiguousarray(self.agents.parameters[:, 3]),
            each([self.model.nq, self.model.nv, self.model.nu, self.model.nuserdata]),
        ]

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""
        main_q, appendage_q, main_v, appendage_v = self.table_arrays[:4]
        qpos, qvel = self.data.qpos, self.data.qvel
        columns = (qpos[main_q] - qpos[appendage_q], qvel[main_v], qvel[appendage_v], qpos[main_q])
        return np.stack(columns, axis=1)

    def reset(self, state: ArrayLike) -> None:
        """See the base class."""
        state = np.asarray(state, dtype=np.float64)
        mujoco.mj_resetData(self.model, self.data)
        main_q, appendage_q, main_v, appendage_v = self.table_arrays[:4]
        self.data.qpos[main_q] = state[:, 3]
        self.data.qpos[appendage_q] = state[:, 3] - state[:, 0]
        self.data.qvel[main_v] = state[:, 1]
        self.data.qvel[appendage_v] = state[:, 2]

    def step(self, u: ArrayLike, steps: int = 1) -> None:
        """See the base class."""
        self.data.userdata[0] = self._table.address
        self.data.ctrl[self.table_arrays[ACTUATOR]] = u
        with callbacks(passive=passive_callback(offsets())):
            _native()(step_address(), self.model._address, self.data._address, steps)
