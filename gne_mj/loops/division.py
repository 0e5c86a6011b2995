"""How mode continuous divides steps, so that the integrator follows the law near the boundary.

Where the barrier is stiff a whole step of an explicit method leaves the set that the law keeps. A
step is then taken in pieces of 1/2, 1/4, ... 1/4096 of it. Each piece is looked at when it is done:

- neither a stage nor the end may use up more than a quarter of any slack -g - t;
- Runge-Kutta 4: with z = |Y4 - 2 Y3 + Y1| / |Y3 - Y2| of the stages' outputs, which is the piece's
  length times the closed loop's greatest rate (Y2 and Y3 are both of the middle), each slack's error
  is about |g(Y3) - g(Y2)| z^3 / 30, and must be small;
- Euler: half of what a slack's rate has changed by since the piece before, times the length, must be
  small.

A piece that fails is taken back and halved. One that succeeds by far is followed by one of twice its
length, where that lies on the coarser grid and no piece has failed lately. All this depends on the
present state alone, which ``work.division`` is part of, so that a run comes out the same however it
is cut into calls. A step that needs no division costs a comparison for each constraint and stage.

Outputs, slacks and (in runs without faults) the law are evaluated at a piece's end to be looked at;
the next piece begins with them in place of evaluating them again.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.settings import GUARDED
from gne_mj.loops import monitor as watch
from gne_mj.native import copy, kernel

FINEST = 12  # steps are halved at most so often
PIECES = 1 << FINEST
SHARES = tuple(2.0**-level for level in range(FINEST + 1))

# Entries of ``work.division``, before the arrays of Stages
LEVEL = 0  # pieces are 2^-LEVEL of a step
POSITION = 1  # where in its step the next piece begins, in 1/PIECES of it
CALM = 2  # pieces since one failed
KNOWN = 3  # what is evaluated at the present state, one of the constants below
SPOILT = 4  # 1: a stage of this piece used up too much of a slack
SPLIT = 5  # 1: the present step is divided
BEFORE = 6  # Euler: whether Stages.change has the rates of a piece before
EASY = 7  # 1: twice the length is sure to do
HEADER = 8

END = -1  # in place of a stage's number: the end of a piece
NOTHING, OUTPUTS, LAW = range(3)  # KNOWN: outputs and slacks; these and what the law asks for

USE = 0.25  # the greatest part of a slack that a piece may use up
# The greatest error of a slack in a piece of Runge-Kutta 4, relative to the slack and to its typical
# size; at the finest pieces so many times that, there being nothing finer
OF_SLACK, OF_SIZE, LAST_RESORT = 1e-6, 3e-8, 100.0
OF_SLACK_EULER = 0.01
GROWTH = 64.0  # twice the length has 2^5 times the error; with a reserve
ROUNDING = 1e-13  # stages that differ by less of the outputs' size tell nothing of stiffness
STIFFEST = 4.0  # all that a greater z tells is that the method is unstable
CALM_FOR = 32  # pieces after a failure before twice the length is tried again


class Stages(NamedTuple):
    """What a piece's stages have shown; views of ``work.division``."""

    y: np.ndarray  # (4 m,) outputs at the stages
    start: np.ndarray  # (p,) g at the piece's start
    room: np.ndarray  # (p,) by how much g may rise
    change: np.ndarray  # (p,) |g(Y3) - g(Y2)|; under Euler's method the rates of g in the last one


@kernel
def length(m, p):
    """Entries of ``work.division``."""
    return HEADER + 4 * m + 3 * p


@kernel
def stages_of(division, m, p):
    """The arrays in ``work.division``."""
    at = HEADER + 4 * m
    return Stages(
        division[HEADER:at],
        division[at : at + p],
        division[at + p : at + 2 * p],
        division[at + 2 * p : at + 3 * p],
    )


def typical_sizes(
    outputs: NDArray[np.float64], slacks: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What errors are compared with: (1 + p,), the outputs' size and that of each slack.

    Args:
        outputs: (k, m) typical ones, as at the start and at the equilibrium.
        slacks: (k, p) -g - t there. What is not finite does not count.
    """
    finite = np.isfinite(outputs)
    output = np.max(np.abs(outputs), initial=0.0, where=finite)
    slack = np.max(slacks, axis=0, initial=0.0, where=np.isfinite(slacks))
    return np.concatenate([[output], slack])


@kernel
def piece(division, h):
    """Length in s of the present piece."""
    return h * SHARES[int(division[LEVEL])]


@kernel
def begins(division, step, h):
    """Time in s at which the present piece begins."""
    return step * h + division[POSITION] * (h * SHARES[FINEST])


@kernel
def ends(division, step, h):
    """Time in s at which it ends, to the bit that at which the next one begins."""
    position = division[POSITION] + PIECES * SHARES[int(division[LEVEL])]
    if position == PIECES:
        return (step + 1) * h
    return step * h + position * (h * SHARES[FINEST])


@kernel
def note(stage, problem, work):
    """Keep what a stage has shown; False if a slack has been used up too much."""
    m, p, g = len(work.y), len(work.g), work.g
    stages = stages_of(work.division, m, p)
    copy(work.y, stages.y[stage * m : (stage + 1) * m])
    if stage == 0:
        work.division[SPOILT] = 0.0
        tightening = problem.data.tightening
        for k in range(p):
            stages.start[k] = g[k]
            stages.room[k] = -USE * (g[k] + tightening[k])
        return True
    good = True
    for k in range(p):
        good &= g[k] - stages.start[k] <= stages.room[k]
    if stage == 1:
        copy(g, stages.change)
    elif stage == 2:
        for k in range(p):
            stages.change[k] = abs(g[k] - stages.change[k])
    if not good:
        work.division[SPOILT] = 1.0
    return good


@kernel
def stiffness(y, size):
    """z of the stages' outputs y (4 m,), at most STIFFEST; 0 where rounding hides it."""
    m = len(y) // 4
    bend, turn = 0.0, 0.0
    for r in range(m):
        bend = max(bend, abs(y[2 * m + r] - y[m + r]))
        turn = max(turn, abs(y[3 * m + r] - 2.0 * y[2 * m + r] + y[r]))
    if not bend > ROUNDING * size:
        return 0.0
    return min(turn / bend, STIFFEST)


@kernel
def error_of(count, h, problem, work, stages):
    """The greatest error of a slack in a piece over what is allowed, and whose that is.

    Args:
        count: stages of the method; one means Euler's.
        h: the piece's length in s.
        problem, work: of the run; work.g is of the piece's end.
        stages: what the piece has shown.
    """
    worst, which, g = 0.0, 0, work.g
    if count > 1:
        z = stiffness(stages.y, problem.size[0])
        factor = z * z * z / 30.0
        for k in range(len(g)):
            allowed = min(OF_SLACK / USE * stages.room[k], OF_SIZE * problem.size[1 + k])
            if stages.change[k] * factor > worst * allowed:
                worst, which = stages.change[k] * factor / allowed, k
    elif work.division[BEFORE] > 0.0:
        for k in range(len(g)):
            error = 0.5 * abs(g[k] - stages.start[k] - h * stages.change[k])
            allowed = OF_SLACK_EULER / USE * stages.room[k]
            if error > worst * allowed:
                worst, which = error / allowed, k
    return worst, which


@kernel
def judge(count, h, problem, work):
    """Whether the piece whose end is evaluated may stand: -1, or the constraint that is why not."""
    division, g = work.division, work.g
    stages = stages_of(division, len(work.y), len(g))
    finest = division[LEVEL] == FINEST
    error, which = error_of(count, h, problem, work, stages)
    if not error <= (LAST_RESORT if finest else 1.0):
        return which
    most = 0.0  # of the room for a slack that is used
    for k in range(len(g)):
        used = g[k] - stages.start[k]
        if used > most * stages.room[k]:
            most, which = used / stages.room[k], k
    if not finest and (most > 1.0 or division[SPOILT] > 0.0):
        return which
    if count == 1:
        division[BEFORE] = 1.0
        for k in range(len(g)):
            stages.change[k] = (g[k] - stages.start[k]) / h
    division[CALM] += 1.0
    easy = division[CALM] >= CALM_FOR and GROWTH * error < 1.0 and most < 0.4
    division[EASY] = 1.0 if easy else 0.0
    return -1


@kernel
def go_on(division, h, monitor):
    """Move on to the end of a piece that stands; whether its step is done."""
    level = int(division[LEVEL])
    if level > 0:
        division[SPLIT] = 1.0
        length = h * SHARES[level]
        if monitor[watch.SMALLEST_STEP] == 0.0 or length < monitor[watch.SMALLEST_STEP]:
            monitor[watch.SMALLEST_STEP] = length
    position = int(division[POSITION]) + (PIECES >> level)
    if level > 0 and division[EASY] > 0.0 and position % (2 * (PIECES >> level)) == 0:
        division[LEVEL] -= 1.0
    division[POSITION] = position % PIECES
    if position < PIECES:
        return False
    monitor[watch.DIVIDED] += division[SPLIT]
    division[SPLIT] = 0.0
    return True


@kernel
def halve(division, monitor):
    """Take back a piece that failed: half of it comes next; False if it is the finest."""
    division[KNOWN] = NOTHING
    if division[LEVEL] == FINEST:
        return False
    division[LEVEL] += 1.0
    division[CALM] = 0.0
    watch.forget_exit(monitor)
    return True


@kernel
def give_up(faults, step, h, which, problem, work, monitor):
    """Latch how a run ends whose finest piece has failed.

    Outputs cannot leave in continuous time where the whole barrier acts on them as they are; if
    they do all the same, it is the step that fails, not the law.

    Args:
        faults: module of kernels.
        step: which, of length h in s.
        which: the constraint that is why, if nothing has left.
        problem, work, monitor: of the run.
    """
    division = work.division
    start = stages_of(division, len(work.y), len(work.g)).start
    guarded = problem.settings[GUARDED] > 0.0 and faults.measured(problem)
    for r in range(len(work.u)):
        guarded &= work.u[r] == work.demand[r]
    if guarded and monitor[watch.EXIT] == watch.LEFT_SET:
        which = int(monitor[watch.EXIT_CONSTRAINT])
        watch.forget_exit(monitor)
    watch.leave(
        monitor, watch.STEP_TOO_SMALL, begins(division, step, h), -1, which, start[which], 0
    )
    division[POSITION] = 0.0
