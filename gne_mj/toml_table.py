"""What all tables of a scenario file share: their checks, and numbers given for each agent."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, model_validator
from pydantic_core import PydanticCustomError

from gne_mj.errors import InvalidInput, nearest

# One number for all agents, or one each
PerAgent = float | list[float]


# m_i, the entries of each agent's action
Sizes = tuple[int, ...]


# Of what every entry of an action has: one number for all; where an action is a vector, one vector
# for all agents or a list of them; else one number for each agent
PerAction = float | list[float] | list[list[float]]


@dataclass(frozen=True)
class Fills:
    """Which parameter of what is built a key fills, where that has another name.

    Args:
        parameter: its name, behind those of what it is a part of, as in "game.agents". Empty at a
            table whose keys all fill parameters of the same object as the table around it.
    """

    parameter: str


# Units that game and agents say
ACTION, INPUT = "the action's", "the input's"


@dataclass(frozen=True)
class Unit:
    """What a key's numbers are measured in, for the page of all keys.

    Args:
        name: the unit; empty for what has none, such as a weight or a count.
        range: where they must be, if no constraint of the field says so.
    """

    name: str
    range: str = ""


class Table(BaseModel):
    """A TOML table: unknown keys and numbers that are not finite are errors.

    A key fills the parameter of its own name of the object that its table builds, and those that
    :class:`Fills` says; by that errors of the parameter are told as errors of the key.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, values: Any) -> Any:
        if isinstance(values, Mapping):
            for key in values:
                if key not in cls.model_fields:
                    raise PydanticCustomError(
                        "unknown_key",
                        "'{key}' is not a key here; {hint}",
                        {"key": key, "hint": cls._hint(str(key))},
                    )
        return values

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """What was given, for one short line."""
        given = self.model_fields_set
        return ((key, value) for key, value in super().__repr_args__() if key in given)

    def key_of(self, parameter: str) -> str:
        """The dotted key in this table that filled a parameter; of a part of one what is known."""
        parts = parameter.split(".")
        for known in range(len(parts), 0, -1):
            found = _filled(self, parts[:known])
            if found is not None:
                return ".".join([*found, *parts[known:]])
        return parameter

    @classmethod
    def _hint(cls, key: str) -> str:
        """Where a key that is unknown here belongs, or the nearest one that is known here."""
        for choice in ("type", "information"):
            if choice not in cls.model_fields:
                continue
            (own,) = get_args(cls.model_fields[choice].annotation)
            others = [
                tag
                for other in all_tables()
                if choice in other.model_fields and key in other.model_fields
                for tag in get_args(other.model_fields[choice].annotation)
            ]
            if others:
                example = " (--set 'controller={...}')" if choice == "information" else ""
                theirs = " or ".join(f"'{tag}'" for tag in sorted(set(others) - {"python"}))
                return (
                    f"it belongs to {choice} = {theirs}, not to '{own}'; to change the"
                    f" {choice} give the whole table{example}"
                )
        return nearest(key, cls.model_fields)


def _filled(value: Any, parts: Sequence[str]) -> list[str] | None:
    """Which keys lead, in a table or list, to what filled a parameter; None if nothing did."""
    if not parts:
        return []
    if isinstance(value, Table):
        for name, begin in _parameters(type(value)):
            if list(parts[: len(begin)]) == begin:
                within = _filled(getattr(value, name), parts[len(begin) :])
                if within is not None:
                    return [name, *within]
        return None
    entries = dict(enumerate(value)) if isinstance(value, list) else value
    if isinstance(entries, Mapping):
        for key, entry in entries.items():
            if str(key) == parts[0]:
                within = _filled(entry, parts[1:])
                return None if within is None else [parts[0], *within]
    return None


def _parameters(table: type[Table]) -> Iterator[tuple[str, list[str]]]:
    """Each key with each parameter that it fills, as the names on the way to it."""
    for name, field in table.model_fields.items():
        yield name, [name]
        for each in field.metadata:
            if isinstance(each, Fills):
                yield name, each.parameter.split(".") if each.parameter else []


def all_tables() -> list[type[Table]]:
    """Every kind of table."""
    found: list[type[Table]] = []
    waiting: list[type[Table]] = [Table]
    while waiting:
        table = waiting.pop()
        found.append(table)
        waiting.extend(table.__subclasses__())
    return found


def union_tags() -> set[str]:
    """What may stand in the keys that choose among tables, such as "osnr" in ``game.type``."""
    keys = ("type", "information", "controller")
    fields = [table.model_fields[key] for table in all_tables() for key in keys
              if key in table.model_fields]  # fmt: skip
    chosen = [field.annotation for field in fields if get_origin(field.annotation) is Literal]
    return {tag for kind in chosen for tag in get_args(kind)}


def dimension_of(sizes: Sizes) -> int:
    """Channels of each agent, where all have as many; else each channel is taken by itself."""
    return sizes[0] if len(set(sizes)) == 1 else 1


def per_agent(
    key: str, given: PerAgent, count: int, *, positive: bool = False
) -> NDArray[np.float64]:
    """(count,) numbers, one an agent.

    Raises:
        InvalidInput: naming ``key``, for another number of them, or one that should be positive.
    """
    values = np.asarray(given, dtype=np.float64)
    if values.ndim == 1 and len(values) != count:
        raise InvalidInput(
            key, given, f"it must be one number or a list of {count}, one for each agent"
        )
    if positive and np.any(values <= 0):
        raise InvalidInput(key, given, "it must be positive")
    return np.broadcast_to(values, (count,)).copy()


def per_action(key: str, given: PerAction, sizes: Sizes) -> NDArray[np.float64]:
    """(m,) numbers, agent by agent.

    Raises:
        InvalidInput: naming ``key``, for lists of other lengths.
    """
    count, dimension = len(sizes), dimension_of(sizes)
    vectors: list[Any] = []
    if isinstance(given, list):
        if any(isinstance(entry, list) for entry in given):
            vectors = given
        elif max(sizes) > 1:
            vectors = [given] * count
    if not vectors:
        return np.repeat(per_agent(key, given, count), sizes)  # type: ignore[arg-type]
    if tuple(map(len, vectors)) != tuple(sizes):
        one = f"one list of {dimension} for all agents, or " if dimension > 1 else ""
        raise InvalidInput(
            key,
            given,
            f"it must be one number, {one}a list of {count} lists, one for each agent",
        )
    return np.concatenate(vectors, dtype=np.float64)
