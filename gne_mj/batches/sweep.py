"""What a sweep varies: a key of the scenario and the values that it takes."""

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gne_mj.errors import InvalidInput
from gne_mj.scenario import parse_value, plain

_NUMBER = r"[-+0-9.eE_]+"
_RANGE = re.compile(rf"({_NUMBER}):({_NUMBER}):([0-9]+)(log)?")


MOST = 100_000  # values of one key


@dataclass(frozen=True)
class Sweep:
    """One swept key.

    Args:
        key: dotted, as in :func:`gne_mj.scenario.load_scenario`.
        values: numbers, words, lists or tables, as TOML has them; all different. NumPy's numbers
            and arrays become Python's.

    Raises:
        InvalidInput: no values, too many, one of them twice, or one that no scenario can hold.
    """

    key: str
    values: tuple[Any, ...]

    def __post_init__(self) -> None:
        given: Any = self.values
        if isinstance(given, str | bytes) or not isinstance(given, Iterable):
            raise InvalidInput("values", given, "its values must be a list")
        values = tuple(_plain(plain(value)) for value in given)
        if not values:
            raise InvalidInput("values", "nothing", "it needs at least one value")
        if len(values) > MOST:
            raise InvalidInput("values", f"{len(values)} values", f"it may have {MOST} at most")
        seen = set()
        for value in values:
            text = json.dumps(value, sort_keys=True)
            if text in seen:
                raise InvalidInput("values", value, "every value may occur once only")
            seen.add(text)
        object.__setattr__(self, "values", values)

    @property
    def labels(self) -> list[Any]:
        """The values as a coordinate has them: numbers or words; a list becomes text."""
        if all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values):
            return [float(value) for value in self.values]
        return [value if isinstance(value, str) else str(value) for value in self.values]


def parse_sweep(text: str) -> Sweep:
    """A sweep from ``key=FROM:TO:COUNT``, ``key=FROM:TO:COUNTlog`` or ``key=A,B,...``.

    Raises:
        InvalidInput: it is none of these.
    """
    key, equals, given = text.partition("=")
    if not (key and equals and given):
        raise InvalidInput("text", text, "it must read KEY=FROM:TO:COUNT[log] or KEY=A,B,...")
    found = _RANGE.fullmatch(given)
    if found:
        return Sweep(key, _range(given, *found.groups()))
    try:
        return Sweep(key, tuple(tomllib.loads(f"values = [{given}]")["values"]))
    except tomllib.TOMLDecodeError:
        return Sweep(key, tuple(parse_value(part.strip()) for part in given.split(",")))


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, float) and not np.isfinite(value):
        raise InvalidInput("values", value, "it must be finite")
    if not isinstance(value, bool | int | float | str):
        raise InvalidInput("values", str(value), "it must be a number, a word, a list or a table")
    return value


def _range(given: str, start: str, end: str, count: str, log: str | None) -> tuple[Any, ...]:
    try:
        ends = float(start), float(end)
    except ValueError:
        raise InvalidInput("text", given, "FROM and TO must be numbers") from None
    if log and not min(ends) > 0:
        raise InvalidInput("text", given, "a logarithmic range must be positive")
    if not all(np.isfinite(ends)):
        raise InvalidInput("text", given, "FROM and TO must be finite")
    if int(count) > MOST:
        raise InvalidInput("text", given, f"it may have {MOST} values at most")
    if int(count) < 2 and ends[0] != ends[1]:
        raise InvalidInput("text", given, "a range has at least two values")
    spaced = np.geomspace(*ends, int(count)) if log else np.linspace(*ends, int(count))
    # twelve digits: 0.1 rather than 0.10000000000000002
    return tuple(float(f"{value:.12g}") for value in spaced)
