"""How a signal ends what runs: between two of its pieces, so that it keeps what it has."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_asked: threading.Event | None = None  # the event of the interruption that is going on


@contextmanager
def interruption(*signals: int) -> Iterator[threading.Event]:
    """An event that a signal sets, so that a run ends between chunks and keeps what it has.

    A second signal acts as usual. Within another interruption it is that one's event. Outside the
    main thread signals are left alone. Ask the event, but do not wait for it: a signal that comes
    while its lock is held would wait for ever.

    Args:
        signals: which; Ctrl-C (SIGINT) if there are none.
    """
    global _asked
    if threading.current_thread() is not threading.main_thread():
        yield threading.Event()
        return
    if _asked is not None:
        yield _asked
        return
    event = _asked = threading.Event()
    before = {number: signal.getsignal(number) for number in signals or (signal.SIGINT,)}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def stop(number: int, frame: object) -> None:
        restore()  # first, so that nothing interrupts the setting but what ends all
        event.set()

    try:
        for number in before:
            signal.signal(number, stop)
        yield event
    finally:
        restore()
        _asked = None
