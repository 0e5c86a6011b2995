"""Plain Python functions in place of kernels: slow, and all that a first try needs.

A native loop cannot call Python, but it can call a C function at an address, and ctypes makes a C
function of a Python one. The kernels of this module do that: a game of plain functions is this
module with the addresses as its parameters, and so runs in every loop and engine that numba
functions run in, some hundred times slower. Putting ``@kernel`` (:mod:`gne_mj.native`) before each
of the same functions gives full speed.

An exception inside a native loop cannot be raised there. It is kept, the function's value becomes
"not a number", which ends a run, and :func:`raise_pending` raises it afterwards.
"""

import ctypes
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from gne_mj.native import is_kernel, kernel

Array = NDArray[np.float64]

# What a game's functions are called; the two second derivatives may be left out
NAMES = (
    "cost",
    "cost_gradient",
    "add_cost_hessian",
    "constraint",
    "constraint_gradient",
    "constraint_hessian",
)
_OPTIONAL = ("add_cost_hessian", "constraint_hessian")
_DIFFERENCE = 6e-6  # step of central differences, relative to the entry's size where that exceeds 1

# double f(integers a, b, c; double scale; arrays x, y, z, each an address and a length)
_SIGNATURE = ctypes.CFUNCTYPE(
    ctypes.c_double,
    *(ctypes.c_int64,) * 3,
    ctypes.c_double,
    *(ctypes.c_int64,) * 6,
)
_pending: list[BaseException] = []


def raise_pending() -> None:
    """Raise what a plain function raised inside a native loop, if any did."""
    if _pending:
        error = _pending[0]
        _pending.clear()
        raise error


def callable_address(function: Callable[..., float]) -> tuple[float, Any]:
    """A C function's address, as a double, that calls ``function(a, b, c, scale, x, y, z)``.

    The second item must be kept as long as the address is used.
    """
    views: dict[tuple[int, int], Array] = {}

    def view(address: int, length: int) -> Array:
        found = views.get((address, length))
        if found is None:
            block = (ctypes.c_double * length).from_address(address)
            found = views[address, length] = np.ctypeslib.as_array(block)
        return found

    def called(a: int, b: int, c: int, scale: float, *arrays: int) -> float:
        try:
            x, y, z = (view(*arrays[at : at + 2]) for at in (0, 2, 4))
            return float(function(a, b, c, scale, x, y, z))
        except BaseException as error:
            _pending.append(error)
            return float("nan")

    kept = _SIGNATURE(called)
    return float(ctypes.cast(kept, ctypes.c_void_p).value or 0), kept


@intrinsic
def call_out(
    typingctx: Any, function: Any, a: Any, b: Any, c: Any, scale: Any, x: Any, y: Any, z: Any
) -> Any:
    """Call such a C function at an address; x, y and z are contiguous float arrays."""
    whole, real = types.int64, types.float64

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        integer, double = ir.IntType(64), ir.DoubleType()
        flat = list(arguments[1:5])
        for kind, value in zip(signature.args[5:], arguments[5:], strict=True):
            array = cgutils.create_struct_proxy(kind)(context, builder, value=value)
            flat.append(builder.ptrtoint(array.data, integer))
            flat.append(array.nitems)
        target = ir.FunctionType(double, [integer] * 3 + [double] + [integer] * 6)
        return builder.call(builder.inttoptr(arguments[0], target.as_pointer()), flat)

    return real(whole, whole, whole, whole, real, x, y, z), codegen


def is_plain(module: ModuleType) -> bool:
    """Whether a game's functions are plain Python ones.

    Raises:
        TypeError: some are kernels and some are not, or one is missing.
    """
    kinds = {name: getattr(module, name, None) for name in NAMES}
    natives = [name for name, function in kinds.items() if is_kernel(function)]
    if len(natives) == len(NAMES):
        return False
    missing = [name for name in NAMES if kinds[name] is None and name not in _OPTIONAL]
    if missing:
        raise TypeError(f"{module.__name__}: a game needs a function '{missing[0]}'")
    if natives:
        other = next(name for name in NAMES if name not in natives)
        raise TypeError(
            f"{module.__name__}: '{natives[0]}' is a kernel and '{other}' is not; mark all six"
            " functions with @kernel, or none"
        )
    return True


def plain_kernels(module: ModuleType, parameters: Array) -> tuple[ModuleType, Array, list[Any]]:
    """This module, the parameters it needs, and what must be kept alive meanwhile.

    Args:
        module: with a game's functions as :mod:`gne_mj.game` describes them.
        parameters: the game's own q.
    """
    q = parameters
    cost, gradient = module.cost, module.cost_gradient
    constraint, slope = module.constraint, module.constraint_gradient

    def add_cost_hessian(i: int, a: int, y: Array, scale: float, out: Array) -> None:
        if hasattr(module, "add_cost_hessian"):
            module.add_cost_hessian(q, i, a, y, scale, out)
        else:
            for b in range(len(y)):
                out[b] += scale * _central(lambda at: gradient(q, i, a, at), y, b)

    def constraint_hessian(k: int, a: int, b: int, y: Array) -> float:
        if hasattr(module, "constraint_hessian"):
            return float(module.constraint_hessian(q, k, a, b, y))
        return _central(lambda at: slope(q, k, a, at), y, b)

    functions: tuple[Callable[..., float], ...] = (
        lambda i, a, b, scale, y, *_: cost(q, i, y),
        lambda i, a, b, scale, y, *_: gradient(q, i, a, y),
        lambda i, a, b, scale, y, out, _: add_cost_hessian(i, a, y, scale, out) or 0.0,  # type: ignore[func-returns-value]
        lambda k, a, b, scale, y, *_: constraint(q, k, y),
        lambda k, a, b, scale, y, *_: slope(q, k, a, y),
        lambda k, a, b, scale, y, *_: constraint_hessian(k, a, b, y),
    )
    addresses, kept = zip(*(callable_address(function) for function in functions), strict=True)
    return sys.modules[__name__], np.array(addresses), list(kept)


def _central(function: Callable[[Array], float], y: Array, b: int) -> float:
    step = _DIFFERENCE * max(1.0, abs(y[b]))
    above, below = y.copy(), y.copy()
    above[b] += step
    below[b] -= step
    return float((function(above) - function(below)) / (above[b] - below[b]))


# The six kernels of a game of plain functions; q holds their addresses.


@kernel
def cost(q, i, y):
    """J_i(y)."""
    return call_out(np.int64(q[0]), i, 0, 0, 0.0, y, y, y)


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_a."""
    return call_out(np.int64(q[1]), i, a, 0, 0.0, y, y, y)


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """out[b] += scale * d2J_i/dy_a dy_b."""
    call_out(np.int64(q[2]), i, a, 0, scale, y, out, out)


@kernel
def constraint(q, l, y):
    """g_l(y)."""
    return call_out(np.int64(q[3]), l, 0, 0, 0.0, y, y, y)


@kernel
def constraint_gradient(q, l, a, y):
    """dg_l/dy_a."""
    return call_out(np.int64(q[4]), l, a, 0, 0.0, y, y, y)


@kernel
def constraint_hessian(q, l, a, b, y):
    """d2g_l/dy_a dy_b."""
    return call_out(np.int64(q[5]), l, a, b, 0.0, y, y, y)
