"""Commands from shell to end, warm, beside a Python that only imports what they are made with."""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from turns import in_turns, row

COMMANDS = (
    ("run velocity-sync", "numba, mujoco", "< 1.0 s"),
    ("solve osnr", "numba", "< 0.8 s"),
    ("certify paper", "numba, mujoco", "< 1.2 s"),
)


def rows(turns: int = 20) -> list[dict[str, str]]:
    """Medians over ``turns`` turns in s."""
    kinds = {f"import {names}": _time(sys.executable, "-c", f"import {names}")
             for _, names, _ in COMMANDS}  # fmt: skip
    gne = str(Path(sys.executable).with_name("gne-mj"))
    kinds |= {command: _time(gne, *command.split()) for command, _, _ in COMMANDS}
    times = in_turns(kinds, turns)
    return [
        row(
            f"`gne-mj {command}` from shell to end: s; ours / a Python that imports {names}",
            times, command, f"import {names}", target,
        )
        for command, names, target in COMMANDS
    ]  # fmt: skip


def _time(*command: str) -> Callable[[], float]:
    def measure() -> float:
        began = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - began

    return measure


if __name__ == "__main__":
    for line in rows():
        print(*line.values(), sep="  ")
