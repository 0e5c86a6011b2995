"""Signals that ask a command to end: Ctrl-C, a scheduler (SIGTERM), a closed terminal."""

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

_OTHERS = (signal.SIGTERM, signal.SIGHUP)  # than Ctrl-C, for which Python has an exception already
ENDING = (signal.SIGINT, *_OTHERS)
_received, _came = int(signal.SIGINT), False
_SOON = 0.05  # s until a signal comes again that Python has swallowed


@contextmanager
def unwinding() -> Iterator[None]:
    """Let SIGTERM and SIGHUP unwind as Ctrl-C does, so that nothing half-written stays.

    What is ignored stays so, as SIGHUP under nohup. A signal that comes while Python finalises an
    object comes again soon after, since what is raised there is only printed.
    """
    global _came
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _came, others = False, sys.unraisablehook
    before = {number: signal.getsignal(number) for number in ENDING}
    for number, handler in before.items():
        if handler in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _end)

    def unraisable(what: Any) -> None:
        if isinstance(what.exc_value, KeyboardInterrupt):
            with suppress(RuntimeError):  # Python is ending anyway
                threading.Timer(_SOON, _thread.interrupt_main, (_received,)).start()
        else:
            others(what)

    sys.unraisablehook = unraisable
    try:
        yield
    finally:
        sys.unraisablehook = others
        for number, handler in before.items():
            signal.signal(number, handler)


def received() -> int:
    """Number of the signal that ended the command."""
    return _received


def came() -> bool:
    """Whether one has come since :func:`unwinding` began that unwound, or tried to."""
    return _came


def _end(number: int, frame: FrameType | None) -> NoReturn:
    global _received, _came
    _received, _came = number, True
    raise KeyboardInterrupt


@contextmanager
def stopping() -> Iterator[threading.Event]:
    """An event that the first of these signals sets; a second one ends the command at once.

    Nobody may wait for the event: the signal could come while its lock is held.
    """
    from gne_mj.interruption import interruption

    heard = [number for number in _OTHERS if signal.getsignal(number) is not signal.SIG_IGN]
    with interruption(signal.SIGINT, *heard) as stop:
        yield stop
