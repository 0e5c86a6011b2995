"""What scenario files can name: games, agent types, laws, low-level controllers, faults and so on.

Things with keys of their own are named by their tables, which register beside what they make:

    @GAMES.register
    class CournotTable(GameTable):
        type: Literal["cournot"]
        ...

Modes and schedules have none, and register themselves, by their names. Other packages register
theirs in modules that they name as entry points of the group ``gne_mj.plugins``;
:func:`load_plugins` imports these before scenarios are read.
"""

from collections.abc import Iterator
from functools import cache
from importlib.metadata import entry_points
from typing import Annotated, Any, Generic, Protocol, TypeVar, Union, get_args

from pydantic import Field
from pydantic_core import PydanticKnownError, core_schema

from gne_mj.errors import GneError, InvalidInput, PluginError, nearest, raised
from gne_mj.toml_table import Table


class Named(Protocol):
    """What registers by its name."""

    @property
    def name(self) -> str:
        """What scenario files call it."""


T = TypeVar("T", bound=Table)
N = TypeVar("N", bound=Named)
PLUGINS = "gne_mj.plugins"  # the group of entry points


class Registry:
    """The tables of one kind of thing.

    Args:
        key: of the table, which says what is meant: a literal in each of them.
    """

    def __init__(self, key: str = "type") -> None:
        self.key = key
        self._tables: dict[str, type[Table]] = {}

    def register(self, table: type[T]) -> type[T]:
        """Let scenario files name what this table makes.

        Raises:
            InvalidInput: its key is no literal, or another table has it.
        """
        field = table.model_fields.get(self.key)
        tags = () if field is None else get_args(field.annotation)
        if len(tags) != 1:
            raise InvalidInput("table", table.__name__, f"its {self.key} must be one Literal")
        if tags[0] in self._tables:
            raise InvalidInput("table", table.__name__, f"another one has {self.key} '{tags[0]}'")
        self._tables[tags[0]] = table
        return table

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __getitem__(self, tag: str) -> type[Table]:
        """The table that has this literal."""
        return self._tables[tag]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """As an annotation: any one of the tables that are registered by then."""
        tables = tuple(self._tables.values())
        return handler.generate_schema(
            Annotated[Union[tables], Field(discriminator=self.key)]  # noqa: UP007
        )


class Names(Generic[N]):
    """Things of one kind that have names and no tables.

    Args:
        parameter: which names one of them, in messages.
    """

    def __init__(self, parameter: str) -> None:
        self.parameter = parameter
        self._things: dict[str, N] = {}

    def register(self, thing: N) -> N:
        """Let scenario files name it.

        Raises:
            InvalidInput: another one has its name.
        """
        if thing.name in self._things:
            raise InvalidInput(self.parameter, thing.name, "another one has this name")
        self._things[thing.name] = thing
        return thing

    def __getitem__(self, name: str) -> N:
        """The one of this name.

        Raises:
            InvalidInput: there is none.
        """
        if name not in self._things:
            raise InvalidInput(self.parameter, name, nearest(str(name), self._things))
        return self._things[name]

    def __iter__(self) -> Iterator[N]:
        return iter(self._things.values())

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """As an annotation: the name of any that is registered when a file is read."""
        return core_schema.no_info_plain_validator_function(self._known)

    def _known(self, name: Any) -> Any:
        if not isinstance(name, str) or name not in self._things:
            expected = ", ".join(f"'{known}'" for known in self._things)
            raise PydanticKnownError("literal_error", {"expected": expected})
        return name


GAMES, AGENTS, FAULTS, TIMES = Registry(), Registry(), Registry(), Registry()
LAWS = Registry("information")
LOW_LEVEL = Registry("controller")
MODES: Names[Any] = Names("mode")
SCHEDULES: Names[Any] = Names("kind")


@cache
def load_plugins() -> None:
    """Import the modules that other packages name, once.

    Raises:
        PluginError: one of them cannot be imported, or registers what is refused.
    """
    for entry in entry_points(group=PLUGINS):
        try:
            entry.load()
        except Exception as error:
            why = str(error) if isinstance(error, GneError) else raised(error)
            package = "" if entry.dist is None else f" of {entry.dist.name}"
            raise PluginError(
                f"the plug-in '{entry.name}'{package} cannot be loaded: {why}"
            ) from error
