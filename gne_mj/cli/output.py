"""Where commands write: result folders, progress, words."""

import json
import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from gne_mj.trajectory import Trajectory


PREPARING = "preparing (a first run compiles for a few seconds)"
MINUTE = 60.0  # s between lines of progress where nobody watches

_stdout: TextIO | None = None  # of results, where all else that is printed goes to stderr


@contextmanager
def results_only() -> Iterator[None]:
    """Keep stdout for what :func:`emit` prints.

    What else is printed goes to stderr: by a user's functions, and by libraries that these call.
    """
    global _stdout
    own, _stdout = sys.__stdout__, sys.stdout
    try:
        with redirect_stdout(sys.stderr):
            if own is None or own is not _stdout or sys.stderr is None:  # not the process's own
                yield
                return
            kept = os.dup(own.fileno())
            os.dup2(sys.stderr.fileno(), own.fileno())
            _stdout = open(kept, "w", encoding=own.encoding, errors=own.errors)  # noqa: SIM115
            try:
                yield
            finally:
                os.dup2(kept, own.fileno())
                with suppress(OSError):  # it was told when it was printed
                    _stdout.close()
    finally:
        _stdout = None


def emit(text: str) -> None:
    """Print a result."""
    print(text, file=_stdout, flush=True)


@contextmanager
def results(out: Path | None, replace: bool) -> Iterator[Path | None]:
    """A folder that becomes ``out`` when all is written, and vanishes if something fails.

    `paper` may replace results of its own, and only those.
    """
    import tempfile

    from gne_mj.errors import InvalidInput

    if out is None:
        yield None
        return
    if out.exists() and not (replace and _is_of_paper(out)):
        raise InvalidInput("--out", str(out), "it exists already; name a folder that does not")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    except OSError as error:
        raise InvalidInput("--out", str(out), f"it cannot be written: {error.strerror}") from None
    try:
        yield folder
        folder.chmod(0o755)
        if out.exists():
            _replace(folder, out)
        else:
            folder.rename(out)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _is_of_paper(out: Path) -> bool:
    """Whether a folder holds what `paper` writes: `run` does not draw."""
    figures = ("robots-velocities", "robots-gaps", "channels-powers", "channels-total-power")
    names = ("report.json", "trajectory.zarr", *(f"{figure}.png" for figure in figures))
    return all((out / name).exists() for name in names)


def _replace(folder: Path, out: Path) -> None:
    """Move all in ``folder`` into ``out``; what has the same names there goes last of all."""
    import tempfile

    aside = Path(tempfile.mkdtemp(prefix=f".{out.name}-old-", dir=out.parent))
    for entry in sorted(folder.iterdir()):
        if (out / entry.name).exists():
            (out / entry.name).rename(aside / entry.name)
        entry.rename(out / entry.name)
    folder.rmdir()
    shutil.rmtree(aside)


def on_terminal(quiet: bool) -> bool:
    """Whether somebody watches, and wants to."""
    return not quiet and sys.stderr.isatty()


@contextmanager
def by_the_minute(quiet: bool, words: str) -> Iterator[Callable[[str], None] | None]:
    """A line on stderr every minute meanwhile, for logs; what is handed out changes its words."""
    if quiet:
        yield None
        return
    ended = threading.Event()

    def tell() -> None:
        minutes = 0
        while not ended.wait(MINUTE):
            minutes += 1
            print(f"gne-mj: {minutes} min: {words}", file=sys.stderr, flush=True)

    def change(to: str) -> None:
        nonlocal words
        words = to

    thread = threading.Thread(target=tell, name="gne-mj progress", daemon=True)
    thread.start()
    try:
        yield change
    finally:
        ended.set()
        thread.join()


@contextmanager
def working(quiet: bool, what: str) -> Iterator[Any]:
    """A word on a terminal's stderr meanwhile, else every minute; what is handed out changes it."""
    if not on_terminal(quiet):
        with by_the_minute(quiet, what) as change:
            yield change
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield status.update


@contextmanager
def progress(total: float, quiet: bool, unit: str = "s") -> Iterator[Any]:
    """A progress bar on a terminal's stderr, else a line every minute."""
    if not on_terminal(quiet):
        with by_the_minute(quiet, f"0 of {total:g} {unit}") as change:
            yield change and (lambda now: change(f"{now:.6g} of {total:g} {unit}"))
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn(
            f"{{task.completed:{'.1f' if unit == 's' else '.0f'}}} of {{task.total:g}} {unit}"
        ),
        BarColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task("run", total=total)
        yield lambda now: bar.update(task, completed=now)


def tell(trajectory: "Trajectory", as_json: bool, out: Path | None) -> None:
    """Print a run's summary and where it is kept, or its report as JSON."""
    from gne_mj.summary import summary

    if as_json:
        emit(json.dumps(trajectory.report(), indent=2))
        return
    for name, report in trajectory.reports.items():
        print(f"\n{name}")
        for key, value in summary(report).items():
            print(f"  {key:20} {value}")
        _warn(name, report)
    if trajectory.interventions:
        print("\nwhile it ran")
        for done in trajectory.interventions:
            when = f"at {done['time']:.4g} s"
            print(f"  {when:20} {done['what']}")
    if out is not None:
        print(f"\ntrajectory  {out / 'trajectory.zarr'}\nreport      {out / 'report.json'}")


def _warn(name: str, report: dict[str, Any]) -> None:
    saturated = report["actuators"]["saturated"]
    if saturated is not None:
        print(
            f"gne-mj: warning: systems.{name}: the law asked agent {saturated['agent']} for"
            f" {saturated['demand']:.4g} at {saturated['time']:.4g} s, beyond its input limit"
            f" {saturated['limit']:g}; from then on nothing is guaranteed",
            file=sys.stderr,
        )
