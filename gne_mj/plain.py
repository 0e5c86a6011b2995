"""Plain Python functions in place of kernels: slow, and all that a first try needs.

A native loop cannot call Python, but it can call a C function at an address, and ctypes makes a C
function of a Python one. The kernels of this module do that: a game of plain functions is this
module with the addresses as its parameters, and so runs in every loop and engine that numba
functions run in, some hundred times slower. Putting ``@kernel`` (:mod:`gne_mj.native`) before each
of the same functions gives full speed.

An exception inside a native loop cannot be raised there. It is kept, the function's value becomes
"not a number", which ends a run, and :func:`raise_pending` raises it afterwards; so is a value that
is not a number. Arrays that a
plain function only reads are handed to it read-only, and are valid during the call.
"""

import ctypes
import inspect
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, UserCodeError, nearest
from gne_mj.linked_game import FUNCTIONS
from gne_mj.native import intrinsic_or, is_kernel, kernel

Array = NDArray[np.float64]

# The second derivatives may be left out
_OPTIONAL = ("add_cost_hessian", "constraint_hessian")
_DIFFERENCE = 6e-6  # step of differences, relative to the entry's size
_SHORTEST = 1e-13  # beyond which it is not shortened

# double f(integers a, b, c; double scale; arrays x, y, z, each an address and a length)
_SIGNATURE = ctypes.CFUNCTYPE(
    ctypes.c_double,
    *(ctypes.c_int64,) * 3,
    ctypes.c_double,
    *(ctypes.c_int64,) * 6,
)
_VIEWS = 1000  # arrays whose views are kept for the next call
_pending: list[tuple[Callable[..., Any], BaseException, str]] = []


@dataclass(frozen=True, eq=False)
class Written:
    """A game's functions as its author wrote them.

    Attributes:
        module: that defines them.
        parameters: q, which each of them takes first.
        native: whether they are kernels.
        functions: those of FUNCTIONS that there are.
    """

    module: ModuleType
    parameters: Array
    native: bool
    functions: Mapping[str, Callable[..., Any]]


def raise_pending() -> None:
    """Raise what a plain function raised inside a native loop, if any did.

    Raises:
        UserCodeError: names the function, its file and line.
        KeyboardInterrupt: Ctrl-C, which is no error of the function's.
    """
    if _pending:
        function, error, at = _pending[0]
        _pending.clear()
        if isinstance(error, KeyboardInterrupt | UserCodeError):
            raise error
        raise UserCodeError(function, error, at) from error


def forgive_pending() -> None:
    """Forget what plain functions raised, where a solver found its way around such a profile.

    What would end the program (``sys.exit``, Ctrl-C) is not forgiven, but raised.
    """
    if _pending:
        _pending[:] = [each for each in _pending if not isinstance(each[1], Exception)]
        raise_pending()


def not_a_number(function: Callable[..., Any], call: Callable[[], Any], at: str) -> UserCodeError:
    """The error to raise where a user's function returned something that is not a number.

    Args:
        function: the user's.
        call: calls it once more as it was called, to find the line.
        at: for what it was called.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            call()
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        return UserCodeError(function, error, at)
    return UserCodeError(function, "what it returns is not a number", at)


def check_numbers(game: Written, data: Any, y: Array) -> None:
    """Call a game's functions at a profile, each as it was written.

    Args:
        game: whose functions.
        data: its :class:`gne_mj.game_model.GameData`.
        y: (m,), a copy.

    Raises:
        UserCodeError: one raises, or what it returns (or adds) is not a finite number.
    """
    at, row = data.offsets.tolist(), np.zeros(len(y))
    for k in range(len(data.member_pointer) - 1):
        _check(game, "constraint", k, y)
        for i in data.member_index[data.member_pointer[k] : data.member_pointer[k + 1]].tolist():
            for a in range(at[i], at[i + 1]):
                _check(game, "constraint_gradient", k, a, y)
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            _check(game, "cost_gradient", i, a, y)
            if "add_cost_hessian" in game.functions:
                row[:] = 0.0
                _check(game, "add_cost_hessian", i, a, y, 1.0, row)
        _check(game, "cost", i, y)


def _check(game: Written, name: str, number: int, *rest: Any) -> None:
    function, q = game.functions[name], game.parameters
    at = place_of(name)(number, next(each for each in rest if isinstance(each, np.ndarray)))
    try:
        with np.errstate(all="ignore"):
            value = function(q, number, *rest)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise UserCodeError(function, error, at) from error
    if not np.all(np.isfinite(rest[-1] if value is None else number_of(function, value))):
        raise not_a_number(function, lambda: function(q, number, *rest), at)


def callable_address(
    function: Callable[..., float],
    own: Callable[..., Any],
    about: Callable[[int, Array], str] = lambda first, x: "",
    *,
    any_value: bool = False,
) -> tuple[float, Any]:
    """A C function's address, as a double, that calls ``function(a, b, c, scale, x, y, z)``.

    x and y are read-only, z is not. ``own`` is the user's function behind it, and ``about(a, x)``
    tells for what it is called, for messages. With ``any_value`` it may return what is not a
    number. The second item must be kept as long as the address is used.
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
        x: Array = np.zeros(0)
        try:
            x, y, z = (view(arrays[at], arrays[at + 1], at == 4) for at in (0, 2, 4))
            value = function(a, b, c, scale, x, y, z)
            if any_value or value == value:
                return value
            raise not_a_number(own, lambda: function(a, b, c, scale, x, y, z), about(a, x))
        except BaseException as error:
            if not _pending or not isinstance(error, Exception):
                _pending.insert(0, (own, error, about(a, x)))
            return float("nan")

    kept = _SIGNATURE(called)
    return float(ctypes.cast(kept, ctypes.c_void_p).value or 0), kept


def _call_out(function: int, a: int, b: int, c: int, scale: float, *arrays: Array) -> float:
    """The same in plain Python."""
    flat = (number for array in arrays for number in (array.ctypes.data, len(array)))
    value: float = _SIGNATURE(int(function))(a, b, c, scale, *flat)
    return value


@intrinsic_or(_call_out)
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


def as_written(module: ModuleType, parameters: Array) -> Written:
    """The functions of a game's module.

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
            raise InvalidInput("kernels", file, f"it must define {_call(name, arguments)}")
        if natives and name not in natives:
            raise InvalidInput(
                "kernels",
                file,
                f"its '{natives[0]}' is a kernel and its '{name}' is not; mark all six functions"
                " with @kernel, or none",
            )
        check_arguments("kernels", file, found[name], name, arguments)
    return Written(module, np.asarray(parameters, dtype=np.float64), bool(natives), found)


def check_arguments(
    key: str,
    file: str,
    function: Any,
    name: str,
    arguments: tuple[str, ...],
    parameters: Iterable[str] = (),
) -> None:
    """Refuse a user's function that cannot take these arguments, and parameters by name."""
    signature, given = inspect.signature(function), list(parameters)
    own = tuple(signature.parameters)[len(arguments) :]
    for wrong in given:
        if own and wrong not in signature.parameters and not _takes_any(signature):
            right = f"its {_call(name, (*arguments, *own))} has no '{wrong}'"
            raise InvalidInput(key, file, f"{right}; {nearest(wrong, own)}")
    try:
        signature.bind(*arguments, **dict.fromkeys(given))
    except TypeError as error:
        raise InvalidInput(
            key, file, f"it must define {_call(name, (*arguments, *given))}: {error}"
        ) from None


def _takes_any(signature: inspect.Signature) -> bool:
    return any(each.kind is each.VAR_KEYWORD for each in signature.parameters.values())


def _call(name: str, arguments: tuple[str, ...]) -> str:
    return f"{name}({', '.join(arguments)})"


def plain_kernels(
    game: Written, own: Sequence[Sequence[int]]
) -> tuple[ModuleType, Array, list[Any]]:
    """This module, the parameters it needs, and what must be kept alive meanwhile.

    Args:
        game: its functions, plain ones.
        own: for each entry of a profile the constraints that contain it.
    """
    q, given = game.parameters, game.functions
    cost, gradient = given["cost"], given["cost_gradient"]
    constraint, slope = given["constraint"], given["constraint_gradient"]
    second, bend = given.get("add_cost_hessian"), given.get("constraint_hessian")
    stencils = Stencils(
        lambda k, y: _number(constraint, q, k, y), lambda k, a, y: _number(slope, q, k, a, y), own
    )

    def add_cost_hessian(i: int, a: int, y: Array, scale: float, out: Array) -> float:
        if second is not None:
            second(q, i, a, y, scale, out)
        else:
            for b in range(len(y)):
                out[b] += scale * stencils.slope(lambda at: _number(gradient, q, i, a, at), y, b)
        total = float(out.sum())
        return 0.0 if np.isfinite(total) else total

    def constraint_hessian(k: int, a: int, b: int, y: Array) -> float:
        if bend is not None:
            return _number(bend, q, k, a, b, y)
        return stencils.slope(lambda at: _number(slope, q, k, a, at), y, b)

    functions: tuple[tuple[Callable[..., float], Callable[..., Any]], ...] = (
        (lambda i, a, b, scale, y, *_: _number(cost, q, i, y), cost),
        (lambda i, a, b, scale, y, *_: _number(gradient, q, i, a, y), gradient),
        (lambda i, a, b, scale, y, _, o: add_cost_hessian(i, a, y, scale, o), second or gradient),
        (lambda k, a, b, scale, y, *_: _number(constraint, q, k, y), constraint),
        (lambda k, a, b, scale, y, *_: _number(slope, q, k, a, y), slope),
        (lambda k, a, b, scale, y, *_: constraint_hessian(k, a, b, y), bend or slope),
    )
    # Outside its set a constraint need not be a number: that is how a profile is seen to be there.
    addresses, kept = zip(
        *(
            callable_address(function, mine, place_of(name), any_value=name == "constraint")
            for name, (function, mine) in zip(FUNCTIONS, functions, strict=True)
        ),
        strict=True,
    )
    return sys.modules[__name__], np.array(addresses), list(kept)


def place_of(name: str) -> Callable[[int, Array], str]:
    """Tells for which agent or constraint, from 0, and where a game's function was called."""
    what = "constraint" if name.startswith("constraint") else "agent"

    def about(number: int, y: Array) -> str:
        shown = ", ".join(f"{value:.6g}" for value in y[:6]) + ", ..." * (len(y) > 6)
        return f"for {what} {number + 1} at y = [{shown}]"

    return about


class Stencils:
    """Difference quotients that stay inside the set, where a game's functions need not be defined.

    Args:
        constraint: g_l(y), of l and y.
        slope: dg_l/dy_b, of l, b and y.
        own: for each entry of a profile the constraints that contain it.
    """

    def __init__(
        self,
        constraint: Callable[[int, Array], float],
        slope: Callable[[int, int, Array], float],
        own: Sequence[Sequence[int]],
    ) -> None:
        self._constraint, self._slope, self._own = constraint, slope, own
        self._at, self._found = b"", dict[int, tuple[Array, list[tuple[float, Array]]]]()

    def slope(self, function: Callable[[Array], float], y: Array, b: int) -> float:
        """df/dy_b to second order in the step."""
        at = y.tobytes()
        if at != self._at:
            self._at, self._found = at, {}
        if b not in self._found:
            self._found[b] = self._stencil(y, b)
        base, others = self._found[b]
        value = function(base)
        return float(sum(weight * (function(point) - value) for weight, point in others))

    def _stencil(self, y: Array, b: int) -> tuple[Array, list[tuple[float, Array]]]:
        """A profile, and weights of differences to others: on the other side, or of two inside."""
        scale = self._scale(y, b)
        step = _DIFFERENCE * scale
        inside = self._inside(y, b)
        while True:
            above, below = _shifted(y, b, step), _shifted(y, b, -step)
            up, down = self._inside(above, b), self._inside(below, b)
            if (up and down) or not inside or step < _SHORTEST * scale:
                return below, [(1.0 / (above[b] - below[b]), above)]
            near, sign = (above, 1.0) if up else (below, -1.0)
            far = _shifted(y, b, 2.0 * sign * step)
            if (up or down) and self._inside(far, b):
                along = near[b] - y[b]
                return y.copy(), [(2.0 / along, near), (-0.5 / along, far)]
            step *= 0.5

    def _scale(self, y: Array, b: int) -> float:
        """Size of an entry: its own, or its distance to the nearest bound if that is more."""
        distance = np.inf
        for k in self._own[b]:
            steepness = abs(self._slope(k, b, y))
            if steepness > 0.0:
                distance = min(distance, abs(self._constraint(k, y)) / steepness)
        return float(max(abs(y[b]), min(distance, max(1.0, np.max(np.abs(y))))))

    def _inside(self, y: Array, b: int) -> bool:
        return all(self._constraint(k, y) < 0.0 for k in self._own[b])


def _shifted(y: Array, b: int, step: float) -> Array:
    shifted = y.copy()
    shifted[b] += step
    return shifted


def _number(function: Callable[..., Any], *arguments: Any) -> float:
    return number_of(function, function(*arguments))


def number_of(function: Callable[..., Any], value: Any) -> float:
    """What a user's function returned, as the one real number that it must be.

    Raises:
        UserCodeError: it is something else.
    """
    if isinstance(value, float):
        return float(value)
    try:
        # NumPy would drop an imaginary part, and read a text
        if not (isinstance(value, str | bytes) or np.iscomplexobj(value)):
            return float(value)
    except (TypeError, ValueError):
        pass
    shown = "None" if value is None else f"{type(value).__name__} {value!r:.40}"
    raise UserCodeError(function, f"it must return a number, not {shown}")


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
