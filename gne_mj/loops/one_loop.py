"""The closed loop of ODE agents, whichever way it steps: by a native loop that records its rows."""

from abc import abstractmethod
from collections.abc import Callable
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops import faultless
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.layout import SCRATCH, Setup, Steps, ode_parameter_block, steps_of
from gne_mj.loops.recorder import Recorder
from gne_mj.native import kernel
from gne_mj.plants.agents import Agents
from gne_mj.records import by_name, dtype_of, in_array


class Native(NamedTuple):
    """A kind of native loop of ODE agents.

    Attributes:
        build: from a module of faults to the loop, as :func:`gne_mj.loops.ode.build`.
        length: entries of a workspace for a run of these sizes.
        workspaces: what workspaces hold, by name; ``loop`` and ``vectors.state`` at least.
    """

    build: Callable[[ModuleType], Any]
    length: Callable[[Steps], int]
    workspaces: Callable[[NDArray[np.float64], Steps], Any]


_SIZES = "m p agents states memory history solver separation"


def laid_out(record: Any) -> tuple[Any, Any, Callable[[NDArray[np.float64], Steps], Any]]:
    """How a loop's workspace lies in one flat array.

    Args:
        record: the workspace, whose shapes are of the sizes that a parameter block has.

    Returns:
        ``length(steps)``, its entries, and ``views(flat, steps)``, both kernels; and the same views
        of (..., length) as Python knows them, by name.
    """
    length_of, views_of = in_array(record, _SIZES, **SCRATCH)

    @kernel
    def length(s):
        return length_of(
            s.actions, s.constraints, s.agents, s.states, s.memory, s.history, s.solver,
            s.separation,
        )  # fmt: skip

    @kernel
    def views(flat, s):
        return views_of(
            flat, 0, s.actions, s.constraints, s.agents, s.states, s.memory, s.history, s.solver,
            s.separation,
        )  # fmt: skip

    def named(flat: NDArray[np.float64], s: Steps) -> Any:
        sizes = dict(zip(_SIZES.split(), (
            s.actions, s.constraints, s.agents, s.states, s.memory, s.history, s.solver,
            s.separation,
        ), strict=True))  # fmt: skip
        return by_name(flat, dtype_of(record, **sizes, **SCRATCH))

    return length, views, named


class OneLoop(ClosedLoop):
    """The closed loop of ODE agents, whichever way it steps.

    Args:
        agents: the agents.
        setup: what the run is made of.
        state: (m, states) at the start.
        memory: the law's, at the start.
        faults: module of kernels, see :func:`gne_mj.loops.ode.control_step`.

    Attributes:
        native: what it runs.
    """

    native: ClassVar[Native]

    def __init__(
        self,
        agents: Agents,
        setup: Setup,
        state: NDArray[np.float64],
        memory: NDArray[np.float64],
        faults: ModuleType = faultless,
    ) -> None:
        self._advance = self.native.build(faults).ctypes
        self._agents = agents
        self._h, self._shape, self._memory = setup.clock.h, state.shape, len(memory)
        self._faulty = faults.RECORDED
        self._take(setup)
        sizes = steps_of(self._parameter_block)
        self._flat = np.zeros(self.native.length(sizes))
        self._workspace = self.native.workspaces(self._flat, sizes)
        self.monitor = self._workspace.loop.monitor
        self._workspace.vectors.state[:] = np.concatenate([state.ravel(), memory])

    @property
    def _reached(self) -> float:
        """Time in s at which the present timestep begins."""
        return float(self._workspace.loop.step * self._h)

    @abstractmethod
    def _now(self) -> NDArray[np.float64]:
        """The present flat state, with the memory."""

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        return self._run(samples, every, samples * every)

    def finish(self) -> Samples:
        """See the base class."""
        rows = self._run(1, 1, 0)
        if len(rows.input):
            return rows
        state, memory, _ = (row[None] for row in self.present())
        columns = rows.input, rows.measurement, rows.applied
        u, measurement, applied = (np.full((1, row.shape[1]), np.nan) for row in columns)
        return Samples(state, u, memory, measurement, applied, u[:, :0])

    def present(self) -> Present:
        """See the base class."""
        now = self._now().copy()
        size = len(now) - self._memory
        return Present(now[:size].reshape(self._shape), now[size:], now[:0])

    def start_at(self, step: int) -> None:
        """See the base class."""
        loop = self._workspace.loop
        loop.step = loop.work.memory_step = step

    def _take(self, setup: Setup) -> None:
        """Let this be what the loop reads."""
        self._parameter_block = ode_parameter_block(setup, self._agents, self._memory)

    def _run(self, rows: int, every: int, steps: int) -> Samples:
        loop = self._workspace.loop
        recorder = Recorder(
            1, rows, self._shape, self._memory, self._faulty, first=int(loop.step), every=every
        )
        if rows > 0:
            loop.recorder = recorder.addresses[0]
            self._advance(self._parameter_block.address, self._flat.ctypes.data, steps)
            loop.recorder = 0.0
        return recorder.samples(0)
