"""PI controller in cascade with a stable first-order system [eq:cascadePI].

x = (y, s) with y' = -v y + k s + u and s' = u, 0 < k < v. The storage V = x'Px/2 needs
P G = (1, 0)' and PA + A'P <= 0, which leaves one choice: P = [[1 + r, -r], [-r, r]] with
r = k / (v - k); for v = 1, k = 1/2 it is [[2, -1], [-1, 1]].

Channel parameters q = [v, k], both in 1/s.
"""

import sys
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.native import kernel
from gne_mj.plants.agents import Agents
from gne_mj.plants.table import AgentsTable
from gne_mj.registry import AGENTS
from gne_mj.toml_table import PerAgent, Sizes, Unit, dimension_of

LANES = True  # numbers or lanes
NAME = "PI cascade"
PARAMETERS = ("decay_rate", "integral_gain")
STATES = (("action", ""), ("integral", ""))
OUTPUT = 0
INPUT_UNIT = ""
LINEAR = True


def is_passive(parameters: NDArray[np.float64]) -> bool:
    """Whether 0 < k < v for every channel; parameters (m, 2)."""
    return bool(np.all((parameters[:, 1] > 0) & (parameters[:, 1] < parameters[:, 0])))


def energy_balance(parameters: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """As :func:`gne_mj.plants.integrator.energy_balance`: e'De = (v e_y - k e_s)^2 / (v - k)."""
    v, k = parameters.T
    r = k / (v - k)
    storage = np.array([[1.0 + r, -r], [-r, r]])
    dissipation = np.array([[v * v, -v * k], [-v * k, k * k]]) / (v - k)
    return np.moveaxis(storage, -1, 0), np.moveaxis(dissipation, -1, 0)


@kernel
def rate(q, x, u, out):
    """Fill out with x'."""
    out[0] = -q[0] * x[0] + q[1] * x[1] + u
    out[1] = u


@kernel
def euler_step(q, x, u, h, out):
    """One Euler step."""
    output = x[0] + h * (-q[0] * x[0] + q[1] * x[1] + u)
    out[1] = x[1] + h * u
    out[0] = output


@kernel
def jacobian(q, x, out):
    """Fill out with df/dx."""
    out[0, 0] = -q[0]
    out[0, 1] = q[1]
    out[1, 0] = 0.0
    out[1, 1] = 0.0


@kernel
def equilibrium(q, y, out):
    """The state pi(y) that rests at the output y with u = 0."""
    out[0] = y
    out[1] = q[0] * y / q[1]


@kernel
def storage(q, x, equilibrium_state):
    """V^{x*}(x), the Bregman divergence of V from the equilibrium ``equilibrium_state``."""
    r = q[1] / (q[0] - q[1])
    output, integral = x[0] - equilibrium_state[0], x[1] - equilibrium_state[1]
    return 0.5 * (output * output + r * (output - integral) ** 2)


@kernel
def shared(q, x):
    """Nothing that both the rate and V need is worth keeping."""
    return 0.0


@kernel
def rate_given(q, x, u, known, out):
    """As :func:`rate`, with what :func:`shared` returned."""
    rate(q, x, u, out)


@kernel
def storage_given(q, x, equilibrium_state, known):
    """As :func:`storage`, likewise."""
    return storage(q, x, equilibrium_state)


@AGENTS.register
class PiCascadeAgents(AgentsTable):
    """First-order systems behind a PI controller [eq:cascadePI]"""

    type: Literal["pi-cascade"]
    decay_rate: Annotated[PerAgent, Unit("1/s", "> 0")] = Field(1.0, description="v")
    integral_gain: Annotated[PerAgent, Unit("1/s", "0 < k < v")] = Field(0.5, description="k")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        table = self.rows(sizes, *PARAMETERS, positive=PARAMETERS)
        if np.any(table[:, 1] >= table[:, 0]):
            raise InvalidInput(
                "integral_gain",
                self.integral_gain,
                "it must be below decay_rate (0 < k < v)",
            )
        return Agents(sys.modules[__name__], table, self.limits(sizes), dimension_of(sizes))
