"""How mode continuous divides steps, so that the integrator follows the law near the boundary.

Where the barrier is stiff a whole step of an explicit method leaves the set that the law keeps. A
step is then taken in pieces of 1/2, 1/4, ... 1/4096 of it. Each piece is looked at when it is done.
It is *ordinary* if its end has changed every slack -g - t by little, and (Runge-Kutta 4) if for
the outputs Y1 ... Y4 of its stages |Y4 - 2 Y3 + Y1| is little beside |Y3 - Y2|, output by output:
the second and third stage are both of the middle, so that the ratio z of these two is the piece's
length times the closed loop's rate. An ordinary piece stands. Of any other

- neither a stage nor the end may use up more than a quarter of any slack, nor more than double it;
- Runge-Kutta 4: each slack's error must be small. With the z of the constraint's own outputs it is
  about |g(Y3) - g(Y2)| z^3 / 30, as of a linear law, and s z r^4 / 50 if the slack s changes by a
  part r, as of the barrier's gradient 1/s under Simpson's rule;
- Euler: half of what a slack's rate has changed by since the piece before, times the length, must
  be small.

A piece that fails is taken back and halved. One that succeeds by far is followed by one of twice
its length, where that lies on the coarser grid and no piece has failed lately. All this depends on
the present state alone, which ``work`` is part of, so that a run comes out the same
however it is cut into calls.

Where a law does not measure what its barrier keeps inside, as the fully distributed one, and
actuators do what it asks for, an exit can be the law's own or the integrator's. The piece is then
divided on, down to 2^-32 of the step, with as many pieces as a step may have: an exit that is still
there is the law's own.

A law that acts outside the set has no barrier: its pieces stand whatever becomes of the slacks, and
steps are divided only where a run that must not go on has left.

Outputs, slacks and (in runs without faults) the law are evaluated at a piece's end to be looked at;
the next piece begins with them in place of evaluating them again.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.settings import GUARDED, OUTSIDE
from gne_mj.lanes import where
from gne_mj.loops import monitor as watch
from gne_mj.native import copy, kernel
from gne_mj.numbers import Numbers

FINEST = 12  # steps are halved at most so often
PIECES = 1 << FINEST
DEEPEST = 32  # to tell whether an exit is the law's own: so often
UNITS = 1 << DEEPEST
SHARES = tuple(2.0**-level for level in range(DEEPEST + 1))


class Division(Numbers):
    """How the present step is divided: ``work.division``."""

    level: float  # pieces are 2^-level of a step
    position: float  # where in its step the next piece begins, in 1/UNITS of it
    calm: float  # pieces since one failed
    known: float  # what is evaluated at the present state, one of the constants below
    split: float  # 1: the present step is divided
    easy: float  # 1: twice the length is sure to do
    rated: float  # Euler, 1: the second row of Stages.g has the rates of g in the piece before
    sized: float  # 1: Stages.size is known
    deep: float  # pieces shorter than 1/PIECES since one that was not


END = -1  # in place of a stage's number: the end of a piece
NOTHING, OUTPUTS, LAW = range(3)  # known: outputs and slacks; these and what the law asks for

# An ordinary piece: z, the outputs' differences that are none beside their size, and the part of a
# slack that changes. Its error is below 1e-7 of that slack.
MILD, TINY, LITTLE = 0.1, 1e-10, 0.02
USE, GAIN = 0.25, 1.0  # the greatest parts of a slack that another may use up, and add to it
# The greatest error of a slack in a piece of Runge-Kutta 4, relative to the slack and to its
# typical size; and in a finest piece, after which there is nothing finer to try
OF_SLACK, OF_SIZE = 3e-6, 3e-8
OF_SLACK_AT_LAST, OF_SIZE_AT_LAST = 1e-2, 1e-6
OF_SLACK_EULER = 0.01
GROWTH = 64.0  # twice the length has 2^5 times the error; with a reserve
ROUNDING = 1e-13  # stages that differ by less of the outputs' size tell nothing of stiffness
STIFFEST = 4.0  # all that a greater z tells is that the method is unstable
CALM_FOR = 32  # pieces after a failure before twice the length is tried again


class Stages(NamedTuple):
    """What a piece's stages have shown, stage after stage; ``work.stages``."""

    y: Annotated[np.ndarray, "4 * m"]  # outputs
    g: Annotated[np.ndarray, "4 * p"]  # constraints
    # typical sizes of outputs, then of each slack: at the start or at y*
    size: Annotated[np.ndarray, "1 + p"]


def sizes_at(y: NDArray[np.float64], slacks: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sizes (1 + p,) at outputs y (m,) with slacks -g - t (p,), which need not be positive."""
    return np.concatenate([[np.max(np.abs(y))], np.maximum(slacks, 0.0)])


@kernel
def piece(division, h):
    """Length in s of the present piece."""
    return h * SHARES[int(division.level)]


@kernel
def begins(division, step, h):
    """Time in s at which the present piece begins."""
    return step * h + division.position * (h * SHARES[DEEPEST])


@kernel
def ends(division, step, h):
    """Time in s at which it ends, to the bit that at which the next one begins."""
    position = division.position + UNITS * SHARES[int(division.level)]
    if position == UNITS:
        return (step + 1) * h
    return step * h + position * (h * SHARES[DEEPEST])


@kernel
def note(stage, problem, work):
    """Keep what a stage has shown."""
    m, p, stages = len(work.y), len(work.g), work.stages
    if work.division.sized == 0.0:  # the start of the run
        work.division.sized = 1.0
        copy(problem.size, stages.size)
        for r in range(m):
            stages.size[0] = max(stages.size[0], abs(work.y[r]))
        for k in range(p):
            slack = -work.g[k] - problem.data.tightening[k]
            stages.size[1 + k] = max(stages.size[1 + k], slack)
    copy(work.y, stages.y[stage * m : (stage + 1) * m])
    copy(work.g, stages.g[stage * p : (stage + 1) * p])


@kernel
def ordinary(count, problem, work, stages):
    """Whether a piece whose end is in work.g needs no closer look; ``count`` stages, 1 of Euler."""
    m, g, tightening, good = len(work.y), work.g, problem.data.tightening, True
    for k in range(len(g)):
        start = stages.g[k]
        good &= abs(g[k] - start) <= -LITTLE * (start + tightening[k])
    if count == 1:
        return good
    y, tiny = stages.y, TINY * stages.size[0]
    first, second, third, fourth = y[:m], y[m : 2 * m], y[2 * m : 3 * m], y[3 * m :]
    for r in range(m):
        bend = abs(third[r] - second[r])
        good &= abs(fourth[r] - 2.0 * third[r] + first[r]) <= MILD * bend + tiny
    return good


@kernel
def stiffness(problem, stages, m, k):
    """z of the outputs in constraint k, at most STIFFEST; 0 where rounding hides it."""
    data, y, bend, turn = problem.data, stages.y, 0.0, 0.0
    for entry in range(data.member_pointer[k], data.member_pointer[k + 1]):
        i = data.member_index[entry]
        for r in range(data.offsets[i], data.offsets[i + 1]):
            bend = max(bend, abs(y[2 * m + r] - y[m + r]))
            turn = max(turn, abs(y[3 * m + r] - 2.0 * y[2 * m + r] + y[r]))
    return where(bend > ROUNDING * stages.size[0], min(turn / bend, STIFFEST), 0.0)


@kernel
def euler_error(h, problem, work, stages, k):
    """The error of slack k in a piece of h seconds of Euler's method over what is allowed of it."""
    division, p, start = work.division, len(work.g), stages.g[k]
    if division.rated == 0.0 or division.level >= FINEST:
        return 0.0
    slack = -start - problem.data.tightening[k]
    error = 0.5 * abs(work.g[k] - start - h * stages.g[p + k])
    return error / (OF_SLACK_EULER * slack)


@kernel
def error_of(problem, work, stages, finest, k):
    """The same of Runge-Kutta 4; ``finest`` says whether the piece is a finest one."""
    m, p, start = len(work.y), len(work.g), stages.g[k]
    slack = -start - problem.data.tightening[k]
    z = stiffness(problem, stages, m, k)
    change = abs(work.g[k] - start)
    part = change / max(slack, slack + start - work.g[k])
    error = abs(stages.g[2 * p + k] - stages.g[p + k]) * z * z * z / 30.0
    error += slack * z * part * part * part * part / 50.0
    of_slack = where(finest, OF_SLACK_AT_LAST, OF_SLACK)
    of_size = where(finest, OF_SIZE_AT_LAST, OF_SIZE)
    return error / min(of_slack * slack, of_size * stages.size[1 + k])


@kernel
def use_of(count, problem, work, stages, k):
    """The greatest parts of slack k that a stage of a piece or its end has used up, and added."""
    p, start, highest, lowest = len(work.g), stages.g[k], work.g[k], work.g[k]
    for stage in range(1, count):
        highest = max(highest, stages.g[stage * p + k])
        lowest = min(lowest, stages.g[stage * p + k])
    slack = -start - problem.data.tightening[k]
    return (highest - start) / slack, (start - lowest) / slack


@kernel
def judge(count, h, problem, work):
    """Whether the piece whose end is evaluated may stand: -1, or the constraint that is why not.

    Args:
        count: stages of the method; one means Euler's.
        h: the piece's length in s.
        problem, work: of the run.
    """
    division, stages, p = work.division, work.stages, len(work.g)
    division.calm += 1.0
    division.easy = 1.0 if division.calm >= CALM_FOR else 0.0
    if ordinary(count, problem, work, stages) or problem.settings[OUTSIDE] > 0.0:
        division.rated = 0.0
        return -1
    finest = division.level >= FINEST
    for k in range(p):
        if count == 1:
            error = euler_error(h, problem, work, stages, k)
        else:
            error = error_of(problem, work, stages, finest, k)
        use, gain = use_of(count, problem, work, stages, k)
        if not error <= 1.0 or not gain <= GAIN or not (use <= USE or finest):
            return k
        if GROWTH * error > 1.0 or use > 0.4 * USE or gain > 0.4 * GAIN:
            division.easy = 0.0
    if count == 1:
        division.rated = 1.0
        for k in range(p):
            stages.g[p + k] = (work.g[k] - stages.g[k]) / h
    return -1


@kernel
def go_on(division, h, monitor):
    """Move on to the end of a piece that stands; whether its step is done."""
    level = int(division.level)
    division.deep = division.deep + 1.0 if level > FINEST else 0.0
    if level > 0:
        division.split = 1.0
        length = h * SHARES[level]
        if monitor.smallest_step == 0.0 or length < monitor.smallest_step:
            monitor.smallest_step = length
    position = int(division.position) + (UNITS >> level)
    if level > 0 and division.easy > 0.0 and position % (2 * (UNITS >> level)) == 0:
        division.level -= 1.0
    division.position = position % UNITS
    if position < UNITS:
        return False
    monitor.divided += division.split
    division.split = 0.0
    return True


@kernel
def halve(faults, step, h, which, problem, work, monitor):
    """Take back a piece that failed: half of it comes next; False if there is nothing finer.

    How the run ends is then latched in the monitor. Outputs cannot leave in continuous time where
    the whole barrier acts on them as they are; if they do all the same, it is the step that fails,
    not the law.

    Args:
        faults: module of kernels.
        step: which, of length h in s.
        which: the constraint that is why, if nothing has left.
        problem, work, monitor: of the run.
    """
    division = work.division
    left = monitor.exit == watch.LEFT_SET
    obeyed = True
    for r in range(len(work.u)):
        obeyed &= work.u[r] == work.commanded[r]
    guarded = obeyed and problem.settings[GUARDED] > 0.0 and faults.measured(problem)
    level = int(division.level)
    doubtful = (left and obeyed and not guarded) or level > FINEST
    division.known = NOTHING
    if level < FINEST or (doubtful and level < DEEPEST and division.deep < PIECES):
        division.level += 1.0
        division.calm = 0.0
        watch.forget_exit(monitor)
        return True
    if left and (guarded or (doubtful and level < DEEPEST)):
        which = int(monitor.exit_constraint)
        watch.forget_exit(monitor)
    start = work.stages.g
    watch.leave(
        monitor, watch.STEP_TOO_SMALL, begins(division, step, h), -1, which, start[which], 0
    )
    division.position = 0.0
    return False
