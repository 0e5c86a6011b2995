"""Functions of the package's top level answer what they do not take with what they do."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from gne_mj.errors import InvalidInput, nearest

P = ParamSpec("P")
R = TypeVar("R")


def answering(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, which refuses arguments that it does not know in one sentence.

    Raises:
        InvalidInput: from the function, names the argument and the nearest one, or all.
    """
    code = function.__code__
    plain, count = code.co_argcount, code.co_argcount + code.co_kwonlyargcount
    known, called = code.co_varnames[:count], f"{function.__name__}()"

    @wraps(function)
    def answered(*given: P.args, **named: P.kwargs) -> R:
        if len(given) > plain:
            right = f"{called} takes {plain or 'none'} without a name; {', '.join(known)} by name"
            raise InvalidInput(f"argument {plain + 1}", given[plain], right)
        for name, value in named.items():
            if name not in known:
                right = f"{called} has no such argument; {nearest(name, known)}"
                raise InvalidInput(name, value, right)
        return function(*given, **named)

    return answered
