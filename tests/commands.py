"""The product's commands, each as a process of its own or called in this one."""

import os
import pty
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from io import StringIO
from pathlib import Path

import pytest

from gne_mj.cli import main

COMMAND = Path(sys.executable).with_name("gne-mj")


def environment():
    """A user's, who has no display."""
    return {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}


@contextmanager
def hearing_hangups():
    """Processes started here end at SIGHUP, also where the tests run under nohup and ignore it.

    A signal that is ignored stays so in a new process, one with a handler is its default there. A
    preexec_fn would do the same, but forks, of which JAX warns once a test has imported it.
    """
    before = signal.signal(signal.SIGHUP, lambda *_: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGHUP, before)


def gne(*arguments):
    """The installed command. Its start takes a second: for what only a process can show."""
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        env=environment(), capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip


@contextmanager
def running(*arguments, until):
    """The installed command on a terminal of its own, once that shows a text; it is killed at last.

    Hands out the process, whose standard output is a pipe.
    """
    master, terminal = pty.openpty()
    with hearing_hangups():
        process = subprocess.Popen(
            [COMMAND, *map(str, arguments)], stdout=subprocess.PIPE, stderr=terminal, text=True,
            env={**environment(), "TERM": "xterm", "COLUMNS": "200"}, start_new_session=True,
        )  # fmt: skip
    os.close(terminal)
    shown, ready = bytearray(), threading.Event()

    def read():  # on and on, or the terminal is full and the command waits
        with suppress(OSError):
            while piece := os.read(master, 4096):
                shown.extend(piece)
                if until.encode() in shown:
                    ready.set()

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        assert ready.wait(120), shown.decode()
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        os.close(master)


def gne_here(*arguments):
    """The same command's exit status and output, without a process; a warning is an error here."""
    command = ["gne-mj", *map(str, arguments)]
    stdout, stderr = StringIO(), StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(stdout), redirect_stderr(stderr):
        patch.setattr("sys.argv", command)
        with pytest.raises(SystemExit) as ended:
            main()
    code = ended.value.code or 0
    return subprocess.CompletedProcess(command, code, stdout.getvalue(), stderr.getvalue())
