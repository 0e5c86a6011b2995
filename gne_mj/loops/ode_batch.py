"""Batches of ODE agents: a compiled loop over runs, on threads."""

from collections.abc import Callable, Sequence
from types import ModuleType

import numpy as np

from gne_mj.loops import monitor as watch
from gne_mj.loops.batch import BatchLoop, Case, Outcome, Span, workers
from gne_mj.loops.layout import ACTIONS, CONSTRAINTS, MEMORY, MONITOR, RECORDER, STATES, STEP
from gne_mj.loops.ode import build, room_length, scratch_width
from gne_mj.loops.recorder import FIRST, HEADER, Recorder
from gne_mj.native import call_loop, compiled, copy
from gne_mj.plants.agents import Agents
from gne_mj.table import integers_at

PIECE = 8  # runs that a thread takes at a time


@compiled
def _run_each(
    advance, tables, blocks, starts, monitors, room, address, state_at, monitor_at, steps, last
):  # fmt: skip
    """Run so many runs one after the other in the one room at ``address``."""
    for run in range(len(tables)):
        room[:] = 0.0
        room[RECORDER] = blocks[run]
        copy(starts[run], room[state_at : state_at + starts.shape[1]])
        call_loop(advance, tables[run], address, steps)
        integers_at(blocks[run], HEADER)[FIRST] = last
        call_loop(advance, tables[run], address, 0)
        copy(room[monitor_at : monitor_at + monitors.shape[1]], monitors[run])


class OdeBatch(BatchLoop):
    """Runs of ODE agents with a fixed step.

    Args:
        agents: of the runs' type.
        law, game, acting, faults: modules of kernels, see :func:`gne_mj.loops.ode.build`.
        faulty: whether runs record what was seen and what acted.
        threads: how many.
    """

    def __init__(
        self,
        agents: Agents,
        law: ModuleType,
        game: ModuleType,
        acting: ModuleType,
        faults: ModuleType,
        faulty: bool,
        threads: int,
    ) -> None:
        self._advance = build(agents.kind, law, game, acting, faults)
        self._faulty, self._threads = faulty, threads

    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """See the base class."""
        tables = [case.table for case in cases if case.table is not None]
        sizes = tables[0].arrays[STEP]
        m, p, states, memory = (sizes[i] for i in (ACTIONS, CONSTRAINTS, STATES, MEMORY))
        recorder = Recorder(
            len(cases), span.rows, (m, states), memory, self._faulty, every=span.every
        )
        addresses = np.array([table.address for table in tables], dtype=np.int64)
        starts = np.stack([np.concatenate([c.state.ravel(), c.memory]) for c in cases])
        monitors = np.zeros((len(cases), watch.length(m, p)))
        length = room_length(sizes)
        state_at = length - starts.shape[1] - 5 * scratch_width(sizes)

        def piece(first: int) -> bool:
            if stopped():
                return False
            room = np.zeros(length)
            part = slice(first, first + PIECE)
            _run_each(
                self._advance.address, addresses[part], recorder.addresses[part], starts[part],
                monitors[part], room, room.ctypes.data, state_at, MONITOR, span.steps, span.last,
            )  # fmt: skip
            return True

        with workers(self._threads) as pool:
            done = list(pool.map(piece, range(0, len(cases), PIECE)))
        return Outcome(recorder.all(), monitors) if all(done) else None
