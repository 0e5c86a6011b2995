"""Mode implicit, each agent by itself: its own input from what it has at the control instant.

Agent i takes the others' actions to be as it has them at the instant (measured, or estimates under
the fully distributed law). It looks at each constraint l where it would be if its own move were
n_l times as long, n_l being the number of agents in l:

    u_i = -pull_i(y_i+) - sum_l rho dg_l(p) / (-g_l(p)),  p = y + n_l (y_i+ - y_i) e_i.

The profile that all reach is the mean of those points p over the agents in l. If g_l is convex and
all p are strictly inside, so is it, whatever the others decide: each keeps to its share of what is
left of the bound. At an equilibrium nothing moves, and the law is the paper's. Without shares n_l
is taken to be 1 and nothing is promised.
"""

import sys

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers.settings import GAIN
from gne_mj.loops import functions
from gne_mj.loops.newton import OUTSIDE, SOLVED, newton
from gne_mj.native import copy, kernel

_EQUATION = sys.modules[__name__]
ALONE = True  # whether each agent solves by itself


@kernel
def solve(problem, memory, work, solver):
    """Fill solver.y agent by agent; returns the worst way in which one ended.

    If an agent has no action at all, work.now says at which constraint.
    """
    at, worst = problem.data.offsets, SOLVED
    copy(solver.anchor, solver.mixed)
    for i in range(len(at) - 1):
        moves = functions.own_profile(problem, i, solver.anchor, memory, work.profile)
        solver.numbers.moves = moves
        copy(work.profile[at[i] : at[i + 1]], solver.own[at[i] : at[i + 1]])
        ended = newton(_EQUATION, problem, i, i + 1, False, memory, work, solver)
        copy(solver.anchor[at[i] : at[i + 1]], solver.mixed[at[i] : at[i + 1]])
        worst = max(worst, ended)
        if ended == OUTSIDE:
            return worst
    return worst


@kernel
def row_of(problem, first, r):
    """The matrix's row of action r among the agent's own."""
    return r - problem.data.offsets[first]


@kernel
def pace(problem, k, solver):
    """How fast the agent's view of constraint k moves with its action: n_l times its own move."""
    pointer = problem.data.member_pointer
    share = pointer[k + 1] - pointer[k] if problem.order.band[1] > 0 else 1
    return solver.numbers.moves * share


@kernel
def look_along(problem, k, first, work, solver):
    """Set the agent's block of work.profile to where it looks at constraint k; its pace there."""
    at, scale = problem.data.offsets, pace(problem, k, solver)
    for a in range(at[first], at[first + 1]):
        work.profile[a] = solver.own[a] + scale * (solver.mixed[a] - solver.anchor[a])
    return scale


@kernel
def residual(problem, first, last, memory, work, solver):
    """Fill the agent's entries of solver.residual at solver.trial; False if it has no action."""
    data, rho, gain = problem.data, solver.numbers.rho, problem.settings[GAIN]
    low, high = data.offsets[first], data.offsets[first + 1]
    for a in range(low, high):
        solver.mixed[a] = solver.trial[a]
    functions.barrier_free_terms(problem, first, last, solver.mixed, memory, solver.residual)
    for a in range(low, high):
        solver.residual[a] += (solver.mixed[a] - solver.base[a]) * solver.stiff[a]
    slot = 0
    for entry in range(data.own_pointer[first], data.own_pointer[first + 1]):
        k = data.own_index[entry]
        look_along(problem, k, first, work, solver)
        slack = -games.constraint(data, k, work.profile) - data.tightening[k]
        if not slack > 0.0:
            work.now.tightened = k
            work.now.tightened_value = -slack
            return False
        solver.inverse[k] = 1.0 / slack
        for a in range(low, high):
            slope = games.constraint_gradient(data, k, a, work.profile)
            solver.jacobian[slot] = slope
            solver.residual[a] += gain * rho * solver.inverse[k] * slope
            slot += 1
    return True


@kernel
def assemble(problem, first, last, b, memory, work, solver):
    """Fill the band with the residual's derivative where it was evaluated last."""
    data, rho, gain = problem.data, solver.numbers.rho, problem.settings[GAIN]
    at, band = data.offsets, solver.band
    low, high = at[first], at[first + 1]
    for a in range(low, high):
        for c in range(2 * b + 1):
            band[a - low, c] = 0.0
        functions.add_barrier_free_slope(problem, first, a, solver.mixed, memory, solver.row)
        for member in range(data.cost_pointer[first], data.cost_pointer[first + 1]):
            j = data.cost_index[member]
            for c in range(at[j], at[j + 1]):
                if j == first:
                    band[a - low, c - a + b] += solver.row[c]
                solver.row[c] = 0.0
        band[a - low, b] += solver.stiff[a]
    for entry in range(data.own_pointer[first], data.own_pointer[first + 1]):
        k = data.own_index[entry]
        scale = look_along(problem, k, first, work, solver)
        weight = gain * rho * solver.inverse[k] * scale
        for a in range(low, high):
            slope = games.constraint_gradient(data, k, a, work.profile)
            slope *= solver.inverse[k]
            for c in range(low, high):
                second = games.constraint_hessian(data, k, a, c, work.profile)
                second += slope * games.constraint_gradient(data, k, c, work.profile)
                band[a - low, c - a + b] += weight * second


@kernel
def local_length(problem, first, last, memory, step, solver):
    """The step's length in the barrier's own norm, as :func:`gne_mj.loops.joint.local_length`."""
    data, greatest, slot = problem.data, 0.0, 0
    low, high = data.offsets[first], data.offsets[first + 1]
    for entry in range(data.own_pointer[first], data.own_pointer[first + 1]):
        k = data.own_index[entry]
        for a in range(low, high):
            moved = pace(problem, k, solver) * step[a - low]
            change = solver.jacobian[slot] * moved * solver.inverse[k]
            second = abs(games.constraint_hessian(data, k, a, a, solver.mixed))
            change = change * change + second * moved * moved * solver.inverse[k]
            if not change <= greatest:
                greatest = change
            slot += 1
    return np.sqrt(greatest)
