"""Eight runs of ODE agents at once, in lanes: adaptive steps.

Every run has its own time and its own length of step, so that no run waits for another whose step
is taken back. The operations are those of :mod:`gne_mj.loops.adaptive`, in their order, so that
each run's numbers are to the bit those that it has alone. A run whose shortest step fails stays
where it is, and the loop of one run takes it from there.
"""

from functools import cache
from types import ModuleType
from typing import Annotated, Any, NamedTuple

import numpy as np

from gne_mj.lanes import WIDTH, bits_of, lanes, lanes_at, mask_of, where
from gne_mj.loops.adaptive import SHORTEST
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
)
from gne_mj.loops.lane_monitor import observe
from gne_mj.loops.lanes import (
    LANES_LOOP,
    act,
    behind,
    note,
    parts_of,
    rates,
    record,
    stored,
)
from gne_mj.loops.layout import RTOL, steps_in
from gne_mj.loops.tsitouras import STAGES, difference, next_length, stage_state
from gne_mj.native import callback, copy, kernel, source_key


class Shown(NamedTuple):
    """Outputs and constraints of rows, at the place that the monitor's observation has them."""

    y: Annotated[np.ndarray, "m"]
    g: Annotated[np.ndarray, "p"]


class Sight(NamedTuple):
    """What the monitor is shown of rows."""

    stages: Shown


@kernel
def begin(agent, law, game, parts, workspace, scratch):
    """Evaluate what steps begin with, where lanes are; the mask of those where that goes well."""
    work, vectors, pace, rates_now = (
        parts.work,
        workspace.vectors,
        workspace.pace,
        workspace.vectors.row,
    )
    m, states = parts.channels.equilibrium_state.shape
    sound, fresh = act(law, game, parts, vectors.state, states), pace.known == NO_RATE
    note(0, work)
    copy(work.commanded, scratch.asked)
    copy(work.u, workspace.loop.u)
    stored(agent, law, parts, vectors.state, scratch.known)
    rates(agent, law, parts, 0, vectors.state, scratch.known, rates_now)
    first = vectors.rates[0]
    for r in range(len(first)):
        first[r] = where(fresh, rates_now[r], first[r])
    grow(vectors.greatest, vectors.state, m, states, fresh)
    pace.known = where(fresh, FIRST_RATE, pace.known)
    pace.length = where(pace.length == 0.0, parts.clock.h, pace.length)
    return sound


@kernel
def show(agent, law, game, parts, workspace, scratch, runs):
    """Observe the rows that are due within the last steps, and write them."""
    turn, vectors, pace, work = scratch.turn, workspace.vectors, workspace.pace, parts.work
    row, states, monitor = vectors.row, parts.channels.equilibrium_state.shape[1], parts.monitor
    size = len(work.y) * states
    while True:
        time = turn.due * parts.clock.h
        due = (time <= pace.end) & (turn.due < turn.last)
        which = bits_of(due) & runs
        if which == 0:
            return
        between(pace, time, vectors)
        storage = stored(agent, law, parts, row, scratch.known)
        good = act(law, game, parts, row, states)
        seen, u = Sight(Shown(work.y, work.g)), work.u
        observe(parts.figures, time, seen, work.commanded, (u, u), storage, due & good)
        monitor.steps = where(due & good, pace.accepted, monitor.steps)
        for r in range(len(u)):
            u[r] = where(good, u[r], np.nan)
        for lane in range(WIDTH):
            if (which >> lane) & 1:
                record(lane, workspace.loop.progress, turn, row[:size], row[size:], u)


@kernel
def take_stages(agent, law, game, parts, vectors, known, h):
    """Fill the trial with the state a step of h s on; the mask of lanes that stay inside."""
    trial, work, states = vectors.trial, parts.work, parts.channels.equilibrium_state.shape[1]
    good = mask_of(-1)
    for stage in range(1, STAGES):
        stage_state(stage, h, vectors.state, vectors.rates, trial)
        good &= act(law, game, parts, trial, states)
        rates(agent, law, parts, stage, trial, known, vectors.rates[stage])
    difference(h, vectors.rates, vectors.error)
    lesser_outputs(parts.channels, vectors, work.y, work.profile)
    for k in range(len(work.g)):
        vectors.less[k] = game.constraint(parts.problem.data.parameters, k, work.profile)
    return good


@kernel
def choose(pace, error, hard, least):
    """Count steps that stand or are taken back, but for lanes that are ``hard``, and choose the
    next length."""
    good = error <= 1.0
    length, kept = next_length(pace.length, error, pace.last, pace.failed, least)
    deep = where(pace.length < least, pace.deep + 1.0, 0.0)
    pace.deep = where(good, deep, pace.deep)
    pace.start = where(good, pace.end, pace.start)
    pace.end = where(good, pace.end + pace.length, pace.end)
    pace.known = where(good, LAST_RATE, FIRST_RATE)
    pace.accepted = where(good, pace.accepted + 1.0, pace.accepted)
    pace.rejected = where(good | hard, pace.rejected, pace.rejected + 1.0)
    pace.last = where(good, kept, pace.last)
    pace.failed = where(hard, pace.failed, where(good, 0.0, 1.0))
    pace.length = where(hard, pace.length, length)


@kernel
def move(parts, vectors, asked, u, good):
    """Move lanes on to their trial states; the next steps begin with what is evaluated there."""
    work, state, begun, trial = parts.work, vectors.state, vectors.begun, vectors.trial
    stages, (m, states) = work.stages, parts.channels.equilibrium_state.shape
    for r in range(len(state)):
        begun[r] = where(good, state[r], begun[r])
        state[r] = where(good, trial[r], state[r])
    grow(vectors.greatest, trial, m, states, good)
    for r in range(len(u)):
        stages.y[r] = where(good, work.y[r], stages.y[r])
        asked[r] = where(good, work.commanded[r], asked[r])
        u[r] = where(good, work.u[r], u[r])
    for k in range(len(work.g)):
        stages.g[k] = where(good, work.g[k], stages.g[k])


@cache
def build(agent: ModuleType, law: ModuleType, game: ModuleType) -> Any:
    """The loop of eight runs: see :func:`gne_mj.loops.lanes.build`; pieces are steps."""
    source = source_key(agent, law, game)

    def advance(block, address, count, runs):
        _ = source
        s = steps_in(block)
        entries = workspace_length(s)
        workspace = workspace_in(lanes_at(address, entries), s)
        scratch, parts = behind(address, entries, s), parts_of(block, s, workspace.loop)
        pace, turn, vectors, asked = workspace.pace, scratch.turn, workspace.vectors, scratch.asked
        u, progress, h, monitor = (
            workspace.loop.u,
            workspace.loop.progress,
            parts.clock.h,
            parts.monitor,
        )
        rtol, least, k = lanes(block, RTOL)[0], h * SHORTEST, vectors.rates
        first, last = k[0], k[STAGES - 1]
        sound = begin(agent, law, game, parts, workspace, scratch)
        for _step in range(count):
            show(agent, law, game, parts, workspace, scratch, runs)
            done = pace.end >= turn.last * h
            ended = bits_of(done) & runs
            if ended != 0:
                progress.step = where(done, turn.last, progress.step)
                return ended
            storage, fresh = stored(agent, law, parts, vectors.state, scratch.known), pace.known
            for r in range(len(first)):
                first[r] = where(fresh == LAST_RATE, last[r], first[r])
            good = sound & take_stages(agent, law, game, parts, vectors, scratch.known, pace.length)
            error = weighted_error(rtol, parts, vectors, len(parts.work.g))
            error = where(good & (error < np.inf), error, np.inf)
            good = error <= 1.0
            hard = (not good) & ((pace.length <= least) | (not sound))
            observe(parts.figures, pace.end, parts.work, asked, (u, u), storage, good)
            monitor.steps = where(good, pace.accepted, monitor.steps)
            choose(pace, error, hard, least)
            move(parts, vectors, asked, u, good)
            stuck = bits_of(hard) & runs
            if stuck != 0:
                begun = max(progress.step, np.floor(pace.end / h))
                progress.step = where(hard, begun, progress.step)
                return 256 * stuck
        return 0

    return callback(LANES_LOOP, advance)
