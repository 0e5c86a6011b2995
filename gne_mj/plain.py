"""Plain Python functions in place of kernels: slow, and all that a first try needs.

A native loop cannot call Python, but it can call a C function at an address, and ctypes makes a C
function of a Python one. The kernels of this module do that: a game of plain functions is this
module with the addresses as its parameters, and so runs in every loop and engine that numba
functions run in, some hundred times slower. Putting ``@kernel`` (:mod:`gne_mj.native`) before each
of the same functions gives full speed.

An exception inside a native loop cannot be raised there. It is kept, the function's value becomes
"not a number", which ends a run, and :func:`raise_pending` raises it afterwards. Arrays that a
plain function only reads are handed to it read-only, and are valid during the call.
"""

import ctypes
import inspect
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.native import is_kernel, kernel

Array = NDArray[np.float64]

# What a game's functions are called and take; the two second derivatives may be left out
FUNCTIONS = {
    "cost": ("q", "i", "y"),
    "cost_gradient": ("q", "i", "a", "y"),
    "add_cost_hessian": ("q", "i", "a", "y", "scale", "out"),
    "constraint": ("q", "l", "y"),
    "constraint_gradient": ("q", "l", "a", "y"),
    "constraint_hessian": ("q", "l", "a", "b", "y"),
}
_OPTIONAL = ("add_cost_hessian", "constraint_hessian")
_DIFFERENCE = 6e-6  # step of central differences, relative to the entry's size where that exceeds 1

# double f(integers a, b, c; double scale; arrays x, y, z, each an address and a length)
_SIGNATURE = ctypes.CFUNCTYPE(
    ctypes.c_double,
    *(ctypes.c_int64,) * 3,
    ctypes.c_double,
    *(ctypes.c_int64,) * 6,
)
_VIEWS = 1000  # arrays whose views are kept for the next call
_pending: list[tuple[Callable[..., Any], BaseException]] = []


def raise_pending() -> None:
    """Raise what a plain function raised inside a native loop, if any did.

    Raises:
        UserCodeError: names the function, its file and line.
    """
    if _pending:
        function, error = _pending[0]
        _pending.clear()
        if isinstance(error, Exception) and not isinstance(error, UserCodeError):
            raise UserCodeError(function, error) from error
        raise error


def callable_address(function: Callable[..., float], own: Callable[..., Any]) -> tuple[float, Any]:
    """A C function's address, as a double, that calls ``function(a, b, c, scale, x, y, z)``.

    x and y are read-only, z is not. ``own`` is the user's function behind it, for messages. The
    second item must be kept as long as the address is used.
    """
    views: dict[tuple[int, int, bool], Array] = {}

    def view(address: int, length: int, writes: bool) -> Array:
        found = views.get((address, length, writes))
        if found is None:
            if len(views) >= _VIEWS:
                views.clear()
            block = (ctypes.c_double * length).from_address(address)
            found = views[address, length, writes] = np.ctypeslib.as_array(block)
            found.flags.writeable = writes
        return found

    def called(a: int, b: int, c: int, scale: float, *arrays: int) -> float:
        try:
            x, y, z = (view(arrays[at], arrays[at + 1], at == 4) for at in (0, 2, 4))
            return function(a, b, c, scale, x, y, z)
        except BaseException as error:
            _pending.append((own, error))
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
        InvalidInput: some are kernels and some are not, one is missing or takes other arguments.
    """
    found = {name: getattr(module, name) for name in FUNCTIONS if hasattr(module, name)}
    natives = [name for name, function in found.items() if is_kernel(function)]
    file = Path(getattr(module, "__file__", None) or module.__name__).name
    for name, arguments in FUNCTIONS.items():
        if name not in found:
            if not natives and name in _OPTIONAL:
                continue
            raise InvalidInput("game.kernels", file, f"it must define {_call(name, arguments)}")
        if natives and name not in natives:
            raise InvalidInput(
                "game.kernels",
                file,
                f"its '{natives[0]}' is a kernel and its '{name}' is not; mark all six functions"
                " with @kernel, or none",
            )
        check_arguments("game.kernels", file, found[name], name, arguments)
    return not natives


def check_arguments(
    key: str,
    file: str,
    function: Any,
    name: str,
    arguments: tuple[str, ...],
    parameters: Iterable[str] = (),
) -> None:
    """Refuse a user's function that cannot take these arguments, and parameters by name."""
    try:
        inspect.signature(function).bind(*arguments, **dict.fromkeys(parameters))
    except TypeError as error:
        raise InvalidInput(
            key, file, f"it must define {_call(name, (*arguments, *parameters))}: {error}"
        ) from None


def _call(name: str, arguments: tuple[str, ...]) -> str:
    return f"{name}({', '.join(arguments)})"


def plain_kernels(module: ModuleType, parameters: Array) -> tuple[ModuleType, Array, list[Any]]:
    """This module, the parameters it needs, and what must be kept alive meanwhile.

    Args:
        module: with a game's functions as :mod:`gne_mj.game` describes them.
        parameters: the game's own q.
    """
    q = parameters
    cost, gradient = module.cost, module.cost_gradient
    constraint, slope = module.constraint, module.constraint_gradient

    second = getattr(module, "add_cost_hessian", None)
    bend = getattr(module, "constraint_hessian", None)

    def add_cost_hessian(i: int, a: int, y: Array, scale: float, out: Array) -> float:
        if second is not None:
            second(q, i, a, y, scale, out)
        else:
            for b in range(len(y)):
                out[b] += scale * _central(lambda at: _number(gradient, q, i, a, at), y, b)
        return 0.0

    def constraint_hessian(k: int, a: int, b: int, y: Array) -> float:
        if bend is not None:
            return _number(bend, q, k, a, b, y)
        return _central(lambda at: _number(slope, q, k, a, at), y, b)

    functions: tuple[tuple[Callable[..., float], Callable[..., Any]], ...] = (
        (lambda i, a, b, scale, y, *_: _number(cost, q, i, y), cost),
        (lambda i, a, b, scale, y, *_: _number(gradient, q, i, a, y), gradient),
        (lambda i, a, b, scale, y, _, o: add_cost_hessian(i, a, y, scale, o), second or gradient),
        (lambda k, a, b, scale, y, *_: _number(constraint, q, k, y), constraint),
        (lambda k, a, b, scale, y, *_: _number(slope, q, k, a, y), slope),
        (lambda k, a, b, scale, y, *_: constraint_hessian(k, a, b, y), bend or slope),
    )
    addresses, kept = zip(*(callable_address(*pair) for pair in functions), strict=True)
    return sys.modules[__name__], np.array(addresses), list(kept)


def _number(function: Callable[..., Any], *arguments: Any) -> float:
    value = function(*arguments)
    try:
        return float(value)
    except (TypeError, ValueError):
        shown = "None" if value is None else f"{type(value).__name__} {value!r:.40}"
        raise UserCodeError(function, f"it must return a number, not {shown}") from None


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
