"""From measured outputs to delivered inputs: the one feedback step that every loop uses."""

from typing import NamedTuple

import numpy as np

from gne_mj.barrier import evaluate_constraints
from gne_mj.controllers.propagation import Propagator, scratch_length
from gne_mj.controllers.settings import RHO
from gne_mj.game import GameData
from gne_mj.graph import GraphData
from gne_mj.loops import monitor as watch
from gne_mj.native import kernel

# MuJoCo silently applies no force at all beyond this magnitude (its mjMAXVAL).
LARGEST_INPUT = 1e10


class Problem(NamedTuple):
    """What a law reads, besides measurements; read-only."""

    data: GameData
    graph: GraphData
    settings: np.ndarray  # the law's numbers, see gne_mj.controllers.settings
    limit: np.ndarray  # (m,) greatest |u| that the actuators deliver
    equilibrium: np.ndarray  # (m,) y*, from which storage is measured
    propagator: Propagator  # exact motion of the law's memory over a control period


class Work(NamedTuple):
    """Scratch arrays of one loop, so that a step allocates nothing."""

    g: np.ndarray  # (p,) constraint values at the last evaluation
    weights: np.ndarray  # (p,) rho / -g
    demand: np.ndarray  # (m,) what the law asks for
    profile: np.ndarray  # (m,) an agent's own profile
    y: np.ndarray  # (m,) outputs
    u: np.ndarray  # (m,) inputs at a stage
    held: np.ndarray  # (m,) outputs at the last control instant, mode sampled
    stands: np.ndarray  # (1,) the step that the law's memory belongs to, mode sampled
    scratch: np.ndarray  # for the propagation of estimates


@kernel
def work_sizes(actions, constraints, agents):
    """Lengths of the arrays of :class:`Work`, in its order."""
    m, p = actions, constraints
    return p, p, m, m, m, m, m, 1, scratch_length(agents)


def work(actions: int, constraints: int, agents: int) -> Work:
    """Fresh scratch arrays."""
    return Work(*(np.zeros(size) for size in work_sizes(actions, constraints, agents)))


@kernel
def inside(game, problem, time, stage, y, work, monitor):
    """Fill work.g and work.weights; latch an exit and return False if y is not strictly inside."""
    outside = evaluate_constraints(
        game, problem.data, problem.settings[RHO], y, work.g, work.weights
    )
    if outside < 0:
        return True
    value = work.g[outside]
    code = watch.LEFT_SET if np.isfinite(value) else watch.DIVERGED
    watch.leave(monitor, code, time, -1, outside, value, stage)
    return False


@kernel
def feedback(law, game, problem, time, stage, y, memory, work, monitor, u):
    """Fill u (m,) with the input that the actuators deliver at outputs y (m,).

    work.g, work.weights and work.demand are filled on the way. Returns True if there is an input.
    If not (y or an estimate is not strictly inside, or the demand is not finite), the exit is
    latched in the monitor with the given time and stage, and u is left unfinished.
    """
    if not inside(game, problem, time, stage, y, work, monitor):
        return False
    left = law.action(game, problem, y, work.weights, memory, work, work.demand)
    if left >= 0:
        agent, constraint = left // len(work.g), left % len(work.g)
        value = game.constraint(problem.data.parameters, constraint, work.profile)
        code = watch.ESTIMATE_LEFT if np.isfinite(value) else watch.DIVERGED
        watch.leave(monitor, code, time, agent, constraint, value, stage)
        return False
    for r in range(len(u)):
        demand = work.demand[r]
        if not abs(demand) < LARGEST_INPUT:
            watch.leave(monitor, watch.DIVERGED, time, -1, -1, demand, stage)
            return False
        u[r] = min(max(demand, -problem.limit[r]), problem.limit[r])
    return True
