"""Flexible robots in MuJoCo whose outputs are positions with a look-ahead.

The same bodies as :mod:`gne_mj.plants.mujoco` has. There they really move with the reference: what
is relative to it is computed from MuJoCo's own positions, velocities and time. Each robot's own
damping is a passive force on its main mass.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.native import callback, kernel, source_key
from gne_mj.parameter_block import floats, integers
from gne_mj.plants import position_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.mujoco import (
    ARCTANGENTS,
    ATAN,
    PLACES,
    MujocoPlant,
    actuator_of,
    place_of,
    refresh,
    sizes_in,
)
from gne_mj.plants.native_mujoco import (
    CALLBACK,
    Offsets,
    address_of,
    field,
    number,
    parameter_block_of,
)

__all__ = ["AGENT", "PLANT", "actuator_of", "gather", "refresh", "stored"]

AGENT = position_robot

# Behind the springs' coefficients in ATAN, a row of each: of which parameters
FORCES = (3, 5, 6, 7)  # atan_coefficient, tau, d, v_0


@kernel
def gather(at, data, parameter_block, state):
    """Fill the flat state (m channels of position_robot.STATES) from mjData."""
    sizes, time = sizes_in(parameter_block), number(data, at.time)
    qpos, qvel = field(data, at.qpos, sizes.nq), field(data, at.qvel, sizes.nv)
    places, numbers = integers(parameter_block, PLACES), floats(parameter_block, ATAN)
    m = len(numbers) // 4
    for r in range(m):
        place, tau, reference = place_of(places, r), numbers[m + r], numbers[3 * m + r]
        position = qpos[place.main_q] - reference * time
        state[4 * r] = qpos[place.main_q] - qpos[place.appendage_q]
        state[4 * r + 1] = position + tau * (qvel[place.main_v] - reference)
        state[4 * r + 2] = qvel[place.appendage_v] - reference
        state[4 * r + 3] = position


@kernel
def stored(channels, state, userdata):
    """V^{x*} of all robots, with the arctangents that the passive callback has just kept."""
    total = 0.0
    for r in range(len(channels.equilibrium_state)):
        x = state[4 * r : 4 * r + 4]
        total += position_robot.storage_given(
            channels.parameters[r], x, channels.equilibrium_state[r], userdata[ARCTANGENTS + r]
        )
    return total


@cache
def passive_callback(at: Offsets) -> Any:
    """The C callback that adds the atan term of every spring and every robot's own damping."""
    source = source_key()

    def passive(model, data):
        _ = source
        struct = address_of(data)
        parameter_block = abs(parameter_block_of(at, address_of(model), struct))
        if parameter_block == 0:
            return
        sizes = sizes_in(parameter_block)
        qpos, qvel = field(struct, at.qpos, sizes.nq), field(struct, at.qvel, sizes.nv)
        force = field(struct, at.qfrc_passive, sizes.nv)
        places, numbers = integers(parameter_block, PLACES), floats(parameter_block, ATAN)
        m = len(numbers) // 4
        kept = field(struct, at.userdata, ARCTANGENTS + m)
        for r in range(m):
            place = place_of(places, r)
            arctangent = np.arctan(qpos[place.main_q] - qpos[place.appendage_q])
            kept[ARCTANGENTS + r] = arctangent  # for the storage function, which needs it again
            spring_force = numbers[r] * arctangent
            moving = qvel[place.main_v] - numbers[3 * m + r]
            force[place.main_v] -= spring_force + numbers[2 * m + r] * moving
            force[place.appendage_v] += spring_force

    return callback(CALLBACK, passive)


class PositionPlant(MujocoPlant):
    """A fleet of flexible robots whose outputs are positions; arguments as of the base class."""

    @staticmethod
    def _forces(agents: Agents) -> NDArray[np.float64]:
        return agents.parameters[:, FORCES].T.ravel()

    @property
    def _reference(self) -> NDArray[np.float64]:
        found: NDArray[np.float64] = self.agents.parameters[:, 7]
        return found

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""
        at, qpos, qvel = self.places, self.data.qpos, self.data.qvel
        v_0 = self._reference
        position = qpos[at.main_q] - v_0 * self.data.time
        output = position + self.agents.parameters[:, 5] * (qvel[at.main_v] - v_0)
        extension = qpos[at.main_q] - qpos[at.appendage_q]
        return np.stack((extension, output, qvel[at.appendage_v] - v_0, position), axis=-1)

    def reset(self, state: ArrayLike) -> None:
        """See the base class."""
        state = np.array(state, dtype=np.float64)
        state[:, 1] = position_robot.velocity(self.agents.parameters, state) + self._reference
        state[:, 2] += self._reference
        super().reset(state)


PLANT = PositionPlant
