"""Contacts between agents' bodies in MuJoCo, counted at the start of every integration step.

The contacts are those that MuJoCo has just found there, which then act in the step.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types

from gne_mj.loops.monitor import MonitorNumbers
from gne_mj.native import callback, kernel, source_key
from gne_mj.numbers import names_of, numbers_in
from gne_mj.parameter_block import floats_at
from gne_mj.plants.mujoco import sizes_in
from gne_mj.plants.native_contacts import contact_offsets, contacts, distance, geoms
from gne_mj.plants.native_mujoco import word

_monitor_in = numbers_in(MonitorNumbers)
_LENGTH_OF_MONITOR = len(names_of(MonitorNumbers))


@kernel
def observe(at, owners, data, monitor, time):
    """Note the contacts between two agents that mjData has.

    Before :func:`gne_mj.loops.monitor.observe`: the same instant is not looked at twice, as where a
    piece of a step is taken again.

    Args:
        at: where contacts lie.
        owners: address of (geoms,) the agent that each belongs to, from 0; -1 for the world's.
        data: address of mjData.
        monitor: numbers, changed.
        time: in s.
    """
    if monitor.started > 0.0 and not time > monitor.time:
        return
    found = 0
    for k in range(contacts(at, data)):
        first, second = geoms(at, data, k)
        if first < 0 or second < 0:
            continue
        one, other = word(owners, first), word(owners, second)
        if one < 0 or other < 0 or one == other:
            continue
        if monitor.contacts == 0.0 and found == 0:
            monitor.contact_time = time
            monitor.contact_agent, monitor.contact_other = min(one, other), max(one, other)
        monitor.contact_depth = max(monitor.contact_depth, -distance(at, data, k))
        found += 1
    monitor.contacts += found
    if found > 0:
        monitor.touching += 1.0


@cache
def counter() -> Any:
    """The C function that counts, of addresses and a time; for all fleets whose bodies collide."""
    at, source = contact_offsets(), source_key()

    def count(block, data, monitor, time):
        _ = source
        numbers = _monitor_in(floats_at(monitor, _LENGTH_OF_MONITOR), 0)
        observe(at, sizes_in(block).owners, data, numbers, time)
        return np.int64(0)

    return callback(types.int64(types.int64, types.int64, types.int64, types.float64), count)
