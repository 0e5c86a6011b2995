"""The loop of mode implicit in plain Python, by the product's kernels as they stand.

Nothing is compiled, so that what a loop of its own would take half a minute for is tried in a
second. Kernels that a compiled loop has to have anyway are better tested through it.
"""

from typing import Any, NamedTuple

import numpy as np

from gne_mj.loops import functions, implicit, layout
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import inside, work
from gne_mj.loops.newton import solver_in
from gne_mj.plants import zero_order_hold
from gne_mj.plants.functions import compiled_functions
from gne_mj.plants.ode import Channels


class Parts(NamedTuple):
    """What the kernels of a system are given."""

    problem: Any
    parameter_block: Any  # which the problem knows by its address
    channels: Any
    clock: Any
    work: Any
    monitor: Any
    solver: Any
    loop: layout.Parts  # of the above, as a loop has them


class Instants(NamedTuple):
    """What was there at the control instants, each (instants, ...)."""

    y: np.ndarray
    u: np.ndarray
    memory: np.ndarray
    measurement: np.ndarray
    monitor: np.ndarray


def parts_of(system, timing):
    """A system's problem, and scratch arrays of its loop."""
    game, setup = system.game, system.setup(timing)
    m, p, states = game.actions, game.constraints_count, system.agents.states
    scratch = work(m, p, game.agents, system._sizes)
    solver = solver_in(scratch.solver, setup.problem.order, p, states)
    kind = system.agents.kind
    rest = setup.equilibrium_state
    channels = Channels(system.agents.parameters, rest, compiled_functions(kind), kind.OUTPUT)
    problem, parameter_block = layout.problem_and_parameter_block(
        setup, system.agents, len(system.loop_memory)
    )
    monitor, clock = watch.fresh(m, p), setup.clock
    loop = layout.Parts(problem, channels, clock, monitor, monitor, np.zeros(m), scratch)
    return Parts(problem, parameter_block, channels, clock, scratch, monitor, solver, loop)


def run_plain(system, timing, periods, plant=zero_order_hold):
    """So many control periods in mode implicit, from the start on, ``plant`` predicting."""
    parts, faults = parts_of(system, timing), system.fault_kernels
    problem, _parameter_block, channels, clock, scratch, monitor, _solver, loop = parts
    state, memory = system.state.ravel().copy(), system.loop_memory.copy()
    rows = []
    for k in range(periods):
        step = k * clock.period
        time = step * clock.h
        scratch.y[:] = state.reshape(channels.equilibrium_state.shape)[:, channels.output]
        assert inside(problem, time, 0, scratch.y, scratch, monitor)
        if k:
            functions.propagate(problem, scratch.held, memory, scratch.scratch)
        at = layout.Instant(time, step, 0)
        faults.begin(loop, at, state, memory)
        before = memory.copy()
        assert implicit.act(faults, plant, (), loop, at, state, memory)
        faults.deliver(problem, clock, step, scratch)
        row = (scratch.y, scratch.u, before, scratch.measurement)
        rows.append([array.copy() for array in row])
        spare = np.zeros(5 * channels.equilibrium_state.shape[1])
        plant.roll(channels, clock, state, scratch.u, spare)
    return Instants(*map(np.array, zip(*rows, strict=True)), monitor)
