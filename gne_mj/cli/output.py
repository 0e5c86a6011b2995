"""Where commands write: result folders, results, words."""

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from gne_mj.progress import say

if TYPE_CHECKING:
    from gne_mj.trajectory import Trajectory

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


def results_stream() -> TextIO:
    """Where :func:`emit` prints."""
    return _stdout or sys.stdout


class Results:
    """Where a command keeps what it finds: nowhere, or in a folder that appears when it is whole.

    Args:
        out: the folder that was asked for, if any; refused at once if it exists.
        replace: results of `paper` there may be replaced, and only those.

    Attributes:
        out: where the results are, once they are written.
    """

    def __init__(self, out: Path | None, *, replace: bool = False) -> None:
        from gne_mj.errors import InvalidInput
        from gne_mj.files import hidden_folder, storing

        self.out = out
        self._replaced: dict[str, object] | None = None
        if out is None:
            return
        if replace and _is_of_paper(out):
            self._replaced = _entries(out)
        elif os.path.lexists(out):
            raise InvalidInput("out", str(out), "it exists already; name a folder that does not")
        there = next(parent for parent in out.parents if parent.exists())
        with storing("out", out), hidden_folder(there):
            pass  # a place that cannot be written to is refused before anything is computed

    @contextmanager
    def written(self) -> Iterator[Path | None]:
        """The folder to write to, None without one; it gets its name when the block ends.

        If somebody else has made something of that name meanwhile, the results get another one, and
        stderr says which.

        Raises:
            StorageError: the disk is full, or fails; what was there before is as it was.
        """
        from gne_mj.files import appear, hidden_folder, storing

        if self.out is None:
            yield None
            return
        with storing("out", self.out):
            self.out.parent.mkdir(parents=True, exist_ok=True)
        with storing("out", self.out), hidden_folder(self.out.parent) as hidden:
            folder = hidden / self.out.name
            folder.mkdir()
            yield folder
            if self._replaced is not None and _replace(folder, self.out, self._replaced):
                return
            place = appear(folder, self.out)
        if place != self.out:
            say(
                f"gne-mj: warning: {self.out} was made by somebody else meanwhile; these results"
                f" are in {place}"
            )
        self.out = place


def _is_of_paper(out: Path) -> bool:
    """Whether a folder holds what `paper` writes: `run` does not draw."""
    figures = ("robots-velocities", "robots-gaps", "channels-powers", "channels-total-power")
    names = ("trajectory.zarr", *(f"{figure}.png" for figure in figures))
    try:
        report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    ours = isinstance(report, dict) and "systems" in report
    return ours and all((out / name).exists() for name in names)


def _entries(folder: Path) -> dict[str, object]:
    """What tells whether something in a folder was changed or came: by name, which and when."""
    found: dict[str, object] = {}
    for path in folder.iterdir():
        about = path.lstat()
        found[path.name] = (about.st_ino, about.st_mtime_ns, about.st_size)
    return found


def _replace(folder: Path, out: Path, before: dict[str, object]) -> bool:
    """Let all in ``folder`` change places with what has its name in ``out``; the rest there stays.

    At every moment each of them is there, whole: the old one or the new one.

    Returns:
        Whether it was done: not if one of these in ``out`` is not what it was before.
    """
    from gne_mj.files import exchange, locked, rename_new

    if not out.is_dir():
        return False
    with locked(out):
        now, entries = _entries(out), sorted(folder.iterdir())
        if any(now.get(entry.name) != before.get(entry.name) for entry in entries):
            return False
        for entry in entries:
            if (out / entry.name).exists():
                exchange(entry, out / entry.name)
            else:
                rename_new(entry, out / entry.name)
    return True


def folder_for(out: Path | None, own: Path) -> Path:
    """Where figures and tables go: to --out, which is made, or beside what they are of.

    Raises:
        InvalidInput: it is no folder, or cannot be made.
    """
    from gne_mj.files import storing

    if out is None or (out.exists() and out.samefile(own)):
        return own
    with storing("out", out):
        out.mkdir(parents=True, exist_ok=True)
    return out


def tell(trajectory: "Trajectory", as_json: bool, out: Path | None) -> None:
    """Print a run's summary and where it is kept, or its report as JSON."""
    if as_json:
        emit(json.dumps(trajectory.report(), indent=2))
        return
    print(f"\n{trajectory}")
    for name, report in trajectory.reports.items():
        _warn(name, report)
    if out is not None:
        print(f"\ntrajectory  {out / 'trajectory.zarr'}\nreport      {out / 'report.json'}")


def _warn(name: str, report: dict[str, Any]) -> None:
    saturated = report["actuators"]["saturated"]
    if saturated is not None:
        say(
            f"gne-mj: warning: systems.{name}: the law asked agent {saturated['agent']} for"
            f" {saturated['demand']:.4g} at {saturated['time']:.4g} s, beyond its input limit"
            f" {saturated['limit']:g}; from then on nothing is guaranteed"
        )
