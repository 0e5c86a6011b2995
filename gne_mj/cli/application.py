"""The application, its errors and its entry point."""

import json
import sys
from typing import Annotated

import typer

from gne_mj.cli.output import give_up, say
from gne_mj.cli.signals import raise_on_signals

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Robots that seek a generalized Nash equilibrium and never leave their constraint set.",
)


def _version(value: bool) -> None:
    if value:
        from gne_mj import __version__

        print(f"gne-mj {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: an error meant for the user is one sentence on stderr.

    The exit status is 2, but 1 where a function of the user's own fails, the disk is full, or what
    is printed cannot be written.
    """
    raise_on_signals()
    try:
        try:
            app()
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except BrokenPipeError:
        give_up(sys.stdout)
        sys.exit(1)
    except OSError as error:
        if error.filename:
            _fail(f"{error.filename}: {error.strerror}")
        give_up(sys.stdout)
        _fail(f"standard output: {error.strerror or error}", "not_stored", 1)
    except Exception as error:
        from gne_mj.errors import GneError, StorageError, UserCodeError

        if type(error).__module__.startswith("numba"):
            from gne_mj.user_files import compiler_complaint

            if (complaint := compiler_complaint(error)) is not None:
                _fail(complaint, UserCodeError.status, 1)
        if not isinstance(error, GneError):
            raise
        code = 1 if isinstance(error, UserCodeError | StorageError) else 2
        _fail(str(error), getattr(error, "status", None), code)


def _fail(message: str, status: str | None = None, code: int = 2) -> None:
    if "--json" in sys.argv:
        try:
            document = {"status": status or "invalid_input", "message": message}
            print(json.dumps(document), flush=True)
        except OSError:
            give_up(sys.stdout)
    say(f"gne-mj: {status + ': ' if status else ''}{message}")
    sys.exit(code)
