"""A robot that is known by its MJCF alone, whose output is a joint's position with a look-ahead.

y = q + tau v of a slide (or hinge) joint, relative to a reference that moves at v_0, with a
damping d of its own: :mod:`gne_mj.plants.lookahead`. Nothing is known of its storage function.
Channel parameters q = [tau, d, v_0].
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gne_mj.native import kernel
from gne_mj.plants import lookahead

Array = NDArray[np.float64]

NAME = "MJCF position robot"
PARAMETERS = ("lookahead", "local_damping", "reference_velocity")
STATES = (("output", ""), ("position", "m or rad"))
OUTPUT = 0
POSITION = 1
INPUT_UNIT = "N or N m"
KNOWS_STORAGE = False
FLEET = "gne_mj.plants.mjcf_fleet"


def is_passive(parameters: Array) -> bool:
    """Not known."""
    return False


def velocity(parameters: Array, state: Array) -> Array:
    """(..., m) v, relative to the reference, at states (..., m, 2)."""
    return lookahead.velocity(parameters[:, 0], state[..., OUTPUT], state[..., POSITION])


DERIVED = (
    (
        "velocity",
        "m/s or rad/s",
        lambda parameters, state, time: velocity(parameters, state),
    ),
)


def start(parameters: Array, rest: Array, given: Mapping[str, Array]) -> Array:
    """(m, 2) states at the start."""
    return lookahead.start(parameters[:, 0], rest, given, (OUTPUT, POSITION))[0]


@kernel
def equilibrium(q, y, out):
    """At rest at y."""
    out[0] = y
    out[1] = y


@kernel
def storage(q, x, equilibrium_state):
    """Not known: nothing is measured."""
    return 0.0
