"""Rows that native loops write at sample times: one block of arrays for each run.

A loop knows a block by its address; 0 stands for none. The block begins with the numbers of
:class:`Head`, and has a pair (address, length) for each column of :class:`Samples`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops.base import Samples
from gne_mj.native import copy, kernel
from gne_mj.numbers import Numbers, dtype_in, names_of, numbers_in
from gne_mj.parameter_block import exact, integers_at
from gne_mj.records import by_name, columns_in, count, shapes


class Head(Numbers):
    """Which rows a run writes."""

    first: int  # step of the first row
    every: int  # steps between rows
    rows: int  # that there is room for
    done: int  # rows written


HEADER = len(names_of(Head))  # the same as two pairs of a parameter block
WORDS = HEADER + 2 * count(Samples)

head_in, columns_in_block = numbers_in(Head), columns_in(Samples, HEADER // 2)


@kernel
def write(column, rows, row, source):
    """Write a column's row from the beginning of ``source``."""
    width = len(column) // rows
    copy(source[:width], column[row * width : (row + 1) * width])


@kernel
def record(block, faults, parts, step, now):
    """Write this step's row, if one is due.

    Args:
        block: its address.
        faults: module of kernels, see :func:`gne_mj.loops.ode.control_step`.
        parts: of the loop.
        step: which.
        now: :class:`gne_mj.loops.base.Present`, all flat, as at the step's start.
    """
    head = head_in(integers_at(block, HEADER), 0)
    due = head.first + head.done * head.every
    if due - head.every < step < due:  # as nearly always, and without a division
        return
    behind, rows = step - head.first, head.rows
    row = behind // head.every
    if behind < 0 or behind % head.every != 0 or row >= rows:
        return
    columns = columns_in_block(block)
    write(columns.state, rows, row, now.state)
    write(columns.input, rows, row, parts.u)
    write(columns.memory, rows, row, now.memory)
    write(columns.configuration, rows, row, now.configuration)
    width = len(columns.measurement) // rows
    at, end = row * width, (row + 1) * width
    faults.record(parts, step, now.state, columns.measurement[at:end], columns.applied[at:end])
    head.done = row + 1


@kernel
def next_row(block):
    """The step at whose start the next row of a recorder's block is due; infinite without one."""
    if block == 0:
        return np.inf
    head = head_in(integers_at(block, HEADER), 0)
    return np.inf if head.done >= head.rows else 1.0 * (head.first + head.done * head.every)


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
        heads: (runs,) which rows each run writes.
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
        m, states = shape
        of_columns = shapes(
            Samples, m=m, states=states, memory=memory, faulty=int(faulty), joints=configuration
        )
        self._columns = Samples(*(np.empty((runs, rows, *shape)) for shape in of_columns))
        self._blocks = np.zeros((runs, WORDS), dtype=np.int64)
        self.heads = by_name(self._blocks, dtype_in(Head))
        self.heads[:] = (first, every, rows, 0)  # a Head
        sizes = np.array([math.prod(column.shape[1:]) for column in self._columns])
        begin = np.array([column.ctypes.data for column in self._columns])
        pairs = self._blocks[:, HEADER:].reshape(runs, len(sizes), 2)
        pairs[:, :, 0] = begin + 8 * sizes * np.arange(runs)[:, None]
        pairs[:, :, 1] = sizes

    @property
    def addresses(self) -> NDArray[np.int64]:
        """(runs,) the blocks' addresses."""
        exact(self._blocks.ctypes.data + self._blocks.nbytes)
        return self._blocks.ctypes.data + 8 * WORDS * np.arange(len(self._blocks))

    @property
    def done(self) -> NDArray[np.int64]:
        """(runs,) rows written."""
        done: NDArray[np.int64] = self.heads.done
        return done

    def samples(self, run: int) -> Samples:
        """The rows of one run."""
        done = self.done[run]
        return Samples(*(column[run, :done] for column in self._columns))

    def all(self) -> Samples:
        """The rows of all runs, (runs, rows, ...); those not written are not numbers."""
        missing = np.arange(self._columns.input.shape[1]) >= self.done[:, None]
        for column in self._columns:
            column[missing] = np.nan
        return self._columns
