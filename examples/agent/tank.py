"""Two tanks side by side, joined by a pipe: an agent type of one's own, as kernels.

x1' = k (x2 - x1) + u, x2' = k (x1 - x2), y = x1: water is added to the first tank and levels out.
With V = (|x1 - y*|^2 + |x2 - y*|^2) / 2, dV/dt = (y - y*) u - k (x1 - x2)^2: passive about every
equilibrium x1 = x2 = y*, u = 0.
"""

import numpy as np

from gne_mj.native import kernel

NAME = "tank pair"
PARAMETERS = ("pipe",)  # k in 1/s
STATES = (("level", ""), ("second_level", ""))  # of the action's unit
OUTPUT = 0
INPUT_UNIT = ""  # the action's per second


def is_passive(parameters):
    """Where water flows from the higher level to the lower."""
    return bool(np.all(parameters[:, 0] > 0))


def energy_balance(parameters):
    """P and D with V = e'Pe/2 and dV/dt = (y - y*) u - e'De, each (m, 2, 2)."""
    difference = np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.tile(np.eye(2), (len(parameters), 1, 1)), parameters[:, :, None] * difference


@kernel
def rate(q, x, u, out):
    """Fill out with x'."""
    out[0] = q[0] * (x[1] - x[0]) + u
    out[1] = q[0] * (x[0] - x[1])


@kernel
def jacobian(q, x, out):
    """Fill out with df/dx."""
    out[0, 0] = out[1, 1] = -q[0]
    out[0, 1] = out[1, 0] = q[0]


@kernel
def equilibrium(q, y, out):
    """The state that rests at the output y with u = 0."""
    out[0] = out[1] = y


@kernel
def storage(q, x, equilibrium_state):
    """V about an equilibrium."""
    return 0.5 * ((x[0] - equilibrium_state[0]) ** 2 + (x[1] - equilibrium_state[1]) ** 2)
