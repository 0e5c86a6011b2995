"""Flexible robot whose output is its main mass's position with a look-ahead, y = q + tau v.

All is relative to a reference that moves at a constant velocity v_0: with the main mass at q and
its appendage at q - s, the states are the extension s (m), the output y (m), the appendage's
velocity w (m/s) and the position q (m); the main mass's velocity is v = (y - q)/tau. Its own
damping d acts beside the input:

s' = v - w,  M v' = -psi(s) - gamma (v - w) + u - d v,  m w' = psi(s) + gamma (v - w),  q' = v

The storage function is V = tau (M v^2/2 + m w^2/2 + int psi) + q (M v + m w) + d q^2/2, and

V' = y u - [(tau d - M - m) v^2 + m v (v - w) + tau gamma (v - w)^2],

likewise for the differences of two motions. The bracket is never negative if and only if
d >= (M + m)/tau + m^2/(4 tau^2 gamma) (docs/positions.md has the proof).

Channel parameters q = [M, m, stiffness, atan_coefficient, gamma, tau, d, v_0]. No force depends on
v_0: only MuJoCo, where the reference really moves, needs it.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gne_mj.elementary import arctangent, logarithm
from gne_mj.native import kernel
from gne_mj.plants import flexible_robot, lookahead

Array = NDArray[np.float64]

NAME = "position robot"
PARAMETERS = (*flexible_robot.PARAMETERS, "lookahead", "local_damping", "reference_velocity")
LOOKAHEAD, LOCAL_DAMPING, REFERENCE_VELOCITY = 5, 6, 7  # columns of the last three
STATES = (
    ("extension", "m"),
    ("output", "m"),
    ("appendage_velocity", "m/s"),
    ("position", "m"),
)
OUTPUT = 1
POSITION = 3  # which follows the output: q' = (y - q)/tau
INPUT_UNIT = "N"
FLEET = "gne_mj.plants.position_fleet"


def least_damping(parameters: Array) -> Array:
    """(m,) the d from which on the bracket is never negative; infinite without a damper."""
    main, appendage, _, _, gamma, tau = parameters.T[:6]
    with np.errstate(divide="ignore"):
        return (main + appendage) / tau + appendage**2 / (4.0 * tau**2 * gamma)


def is_passive(parameters: Array) -> bool:
    """Whether every robot meets Assumption [asmp:nonlinearPlant]; parameters (m, 8).

    With more than the least damping: at the least itself the output can rest while q moves, so
    that the state cannot be told from it.
    """
    damping = parameters[:, 6]
    return flexible_robot.is_passive(parameters[:, :5]) and bool(
        np.all(damping > least_damping(parameters))
    )


def why_not_passive(parameters: Array, dimension: int = 1) -> str:
    """What is missing, in words; empty if nothing is.

    Args:
        parameters: (m, ...) of the channels.
        dimension: channels of each agent.
    """
    if not flexible_robot.is_passive(parameters[:, :5]):
        return "a spring is not strongly monotone or has no damper"
    short = parameters[:, 6] - least_damping(parameters)
    worst = int(np.argmin(short))
    if short[worst] > 0:
        return ""
    return (
        f"local_damping {parameters[worst, 6]:.6g} N s/m of agent {worst // dimension + 1} must"
        f" exceed (M + m)/tau + m^2/(4 tau^2 gamma) = {least_damping(parameters)[worst]:.6g} N s/m"
    )


def energy_balance(parameters: Array) -> tuple[Array, Array]:
    """As :func:`gne_mj.plants.integrator.energy_balance`, over all states.

    Nothing is dissipated in the extension.
    """
    main, appendage, stiffness, atan_coefficient, gamma, tau, damping, _ = parameters.T
    storage, dissipation = np.zeros((2, len(parameters), 4, 4))  # over s, v, w, q first
    storage[:, 0, 0] = tau * np.maximum(stiffness, stiffness + atan_coefficient)
    storage[:, 1, 1], storage[:, 2, 2], storage[:, 3, 3] = tau * main, tau * appendage, damping
    storage[:, 1, 3] = storage[:, 3, 1] = main
    storage[:, 2, 3] = storage[:, 3, 2] = appendage
    dissipation[:, 1, 1] = tau * damping - main + tau * gamma
    dissipation[:, 1, 2] = dissipation[:, 2, 1] = -0.5 * appendage - tau * gamma
    dissipation[:, 2, 2] = tau * gamma
    back = np.stack([np.linalg.inv(physical(row)) for row in parameters])
    turned = back.transpose(0, 2, 1)
    return turned @ storage @ back, turned @ dissipation @ back


def physical(q: Array) -> Array:
    """(4, 4) from (s, v, w, q), where Euler's step is semi-implicit, to the states."""
    matrix = np.eye(4)
    matrix[1] = 0.0, q[5], 0.0, 1.0
    return matrix


POSITIONS = (0, 3)  # of (s, v, w, q), moved by the new velocities in an Euler step


def velocity(parameters: Array, state: Array) -> Array:
    """(..., m) v in m/s, relative to the reference, at states (..., m, 4)."""
    return lookahead.velocity(parameters[:, 5], state[..., OUTPUT], state[..., POSITION])


# What follows from states (T, m, 4) at times (T,): where robots are, of which the reference is at 0
# at the start, and how fast they move relative to it
DERIVED = (
    ("velocity", "m/s", lambda parameters, state, time: velocity(parameters, state)),
    (
        "place",
        "m",
        lambda parameters, state, time: state[..., POSITION] + time[:, None] * parameters[:, 7],
    ),
)


def start(parameters: Array, rest: Array, given: Mapping[str, Array]) -> Array:
    """(m, 4) states at the start; appendages that are not given move with their masses."""
    state, moving = lookahead.start(parameters[:, 5], rest, given, (OUTPUT, POSITION))
    state[:, 0] = given.get("extension", state[:, 0])
    state[:, 2] = given.get("appendage_velocity", moving)
    return state


@kernel
def shared(q, x):
    """What both the rate and V need: the extension's arctangent."""
    return arctangent(x[0])


@kernel
def spring_force(q, x, v, arctangent):
    """Force of spring and damper on the appendage, in N (the main mass feels its opposite)."""
    return q[2] * x[0] + q[3] * arctangent + q[4] * (v - x[2])


@kernel
def rate(q, x, u, out):
    """Fill out with x'; u in N."""
    rate_given(q, x, u, arctangent(x[0]), out)


@kernel
def rate_given(q, x, u, arctangent, out):
    """The same where the extension's arctangent is at hand."""
    v = (x[1] - x[3]) / q[5]
    force = spring_force(q, x, v, arctangent)
    out[0] = v - x[2]
    out[1] = v + q[5] * (u - q[6] * v - force) / q[0]
    out[2] = force / q[1]
    out[3] = v


@kernel
def euler_step(q, x, u, h, out):
    """One semi-implicit Euler step, as MuJoCo's: velocities first, positions with the new ones."""
    v = (x[1] - x[3]) / q[5]
    force = spring_force(q, x, v, arctangent(x[0]))
    v += h * (u - q[6] * v - force) / q[0]
    appendage = x[2] + h * force / q[1]
    out[0] = x[0] + h * (v - appendage)
    out[2] = appendage
    out[3] = x[3] + h * v
    out[1] = out[3] + q[5] * v


@kernel
def jacobian(q, x, out):
    """Fill out with df/dx."""
    slope = q[2] + q[3] / (1.0 + x[0] * x[0])
    for r in range(4):
        for s in range(4):
            out[r, s] = 0.0
    v, pull = 1.0 / q[5], q[4] / q[5]  # of v and of the damper's force, to y and less to q
    out[0, 1] = v
    out[0, 2] = -1.0
    out[0, 3] = -v
    out[1, 0] = -q[5] * slope / q[0]
    out[1, 1] = v - (q[6] + q[4]) / q[0]
    out[1, 2] = q[5] * q[4] / q[0]
    out[1, 3] = -out[1, 1]
    out[2, 0] = slope / q[1]
    out[2, 1] = pull / q[1]
    out[2, 2] = -q[4] / q[1]
    out[2, 3] = -pull / q[1]
    out[3, 1] = v
    out[3, 3] = -v


@kernel
def equilibrium(q, y, out):
    """The state pi(y): at rest at y, spring relaxed."""
    out[0] = 0.0
    out[1] = y
    out[2] = 0.0
    out[3] = y


@kernel
def storage(q, x, equilibrium_state):
    """V^{x*}(x), the Bregman divergence of V from the equilibrium ``equilibrium_state``."""
    return storage_given(q, x, equilibrium_state, arctangent(x[0]))


@kernel
def storage_given(q, x, equilibrium_state, arctangent):
    """The same where the extension's arctangent is at hand."""
    extension, v, w = x[0], (x[1] - x[3]) / q[5], x[2]
    away = x[3] - equilibrium_state[3]
    energy = 0.5 * q[2] * extension * extension + q[3] * (
        extension * arctangent - 0.5 * logarithm(1.0 + extension * extension)
    )
    energy += 0.5 * q[0] * v * v + 0.5 * q[1] * w * w
    return q[5] * energy + away * (q[0] * v + q[1] * w) + 0.5 * q[6] * away * away
