"""The product's commands, each as a process of its own or called in this one."""

import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from gne_mj.cli import main

COMMAND = Path(sys.executable).with_name("gne-mj")


def environment():
    """A user's, who has no display."""
    return {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}


def gne(*arguments):
    """The installed command. Its start takes a second: for what only a process can show."""
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        env=environment(), capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip


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
