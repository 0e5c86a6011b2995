"""Newton's method on the strongly monotone equation of mode implicit, kept inside its domain.

For some agents' outputs y at the end of a control period it solves

    (y - base) / slope + barrier_free(y) + (gradient of the barrier at y) = 0,

where ``base + slope * u`` is what the plant reaches under the held input u. ``equation`` is the
module that says which agents solve together and where their barriers look:
:mod:`gne_mj.loops.joint`, :mod:`gne_mj.loops.apart` or :mod:`gne_mj.loops.local`. Its derivative's
symmetric part is positive definite, so Newton's direction lowers the residual's norm, and halving
the step until it does so and stays inside converges from every interior start. Each iterate is
strictly inside, so that the set is kept even by one that is not accurate.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj import banded
from gne_mj.native import copy, kernel
from gne_mj.numbers import Numbers
from gne_mj.records import in_array

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


class SolverNumbers(Numbers):
    """What mode implicit counts and keeps."""

    found: float  # inputs so far
    steps: float  # taken for the present one
    moves: float  # how much an agent's barrier profile moves with its action
    uses: float  # how often the factors were used
    leaves: float  # what they leave of an error
    rho: float  # the penalty that is solved for
    solved_step: float  # the step (plus 1) that was solved for last
    length: float  # steps in the period that slopes are of, where periods may be cut


class InputSolver(NamedTuple):
    """Arrays of mode implicit, views into a loop's ``work.solver``."""

    numbers: SolverNumbers
    slope: Annotated[np.ndarray, "m"]  # dy+/du of each channel; kept from period to period
    stiff: Annotated[np.ndarray, "m"]  # 1 / slope
    prediction: Annotated[np.ndarray, "m"]  # outputs expected at the next control instant; kept
    # the input that was asked for last; kept, as the two before it
    held: Annotated[np.ndarray, "m"]
    before: Annotated[np.ndarray, "m"]
    earlier: Annotated[np.ndarray, "m"]
    # the input under which outputs would stay, with compensation; else zero
    keeping: Annotated[np.ndarray, "m"]
    base: Annotated[np.ndarray, "m"]
    reached: Annotated[np.ndarray, "m"]  # predicted outputs under an input
    u: Annotated[np.ndarray, "m"]  # that input
    y: Annotated[np.ndarray, "m"]  # the iterate
    trial: Annotated[np.ndarray, "m"]
    residual: Annotated[np.ndarray, "m"]
    step: Annotated[np.ndarray, "m"]  # in the order of the matrix's rows
    old_step: Annotated[np.ndarray, "m"]  # by the factors of an earlier period
    row: Annotated[np.ndarray, "m"]  # zero between uses
    anchor: Annotated[np.ndarray, "m"]  # outputs as the law has them
    mixed: Annotated[np.ndarray, "m"]  # the same, but for the agent that is solving
    # where agents' barriers see their own actions if they do not move
    own: Annotated[np.ndarray, "m"]
    inverse: Annotated[np.ndarray, "p"]  # 1 / (-g - t) at the trial
    # dg_l/dy_a there, constraint by constraint, for the actions in it
    jacobian: Annotated[np.ndarray, "entries"]
    state: Annotated[np.ndarray, "m * states"]  # flat, as the law has it
    rolled: Annotated[np.ndarray, "m * states"]  # flat, the prediction's
    scratch: Annotated[np.ndarray, "5 * states"]  # five times a channel's state
    band: Annotated[np.ndarray, "m, 2 * b + 1"]  # factors of half bandwidth b, kept


# Of m actions, p constraints, so many entries of dg/dy, and states of a channel
solver_length, _views = in_array(InputSolver, "m p entries states b")


@kernel
def solver_in(flat, order, p, states):
    """The views into ``work.solver``."""
    return _views(flat, 0, len(order.position), p, len(order.column), states, order.band[0])


@kernel
def newton(equation, problem, first, last, reuse, memory, work, solver):
    """Solve for the outputs solver.y of agents ``first`` to ``last`` - 1, from solver.y.

    If that is not in the domain, the outputs seen now or those that the last solution expected are
    taken. Factors of the last period are used again, if ``reuse``, as long as that is accurate.
    Returns how it ended; solver.numbers.steps grows by the iterations taken.
    """
    at, numbers, b = problem.data.offsets, solver.numbers, problem.order.band[0]
    target, patience = work.now.penalty, PATIENCE
    numbers.rho = target
    low, high = at[first], at[last]
    y, trial, step, old = solver.y, solver.trial, solver.step, solver.old_step
    starts, length, norm, remaining = 0, 0.0, np.inf, np.inf
    for _ in range(MOST_EVALUATIONS):
        copy(y[low:high], trial[low:high])
        if length > 0.0:
            add_step(equation, problem, first, length, step, trial[:high])
        patience -= 1
        if patience < 0 and numbers.rho < 1e12 * target:
            numbers.rho *= RAISE
            length, patience = 0.0, PATIENCE
            copy(y[low:high], trial[low:high])
        good = equation.residual(problem, first, last, memory, work, solver)
        if length == 0.0 and not good:
            if starts == 2:
                return OUTSIDE
            source = solver.anchor if starts == 0 else solver.prediction
            copy(source[low:high], y[low:high])
            starts, patience = starts + 1, PATIENCE
            continue
        size = put_residual(equation, problem, first, last, solver.residual, old)
        if length > 0.0:
            if not (good and size <= (1.0 - DECREASE * length) * norm):
                length *= 0.5
                if length < SHORTEST:  # rounding hides what is left
                    return ROUNDED if remaining < GOOD_STEP else UNSOLVED
                continue
            copy(trial[low:high], y[low:high])
        norm, numbers.steps = size, numbers.steps + 1.0
        usable = reuse and numbers.uses > 0.0 and numbers.rho == target
        if usable:
            banded.solve_definite(solver.band, high - low, b, old)
            if numbers.uses < MOST_USES:
                remaining = equation.local_length(problem, first, last, memory, old, solver)
                if remaining * max(numbers.leaves, remaining) <= ACCURATE:
                    numbers.uses += 1.0
                    return arrive(equation, problem, first, old, y[:high])
        if not find_step(equation, problem, first, last, memory, work, solver):
            return UNSOLVED
        numbers.leaves, numbers.uses = share_left(high - low, solver) if usable else 1.0, 1.0
        remaining = equation.local_length(problem, first, last, memory, step, solver)
        if not remaining < np.inf:
            return UNSOLVED
        length = 1.0
        if numbers.rho > target and remaining <= CENTRED:
            numbers.rho = max(target, LOWER * numbers.rho)
            length, patience = 0.0, PATIENCE
        elif remaining <= LAST_STEP:
            return arrive(equation, problem, first, step, y[:high])
    return UNSOLVED


@kernel
def arrive(equation, problem, first, step, y):
    """Take the last step."""
    add_step(equation, problem, first, 1.0, step, y)
    return SOLVED


@kernel
def find_step(equation, problem, first, last, memory, work, solver):
    """Factorise, and fill solver.step with Newton's; False if the matrix is not definite."""
    at, b = problem.data.offsets, problem.order.band[0]
    n = at[last] - at[first]
    equation.assemble(problem, first, last, b, memory, work, solver)
    solver.numbers.uses = 0.0
    if not banded.factorise_definite(solver.band, n, b):
        return False
    put_residual(equation, problem, first, last, solver.residual, solver.step)
    banded.solve_definite(solver.band, n, b, solver.step)
    return True


@kernel
def add_step(equation, problem, first, length, step, y):
    """Move the outputs y of agents from ``first`` to its end by so much of a step."""
    for r in range(problem.data.offsets[first], len(y)):
        y[r] += length * step[equation.row_of(problem, first, r)]


@kernel
def put_residual(equation, problem, first, last, residual, rows):
    """Fill rows with the negative residual, in the equation's order; its squared norm."""
    at, size = problem.data.offsets, 0.0
    for r in range(at[first], at[last]):
        rows[equation.row_of(problem, first, r)] = -residual[r]
        size += residual[r] * residual[r]
    return size


@kernel
def share_left(n, solver):
    """What the step by old factors has left of the error, at most 1, from the step by new ones."""
    off, whole = 0.0, 0.0
    for r in range(n):
        off = max(off, abs(solver.step[r] - solver.old_step[r]))
        whole = max(whole, abs(solver.step[r]))
    return min(2.0 * off / whole, 1.0) if whole > 0.0 else 1.0
