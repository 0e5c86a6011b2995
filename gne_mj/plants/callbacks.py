"""MuJoCo's callbacks, which are global to the process: installed for a while, then put back.

Besides forces and control these are its warnings and its clock. MuJoCo reads the clock some thirty
times in a step, to tell in ``mjData.timer`` how long each stage took: for five robots that is a
fifth of the step. Nobody asks for these times here, so that the clock stands still meanwhile.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import mujoco
from numba import types

from gne_mj.errors import EngineError
from gne_mj.native import callback
from gne_mj.plants.native_mujoco import library

_FUNCTION = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_DYNAMICS = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_WARNING = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


@cache
def _silence() -> Any:
    def ignore(message):
        pass

    return callback(types.void(types.voidptr), ignore)


@contextmanager
def quiet() -> Iterator[None]:
    """MuJoCo's warnings go nowhere meanwhile: not to stderr, nor to a file in the working folder.

    What they say of a simulation is in the monitor, and in :func:`check_warnings`.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_WARNING(_silence().address))
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


@contextmanager
def _untimed() -> Iterator[None]:
    """MuJoCo does not look at the clock meanwhile."""
    clock = ctypes.c_void_p.in_dll(library(), "mjcb_time")  # Python's setter cannot put it to none
    before, clock.value = clock.value, None
    try:
        yield
    finally:
        clock.value = before


_installed = threading.Lock()


@contextmanager
def callbacks(
    *, control: Any = None, passive: Any = None, activation: Any = None
) -> Iterator[None]:
    """Install C callbacks (numba ``cfunc`` objects) for a while; always restores what was there.

    MuJoCo is :func:`quiet` meanwhile, and does not time its stages.

    Raises:
        EngineError: callbacks are global to the process, and ours are installed already.
    """
    if not _installed.acquire(blocking=False):
        raise EngineError(
            "MuJoCo's callbacks are global to the process and already in use by another"
            " simulation that is stepping right now: step one at a time"
        )
    try:
        before = (
            mujoco.get_mjcb_control(),
            mujoco.get_mjcb_passive(),
            mujoco.get_mjcb_act_dyn(),
        )
        try:
            mujoco.set_mjcb_control(control and _FUNCTION(control.address))
            mujoco.set_mjcb_passive(passive and _FUNCTION(passive.address))
            mujoco.set_mjcb_act_dyn(activation and _DYNAMICS(activation.address))
            with quiet(), _untimed():
                yield
        finally:
            mujoco.set_mjcb_control(before[0])
            mujoco.set_mjcb_passive(before[1])
            mujoco.set_mjcb_act_dyn(before[2])
    finally:
        _installed.release()
