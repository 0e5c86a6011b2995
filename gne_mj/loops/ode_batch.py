"""Batches of ODE agents: a compiled loop over runs, on threads."""

from collections.abc import Callable, Sequence
from types import ModuleType

import numpy as np

from gne_mj.loops.batch import BatchLoop, Case, Outcome, Span, begin, workers
from gne_mj.loops.ode import build, ode_workspace_length, workspaces_of
from gne_mj.native import call_integer, compiled

PIECE = 8  # runs that a thread takes at a time
STRIDE = 20_000  # steps of each of them between looks at the user's wishes


@compiled
def _advance_each(advance, parameter_blocks, workspaces, steps):
    """Move every run on, one after the other; addresses of parameter blocks and workspaces."""
    for run in range(len(parameter_blocks)):
        call_integer(advance, (parameter_blocks[run], workspaces[run], steps))


class OdeBatch(BatchLoop):
    """Runs of ODE agents with a fixed step.

    Args:
        faults: module of kernels, see :func:`gne_mj.loops.ode.build`.
        faulty: whether runs record what was seen and what acted.
        threads: how many.
    """

    def __init__(
        self,
        faults: ModuleType,
        faulty: bool,
        threads: int,
    ) -> None:
        self._advance = build(faults)
        self._faulty, self._threads = faulty, threads

    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """See the base class."""
        parameter_blocks, sizes, recorder, monitors = begin(cases, span, self._faulty)
        addresses = np.array(
            [parameter_block.address for parameter_block in parameter_blocks], dtype=np.int64
        )
        starts = np.stack([np.concatenate([c.state.ravel(), c.memory]) for c in cases])
        length = ode_workspace_length(sizes)

        def piece(first: int) -> bool:
            part = slice(first, first + PIECE)
            flat = np.zeros((len(addresses[part]), length))
            workspaces = workspaces_of(flat, sizes)
            workspaces.loop.recorder = recorder.addresses[part]
            workspaces.vectors.state = starts[part]
            at = flat.ctypes.data + 8 * length * np.arange(len(flat))
            for done in range(0, span.steps, STRIDE):
                if stopped():
                    return False
                steps = min(STRIDE, span.steps - done)
                _advance_each(self._advance.address, addresses[part], at, steps)
            recorder.heads.first[part] = span.last
            _advance_each(self._advance.address, addresses[part], at, 0)
            monitors[part] = workspaces.loop.monitor
            return True

        with workers(self._threads) as pool:
            done = list(pool.map(piece, range(0, len(cases), PIECE)))
        return Outcome(recorder.all(), monitors) if all(done) else None
