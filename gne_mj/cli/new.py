"""The command that writes a starting point of one's own."""

import re
from pathlib import Path
from typing import Annotated

import typer

from gne_mj.cli.application import app
from gne_mj.cli.templates import TEMPLATES


@app.command()
def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="game, law, robot or scenario.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the files, without an ending.")],
) -> None:
    """Write a commented starting point of a game, law, robot or scenario, which runs as it is.

    Files go to the current folder; none that exists is replaced.
    """
    from gne_mj.errors import InvalidInput, nearest
    from gne_mj.files import refuse_existing, written

    if kind not in TEMPLATES:
        raise InvalidInput("kind", kind, nearest(kind, TEMPLATES))
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name):
        raise InvalidInput(
            "name", name, "it must begin with a letter and have letters, digits, '-' and '_' only"
        )
    texts = {Path(f"{name}{end}"): text for end, text in TEMPLATES[kind].items()}
    refuse_existing("name", list(texts))
    for path, text in texts.items():
        with written("name", path, replace=False) as file:
            file.write_text(text.replace("NAME", name), encoding="utf-8")
        print(path)
    print(f"\ngne-mj check {path}\ngne-mj run {path}")
