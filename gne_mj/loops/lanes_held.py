"""Eight runs of ODE agents at once, in lanes: mode sampled, laws without memory.

As :mod:`gne_mj.loops.lanes` is of mode continuous: the operations are those of
:mod:`gne_mj.loops.ode` in their order, and a run that must end stays where it is for the loop of
one run. Lanes may be at different steps, so that the law is evaluated at every step and taken where
a control period begins.
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from gne_mj.lanes import WIDTH, bits_of, where
from gne_mj.loops.lane_monitor import observe
from gne_mj.loops.lanes import (
    LANES_LOOP,
    act,
    laid_out,
    note,
    record,
    stored,
)
from gne_mj.loops.layout import steps_in
from gne_mj.native import callback, copy, source_key
from gne_mj.plants.functions import hold_step


@cache
def build(agent: ModuleType, law: ModuleType, game: ModuleType) -> Any:
    """The loop of eight runs: see :func:`gne_mj.loops.lanes.build`."""
    source = source_key(agent, law, game)

    def advance(block, address, count, runs):
        _ = source
        s = steps_in(block)
        workspace, scratch, parts = laid_out(block, address, s)
        turn, asked, known = scratch.turn, scratch.asked, scratch.known
        loop, vectors, h = workspace.loop, workspace.vectors, parts.clock.h
        work, u, progress = loop.work, loop.u, loop.progress
        state, trial = vectors.state, vectors.trial
        for _step in range(count):
            storage = stored(agent, law, parts, state, known)
            copy(work.commanded, asked)
            good = act(law, game, parts, state, s.states)
            periods = progress.step / (1.0 * s.period)
            instant = np.floor(periods) == periods
            for r in range(len(u)):
                work.commanded[r] = where(instant & good, work.commanded[r], asked[r])
                work.u[r] = where(instant & good, work.u[r], u[r])
            note(0, work)
            observe(
                loop.monitor, progress.step * h, work, work.commanded, (u, work.u), storage, good
            )
            copy(work.u, u)
            due = bits_of(good & (progress.step == turn.due)) & runs
            for lane in range(WIDTH if due != 0 else 0):
                if (due >> lane) & 1:
                    record(lane, progress, turn, state, state[:0], u)
            copy(state, trial)
            hold_step(
                agent, parts.channels.parameters, s.states, s.method, h, trial, u, vectors.spare
            )
            for r in range(len(state)):
                state[r] = where(good, trial[r], state[r])
            progress.step = where(good, progress.step + 1.0, progress.step)
            hard = bits_of(not good) & runs
            ended = bits_of(progress.step >= turn.last) & runs
            if (ended | hard) != 0:
                return ended + 256 * hard
        return 0

    return callback(LANES_LOOP, advance)
