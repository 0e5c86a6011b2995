"""Ctrl-C ends a command: the first one a function that never returns, the second one anything.

Python tells its main thread of a signal when that runs Python code again, which it never does
while a user's kernel does not return, or while it waits for a thread. The watch here is a thread of
its own that the C side tells at once (``signal.set_wakeup_fd``).
"""

import ctypes
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NamedTuple

from gne_mj.cli.signals import ENDING
from gne_mj.errors import USER_MODULES, UserCodeError

# s after Ctrl-C: between looks; how long one call of a user's function, or of native code, may
# still take (a tenth of that is much); and until what was asked to end is ended
POLL, OF_USER, NATIVE, GRACE = 0.25, 3.0, 20.0, 3.0


class _Call(NamedTuple):
    """What a thread is in: the same as long as it is in the same call."""

    frame: FrameType
    instruction: int  # of native code's caller
    allowed: float  # s


@contextmanager
def watched() -> Iterator[None]:
    """Let Ctrl-C end what is in this context; of the main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    watch = threading.Thread(target=_watch, args=(reader,), name="gne-mj Ctrl-C", daemon=True)
    watch.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(writer)  # which ends the watch
        watch.join()
        os.close(reader)


def _watch(reader: int) -> None:
    asked, sent, second = 0, 0, 0.0  # signals that came, that were sent from here
    since: dict[int, tuple[_Call, float, bool]] = {}  # of each thread; whether it was told to end
    while True:
        if select.select([reader], [], [], POLL if asked else None)[0]:
            told = os.read(reader, 64)
            if not told:
                return
            asked += sum(number in ENDING for number in told)
        now = time.monotonic()
        if asked - sent > 1:
            second = second or now
            if now > second + GRACE:
                _end("interrupted: nothing more is kept", 128 + signal.SIGINT)
        calls = _calls() if asked else {}
        for thread, call in calls.items():
            last, began, ending = since.get(thread, (None, now, False))
            if call != last:
                began, ending = now, False
            if now > began + call.allowed + GRACE:
                _end(_words(call), 1)
            if now > began + call.allowed and not ending:
                ending = True
                sent += _interrupt(thread)
            since[thread] = call, began, ending
        since = {thread: known for thread, known in since.items() if thread in calls}


def _calls() -> dict[int, _Call]:
    """Which threads are in a user's function, or in native code that this package called."""
    found: dict[int, _Call] = {}
    for thread, innermost in sys._current_frames().items():
        if thread == threading.get_ident():
            continue
        if _module(innermost).startswith("gne_mj."):
            found[thread] = _Call(innermost, innermost.f_lasti, NATIVE)
        frame: FrameType | None = innermost
        while frame is not None:
            if _module(frame).startswith(USER_MODULES):
                found[thread] = _Call(frame, 0, OF_USER)
            frame = frame.f_back
    return found


def _module(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__"))


def _interrupt(thread: int) -> int:
    """Raise Ctrl-C's exception in a thread, when it next runs Python code; returns signals sent."""
    if thread == threading.main_thread().ident:
        signal.pthread_kill(thread, signal.SIGINT)  # which ends a sleep too
        return 1
    error = ctypes.py_object(KeyboardInterrupt)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), error)
    return 0


def _words(call: _Call) -> str:
    if not _module(call.frame).startswith(USER_MODULES):
        return "interrupted: native code, as of a kernel of one's own, did not return"
    return f"{UserCodeError.status}: {UserCodeError(call.frame.f_code, 'it did not return')}"


def _end(words: str, code: int) -> None:
    """End the process whatever its threads do."""
    os.write(2, f"gne-mj: {words}\n".encode())
    os._exit(code)
