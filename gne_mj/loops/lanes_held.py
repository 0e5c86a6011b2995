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

from gne_mj.lanes import WIDTH, bits_of, lanes, lanes_at, where
from gne_mj.loops.lane_monitor import observe
from gne_mj.loops.lanes import (
    LANES_LOOP,
    act,
    channels_in_lanes,
    note,
    problem_in_lanes,
    record,
    scratch_in,
    scratch_length,
    stored,
)
from gne_mj.loops.layout import H, LoopClock, Parts, steps_in
from gne_mj.loops.ode import ode_workspace_in, ode_workspace_length
from gne_mj.native import address_in, callback, copy, source_key
from gne_mj.parameter_block import floats_at
from gne_mj.plants.functions import hold_step


@cache
def build(agent: ModuleType, law: ModuleType, game: ModuleType) -> Any:
    """The loop of eight runs: see :func:`gne_mj.loops.lanes.build`."""
    source = source_key(agent, law, game)

    def advance(block, address, count, runs):
        _ = source
        s = steps_in(block)
        length = ode_workspace_length(s)
        workspace = ode_workspace_in(lanes_at(address, length), s)
        behind = lanes_at(address + 8 * WIDTH * length, scratch_length(s.actions))
        scratch = scratch_in(behind, 0, s.actions)
        turn, asked, known = scratch.turn, scratch.asked, scratch.known
        problem = problem_in_lanes(block, s.agents)
        channels = channels_in_lanes(block, s.actions, s.output, -1)
        h = floats_at(address_in(lanes(block, H)), 1)[0]
        loop, vectors = workspace.loop, workspace.vectors
        work, u, progress = loop.work, loop.u, loop.progress
        parts = Parts(
            problem, channels, LoopClock(h, s.period, s.mode, s.method), loop.monitor.numbers,
            loop.monitor, u, work,
        )  # fmt: skip
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
            hold_step(agent, channels.parameters, s.states, s.method, h, trial, u, vectors.spare)
            for r in range(len(state)):
                state[r] = where(good, trial[r], state[r])
            progress.step = where(good, progress.step + 1.0, progress.step)
            hard = bits_of(not good) & runs
            ended = bits_of(progress.step >= turn.last) & runs
            if (ended | hard) != 0:
                return ended + 256 * hard
        return 0

    return callback(LANES_LOOP, advance)
