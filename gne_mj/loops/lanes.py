"""Eight runs of ODE agents at once, in lanes: mode continuous, Runge-Kutta 4.

Every run has its own step and its own piece of it (:mod:`gne_mj.loops.division`), so that no run
waits for another that divides its steps. The operations are those of :mod:`gne_mj.loops.ode`, in
their order, so that each run's numbers are to the bit those that it has alone. What is rare is not
done here: a run that is outside at the start of a piece, or that fails in a finest one, stays at
the piece's start, and the loop of one run takes it from there.
"""

from functools import cache
from types import ModuleType
from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import types

from gne_mj.controllers.settings import RHO
from gne_mj.lanes import WIDTH, bits_of, lanes, lanes_at, mask_of, power_of_two, where
from gne_mj.loops import division
from gne_mj.loops.feedback import LARGEST_INPUT, Problem
from gne_mj.loops.lane_monitor import observe
from gne_mj.loops.layout import H, LoopClock, Parts, place_in_block, steps_in
from gne_mj.loops.ode import ode_workspace_in, ode_workspace_length, stage_state
from gne_mj.loops.recorder import HEADER, columns_in_block, head_in, next_row
from gne_mj.native import address_in, callback, copy, kernel, source_key
from gne_mj.numbers import Numbers
from gne_mj.parameter_block import floats_at, integers_at
from gne_mj.plants.ode import Channels
from gne_mj.records import in_array, in_parameter_block

_whole = types.int64
LANES_LOOP = _whole(*[_whole] * 4)


class Turn(Numbers):
    """What a lane works towards."""

    last: float  # the step at whose start it ends
    due: float  # the step at whose start its next row is due


class Scratch(NamedTuple):
    """What lies behind a workspace of lanes."""

    turn: Turn
    asked: Annotated[np.ndarray, "m"]  # what the law asked for at the piece's start
    known: Annotated[np.ndarray, "m"]  # what the agents' rates need again


scratch_length, scratch_in = in_array(Scratch, "m")
problem_in_lanes = in_parameter_block(Problem, place_in_block("problem"), floats=lanes)
channels_in_lanes = in_parameter_block(Channels, place_in_block("channels"), floats=lanes)


@kernel
def act(law, game, parts, state, states):
    """Measure and act at a flat state; the mask of the lanes where that goes well."""
    problem, work, data = parts.problem, parts.work, parts.problem.data
    good, size = mask_of(-1), len(work.y) * states
    for r in range(len(work.y)):
        work.y[r] = state[r * states + parts.channels.output]
    for k in range(len(work.g)):
        value = game.constraint(data.parameters, k, work.y)
        slack = -value - data.tightening[k]
        work.g[k] = value
        work.weights[k] = problem.settings[RHO] / slack
        good &= slack > 0.0
    law.action(game, problem, work.y, work.weights, state[size:], work, work.commanded)
    for r in range(len(work.u)):
        good &= abs(work.commanded[r]) < LARGEST_INPUT
        work.u[r] = min(max(work.commanded[r], -problem.limit[r]), problem.limit[r])
    return good


@kernel
def stored(agent, law, parts, state, known):
    """V^{x*} of all, and what the rates here need again."""
    channels = parts.channels
    states, total = channels.equilibrium_state.shape[1], 0.0
    for r in range(len(known)):
        own = state[r * states : (r + 1) * states]
        known[r] = agent.shared(channels.parameters[r], own)
        total += agent.storage_given(
            channels.parameters[r], own, channels.equilibrium_state[r], known[r]
        )
    size = len(known) * states
    if len(state) > size:
        total += law.storage(parts.problem, state[size:])
    return total


@kernel
def rates(agent, law, parts, stage, state, known, out):
    """Fill out with the rates at a flat state."""
    channels, u = parts.channels, parts.work.u
    states = channels.equilibrium_state.shape[1]
    for r in range(len(u)):
        own = state[r * states : (r + 1) * states]
        if stage > 0:
            known[r] = agent.shared(channels.parameters[r], own)
        agent.rate_given(
            channels.parameters[r], own, u[r], known[r], out[r * states : (r + 1) * states]
        )
    size = len(u) * states
    if len(state) > size:
        law.rate(parts.problem, parts.work.y, state[size:], out[size:])


@kernel
def note(stage, work):
    """Keep what a stage has shown."""
    m, p = len(work.y), len(work.g)
    copy(work.y, work.stages.y[stage * m : (stage + 1) * m])
    copy(work.g, work.stages.g[stage * p : (stage + 1) * p])


@kernel
def size_up(problem, work):
    """The typical sizes of a run, where it starts."""
    size, fresh = work.stages.size, work.division.sized == 0.0
    largest = problem.size[0]
    for r in range(len(work.y)):
        largest = max(largest, abs(work.y[r]))
    size[0] = where(fresh, largest, size[0])
    for k in range(len(work.g)):
        slack = -work.g[k] - problem.data.tightening[k]
        size[1 + k] = where(fresh, max(problem.size[1 + k], slack), size[1 + k])
    work.division.sized = where(fresh, 1.0, work.division.sized)


@kernel
def stands(problem, work, runs):
    """The mask of lanes whose piece may stand, of those whose bits are in ``runs``.

    As :func:`gne_mj.loops.division.judge` has it; the closer look is taken where any run needs it.
    """
    divided = work.division
    calm = divided.calm + 1.0
    easy = calm >= division.CALM_FOR
    good = division.ordinary(4, problem, work, work.stages)
    if bits_of(good) & runs != runs:
        closer, calmer = mask_of(-1), mask_of(-1)
        finest = divided.level >= division.FINEST
        for k in range(len(work.g)):
            error = division.error_of(problem, work, work.stages, finest, k)
            use, gain = division.use_of(4, problem, work, work.stages, k)
            closer &= (error <= 1.0) & (gain <= division.GAIN)
            closer &= (use <= division.USE) | finest
            calmer &= not (
                (division.GROWTH * error > 1.0)
                | (use > 0.4 * division.USE)
                | (gain > 0.4 * division.GAIN)
            )
        easy &= good | calmer
        good |= closer
    divided.easy = where(easy, 1.0, 0.0)
    divided.calm = where(good, calm, divided.calm)
    return good


@kernel
def go_on(progress, divided, h, monitor, good, halved):
    """Move lanes on to the end of a piece where that is ``good``; pieces of others are halved."""
    level, split = divided.level, divided.split
    whole = level == 0.0
    length = h * power_of_two(-level)
    shorter = good & (not whole)
    split = where(shorter, 1.0, split)
    shortest = (monitor.smallest_step == 0.0) | (length < monitor.smallest_step)
    monitor.smallest_step = where(shorter & shortest, length, monitor.smallest_step)
    unit = power_of_two(division.DEEPEST - level)
    position = divided.position + unit
    pairs = position / (2.0 * unit)
    coarser = shorter & (divided.easy > 0.0) & (np.floor(pairs) == pairs)
    done = good & (position == float(division.UNITS))
    divided.position = where(done, 0.0, where(good, position, divided.position))
    divided.level = where(halved, level + 1.0, where(coarser, level - 1.0, level))
    divided.calm = where(halved, 0.0, divided.calm)
    divided.deep = where(good, 0.0, divided.deep)
    monitor.divided = where(done, monitor.divided + split, monitor.divided)
    divided.split = where(done, 0.0, split)
    progress.step = where(done, progress.step + 1.0, progress.step)


@kernel
def write(column, rows, row, source, lane):
    """Write a column's row from one lane of ``source``."""
    width = len(column) // rows
    flat = floats_at(address_in(source), WIDTH * width)
    for r in range(width):
        column[row * width + r] = flat[WIDTH * r + lane]


@kernel
def record(lane, progress, turn, state, memory, u):
    """Write a row of a lane, which is due, and note when the next one is."""
    addresses = floats_at(address_in(progress), 3 * WIDTH)[2 * WIDTH :]  # progress.recorder
    block = int(addresses[lane])
    head, columns = head_in(integers_at(block, HEADER), 0), columns_in_block(block)
    write(columns.state, head.rows, head.done, state, lane)
    write(columns.input, head.rows, head.done, u, lane)
    write(columns.memory, head.rows, head.done, memory, lane)
    head.done += 1
    due = floats_at(address_in(turn), 2 * WIDTH)[WIDTH:]  # turn.due
    due[lane] = next_row(block)


@kernel
def forget(good, work, asked, u):
    """Where a piece is taken back, what was evaluated at its start holds again."""
    stages = work.stages
    for r in range(len(u)):
        work.y[r] = where(good, work.y[r], stages.y[r])
        work.commanded[r] = where(good, work.commanded[r], asked[r])
        work.u[r] = where(good, work.u[r], u[r])
    for k in range(len(work.g)):
        work.g[k] = where(good, work.g[k], stages.g[k])


@kernel
def take_stages(agent, law, game, parts, vectors, known, piece):
    """Fill the trial with the state a piece of so many s on; the mask of lanes that stay inside."""
    state, trial, k, work = vectors.state, vectors.trial, vectors.rates, parts.work
    states = parts.channels.equilibrium_state.shape[1]
    note(0, work)
    rates(agent, law, parts, 0, state, known, k[0])
    stage_state(1, piece, state, k, trial)
    good = act(law, game, parts, trial, states)
    for stage in range(1, 4):
        note(stage, work)
        rates(agent, law, parts, stage, trial, known, k[stage])
        if stage < 3:
            stage_state(stage + 1, piece, state, k, trial)
        else:
            for r in range(len(state)):
                rise = k[0, r] + 2.0 * k[1, r] + 2.0 * k[2, r] + k[3, r]
                trial[r] = state[r] + piece / 6.0 * rise
        good &= act(law, game, parts, trial, states)
    return good


@kernel
def behind(address, length, s):
    """The scratch behind a workspace of so many lanes at an address."""
    flat = lanes_at(address + 8 * WIDTH * length, scratch_length(s.actions))
    return scratch_in(flat, 0, s.actions)


@kernel
def parts_of(block, s, loop):
    """The parts of eight runs, from the address of their block, its sizes and their workspace."""
    problem = problem_in_lanes(block, s.agents)
    channels = channels_in_lanes(block, s.actions, s.output, -1)
    h, monitor = floats_at(address_in(lanes(block, H)), 1)[0], loop.monitor
    clock = LoopClock(h, s.period, s.mode, s.method)
    return Parts(problem, channels, clock, monitor.numbers, monitor, loop.u, loop.work)


@kernel
def laid_out(block, address, s):
    """A loop's workspace, its scratch behind that, and its parts, by addresses and sizes."""
    length = ode_workspace_length(s)
    workspace = ode_workspace_in(lanes_at(address, length), s)
    return workspace, behind(address, length, s), parts_of(block, s, workspace.loop)


@cache
def build(agent: ModuleType, law: ModuleType, game: ModuleType) -> Any:
    """The loop of eight runs, for modules of kernels that lanes can go through.

    A C function of the addresses of a parameter block and a workspace of lanes, of the most pieces
    to take, and of the bits of the lanes that are runs. It ends when a run is where it is to end,
    or must go on by itself; it returns the bits of the first plus 256 times those of the others.
    """
    source = source_key(agent, law, game)

    def advance(block, address, count, runs):
        _ = source
        s = steps_in(block)
        workspace, scratch, parts = laid_out(block, address, s)
        turn, asked, known = scratch.turn, scratch.asked, scratch.known
        loop, vectors, problem, h = workspace.loop, workspace.vectors, parts.problem, parts.clock.h
        work, u, divided, progress = loop.work, loop.u, loop.work.division, loop.progress
        state, trial, begun = vectors.state, vectors.trial, vectors.begun
        size, tick = s.actions * s.states, h * division.SHARES[division.DEEPEST]
        sound = act(law, game, parts, state, s.states)
        size_up(problem, work)
        for _piece in range(count):
            storage = stored(agent, law, parts, state, known)
            copy(work.commanded, asked)
            copy(work.u, u)
            piece = h * power_of_two(-divided.level)
            good = take_stages(agent, law, game, parts, vectors, known, piece) & sound
            good &= stands(problem, work, runs & bits_of(good))
            whole = divided.position == 0.0
            halved = (not good) & sound & (divided.level < division.FINEST)
            hard = bits_of(not (good | halved)) & runs
            time = progress.step * h + divided.position * tick
            observe(loop.monitor, time, work, asked, (u, u), storage, good)
            due = bits_of(good & whole & (progress.step == turn.due)) & runs
            for lane in range(WIDTH if due != 0 else 0):
                if (due >> lane) & 1:
                    record(lane, progress, turn, state[:size], state[size:], u)
            for r in range(len(state)):
                begun[r] = where(whole, state[r], begun[r])
                state[r] = where(good, trial[r], state[r])
            go_on(progress, divided, h, loop.monitor.numbers, good, halved)
            forget(good, work, asked, u)
            ended = bits_of(progress.step >= turn.last) & runs
            if (ended | hard) != 0:
                return ended + 256 * hard
        return 0

    return callback(LANES_LOOP, advance)
