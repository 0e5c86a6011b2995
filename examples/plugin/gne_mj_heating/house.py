"""Agent type ``house``: a boiler's heat y, which warms a store that gives it back slowly.

x1' = k (x2 - x1) + u, x2' = k (x1 - x2), y = x1.
"""

import sys
from typing import Literal

import numpy as np
from pydantic import Field

from gne_mj.native import kernel
from gne_mj.plants.agent_type import complete
from gne_mj.plants.agents import Agents
from gne_mj.plants.table import AgentsTable
from gne_mj.registry import AGENTS
from gne_mj.toml_table import PerAgent, dimension_of

NAME = "house"
PARAMETERS = ("exchange",)
STATES = (("heat", ""), ("stored", ""))
OUTPUT = 0
INPUT_UNIT = ""


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


KIND = complete(sys.modules[__name__])


@AGENTS.register
class HouseAgents(AgentsTable):
    """Houses with a store."""

    type: Literal["house"]
    exchange: PerAgent = Field(1.0, description="k in 1/s, positive")

    def build(self, sizes):
        """The agents, for actions of so many entries each."""
        table = self.rows(sizes, *PARAMETERS, positive=PARAMETERS)
        return Agents(KIND, np.ascontiguousarray(table), self.limits(sizes), dimension_of(sizes))
