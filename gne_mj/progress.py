"""How long something takes and how far it is, told on stderr.

Whoever does the work calls a function (``Tell``) now and then, with how much is done, how much
there is, and a few words. The first call, before anything is done, says what is ahead. The time
that is left is estimated from the pieces behind the first one, which may have compiled something.
If it is long it is told as soon as it is known; then a terminal has one line that is rewritten, and
a log a line every minute.
"""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO, cast

if TYPE_CHECKING:
    from rich.console import Console

# (done, of how much, in words): both in any unit in which pieces cost alike; may grow meanwhile
Tell = Callable[[float, float, str], None]

PREPARING = "preparing (a first run compiles for a few seconds)"
# s between lines where nobody watches; that pieces must have taken together for an estimate; below
# which nobody needs one
MINUTE, MEASURED, LONG = 60.0, 1.0, 10.0


def nothing(done: float, total: float, words: str) -> None:
    """A ``Tell`` for work of which nobody wants to hear."""


def of_time(tell: Tell, duration: float) -> Callable[[float], None]:
    """What a simulation calls with its time in s, of one that lasts so long."""
    tell(0.0, duration, f"a run of {duration:g} s")
    return lambda now: tell(now, duration, f"{now:.6g} of {duration:g} s")


@contextmanager
def telling(words: str, *, quiet: bool = False) -> Iterator[Tell]:
    """Tell on stderr how far the work in this context is.

    Args:
        words: until the work calls; of work that never does there is no estimate.
        quiet: tell nothing unless stderr is a terminal.
    """
    pace = _Pace(words)
    with _rewritten(pace) if on_terminal() else _in_lines(pace, quiet) as told:

        def tell(done: float, total: float, words: str) -> None:
            pace.note(done, total, words)
            left = pace.left()
            if not (pace.told or left is None) and left >= LONG:
                pace.told = True
                told(f"gne-mj: about {_rounded(left)}: {pace.ahead}")

        yield tell


@contextmanager
def if_asked(progress: object) -> Iterator[Tell]:
    """Tell how far the work in this context is if ``progress`` is True, as programs ask for it."""
    if progress is not True:
        yield nothing
        return
    with telling(PREPARING) as tell:
        yield tell


class _Pace:
    """What has been done since when, and how long the rest takes at that pace.

    Attributes:
        ahead: what the work is, in words.
        words: how far it is.
        told: whether the estimate has been told.
    """

    def __init__(self, words: str) -> None:
        self.ahead = self.words = words
        self.told = False
        self.done, self.total = 0.0, 0.0
        self._begun: float | None = None  # what was done before
        self._first: tuple[float, float] | None = None  # when the first piece was, and what then
        self._now = 0.0

    def note(self, done: float, total: float, words: str) -> None:
        """So much is done now."""
        now = monotonic()
        if self._begun is None:
            self._begun, self.ahead = done, words
        elif self._first is None and done > self._begun:
            self._first = now, done
        self._now, self.done, self.total, self.words = now, done, total, words

    def left(self) -> float | None:
        """Seconds; None while too little was done to say, and where the pace does not hold."""
        if self._first is None:
            return None
        since, before = self._first
        passed = self._now - since
        if passed < MEASURED or self.done <= before:
            return None
        rest = (self.total - self.done) * passed / (self.done - before)
        rest -= monotonic() - self._now
        return rest if rest > 0.0 else None

    def line(self) -> str:
        """How far it is."""
        left = self.left()
        return self.words if left is None else f"{self.words}, about {_rounded(left)} left"


def _rounded(seconds: float) -> str:
    """As exactly as it is known: s below a minute and a half, min below as many hours."""
    if seconds < 90.0:
        size = 1 if seconds < 10.0 else 5
        return f"{size * round(seconds / size)} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < 90.0 else f"{minutes / 60.0:.1f} h"


@contextmanager
def _in_lines(pace: _Pace, quiet: bool) -> Iterator[Callable[[str], None]]:
    """A line every minute meanwhile, for logs; hands out what says another."""
    if quiet:
        yield lambda line: None
        return
    ended = threading.Event()

    def every_minute() -> None:
        minutes = 0
        while not ended.wait(MINUTE):
            minutes += 1
            say(f"gne-mj: {minutes} min: {pace.line()}")

    thread = threading.Thread(target=every_minute, name="gne-mj progress", daemon=True)
    thread.start()
    try:
        yield say
    finally:
        ended.set()
        thread.join()


@contextmanager
def _rewritten(pace: _Pace) -> Iterator[Callable[[str], None]]:
    """A bar and words on one line of a terminal, gone at the end; hands out what says another."""
    from rich.progress import BarColumn, Progress, ProgressColumn, Task
    from rich.text import Text

    class Words(ProgressColumn):
        def render(self, task: Task) -> Text:
            bar.update(task.id, completed=pace.done, total=pace.total or None)
            return Text(pace.line())

    with Progress(Words(), BarColumn(), console=console(), transient=True) as bar:
        bar.add_task("", total=None)
        yield lambda line: bar.console.print(line, markup=False, highlight=False)


def on_terminal() -> bool:
    """Whether somebody watches."""
    return sys.stderr is not None and sys.stderr.isatty()


def say(line: str) -> None:
    """A line on stderr, if that is open: what is told there must not end a command."""
    if sys.stderr is not None:
        try:
            print(line, file=sys.stderr, flush=True)
        except OSError:
            give_up(sys.stderr)


def give_up(stream: TextIO) -> None:
    """Let what a stream still holds go nowhere, or Python complains of it at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    with suppress(OSError, ValueError):  # it is no file of the system's own
        os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


class _Terminal:
    """stderr, which may be closed while something is shown there: that must not end a run."""

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stderr, name)

    def write(self, text: str) -> int:
        with suppress(OSError):
            return sys.stderr.write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(OSError):
            sys.stderr.flush()


def console() -> "Console":
    """Rich's, on stderr."""
    from rich.console import Console

    return Console(file=cast(TextIO, _Terminal()))
