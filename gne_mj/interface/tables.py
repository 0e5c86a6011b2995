"""How objects are made: what a function is called with becomes a scenario's table."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from pydantic import ValidationError

from gne_mj.scenario import complaint, plain
from gne_mj.toml_table import Table

T = TypeVar("T", bound=Table)


def made(table: type[T], /, **given: Any) -> T:
    """The table with these values; those that are None are left out.

    Args:
        table: its class.
        **given: its keys; objects and arrays may stand for tables and lists.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    values = {name: plain(value) for name, value in given.items() if value is not None}
    with in_one_sentence():
        return table.model_validate(values)


@contextmanager
def in_one_sentence() -> Iterator[None]:
    """Tell what is wrong with a table as all else is told.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    try:
        yield
    except ValidationError as error:
        raise complaint(error) from None
