"""A controller of plain Python functions: slow, and all that a first try needs.

A native loop cannot call Python, but it can call the C function that ctypes makes of one
(:mod:`gne_mj.plain`), whose address is in q. Readings, input and memory lie one behind the other.
"""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import UserCodeError
from gne_mj.native import address_in, kernel
from gne_mj.parameter_block import floats_at
from gne_mj.plain import call_out, callable_address
from gne_mj.plants.low_level.table import Controller, Seen

Array = NDArray[np.float64]
_CONTROL, _RATE = range(2)  # q: addresses of the two functions


@kernel
def control(q, readings, memory, u, out):
    """Fill out by the user's function; not a number if that raised."""
    failed = _called(q[_CONTROL], readings, memory, u, out)
    out[0] += failed  # zero, or not a number


@kernel
def rate(q, readings, memory, u, out):
    """The rates of a memory that moves."""
    if len(out) > 0:
        failed = _called(q[_RATE], readings, memory, u, out)
        out[0] += failed


@kernel
def _called(address, readings, memory, u, out):
    count, inputs, kept = len(readings), len(u), len(memory)
    given = floats_at(address_in(readings), count + inputs + kept)
    return call_out(np.int64(address), count, inputs, kept, 0.0, given, given, out)


def controller(
    functions: Mapping[str, Callable[..., Any]],
    actuators: tuple[str, ...],
    seen: tuple[Seen, ...],
    inputs: int,
    memory: int,
) -> Controller:
    """The controller of ``control(readings, memory, u)``, ``rate`` and ``start(readings)``.

    Args:
        functions: by these names; the last two may be missing.
        actuators, seen, inputs: as a controller has them.
        memory: its entries.
    """
    moving = memory if "rate" in functions else 0
    numbers, kept = [], []
    for name in ("control", "rate"):
        function = functions.get(name, functions["control"])
        address, owner = callable_address(_filled(function), function)
        numbers.append(address)
        kept.append(owner)
    start = partial(_start, functions["start"]) if "start" in functions else None
    return Controller(
        sys.modules[__name__], actuators, seen, np.array(numbers), inputs, moving,
        memory - moving, start, tuple(kept),
    )  # fmt: skip


def _filled(function: Callable[..., Any]) -> Callable[..., float]:
    def filled(
        count: int, inputs: int, kept: int, scale: float, given: Array, same: Array, out: Array
    ) -> float:
        readings, u, memory = np.split(given, [count, count + inputs])
        _fill(function, out, readings, memory, u)
        return 0.0

    return filled


def _start(function: Callable[..., Any], numbers: Array, readings: Array, out: Array) -> None:
    try:
        _fill(function, out, readings)
    except (KeyboardInterrupt, UserCodeError):
        raise
    except BaseException as error:
        raise UserCodeError(function, error) from error


def _fill(function: Callable[..., Any], out: Array, *given: Array) -> None:
    value = np.asarray(function(*given))
    if value.dtype.kind not in "fiub" or value.shape not in {(len(out),), () * (len(out) == 1)}:
        raise UserCodeError(
            function, f"it must return a list of {len(out)} numbers, and returned {value!r}"
        )
    if not np.all(np.isfinite(value)):
        raise UserCodeError(function, f"it must return finite numbers, and returned {value!r}")
    out[:] = value
