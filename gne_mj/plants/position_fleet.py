"""Flexible robots in MuJoCo whose outputs are positions with a look-ahead.

The same bodies as :mod:`gne_mj.plants.mujoco` has. There they really move with the reference: what
is relative to it is computed from MuJoCo's own positions, velocities and time. Each robot's own
damping is a passive force on its main mass.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.native import kernel
from gne_mj.parameter_block import floats, integers
from gne_mj.plants import position_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.mujoco import (
    ATAN,
    PLACES,
    MujocoPlant,
    add_atan_forces,
    drive,
    drive_again,
    place_of,
    push,
    refresh,
    sizes_in,
    stored_of,
)
from gne_mj.plants.native_mujoco import field, number
from gne_mj.plants.position_robot import LOCAL_DAMPING, LOOKAHEAD, REFERENCE_VELOCITY

__all__ = [
    "AGENT", "PLANT", "add_forces", "drive", "drive_again", "gather", "push", "refresh", "stored",
]  # fmt: skip

AGENT = position_robot

# Which parameters are in ATAN, a row of each: the springs' coefficients first
FORCES = (3, LOOKAHEAD, LOCAL_DAMPING, REFERENCE_VELOCITY)


@kernel
def gather(at, data, parameter_block, state):
    """Fill the flat state (m channels of position_robot.STATES) from mjData."""
    sizes, time = sizes_in(parameter_block), number(data, at.time)
    qpos, qvel = field(data, at.qpos, sizes.nq), field(data, at.qvel, sizes.nv)
    places, numbers = integers(parameter_block, PLACES), floats(parameter_block, ATAN)
    m = len(numbers) // len(FORCES)
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
    return stored_of(position_robot, channels, state, userdata)


@kernel
def add_forces(at, data, parameter_block):
    """Add the atan term of every spring and every robot's own damping to the passive forces."""
    numbers = floats(parameter_block, ATAN)
    m = len(numbers) // len(FORCES)
    add_atan_forces(at, data, parameter_block, m)
    sizes, places = sizes_in(parameter_block), integers(parameter_block, PLACES)
    qvel = field(data, at.qvel, sizes.nv)
    force = field(data, at.qfrc_passive, sizes.nv)
    for r in range(m):
        joint = place_of(places, r).main_v
        force[joint] -= numbers[2 * m + r] * (qvel[joint] - numbers[3 * m + r])


class PositionPlant(MujocoPlant):
    """A fleet of flexible robots whose outputs are positions; arguments as of the base class."""

    @staticmethod
    def _forces(agents: Agents) -> NDArray[np.float64]:
        return agents.parameters[:, FORCES].T.ravel()

    @property
    def _reference(self) -> NDArray[np.float64]:
        found: NDArray[np.float64] = self.agents.parameters[:, REFERENCE_VELOCITY]
        return found

    @property
    def state(self) -> NDArray[np.float64]:
        """(m, states), a copy."""
        at, qpos, qvel = self.places, self.data.qpos, self.data.qvel
        v_0 = self._reference
        position = qpos[at.main_q] - v_0 * self.data.time
        output = position + self.agents.parameters[:, LOOKAHEAD] * (qvel[at.main_v] - v_0)
        extension = qpos[at.main_q] - qpos[at.appendage_q]
        return np.stack((extension, output, qvel[at.appendage_v] - v_0, position), axis=-1)

    def reset(self, state: ArrayLike) -> None:
        """See the base class."""
        state = np.array(state, dtype=np.float64)
        state[:, 1] = position_robot.velocity(self.agents.parameters, state) + self._reference
        state[:, 2] += self._reference
        super().reset(state)

    def go_to_time(self, time: float) -> None:
        """See the base class: robots are where the reference is then."""
        qpos, _ = self.joints
        self.data.qpos[qpos] += self._reference * (time - self.data.time)
        super().go_to_time(time)


PLANT = PositionPlant
