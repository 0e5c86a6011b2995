"""The open-loop equilibrium over a horizon, as a variational inequality of the inputs: kernels.

A plan is K inputs, each held for a knot of some control periods. Agent i's cost is that of the
outputs at the knots' ends and of its own inputs, sum_j J_i(Y_j) + effort |u_i,j|^2 / 2, all under
g(Y_j) <= s_j, |u| <= limit, s_j >= 0. What all multipliers share is a variational inequality of
all inputs U,

    G(U) = (sum_j S_ji^T F(Y_j(U)) + effort u_i)_i,    S_ji = dY_j / du_i

beside PRICE + s_j for the slacks of knots, which are nobody's: where the bounds can be kept s = 0,
as long as no multiplier exceeds PRICE. It is linearised where the last solution leads, with the
constraints' curvature, and solved again until plans agree. Y_j are the plant's own; S_ji is by a
difference of the first input by one, S_ji = S_(j-i) for later ones: exact of linear plants.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj import game_functions as games
from gne_mj.controllers.plant_model import outputs_at_knots
from gne_mj.controllers.programs import linearised, solver_in
from gne_mj.native import copy, kernel, released, reserved
from gne_mj.quadratic_program import (
    RELAXED,
    UNBOUNDED,
    VARIATIONAL,
    clear,
    program_in,
    program_length,
    solve,
)
from gne_mj.records import in_array

PRICE = 1e4  # of a slack, in the costs' unit over the constraints'
SLACK = 1e-9  # of a bound that is kept, in the constraints' unit
MOST = 40  # programs for one plan
AGREES = 1e-9  # plans whose inputs differ by less, beside their size, are the same


class Plan(NamedTuple):
    """What a plan is looked for with."""

    u: Annotated[np.ndarray, "knots, m"]
    pulsed: Annotated[np.ndarray, "knots, m"]  # the same, the first input raised by one
    reached: Annotated[np.ndarray, "knots, m"]  # Y
    response: Annotated[np.ndarray, "knots, m"]  # S_0, S_1, ...
    gradient: Annotated[np.ndarray, "m"]  # F at a knot
    slope: Annotated[np.ndarray, "m, m"]  # dF/dy and the constraints' curvature there
    values: Annotated[np.ndarray, "p"]
    jacobian: Annotated[np.ndarray, "p, m"]


_plan_length, _plan_in = in_array(Plan, "knots m p")


@kernel
def respond(problem, work, y, periods, plan):
    """Fill the outputs that the plan leads to, and how they respond to its first input."""
    knots, m = plan.u.shape
    outputs_at_knots(problem, work, y, knots, periods, plan.u, plan.reached)
    for j in range(knots):
        for a in range(m):
            plan.pulsed[j, a] = plan.u[j, a] + (1.0 if j == 0 else 0.0)
    outputs_at_knots(problem, work, y, knots, periods, plan.pulsed, plan.response)
    for j in range(knots):
        for a in range(m):
            plan.response[j, a] -= plan.reached[j, a]


@kernel
def add_bend(data, k, y, weight, out):
    """Add weight d2g_k to out (m, m)."""
    at, members = data.offsets, data.member_index
    first, last = data.member_pointer[k], data.member_pointer[k + 1]
    for row in range(first, last):
        for a in range(at[members[row]], at[members[row] + 1]):
            for column in range(first, last):
                for b in range(at[members[column]], at[members[column] + 1]):
                    out[a, b] += weight * games.constraint_hessian(data, k, a, b, y)


@kernel
def look(problem, plan, program, j):
    """Evaluate costs and constraints at knot j."""
    data, y = problem.data, plan.reached[j]
    m, p, bounds = len(y), len(plan.values), len(program.upper) - len(program.matrix)
    games.gradients(data, data.everyone, y, plan.gradient)
    games.cost_rows(data, y, m, plan.slope)
    for k in range(p):
        for a in range(m):
            plan.jacobian[k, a] = 0.0
    linearised(problem, y, plan.values, plan.jacobian)
    for k in range(p):
        weight = program.multipliers[bounds + j * p + k]
        if weight > 0.0:
            add_bend(data, k, y, weight, plan.slope)


@kernel
def add_costs(plan, program, j):
    """Add what the costs of knot j make of G and its derivative."""
    m = plan.u.shape[1]
    for i in range(j + 1):
        for a in range(m):
            mine = plan.response[j - i, a]
            program.linear[i * m + a] += mine * plan.gradient[a]
            for b in range(m):
                slope = mine * plan.slope[a, b]
                for other in range(j + 1):
                    program.hessian[i * m + a, other * m + b] += slope * plan.response[j - other, b]


@kernel
def add_constraints(plan, program, j):
    """Write the rows of knot j."""
    knots, m = plan.u.shape
    p, bounds = len(plan.values), len(program.upper) - len(program.matrix)
    for k in range(p):
        row = j * p + k
        bound = -plan.values[k]
        for i in range(j + 1):
            for a in range(m):
                slope = plan.jacobian[k, a] * plan.response[j - i, a]
                program.matrix[row, i * m + a] = slope
                bound += slope * plan.u[i, a]
        program.matrix[row, knots * m + j] = -1.0
        program.upper[bounds + row] = bound


@kernel
def write(problem, effort, plan, program):
    """Write the inequality, linearised about the plan."""
    knots, m = plan.u.shape
    clear(program)
    for j in range(knots):
        look(problem, plan, program, j)
        add_costs(plan, program, j)
        add_constraints(plan, program, j)
    for i in range(knots):
        for a in range(m):
            entry, limit = i * m + a, problem.limit[a]
            for other in range(knots):
                for b in range(m):
                    program.linear[entry] -= (
                        program.hessian[entry, other * m + b] * plan.u[other, b]
                    )
            program.hessian[entry, entry] += effort
            program.lower[entry] = -min(limit, UNBOUNDED)
            program.upper[entry] = min(limit, UNBOUNDED)
        slack = knots * m + i
        program.hessian[slack, slack] = 1.0
        program.linear[slack] = PRICE
        program.lower[slack] = 0.0


@kernel
def first_input(problem, work, y, shape, effort, u):
    """Fill u (m,) with the first input of the equilibrium plan; how the last program ended, RELAXED
    where a knot has a slack.

    Args:
        problem, work: of the run.
        y: outputs (m,) now, as they are seen.
        shape: knots, and how many control periods each lasts.
        effort: what inputs cost.
        u: filled.
    """
    knots, m, p = shape[0], len(u), len(problem.data.tightening)
    unknown, rows = knots * (m + 1), knots * p
    length = program_length(unknown, rows, unknown, 1)
    room = reserved(length + _plan_length(knots, m, p))
    program, plan = (
        program_in(room, 0, unknown, rows, unknown, 1),
        _plan_in(room[length:], 0, knots, m, p),
    )
    for k in range(unknown + rows):
        program.multipliers[k] = 0.0
    for j in range(knots):
        for a in range(m):
            plan.u[j, a] = 0.0
    ended = 0
    for _ in range(MOST):
        respond(problem, work, y, shape[1], plan)
        write(problem, effort, plan, program)
        ended = solve(solver_in(problem), program, VARIATIONAL)
        if ended <= 0:
            break
        moved, size = 0.0, 1.0
        for j in range(knots):
            for a in range(m):
                found = program.x[j * m + a]
                moved, size = max(moved, abs(found - plan.u[j, a])), max(size, abs(found))
                plan.u[j, a] = found
        if moved <= AGREES * size:
            break
    copy(plan.u[0], u)
    for j in range(knots):
        if ended > 0 and program.x[knots * m + j] > SLACK:
            ended = RELAXED
    released(room)
    return ended
