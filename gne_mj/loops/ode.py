"""The fixed-step closed loop of ODE agents: any law, any agents, Runge-Kutta 4 or Euler.

In mode `continuous` the law (and the rates of its memory) are evaluated at every stage of the
integrator. In the held modes, `sampled` and `implicit`, an input is found once per control period
and held; at the next control instant the law's memory first moves exactly over the period that has
passed, with the outputs held at their values at the period's start.
"""

from functools import cache
from types import ModuleType
from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.loops import division, faultless, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Present
from gne_mj.loops.feedback import explicit_law, inside
from gne_mj.loops.layout import (
    Instant,
    Setup,
    Workspace,
    parts_in,
    steps_in,
)
from gne_mj.loops.one_loop import Native, OneLoop, laid_out
from gne_mj.loops.recorder import record
from gne_mj.native import address_in, callback, copy, kernel, source_key
from gne_mj.parameter_block import floats_at
from gne_mj.plants import functions as agents_functions
from gne_mj.plants.functions import EULER, RK4

LOOP = types.int64(types.int64, types.int64, types.int64)

CONTINUOUS, SAMPLED, IMPLICIT = range(3)


@kernel
def measure(channels, state, y):
    """Fill y (m,) with the outputs of a flat state: the channels' states, then the memory."""
    states = channels.equilibrium_state.shape[1]
    for r in range(len(y)):
        y[r] = state[r * states + channels.output]


@kernel
def look(faults, place, parts, at, known, state):
    """Measure unless outputs are known; False, with the exit latched, if they are outside or agents
    are not kept apart."""
    work = parts.work
    if known == division.NOTHING:
        measure(parts.channels, state, work.y)
        if not inside(parts.problem, at.time, max(at.stage, 0), work.y, work, parts.monitor):
            return False
    return faults.keep_apart(parts.problem, place, at, state)


@kernel
def control_step(faults, place, parts, at, storage, state, memory):
    """Measure and act at a stage of a step, and at its start (stage 0) observe; fill work.u.

    At the end of a piece of a step, mode continuous, what the next piece begins with is evaluated
    and kept: outputs and slacks, and the law where its action does not depend on the step.
    One kernel for all stages keeps loops small: that is most of their speed, and of compile time.

    Args:
        faults: :mod:`gne_mj.loops.faultless` or one of those in its place.
        place: see :func:`gne_mj.loops.functions.act`.
        parts: of the loop; its input is changed at stage 0.
        at: when; stages but the start, and division.END, are in mode continuous only.
        storage: V^{x*} of the agents now; read at stage 0.
        state, memory: there, flat; own actions are written into the law's memory, and in the held
            modes it moves on when a control period has passed.

    Returns:
        False if the run must end; the exit is then latched in the monitor.
    """
    problem, clock, work, monitor = parts.problem, parts.clock, parts.work, parts.monitor
    divided, stage = work.division, max(at.stage, 0)
    known = divided.known if at.stage == 0 else float(division.NOTHING)
    divided.known = division.NOTHING
    instant = clock.mode == CONTINUOUS or faults.begins(clock, work.now, at.step)
    if not look(faults, place, parts, at, known, state):
        if not instant:
            monitor.exit_between = 1.0
        return False
    if at.stage == division.END and not faults.PREDICTION_KNOWN:
        divided.known = division.OUTPUTS
        return True
    if instant and known != division.LAW:
        if clock.mode != CONTINUOUS and work.now.memory_step < at.step:  # a period has passed
            faults.elapse(problem, at.step, work, memory)
            work.now.memory_step = at.step
        faults.begin(parts, at, state, memory)
        work.now.state = address_in(state)
        if clock.mode == IMPLICIT:
            good = functions.act(problem, place, at.time, at.step, state, memory)
        else:
            measurement = faults.sense(problem, work, work.y, work.measurement)
            good = explicit_law(problem, at.time, stage, measurement, memory, work, monitor)
            good = good and faults.push_apart(problem, place, at)
        work.now.state = 0.0  # an address is of no use where a workspace is copied to
        if not good:
            return False
        if at.stage == division.END:
            divided.known = division.LAW
            return True
    if instant:
        faults.deliver(problem, clock, at.step, work)
    else:
        copy(parts.u, work.u)
    if at.stage == 0:
        before = work.u if clock.mode == CONTINUOUS else parts.u
        storage += functions.storage(problem, memory)
        functions.observe_positions(problem, work, monitor, at.time, state)
        watch.observe(monitor, parts.figures, at.time, work, before, work.u, storage)
        copy(work.u, parts.u)
    return True


class Vectors(NamedTuple):
    """What an ODE loop has behind its :class:`Workspace`; states are flat, with the memory."""

    state: Annotated[np.ndarray, "m * states + memory"]
    trial: Annotated[np.ndarray, "m * states + memory"]  # at a stage, or at a piece's end
    begun: Annotated[np.ndarray, "m * states + memory"]  # at the start of a divided step
    rates: Annotated[np.ndarray, "4, m * states + memory"]  # at the stages of a piece
    spare: Annotated[np.ndarray, "max(m, 5 * states)"]  # for the agents' kernels


class OdeWorkspace(NamedTuple):
    """What changes in a run of ODE agents."""

    loop: Workspace
    vectors: Vectors


ode_workspace_length, ode_workspace_in, workspaces_of = laid_out(OdeWorkspace)


@kernel
def stage_state(stage, h, state, k, trial):
    """Fill trial with the flat state at a stage of RK4, given the rates at the stages before it."""
    length = h if stage == 3 else 0.5 * h
    for r in range(len(state)):
        trial[r] = state[r] + length * k[stage - 1, r]


@kernel
def piece_end(faults, parts, step, length, vectors):
    """Fill the trial with the flat state at the end of a piece of so many s, mode continuous."""
    channels, state, trial, k = parts.channels, vectors.state, vectors.trial, vectors.rates
    if parts.clock.method == RK4:
        for r in range(len(state)):
            rise = k[0, r] + 2.0 * k[1, r] + 2.0 * k[2, r] + k[3, r]
            trial[r] = state[r] + length / 6.0 * rise
        return
    applied = faults.push(parts.problem, parts.clock, step, parts.u, parts.work.applied)
    size = channels.equilibrium_state.size
    copy(state[:size], trial[:size])
    agents_functions.roll(channels, EULER, length, 1, trial, applied, vectors.spare)
    for r in range(size, len(state)):  # Euler's method for the memory
        trial[r] = state[r] + length * k[0, r]


@kernel
def rates_at(faults, parts, at, now, vectors):
    """Fill the rates at a stage, whose flat state is ``now``."""
    size, out = parts.channels.equilibrium_state.size, vectors.rates[at.stage]
    work = parts.work
    applied = faults.push(parts.problem, parts.clock, at.step, work.u, work.applied)
    measurement = faults.choose(work.y, work.measurement)
    if parts.clock.method == RK4:
        agents_functions.rates(parts.channels, at.stage, now, applied, vectors.spare, out)
    functions.rate(parts.problem, measurement, now[size:], out[size:])


@kernel
def roll_on(faults, parts, step, state, spare):
    """Move the flat state by a step under the input held."""
    clock = parts.clock
    applied = faults.push(parts.problem, clock, step, parts.u, parts.work.applied)
    agents_functions.roll(parts.channels, clock.method, clock.h, 1, state, applied, spare)


@kernel
def go_to(faults, parts, vectors, step, point, stages):
    """When a stage or the end of a piece is, and its number; fill the trial but at its start."""
    clock, divided = parts.clock, parts.work.division
    time, length = division.begins(divided, step, clock.h), division.piece(divided, clock.h)
    if point == 0:
        return time, point
    if point == stages:
        piece_end(faults, parts, step, length, vectors)
        return division.ends(divided, step, clock.h), division.END
    stage_state(point, length, vectors.state, vectors.rates, vectors.trial)
    return time + (0.5 * length, 0.5 * length, length)[point - 1], point


# What became of a piece: it stands, with its step or before its end; it is taken back; no way on
DONE, UNDER_WAY, AGAIN, ENDED = range(4)


@kernel
def end_piece(faults, parts, vectors, step, stages, good):
    """Judge a piece whose stages were inside, if ``good``, and go on or take it back."""
    clock, divided, problem, work = parts.clock, parts.work.division, parts.problem, parts.work
    length, which = division.piece(divided, clock.h), 0
    if good:
        which = division.judge(stages, length, problem, work)
        if which < 0:
            return DONE if division.go_on(divided, clock.h, parts.monitor) else UNDER_WAY
    if divided.position == 0.0:
        copy(vectors.state, vectors.begun)
    if division.halve(faults, step, clock.h, which, problem, work, parts.monitor):
        return AGAIN
    copy(vectors.begun, vectors.state)
    return ENDED


@cache
def build(faults: ModuleType = faultless) -> Any:
    """The native loop of all agents, laws and games: a C function.

    It takes the addresses of a run's parameter block and workspace, and moves the run on by so many
    steps, or, if that is 0, observes the present state without moving on. It returns 0 once the run
    has left, else 1.
    """
    source = source_key()

    def advance(parameter_block, address, count):
        _ = source
        sizes = steps_in(parameter_block)
        workspace = ode_workspace_in(floats_at(address, ode_workspace_length(sizes)), sizes)
        parts, progress = parts_in(parameter_block, workspace.loop), workspace.loop.progress
        clock, divided, given = parts.clock, parts.work.division, workspace.vectors
        size = parts.channels.equilibrium_state.size
        if parts.monitor.exit != watch.INSIDE:
            return 0
        state, trial, spare = given.state, given.trial, given.spare
        step, block = np.int64(progress.step), np.int64(progress.recorder)
        moving = clock.mode == CONTINUOUS and count > 0
        stages, swapped, done, good = 4 if moving and clock.method == RK4 else 1, False, 0, True
        divided.known = division.NOTHING
        while good:
            if divided.position == 0.0 and divided.level > 0.0:
                copy(state, given.begun)
            vectors, stage = Vectors(state, trial, given.begun, given.rates, spare), 0
            storage = agents_functions.stored(parts.channels, state, spare)
            for point in range(stages + 1 if moving else 1):
                time, stage = go_to(faults, parts, vectors, step, point, stages)
                at, now = Instant(time, step, stage), state if point == 0 else trial
                good = control_step(faults, (address, 0, 0), parts, at, storage, now, now[size:])
                if not good:
                    break
                if stage == 0 and block > 0 and divided.position == 0.0:
                    start = Present(state[:size], state[size:], state[:0])
                    record(block, faults, parts, step, start)
                if moving and point < stages:
                    division.note(stage, parts.problem, parts.work)
                    rates_at(faults, parts, at, now, vectors)
            if count == 0 or (not good and stage == 0):
                break
            result = DONE
            if moving:
                result = end_piece(faults, parts, vectors, step, stages, good)
                good = result != ENDED
            else:
                roll_on(faults, parts, step, state, spare)
            if moving and result <= UNDER_WAY:
                state, trial, swapped = trial, state, not swapped
            if result == DONE:
                step, done = step + 1, done + 1
                if done == count:
                    break
        if swapped:
            copy(state, trial)
        progress.step = step
        return 1 if good else 0

    return callback(LOOP, advance)


NATIVE = Native(build, ode_workspace_length, workspaces_of)


class OdeLoop(OneLoop):
    """The closed loop of ODE agents with a fixed step; arguments are the base class's."""

    native = NATIVE

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._reached

    def _now(self) -> NDArray[np.float64]:
        now: NDArray[np.float64] = self._workspace.vectors.state
        return now

    def _adopt(self, setup: Setup) -> None:
        self._take(setup)
