"""An agent type's kernels as C functions, compiled by themselves, and the kernels that call them.

A loop is compiled once for all types. It finds their functions by the addresses in
``Channels.functions``; one call does its work for all channels, so that calling costs next to
nothing.
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.native import (
    address_in,
    call_integer,
    call_number,
    callback,
    kernel,
    shaped,
    source_key,
)
from gne_mj.parameter_block import floats_at
from gne_mj.plants.agent_type import has_ode

EULER, RK4 = 0, 1
METHODS = {"euler": EULER, "rk4": RK4}

_RATES, _STORED, ROLL, _JACOBIANS, _COUNT = range(5)

_whole, _real = types.int64, types.float64


def compiled_functions(agent: ModuleType) -> NDArray[np.int64]:
    """The addresses for ``Channels.functions``; 0 for a type that only MuJoCo knows."""
    if not has_ode(agent):
        return np.zeros(_COUNT, dtype=np.int64)
    return np.array([owner.address for owner in _compiled(agent)], dtype=np.int64)


@cache
def _compiled(agent: ModuleType) -> list[Any]:
    source = source_key(agent)
    numbers, states = len(agent.PARAMETERS), len(agent.STATES)

    def rates(parameters, m, stage, state, u, known, out):
        _ = source
        q = shaped(floats_at(parameters, m * numbers), (m, numbers))
        x = floats_at(state, m * states)
        inputs, kept, rate = floats_at(u, m), floats_at(known, m), floats_at(out, m * states)
        for r in range(m):
            own = x[r * states : (r + 1) * states]
            if stage > 0:
                kept[r] = agent.shared(q[r], own)
            agent.rate_given(q[r], own, inputs[r], kept[r], rate[r * states : (r + 1) * states])
        return 0

    def stored(parameters, m, equilibrium_state, state, known):
        _ = source
        q = shaped(floats_at(parameters, m * numbers), (m, numbers))
        at_rest = shaped(floats_at(equilibrium_state, m * states), (m, states))
        x, kept, total = floats_at(state, m * states), floats_at(known, m), 0.0
        for r in range(m):
            own = x[r * states : (r + 1) * states]
            kept[r] = agent.shared(q[r], own)
            total += agent.storage_given(q[r], own, at_rest[r], kept[r])
        return total

    def roll(parameters, m, method, h, steps, state, u, scratch):
        _ = source
        q = shaped(floats_at(parameters, m * numbers), (m, numbers))
        for _step in range(steps):
            hold_step(
                agent, q, states, method, h, floats_at(state, m * states), floats_at(u, m),
                floats_at(scratch, 5 * states),
            )  # fmt: skip
        return 0

    def jacobians(parameters, m, state, out):
        _ = source
        q = shaped(floats_at(parameters, m * numbers), (m, numbers))
        x = floats_at(state, m * states)
        slopes = shaped(floats_at(out, m * states * states), (m, states, states))
        for r in range(m):
            agent.jacobian(q[r], x[r * states : (r + 1) * states], slopes[r])
        return 0

    return [
        callback(_whole(*[_whole] * 7), rates),
        callback(_real(*[_whole] * 5), stored),
        callback(_whole(_whole, _whole, _whole, _real, *[_whole] * 4), roll),
        callback(_whole(*[_whole] * 4), jacobians),
    ]


@kernel
def hold_step(agent, parameters, states, method, h, state, u, scratch):
    """Move all channels by one step under the held input u (m,): the plant's discrete map.

    state is flat, channel after channel; scratch has at least 5 * states entries.
    """
    k1, k2 = scratch[:states], scratch[states : 2 * states]
    k3, k4 = scratch[2 * states : 3 * states], scratch[3 * states : 4 * states]
    trial = scratch[4 * states : 5 * states]
    for r in range(len(u)):
        q, x = parameters[r], state[r * states : (r + 1) * states]
        if method == EULER:
            agent.euler_step(q, x, u[r], h, trial)
            for s in range(states):
                x[s] = trial[s]
        else:
            agent.rate(q, x, u[r], k1)
            for s in range(states):
                trial[s] = x[s] + 0.5 * h * k1[s]
            agent.rate(q, trial, u[r], k2)
            for s in range(states):
                trial[s] = x[s] + 0.5 * h * k2[s]
            agent.rate(q, trial, u[r], k3)
            for s in range(states):
                trial[s] = x[s] + h * k3[s]
            agent.rate(q, trial, u[r], k4)
            for s in range(states):
                x[s] += h / 6.0 * (k1[s] + 2.0 * k2[s] + 2.0 * k3[s] + k4[s])


@kernel
def rates(channels, stage, state, u, known, out):
    """Fill out with x' of all channels at a flat state under u (m,).

    ``known`` (m,) is at stage 0 what :func:`stored` has found for this state; else changed.
    """
    parameters = channels.parameters
    call_integer(
        channels.functions[_RATES],
        (
            address_in(parameters), len(parameters), stage, address_in(state), address_in(u),
            address_in(known), address_in(out),
        ),
    )  # fmt: skip


@kernel
def stored(channels, state, known):
    """V^{x*} of all channels; known (m,) is filled with what their rates here need again."""
    parameters = channels.parameters
    return call_number(
        channels.functions[_STORED],
        (
            address_in(parameters),
            len(parameters),
            address_in(channels.equilibrium_state),
            address_in(state),
            address_in(known),
        ),
    )


@kernel
def roll(channels, method, h, steps, state, u, scratch):
    """Move the flat state by so many steps of h seconds under the held input u (m,)."""
    parameters = channels.parameters
    call_integer(
        channels.functions[ROLL],
        (
            address_in(parameters), len(parameters), method, h, steps, address_in(state),
            address_in(u), address_in(scratch),
        ),
    )  # fmt: skip


@kernel
def jacobians(channels, state, out):
    """Fill out (m, states, states) with df/dx of all channels at a flat state."""
    parameters = channels.parameters
    call_integer(
        channels.functions[_JACOBIANS],
        (address_in(parameters), len(parameters), address_in(state), address_in(out)),
    )
