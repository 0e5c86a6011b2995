"""The input nearest to a goal whose outputs after a period meet constraints: a program solved anew.

minimise |u - goal|^2 / 2  subject to  g(y+(u)) <= bound, |u| <= limit

y+ is the plant's own map over a control period, or y + T u. Neither it nor g need be affine. As in
sequential quadratic programming both are linearised where the last program's solution leads, with
the constraints' curvature, weighed by its multipliers, in H; the map's slope is by a difference of
inputs by one. Where that comes to rest nothing is approximate: constraints hold at y+ itself.
"""

from gne_mj import game_functions as games
from gne_mj.controllers.plant_model import outputs_at_knots
from gne_mj.controllers.programs import linearised, solver_in
from gne_mj.native import copy, kernel, released, reserved
from gne_mj.quadratic_program import QUADRATIC, clear, program_in, program_length, solve

MOST = 40  # programs for one input
AGREES = 1e-11  # inputs of two programs that differ by less, beside their size, are the same


@kernel
def reach(problem, work, y, period, u, out):
    """Fill out (m,) with the outputs after a control period: the plant's, or y + period u."""
    if period > 0.0:
        for a in range(len(u)):
            out[a] = y[a] + period * u[a]
    else:
        outputs_at_knots(problem, work, y, 1, 1, u, out)


@kernel
def add_block(data, k, i, j, y, weight, slope, program):
    """Of agents i and j in constraint k."""
    at = data.offsets
    for a in range(at[i], at[i + 1]):
        for b in range(at[j], at[j + 1]):
            second = games.constraint_hessian(data, k, a, b, y)
            program.hessian[a, b] += weight * slope[a] * slope[b] * second


@kernel
def add_curvature(problem, y, slope, program):
    """Add to H what constraints add to the Lagrangian: sum_l lambda_l S d2g_l S, S the slopes."""
    data, m = problem.data, len(y)
    for k in range(len(data.tightening)):
        weight = program.multipliers[m + k]
        if weight <= 0.0:
            continue
        members = data.member_index[data.member_pointer[k] : data.member_pointer[k + 1]]
        for row in range(len(members)):
            for column in range(len(members)):
                add_block(data, k, members[row], members[column], y, weight, slope, program)


@kernel
def write(problem, y, slope, goal, bound, u, program):
    """Write the program about u, whose outputs at the period's end are y (m,) with these slopes."""
    m, limit = len(y), problem.limit
    clear(program)
    values = program.upper[m:]
    linearised(problem, y, values, program.matrix)
    add_curvature(problem, y, slope, program)
    for a in range(m):
        program.linear[a] = -goal[a]
        for b in range(m):
            program.linear[a] -= program.hessian[a, b] * u[b]
    for k in range(len(bound)):
        values[k] = bound[k] - values[k]
        for a in range(m):
            program.matrix[k, a] *= slope[a]
            values[k] += program.matrix[k, a] * u[a]
    for a in range(m):
        program.hessian[a, a] += 1.0
        program.lower[a], program.upper[a] = -limit[a], limit[a]


@kernel
def nearest(problem, work, y, period, goal, bound, u):
    """Fill u (m,); how the last program ended, not positive where it has no solution.

    Args:
        problem, work: of the run.
        y: outputs (m,) now, as they are seen.
        period: in s, of y + period u; 0 for the plant's own map.
        goal: (m,) what u is to be near to.
        bound: (p,) of g + t at the outputs reached.
        u: filled.
    """
    m, p, ended = len(u), len(bound), 0
    length = program_length(m, p, m, 1)
    room = reserved(length + 3 * m)
    program, reached = program_in(room, 0, m, p, m, 1), room[length : length + m]
    slope, tried = room[length + m : length + 2 * m], room[length + 2 * m :]
    for k in range(m + p):
        program.multipliers[k] = 0.0
    for a in range(m):
        u[a] = min(max(goal[a], -problem.limit[a]), problem.limit[a])
    for _ in range(MOST):
        reach(problem, work, y, period, u, reached)
        for a in range(m):
            tried[a] = u[a] + 1.0
        reach(problem, work, y, period, tried, slope)
        for a in range(m):
            slope[a] -= reached[a]
        write(problem, reached, slope, goal, bound, u, program)
        ended = solve(solver_in(problem), program, QUADRATIC)
        if ended <= 0:
            break
        moved, size = 0.0, 1.0
        for a in range(m):
            moved, size = max(moved, abs(program.x[a] - u[a])), max(size, abs(u[a]))
        copy(program.x, u)
        if moved <= AGREES * size:
            break
    released(room)
    return ended
