"""The stiff closed loop of ODE agents under the fully distributed law, by a Rosenbrock method.

Small epsilon makes the estimates and z of [eq:CentreDynamics2] fast, so that explicit methods
crawl. Rodas5P (:mod:`gne_mj.loops.rodas`) is L-stable, its steps hardly depend on epsilon, and the
structure of the loop keeps them cheap (:mod:`gne_mj.loops.stage_system`).

The loop's flat vector holds the channels' states, the law's memory, and behind them the estimates'
modes. The modes are integrated beside the estimates that the law reads; since the method commutes
with linear maps, both are the same solution.
"""

import math
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.controllers.settings import EPSILON
from gne_mj.graph import Graph
from gne_mj.loops import functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.estimate_modes import Modes, modes_of, to_modes
from gne_mj.loops.feedback import feedback
from gne_mj.loops.layout import (
    Setup,
    clock_in,
    ode_parameter_block,
    steps_in,
)
from gne_mj.loops.ode import measure
from gne_mj.loops.rodas import STAGES, method
from gne_mj.loops.rosenbrock_step import (
    ACT,
    EXIT_LENGTH,
    STEP_SCRATCH,
    Place,
    RosenbrockState,
    Rows,
    Workspace,
    control_step,
    exit_in,
    interpolate,
    run_in,
    step_on,
    step_to_trial,
    workspace_length,
)
from gne_mj.loops.stage_system import (
    solve_stage,
    stage_system,
)
from gne_mj.native import (
    call_integer,
    callback,
    compiled,
    kernel,
    source_key,
)
from gne_mj.parameter_block import ParameterBlock, floats_at
from gne_mj.plants import functions as agents_functions
from gne_mj.plants.agents import Agents, input_columns
from gne_mj.records import arrays, by_name, dtype_of

_whole, _real = types.int64, types.float64


@cache
def parts() -> list[Any]:
    """C functions of a step's parts, for all agents and games, in the order of their numbers."""
    source = source_key()

    def act(block, workspace, solver, time, stage, state, latch, u):
        _ = source
        fixed, run = run_in(block, workspace, solver)
        size, y = fixed.channels.equilibrium_state.size, run.work.y
        vector = floats_at(state, size + steps_in(block).memory)
        measure(fixed.channels, vector, y)
        good = feedback(
            fixed.problem, time, stage, y, vector[size:], run.work,
            exit_in(floats_at(latch, EXIT_LENGTH), 0), floats_at(u, len(y)),
        )  # fmt: skip
        return 1 if good else 0

    def observe(block, workspace, solver, time, state, latch, u):
        _ = source
        fixed, run = run_in(block, workspace, solver)
        good = call_integer(
            run.solver.functions[ACT], (block, workspace, solver, time, 0, state, latch, u)
        )
        if good != 0:
            vector = floats_at(state, fixed.channels.equilibrium_state.size)
            delivered = floats_at(u, len(run.u))
            storage = agents_functions.stored(fixed.channels, vector, run.solver.system.known)
            memory = vector[fixed.channels.equilibrium_state.size :]
            storage += functions.storage(fixed.problem, memory)
            functions.observe_positions(fixed.problem, run.work, run.monitor, time, vector)
            watch.observe(run.monitor, run.figures, time, run.work, delivered, delivered, storage)
        return good

    def solve(block, workspace, solver, h, stage):
        _ = source
        fixed, run = run_in(block, workspace, solver)
        arrays = run.solver
        solve_stage(fixed, h, stage, arrays.trial, arrays.u, arrays.k, arrays.system)
        return 0

    def try_step(block, workspace, solver, time, h):
        _ = source
        fixed, run = run_in(block, workspace, solver)
        return step_to_trial(fixed, run, time, h)

    place = [_whole] * 3
    return [
        callback(_whole(*place, _real, *[_whole] * 4), act),
        callback(_whole(*place, _real, *[_whole] * 3), observe),
        callback(_whole(*place, _real, _whole), solve),
        callback(_real(*place, _real, _real), try_step),
    ]


@kernel
def observe(run, time, row, u):
    """Fill a row at a time within the last step, and observe; False, and no numbers in u, if there
    is no input."""
    progress = run.progress
    interpolate(progress, time, run.solver.dense, row)
    # Outside between two states inside is the interpolation's doing and ends no run.
    latch = run.exit if progress.end > 0.0 else run.monitor
    good = control_step(run, time, row, latch, u)
    if not good:
        for r in range(len(u)):
            u[r] = np.nan
    run.monitor.steps = progress.accepted
    return good


@cache
def build() -> SimpleNamespace:
    """The native loop, for all agents and games."""
    source = source_key()

    @compiled
    def advance(place, step, every, rows):
        """Fill rows, each followed by ``every`` sample steps; how many, and the step then."""
        _ = source
        fixed, run = run_in(place.parameter_block, place.workspace, place.solver)
        progress, period = run.progress, clock_in(place.parameter_block).h
        for sample in range(len(rows.u)):
            good = observe(run, step * period, rows.state[sample], rows.u[sample])
            if not good and progress.end == 0.0:
                return sample, step
            time = (step + every) * period
            while progress.end < time:
                if not step_on(fixed, run):
                    return sample + 1, step
            step += every
        return len(rows.u), step

    @compiled
    def finish(place, time, rows):
        """Fill the one row with what is at a time within the last step."""
        _ = source
        _fixed, run = run_in(place.parameter_block, place.workspace, place.solver)
        observe(run, time, rows.state[0], rows.u[0])

    return SimpleNamespace(advance=advance, finish=finish)


class RosenbrockLoop(ClosedLoop):
    """The closed loop of ODE agents under the fully distributed law, with adaptive steps.

    Rows at sample times come from the steps' dense output, so steps do not depend on them, nor on
    how a run is divided into calls. The monitor sees every accepted step's start and every sample.

    Args:
        agents: the agents.
        setup: what the run is made of; its law is the fully distributed one.
        graph: who hears whom, the same as in ``setup``.
        state: (m, states) at the start.
        memory: the law's, at the start.
        rtol: error allowed per step, relative to each state's greatest magnitude so far.
        atol: error allowed per step besides, in the states' own units.
        affine: whether all constraints are, so that they have no second derivatives.
    """

    def __init__(
        self,
        agents: Agents,
        setup: Setup,
        graph: Graph,
        state: NDArray[np.float64],
        memory: NDArray[np.float64],
        rtol: float = 1e-6,
        atol: float = 1e-9,
        affine: bool = False,
    ) -> None:
        self._native = build()
        self._agents, self._shape = agents, state.shape
        data, m = setup.problem.data, len(state)
        constraints = len(data.member_pointer) - 1
        modes = modes_of(graph, np.repeat(np.arange(graph.agents), np.diff(data.offsets)))
        self._length, self._estimates = state.size + len(memory), graph.agents * m
        self._h = setup.clock.h
        self._step = 0
        self._state = self._flat(modes, state, memory)
        sizes = {"m": m, "p": constraints, "agents": graph.agents}
        self._workspace = np.zeros(workspace_length(*sizes.values()))
        workspace = by_name(self._workspace, dtype_of(Workspace, **sizes, **STEP_SCRATCH))
        self._progress, self.monitor, self._exit = workspace, workspace.monitor, workspace.exit
        self._solver = RosenbrockState(
            functions=np.array([each.address for each in parts()]),
            state=self._state,
            trial=np.zeros_like(self._state),
            k=np.zeros((STAGES, len(self._state))),
            dense=np.zeros((5, self._length)),
            greatest=np.abs(state).max(axis=0),
            u=np.zeros(m),
            system=stage_system(input_columns(agents.kind, agents.parameters), data, affine),
            modes=modes,
            method=method(rtol, atol),
        )
        self._solver_block = ParameterBlock(arrays(self._solver))
        self._take(setup)
        self._begin()

    def _take(self, setup: Setup) -> None:
        """Let this be what the loop and the law's functions read."""
        memory = self._length - math.prod(self._shape)
        self._parameter_block = ode_parameter_block(setup, self._agents, memory)
        self._epsilon = float(setup.problem.settings[EPSILON])

    def _flat(
        self, modes: Modes, state: NDArray[np.float64], memory: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        estimates = to_modes(modes, memory[: self._estimates])
        return np.concatenate([state.ravel(), memory, estimates])

    def _begin(self) -> None:
        """Let the next adaptive step be from this state at the present time."""
        dense = self._solver.dense
        dense[:2], dense[2:] = self._state[: self._length], 0.0
        self._progress.last_step = self._progress.last_error = 0.0
        self._progress.start = self._progress.end = self.time
        self._progress.next = min(self._h, self._epsilon)

    @property
    def time(self) -> float:
        """Time of the present state in s: of a run that has ended early, its last step's end."""
        ended = self.monitor.exit != watch.INSIDE
        return float(self._progress.end) if ended else self._step * self._h

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps have been accepted, and how many rejected."""
        return int(self._progress.accepted), int(self._progress.rejected)

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        rows, done = self._rows(samples), 0
        if self.monitor.exit == watch.INSIDE:
            done, self._step = self._native.advance(self._place, self._step, every, rows)
        return self._samples(rows.state[:done], rows.u[:done])

    def finish(self) -> Samples:
        """See the base class."""
        rows = self._rows(1)
        self._native.finish(self._place, self.time, rows)
        return self._samples(*rows)

    @property
    def _place(self) -> Place:
        return Place(
            self._parameter_block.address, self._workspace.ctypes.data, self._solver_block.address
        )

    def _rows(self, count: int) -> Rows:
        return Rows(np.empty((count, self._length)), np.empty((count, self._shape[0])))

    def present(self) -> Present:
        """See the base class; the state between two adaptive steps is interpolated."""
        row, size = np.empty(self._length), self._shape[0] * self._shape[1]
        interpolate(self._progress, self.time, self._solver.dense, row)
        return Present(row[:size].reshape(self._shape), row[size:], row[:0])

    def _adopt(self, setup: Setup) -> None:
        state, memory, _ = self.present()
        self._take(setup)
        # the last step's end lies beyond, by the old
        self._state[:] = self._flat(self._solver.modes, state, memory)
        self._begin()

    def _samples(self, states: NDArray[np.float64], inputs: NDArray[np.float64]) -> Samples:
        size = self._shape[0] * self._shape[1]
        return Samples(
            state=states[:, :size].reshape(-1, *self._shape),
            input=inputs,
            memory=states[:, size:],
            measurement=inputs[:, :0],
            applied=inputs[:, :0],
            configuration=inputs[:, :0],
        )
