"""Many runs of one structure at once: what every engine's batch offers.

Runs of one structure share kernels, shapes, mode, integrator and step; whatever is in their
parameter blocks (the game's numbers, gains, penalties, periods, the agents' numbers) may differ
from run to run. Every run is computed as it would be alone, so results depend neither on threads
nor on how runs are put together.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.layout import Steps, steps_of
from gne_mj.loops.recorder import Recorder
from gne_mj.parameter_block import ParameterBlock

SLICE = 50  # rows of a run alone between looks at the user's wishes


@dataclass(frozen=True)
class Case:
    """One run of a batch.

    Attributes:
        state: (m, states) at the start.
        memory: the law's, at the start.
        parameters: (m, numbers of the agents' type).
        parameter_block: of the run, for native batches.
        loop: makes the run's own closed loop, for engines without a native batch.
    """

    state: NDArray[np.float64]
    memory: NDArray[np.float64]
    parameters: NDArray[np.float64]
    parameter_block: ParameterBlock | None
    loop: Callable[[], ClosedLoop]


@dataclass(frozen=True)
class Span:
    """How long the runs of a batch are and when rows are recorded.

    Args:
        steps: integration steps.
        every: steps between rows.
    """

    steps: int
    every: int

    @property
    def rows(self) -> int:
        """Rows of each run: at every sample time before the end, and at the end."""
        return -(-self.steps // self.every) + 1

    @property
    def last(self) -> int:
        """From which step rows must be counted for the last one to be that of the end."""
        return self.steps - (self.rows - 1) * self.every


@dataclass(frozen=True)
class Outcome:
    """What a batch showed.

    Attributes:
        samples: rows of every run, (runs, rows, ...), not numbers from a run's exit on.
        monitors: (runs,), see :func:`gne_mj.loops.monitor.fresh`.
    """

    samples: Samples
    monitors: Any

    def part(self, runs: slice | NDArray[np.int64]) -> "Outcome":
        """Of some runs only."""
        return Outcome(Samples(*(column[runs] for column in self.samples)), self.monitors[runs])


def begin(
    cases: Sequence[Case], span: Span, faulty: bool
) -> tuple[list[ParameterBlock], Steps, Recorder, Any]:
    """What a native batch begins with: parameter blocks, the sizes that all share, room for rows,
    monitors.

    Args:
        cases: all with a parameter block.
        span: of the runs.
        faulty: whether runs record what was seen and what acted.
    """
    parameter_blocks = [case.parameter_block for case in cases if case.parameter_block is not None]
    sizes = steps_of(parameter_blocks[0])
    m, p, states, memory = sizes.actions, sizes.constraints, sizes.states, sizes.memory
    recorder = Recorder(len(cases), span.rows, (m, states), memory, faulty, every=span.every)
    return parameter_blocks, sizes, recorder, watch.fresh(m, p, len(cases))


class BatchLoop(ABC):
    """Runs cases of one structure."""

    @abstractmethod
    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """Run all cases to their ends; None if ``stopped`` said so meanwhile."""


class EachLoop(BatchLoop):
    """Runs every case by a loop of its own, on threads: for engines without a native batch."""

    def __init__(self, threads: int) -> None:
        self._threads = threads

    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """See the base class."""
        whole, rest = divmod(span.steps, span.every)

        def one(case: Case) -> tuple[list[NDArray[np.float64]], Any] | None:
            loop, parts = case.loop(), []
            for first in range(0, whole, SLICE):
                if stopped():
                    return None
                parts.append(loop.advance(min(SLICE, whole - first), span.every))
            if rest:
                parts.append(loop.advance(1, rest))
            done = sum(len(part.input) for part in parts)
            last = loop.finish()
            if done == span.rows - 1 and not np.any(np.isnan(last.input)):
                parts.append(last)
            columns = []
            for found in Samples.join(parts):
                column = np.full((span.rows, *found.shape[1:]), np.nan)
                column[: len(found)] = found
                columns.append(column)
            return columns, loop.monitor

        with workers(self._threads) as pool:
            found = list(pool.map(one, cases))
        kept = [each for each in found if each is not None]
        if len(kept) < len(found):
            return None
        columns = zip(*(columns for columns, _ in kept), strict=True)
        return Outcome(
            Samples(*(np.stack(column) for column in columns)),
            watch.together([monitor for _, monitor in kept]),
        )


@contextmanager
def workers(threads: int) -> Iterator[ThreadPoolExecutor]:
    """Threads for native code, which needs no lock of Python's."""
    with ThreadPoolExecutor(threads) as pool:
        yield pool
