"""Rows that native loops write at sample times: one block of arrays for each run.

A loop knows a block by its address; 0 stands for none. The block is [first step of which a row is
written, steps between rows, rows that there is room for, rows written], and then a pair (address,
length) for each column.
"""

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops.base import Samples
from gne_mj.native import copy, kernel
from gne_mj.table import exact, floats, integers_at

FIRST, EVERY, ROWS, DONE = range(4)
HEADER = 4  # the same as two pairs of a table
STATE, INPUT, MEMORY, SEEN, ACTS, CONFIGURATION = range(2, 8)
WORDS = HEADER + 12


@kernel
def write(block, index, rows, row, source):
    """Write a column's row from the beginning of ``source``."""
    column = floats(block, index)
    width = len(column) // rows
    copy(source[:width], column[row * width : (row + 1) * width])


@kernel
def record(block, faults, channels, problem, clock, step, state, u, memory, work, qpos):
    """Write this step's row, if one is due; state, u and qpos are flat, as at its start."""
    head = integers_at(block, HEADER)
    behind, rows = step - head[FIRST], head[ROWS]
    row = behind // head[EVERY]
    if behind < 0 or behind % head[EVERY] != 0 or row >= rows:
        return
    write(block, STATE, rows, row, state)
    write(block, INPUT, rows, row, u)
    write(block, MEMORY, rows, row, memory)
    write(block, CONFIGURATION, rows, row, qpos)
    seen, acts = floats(block, SEEN), floats(block, ACTS)
    width = len(seen) // rows
    at, end = row * width, (row + 1) * width
    faults.record(channels, problem, clock, step, state, u, work, seen[at:end], acts[at:end])
    head[DONE] = row + 1


class Recorder:
    """Room for rows of several runs.

    Args:
        runs: how many.
        rows: of each run.
        shape: (m, states) of the agents' channels.
        memory: entries of the law's memory.
        faulty: whether what was seen and what acted is recorded too.
        configuration: joint positions to record besides.
        first: step of the first row.
        every: steps between rows.

    Attributes:
        blocks: (runs, WORDS), what the loops know.
    """

    def __init__(
        self,
        runs: int,
        rows: int,
        shape: tuple[int, int],
        memory: int,
        faulty: bool,
        configuration: int = 0,
        *,
        first: int = 0,
        every: int = 1,
    ) -> None:
        m = shape[0]
        struck = m * int(faulty)
        widths = (m, memory, struck, struck, configuration)
        columns = [np.empty((runs, rows, width)) for width in widths]
        self._columns = [np.empty((runs, rows, *shape)), *columns]
        self.blocks = np.zeros((runs, WORDS), dtype=np.int64)
        self.blocks[:, : DONE + 1] = first, every, rows, 0
        for at, column in enumerate(self._columns, start=STATE):
            size = column[0].size if runs else 0
            self.blocks[:, 2 * at] = column.ctypes.data + 8 * size * np.arange(runs)
            self.blocks[:, 2 * at + 1] = size

    @property
    def addresses(self) -> NDArray[np.int64]:
        """(runs,) the blocks' addresses."""
        exact(self.blocks.ctypes.data + self.blocks.nbytes)
        return self.blocks.ctypes.data + 8 * WORDS * np.arange(len(self.blocks))

    @property
    def done(self) -> NDArray[np.int64]:
        """(runs,) rows written."""
        return self.blocks[:, DONE]

    def samples(self, run: int) -> Samples:
        """The rows of one run."""
        return Samples(*(column[run, : self.done[run]] for column in self._columns))

    def all(self) -> Samples:
        """The rows of all runs, (runs, rows, ...); those not written are not numbers."""
        missing = np.arange(self._columns[0].shape[1]) >= self.done[:, None]
        for column in self._columns:
            column[missing] = np.nan
        return Samples(*self._columns)
