"""What a sweep varies: a key of the scenario and the values that it takes."""

import re
import tomllib
from dataclasses import dataclass
from typing import Any

import numpy as np

from gne_mj.errors import InvalidInput
from gne_mj.scenario import parse_value

_NUMBER = r"[-+0-9.eE_]+"
_RANGE = re.compile(rf"({_NUMBER}):({_NUMBER}):([0-9]+)(log)?")


@dataclass(frozen=True)
class Sweep:
    """One swept key.

    Args:
        key: dotted, as in :func:`gne_mj.scenario.load_scenario`.
        values: numbers, words or lists; all different.

    Raises:
        InvalidInput: no values, or one of them twice.
    """

    key: str
    values: tuple[Any, ...]

    def __post_init__(self) -> None:
        if not self.values:
            raise InvalidInput(f"--sweep {self.key}", "nothing", "it needs at least one value")
        for at, value in enumerate(self.values):
            if value in self.values[:at]:
                raise InvalidInput(f"--sweep {self.key}", value, "every value may occur once only")

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
        raise InvalidInput("--sweep", text, "it must read KEY=FROM:TO:COUNT[log] or KEY=A,B,...")
    found = _RANGE.fullmatch(given)
    if found:
        return Sweep(key, _range(key, given, *found.groups()))
    try:
        return Sweep(key, tuple(tomllib.loads(f"values = [{given}]")["values"]))
    except tomllib.TOMLDecodeError:
        return Sweep(key, tuple(parse_value(part.strip()) for part in given.split(",")))


def _range(
    key: str, given: str, start: str, end: str, count: str, log: str | None
) -> tuple[Any, ...]:
    try:
        ends = float(start), float(end)
    except ValueError:
        raise InvalidInput(f"--sweep {key}", given, "FROM and TO must be numbers") from None
    if log and not min(ends) > 0:
        raise InvalidInput(f"--sweep {key}", given, "a logarithmic range must be positive")
    if int(count) < 2 and ends[0] != ends[1]:
        raise InvalidInput(f"--sweep {key}", given, "a range has at least two values")
    spaced = np.geomspace(*ends, int(count)) if log else np.linspace(*ends, int(count))
    # twelve digits: 0.1 rather than 0.10000000000000002
    return tuple(float(f"{value:.12g}") for value in spaced)
