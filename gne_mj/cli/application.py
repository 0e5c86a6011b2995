"""The application, its errors and its entry point."""

import json
import sys
from typing import Annotated, Any, NoReturn

import typer

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

    The exit status is 2, but 1 where a function of the user's own fails or the disk is full.
    """
    try:
        sys.exit(app(prog_name="gne-mj", standalone_mode=False) or 0)
    except BrokenPipeError:
        sys.exit(1)
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except MemoryError:
        _fail("there is not enough memory for this", code=1)
    except Exception as error:
        from gne_mj.errors import GneError, StorageError, UserCodeError

        if type(error).__module__.startswith("numba"):
            from gne_mj.user_files import compiler_complaint

            if (complaint := compiler_complaint(error)) is not None:
                _fail(complaint, UserCodeError.status, 1)
        if hasattr(error, "format_message"):  # typer's, about the command line
            _misused(error)
        if not isinstance(error, GneError):
            raise
        code = 1 if isinstance(error, UserCodeError | StorageError) else 2
        _fail(str(error), getattr(error, "status", None), code)


def _misused(error: Any) -> NoReturn:
    """Tell of a command line that cannot be; show the help where there was nothing on it."""
    context = getattr(error, "ctx", None)
    if len(sys.argv) == 1 and context is not None:
        print(context.get_help(), file=sys.stderr)
        sys.exit(2)
    path = context.command_path if context is not None else "gne-mj"
    _fail(f"{error.format_message().rstrip('.')}; see `{path} --help`")


def _fail(message: str, status: str | None = None, code: int = 2) -> NoReturn:
    from gne_mj.errors import one_line

    message = one_line(message)
    if "--json" in sys.argv:
        print(json.dumps({"status": status or "invalid_input", "message": message}))
    print(f"gne-mj: {status + ': ' if status else ''}{message}", file=sys.stderr)
    sys.exit(code)
