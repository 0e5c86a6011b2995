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
from numba import types
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
    steps_in,
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
from gne_mj.native import (
    address_in,
    call_integer,
    call_number,
    callback,
    compiled,
    copy,
    kernel,
    source_key,
)
from gne_mj.numbers import Numbers, names_of, numbers_in
from gne_mj.parameter_block import ParameterBlock, floats_at
from gne_mj.plants import functions as agents_functions
from gne_mj.plants.agents import Agents, input_columns
from gne_mj.records import arrays, by_name, dtype_of, in_array, in_parameter_block

# How the step is chosen: Gustafsson's predictive controller with the figures of Hairer's RODAS.
SAFETY, GROW, SHRINK = 0.9, 6.0, 0.2
POWER = 1.0 / ORDER
# Step in s, relative to the time from EARLY on, below which a run ends; and how far beyond it is
# looked whether the boundary is why, relative to the time from 1 s on
SMALLEST, EARLY = 1e-12, 1e-6
AHEAD = 1e-6
_whole, _real = types.int64, types.float64


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
    """Arrays that a step works on, as a parameter block of their own; n entries each."""

    functions: Annotated[np.ndarray, "n", int]  # addresses, in the order below
    state: Annotated[np.ndarray, "n"]  # the flat vector
    trial: Annotated[np.ndarray, "n"]  # at a stage
    k: Annotated[np.ndarray, "stages, n // stages"]
    # states and memory: what the dense output of the last accepted step needs
    dense: Annotated[np.ndarray, "5, n // 5"]
    greatest: Annotated[np.ndarray, "n"]  # each state's greatest magnitude so far
    u: Annotated[np.ndarray, "n"]  # input at a stage
    system: StageSystem
    modes: Modes  # read-only
    method: Method  # read-only


ACT, OBSERVE, SOLVE_STAGE, TRY_STEP = range(4)
_solver_in = in_parameter_block(RosenbrockState, stages=STAGES)
_exit_in, _EXIT_LENGTH = numbers_in(watch.MonitorNumbers), len(names_of(watch.MonitorNumbers))


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


class Place(NamedTuple):
    """Addresses of where a run's numbers lie."""

    parameter_block: int
    workspace: int
    solver: int


class Run(NamedTuple):
    """What kernels of a run change."""

    progress: Steps
    monitor: watch.MonitorNumbers
    figures: watch.Monitor
    exit: watch.MonitorNumbers
    u: np.ndarray
    work: StepScratch
    solver: RosenbrockState
    place: Place


@kernel
def run_in(parameter_block, workspace, solver):
    """What does not change in a run, and what does, from the addresses of where it lies."""
    steps = steps_in(parameter_block)
    arrays = _solver_in(solver, steps.agents, steps.actions, steps.states)
    fixed = Fixed(
        problem_in(parameter_block), channels_in(parameter_block), arrays.modes, arrays.method
    )
    sizes = steps.actions, steps.constraints, steps.agents
    found = _workspace_in(floats_at(workspace, _length(*sizes)), 0, *sizes)
    return fixed, Run(
        found.progress, found.monitor.numbers, found.monitor, found.exit, found.u, found.work,
        arrays, Place(parameter_block, workspace, solver),
    )  # fmt: skip


@kernel
def act(run, time, stage, state, latch, u):
    """Measure and act; fill u. False, with the exit in ``latch``, if there is no input."""
    good = call_integer(
        run.solver.functions[ACT],
        (
            run.place.parameter_block, run.place.workspace, run.place.solver, time, stage,
            address_in(state), address_in(latch), address_in(u),
        ),
    )  # fmt: skip
    return good != 0


@kernel
def control_step(run, time, state, latch, u):
    """The same, and observe."""
    good = call_integer(
        run.solver.functions[OBSERVE],
        (
            run.place.parameter_block, run.place.workspace, run.place.solver, time,
            address_in(state), address_in(latch), address_in(u),
        ),
    )  # fmt: skip
    return good != 0


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
        allowed = method.tolerance[1] + method.tolerance[0] * magnitude(states, state, solver, a)
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
def step_to_trial(fixed, run, time, h):
    """Fill trial with the flat vector after a step of length h; return its weighted error.

    The error is infinite, and run.exit says why, if a stage or the new state is not inside.
    """
    problem, channels, method = fixed.problem, fixed.channels, fixed.method
    solver, agents = run.solver, len(problem.data.offsets) - 1
    state, trial, k, place = solver.state, solver.trial, solver.k, run.place
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
        if stage > 0 and not act(run, time, stage, trial, run.exit, solver.u):
            return np.inf
        if stage < STAGES:
            call_integer(
                solver.functions[SOLVE_STAGE],
                (place.parameter_block, place.workspace, place.solver, h, stage),
            )
    states = channels.equilibrium_state.shape[1]
    error = error_of(channels.output, agents, method, states, trial, solver)
    if not error <= 1.0:  # latched only if the run ends here
        watch.leave(run.exit, watch.DIVERGED, time, -1, -1, error, STAGES)
    return error


@kernel
def look_ahead(run, time, h):
    """Tell in run.exit if the boundary is why even the smallest step has failed.

    Next to the boundary the demand grows so fast that no step is accurate. The trial vector is
    moved on along the step of length h, until it is outside or a microsecond away.
    """
    state, trial = run.solver.state, run.solver.trial
    while h < AHEAD * max(1.0, time):
        h *= 2.0
        for r in range(len(trial)):
            trial[r] += trial[r] - state[r]
        why = run.exit.exit
        run.exit.exit = watch.INSIDE
        good = act(run, time, STAGES, trial, run.exit, run.solver.u)
        if not good and run.exit.exit != watch.DIVERGED:
            return
        run.exit.exit = why


@kernel
def accept(fixed, run, h):
    """Move to the trial state, and keep what the dense output of the step needs."""
    problem, channels, modes, method = fixed.problem, fixed.channels, fixed.modes, fixed.method
    progress, solver = run.progress, run.solver
    at, states, state = problem.data.offsets, channels.equilibrium_state.shape[1], solver.state
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
def step_on(fixed, run):
    """Take one accepted step from its end; False, with the exit latched, if there is none."""
    progress, monitor, state = run.progress, run.monitor, run.solver.state
    time = progress.end
    if not control_step(run, time, state, monitor, run.u):
        return False
    monitor.steps = progress.accepted
    linearise(fixed, state, run.u, run.work, run.solver.system)
    h, retried = progress.next, False
    while True:
        smallest = SMALLEST * max(EARLY, time)
        if not h > smallest:
            h = smallest
        error = call_number(
            run.solver.functions[TRY_STEP],
            (run.place.parameter_block, run.place.workspace, run.place.solver, time, h),
        )
        if error <= 1.0:
            break
        if h == smallest:
            why = run.exit
            if why.exit == watch.DIVERGED:
                look_ahead(run, time, h)
            watch.leave(
                monitor, int(why.exit), time, why.exit_agent, why.exit_constraint,
                why.exit_value, why.exit_stage,
            )  # fmt: skip
            return False
        progress.rejected += 1.0
        retried = True
        h *= max(SHRINK, SAFETY * error**-POWER) if error < np.inf else 0.5
    accept(fixed, run, h)
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
            _exit_in(floats_at(latch, _EXIT_LENGTH), 0), floats_at(u, len(y)),
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
            positions.observe(fixed.problem, fixed.channels, run.work, run.monitor, time, vector)
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


@cache
def build() -> Any:
    """The native loop, for all agents and games."""
    source = source_key()

    @compiled
    def advance(place, step, every, rows):
        """Fill rows, each followed by ``every`` sample steps; how many, and the step then."""
        _ = source
        fixed, run = run_in(place.parameter_block, place.workspace, place.solver)
        progress, monitor, period = run.progress, run.monitor, clock_in(place.parameter_block).h
        for sample in range(len(rows.u)):
            row, time = rows.state[sample], step * period
            interpolate(progress, time, run.solver.dense, row)
            # Outside between two states inside is the interpolation's doing and ends no run.
            latch = run.exit if progress.end > 0.0 else monitor
            if not control_step(run, time, row, latch, rows.u[sample]):
                if progress.end == 0.0:
                    return sample, step
                for r in range(len(run.u)):
                    rows.u[sample, r] = np.nan
            monitor.steps = progress.accepted
            time = (step + every) * period
            while progress.end < time:
                if not step_on(fixed, run):
                    return sample + 1, step
            step += every
        return len(rows.u), step

    return advance


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
        self._advance = build()
        self._agents, self._shape = agents, state.shape
        data, m = setup.problem.data, len(state)
        constraints = len(data.member_pointer) - 1
        modes = modes_of(graph, np.repeat(np.arange(graph.agents), np.diff(data.offsets)))
        self._length, self._estimates = state.size + len(memory), graph.agents * m
        self._h = setup.clock.h
        self._step = 0
        self._state = self._flat(modes, state, memory)
        sizes = {"m": m, "p": constraints, "agents": graph.agents}
        self._workspace = np.zeros(_length(*sizes.values()))
        workspace = by_name(self._workspace, dtype_of(Workspace, **sizes, **_SCRATCH))
        self._progress, self.monitor, self._exit = workspace, workspace.monitor, workspace.exit
        self._solver = RosenbrockState(
            functions=np.array([each.address for each in parts()]),
            state=self._state,
            trial=np.zeros_like(self._state),
            k=np.zeros((STAGES, len(self._state))),
            dense=np.zeros((5, self._length)),
            greatest=np.abs(state).max(axis=0),
            u=np.zeros(m),
            system=stage_system(input_columns(agents.kind, agents.parameters), graph.agents),
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
            done, self._step = self._advance(self._place, self._step, every, rows)
        return self._samples(rows.state[:done], rows.u[:done])

    def finish(self) -> Samples:
        """See the base class."""
        rows, progress = self._rows(1), self._progress
        (row,), (u,) = rows
        interpolate(progress, self.time, self._solver.dense, row)
        latch = self._exit if progress.end > 0.0 else self.monitor
        where = (*self._place, self.time, address_in(row), address_in(latch), address_in(u))
        if not call_integer(self._solver.functions[OBSERVE], where):
            u[:] = np.nan
        self.monitor.steps = progress.accepted
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
