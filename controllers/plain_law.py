"""A law of plain Python functions: slow, and all that a first try needs.

The functions get NumPy arrays and the game as a Python object, and run in every loop and engine
(see :mod:`gne_mj.plain` for how).
"""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.controllers.law import Law
from gne_mj.controllers.no_memory import storage as storage
from gne_mj.controllers.settings import COUNT
from gne_mj.errors import InvalidInput, UserCodeError, written
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.plain import call_out, callable_address

Array = NDArray[np.float64]

# Entries of the settings behind the laws' numbers: addresses of the two functions
ACTION, _RATE = COUNT, COUNT + 1


class PlainLaw(Law):
    """A law given by plain functions.

    Args:
        game: what is played.
        action: ``action(game, rho, y, memory)`` returns u, shape (m,).
        rate: ``rate(game, rho, y, memory)`` returns the memory's rate; needed with a memory only.
        memory: the memory at the start, as a function of y(0), or None for a static law.
    """

    def __init__(
        self,
        game: Game,
        action: Callable[[Game, float, Array, Array], ArrayLike],
        rate: Callable[[Game, float, Array, Array], ArrayLike] | None = None,
        memory: Callable[[Array], ArrayLike] | None = None,
    ) -> None:
        if (rate is None) != (memory is None):
            raise InvalidInput(
                "rate",
                "no rate" if rate is None else "a rate",
                "a law with a memory has both of these functions, rate and initial_memory, a static"
                " law none",
            )
        self._game, self._action, self._rate, self._memory = game, action, rate, memory
        self.propagates = memory is None
        self._kept: list[Any] = []

    def __repr__(self) -> str:
        memory = "without a memory" if self._memory is None else "with a memory"
        return f"<PlainLaw of {_name(self._action)}, {memory}>"

    @property
    def kernels(self) -> ModuleType:
        """This module."""
        return sys.modules[__name__]

    def settings(self, rho: float) -> Array:
        """See the base class; behind the numbers stand the functions' addresses."""

        def fill(function: Callable[..., ArrayLike]) -> Callable[..., float]:
            def filled(
                a: int, b: int, c: int, scale: float, y: Array, memory: Array, out: Array
            ) -> float:
                value = _numbers(function, self._game, rho, y, memory)
                if value.shape != out.shape:
                    raise UserCodeError(
                        function, f"it must return {len(out)} numbers, not shape {value.shape}"
                    )
                out[:] = value
                return 0.0

            return filled

        functions = [self._action, self._rate or self._action]
        addresses, kept = zip(*(callable_address(fill(f), f) for f in functions), strict=True)
        self._kept.extend(kept)
        return np.concatenate([super().settings(rho), addresses])

    def asked(self, rho: float, y: Array) -> Array:
        """What its own function asks for at y (m,) without a memory.

        Raises:
            UserCodeError: it raises, or does not return m numbers.
        """
        try:
            value = _numbers(self._action, self._game, rho, y.copy(), np.zeros(0))
        except (KeyboardInterrupt, UserCodeError):
            raise
        except BaseException as error:
            raise UserCodeError(self._action, error) from error
        if value.shape != y.shape:
            raise UserCodeError(
                self._action, f"it must return {len(y)} numbers, not shape {value.shape}"
            )
        return value

    def first_memory(self, y: Array) -> Array:
        """See the base class."""
        if self._memory is None:
            return np.zeros(0)
        try:
            memory = _numbers(self._memory, y.copy())
        except (KeyboardInterrupt, UserCodeError):
            raise
        except BaseException as error:
            raise UserCodeError(self._memory, error) from error
        if memory.ndim != 1 or not len(memory):
            raise UserCodeError(
                self._memory, f"it must return one row of numbers, not shape {memory.shape}"
            )
        return memory.copy()


class PlainLawOutside(PlainLaw):
    """The same, of functions that also know what to do where constraints are violated."""

    acts_outside: ClassVar[bool] = True


def _name(function: Callable[..., Any]) -> str:
    own = written(function)
    return str(getattr(own, "__name__", own))


def _numbers(function: Callable[..., ArrayLike], *arguments: Any) -> Array:
    value = function(*arguments)
    try:
        array = np.asarray(value)
        if array.dtype.kind in "fiub":  # NumPy would drop an imaginary part, and read a text
            return array.astype(np.float64)
    except (TypeError, ValueError):
        pass
    kind = "complex ones" if np.iscomplexobj(value) else type(value).__name__
    raise UserCodeError(function, f"it must return numbers, not {kind}")


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) by the law's own function; not a number if that raised."""
    address = np.int64(problem.settings[ACTION])
    failed = call_out(address, 0, 0, 0, 0.0, y, memory, u)
    u[0] += failed  # zero, or not a number
    return -1


@kernel
def rate(problem, y, memory, out):
    """Fill out by the law's own function."""
    if len(memory) > 0:
        failed = call_out(np.int64(problem.settings[_RATE]), 0, 0, 0, 0.0, y, memory, out)
        out[0] += failed


@kernel
def propagate(problem, y, memory, scratch):
    """No exact propagation of an unknown memory: such laws run in mode continuous."""
