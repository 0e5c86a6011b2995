"""What scenario files can name: games, agent types, laws and faults, each by its table.

A table registers beside the thing that it makes:

    @GAMES.register
    class CournotTable(GameTable):
        type: Literal["cournot"]
        ...

Other packages register theirs in modules that they name as entry points of the group
``gne_mj.plugins``; :func:`load_plugins` imports these before scenarios are read.
"""

from collections.abc import Iterator
from functools import cache
from importlib.metadata import entry_points
from typing import Annotated, Any, TypeVar, Union, get_args

from pydantic import Field

from gne_mj.errors import GneError, InvalidInput, PluginError, raised
from gne_mj.toml_table import Table

T = TypeVar("T", bound=Table)
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

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """As an annotation: any one of the tables that are registered by then."""
        tables = tuple(self._tables.values())
        return handler.generate_schema(
            Annotated[Union[tables], Field(discriminator=self.key)]  # noqa: UP007
        )


GAMES, AGENTS, FAULTS = Registry(), Registry(), Registry()
LAWS = Registry("information")


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
