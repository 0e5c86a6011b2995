"""What is told to numba of how it compiles changes nothing of what it computes."""

import gc
from typing import NamedTuple

import numpy as np
from numba import types

from gne_mj import native
from gne_mj.interior_point import Path
from gne_mj.kernel_compiler import _INHERITED
from gne_mj.primal_dual import Free, Iterate


class Elsewhere(NamedTuple):
    """A record that is none of the package's."""

    values: np.ndarray
    entry: int
    flag: bool


class Both(NamedTuple):
    """Records in a record."""

    path: Path
    point: Iterate


@native.kernel
def turned(path, point):
    """Records of numbers with a truth value, and of arrays, as what a kernel returns."""
    return Path(
        2.0 * path.rho, path.last_rho, path.tolerance, path.spread, not path.to_zero, path.gently
    ), (Iterate(point.slack, point.multipliers, point.y))


@native.kernel
def told(path, point, free, other):
    """Something of each field."""
    value = path.rho + 10.0 * path.spread + (100.0 if path.to_zero else 0.0)
    for k in range(len(point.y)):
        value += point.y[k] - 3.0 * point.slack[k] + 7.0 * point.multipliers[free.position[k]]
    return value + other.values[other.entry] * (1.0 if other.flag else -1.0)


@native.compiled
def tell(path, point, free, other, out):
    """Through kernels that are given and return records."""
    path, point = turned(path, point)
    both = Both(path, point)
    out[0] = told(both.path, both.point, free, other)
    free.position[0] = 1  # the caller's own array, not a copy


def test_records_come_through_kernels_as_they_are():
    path = Path(0.5, 0.25, 0.125, 4.0, False, True)
    point = Iterate(np.array([1.0, 2.0]), np.array([3.0, 5.0]), np.array([7.0, 11.0]))
    free = Free(np.array([0, 1]), np.array([0]), np.array([0, 1]))
    other = Elsewhere(np.array([0.0, 1000.0]), 1, True)
    path_then, point_then = turned(path, point)
    expected = told(path_then, point_then, free, other)  # in plain Python
    out = np.empty(1)
    tell(path, point, free, other, out)
    assert out[0] == expected
    assert free.position.tolist() == [1, 1]


@native.kernel
def quartered(x):
    """For loops and callbacks alike."""
    return 0.25 * x


@native.compiled
def quartered_in_a_loop(x):
    """A loop."""
    return quartered(x)


def test_a_loop_and_a_callback_call_the_same_kernel():
    def quarter(x):
        return quartered(x)

    assert quartered_in_a_loop(8.0) == 2.0
    assert native.callback(types.float64(types.float64), quarter).ctypes(8.0) == 2.0


def test_the_options_that_calls_inherit_are_the_loops_own():
    assert not _INHERITED.nrt
    assert _INHERITED.error_model == "numpy"


def test_compiling_leaves_the_garbage_collector_as_it_was():
    for enabled in (False, True):
        (gc.enable if enabled else gc.disable)()
        try:

            @native.compiled
            def one():
                return 1

            assert one() == 1
            assert gc.isenabled() == enabled
        finally:
            gc.enable()
