"""The application, its errors and its entry point."""

import atexit
import gc
import json
import os
import re
import sys
import warnings
from contextlib import nullcontext
from io import TextIOWrapper
from typing import Annotated, Any, NoReturn

import typer

from gne_mj.cli.ending import watched
from gne_mj.cli.output import emit, results_only, results_stream
from gne_mj.cli.signals import came, received, unwinding
from gne_mj.progress import give_up, say


class Interrupted(Exception):
    """A signal ended the command; typer would take KeyboardInterrupt for an exit status."""


class _Commands(typer.core.TyperGroup):
    def make_context(self, *arguments: Any, **options: Any) -> Any:
        try:
            return super().make_context(*arguments, **options)
        except KeyboardInterrupt as error:
            raise Interrupted from error

    def invoke(self, ctx: Any) -> Any:
        from gne_mj.errors import Refusal

        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            raise Interrupted from error
        except Refusal as error:
            _name_flags(error, self.commands[ctx.invoked_subcommand].params)
            raise


def _name_flags(error: Any, parameters: list[Any]) -> None:
    """Let an error name the option or argument of a command in place of its function's parameter.

    What is expected may name some too, in backquotes.
    """
    flags = {
        each.name: next((opt for opt in each.opts if opt.startswith("-")), None)
        or (each.metavar or each.name).upper()
        for each in parameters
    }

    def flag(found: re.Match[str]) -> str:
        return flags.get(found[1], found[0])

    error.rename(re.sub(r"^(\w+)", flag, error.key), re.sub(r"`(\w+)`", flag, error.about))


# Objects made, beyond those gone, between looks for garbage. What a command makes at its start
# stays: at Python's own 700 looking through it took a tenth of a short command.
_BETWEEN_LOOKS = 50_000

app = typer.Typer(
    cls=_Commands,
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

    The exit status is 2, but 1 where a function of the user's own fails, the disk is full, what is
    printed cannot be written or a cluster is lost. With --json nothing but the report is printed to
    stdout, whatever a user's functions print.
    """
    # before NumPy is loaded: matrices here are small, and threads that wait for each other take
    # longer than the work (a certificate of ten channels three times as long)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(_BETWEEN_LOOKS)
    atexit.register(gc.freeze)  # what is left at the end goes with the process
    # Nothing here needs a display, so that no setting for one may be in the way.
    os.environ.update(MUJOCO_GL="disabled", MPLBACKEND="agg")
    for stream in (sys.stdout, sys.stderr):  # whatever a terminal cannot show, and file names
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    # Of what leaves the floats our own checks tell, in sentences
    warnings.filterwarnings("ignore", category=RuntimeWarning, module=r"gne_mj\.")
    try:
        with (
            unwinding(),
            watched(),
            results_only() if "--json" in sys.argv else nullcontext(),
        ):
            _main()
    except KeyboardInterrupt:
        _interrupted()


def _main() -> None:
    try:
        try:
            sys.exit(app(prog_name="gne-mj", standalone_mode=False) or 0)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except BrokenPipeError:
        give_up(results_stream())
        sys.exit(1)
    except OSError as error:
        if error.filename:
            _fail(f"{error.filename}: {error.strerror}")
        give_up(results_stream())
        _fail(f"standard output: {error.strerror or error}", "not_stored", 1)
    except MemoryError:
        _fail("there is not enough memory for this", code=1)
    except (SystemExit, Interrupted) as ended:  # a command's own, unless a user's function's
        from gne_mj.errors import fault_of_user

        if (fault := fault_of_user(ended)) is not None:
            _fail(str(fault), fault.status, 1)
        if isinstance(ended, SystemExit):
            raise
        _interrupted()
    except BaseException as error:
        from gne_mj.errors import (
            ClusterError,
            GneError,
            StorageError,
            UserCodeError,
            fault_of_user,
        )

        if type(error).__module__.startswith("numba"):
            from gne_mj.user_files import compiler_complaint

            if (complaint := compiler_complaint(error)) is not None:
                _fail(complaint, UserCodeError.status, 1)
        if hasattr(error, "format_message"):  # typer's, about the command line
            _misused(error)
        if not isinstance(error, GneError):
            if (fault := fault_of_user(error)) is None:
                if came():  # in an import, say, which made another exception of it
                    _interrupted()
                raise
            _fail(str(fault), fault.status, 1)
        code = 1 if isinstance(error, UserCodeError | StorageError | ClusterError) else 2
        _fail(str(error), getattr(error, "status", None), code)


def _interrupted() -> NoReturn:
    say("gne-mj: interrupted")
    sys.exit(128 + received())


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
        try:
            emit(json.dumps({"status": status or "invalid_input", "message": message}))
        except OSError:
            give_up(results_stream())
    say(f"gne-mj: {status + ': ' if status else ''}{message}")
    sys.exit(code)
