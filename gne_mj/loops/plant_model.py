"""The plant's equations as laws that know them ask for: C functions for all agents, compiled once.

:mod:`gne_mj.controllers.plant_model` calls them.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.controllers.plant_model import COUNT, KNOTS, RATES
from gne_mj.loops.layout import channels_in, clock_in, steps_in
from gne_mj.native import callback, copy, kernel, released, reserved, source_key
from gne_mj.parameter_block import floats_at
from gne_mj.plants import functions

_whole = types.int64


def addresses() -> NDArray[np.int64]:
    """For ``problem.model``."""
    found = np.zeros(COUNT, dtype=np.int64)
    found[RATES], found[KNOTS] = (each.address for each in _compiled())
    return found


@kernel
def _seen(state, y, output, states, out):
    """Fill out with a flat state whose outputs are y (m,)."""
    copy(state, out)
    for r in range(len(y)):
        out[r * states + output] = y[r]


@cache
def _compiled() -> list[Any]:
    source = source_key()

    def rates(block, state, y, drift, push):
        _ = source
        steps, channels = steps_in(block), channels_in(block)
        m, states = steps.actions, steps.states
        size, base, slope = m * states, floats_at(drift, m), floats_at(push, m)
        room = reserved(2 * size + 2 * m)
        x, rate, u = room[:size], room[size : 2 * size], room[2 * size : 2 * size + m]
        _seen(floats_at(state, size), floats_at(y, m), steps.output, states, x)
        for trial in range(2):
            for r in range(m):
                u[r] = 1.0 * trial
            functions.rates(channels, 1, x, u, room[2 * size + m :], rate)
            for r in range(m):
                found = rate[r * states + steps.output]
                base[r], slope[r] = (found, slope[r]) if trial == 0 else (base[r], found - base[r])
        released(room)
        return 0

    def knots(block, state, y, count, periods, u, out):
        _ = source
        steps, channels, clock = steps_in(block), channels_in(block), clock_in(block)
        m, states = steps.actions, steps.states
        size, room = m * states, reserved(m * states + 5 * states)
        x = room[:size]
        _seen(floats_at(state, size), floats_at(y, m), steps.output, states, x)
        for knot in range(count):
            held, reached = floats_at(u + 8 * knot * m, m), floats_at(out + 8 * knot * m, m)
            functions.roll(
                channels, clock.method, clock.h, periods * clock.period, x, held, room[size:]
            )
            for r in range(m):
                reached[r] = x[r * states + steps.output]
        released(room)
        return 0

    return [
        callback(_whole(*[_whole] * 5), rates),
        callback(_whole(*[_whole] * 7), knots),
    ]
