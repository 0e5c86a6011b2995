"""Fleets under held inputs, looked at after every integration step: what all environments step."""

from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gne_mj import game_functions as games
from gne_mj.loops import functions
from gne_mj.loops.feedback import inside
from gne_mj.loops.layout import steps_in
from gne_mj.loops.link import parts_at
from gne_mj.native import address_in, compiled, copy, kernel, source_key
from gne_mj.plants.mujoco import sizes_in
from gne_mj.plants.native_mujoco import (
    Offsets,
    call_state,
    field,
    forces_lost,
    parameter_block_of,
    timed_step,
)

# What a look found in place of the first constraint that is violated
# (LOST: MuJoCo has left out forces)
INSIDE, DIVERGED, NO_INPUT, LOST = -1, -2, -3, -4


class Tools(NamedTuple):
    """What steps rows of fleets, one after the other: addresses.

    They share one mjData, which then stays in the processor's cache: with one each, hundreds of
    fleets take two or three times as long.
    """

    step: int  # of mj_step
    save: int  # of mj_getState
    load: int  # of mj_setState
    bits: int  # of mjtState that a row keeps
    model: int
    data: int
    shared: int  # 1: it has several rows; 0: mjData is that of its only one
    barrier: int  # parameter block of the law that keeps them inside; 0: none does
    states: int  # of a channel
    output: int  # which of them is its output


class Rows(NamedTuple):
    """Fleets beside each other, in each array a row for one."""

    workspace: np.ndarray  # (E,) address of the loop workspace of what keeps it inside
    moves: np.ndarray  # (E,) 1: it is stepped, 0: it is left alone
    step: np.ndarray  # (E,) integration steps since its start
    found: np.ndarray  # (E,) INSIDE, another of these, or the constraint that is violated
    limited: np.ndarray  # (E,) periods whose input the actuators do not deliver
    pull: np.ndarray  # (E, m) what is asked for
    given: np.ndarray  # (E, m) the input that acts
    state: np.ndarray  # (E, m * states) flat
    y: np.ndarray  # (E, m) outputs
    g: np.ndarray  # (E, p)
    now: np.ndarray  # (E, ...) MuJoCo's state
    before: np.ndarray  # (E, ...) the same at the last step's start


@kernel
def begins(parts, step):
    """Whether a control period begins with this step: by the clock, or where one was cut."""
    return step % parts.clock.period == 0 or step == parts.work.now.next_instant


@kernel
def keep_inside(tools, rows, e):
    """Fill ``given`` of row e, at a control instant, with the input that keeps it inside.

    Returns 1 if there is one, 0 if there is none, and -1 where no control period begins.
    """
    workspace, step, y = rows.workspace[e], rows.step[e], rows.y[e]
    parts = parts_at(tools.barrier, workspace, steps_in(tools.barrier))
    if not begins(parts, step):
        return -1
    time, work, place = step * parts.clock.h, parts.work, (workspace, tools.model, tools.data)
    copy(y, work.y)
    copy(y, work.held)
    good = inside(parts.problem, time, 0, work.y, work, parts.monitor)
    good = good and functions.act(parts.problem, place, time, step, rows.state[e], rows.pull[e])
    if good:
        copy(work.commanded, rows.given[e])
    return 1 if good else 0


@kernel
def look(at, fleet, tools, game, rows, e):
    """Fill row e with what is now; INSIDE, DIVERGED or the first constraint that is violated."""
    data, state, y, g = tools.data, rows.state[e], rows.y[e], rows.g[e]
    block = abs(parameter_block_of(at, tools.model, data))
    sizes = sizes_in(block)
    lost = forces_lost(at, data, sizes.nv) >= 0
    fleet.refresh(tools.model, data, block)
    fleet.gather(at, data, block, state)
    for r in range(len(y)):
        y[r] = state[r * tools.states + tools.output]
    found = INSIDE
    games.values(game, game.all_constraints, y, g)
    for k in range(len(g)):
        if found == INSIDE and not g[k] < 0.0:
            found = k
    qpos, qvel = field(data, at.qpos, sizes.nq), field(data, at.qvel, sizes.nv)
    act = field(data, at.act, sizes.na)
    for array in (qpos, qvel, act):
        for r in range(len(array)):
            if not np.isfinite(array[r]):
                found = DIVERGED
    return LOST if lost and found == INSIDE else found


@kernel
def keep(tools, place):
    """Keep MuJoCo's state in one of a row's places."""
    call_state(tools.save, tools.model, tools.data, address_in(place), tools.bits)


@kernel
def push(at, fleet, tools, limit, rows, e):
    """Let the input of row e act from now on; False if there is none."""
    data, given, kept = tools.data, rows.given[e], 1
    if tools.barrier != 0:
        kept = keep_inside(tools, rows, e)
    else:
        copy(rows.pull[e], given)
    if kept == 0:
        return False
    block = abs(parameter_block_of(at, tools.model, data))
    limited = 0
    for r in range(len(given)):
        asked = given[r]
        given[r] = min(max(asked, -limit[r]), limit[r])
        if given[r] != asked:
            limited = 1
    fleet.drive(at, data, block, given, True)
    rows.limited[e] += limited
    return True


@cache
def build(at: Offsets, fleet: ModuleType) -> Any:
    """The native loop that steps rows of fleets, each up to the step that leaves the set.

    Args:
        at: where MuJoCo keeps what.
        fleet: the module that reads and drives the robots, as :mod:`gne_mj.plants.mujoco` does.
    """
    source = source_key(fleet, fleet.AGENT)

    @compiled
    def advance(tools, game, limit, rows, first, last, steps):
        """Take up to ``steps`` steps in rows from first to last - 1; none: look at what is now."""
        _ = source
        for e in range(first, last):
            if rows.moves[e] == 0:
                continue
            if tools.shared != 0:
                state = address_in(rows.now[e])
                call_state(tools.load, tools.model, tools.data, state, tools.bits)
            if steps == 0:
                keep(tools, rows.before[e])
            if rows.found[e] == INSIDE:  # somebody may have moved it
                rows.found[e] = look(at, fleet, tools, game, rows, e)
            taken = 0
            while taken < steps and rows.found[e] == INSIDE:
                acts = tools.barrier != 0 or taken == 0
                if acts and not push(at, fleet, tools, limit, rows, e):
                    rows.found[e] = NO_INPUT
                    break
                keep(tools, rows.before[e])
                block = abs(parameter_block_of(at, tools.model, tools.data))
                fleet.drive_again(at, tools.model, tools.data, block, rows.given[e])
                timed_step(at, tools.step, tools.model, tools.data)
                rows.step[e] += 1
                rows.found[e] = look(at, fleet, tools, game, rows, e)
                taken += 1
            keep(tools, rows.now[e])

    return advance
