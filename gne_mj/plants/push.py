"""Pushes: forces that act on a fleet's outputs besides its inputs, as long as they are wanted.

A force f at an output whose velocity is J(q) times that of the joints is the joint forces J(q)' f,
so that f times that velocity is its power: at a joint f itself, at a point of a body a force there
along the output's axis, of an angular velocity a torque. They are mjData's ``qfrc_applied``. J
changes as a robot turns: while something is pushed a control callback finds it at each evaluation,
which then calls the loop's own; at other times nothing of this is called.
"""

import ctypes
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import mujoco
import numpy as np

from gne_mj.native import callback, source_key
from gne_mj.parameter_block import floats_at
from gne_mj.plants.c_layout import unknown_layout, word_of
from gne_mj.plants.mujoco import sizes_in
from gne_mj.plants.native_mujoco import (
    CALLBACK,
    Offsets,
    address_of,
    call,
    field,
    parameter_block_of,
)

_DATA = (
    "qfrc_applied", "cdof", "ten_velocity", "ten_J", "actuator_velocity", "actuator_moment",
    "moment_rownnz", "moment_rowadr", "moment_colind",
)  # fmt: skip


class Slopes(NamedTuple):
    """Where MuJoCo has how velocities are made of joint velocities, in 8-byte words from the start
    of mjData, of the last four from that of mjModel."""

    qfrc_applied: int
    cdof: int
    ten_velocity: int
    ten_J: int
    actuator_velocity: int
    actuator_moment: int
    moment_rownnz: int
    moment_rowadr: int
    moment_colind: int
    dof_parentid: int
    ten_J_rownnz: int
    ten_J_rowadr: int
    ten_J_colind: int


def slopes(model: mujoco.MjModel, data: mujoco.MjData) -> Slopes:
    """Where they are, checked there.

    Raises:
        EngineError: one is elsewhere, so this MuJoCo cannot be told of pushes.
    """
    found = {}
    for name in Slopes._fields:
        struct, kind = (data, "mjData") if name in _DATA else (model, "mjModel")
        found[name], array = word_of(kind, name), getattr(struct, name)
        pointer = ctypes.c_int64.from_address(struct._address + 8 * found[name]).value
        if array.size and pointer != array.ctypes.data:
            raise unknown_layout(f"{kind}.{name}")
    return Slopes(**found)


@cache
def pushing(at: Offsets, where: Slopes, fleet: ModuleType) -> Any:
    """The control callback of a loop whose fleet is pushed.

    Args:
        at, where: MuJoCo's own places.
        fleet: the module that has the kernel ``push(where, model, data, parameter_block, forces,
            applied)``, which adds J' forces (m,) to the joint forces applied (nv,).
    """
    source = source_key(fleet)

    def control(model, data):
        _ = source
        model, data = address_of(model), address_of(data)
        parameter_block = parameter_block_of(at, model, data)
        if parameter_block <= 0:  # nor does a prediction know of it
            return
        sizes = sizes_in(parameter_block)
        pushes = floats_at(sizes.pushes, sizes.channels + 1)
        call(np.int64(pushes[0]), model, data)
        applied = field(data, where.qfrc_applied, sizes.nv)
        for dof in range(sizes.nv):
            applied[dof] = 0.0
        fleet.push(where, model, data, parameter_block, pushes[1:], applied)

    return callback(CALLBACK, control)
