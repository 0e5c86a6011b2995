"""What is too much, said before anything is allocated or begun.

The bounds are far beyond what is of use, and below what fills a machine's memory or never ends.
"""

import os
import re
import stat
from pathlib import Path
from typing import Any

from gne_mj.errors import InvalidInput

# Times in s; multiples of the timestep that floats count exactly
SHORTEST, LONGEST, MOST_STEPS = 1e-12, 1e12, 2**53
MOST_HELD = 500_000  # timesteps in a control period that is looked ahead over
MOST_POINTS, MOST_RUNS = 10_000, 10_000_000  # of a range, and of what runs again and again
# What a run keeps until its end, and what it is set up with, in bytes
MOST_RECORDED, MOST_SET_UP = 2**30, 2**30
MOST_SYSTEMS, MOST_AGENTS = 100, 20_000
MOST_ACTIONS = 50_000  # entries of a profile, and constraints
MOST_MEMBERS = 10_000_000  # agents in all costs and constraints together
MOST_COUPLED = 2000  # agents whose costs all depend on all
MOST_EXAMINED = 5000  # actions of a system for whose guarantees matrices are made
MOST_EDGES = 500_000  # of a graph
MOST_FILE = 2**25  # bytes of a scenario or of a user's Python file
DEEPEST = 32  # tables and lists within each other


def check_room(key: str, value: object, numbers: float, what: str, most: int = MOST_SET_UP) -> None:
    """Refuse so many numbers of 8 bytes.

    Args:
        key, value: what the user gave that makes them so many.
        numbers: how many.
        what: they are, and that is to be said of them, such as "the estimates of 9 agents".
        most: bytes that they may take.
    """
    if not 8.0 * numbers <= most:
        raise InvalidInput(
            key,
            value,
            f"{what} would take {8e-9 * numbers:.3g} GB, where {1e-9 * most:.3g} GB are the most",
        )


def check_count(key: str, value: int, most: int, what: str = "it") -> None:
    """Refuse a count beyond ``most``, of what the value makes so many."""
    if value > most:
        raise InvalidInput(key, value, f"{what} must be at most {most}")


# More parts of one dotted TOML key than DEEPEST: reading them takes time by their number's square
_DOTTED = re.compile(
    rb"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){%d}""" % DEEPEST
)


def check_text(key: str, text: bytes) -> None:
    """Refuse TOML with keys so deep that it could not be read soon."""
    if _DOTTED.search(text):
        raise InvalidInput(key, "...", f"tables may be {DEEPEST} deep at most")


def check_nesting(key: str, value: Any) -> None:
    """Refuse tables and lists within each other that recursion would not get through."""
    level = [value]
    for _ in range(DEEPEST):
        within = [each for each in level if isinstance(each, dict | list)]
        level = [x for each in within for x in (each.values() if isinstance(each, dict) else each)]
        if not level:
            return
    raise InvalidInput(key, "...", f"tables and lists may be {DEEPEST} deep at most")


def read_file(path: Path) -> bytes:
    """The contents of a file.

    Raises:
        OSError: it cannot be read, is no ordinary file, or is longer than any that is of use.
    """
    # a pipe without a writer must not block
    with open(path, "rb", opener=lambda p, flags: os.open(p, flags | os.O_NONBLOCK)) as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise OSError(None, "it is no ordinary file", str(path))
        contents = stream.read(MOST_FILE + 1)
    if len(contents) > MOST_FILE:
        raise OSError(None, f"it has more than {MOST_FILE // 2**20} MiB", str(path))
    return contents
