"""What a system's law asks of the actuators at the start, and what they deliver at a time."""

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.propagation import no_propagator
from gne_mj.controllers.settings import RHO
from gne_mj.errors import InvalidInput
from gne_mj.faults import Saturation
from gne_mj.loops import functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.layout import LoopClock as Steps
from gne_mj.loops.layout import Setup, problem_and_parameter_block
from gne_mj.plain import raise_pending
from gne_mj.system.clock import Clock
from gne_mj.system.modes import mode_of
from gne_mj.system.system import System

Array = NDArray[np.float64]


def law_at_start(system: System) -> Array:
    """u (m,) as the law reads at y(0) and its memory at the start, without any limit.

    Faults of sensors are left out. Not a number where the law has no action, or where that depends
    on how long a control period is.
    """
    if system.law.of_period and mode_of(system).held:
        return np.full(system.game.actions, np.nan)
    game, problem, memory = system.game, problem_at_start(system), system.loop_memory.copy()
    setup = Setup(problem, system.agents.equilibrium(system.start), Steps(1.0, 1, 0, 0))
    problem, _parameter_block = problem_and_parameter_block(setup, system.agents, len(memory))
    rho = problem.settings[RHO]
    scratch = work(game.actions, game.constraints_count, game.agents)
    scratch.now.penalty = rho
    state = np.ascontiguousarray(system.state)
    scratch.now.state = state.ctypes.data
    weights = rho / -(game.constraints(system.start) + game.margins)
    u = np.full(game.actions, np.nan)
    y = system.start.copy()
    left = functions.action(problem, y, weights, memory, scratch, u)
    raise_pending()
    if system.separation is not None and system.start_positions is not None:
        each = (game.agents, -1)
        places, outputs = system.start_positions.reshape(each), system.start.reshape(each)
        for (i, j), push in system.separation.pushes(places, outputs, rho).items():
            u.reshape(each)[i] += push
            u.reshape(each)[j] -= push
    return u if left < 0 else np.full(game.actions, np.nan)


def problem_at_start(system: System) -> Problem:
    """What the law reads at the start, and what the division of steps does."""
    rho = system.rho if system.schedule is None else system.schedule.start
    return Problem(
        data=system.game.data,
        graph=system.graph_at_start,
        settings=system.law_settings(rho),
        limit=system.agents.input_limit,
        equilibrium=np.ascontiguousarray(system.start),  # nothing is measured from it here
        propagator=no_propagator(),
        kept=system.law.kept_data,
        model=system.plant_model,
        size=system.typical_sizes,
        functions=system.functions,
    )


def first_input(system: System, clock: Clock) -> Array:
    """|u| (m,) that the first control period's input would need, without any limit.

    Unlike :func:`law_at_start` that is what a run solves for in mode implicit, faults included.
    Not a number where there is none.
    """
    m = system.game.actions
    try:
        loop = system.closed_loop(clock)
    except InvalidInput:  # a period that no run may have
        return np.full(m, np.nan)
    loop.finish()
    raise_pending()
    if loop.monitor.exit != watch.INSIDE:
        return np.full(m, np.nan)
    peak: Array = loop.monitor.peak.copy()
    return peak


def limits_at(system: System, time: float) -> Array:
    """The least limit (m,) of each channel's actuator at a time in s: its own, or a fault's."""
    limits = system.agents.input_limit.copy()
    for fault in system.faults:
        if isinstance(fault, Saturation) and fault.start <= time + 1e-9 < fault.end + 1e-9:
            struck = fault.targets(system.game, system.law.graph)
            limits[struck] = np.minimum(limits[struck], fault.limit)
    return limits
