"""The fixed-step closed loop of ODE agents: any law, any agents, Runge-Kutta 4 or Euler.

In mode `continuous` the law (and the rates of its memory) are evaluated at every stage of the
integrator. In the held modes, `sampled` and `implicit`, an input is found once per control period
and held; at the next control instant the law's memory first moves exactly over the period that has
passed, with the outputs held at their values at the period's start.
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.loops import division, faultless, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.feedback import explicit_law, inside
from gne_mj.loops.layout import (
    RECORDER,
    STEP_NOW,
    Setup,
    channels_in,
    clock_in,
    ode_table,
    parts_of,
    problem_in,
    room_needed,
    steps_in,
    steps_of,
)
from gne_mj.loops.recorder import Recorder, record
from gne_mj.native import callback, copy, kernel, shaped, source_key
from gne_mj.plants import functions as agents_functions
from gne_mj.plants.agents import Agents
from gne_mj.plants.functions import EULER, RK4
from gne_mj.table import floats_at

LOOP = types.int64(types.int64, types.int64, types.int64)

# Rates at four stages, a trial state, the state at the start of a divided step, and scratch
SCRATCH_ROWS = 7

CONTINUOUS, SAMPLED, IMPLICIT = range(3)


@kernel
def measure(channels, state, y):
    """Fill y (m,) with the outputs of a flat state: the channels' states, then the memory."""
    states = channels.rest.shape[1]
    for r in range(len(y)):
        y[r] = state[r * states + channels.output]


@kernel
def look(
    faults, place, problem, channels, clock, time, step, stage, storage, state, memory, u, monitor,
    work,
):  # fmt: skip
    """Measure and act at a stage of a step, and at its start (stage 0) observe; fill work.u.

    At the end of a piece of a step, mode continuous, what the next piece begins with is evaluated
    and kept: outputs and slacks, and the law where its action does not depend on the step.

    One kernel for all stages keeps loops and MuJoCo's callback small, which is most of their speed
    and of the time to compile them.

    Args:
        faults: :mod:`gne_mj.loops.faultless` or :mod:`gne_mj.loops.faults`.
        place: see :func:`gne_mj.loops.functions.act`.
        problem, channels, clock: as the loop has them.
        time: at the stage, in s.
        step: which step this is.
        stage: 0 at its start; later ones, and division.END, in mode continuous only.
        storage: V^{x*} of the agents now; read at stage 0.
        state: flat, channel after channel, at the stage.
        memory: the law's at the stage; own actions are written into it, and in the held modes it
            moves on when a control period has passed.
        u: (m,) input that acts; changed at stage 0.
        monitor, work: changed.

    Returns:
        False if the run must end; the exit is then latched in the monitor.
    """
    y = work.y
    known = work.division[division.KNOWN] if stage == 0 else float(division.NOTHING)
    work.division[division.KNOWN] = division.NOTHING
    instant = clock.mode == CONTINUOUS or step % clock.period == 0
    if known == division.NOTHING:
        measure(channels, state, y)
        if not inside(problem, time, max(stage, 0), y, work, monitor):
            if not instant:
                monitor[watch.EXIT_BETWEEN] = 1.0
            return False
    if stage == division.END and not faults.KNOWN_AHEAD:
        work.division[division.KNOWN] = division.OUTPUTS
        return True
    if known == division.LAW:
        faults.deliver(problem, clock, step, stage, work)
    elif instant:
        if clock.mode != CONTINUOUS and work.stands[0] < step:  # a control period has passed
            functions.propagate(problem, work.held, memory, work.scratch)
            work.stands[0] = step
        faults.begin(channels, problem, clock, step, stage, state, memory, work)
        if clock.mode == IMPLICIT:
            good = functions.act(problem, place, time, step, state, memory)
        else:
            seen = faults.sense(problem, clock, step, stage, work, y, work.seen)
            good = explicit_law(problem, time, max(stage, 0), seen, memory, work, monitor)
        if not good:
            return False
        if stage == division.END:
            work.division[division.KNOWN] = division.LAW
            return True
        faults.deliver(problem, clock, step, stage, work)
    else:
        copy(u, work.u)
    if stage == 0:
        before = work.u if clock.mode == CONTINUOUS else u
        storage += functions.storage(problem, memory)
        watch.observe(monitor, time, y, work.g, work.demand, before, work.u, storage)
        copy(work.u, u)
    return True


@kernel
def stage_state(stage, h, state, k, trial):
    """Fill trial with the flat state at a stage of RK4, given the rates at the stages before it."""
    length = h if stage == 3 else 0.5 * h
    for r in range(len(state)):
        trial[r] = state[r] + length * k[stage - 1, r]


@kernel
def piece_end(
    faults, problem, channels, clock, step, length, u, state, k, trial, scratch, work
):  # fmt: skip
    """Fill trial with the flat state at the end of a piece, mode continuous.

    Args:
        length: of the piece, in s.
        u: (m,) inputs at its start.
        state: flat, at its start.
        k: (4, ...) rates at its stages.
        scratch: overwritten.
    """
    if clock.method == RK4:
        for r in range(len(state)):
            rise = k[0, r] + 2.0 * k[1, r] + 2.0 * k[2, r] + k[3, r]
            trial[r] = state[r] + length / 6.0 * rise
        return
    acts = faults.push(problem, clock, step, u, work.acts)
    size = channels.rest.size
    copy(state[:size], trial[:size])
    agents_functions.roll(channels, EULER, length, 1, trial, acts, scratch)
    for r in range(size, len(state)):  # Euler's method for the memory
        trial[r] = state[r] + length * k[0, r]


@cache
def build(faults: ModuleType = faultless) -> Any:
    """The native loop of all agents, laws and games: a C function.

    It takes the addresses of a run's table and room, and moves the run on by so many steps, or,
    if that is 0, observes the present state without moving on. It returns 0 once the run has left,
    else 1. Behind the room's other parts are [flat state, memory, scratch].
    """
    source = source_key()

    def advance(table, address, count):
        _ = source
        sizes = steps_in(table)
        m, states = sizes.actions, sizes.states
        size, n = m * states, m * states + sizes.memory
        room = floats_at(address, room_length(sizes))
        problem, clock, channels = problem_in(table), clock_in(table), channels_in(table)
        monitor, u, work, rest = parts_of(room, 0, sizes)
        if monitor[watch.EXIT] != watch.INSIDE:
            return 0
        state, scratch, h = rest[:n], rest[n:], clock.h
        width = len(scratch) // SCRATCH_ROWS
        # of the state's own length, so that the memory behind the channels has its own too
        k, trial = shaped(scratch, (4, width)), scratch[4 * width : 4 * width + n]
        begun, spare = scratch[5 * width : 5 * width + n], scratch[6 * width :]
        step, block = np.int64(room[STEP_NOW]), np.int64(room[RECORDER])
        moving = clock.mode == CONTINUOUS and count > 0
        stages = 4 if moving and clock.method == RK4 else 1
        divided, swapped, done, good = work.division, False, 0, True
        divided[division.KNOWN] = division.NOTHING
        while good:
            if divided[division.POSITION] == 0.0 and divided[division.LEVEL] > 0.0:
                copy(state, begun)
            time, length, stage = division.begins(divided, step, h), division.piece(divided, h), 0
            storage = agents_functions.stored(channels, state, spare)
            for point in range(stages + 1 if moving else 1):
                now, stage, at = state, point, time
                if point == stages:
                    piece_end(
                        faults, problem, channels, clock, step, length, u, state, k, trial, spare,
                        work,
                    )  # fmt: skip
                    now, stage, at = trial, division.END, division.ends(divided, step, h)
                elif point > 0:
                    stage_state(point, length, state, k, trial)
                    now, at = trial, time + (0.5 * length, 0.5 * length, length)[point - 1]
                good = look(
                    faults, (address, 0, 0), problem, channels, clock, at, step, stage, storage,
                    now, now[size:], u, monitor, work,
                )  # fmt: skip
                if not good:
                    break
                if stage == 0 and block > 0 and divided[division.POSITION] == 0.0:
                    record(
                        block, faults, channels, problem, clock, step, state[:size], u,
                        state[size:], work, state[:0],
                    )  # fmt: skip
                if moving and point < stages:
                    division.note(stage, problem, work)
                    acts = faults.push(problem, clock, step, work.u, work.acts)
                    seen = faults.choose(work.y, work.seen)
                    if clock.method == RK4:
                        agents_functions.rates(channels, stage, now, acts, spare, k[point])
                    functions.rate(problem, seen, now[size:n], k[point, size:n])
            if count == 0 or (not good and stage == 0):
                break
            if not moving:
                acts = faults.push(problem, clock, step, u, work.acts)
                agents_functions.roll(channels, clock.method, h, 1, state, acts, spare)
                step, done = step + 1, done + 1
                if done == count:
                    break
                continue
            which = division.judge(stages, length, problem, work) if good else 0
            if good and which < 0:
                state, trial, swapped = trial, state, not swapped
                if division.go_on(divided, h, monitor):
                    step, done = step + 1, done + 1
                    if done == count:
                        break
                continue
            if divided[division.POSITION] == 0.0:
                copy(state, begun)
            good = division.halve(faults, step, h, which, problem, work, monitor)
            if not good:
                copy(begun, state)
        if swapped:
            copy(state, trial)
        room[STEP_NOW] = step
        return 1 if good else 0

    return callback(LOOP, advance)


@kernel
def scratch_width(sizes):
    """Entries of each of the SCRATCH_ROWS rows behind state and memory."""
    m, states = sizes.actions, sizes.states
    return max(m * states + sizes.memory, m, 5 * states)


@kernel
def room_length(sizes):
    """Entries of the room of a loop of these sizes, as a table has them."""
    needed = room_needed(
        sizes.actions, sizes.constraints, sizes.agents, sizes.history, sizes.solver
    )
    return (
        needed + sizes.actions * sizes.states + sizes.memory + SCRATCH_ROWS * scratch_width(sizes)
    )


class OdeLoop(ClosedLoop):
    """The closed loop of ODE agents with a fixed step.

    Args:
        agents: the agents.
        setup: what the run is made of.
        state: (m, states) at the start.
        memory: the law's, at the start.
        faults: module of kernels, see :func:`look`.
    """

    def __init__(
        self,
        agents: Agents,
        setup: Setup,
        state: NDArray[np.float64],
        memory: NDArray[np.float64],
        faults: ModuleType = faultless,
    ) -> None:
        self._advance = build(faults).ctypes
        self._agents = agents
        self._table = ode_table(setup, agents, len(memory))
        self._h, self._shape, self._memory = setup.clock.h, state.shape, len(memory)
        self._faulty = faults is not faultless
        sizes = steps_of(self._table)
        self._room = np.zeros(room_length(sizes))
        self.monitor, _u, _work, rest = parts_of(self._room, 0, sizes)
        self._state = rest[: state.size + len(memory)]
        self._state[:] = np.concatenate([state.ravel(), memory])

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return float(self._room[STEP_NOW] * self._h)

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        return self._run(samples, every, samples * every)

    def finish(self) -> Samples:
        """See the base class."""
        rows = self._run(1, 1, 0)
        if len(rows.input):
            return rows
        state, memory, _ = (row[None] for row in self.present())
        none = (np.full((1, row.shape[1]), np.nan) for row in (rows.input, rows.seen, rows.acts))
        u, seen, acts = none
        return Samples(state, u, memory, seen, acts, u[:, :0])

    def present(self) -> Present:
        """See the base class."""
        now, size = self._state.copy(), len(self._state) - self._memory
        return Present(now[:size].reshape(self._shape), now[size:], now[:0])

    def _adopt(self, setup: Setup) -> None:
        self._table = ode_table(setup, self._agents, self._memory)

    def _run(self, rows: int, every: int, steps: int) -> Samples:
        recorder = Recorder(
            1, rows, self._shape, self._memory, self._faulty,
            first=int(self._room[STEP_NOW]), every=every,
        )  # fmt: skip
        if rows > 0:
            self._room[RECORDER] = recorder.addresses[0]
            self._advance(self._table.address, self._room.ctypes.data, steps)
            self._room[RECORDER] = 0.0
        return recorder.samples(0)
