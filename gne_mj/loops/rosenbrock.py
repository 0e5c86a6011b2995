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
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.settings import EPSILON
from gne_mj.graph import Graph
from gne_mj.loops import monitor as watch
from gne_mj.loops import positions
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.estimate_modes import Modes, add_from_modes, modes_of, to_modes
from gne_mj.loops.feedback import StepScratch, feedback
from gne_mj.loops.layout import (
    SCRATCH,
    Setup,
    channels_in,
    clock_in,
    ode_parameter_block,
    problem_in,
)
from gne_mj.loops.linear import add_multiple
from gne_mj.loops.ode import measure
from gne_mj.loops.rodas import ADDING, ORDER, STAGES, Method, method
from gne_mj.loops.stage_system import (
    Fixed,
    StageSystem,
    linearise,
    prepare,
    solve_stage,
    stage_system,
)
from gne_mj.native import compiled, copy, kernel, source_key
from gne_mj.numbers import Numbers
from gne_mj.plants import functions as agents_functions
from gne_mj.plants.agents import Agents, input_columns
from gne_mj.records import by_name, dtype_of, in_array

# How the step is chosen: Gustafsson's predictive controller with the figures of Hairer's RODAS.
SAFETY, GROW, SHRINK = 0.9, 6.0, 0.2
POWER = 1.0 / ORDER
# Step in s, relative to the time from EARLY on, below which a run ends; and how far beyond it is
# looked whether the boundary is why, relative to the time from 1 s on
SMALLEST, EARLY = 1e-12, 1e-6
AHEAD = 1e-6


class Steps(Numbers):
    """How far a run is: the last accepted step runs from start to end."""

    start: float
    end: float
    next: float  # length to be tried, as the others in s
    last_step: float
    last_error: float
    accepted: float
    rejected: float


class RosenbrockState(NamedTuple):
    """Arrays that a step works on; n is the length of states and memory, w that of the modes."""

    trial: np.ndarray  # (n + w,) the flat vector at a stage
    k: np.ndarray  # (STAGES, n + w)
    dense: np.ndarray  # (5, n) what the dense output of the last accepted step needs
    greatest: np.ndarray  # (states,) each state's greatest magnitude so far
    u: np.ndarray  # (m,) input at a stage
    system: StageSystem
    modes: Modes  # read-only
    method: Method  # read-only


class Rows(NamedTuple):
    """What a run has recorded."""

    state: np.ndarray  # (rows, n) states and memory
    u: np.ndarray  # (rows, m)


class Workspace(NamedTuple):
    """What changes in a run besides, in one flat array."""

    progress: Steps
    monitor: watch.Monitor
    exit: watch.MonitorNumbers  # why the last stage failed
    u: Annotated[np.ndarray, "m"]  # input at the last step's start
    work: StepScratch


_SCRATCH = SCRATCH | {"history": 0, "solver": 0}
_length, _workspace_in = in_array(Workspace, "m p agents", **_SCRATCH)


class Run(NamedTuple):
    """What kernels of a run change."""

    progress: Steps
    monitor: watch.MonitorNumbers
    figures: watch.Monitor
    exit: watch.MonitorNumbers
    u: np.ndarray
    work: StepScratch
    solver: RosenbrockState


@kernel
def run_in(parameter_block, flat, solver):
    """What does not change in a run, and what does, from its parameter block and workspace."""
    fixed = Fixed(
        problem_in(parameter_block), channels_in(parameter_block), solver.modes, solver.method
    )
    data = fixed.problem.data
    m, p, agents = len(data.owner), len(data.member_pointer) - 1, len(data.offsets) - 1
    workspace = _workspace_in(flat, 0, m, p, agents)
    watched, figures = workspace.monitor.numbers, workspace.monitor
    return fixed, Run(
        workspace.progress, watched, figures, workspace.exit, workspace.u, workspace.work, solver
    )


@kernel
def control_step(fixed, run, time, state, latch, u):
    """Measure, act and observe; fill u. False, with the exit in ``latch``, if there is no input."""
    channels, work = fixed.channels, run.work
    measure(channels, state, work.y)
    memory = state[channels.equilibrium_state.size :]
    if not feedback(fixed.problem, time, 0, work.y, memory, work, latch, u):
        return False
    storage = agents_functions.stored(channels, state, run.solver.system.known)
    positions.observe(fixed.problem, channels, work, run.monitor, time, state)
    watch.observe(run.monitor, run.figures, time, work, u, u, storage)
    return True


@kernel
def error_of(output, agents, method, states, state, solver):
    """Weighted estimate of the step's error, 1 being what is allowed: the worst of all states.

    A state is compared with its greatest magnitude so far in any channel, z and the estimates
    with that of the output; a column of estimates counts by its root mean square, which is that
    of its modes.
    """
    m = len(solver.u)
    k = solver.k[STAGES - 1]
    at_z = m * states + agents * m
    worst = 0.0
    for a in range(states):
        allowed = method.atol + method.rtol * magnitude(states, state, solver, a)
        for r in range(m):
            error = abs(k[r * states + a])
            if a == output:
                total = 0.0
                for mode in range(at_z + m + r, len(k), m):
                    total += k[mode] ** 2
                error = max(error, abs(k[at_z + r]), np.sqrt(total / max(agents - 1, 1)))
                error += 0.0 * (total + k[at_z + r])  # not a number if one of them is not
            error /= allowed
            if not error < np.inf:
                return np.inf
            worst = max(worst, error)
    return worst


@kernel
def magnitude(states, state, solver, a):
    """Greatest magnitude of the channels' state a so far and at ``state``."""
    greatest = solver.greatest[a]
    for r in range(len(solver.u)):
        greatest = max(greatest, abs(state[r * states + a]))
    return greatest


@kernel
def try_step(fixed, run, time, h, state):
    """Fill trial with the flat vector after a step of length h; return its weighted error.

    The error is infinite, and run.exit says why, if a stage or the new state is not inside.
    """
    problem, channels, method = fixed.problem, fixed.channels, fixed.method
    work, solver = run.work, run.solver
    size, agents = channels.equilibrium_state.size, len(problem.data.offsets) - 1
    trial, k = solver.trial, solver.k
    run.exit.exit = watch.INSIDE
    if not prepare(fixed, h, solver.system):
        watch.leave(run.exit, watch.DIVERGED, time, -1, -1, np.inf, 1)
        return np.inf
    copy(run.u, solver.u)
    for stage in range(STAGES + 1):
        if stage < ADDING:
            copy(state, trial)
            for j in range(stage):
                add_multiple(method.stage[stage, j], k[j], trial)
        else:
            add_multiple(1.0, k[stage - 1], trial)
        if stage > 0:
            measure(channels, trial, work.y)
            if not feedback(problem, time, stage, work.y, trial[size:], work, run.exit, solver.u):
                return np.inf
        if stage < STAGES:
            solve_stage(fixed, h, stage, trial, solver.u, k, solver.system)
    states = channels.equilibrium_state.shape[1]
    error = error_of(channels.output, agents, method, states, trial, solver)
    if not error <= 1.0:  # latched only if the run ends here
        watch.leave(run.exit, watch.DIVERGED, time, -1, -1, error, STAGES)
    return error


@kernel
def look_ahead(fixed, run, time, h, state):
    """Tell in run.exit if the boundary is why even the smallest step has failed.

    Next to the boundary the demand grows so fast that no step is accurate. The trial vector is
    moved on along the step of length h, until it is outside or a microsecond away.
    """
    problem, channels, work, solver = fixed.problem, fixed.channels, run.work, run.solver
    y, trial, size = work.y, solver.trial, channels.equilibrium_state.size
    while h < AHEAD * max(1.0, time):
        h *= 2.0
        for r in range(len(trial)):
            trial[r] += trial[r] - state[r]
        measure(channels, trial, y)
        why = run.exit.exit
        run.exit.exit = watch.INSIDE
        if not feedback(
            problem, time, STAGES, y, trial[size:], work, run.exit, solver.u
        ) and run.exit.exit != watch.DIVERGED:  # fmt: skip
            return
        run.exit.exit = why


@kernel
def accept(fixed, run, h, state):
    """Move to the trial state, and keep what the dense output of the step needs."""
    problem, channels, modes, method = fixed.problem, fixed.channels, fixed.modes, fixed.method
    progress, solver = run.progress, run.solver
    at, states = problem.data.offsets, channels.equilibrium_state.shape[1]
    m, agents = len(solver.u), len(at) - 1
    size, n = m * states, solver.dense.shape[1]
    copy(state[:n], solver.dense[0])
    copy(solver.trial, state)
    # anew from the modes, so that rounding does not add up in the estimates
    estimates = state[size : size + agents * m]
    for i in range(agents):
        row = estimates[i * m : (i + 1) * m]
        for r in range(at[i]):
            row[r] = 0.0
        for r in range(at[i + 1], m):
            row[r] = 0.0
    add_from_modes(modes.vectors, state[n:], estimates)
    copy(state[:n], solver.dense[1])
    for line in range(len(method.dense)):
        out = solver.dense[2 + line]
        for r in range(n):
            out[r] = 0.0
        for j in range(STAGES):
            add_multiple(method.dense[line, j], solver.k[j], out)
    for a in range(states):
        solver.greatest[a] = magnitude(states, state, solver, a)
    progress.start = progress.end
    progress.end += h
    progress.accepted += 1.0


@kernel
def step_on(fixed, run, state):
    """Take one accepted step from its end; False, with the exit latched, if there is none."""
    progress, monitor = run.progress, run.monitor
    time = progress.end
    if not control_step(fixed, run, time, state, monitor, run.u):
        return False
    monitor.steps = progress.accepted
    linearise(fixed, state, run.u, run.work, run.solver.system)
    h, retried = progress.next, False
    while True:
        smallest = SMALLEST * max(EARLY, time)
        if not h > smallest:
            h = smallest
        error = try_step(fixed, run, time, h, state)
        if error <= 1.0:
            break
        if h == smallest:
            why = run.exit
            if why.exit == watch.DIVERGED:
                look_ahead(fixed, run, time, h, state)
            watch.leave(
                monitor, int(why.exit), time, why.exit_agent, why.exit_constraint,
                why.exit_value, why.exit_stage,
            )  # fmt: skip
            return False
        progress.rejected += 1.0
        retried = True
        h *= max(SHRINK, SAFETY * error**-POWER) if error < np.inf else 0.5
    accept(fixed, run, h, state)
    error = max(error, 1e-12)
    factor = min(GROW, SAFETY * error**-POWER)
    if progress.last_step > 0.0:
        trend = SAFETY * h / progress.last_step
        factor = min(factor, trend * (progress.last_error / error**2) ** POWER)
    factor = max(factor, SHRINK)
    progress.next = h * (min(factor, 1.0) if retried else factor)
    progress.last_step = h
    progress.last_error = max(error, 0.01)
    return True


@kernel
def interpolate(progress, time, dense, out):
    """Fill out (n,) with states and memory at a time in the last accepted step."""
    length = progress.end - progress.start
    theta = (time - progress.start) / length if length > 0.0 else 1.0
    rest = 1.0 - theta
    for r in range(len(out)):
        bend = dense[2, r] + theta * (dense[3, r] + theta * dense[4, r])
        out[r] = rest * dense[0, r] + theta * (dense[1, r] + rest * bend)


@cache
def build() -> tuple[Any, Any]:
    """The native loop and its last observation, for all agents and games."""
    source = source_key()

    @compiled
    def advance(parameter_block, workspace, solver, step, every, state, rows):
        """Fill rows, each followed by ``every`` sample steps; how many, and the step then."""
        _ = source
        fixed, run = run_in(parameter_block, workspace, solver)
        progress, monitor, period = run.progress, run.monitor, clock_in(parameter_block).h
        for sample in range(len(rows.u)):
            row, time = rows.state[sample], step * period
            interpolate(progress, time, solver.dense, row)
            # Outside between two states inside is the interpolation's doing and ends no run.
            latch = run.exit if progress.end > 0.0 else monitor
            if not control_step(fixed, run, time, row, latch, rows.u[sample]):
                if progress.end == 0.0:
                    return sample, step
                for r in range(len(run.u)):
                    rows.u[sample, r] = np.nan
            monitor.steps = progress.accepted
            time = (step + every) * period
            while progress.end < time:
                if not step_on(fixed, run, state):
                    return sample + 1, step
            step += every
        return len(rows.u), step

    @compiled
    def finish(parameter_block, workspace, solver, time, rows):
        _ = source
        fixed, run = run_in(parameter_block, workspace, solver)
        row, u, progress = rows.state[0], rows.u[0], run.progress
        interpolate(progress, time, solver.dense, row)
        latch = run.exit if progress.end > 0.0 else run.monitor
        if not control_step(fixed, run, time, row, latch, u):
            for r in range(len(u)):
                u[r] = np.nan
        run.monitor.steps = progress.accepted

    return advance, finish


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
    ) -> None:
        self._advance, self._finish = build()
        self._agents, self._shape = agents, state.shape
        data, m = setup.problem.data, len(state)
        constraints = len(data.member_pointer) - 1
        modes = modes_of(graph, np.repeat(np.arange(graph.agents), np.diff(data.offsets)))
        self._length, self._estimates = state.size + len(memory), graph.agents * m
        self._take(setup)
        self._h = setup.clock.h
        self._step = 0
        self._state = self._flat(modes, state, memory)
        sizes = {"m": m, "p": constraints, "agents": graph.agents}
        self._workspace = np.zeros(_length(*sizes.values()))
        workspace = by_name(self._workspace, dtype_of(Workspace, **sizes, **_SCRATCH))
        self._progress, self.monitor = workspace, workspace.monitor
        self._solver = RosenbrockState(
            trial=np.zeros_like(self._state),
            k=np.zeros((STAGES, len(self._state))),
            dense=np.zeros((5, self._length)),
            greatest=np.abs(state).max(axis=0),
            u=np.zeros(m),
            system=stage_system(input_columns(agents.kind, agents.parameters), graph.agents),
            modes=modes,
            method=method(rtol, atol),
        )
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
            done, self._step = self._advance(
                self._parameter_block.address,
                self._workspace,
                self._solver,
                self._step,
                every,
                self._state,
                rows,
            )
        return self._samples(rows.state[:done], rows.u[:done])

    def finish(self) -> Samples:
        """See the base class."""
        rows = self._rows(1)
        self._finish(self._parameter_block.address, self._workspace, self._solver, self.time, rows)
        return self._samples(*rows)

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
