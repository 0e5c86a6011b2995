"""What every loop's feedback reads and works on, and the look at the true outputs."""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers.kept import EVERYTHING, KeptData
from gne_mj.controllers.propagation import Propagator, scratch_length
from gne_mj.controllers.settings import OUTSIDE, RELAXED, RHO, Now
from gne_mj.game_model import GameData
from gne_mj.graph import GraphData
from gne_mj.loops import division, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.outside import goes_on
from gne_mj.motion import STANDING, Moving
from gne_mj.native import kernel
from gne_mj.numbers import Numbers, names_of, numbers
from gne_mj.records import in_array

# MuJoCo silently applies no force at all beyond this magnitude (its mjMAXVAL).
LARGEST_INPUT = 1e10


class Order(NamedTuple):
    """Rows of Newton's matrix, mode implicit."""

    position: Annotated[np.ndarray, "m", int]  # each action's row
    band: Annotated[np.ndarray, "2", int]  # [half bandwidth, 1 if shares of slacks are kept to]
    start: Annotated[np.ndarray, "p + 1", int]  # where each constraint's actions begin in the next
    column: Annotated[np.ndarray, "n", int]  # the actions in one constraint after the other
    within: Annotated[np.ndarray, "n", int]  # and the constraint that each of these entries is of


class Fault(Numbers):
    """One fault of one target; times in s."""

    target: float  # channel, link or agent
    start: float
    end: float
    amount: float
    form: float  # a push's, see gne_mj.loops.faults; sigma of a trigger
    period: float  # a push's, in s; a trigger's decay in 1/s
    stream: float  # which random numbers


class FaultNumbers(Numbers):
    """What holds for all faults of a run; delays in control periods."""

    seed: float
    sensor_delay: float
    message_delay: float  # the greatest


class Faults(NamedTuple):
    """Faults of a run, see :mod:`gne_mj.loops.faults`."""

    rows: Annotated[np.ndarray, "n"]  # one Fault after the other, sorted by kind
    # kind k has those from pointer[k] to pointer[k + 1]
    pointer: Annotated[np.ndarray, "n", int]
    numbers: FaultNumbers


NO_MODEL = np.zeros(0, dtype=np.int64)
NO_ORDER = Order(*(np.zeros(n, dtype=np.int64) for n in (0, 2, 0, 0, 0)))
FAULT_COLUMNS, FAULT_KINDS = len(names_of(Fault)), 9
NO_FAULTS = Faults(np.zeros(0), np.zeros(FAULT_KINDS + 1, dtype=np.int64), numbers(FaultNumbers))


class Problem(NamedTuple):
    """What a law reads, besides measurements; read-only."""

    data: GameData
    graph: GraphData
    # the law's numbers, see gne_mj.controllers.settings
    settings: Annotated[np.ndarray, "n"]
    limit: Annotated[np.ndarray, "m"]  # greatest |u| that the actuators deliver
    equilibrium: Annotated[np.ndarray, "m"]  # y*, from which storage is measured
    propagator: Propagator  # exact motion of the law's memory over a control period
    # of the penalty, where functions.PENALTY changes it in time: gne_mj.barrier.Schedule.numbers
    schedule: Annotated[np.ndarray, "3"] = np.zeros(3)
    order: Order = NO_ORDER
    faults: Faults = NO_FAULTS
    # at y*: division.sizes_at; read in mode continuous only
    size: Annotated[np.ndarray, "1 + p"] = np.zeros(1)
    # of agents that keep apart: gne_mj.separation.Separation.numbers
    separation: Annotated[np.ndarray, "3"] = np.zeros(3)
    # where control periods may end early, of every step and constraint: gne_mj.loops.guard
    ahead: Annotated[np.ndarray, "n"] = np.zeros(0)
    kept: KeptData = EVERYTHING  # the estimates that the law keeps, where these are not all
    # the plant's equations by address, where the law asks for them: gne_mj.loops.plant_model
    model: Annotated[np.ndarray, "n", int] = NO_MODEL
    motion: Moving = STANDING  # of the game's numbers, which functions.PENALTY moves too
    # addresses, see gne_mj.loops.functions; and that of the run's table, as loops know it
    functions: Annotated[np.ndarray, "n", int] = np.zeros(functions.COUNT, dtype=np.int64)
    parameter_block: int = 0


class StepScratch(NamedTuple):
    """Scratch arrays of one loop, so that a step allocates nothing."""

    now: Now
    g: Annotated[np.ndarray, "p"]  # constraint values at the last evaluation
    at_positions: Annotated[np.ndarray, "p"]  # and at positions that follow outputs
    weights: Annotated[np.ndarray, "p"]  # rho / (-g - t)
    commanded: Annotated[np.ndarray, "m"]  # what the law asks for
    profile: Annotated[np.ndarray, "m"]  # an agent's own profile
    y: Annotated[np.ndarray, "m"]  # outputs
    u: Annotated[np.ndarray, "m"]  # inputs at a stage
    held: Annotated[np.ndarray, "m"]  # outputs at the last control instant, held modes
    scratch: Annotated[np.ndarray, "propagation(agents)"]  # for the propagation of estimates
    measurement: Annotated[np.ndarray, "m"]  # outputs as the law sees them
    applied: Annotated[np.ndarray, "m"]  # inputs with pushes, which move the plant
    history: Annotated[np.ndarray, "history"]  # past states and inputs, where sensors are late
    division: division.Division  # of steps, mode continuous
    stages: division.Stages
    solver: Annotated[np.ndarray, "solver"]  # of mode implicit
    separation: Annotated[np.ndarray, "separation"]  # of agents that keep apart


class Sizes(NamedTuple):
    """Lengths that depend on the kind of loop."""

    history: int = 0
    solver: int = 0
    separation: int = 0


NO_SIZES = Sizes()


work_length, work_views = in_array(
    StepScratch, "m p agents history solver separation", propagation=scratch_length
)


def work(actions: int, constraints: int, agents: int, sizes: Sizes = NO_SIZES) -> StepScratch:
    """Fresh scratch arrays."""
    lengths = (actions, constraints, agents, *sizes)
    found: StepScratch = work_views(np.zeros(work_length(*lengths)), 0, *lengths)
    return found


@kernel
def inside(problem, time, stage, y, work, monitor):
    """Fill work.g, work.weights and work.now; latch an exit, and return False, if g(y) is not < 0.

    Where runs go on outside, that is noted instead. Outputs that are inside, but closer to the
    boundary than the barrier's tightening, are no exit; the constraint is in work.now.tightened,
    and its weight is of no use.
    """
    rho = functions.penalty(problem, time, problem.settings[RHO])
    work.now.penalty = rho
    outside = games.evaluate(problem.data, rho, y, work.g, work.weights)
    work.now.tightened = outside
    if outside < 0:
        return True
    work.now.tightened_value = work.g[outside] + problem.data.tightening[outside]
    for k in range(outside, len(work.g)):
        value = work.g[k]
        if not value < 0.0:
            if goes_on(problem, time, stage, work, monitor):
                return True
            code = watch.LEFT_SET if np.isfinite(value) else watch.DIVERGED
            watch.leave(monitor, code, time, -1, k, value, stage)
            return False
    return True


@kernel
def feedback(problem, time, stage, y, memory, work, monitor, u):
    """Fill u (m,) with the input that actuators deliver at outputs y (m,), all seen as they are.

    work.g, work.weights and work.commanded are filled on the way. Returns True if there is an
    input. If not (y or an estimate is not strictly inside, or the commanded input is not finite),
    the exit is latched in the monitor with the given time and stage, and u is left unfinished.
    """
    if not inside(problem, time, stage, y, work, monitor):
        return False
    if not explicit_law(problem, time, stage, y, memory, work, monitor):
        return False
    for r in range(len(u)):
        u[r] = min(max(work.commanded[r], -problem.limit[r]), problem.limit[r])
    return True


@kernel
def explicit_law(problem, time, stage, y, memory, work, monitor):
    """Fill work.commanded by the law at y (m,), weights being given; False: it has no action."""
    tightened = int(work.now.tightened)
    if tightened >= 0 and problem.settings[OUTSIDE] == 0.0:
        watch.leave(
            monitor, watch.ESTIMATE_LEFT, time, -1, tightened, work.now.tightened_value, stage
        )
        return False
    left = functions.action(problem, y, work.weights, memory, work, work.commanded)
    if left >= 0:
        agent, constraint = left // len(work.g), left % len(work.g)
        value = games.constraint(problem.data, constraint, work.profile)
        value += problem.data.tightening[constraint]
        code = watch.ESTIMATE_LEFT if np.isfinite(value) else watch.DIVERGED
        watch.leave(monitor, code, time, agent, constraint, value, stage)
        return False
    if left == RELAXED:
        monitor.relaxed += 1.0
    return usable(time, stage, work, monitor)


@kernel
def usable(time, stage, work, monitor):
    """Whether all demands are numbers that actuators can take; else the exit is latched."""
    for r in range(len(work.commanded)):
        if not abs(work.commanded[r]) < LARGEST_INPUT:
            watch.leave(monitor, watch.DIVERGED, time, -1, -1, work.commanded[r], stage)
            return False
    return True
