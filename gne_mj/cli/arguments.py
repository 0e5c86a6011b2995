"""Arguments and options that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

T = TypeVar("T")

# An error that names one of a command's parameters is told with its option, or its argument's name:
# they are called as in the functions that a command calls.
SCENARIO = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO", help="Name of a shipped scenario (see `scenarios`), or a .toml file."
    ),
]


SET = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value; may be repeated."),
]


OUT = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder to write; must not exist.")
]


SYSTEM = Annotated[
    str | None, typer.Option("--system", metavar="NAME", help="Which; needed if there are several.")
]
WHERE = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Where to; beside what is read if left out."),
]
FORMAT = Annotated[
    list[str] | None, typer.Option("--format", help="png, pdf or svg; may be repeated.")
]
REPLACE = Annotated[
    bool, typer.Option("--replace", help="Files that exist may be replaced by those of a new one.")
]
INDEX = Annotated[int | None, typer.Option("--index", help="Number of the batch's run, from 0.")]
PORT = Annotated[
    int | None,
    typer.Option(
        "--port", min=1, max=65535, help="Of the page, on 127.0.0.1; if left out any free one."
    ),
]
JSON = Annotated[bool, typer.Option("--json", help="Print the report as JSON and nothing else.")]


def settings(changes: list[str] | None) -> dict[str, Any]:
    """What --set asks for: dotted keys to values."""
    from gne_mj.errors import InvalidInput
    from gne_mj.scenario import parse_value

    found: dict[str, Any] = {}
    for change in changes or []:
        key, equals, value = change.partition("=")
        if not (key and equals):
            raise InvalidInput("set_", change, "it must read KEY=VALUE")
        found[key.strip()] = parse_value(value.strip())
    return found


def meaning(option: str, parse: Callable[[str], T], text: str) -> T:
    """What the text of an option says; what is wrong with it is told of the option."""
    from gne_mj.errors import renaming

    with renaming(lambda _: option):
        return parse(text)


def formats(given: list[str] | None) -> tuple[str, ...]:
    """What --format asks for; png if it is left out."""
    from gne_mj.errors import InvalidInput
    from gne_mj.plots import FORMATS

    for name in given or []:
        if name not in FORMATS:
            raise InvalidInput("format_", name, f"choose from {', '.join(FORMATS)}")
    return tuple(given or ("png",))
