"""Signals that ask a command to end: Ctrl-C, a scheduler (SIGTERM), a closed terminal."""

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

_OTHERS = (signal.SIGTERM, signal.SIGHUP)  # than Ctrl-C, for which Python has an exception already
ENDING = (signal.SIGINT, *_OTHERS)
_received = int(signal.SIGINT)
_SOON = 0.05  # s


def raise_on_signals() -> None:
    """Let SIGTERM and SIGHUP unwind as Ctrl-C does, so that nothing half-written stays.

    What is ignored stays so, as SIGHUP under nohup. A signal that comes while Python finalises an
    object comes again soon after, since what is raised there is only printed.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    sys.unraisablehook = _unraisable
    for number in _OTHERS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _end)


def _unraisable(unraisable: Any) -> None:
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        threading.Timer(_SOON, _thread.interrupt_main).start()
    else:
        sys.__unraisablehook__(unraisable)


def received() -> int:
    """Number of the signal that ended the command."""
    return _received


def _end(number: int, frame: FrameType | None) -> NoReturn:
    global _received
    _received = number
    raise KeyboardInterrupt


@contextmanager
def stopping() -> Iterator[threading.Event]:
    """An event that the first of these signals sets; a second one ends the command at once.

    Nobody may wait for the event: the signal could come while its lock is held.
    """
    from gne_mj.simulation import interruption

    heard = [number for number in _OTHERS if signal.getsignal(number) is not signal.SIG_IGN]
    with interruption(signal.SIGINT, *heard) as stop:
        yield stop
