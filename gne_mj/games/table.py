"""What the tables ``[systems.NAME.game]`` have in common; each game's is beside it."""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import PrivateAttr, ValidationError, model_serializer, model_validator
from pydantic_core import PydanticCustomError

from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.motion import Motion, moving_game
from gne_mj.registry import TIMES
from gne_mj.time_functions import TimeTable, from_table
from gne_mj.toml_table import Table

# The keys, and numbers of entries of lists, that lead to a number of a table
Place = tuple[str | int, ...]


class GameTable(Table):
    """A game's numbers in a scenario file, any of which may be a function of time.

    A function's number is that of time 0 for all that asks for the key.

    Attributes:
        keeps: names of constraints that go on without some of their agents, where these leave.
    """

    keeps: ClassVar[tuple[str, ...]] = ()

    _moving: dict[Place, TimeTable] = PrivateAttr(default_factory=dict)

    @model_validator(mode="wrap")
    @classmethod
    def _functions_of_time(cls, values: Any, handler: Callable[[Any], Self]) -> Self:
        if not isinstance(values, Mapping):
            return handler(values)
        found: dict[Place, TimeTable] = {}
        numbers: dict[Place, float] = {}
        for place, given in functions_in(values):
            try:
                found[place] = from_table(given)
                numbers[place] = found[place].build().at(0.0)
            except InvalidInput as error:
                raise PydanticCustomError(
                    "time_function", "{expected}",
                    {"key": _dotted((*place, error.key)), "value": error.value,
                     "expected": error.expected},
                ) from None  # fmt: skip
        made = handler(with_values(values, numbers))
        made._moving = found
        return made

    @model_serializer(mode="wrap")
    def _as_given(self, handler: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        functions = {
            place: table.model_dump(mode="json", exclude_none=True)
            for place, table in self._moving.items()
        }
        return with_values(handler(self), functions)

    @abstractmethod
    def build(self, count: int) -> Game:
        """The game for ``count`` agents, as it is at time 0."""

    def default_start(self, count: int) -> NDArray[np.float64] | None:
        """(m,) actions strictly inside, from which it is started if none are given.

        None lets a profile inside be looked for.
        """
        return None

    def away(self, count: int) -> NDArray[np.float64] | None:
        """(m,) what the action of an agent that is away counts as in others' costs.

        None lets whoever lets agents leave say it.
        """
        return None

    @property
    def moving(self) -> tuple[str, ...]:
        """The keys whose numbers are functions of time."""
        return tuple(map(_dotted, self._moving))

    def game(self, count: int) -> Game:
        """The game for ``count`` agents, with its motion if numbers of it move."""
        game = self.build(count)
        if not self._moving:
            return game
        signals = tuple(table.build() for table in self._moving.values())
        return moving_game(game, Motion(self.moving, signals, partial(self._at, count)))

    def _at(self, count: int, values: Sequence[float]) -> Game:
        """The game with these values in the places of what moves."""
        given = self.model_dump(mode="json", exclude_none=True)
        changed = with_values(given, dict(zip(self._moving, values, strict=True)))
        try:
            return type(self).model_validate(changed).build(count)
        except ValidationError as error:
            detail = error.errors()[0]
            words = detail["msg"][0].lower() + detail["msg"][1:]
            raise InvalidInput(_dotted(detail["loc"]), detail["input"], words) from None


def functions_in(values: Any, place: Place = ()) -> Iterator[tuple[Place, Mapping[str, Any]]]:
    """The functions of time within a game's table, and where they are."""
    if isinstance(values, Mapping):
        kind = values.get("type")
        if place and isinstance(kind, str) and kind in set(TIMES):
            yield place, values
            return
        for key, each in values.items():
            yield from functions_in(each, (*place, key))
    elif isinstance(values, list | tuple):
        for index, each in enumerate(values):
            yield from functions_in(each, (*place, index))


def with_values(values: Any, given: Mapping[Place, Any]) -> Any:
    """A copy of tables and lists with these in their places."""
    if () in given:
        return given[()]
    if not given:
        return values
    heads = {place[0] for place in given}
    parts = {
        head: {place[1:]: value for place, value in given.items() if place[0] == head}
        for head in heads
    }
    if isinstance(values, Mapping):
        return {
            key: with_values(each, parts[key]) if key in parts else each
            for key, each in values.items()
        }
    return [
        with_values(each, parts[index]) if index in parts else each
        for index, each in enumerate(values)
    ]


def _dotted(place: Sequence[str | int]) -> str:
    return ".".join(map(str, place))
