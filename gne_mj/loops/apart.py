"""Mode implicit, all agents' inputs together, with the half-planes of pairs that are near.

The equation of :mod:`gne_mj.loops.joint` with a barrier more for each such pair, which is convex.
Its solution is inside all half-planes, so that those of the next control instant exist. Where it
brings agents together that were not near, they are now: half-planes for them are added, and it is
solved again.

Newton's matrix is ordered anew whenever the pairs change: agents along the line on which they are
spread the most, so that the matrix is a band as wide as neighbours are apart.
"""

import sys
from typing import Any, NamedTuple

import numpy as np

from gne_mj.controllers.settings import GAIN
from gne_mj.loops import cells, joint
from gne_mj.loops.feedback import Order, Problem
from gne_mj.loops.newton import OUTSIDE, newton
from gne_mj.loops.separation import (
    add_pushes,
    half_plane,
    neighbours_in,
    push,
    rule_of,
    slack_at,
)
from gne_mj.native import address_in, kernel
from gne_mj.parameter_block import integers_at

_EQUATION = sys.modules[__name__]
ALONE = False  # whether each agent solves by itself


class Kept(NamedTuple):
    """What the equation is made of besides the game."""

    memory: Any  # the law's
    near: Any
    rule: Any


@kernel
def solve(problem, memory, work, solver):
    """Fill solver.y from solver.base and solver.slope; returns how that ended."""
    near, rule, agents = (
        neighbours_in(work.separation, problem),
        rule_of(problem),
        len(problem.data.offsets) - 1,
    )
    while True:
        ordered = in_order(problem, near, solver)
        ended = newton(_EQUATION, ordered, 0, agents, True, Kept(memory, near, rule), work, solver)
        if ended == OUTSIDE or not add_pairs(rule, near, solver.y):
            return ended


@kernel
def add_pairs(rule, near, y):
    """Add the pairs that outputs y (m,) bring near, and their half-planes; whether there are any.

    That is half way from the reach to the least distance. Agents that were not near are not even
    there as long as none of them has moved by a quarter of the way.
    """
    place, output, fast = near.place, near.output, False
    quarter = 0.25 * (rule.reach - rule.distance)
    for a in range(0, len(y), 2):
        across, up = y[a] - output[a], y[a + 1] - output[a + 1]
        fast |= across * across + up * up > quarter * quarter
    count = int(near.numbers.pairs)
    if not fast:
        return False
    cells.find(near, place, y, rule.distance + 2.0 * quarter, rule.reach)
    for k in range(count, int(near.numbers.pairs)):
        i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
        near.along[k], near.across[k], _ = half_plane(
            rule, place[i] - place[j], place[i + 1] - place[j + 1],
            output[i] - output[j], output[i + 1] - output[j + 1],
        )  # fmt: skip
    return near.numbers.pairs > count


@kernel
def in_order(problem, near, solver):
    """The problem with the order of Newton's matrix for the pairs that are near."""
    numbers, m, mark = near.numbers, len(near.place), 0.0
    position = integers_at(address_in(near.position), m)
    band = integers_at(address_in(near.band), 2)
    changed = band[0] == 0 or numbers.before != numbers.pairs
    for k in range(int(numbers.pairs)):
        i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
        mark += (i + 1.0) * m + j
        changed |= abs(position[i] - position[j]) >= band[0]
    if changed or numbers.mark != mark:
        numbers.before, numbers.mark = numbers.pairs, mark
        put_in_line(near, position, band[0] == 0)
        band[0] = half_band(problem, near, position)
        solver.numbers.uses = 0.0  # of factors in another order
    order = problem.order
    return Problem(
        problem.data, problem.graph, problem.settings, problem.limit, problem.equilibrium,
        problem.propagator, problem.schedule,
        Order(position, band, order.start, order.column, order.within), problem.faults,
        problem.size, problem.separation, problem.ahead, problem.kept, problem.model,
        problem.motion, problem.functions, problem.parameter_block,
    )  # fmt: skip


@kernel
def put_in_line(near, position, first):
    """Sort agents along the line on which their outputs are spread the most; fill their rows."""
    line, y = near.line, near.output
    n = len(line)
    along, up = 0.0, 0.0
    for i in range(n):
        along, up = along + y[2 * i] / n, up + y[2 * i + 1] / n
        if first:
            line[i] = i
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(n):
        a, b = y[2 * i] - along, y[2 * i + 1] - up
        xx, xy, yy = xx + a * a, xy + a * b, yy + b * b
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    c, s = np.cos(angle), np.sin(angle)
    for k in range(1, n):  # few have changed places since the last time
        agent, at = int(line[k]), k
        value = c * y[2 * agent] + s * y[2 * agent + 1]
        while at > 0:
            other = int(line[at - 1])
            if not c * y[2 * other] + s * y[2 * other + 1] > value:
                break
            line[at] = other
            at -= 1
        line[at] = agent
    for k in range(n):
        agent = int(line[k])
        position[2 * agent], position[2 * agent + 1] = 2 * k, 2 * k + 1


@kernel
def half_band(problem, near, position):
    """How far apart rows of agents are at most that costs, constraints or pairs couple."""
    data, farthest = problem.data, 0
    for i in range(len(data.cost_pointer) - 1):
        for member in range(data.cost_pointer[i], data.cost_pointer[i + 1]):
            other = data.cost_index[member]
            farthest = max(farthest, abs(position[2 * i] - position[2 * other]))
    for k in range(len(data.member_pointer) - 1):
        low, high = len(position), 0
        for member in range(data.member_pointer[k], data.member_pointer[k + 1]):
            row = position[2 * data.member_index[member]]
            low, high = min(low, row), max(high, row)
        farthest = max(farthest, high - low)
    for k in range(int(near.numbers.pairs)):
        i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
        farthest = max(farthest, abs(position[i] - position[j]))
    return farthest + 1


@kernel
def row_of(problem, first, r):
    """The matrix's row of action r."""
    return problem.order.position[r]


@kernel
def residual(problem, first, last, kept, work, solver):
    """Fill solver.residual at solver.trial; False if that is not strictly inside."""
    if not joint.residual(problem, first, last, kept.memory, work, solver):
        return False
    near, rule = kept.near, kept.rule
    rho, most = problem.settings[GAIN] * solver.numbers.rho, rule.reach - rule.distance
    for k in range(int(near.numbers.pairs)):
        slack = slack_at(rule, near, solver.trial, k)
        if not slack > 0.0:
            return False
        near.slack[k] = slack
        add_pushes(rule, near, k, -push(rho, slack, most), solver.residual)
    return True


@kernel
def assemble(problem, first, last, b, kept, work, solver):
    """Fill the band with the residual's derivative where it was evaluated last."""
    joint.assemble(problem, first, last, b, kept.memory, work, solver)
    near, rule, position, band = kept.near, kept.rule, problem.order.position, solver.band
    rho, most = problem.settings[GAIN] * solver.numbers.rho, rule.reach - rule.distance
    for k in range(int(near.numbers.pairs)):
        slack = near.slack[k]
        if not slack < most:
            continue
        i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
        n, stiff = (near.along[k], near.across[k]), rho / (slack * slack)
        for a in range(2):
            for c in range(2):
                bend = stiff * n[a] * n[c]
                at_i, at_j, to_i, to_j = (
                    position[i + a],
                    position[j + a],
                    position[i + c],
                    position[j + c],
                )
                band[at_i, to_i - at_i + b] += bend
                band[at_j, to_j - at_j + b] += bend
                band[at_i, to_j - at_i + b] -= bend
                band[at_j, to_i - at_j + b] -= bend


@kernel
def local_length(problem, first, last, kept, step, solver):
    """The step's length in the barrier's own norm, that of the worst action, constraint or pair."""
    greatest = joint.local_length(problem, first, last, kept.memory, step, solver)
    near, position = kept.near, problem.order.position
    for k in range(int(near.numbers.pairs)):
        i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
        change = near.along[k] * (step[position[i]] - step[position[j]])
        change += near.across[k] * (step[position[i + 1]] - step[position[j + 1]])
        greatest = max(greatest, abs(change) / near.slack[k])
    return greatest
