"""Mode implicit, all agents' inputs together: the law as it stands at the outputs it produces.

u = -barrier_free(y+) - dphi(y+) with y+ = base + slope u is strongly monotone in y+ wherever all
slopes are positive, so that it has one solution, strictly inside.
"""

import sys

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers.settings import GAIN
from gne_mj.loops import functions
from gne_mj.loops.newton import newton
from gne_mj.native import kernel

_EQUATION = sys.modules[__name__]
ALONE = False  # whether each agent solves by itself


@kernel
def solve(problem, memory, work, solver):
    """Fill solver.y from solver.base and solver.slope; returns how that ended."""
    agents = len(problem.data.offsets) - 1
    return newton(_EQUATION, problem, 0, agents, True, memory, work, solver)


@kernel
def row_of(problem, first, r):
    """The matrix's row of action r, ordered for a narrow band."""
    return problem.order.position[r]


@kernel
def residual(problem, first, last, memory, work, solver):
    """Fill solver.residual at solver.trial; False if that is not strictly inside."""
    data, y, column, within = problem.data, solver.trial, problem.order.column, problem.order.within
    weight = problem.settings[GAIN] * solver.numbers.rho
    games.values(data, data.all_constraints, y, solver.inverse)
    for k in range(len(solver.inverse)):
        slack = -solver.inverse[k] - data.tightening[k]
        if not slack > 0.0:
            work.now.tightened = k
            work.now.tightened_value = -slack
            return False
        solver.inverse[k] = 1.0 / slack
    functions.barrier_free_terms(problem, first, last, y, memory, solver.residual)
    for a in range(len(y)):
        barrier_free = solver.residual[a]
        solver.residual[a] = (y[a] - solver.base[a]) * solver.stiff[a] + barrier_free
    games.slopes(data, data.all_constraints, problem.order.start, column, y, solver.jacobian)
    for entry in range(len(column)):  # one loop without others inside is twice as fast
        k, a = within[entry], column[entry]
        solver.residual[a] += weight * solver.inverse[k] * solver.jacobian[entry]
    return True


@kernel
def assemble(problem, first, last, b, memory, work, solver):
    """Fill the band with the residual's derivative where it was evaluated last."""
    data, y, start, column = problem.data, solver.trial, problem.order.start, problem.order.column
    at, position, band = data.offsets, problem.order.position, solver.band
    scale = problem.settings[GAIN] * solver.numbers.rho
    for a in range(len(y)):
        i, r = data.owner[a], position[a]
        for c in range(2 * b + 1):
            band[r, c] = 0.0
        band[r, b] = solver.stiff[a]
        functions.add_barrier_free_slope(problem, i, a, y, memory, solver.row)
        for member in range(data.cost_pointer[i], data.cost_pointer[i + 1]):
            j = data.cost_index[member]
            for c in range(at[j], at[j + 1]):
                band[r, position[c] - r + b] += solver.row[c]
                solver.row[c] = 0.0
    for k in range(len(solver.inverse)):
        inverse = solver.inverse[k]
        weight = scale * inverse
        for entry in range(start[k], start[k + 1]):
            a = column[entry]
            r, slope = position[a], solver.jacobian[entry] * inverse
            for other in range(start[k], start[k + 1]):
                c = column[other]
                second = games.constraint_hessian(data, k, a, c, y)
                second += slope * solver.jacobian[other]
                band[r, position[c] - r + b] += weight * second


@kernel
def local_length(problem, first, last, memory, step, solver):
    """The step's length in the barrier's own norm, that of the worst action and constraint.

    With s = -g - t its square is (dg step / s)^2 + d2g step^2 / s: where a gap vanishes, dg does.
    """
    order, data, greatest = problem.order, problem.data, 0.0
    for entry in range(len(order.column)):
        k, a = order.within[entry], order.column[entry]
        moved = step[order.position[a]]
        change = solver.jacobian[entry] * moved * solver.inverse[k]
        second = abs(games.constraint_hessian(data, k, a, a, solver.trial))
        change = change * change + second * moved * moved * solver.inverse[k]
        if not change <= greatest:
            greatest = change
    return np.sqrt(greatest)
