"""What every loop's feedback reads and works on, and the look at the true outputs."""

from typing import NamedTuple

import numpy as np

from gne_mj import game_functions as games
from gne_mj.barrier import KIND, START, rho_at
from gne_mj.controllers.propagation import Propagator, scratch_length
from gne_mj.controllers.settings import NOW, PENALTY, RHO, SHELL, SHELL_VALUE
from gne_mj.game import GameData
from gne_mj.graph import GraphData
from gne_mj.loops import division, functions
from gne_mj.loops import monitor as watch
from gne_mj.native import kernel

# MuJoCo silently applies no force at all beyond this magnitude (its mjMAXVAL).
LARGEST_INPUT = 1e10


class Order(NamedTuple):
    """Rows of Newton's matrix, mode implicit."""

    position: np.ndarray  # (m,) each action's row
    band: np.ndarray  # [half bandwidth, 1 if shares of slacks are kept to], integers
    start: np.ndarray  # (p + 1,) where each constraint's actions begin in the next
    column: np.ndarray  # the actions in one constraint after the other
    within: np.ndarray  # and the constraint that each of these entries is of


class Faults(NamedTuple):
    """Faults of a run, see :mod:`gne_mj.loops.faults`."""

    rows: np.ndarray  # (faults, FAULT_COLUMNS), sorted by kind
    pointer: np.ndarray  # kind k has the rows from pointer[k] to pointer[k + 1]
    numbers: np.ndarray  # [seed, sensor delay, greatest message delay], delays in control periods


NO_ORDER = Order(*(np.zeros(n, dtype=np.int64) for n in (0, 2, 0, 0, 0)))
FAULT_COLUMNS, FAULT_KINDS = 7, 8
NO_FAULTS = Faults(
    np.zeros((0, FAULT_COLUMNS)), np.zeros(FAULT_KINDS + 1, dtype=np.int64), np.zeros(3)
)


class Problem(NamedTuple):
    """What a law reads, besides measurements; read-only."""

    data: GameData
    graph: GraphData
    settings: np.ndarray  # the law's numbers, see gne_mj.controllers.settings
    limit: np.ndarray  # (m,) greatest |u| that the actuators deliver
    equilibrium: np.ndarray  # (m,) y*, from which storage is measured
    propagator: Propagator  # exact motion of the law's memory over a control period
    schedule: np.ndarray = np.zeros(4)  # of the penalty; all zero: settings[RHO] for all time
    order: Order = NO_ORDER
    faults: Faults = NO_FAULTS
    # (1 + p,) at y*: division.sizes_at; read in mode continuous only
    size: np.ndarray = np.zeros(1)
    # addresses, see gne_mj.loops.functions; and that of the run's table, as loops know it
    functions: np.ndarray = np.zeros(functions.COUNT, dtype=np.int64)
    table: int = 0


class Work(NamedTuple):
    """Scratch arrays of one loop, so that a step allocates nothing."""

    g: np.ndarray  # (p,) constraint values at the last evaluation
    weights: np.ndarray  # (p,) rho / (-g - t)
    demand: np.ndarray  # (m,) what the law asks for
    profile: np.ndarray  # (m,) an agent's own profile
    y: np.ndarray  # (m,) outputs
    u: np.ndarray  # (m,) inputs at a stage
    held: np.ndarray  # (m,) outputs at the last control instant, held modes
    stands: np.ndarray  # (1,) the step that the law's memory belongs to, held modes
    scratch: np.ndarray  # for the propagation of estimates
    now: np.ndarray  # see gne_mj.controllers.settings
    seen: np.ndarray  # (m,) outputs as the law sees them
    acts: np.ndarray  # (m,) inputs with pushes, which move the plant
    history: np.ndarray  # past states and inputs, where sensors are late
    division: np.ndarray  # of steps, mode continuous: see gne_mj.loops.division
    solver: np.ndarray  # of mode implicit


class Sizes(NamedTuple):
    """Lengths that depend on the kind of loop."""

    history: int = 0
    solver: int = 0


NO_SIZES = Sizes()


@kernel
def work_sizes(actions, constraints, agents, history, solver):
    """Lengths of the arrays of :class:`Work`, in its order."""
    m, p = actions, constraints
    divided = division.length(m, p)
    return p, p, m, m, m, m, m, 1, scratch_length(agents), NOW, m, m, history, divided, solver


def work(actions: int, constraints: int, agents: int, sizes: Sizes = NO_SIZES) -> Work:
    """Fresh scratch arrays."""
    return Work(*(np.zeros(n) for n in work_sizes(actions, constraints, agents, *sizes)))


@kernel
def inside(problem, time, stage, y, work, monitor):
    """Fill work.g, work.weights and work.now; latch an exit, and return False, if g(y) is not < 0.

    Outputs that are inside, but closer to the boundary than the barrier's tightening, are no exit;
    the constraint is in work.now[SHELL], and its weight is of no use.
    """
    schedule, rho = problem.schedule, problem.settings[RHO]
    if schedule[KIND] > 0.0 or schedule[START] > 0.0:
        rho = rho_at(schedule, time)
    work.now[PENALTY] = rho
    outside = games.evaluate(problem.data, rho, y, work.g, work.weights)
    work.now[SHELL] = outside
    if outside < 0:
        return True
    work.now[SHELL_VALUE] = work.g[outside] + problem.data.tightening[outside]
    for k in range(outside, len(work.g)):
        value = work.g[k]
        if not value < 0.0:
            code = watch.LEFT_SET if np.isfinite(value) else watch.DIVERGED
            watch.leave(monitor, code, time, -1, k, value, stage)
            return False
    return True


@kernel
def feedback(problem, time, stage, y, memory, work, monitor, u):
    """Fill u (m,) with the input that actuators deliver at outputs y (m,), all seen as they are.

    work.g, work.weights and work.demand are filled on the way. Returns True if there is an input.
    If not (y or an estimate is not strictly inside, or the demand is not finite), the exit is
    latched in the monitor with the given time and stage, and u is left unfinished.
    """
    if not inside(problem, time, stage, y, work, monitor):
        return False
    if not explicit_law(problem, time, stage, y, memory, work, monitor):
        return False
    for r in range(len(u)):
        u[r] = min(max(work.demand[r], -problem.limit[r]), problem.limit[r])
    return True


@kernel
def explicit_law(problem, time, stage, y, memory, work, monitor):
    """Fill work.demand by the law at y (m,), whose weights are given; False if it has no action."""
    shell = int(work.now[SHELL])
    if shell >= 0:
        watch.leave(monitor, watch.ESTIMATE_LEFT, time, -1, shell, work.now[SHELL_VALUE], stage)
        return False
    left = functions.action(problem, y, work.weights, memory, work, work.demand)
    if left >= 0:
        agent, constraint = left // len(work.g), left % len(work.g)
        value = games.constraint(problem.data, constraint, work.profile)
        value += problem.data.tightening[constraint]
        code = watch.ESTIMATE_LEFT if np.isfinite(value) else watch.DIVERGED
        watch.leave(monitor, code, time, agent, constraint, value, stage)
        return False
    return usable(time, stage, work, monitor)


@kernel
def usable(time, stage, work, monitor):
    """Whether all demands are numbers that actuators can take; else the exit is latched."""
    for r in range(len(work.demand)):
        if not abs(work.demand[r]) < LARGEST_INPUT:
            watch.leave(monitor, watch.DIVERGED, time, -1, -1, work.demand[r], stage)
            return False
    return True
