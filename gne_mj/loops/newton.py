"""Newton's method on the strongly monotone equation of mode implicit, kept inside its domain.

For some agents' outputs y at the end of a control period it solves

    (y - base) / slope + pull(y) + (gradient of the barrier at y) = 0,

where ``base + slope * u`` is what the plant reaches under the held input u. ``equation`` is the
module that says which agents solve together and where their barriers look:
:mod:`gne_mj.loops.joint` or :mod:`gne_mj.loops.local`. Its derivative's symmetric part is positive
definite, so Newton's direction lowers the residual's norm, and halving the step until it does so
and stays inside converges from every interior start. Each iterate is strictly inside, so that the
set is kept even by one that is not accurate.
"""

from typing import NamedTuple

import numpy as np

from gne_mj import banded
from gne_mj.controllers.settings import PENALTY
from gne_mj.native import copy, kernel

# How it ended
SOLVED, ROUNDED, UNSOLVED, OUTSIDE = range(4)

# A step this long in the barrier's own norm, in which a step of 1 may reach a bound, is the last:
# what is left after it is of the order of its square.
LAST_STEP = 1e-6
GOOD_STEP = 1e-3  # if rounding ends the progress before, the end still counts as accurate
DECREASE = 1e-4  # of the residual's norm, relative to the step's length
MOST_EVALUATIONS = 1000
# Along curved bounds a low penalty leaves only tiny steps. After so many evaluations it is raised,
# and lowered again by steps once Newton's step is this short.
PATIENCE, RAISE, LOWER, CENTRED = 25, 100.0, 0.2, 0.3
SHORTEST = 1e-14

# A step with factors of an earlier period is as good if its length, times what such factors have
# left of an error lately or the length itself, is within this; they are renewed after so many uses
# at the latest.
ACCURATE, MOST_USES = 1e-10, 12

# Entries of ``numbers``: how many inputs were found, steps taken, how much an agent's barrier
# profile moves with its action, how often the factors were used and what they leave of an error,
# the penalty that is solved for, and the step (plus 1) that was solved for last
FOUND, STEPS, MOVES, USES, LEAVES, RHO, STANDS, COUNT = range(8)


class Solver(NamedTuple):
    """Arrays of mode implicit, views into a loop's ``work.solver``."""

    numbers: np.ndarray  # see above
    slope: np.ndarray  # (m,) dy+/du of each channel; kept from period to period
    stiff: np.ndarray  # (m,) 1 / slope
    ahead: np.ndarray  # (m,) outputs that are expected at the next control instant; kept
    held: np.ndarray  # (m,) the input that was asked for last; kept, as the two before it
    before: np.ndarray  # (m,)
    earlier: np.ndarray  # (m,)
    base: np.ndarray  # (m,)
    reached: np.ndarray  # (m,) predicted outputs under an input
    u: np.ndarray  # (m,) that input
    y: np.ndarray  # (m,) the iterate
    trial: np.ndarray  # (m,)
    residual: np.ndarray  # (m,)
    step: np.ndarray  # (m,) in the order of the matrix's rows
    old_step: np.ndarray  # (m,) by the factors of an earlier period
    row: np.ndarray  # (m,) zero between uses
    anchor: np.ndarray  # (m,) outputs as the law has them
    mixed: np.ndarray  # (m,) the same, but for the agent that is solving
    own: np.ndarray  # (m,) where agents' barriers see their own actions if they do not move
    inverse: np.ndarray  # (p,) 1 / (-g - t) at the trial
    jacobian: np.ndarray  # dg_l/dy_a there, constraint by constraint, for the actions in it
    state: np.ndarray  # flat, as the law has it
    rolled: np.ndarray  # flat, the prediction's
    scratch: np.ndarray  # five times a channel's state
    band: np.ndarray  # (m, 2 b + 1) factors, kept


def solver_length(actions: int, constraints: int, entries: int, states: int, b: int) -> int:
    """Entries of ``work.solver``; ``entries`` are those of dg/dy, b the half bandwidth."""
    m, p = actions, constraints
    return COUNT + 18 * m + p + entries + 2 * m * states + 5 * states + m * (2 * b + 1)


@kernel
def solver_in(flat, m, p, states, b):
    """The views into ``work.solver``."""
    at = COUNT
    end = at + 18 * m
    w = end + p
    f = len(flat) - m * (2 * b + 1)
    s = f - 5 * states
    z = s - m * states
    x = z - m * states
    return Solver(
        flat[:at],
        flat[at : at + m],
        flat[at + m : at + 2 * m],
        flat[at + 2 * m : at + 3 * m],
        flat[at + 3 * m : at + 4 * m],
        flat[at + 4 * m : at + 5 * m],
        flat[at + 5 * m : at + 6 * m],
        flat[at + 6 * m : at + 7 * m],
        flat[at + 7 * m : at + 8 * m],
        flat[at + 8 * m : at + 9 * m],
        flat[at + 9 * m : at + 10 * m],
        flat[at + 10 * m : at + 11 * m],
        flat[at + 11 * m : at + 12 * m],
        flat[at + 12 * m : at + 13 * m],
        flat[at + 13 * m : at + 14 * m],
        flat[at + 14 * m : at + 15 * m],
        flat[at + 15 * m : at + 16 * m],
        flat[at + 16 * m : at + 17 * m],
        flat[at + 17 * m : at + 18 * m],
        flat[end:w],
        flat[w:x],
        flat[x:z],
        flat[z:s],
        flat[s:f],
        flat[f:].reshape((m, 2 * b + 1)),
    )


@kernel
def newton(equation, problem, first, last, b, reuse, memory, work, solver):
    """Solve for the outputs solver.y of agents ``first`` to ``last`` - 1, from solver.y.

    If that is not in the domain, the outputs seen now or those that the last solution expected are
    taken. Factors of the last period are used again, if ``reuse``, as long as that is accurate.
    Returns how it ended; solver.numbers[STEPS] grows by the iterations taken.
    """
    at, numbers = problem.data.offsets, solver.numbers
    target = work.now[PENALTY]
    numbers[RHO] = target
    patience = PATIENCE
    low, high = at[first], at[last]
    n = high - low
    y, trial, step = solver.y, solver.trial, solver.step
    starts, length, norm, remaining = 0, 0.0, np.inf, np.inf
    for _ in range(MOST_EVALUATIONS):
        if length == 0.0:
            for r in range(low, high):
                trial[r] = y[r]
        else:
            for r in range(low, high):
                trial[r] = y[r] + length * step[equation.row_of(problem, first, r)]
        patience -= 1
        if patience < 0 and numbers[RHO] < 1e12 * target:
            numbers[RHO] *= RAISE
            length, patience = 0.0, PATIENCE
            copy(y[low:high], trial[low:high])
        good = equation.residual(problem, first, last, memory, work, solver)
        if length == 0.0 and not good:
            patience = PATIENCE
            if starts == 2:
                return OUTSIDE
            source = solver.anchor if starts == 0 else solver.ahead
            copy(source[low:high], y[low:high])
            starts += 1
            continue
        size = 0.0
        for r in range(low, high):
            solver.old_step[equation.row_of(problem, first, r)] = -solver.residual[r]
            size += solver.residual[r] * solver.residual[r]
        if length > 0.0:
            if not (good and size <= (1.0 - DECREASE * length) * norm):
                length *= 0.5
                if length < SHORTEST:  # rounding hides what is left
                    return ROUNDED if remaining < GOOD_STEP else UNSOLVED
                continue
            copy(trial[low:high], y[low:high])
        norm = size
        numbers[STEPS] += 1.0
        usable = reuse and numbers[USES] > 0.0 and numbers[RHO] == target
        if usable:
            banded.solve_definite(solver.band, n, b, solver.old_step)
            if numbers[USES] < MOST_USES:
                remaining = equation.local_length(problem, first, last, solver.old_step, solver)
                if remaining * max(numbers[LEAVES], remaining) <= ACCURATE:
                    numbers[USES] += 1.0
                    for r in range(low, high):
                        y[r] += solver.old_step[equation.row_of(problem, first, r)]
                    return SOLVED
        equation.assemble(problem, first, last, b, memory, work, solver)
        numbers[USES] = 0.0
        if not banded.factorise_definite(solver.band, n, b):
            return UNSOLVED
        for r in range(low, high):
            step[equation.row_of(problem, first, r)] = -solver.residual[r]
        banded.solve_definite(solver.band, n, b, step)
        if usable:
            off, whole = 0.0, 0.0
            for r in range(n):
                off = max(off, abs(step[r] - solver.old_step[r]))
                whole = max(whole, abs(step[r]))
            numbers[LEAVES] = min(2.0 * off / whole, 1.0) if whole > 0.0 else 1.0
        else:
            numbers[LEAVES] = 1.0
        numbers[USES] = 1.0
        remaining = equation.local_length(problem, first, last, step, solver)
        if not remaining < np.inf:
            return UNSOLVED
        length = 1.0
        if numbers[RHO] > target and remaining <= CENTRED:
            numbers[RHO] = max(target, LOWER * numbers[RHO])
            length, patience = 0.0, PATIENCE
        elif remaining <= LAST_STEP:
            for r in range(low, high):
                y[r] += step[equation.row_of(problem, first, r)]
            return SOLVED
    return UNSOLVED
