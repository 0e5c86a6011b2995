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
    draw,
    farthest_move,
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
    near, rule = neighbours_in(work.separation, problem, work.origin), rule_of(problem, work.origin)
    agents = len(problem.data.offsets) - 1
    while True:
        ordered = in_order(problem, rule, near, solver)
        ended = newton(_EQUATION, ordered, 0, agents, True, Kept(memory, near, rule), work, solver)
        if ended == OUTSIDE or not add_pairs(rule, near, solver.y):
            return ended


@kernel
def add_pairs(rule, near, y):
    """Add the pairs that outputs y (m,) bring near, and their half-planes; whether there are any.

    That is half way from the reach to the least distance. Agents that were not near are not even
    there as long as none of them has moved by a quarter of the way.
    """
    quarter = 0.25 * (rule.reach - rule.distance)
    count = int(near.numbers.pairs)
    if not farthest_move(rule, near, y)[0] > quarter:
        return False
    cells.find(rule.origin, near, near.place, y, rule.distance + 2.0 * quarter, rule.reach)
    for k in range(count, int(near.numbers.pairs)):
        draw(rule, near, k)
    return near.numbers.pairs > count


@kernel
def in_order(problem, rule, near, solver):
    """The problem with the order of Newton's matrix for the pairs that are near."""
    numbers, m, mark, d = near.numbers, len(near.place), 0.0, len(rule.origin)
    position = integers_at(address_in(near.position), m)
    band = integers_at(address_in(near.band), 2)
    changed = band[0] == 0 or numbers.before != numbers.pairs
    for k in range(int(numbers.pairs)):
        i, j = d * int(near.first[k]), d * int(near.second[k])
        mark += (i + 1.0) * m + j
        changed |= abs(position[i] - position[j]) + d - 1 > band[0]
    if changed or numbers.mark != mark:
        numbers.before, numbers.mark = numbers.pairs, mark
        put_in_line(near, rule.origin, position, band[0] == 0)
        band[0] = half_band(problem, near, rule.origin, position)
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
def put_in_line(near, origin, position, first):
    """Sort agents along the line on which their outputs are spread the most; fill their rows.

    That is level, or upright.
    """
    line, y, d = near.line, near.output, len(origin)
    n = len(line)
    if first:
        for i in range(n):
            line[i] = i
    along = direction(origin, y, n)
    for k in range(1, n):  # few have changed places since the last time
        agent, at = int(line[k]), k
        value = cells.dot(along, cells.middle(origin, y, y, agent))
        while at > 0:
            other = cells.middle(origin, y, y, int(line[at - 1]))
            if not cells.dot(along, other) > value:
                break
            line[at] = line[at - 1]
            at -= 1
        line[at] = agent
    for k in range(n):
        agent = int(line[k])
        for a in range(d):
            position[d * agent + a] = d * k + a


@kernel
def direction(origin, points, n):
    """The level or upright unit vector along which n points are spread the most."""
    along, across, up = 0.0, 0.0, 0.0
    for i in range(n):
        x, y, z = cells.middle(origin, points, points, i)
        along, across, up = along + x / n, across + y / n, up + z / n
    xx, xy, yy, zz = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        x, y, z = cells.middle(origin, points, points, i)
        a, b, c = x - along, y - across, z - up
        xx, xy, yy, zz = xx + a * a, xy + a * b, yy + b * b, zz + c * c
    if zz > 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy):
        return 0.0, 0.0, 1.0
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    return np.cos(angle), np.sin(angle), 0.0


@kernel
def half_band(problem, near, origin, position):
    """How far apart rows of agents are at most that costs, constraints or pairs couple."""
    data, farthest, d = problem.data, 0, len(origin)
    for i in range(len(data.cost_pointer) - 1):
        for member in range(data.cost_pointer[i], data.cost_pointer[i + 1]):
            other = data.cost_index[member]
            farthest = max(farthest, abs(position[d * i] - position[d * other]))
    for k in range(len(data.member_pointer) - 1):
        low, high = len(position), 0
        for member in range(data.member_pointer[k], data.member_pointer[k + 1]):
            row = position[d * data.member_index[member]]
            low, high = min(low, row), max(high, row)
        farthest = max(farthest, high - low)
    for k in range(int(near.numbers.pairs)):
        i, j = d * int(near.first[k]), d * int(near.second[k])
        farthest = max(farthest, abs(position[i] - position[j]))
    return farthest + d - 1


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
        d = len(rule.origin)
        i, j = d * int(near.first[k]), d * int(near.second[k])
        up = near.up[k] if d == 3 else 0.0
        n, stiff = (near.along[k], near.across[k], up), rho / (slack * slack)
        for a in range(d):
            for c in range(d):
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
    near, rule, position = kept.near, kept.rule, problem.order.position
    d = len(rule.origin)
    for k in range(int(near.numbers.pairs)):
        i, j = d * int(near.first[k]), d * int(near.second[k])
        change = near.along[k] * (step[position[i]] - step[position[j]])
        change += near.across[k] * (step[position[i + 1]] - step[position[j + 1]])
        if d == 3:
            change += near.up[k] * (step[position[i + 2]] - step[position[j + 2]])
        greatest = max(greatest, abs(change) / near.slack[k])
    return greatest
