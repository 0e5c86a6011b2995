"""How an output can be pushed: in what unit, and in which direction."""

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray


class Way(NamedTuple):
    """How an output can be pushed.

    Attributes:
        unit: of the force: N, or N m where it turns.
        along: (3,) the force's direction; None where it has none, as where it turns.
        body: in whose frame that is, which may turn; 0 for the world's.
    """

    unit: str
    along: NDArray[np.float64] | None = None
    body: int = 0


def way_of_joint(model: mujoco.MjModel, dof: int, factor: float = 1.0) -> Way:
    """How the velocity of a degree of freedom, times a factor, is pushed."""
    joint, kinds = int(model.dof_jntid[dof]), mujoco.mjtJoint
    kind, place = model.jnt_type[joint], dof - int(model.jnt_dofadr[joint])
    if kind == kinds.mjJNT_FREE and place < 3:
        return Way("N", np.sign(factor) * np.eye(3)[place])
    if kind != kinds.mjJNT_SLIDE:
        return Way("N m")
    body, along = int(model.jnt_bodyid[joint]), np.empty(3)
    mujoco.mju_rotVecQuat(along, model.jnt_axis[joint], model.body_quat[body])
    return Way("N", np.sign(factor) * along, int(model.body_parentid[body]))
