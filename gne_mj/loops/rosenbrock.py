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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.settings import EPSILON
from gne_mj.graph import Graph
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.estimate_modes import add_from_modes, modes_of, to_modes
from gne_mj.loops.feedback import Problem, feedback, work
from gne_mj.loops.layout import Setup, problem_and_table
from gne_mj.loops.linear import add_multiple
from gne_mj.loops.ode import measure
from gne_mj.loops.rodas import ADDING, ORDER, STAGES, method
from gne_mj.loops.stage_system import StageSystem, linearise, prepare, solve_stage, stage_system
from gne_mj.native import compiled, copy, kernel, source_key
from gne_mj.plants import functions as agents_functions
from gne_mj.plants.agents import Agents, input_columns
from gne_mj.plants.functions import compiled_functions
from gne_mj.plants.ode import Channels

# How the step is chosen: Gustafsson's predictive controller with the figures of Hairer's RODAS.
SAFETY, GROW, SHRINK = 0.9, 6.0, 0.2
POWER = 1.0 / ORDER
# Step in s, relative to the time from EARLY on, below which a run ends; and how far beyond it is
# looked whether the boundary is why, relative to the time from 1 s on
SMALLEST, EARLY = 1e-12, 1e-6
AHEAD = 1e-6

# Entries of a loop's `progress`: the last accepted step runs from START to END.
START, END, NEXT, LAST_STEP, LAST_ERROR, ACCEPTED, REJECTED, COUNT = range(8)


class Solver(NamedTuple):
    """Arrays that a step works on; n is the length of states and memory, w that of the modes."""

    trial: np.ndarray  # (n + w,) the flat vector at a stage
    k: np.ndarray  # (STAGES, n + w)
    dense: np.ndarray  # (5, n) what the dense output of the last accepted step needs
    greatest: np.ndarray  # (states,) each state's greatest magnitude so far
    exit: np.ndarray  # why the last stage failed, as the monitor's header
    u: np.ndarray  # (m,) input at a stage
    system: StageSystem


@kernel
def look(
    problem, channels, time, state, monitor, latch, work, known, u
):  # fmt: skip
    """Measure, act and observe; fill u. False, with the exit in ``latch``, if there is no input."""
    y = work.y
    measure(channels, state, y)
    if not feedback(problem, time, 0, y, state[channels.rest.size :], work, latch, u):
        return False
    storage = agents_functions.stored(channels, state, known)
    watch.observe(monitor, time, y, work.g, work.demand, u, u, storage)
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
def try_step(
    problem, channels, modes, method, states, time, h, state, u, work, solver
):  # fmt: skip
    """Fill trial with the flat vector after a step of length h; return its weighted error.

    The error is infinite, and solver.exit says why, if a stage or the new state is not inside.
    """
    size, agents = len(u) * states, len(problem.data.offsets) - 1
    trial, k = solver.trial, solver.k
    solver.exit[watch.EXIT] = watch.INSIDE
    if not prepare(problem, channels, modes, states, h, solver.system):
        watch.leave(solver.exit, watch.DIVERGED, time, -1, -1, np.inf, 1)
        return np.inf
    copy(u, solver.u)
    for stage in range(STAGES + 1):
        if stage < ADDING:
            copy(state, trial)
            for j in range(stage):
                add_multiple(method.stage[stage, j], k[j], trial)
        else:
            add_multiple(1.0, k[stage - 1], trial)
        if stage > 0:
            measure(channels, trial, work.y)
            if not feedback(
                problem, time, stage, work.y, trial[size:], work, solver.exit,
                solver.u,
            ):  # fmt: skip
                return np.inf
        if stage < STAGES:
            solve_stage(
                problem, channels, modes, method, states, h, stage, trial, solver.u, k,
                solver.system,
            )  # fmt: skip
    error = error_of(channels.output, agents, method, states, trial, solver)
    if not error <= 1.0:  # latched only if the run ends here
        watch.leave(solver.exit, watch.DIVERGED, time, -1, -1, error, STAGES)
    return error


@kernel
def look_ahead(problem, channels, time, h, state, work, solver):
    """Tell in solver.exit if the boundary is why even the smallest step has failed.

    Next to the boundary the demand grows so fast that no step is accurate. The trial vector is
    moved on along the step of length h, until it is outside or a microsecond away.
    """
    y, trial = work.y, solver.trial
    size = channels.rest.size
    while h < AHEAD * max(1.0, time):
        h *= 2.0
        for r in range(len(trial)):
            trial[r] += trial[r] - state[r]
        measure(channels, trial, y)
        why = solver.exit[watch.EXIT]
        solver.exit[watch.EXIT] = watch.INSIDE
        if not feedback(
            problem, time, STAGES, y, trial[size:], work, solver.exit, solver.u
        ) and solver.exit[watch.EXIT] != watch.DIVERGED:  # fmt: skip
            return
        solver.exit[watch.EXIT] = why


@kernel
def accept(problem, modes, method, states, h, progress, state, solver):
    """Move to the trial state, and keep what the dense output of the step needs."""
    at = problem.data.offsets
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
    progress[START] = progress[END]
    progress[END] += h
    progress[ACCEPTED] += 1.0


@kernel
def step_on(
    problem, channels, modes, method, states, progress, state, u, monitor, work, solver,
):  # fmt: skip
    """Take one accepted step from END; False, with the exit latched, if there is none."""
    time = progress[END]
    if not look(
        problem, channels, time, state, monitor, monitor, work, solver.system.known, u
    ):  # fmt: skip
        return False
    monitor[watch.STEPS] = progress[ACCEPTED]
    linearise(problem, channels, states, state, u, work, solver.system)
    h, retried = progress[NEXT], False
    while True:
        smallest = SMALLEST * max(EARLY, time)
        if not h > smallest:
            h = smallest
        error = try_step(
            problem, channels, modes, method, states, time, h, state, u, work, solver,
        )  # fmt: skip
        if error <= 1.0:
            break
        if h == smallest:
            why = solver.exit
            if why[watch.EXIT] == watch.DIVERGED:
                look_ahead(problem, channels, time, h, state, work, solver)
            watch.leave(
                monitor, int(why[watch.EXIT]), time, why[watch.EXIT_AGENT],
                why[watch.EXIT_CONSTRAINT], why[watch.EXIT_VALUE], why[watch.EXIT_STAGE],
            )  # fmt: skip
            return False
        progress[REJECTED] += 1.0
        retried = True
        h *= max(SHRINK, SAFETY * error**-POWER) if error < np.inf else 0.5
    accept(problem, modes, method, states, h, progress, state, solver)
    error = max(error, 1e-12)
    factor = min(GROW, SAFETY * error**-POWER)
    if progress[LAST_STEP] > 0.0:
        trend = SAFETY * h / progress[LAST_STEP]
        factor = min(factor, trend * (progress[LAST_ERROR] / error**2) ** POWER)
    factor = max(factor, SHRINK)
    progress[NEXT] = h * (min(factor, 1.0) if retried else factor)
    progress[LAST_STEP] = h
    progress[LAST_ERROR] = max(error, 0.01)
    return True


@kernel
def interpolate(progress, time, dense, out):
    """Fill out (n,) with states and memory at a time in the last accepted step."""
    length = progress[END] - progress[START]
    theta = (time - progress[START]) / length if length > 0.0 else 1.0
    rest = 1.0 - theta
    for r in range(len(out)):
        bend = dense[2, r] + theta * (dense[3, r] + theta * dense[4, r])
        out[r] = rest * dense[0, r] + theta * (dense[1, r] + rest * bend)


@cache
def build() -> tuple[Any, Any]:
    """The native loop and its last observation, for all agents and games."""
    source = source_key()

    @compiled
    def advance(
        problem, channels, modes, method, clock_step, step, every, progress, state, u, monitor,
        work, solver, samples_state, samples_u,
    ):  # fmt: skip
        _ = source
        states, known = channels.rest.shape[1], solver.system.known
        for sample in range(len(samples_u)):
            row, time = samples_state[sample], step * clock_step
            interpolate(progress, time, solver.dense, row)
            # Outside between two states inside is the interpolation's doing and ends no run.
            latch = solver.exit if progress[END] > 0.0 else monitor
            if not look(
                problem, channels, time, row, monitor, latch, work, known, samples_u[sample],
            ):  # fmt: skip
                if progress[END] == 0.0:
                    return sample, step
                for r in range(len(u)):
                    samples_u[sample, r] = np.nan
            monitor[watch.STEPS] = progress[ACCEPTED]
            time = (step + every) * clock_step
            while progress[END] < time:
                if not step_on(
                    problem, channels, modes, method, states, progress, state, u, monitor, work,
                    solver,
                ):  # fmt: skip
                    return sample + 1, step
            step += every
        return len(samples_u), step

    @compiled
    def finish(problem, channels, time, progress, monitor, work, solver, row, row_u):
        _ = source
        interpolate(progress, time, solver.dense, row)
        latch = solver.exit if progress[END] > 0.0 else monitor
        if not look(problem, channels, time, row, monitor, latch, work, solver.system.known, row_u):
            for r in range(len(row_u)):
                row_u[r] = np.nan
        monitor[watch.STEPS] = progress[ACCEPTED]

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
        self._fixed = (*self._parts(setup), modes, method(rtol, atol))
        self._h = setup.clock.h
        self._step = 0
        self._state = self._flat(state, memory)
        self._progress = np.zeros(COUNT)
        self._u = np.zeros(m)
        self._work = work(m, constraints, graph.agents)
        self._solver = Solver(
            trial=np.zeros_like(self._state),
            k=np.zeros((STAGES, len(self._state))),
            dense=np.zeros((5, self._length)),
            greatest=np.abs(state).max(axis=0),
            exit=np.zeros(watch.HEADER),
            u=np.zeros(m),
            system=stage_system(input_columns(agents.kind, agents.parameters), graph.agents),
        )
        self.monitor = np.zeros(watch.length(m, constraints))
        self._begin()

    def _parts(self, setup: Setup) -> tuple[Problem, Channels]:
        """What the loop reads, and as a table what the law's functions do."""
        kind = self._agents.kind
        memory = self._length - math.prod(self._shape)
        problem, self._table = problem_and_table(setup, self._agents, memory)
        addresses = compiled_functions(kind)
        channels = Channels(self._agents.parameters, setup.rest, addresses, kind.OUTPUT)
        return problem, channels

    def _flat(self, state: NDArray[np.float64], memory: NDArray[np.float64]) -> NDArray[np.float64]:
        modes = self._fixed[2]
        return np.concatenate([state.ravel(), memory, to_modes(modes, memory[: self._estimates])])

    def _begin(self) -> None:
        """Let the next adaptive step be from this state at the present time."""
        problem, dense = self._fixed[0], self._solver.dense
        dense[:2], dense[2:] = self._state[: self._length], 0.0
        self._progress[:ACCEPTED] = 0.0
        self._progress[START] = self._progress[END] = self.time
        self._progress[NEXT] = min(self._h, float(problem.settings[EPSILON]))

    @property
    def time(self) -> float:
        """Time of the present state in s: of a run that has ended early, its last step's end."""
        ended = self.monitor[watch.EXIT] != watch.INSIDE
        return float(self._progress[END]) if ended else self._step * self._h

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps have been accepted, and how many rejected."""
        return int(self._progress[ACCEPTED]), int(self._progress[REJECTED])

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        states, inputs = np.empty((samples, self._length)), np.empty((samples, len(self._u)))
        done = 0
        if self.monitor[watch.EXIT] == watch.INSIDE:
            done, self._step = self._advance(
                *self._fixed, self._h, self._step, every, self._progress, self._state, self._u,
                self.monitor, self._work, self._solver, states, inputs,
            )  # fmt: skip
        return self._samples(states[:done], inputs[:done])

    def finish(self) -> Samples:
        """See the base class."""
        row, u = np.empty((1, self._length)), np.empty((1, len(self._u)))
        self._finish(
            *self._fixed[:2], self.time, self._progress, self.monitor, self._work, self._solver,
            row[0], u[0],
        )  # fmt: skip
        return self._samples(row, u)

    def present(self) -> Present:
        """See the base class; the state between two adaptive steps is interpolated."""
        row, size = np.empty(self._length), self._shape[0] * self._shape[1]
        interpolate(self._progress, self.time, self._solver.dense, row)
        return Present(row[:size].reshape(self._shape), row[size:], row[:0])

    def _adopt(self, setup: Setup) -> None:
        state, memory, _ = self.present()
        self._fixed = (*self._parts(setup), *self._fixed[2:])
        self._state[:] = self._flat(state, memory)  # the last step's end lies beyond, by the old
        self._begin()

    def _samples(self, states: NDArray[np.float64], inputs: NDArray[np.float64]) -> Samples:
        size = self._shape[0] * self._shape[1]
        return Samples(
            state=states[:, :size].reshape(-1, *self._shape),
            input=inputs,
            memory=states[:, size:],
            seen=inputs[:, :0],
            acts=inputs[:, :0],
            configuration=inputs[:, :0],
        )
