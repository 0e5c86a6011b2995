"""Batches of ODE agents: a compiled loop over runs, on threads."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from types import ModuleType

import numpy as np

from gne_mj.loops.batch import BatchLoop, Case, Outcome, Span, begin
from gne_mj.loops.lane_batch import LaneLoop, Modules
from gne_mj.loops.layout import Steps
from gne_mj.loops.one_loop import Native
from gne_mj.native import call_integer, compiled
from gne_mj.parameter_block import ParameterBlock

PIECE, MANY = 8, 256  # runs that a thread takes at a time; and at most, where lanes go through them
LEAST = 50_000  # steps, of all runs together, for which a loop of lanes is worth compiling
STRIDE = 20_000  # steps of each of them between looks at the user's wishes


@compiled
def _advance_each(advance, parameter_blocks, workspaces, steps):
    """Move every run on, one after the other; addresses of parameter blocks and workspaces."""
    for run in range(len(parameter_blocks)):
        call_integer(advance, (parameter_blocks[run], workspaces[run], steps))


class OdeBatch(BatchLoop):
    """Runs of ODE agents.

    Args:
        native: what runs one, with fixed or adaptive steps.
        faults: module of kernels, see :func:`gne_mj.loops.ode.build`.
        faulty: whether runs record what was seen and what acted.
        threads: how many.
    """

    def __init__(
        self,
        native: Native,
        faults: ModuleType,
        faulty: bool,
        threads: int,
    ) -> None:
        self._native, self._advance = native, native.build(faults)
        self._faulty, self._threads = faulty, threads
        self._workers = ThreadPoolExecutor(threads)
        self._loops: dict[Modules, LaneLoop] = {}
        self._asked = 0  # steps of all runs so far

    def run(self, cases: Sequence[Case], span: Span, stopped: Callable[[], bool]) -> Outcome | None:
        """See the base class."""
        parameter_blocks, sizes, recorder, monitors = begin(cases, span, self._faulty)
        known = {block: block.address for block in set(parameter_blocks)}
        addresses = np.array([known[block] for block in parameter_blocks], dtype=np.int64)
        starts = np.array([case.state for case in cases]).reshape(len(cases), -1)
        if sizes.memory:
            starts = np.concatenate([starts, [case.memory for case in cases]], axis=1)
        length, rows = self._native.length(sizes), recorder.addresses
        in_lanes = None
        self._asked += len(cases) * span.steps
        if self._asked >= LEAST and not self._faulty:
            in_lanes = self._in_lanes(parameter_blocks[0], sizes)
        size = PIECE
        if in_lanes is not None:
            size = min(MANY, PIECE * -(-len(cases) // (2 * PIECE * self._threads)))

        def piece(first: int) -> bool:
            part = slice(first, first + size)
            flat = np.zeros((len(addresses[part]), length))
            workspaces = self._native.workspaces(flat, sizes)
            workspaces.loop.recorder = rows[part]
            workspaces.vectors.state = starts[part]
            at = flat.ctypes.data + 8 * length * np.arange(len(flat))
            own = parameter_blocks[part]
            if in_lanes is not None and in_lanes.fits(own):
                if not in_lanes.move(own, addresses[part], at, span.steps, stopped):
                    return False
            else:
                for done in range(0, span.steps, STRIDE):
                    if stopped():
                        return False
                    steps = min(STRIDE, span.steps - done)
                    _advance_each(self._advance.address, addresses[part], at, steps)
            recorder.heads.first[part] = span.last
            _advance_each(self._advance.address, addresses[part], at, 0)
            monitors[part] = workspaces.loop.monitor
            return True

        done = list(self._workers.map(piece, range(0, len(cases), size)))
        return Outcome(recorder.all(), monitors) if all(done) else None

    def _in_lanes(self, block: ParameterBlock, sizes: Steps) -> LaneLoop | None:
        """What moves runs with the first one's kernels in lanes, if anything does."""
        modules = block.modules
        if modules is None:
            return None
        if modules not in self._loops:
            self._loops[modules] = LaneLoop(
                modules, sizes, self._native, int(self._advance.address)
            )
        return self._loops[modules]
