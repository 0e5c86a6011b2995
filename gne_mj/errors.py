"""Errors that the package raises on purpose; each message is one sentence a user can act on."""

import difflib
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import CodeType
from typing import Any

USER_MODULES = "gne_mj_user_"  # what the names of modules of users' files begin with
# Characters of a message, and of a value or name in it: the rest is left out
LONGEST, LONGEST_VALUE = 350, 100


class GneError(Exception):
    """Base of every error that this package raises on purpose; its message is one short line."""

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))

    def __reduce__(self) -> tuple[Any, ...]:
        """Let it come back from a cluster's worker, though it is not made of its message."""
        return GneError._again, (type(self), self.args, self.__dict__)

    @staticmethod
    def _again(kind: "type[GneError]", args: tuple[Any, ...], about: dict[str, Any]) -> "GneError":
        error = kind.__new__(kind, *args)
        error.__dict__.update(about)
        return error


class Refusal(GneError, ValueError):
    """What was given cannot be used.

    Attributes:
        key: which parameter of the function or class that was called; what is within it behind
            dots, as in "faults.0.agents". Errors of a scenario's file have its dotted key, and
            those of the command line the flag, since these layers name anew (:func:`renaming`).
        about: the rest of the sentence.
    """

    def __init__(self, key: str, about: str) -> None:
        super().__init__(f"{one_line(key, LONGEST_VALUE)}: {about}")
        self.key, self.about = key, about

    def rename(self, key: str, about: str | None = None) -> None:
        """Name by another key what was refused, and say other words about it if there are any."""
        self.__dict__ |= {"key": key, "about": about or self.about}
        self.args = (one_line(f"{one_line(key, LONGEST_VALUE)}: {self.about}"),)


class InvalidInput(Refusal):
    """A value that cannot be used: names the parameter, the value and what would be right.

    Attributes:
        value: what was given.
        expected: what would be right.
    """

    def __init__(self, key: str, value: object, expected: str) -> None:
        self.value, self.expected = value, expected
        given = "nothing is given" if value is None else f"got {shown(value)}"
        super().__init__(key, f"{given}, but {expected}")


class InfeasibleStart(Refusal):
    """An initial action (or estimate) on or outside the boundary of the shared constraint set.

    Attributes:
        constraint: name of the constraint that is not strictly satisfied.
        value: its value g_l(y(0)), which would have to be negative.
    """

    status = "infeasible_start"

    def __init__(self, key: str, what: str, constraint: str, value: float) -> None:
        self.constraint, self.value = constraint, value
        super().__init__(
            key,
            f"the {what} must lie strictly inside the constraint set, but constraint"
            f" '{constraint}' has g = {value + 0.0:.6g} (margin {0.0 - value:.6g}); it must be"
            " negative",
        )


@contextmanager
def renaming(name: Callable[[str], str]) -> Iterator[None]:
    """Let what is refused within be named as whoever called knows it: ``name(key)``."""
    try:
        yield
    except Refusal as error:
        error.rename(name(error.key))
        raise


@contextmanager
def part_of(owner: str, *others: str) -> Iterator[None]:
    """Name what is refused within as a part of ``owner``, but for ``others`` that stand beside it.

    >>> with part_of("system", "clock"):
    ...     raise InvalidInput("mode", "continuous", "it must be 'sampled'")  # system.mode
    """
    beside = (owner, *others)
    with renaming(lambda key: key if key.split(".")[0] in beside else f"{owner}.{key}"):
        yield


@contextmanager
def named(**parameters: str) -> Iterator[None]:
    """Name by other parameters what is refused within, by what they are called there.

    One whose name is empty is left out before what is a part of it.
    """

    def name(key: str) -> str:
        head, dot, rest = key.partition(".")
        return f"{parameters.get(head, head)}{dot}{rest}".removeprefix(".")

    with renaming(name):
        yield


class UserCodeError(GneError, RuntimeError):
    """A function of the user's own raised, or returned something of no use; the cause is chained.

    Args:
        function: the user's, or its code.
        error: what it raised, or a sentence about what it returned.
        at: for what it was called, e.g. "for agent 2 at y = [0.5, -0.1]".

    Attributes:
        where: the function, with its file and line where they are known.
    """

    status = "user_code_failed"

    def __init__(
        self, function: Callable[..., Any] | CodeType, error: BaseException | str, at: str = ""
    ) -> None:
        inner = written(function)
        code = inner if isinstance(inner, CodeType) else getattr(inner, "__code__", None)
        name = getattr(inner, "__name__", repr(inner) if code is None else code.co_name)
        self.where = name
        if code is not None:
            line = code.co_firstlineno
            if isinstance(error, BaseException):  # the deepest line of the user's own file
                lines = traceback.extract_tb(error.__traceback__)
                line = next((f.lineno for f in lines[::-1] if f.filename == code.co_filename), line)
            self.where = f"{Path(code.co_filename).name}, line {line}, in {name}"
        what = raised(error) if isinstance(error, BaseException) else error
        super().__init__(f"{self.where}: " + " ".join(f"{what} {at}".split()))


def written(function: Any) -> Any:
    """The function that a user wrote, of one with arguments given, or called for each agent."""
    while isinstance(function, partial):
        function = next((each for each in function.args if callable(each)), function.func)
    return function


def raised(error: BaseException) -> str:
    """What an exception is and says, for a sentence."""
    if isinstance(error, KeyboardInterrupt):
        return "Ctrl-C ended it"
    name, said = type(error).__name__, str(error)
    if isinstance(error, AttributeError) and isinstance(error.name, str) and "mean" not in said:
        known = [each for each in dir(error.obj) if not each.startswith("_")]
        close = difflib.get_close_matches(error.name, known, n=1)
        said += f"; did you mean '{close[0]}'?" if close else ""
    return f"{name}: {said}" if said else name


def fault_of_user(error: BaseException | None) -> UserCodeError | None:
    """The same as an error of a user's file, if it, or what it came of, was raised in one."""
    while error is not None:
        frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
        for frame in reversed(frames):
            if str(frame.f_globals.get("__name__")).startswith(USER_MODULES):
                return UserCodeError(frame.f_code, error)
        error = error.__cause__ or error.__context__
    return None


class EngineError(GneError, RuntimeError):
    """MuJoCo cannot be driven natively here (unknown version, or callbacks already in use)."""


class PluginError(GneError, RuntimeError):
    """Another package's plug-in cannot be loaded; the cause is chained."""


class MissingExtra(GneError, ImportError):
    """A part of the package is asked for whose extra is not installed."""


class SolverError(GneError, RuntimeError):
    """An iteration ended without reaching its tolerance; the numbers are attributes."""

    status = "not_solved"

    def __init__(self, message: str, residual: float, iterations: int) -> None:
        self.residual, self.iterations = residual, iterations
        super().__init__(f"{message} (residual {residual:.3g} after {iterations} iterations)")


class StorageError(GneError, RuntimeError):
    """Results cannot be written, as on a full disk; what was written before is whole."""

    status = "not_stored"


class ClusterError(GneError, RuntimeError):
    """A cluster's scheduler no longer answers, or its workers end; what was stored is whole."""

    status = "cluster_lost"


def one_line(text: str, most: int = LONGEST) -> str:
    """A text in one line of at most so many characters, without the middle of a longer one."""
    if len(text) > most:
        end = most // 3
        text = f"{text[: most - end - 5]} ... {text[len(text) - end :]}"
    if text.isprintable():
        return text
    escaped = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return escaped if len(escaped) <= most else one_line(escaped, most)


def shown(value: object) -> str:
    """A value in a message: as Python writes it, without the middle of what is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # of an integer of thousands of digits, or very deep
        text = f"{type(value).__name__} that is too large to be shown"
    return one_line(text, LONGEST_VALUE)


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint for a name that is not known: the nearest one, or all."""
    known = list(known)
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"choose from {', '.join(known)}"
