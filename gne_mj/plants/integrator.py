"""Integrator agent [eq:int]: y' = u, one state a channel; V = y^2 / 2.

Every agent module describes one channel, that is one scalar output with its input; an agent with
an action of m_i entries is m_i such channels. It defines PARAMETERS (their names), STATES (names
and units; an empty unit stands for the action's), OUTPUT (which of them is y; the others are
recorded under their names), INPUT_UNIT (empty: the action's per second), ``is_passive`` (whether
given parameters meet the theory's assumption), and the kernels below; x' is affine in u. It may
define ``energy_balance``, from which the theory's rates follow, LINEAR (x' is linear in x and u,
which adds to y', and V is what the balance says), FLEET (the module of its fleets in
MuJoCo, which has a ``PLANT``: :mod:`gne_mj.plants.fleet_plant`), PLACED (the state that is a
place, at which agents start apart), POSITION (the state that is a position which follows the
output, :mod:`gne_mj.plants.lookahead`), DERIVED (what follows from its states, as triples of name,
unit and function), POSITIONS (which states an Euler step moves by the new values of the others)
with ``physical`` where that is so in other coordinates, ``start`` (the states at the start, of what
is given) and ``why_not_passive`` (in words, of agents with so many channels).
"""

import sys
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gne_mj.native import kernel
from gne_mj.plants.agents import Agents
from gne_mj.plants.table import AgentsTable
from gne_mj.registry import AGENTS
from gne_mj.toml_table import Sizes, dimension_of

LANES = True  # numbers or lanes
NAME = "integrator"
PARAMETERS: tuple[str, ...] = ()
STATES = (("action", ""),)
OUTPUT = 0
INPUT_UNIT = ""
LINEAR = True


def is_passive(parameters: NDArray[np.float64]) -> bool:
    """Always: y' = u meets Assumption [asmp:nonlinearPlant]."""
    return True


def energy_balance(parameters: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """P and D, each (m, s, s), over the first s states, those that V depends on.

    With e the deviation from the equilibrium x* = pi(y*), V^{x*} <= e'Pe/2 (here equal) and along
    all motions dV^{x*}/dt = (y - y*) u - e'De.
    """
    ones = np.ones((len(parameters), 1, 1))
    return ones, 0.0 * ones


@kernel
def rate(q, x, u, out):
    """Fill out with x'."""
    out[0] = u


@kernel
def euler_step(q, x, u, h, out):
    """One Euler step."""
    out[0] = x[0] + h * u


@kernel
def jacobian(q, x, out):
    """Fill out with df/dx."""
    out[0, 0] = 0.0


@kernel
def equilibrium(q, y, out):
    """The state pi(y) that rests at the output y with u = 0."""
    out[0] = y


@kernel
def storage(q, x, equilibrium_state):
    """V^{x*}(x), the Bregman divergence of V from the equilibrium ``equilibrium_state``."""
    return 0.5 * (x[0] - equilibrium_state[0]) ** 2


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
class IntegratorAgents(AgentsTable):
    """y' = u [eq:int]"""

    type: Literal["integrator"]

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        table = np.zeros((sum(sizes), 0))
        return Agents(sys.modules[__name__], table, self.limits(sizes), dimension_of(sizes))
