"""The closed loop of ODE agents with adaptive steps of an explicit pair: integrator ``tsit5``.

Mode continuous: the law (and the rates of its memory) are evaluated at every stage, never outside
the set. A step of which a stage lies outside, or whose error is too great, is taken back and a
shorter one tried, down to the shortest piece of a timestep (:mod:`gne_mj.loops.division`). Rows at
sample times come from the steps' dense output, so that steps depend neither on them nor on how a
run is divided into calls; the monitor sees the start of every step and every row.
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers.settings import GUARDED, OUTSIDE
from gne_mj.loops import division, faultless, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.adaptive_step import (
    FIRST_RATE,
    LAST_RATE,
    NO_RATE,
    between,
    grow,
    lesser_outputs,
    weighted_error,
    workspace_in,
    workspace_length,
    workspaces_of,
)
from gne_mj.loops.base import Present
from gne_mj.loops.layout import RTOL, Instant, Setup, parts_in, steps_in
from gne_mj.loops.ode import LOOP, control_step
from gne_mj.loops.one_loop import Native, OneLoop
from gne_mj.loops.recorder import next_row, record
from gne_mj.loops.tsitouras import NODES, STAGES, difference, next_length, stage_state
from gne_mj.native import callback, copy, kernel, source_key
from gne_mj.parameter_block import floats, floats_at
from gne_mj.plants import functions as agents_functions

TSIT5 = 2  # beside the methods of plants alone, EULER and RK4
SHORTEST = division.SHARES[division.FINEST]  # of a timestep, unless an exit is looked into


@kernel
def rates_at(parts, stage, state, vectors):
    """Fill the rates at a stage, whose flat state is given, under the input in work.u."""
    out, size = vectors.rates[stage], parts.channels.equilibrium_state.size
    agents_functions.rates(parts.channels, stage, state, parts.work.u, vectors.spare, out)
    functions.rate(parts.problem, parts.work.y, state[size:], out[size:])


@kernel
def try_step(faults, place, parts, vectors, pace, rtol, step):
    """Fill the trial with the flat state a step on; its weighted error, infinite if a stage is
    outside, where the exit is latched."""
    h, work, problem, trial = pace.length, parts.work, parts.problem, vectors.trial
    size = parts.channels.equilibrium_state.size
    for stage in range(1, STAGES):
        stage_state(stage, h, vectors.state, vectors.rates, trial)
        at = Instant(pace.end + NODES[stage] * h, step, stage)
        if not control_step(faults, place, parts, at, 0.0, trial, trial[size:]):
            return np.inf
        rates_at(parts, stage, trial, vectors)
    difference(h, vectors.rates, vectors.error)
    lesser_outputs(parts.channels, vectors, work.y, work.profile)
    for k in range(len(work.g)):
        vectors.less[k] = games.constraint(problem.data, k, work.profile)
    slacks = len(work.g) if problem.settings[OUTSIDE] == 0.0 else 0  # which a barrier depends on
    error = weighted_error(rtol, parts, vectors, slacks)
    return error if error < np.inf else np.inf


@kernel
def goes_on(faults, parts, pace, length, h):
    """Whether a step of so many s that failed may be tried again; if not, the end is latched.

    As :func:`gne_mj.loops.division.halve` has it: where the law measures what its barrier keeps
    inside, it is the step that fails; elsewhere an exit may be the law's own, which shorter steps
    tell.

    Args:
        faults: module of kernels.
        parts: of the loop.
        pace: of the run.
        length: of the step in s.
        h: the timestep in s.
    """
    problem, work, monitor = parts.problem, parts.work, parts.monitor
    left = monitor.exit == watch.LEFT_SET
    obeyed = True
    for r in range(len(work.u)):
        obeyed &= work.u[r] == work.commanded[r]
    guarded = obeyed and problem.settings[GUARDED] > 0.0 and faults.measured(problem)
    doubtful = (left and obeyed and not guarded) or length < h * SHORTEST
    deeper = doubtful and length > h * division.SHARES[division.DEEPEST]
    if length > h * SHORTEST or (deeper and pace.deep < division.PIECES):
        watch.forget_exit(monitor)
        return True
    which, most, start = 0, 0.0, work.stages.g  # the slack that has changed most
    for k in range(len(work.g)):
        slack = -start[k] - problem.data.tightening[k]
        part = abs(work.g[k] - start[k]) / slack
        if not part <= most:
            which, most = k, part
    if left and (guarded or deeper):
        which = int(monitor.exit_constraint)
        watch.forget_exit(monitor)
    watch.leave(monitor, watch.STEP_TOO_SMALL, pace.end, -1, which, start[which], 0)
    return False


@kernel
def step_on(faults, place, parts, vectors, pace, rtol, step):
    """Observe the present end and take one step that stands; False, the exit being latched, if
    there is none."""
    channels, state, k, work = parts.channels, vectors.state, vectors.rates, parts.work
    size, h = channels.equilibrium_state.size, parts.clock.h
    storage, at = (
        agents_functions.stored(channels, state, vectors.spare),
        Instant(pace.end, step, 0),
    )
    if not control_step(faults, place, parts, at, storage, state, state[size:]):
        return False
    parts.monitor.steps = pace.accepted
    copy(work.g, work.stages.g[: len(work.g)])
    if pace.known == LAST_RATE:
        copy(k[STAGES - 1], k[0])
    elif pace.known == NO_RATE:
        rates_at(parts, 0, state, vectors)
        grow(vectors.greatest, state, len(work.u), channels.equilibrium_state.shape[1], True)
    pace.known = FIRST_RATE
    while True:
        length = pace.length
        error = try_step(faults, place, parts, vectors, pace, rtol, step)
        pace.length, kept = next_length(length, error, pace.last, pace.failed, h * SHORTEST)
        if error <= 1.0:
            break
        pace.failed = 1.0
        pace.rejected += 1.0
        if not goes_on(faults, parts, pace, length, h):
            return False
    copy(state, vectors.begun)
    copy(vectors.trial, state)
    grow(vectors.greatest, state, len(work.u), channels.equilibrium_state.shape[1], True)
    pace.start, pace.end = pace.end, pace.end + length
    pace.known, pace.last, pace.failed = LAST_RATE, kept, 0.0
    pace.accepted += 1.0
    pace.deep = pace.deep + 1.0 if length < h * SHORTEST else 0.0
    work.division.known = division.LAW
    return True


@kernel
def show(faults, place, parts, vectors, pace, step, block):
    """Observe at a timestep's start, within the last step, and write its row."""
    row, size = vectors.row, parts.channels.equilibrium_state.size
    at = Instant(step * parts.clock.h, step, 0)
    between(pace, at.time, vectors)
    parts.work.division.known = division.NOTHING
    storage = agents_functions.stored(parts.channels, row, vectors.spare)
    if control_step(faults, place, parts, at, storage, row, row[size:]):
        parts.monitor.steps = pace.accepted
    else:
        # Outside between two states inside is the interpolation's doing and ends no run.
        watch.forget_exit(parts.monitor)
        for r in range(len(parts.u)):
            parts.u[r] = np.nan
    if block > 0:
        record(block, faults, parts, step, Present(row[:size], row[size:], row[:0]))


@cache
def build(faults: ModuleType = faultless) -> Any:
    """The native loop of all agents, laws and games: see :func:`gne_mj.loops.ode.build`."""
    source = source_key()

    def advance(parameter_block, address, count):
        _ = source
        sizes = steps_in(parameter_block)
        workspace = workspace_in(floats_at(address, workspace_length(sizes)), sizes)
        parts, progress = parts_in(parameter_block, workspace.loop), workspace.loop.progress
        vectors, pace, rtol = workspace.vectors, workspace.pace, floats(parameter_block, RTOL)[0]
        h, place = parts.clock.h, (address, 0, 0)
        if parts.monitor.exit != watch.INSIDE:
            return 0
        if pace.length == 0.0:
            pace.length = h
        step, block = np.int64(progress.step), np.int64(progress.recorder)
        goal, good = step + count, True
        parts.work.division.known = division.NOTHING
        if count == 0:
            show(faults, place, parts, vectors, pace, step, block)
        while good and step < goal:
            due = np.int64(min(next_row(block), 1.0 * goal))
            if due * h > pace.end:
                good = step_on(faults, place, parts, vectors, pace, rtol, step)
                continue
            if due < goal:
                show(faults, place, parts, vectors, pace, due, block)
            step = due
        progress.step = step
        return 1 if good else 0

    return callback(LOOP, advance)


NATIVE = Native(build, workspace_length, workspaces_of)


class AdaptiveLoop(OneLoop):
    """The closed loop of ODE agents with adaptive steps; arguments are the base class's."""

    native = NATIVE

    @property
    def time(self) -> float:
        """Time of the present state in s: of a run that has ended early, its last step's end."""
        ended = self.monitor.exit != watch.INSIDE
        return float(self._workspace.end) if ended else self._reached

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps stand, and how many were taken back."""
        pace = self._workspace
        return int(pace.accepted), int(pace.rejected)

    def _now(self) -> Any:
        """The state between two steps is interpolated."""
        between(self._workspace, self.time, self._workspace.vectors)
        return self._workspace.vectors.row

    def _adopt(self, setup: Setup) -> None:
        now = self._now().copy()
        self._take(setup)
        vectors, pace = self._workspace.vectors, self._workspace
        # the last step's end lies beyond, by the old
        vectors.state[:] = vectors.begun[:] = now
        pace.start = pace.end = self.time
        pace.length = pace.known = pace.last = pace.failed = 0.0
