"""Flexible robot: two masses joined by a nonlinear spring and a damper [eq:MobileRobot].

With the main mass at d and its appendage at e, the states are the extension x1 = d - e (m), the
main mass's velocity x2 (m/s, the output), the appendage's velocity x3 (m/s), and, beside the
paper's three, the position d (m), on which no force depends:

x1' = x2 - x3,  M x2' = -psi(x1) - gamma (x2 - x3) + u,  m x3' = psi(x1) + gamma (x2 - x3)

The spring is psi(x) = stiffness * x + atan_coefficient * atan(x); the paper prints it with the
opposite sign, which would not be monotone. V is the energy, int psi + M/2 x2^2 + m/2 x3^2.

Channel parameters q = [M, m, stiffness, atan_coefficient, gamma].
"""

import numpy as np
from numpy.typing import NDArray

from gne_mj.elementary import arctangent, logarithm
from gne_mj.native import kernel

LANES = True  # numbers or lanes
NAME = "flexible robot"
PARAMETERS = ("main_mass", "appendage_mass", "stiffness", "atan_coefficient", "damping")
STATES = (
    ("extension", "m"),
    ("velocity", "m/s"),
    ("appendage_velocity", "m/s"),
    ("position", "m"),
)
OUTPUT = 1
POSITIONS = (0, 3)  # moved by the new velocities in an Euler step
INPUT_UNIT = "N"
FLEET = "gne_mj.plants.mujoco"  # the module of its fleets in MuJoCo
PLACED = "position"  # the state at which agents start apart from each other


def is_passive(parameters: NDArray[np.float64]) -> bool:
    """Whether every robot meets Assumption [asmp:nonlinearPlant]; parameters (m, 5).

    psi is strongly monotone, since its slope lies between stiffness and stiffness +
    atan_coefficient, and the damper dissipates.
    """
    _, _, stiffness, atan_coefficient, damping = parameters.T
    return bool(
        np.all(np.minimum(stiffness, stiffness + atan_coefficient) > 0) & np.all(damping > 0)
    )


def energy_balance(parameters: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """As :func:`gne_mj.plants.integrator.energy_balance`, over extension and both velocities.

    Only the damper dissipates, gamma (x2 - x3)^2: nothing in the extension.
    """
    main, appendage, stiffness, atan_coefficient, damping = parameters.T
    storage, dissipation = np.zeros((2, len(parameters), 3, 3))
    storage[:, 0, 0] = np.maximum(stiffness, stiffness + atan_coefficient)
    storage[:, 1, 1], storage[:, 2, 2] = main, appendage
    dissipation[:, 1:, 1:] = damping[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return storage, dissipation


@kernel
def shared(q, x):
    """What both the rate and V need: the extension's arctangent."""
    return arctangent(x[0])


@kernel
def spring_force(q, x, arctangent):
    """Force of spring and damper on the appendage, in N (the main mass feels its opposite)."""
    return q[2] * x[0] + q[3] * arctangent + q[4] * (x[1] - x[2])


@kernel
def rate(q, x, u, out):
    """Fill out with x'; u in N."""
    rate_given(q, x, u, arctangent(x[0]), out)


@kernel
def rate_given(q, x, u, arctangent, out):
    """The same where the extension's arctangent is at hand."""
    force = spring_force(q, x, arctangent)
    out[0] = x[1] - x[2]
    out[1] = (u - force) / q[0]
    out[2] = force / q[1]
    out[3] = x[1]


@kernel
def euler_step(q, x, u, h, out):
    """One semi-implicit Euler step, as MuJoCo's: velocities first, positions with the new ones."""
    force = spring_force(q, x, arctangent(x[0]))
    velocity = x[1] + h * (u - force) / q[0]
    appendage = x[2] + h * force / q[1]
    out[0] = x[0] + h * (velocity - appendage)
    out[1] = velocity
    out[2] = appendage
    out[3] = x[3] + h * velocity


@kernel
def jacobian(q, x, out):
    """Fill out with df/dx."""
    slope = q[2] + q[3] / (1.0 + x[0] * x[0])
    for r in range(4):
        for s in range(4):
            out[r, s] = 0.0
    out[0, 1] = 1.0
    out[0, 2] = -1.0
    out[1, 0] = -slope / q[0]
    out[1, 1] = -q[4] / q[0]
    out[1, 2] = q[4] / q[0]
    out[2, 0] = slope / q[1]
    out[2, 1] = q[4] / q[1]
    out[2, 2] = -q[4] / q[1]
    out[3, 1] = 1.0


@kernel
def equilibrium(q, y, out):
    """The state pi(y): spring relaxed, both masses at the velocity y (the position is free)."""
    out[0] = 0.0
    out[1] = y
    out[2] = y
    out[3] = 0.0


@kernel
def storage(q, x, equilibrium_state):
    """V^{x*}(x): since psi(0) = 0 at rest, the energy of the deviation."""
    return storage_given(q, x, equilibrium_state, arctangent(x[0]))


@kernel
def storage_given(q, x, equilibrium_state, arctangent):
    """The same where the extension's arctangent is at hand."""
    extension = x[0]
    spring = 0.5 * q[2] * extension * extension + q[3] * (
        extension * arctangent - 0.5 * logarithm(1.0 + extension * extension)
    )
    main, appendage = x[1] - equilibrium_state[1], x[2] - equilibrium_state[2]
    return spring + 0.5 * q[0] * main * main + 0.5 * q[1] * appendage * appendage
