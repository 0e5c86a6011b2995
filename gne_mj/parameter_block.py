"""Parameter blocks of arrays that native code reaches by one address: read-only to it, unless it
says so.

A callback gets two pointers and nothing else, and a loop over many runs wants one number a run.
Both find their arrays through the address of a block of (address, length) pairs.
"""

import ctypes
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.native import array_at, intrinsic_or, load_word


class ParameterBlock:
    """Arrays that native code reads, as one block of (address, length) pairs.

    The arrays are kept alive as long as the parameter block is; so keep the plant or loop that made
    a simulation for as long as that simulation, or a copy of it, is stepped with its callbacks.

    Attributes:
        arrays: as they were given.
        kept_alive: what native code knows by addresses in them.
        modules: those of the run's kernels, where lanes can go through all of them
            (:mod:`gne_mj.loops.lane_batch`).
    """

    modules: Any = None

    def __init__(self, arrays: Sequence[NDArray[Any]], kept_alive: Any = None) -> None:
        for array in arrays:
            if array.dtype not in (np.float64, np.int64) or not array.flags.c_contiguous:
                raise EngineError(
                    f"native code reads contiguous arrays of 8-byte items, not {array.dtype}"
                )
        self.arrays, self.kept_alive = tuple(arrays), kept_alive
        pairs = [(array.ctypes.data, array.size) for array in arrays]
        self._pairs = np.array(pairs, dtype=np.int64).reshape(-1)

    @cached_property
    def address(self) -> int:
        """Where the pairs lie; a double, which is what MuJoCo can keep, holds it exactly.

        Raises:
            EngineError: it does not.
        """
        return exact(self._pairs.ctypes.data)


def exact(address: int) -> int:
    """The same address, if a double holds it exactly, as all user-space addresses so far."""
    if int(float(address)) != address:
        raise EngineError(f"the address {address} does not fit into a double")
    return address


def _array(item: Any, address: int, length: int) -> NDArray[Any]:
    """An array at an address, in plain Python."""
    if not length:
        return np.zeros(0, dtype=item)
    return np.ctypeslib.as_array((item * int(length)).from_address(int(address)))


def _indexed(item: Any, parameter_block: int, index: int) -> NDArray[Any]:
    """An array of a parameter block, in plain Python."""
    return _array(item, *_array(ctypes.c_int64, parameter_block + 16 * index, 2))


_FLOATS, _INTEGERS = types.Array(types.float64, 1, "C"), types.Array(types.int64, 1, "C")


@intrinsic_or(lambda parameter_block, index: _indexed(ctypes.c_double, parameter_block, index))
def floats(typingctx: Any, parameter_block: Any, index: Any) -> Any:
    """The float array at this index of the parameter block at an address."""
    return entry_of(_FLOATS)


@intrinsic_or(lambda parameter_block, index: _indexed(ctypes.c_int64, parameter_block, index))
def integers(typingctx: Any, parameter_block: Any, index: Any) -> Any:
    """The integer array at this index of the parameter block at an address."""
    return entry_of(_INTEGERS)


def entry_of(kind: types.Array) -> Any:
    """For intrinsics: a parameter block's entry of an index as an array of a kind."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        parameter_block, index = arguments
        pair = builder.add(
            parameter_block, builder.mul(index, context.get_constant(types.intp, 16))
        )
        length = builder.add(pair, context.get_constant(types.intp, 8))
        return array_at(
            context, builder, kind, load_word(builder, pair), load_word(builder, length)
        )

    return kind(types.int64, types.int64), codegen


@intrinsic_or(lambda address, length: _array(ctypes.c_double, address, length))
def floats_at(typingctx: Any, address: Any, length: Any) -> Any:
    """The float array of a length at an address."""
    return array_of(_FLOATS)


@intrinsic_or(lambda address, length: _array(ctypes.c_int64, address, length))
def integers_at(typingctx: Any, address: Any, length: Any) -> Any:
    """The integer array of a length at an address."""
    return array_of(_INTEGERS)


def array_of(kind: types.Array) -> Any:
    """For intrinsics: the array of a kind and length at an address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return array_at(context, builder, kind, *arguments)

    return kind(types.int64, types.int64), codegen
