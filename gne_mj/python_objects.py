"""Games, laws and functions of time of this Python process, which tables name in place of a file.

A scenario is text, so that it can be changed, swept and kept with results. What was made in a
program or a notebook's cell is kept here under a name of its own, and the tables have that name.
Another process does not know it, and says so; if it is made there again of the same functions, it
has the same name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from secrets import token_hex
from types import FunctionType
from typing import Any, Literal, TypeVar

from pydantic import Field

from gne_mj.controllers import Law
from gne_mj.controllers.table import NetworkTable
from gne_mj.errors import InvalidInput
from gne_mj.fingerprint import fingerprint
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.registry import GAMES, LAWS, TIMES
from gne_mj.time_functions import Signal, TimeTable, called
from gne_mj.user_files import plain_law

T = TypeVar("T")
OBJECT = "of this Python process; written by gne_mj.setup"
_kept: dict[str, Any] = {}


def keep(thing: Any, name: str, *functions: Any) -> str:
    """The name of a thing in tables, always the same one; it is kept until the process ends.

    Args:
        thing: a game, say.
        name: what its own begins with.
        functions: what it is made of, if that says all of it: in another process it then has the
            same name, and a thing that is made again takes the place of the one before.
    """
    for known, kept in _kept.items():
        if kept is thing:
            return known
    known = f"{name} {fingerprint(*functions) if functions else token_hex(4)}"
    _kept[known] = thing
    return known


def kept(name: str, kind: type[T]) -> T:
    """The thing of this name.

    Raises:
        InvalidInput: this process has no such thing.
    """
    thing = _kept.get(name)
    if not isinstance(thing, kind):
        raise InvalidInput(
            "object",
            name,
            "another Python process made it: in a program give it again, also to batch(...,"
            " resume=True), or put its functions into a file that the scenario names",
        )
    return thing


@dataclass(frozen=True, eq=False)
class LawFunctions:
    """A law as plain functions (:class:`gne_mj.controllers.plain_law.PlainLaw`), for any game."""

    functions: Mapping[str, Callable[..., Any]]
    acts_outside: bool = False
    filtered: bool = False


@GAMES.register
class PythonGame(GameTable):
    """A game that a program made."""

    type: Literal["python"]
    object: str = Field(description=f"a game {OBJECT}")

    def build(self, count: int) -> Game:
        """The game."""
        game = kept(self.object, Game)
        if game.agents != count:
            raise InvalidInput("count", count, f"the {game.called} has {game.agents} agents")
        return game


@TIMES.register
class PythonFunction(TimeTable):
    """A function of the time in s that a program made"""

    type: Literal["python"]
    object: str = Field(description=f"a function {OBJECT}")

    def build(self) -> Signal:
        """See the base class."""
        return called(kept(self.object, FunctionType))


@LAWS.register
class PythonLaw(NetworkTable):
    """A law that a program made: an object, or plain functions."""

    information: Literal["python"]
    object: str = Field(description=f"a law {OBJECT}")
    parameters: dict[str, Any] = Field({}, description="handed to its functions")

    def build(self, game: Game) -> Law:
        """The law."""
        made: Law | LawFunctions = kept(self.object, (Law, LawFunctions))  # type: ignore[arg-type]
        if isinstance(made, Law):
            return made
        functions = made.functions
        name = getattr(functions["action"], "__name__", "law")
        return plain_law(
            game, self.network(game.agents), functions, self.parameters, ("object", name),
            acts_outside=made.acts_outside, filtered=made.filtered,
        )  # fmt: skip
