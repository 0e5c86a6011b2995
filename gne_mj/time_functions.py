"""Numbers that change in time: ramps, sines, steps with a rate limit, tables, Python functions.

Wherever a game's table has a number it may have one of these tables in its place
(:mod:`gne_mj.motion`). Native code evaluates them by :func:`value_at`. Each kind is a registered
table; that of Python functions is in :mod:`gne_mj.user_files`.
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, create_model

from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.native import kernel
from gne_mj.plain import call_out, callable_address, number_of
from gne_mj.registry import TIMES
from gne_mj.toml_table import Table, Unit

LINEAR, SINE, CALLED = range(3)  # what a row begins with


@kernel
def value_at(row, time):
    """The value at a time in s of a function that a row of numbers describes, see :class:`Signal`.

    LINEAR: times, which rise, then as many values, straight lines between and constant beyond them.
    SINE: mean, amplitude, angular frequency (1/s), phase (rad). CALLED: the address of a C function
    as :func:`gne_mj.plain.callable_address` makes it, which is given the time.
    """
    kind = int(row[0])
    if kind == SINE:
        return row[1] + row[2] * np.sin(row[3] * time + row[4])
    if kind == CALLED:
        return call_out(np.int64(row[1]), 0, 0, 0, time, row, row, row)
    n = (len(row) - 1) // 2
    if not time > row[1]:
        return row[1 + n]
    if time >= row[n]:
        return row[2 * n]
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if row[1 + middle] <= time:
            low = middle
        else:
            high = middle
    part = (time - row[1 + low]) / (row[1 + high] - row[1 + low])
    return row[1 + n + low] + (row[1 + n + high] - row[1 + n + low]) * part


@dataclass(frozen=True, eq=False)
class Signal:
    """A number that changes in time.

    Attributes:
        row: as :func:`value_at` reads it.
        knots: times in s at which it or its rate jumps, or its extremes are.
        function: the user's, of a Python function.
        kept: what must live as long as ``row`` is used.
    """

    row: NDArray[np.float64]
    knots: tuple[float, ...] = ()
    function: Callable[[float], Any] | None = None
    kept: object = None

    def at(self, time: float) -> float:
        """The value at a time in s.

        Raises:
            UserCodeError: the user's function raises, or returns what is no finite number.
        """
        if self.function is None:
            return float(value_at(self.row, time))
        try:
            value = number_of(self.function, self.function(time))
        except UserCodeError:
            raise
        except Exception as error:
            raise UserCodeError(self.function, error, f"at {time:g} s") from error
        if not np.isfinite(value):
            words = "what it returns is not a finite number"
            raise UserCodeError(self.function, words, f"at {time:g} s")
        return value


def linear(times: Sequence[float], values: Sequence[float]) -> Signal:
    """Straight lines through values at times in s, constant before the first and after the last."""
    return Signal(np.array([LINEAR, *times, *values], dtype=np.float64), tuple(times))


def called(function: Callable[[float], Any]) -> Signal:
    """A Python function of the time in s."""
    address, kept = callable_address(
        lambda a, b, c, time, x, y, z: number_of(function, function(time)), function
    )
    return Signal(np.array([CALLED, address]), (), function, kept)


class TimeTable(Table):
    """A number that changes in time, in a scenario file."""

    @abstractmethod
    def build(self) -> Signal:
        """The function of time."""


def from_table(given: Any) -> TimeTable:
    """The table that ``given``, a mapping with one of the registered types, stands for.

    Raises:
        InvalidInput: names the key in it, and what would be right.
    """
    kind = cast(type[TimeTable], TIMES[given["type"]])
    try:
        return kind.model_validate(given)
    except ValidationError as error:
        detail = error.errors()[0]
        key = ".".join(map(str, detail["loc"])) or "type"
        if detail["type"] == "unknown_key":
            name = str(detail["ctx"]["key"])
            raise InvalidInput(name, given[name], str(detail["ctx"]["hint"])) from None
        value = None if detail["type"] == "missing" else detail["input"]
        words = detail["msg"][0].lower() + detail["msg"][1:].replace("Input should", "it should")
        raise InvalidInput(
            key, value, words.replace("input should", "it should").replace("field required",
            "this key must be given")
        ) from None  # fmt: skip


@TIMES.register
class ConstantTable(TimeTable):
    """A number that does not change"""

    type: Literal["constant"]
    value: float = Field(description="which")

    def build(self) -> Signal:
        """See the base class."""
        return linear([0.0], [self.value])


class _Ramp(TimeTable):
    """A change at a constant rate"""

    def build(self) -> Signal:
        """See the base class."""
        at: Any = self
        begin, end = getattr(at, "from"), at.to
        if begin == end:
            return linear([at.start], [begin])
        return linear([at.start, at.start + abs(end - begin) / at.rate], [begin, end])


class _Steps(TimeTable):
    """Steps, each gone at a rate that is limited"""

    def build(self) -> Signal:
        """See the base class; the limit makes straight lines of steps."""
        at: Any = self
        _check_times(at.times, len(at.to), "to")
        value = getattr(at, "from")
        knots, values = [at.times[0] - 1.0], [value]
        for begin, end, target in zip(at.times, [*at.times[1:], np.inf], at.to, strict=True):
            if knots[-1] < begin:
                knots.append(begin)
                values.append(value)
            if value == target:
                continue
            reached = begin + abs(target - value) / at.rate
            if reached > end:  # the next step begins on the way
                target = value + (end - begin) / (reached - begin) * (target - value)
                reached = end
            knots.append(reached)
            values.append(target)
            value = target
        return linear(knots, values)


def _check_times(times: Sequence[float], count: int, key: str) -> None:
    if len(times) != count or not count:
        raise InvalidInput("times", times, f"it must list as many times as '{key}' has values")
    if np.any(np.diff(times) <= 0):
        raise InvalidInput("times", times, "they must rise")


def _with_from(table: type[TimeTable], kind: str, **fields: Any) -> Any:
    """The registered table with a key "from", a word that no class may have as a field of its own.

    Args:
        table: without its keys.
        kind: its type.
        **fields: its other keys.
    """
    begin = (float, Field(description="the value before"))
    return TIMES.register(
        create_model(
            f"{kind.title()}Table", __base__=table, __module__=__name__, __doc__=table.__doc__,
            **{"type": (Literal[kind], ...), "from": begin, **fields},
        )
    )  # fmt: skip


_SECONDS = Unit("s")
_RATE = (float, Field(gt=0, description="how fast it changes, per s"))
RampTable = _with_from(
    _Ramp, "ramp",
    to=(float, Field(description="the value after")), rate=_RATE,
    start=(Annotated[float, _SECONDS], Field(0.0, description="when it begins to change")),
)  # fmt: skip
StepsTable = _with_from(
    _Steps, "steps",
    times=(Annotated[list[float], _SECONDS], Field(description="when steps begin; they rise")),
    to=(list[float], Field(description="the value that each goes to")), rate=_RATE,
)  # fmt: skip


@TIMES.register
class SineTable(TimeTable):
    """mean + amplitude sin(2 pi t / period + phase)"""

    type: Literal["sine"]
    mean: float = Field(description="about which it swings")
    amplitude: float = Field(description="how far")
    period: Annotated[float, Unit("s")] = Field(gt=0, description="of one swing")
    phase: Annotated[float, Unit("rad")] = Field(0.0, description="at t = 0")

    def build(self) -> Signal:
        """See the base class; knots are the extremes of the first period."""
        frequency = 2.0 * np.pi / self.period
        row = np.array([SINE, self.mean, self.amplitude, frequency, self.phase])
        quarters = (np.arange(1, 5) * 0.5 * np.pi - self.phase % (0.5 * np.pi)) / frequency
        return Signal(row, tuple(quarters.tolist()))


@TIMES.register
class PointsTable(TimeTable):
    """Values at times, straight lines between them, constant before and after"""

    type: Literal["table"]
    times: Annotated[list[float], Unit("s")] = Field(description="they rise")
    values: list[float] = Field(description="one for each time")

    def build(self) -> Signal:
        """See the base class."""
        _check_times(self.times, len(self.values), "values")
        return linear(self.times, self.values)
