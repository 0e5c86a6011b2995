"""Agents that keep apart: half-planes that turn, renewed at every control instant.

In space they are half-spaces. For each pair that is near, a unit vector n is found with
n.(q_i - q_j) > r and n.(y_i - y_j) > r, and until the next instant the law has a barrier of
r - n.(y_i - y_j) < 0 besides those of the game.
docs/positions.md has what that keeps. A barrier is pulled down to 0, with its slope, where its
slack is that of two agents at the reach, so that pairs become and cease to be near without a jump:
with s the slack and s_0 = reach - r it is rho (s/s_0 - log(s/s_0) - 1) for s < s_0.

In mode continuous half-planes are renewed at the start of every piece of a step. Like a constraint
of the game in :mod:`gne_mj.loops.division`, a slack may neither lose more than a quarter of itself
in a piece nor gain more than all of it, and no agent's output may go so far that pairs which are
not near would come too near.
"""

from typing import Annotated, Any, NamedTuple

import numpy as np

from gne_mj.controllers.settings import GAIN
from gne_mj.loops import cells, division
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import usable
from gne_mj.native import kernel
from gne_mj.numbers import Numbers
from gne_mj.records import in_array

UPRIGHT = 1e-9  # how level a direction is at least that turns about the vertical


class NeighbourNumbers(Numbers):
    """Of the pairs that are near."""

    pairs: float  # in the list
    renewed: float  # of these, those that were near at the last renewal
    before: float  # pairs when agents were last put in order, mode implicit
    mark: float  # and what their numbers added up to


class Neighbours(NamedTuple):
    """Pairs of agents that are near, and what finding them takes; a view of work.separation."""

    numbers: NeighbourNumbers
    first: Annotated[np.ndarray, "agents * (agents - 1) // 2"]
    second: Annotated[np.ndarray, "agents * (agents - 1) // 2"]
    along: Annotated[np.ndarray, "agents * (agents - 1) // 2"]  # n, first axis
    across: Annotated[np.ndarray, "agents * (agents - 1) // 2"]  # second axis
    up: Annotated[np.ndarray, "(axes - 2) * agents * (agents - 1) // 2"]  # third one, in space
    # n.(y_i - y_j) - r in m: at the renewal; in mode implicit at the trial
    slack: Annotated[np.ndarray, "agents * (agents - 1) // 2"]
    place: Annotated[np.ndarray, "axes * agents"]  # q at the renewal
    output: Annotated[np.ndarray, "axes * agents"]  # y there
    head: Annotated[np.ndarray, "4 * agents"]  # of each cell the agent that came last, or -1
    following: Annotated[np.ndarray, "agents"]  # the one before it in the same cell
    # Mode implicit: agents along a line, and each action's row of Newton's matrix with its half
    # bandwidth, these two whole numbers
    line: Annotated[np.ndarray, "agents"]
    position: Annotated[np.ndarray, "axes * agents"]
    band: Annotated[np.ndarray, "2"]


neighbours_length, _neighbours_in = in_array(Neighbours, "agents axes")


class Rule(NamedTuple):
    """How agents keep apart, in numbers."""

    distance: Any  # r in m
    reach: Any  # in m
    turn: Any  # in rad
    origin: Any  # cells.PLANE or cells.SPACE


@kernel
def rule_of(problem, origin):
    """Of a run."""
    numbers = problem.separation
    return Rule(numbers[0], numbers[1], numbers[2], origin)


@kernel
def neighbours_in(flat, problem, origin):
    """The views into ``work.separation``."""
    return _neighbours_in(flat, 0, len(problem.data.offsets) - 1, len(origin))


@kernel
def half_plane(rule, a, b):
    """The unit vector n of a pair with q_i - q_j = a and y_i - y_j = b, and |p|.

    p, the point of the segment from a to b that is nearest to 0, has the direction that is farthest
    from both. It is turned about the vertical (seen from above counter-clockwise) by up to
    ``rule.turn``, but by no more than leaves n.a - r and n.b - r half of |p| - r.
    """
    p = cells.nearest_point(a, b)
    size = np.sqrt(cells.dot(p, p))
    p = (p[0] / size, p[1] / size, p[2] / size)
    aside = sideways(rule.origin, p)
    least = rule.distance + 0.5 * (size - rule.distance)
    angle = min(rule.turn, room_to_turn(rule.origin, p, aside, a, least))
    angle = max(min(angle, room_to_turn(rule.origin, p, aside, b, least)), 0.0)
    c, s = np.cos(angle), np.sin(angle)
    n = (c * p[0] + s * aside[0], c * p[1] + s * aside[1], c * p[2] + s * aside[2])
    return n, size


@kernel
def sideways(origin, p):
    """The unit vector that the unit vector p turns to: level, to the left seen from above.

    Seen by the other agent, from -p, it is the opposite.
    """
    if len(origin) == 2:
        return -p[1], p[0], 0.0
    level = np.sqrt(p[0] * p[0] + p[1] * p[1])
    if level > UPRIGHT:
        return -p[1] / level, p[0] / level, 0.0
    steep = np.sqrt(p[1] * p[1] + p[2] * p[2])
    return 0.0, -p[2] / steep, p[1] / steep


@kernel
def room_to_turn(origin, p, aside, point, least):
    """How far in rad p may turn towards ``aside`` so that its product with a point is ``least``."""
    if len(origin) == 3:  # the rest of it has no part in that
        axis = (
            p[1] * aside[2] - p[2] * aside[1],
            p[2] * aside[0] - p[0] * aside[2],
            p[0] * aside[1] - p[1] * aside[0],
        )
        off = cells.dot(axis, point)
        point = (point[0] - off * axis[0], point[1] - off * axis[1], point[2] - off * axis[2])
    share = min(least / np.sqrt(cells.dot(point, point)), 1.0)
    return np.arctan2(cells.dot(aside, point), cells.dot(p, point)) + np.arccos(share)


@kernel
def push(rho, slack, most):
    """What the barrier pushes a pair apart with at a slack below ``most``, in the input's unit."""
    return rho * (1.0 / slack - 1.0 / most) if slack < most else 0.0


@kernel
def keep(parts, at, state, origin):
    """Look at the agents, at a stage of a step or at its start; False, with the exit latched, if
    they are not kept apart.

    Args:
        parts: of the loop, with its outputs.
        at: when.
        state: flat, there.
        origin: cells.PLANE or cells.SPACE.
    """
    problem, clock, work = parts.problem, parts.clock, parts.work
    near, rule = neighbours_in(work.separation, problem, origin), rule_of(problem, origin)
    if at.stage != 0:
        return stays(rule, near, parts, at)
    numbers, states = near.numbers, parts.channels.equilibrium_state.shape[1]
    instant = clock.mode == 0 or at.step % clock.period == 0
    for a in range(len(near.place)):
        near.place[a] = state[a * states + parts.channels.position]
        near.output[a] = work.y[a] if instant else near.place[a]
    numbers.pairs = 0.0
    cells.find(origin, near, near.place, near.output, rule.reach, 0.0)
    numbers.renewed = numbers.pairs
    return see(rule, near, parts.monitor, at.time) and (
        not instant or renew(rule, near, 0, parts.monitor, at.time)
    )


@kernel
def see(rule, near, monitor, time):
    """Note how far apart positions are; False, with the exit latched, if a pair is too near."""
    if monitor.apart == 0.0:
        monitor.least_distance = np.inf
    monitor.apart += 1.0
    monitor.most_pairs = max(monitor.most_pairs, near.numbers.pairs)
    first, second, least = 0.0, 0.0, np.inf
    for k in range(int(near.numbers.pairs)):
        i, j = int(near.first[k]), int(near.second[k])
        apart = cells.distance(rule.origin, near.place, near.place, i, j)
        if apart < least:
            least, first, second = apart, i, j
    if least < monitor.least_distance:
        monitor.least_distance, monitor.least_distance_time = least, time
        monitor.nearest_first, monitor.nearest_second = first, second
    if not least >= rule.distance and near.numbers.pairs > 0.0:
        monitor.too_near += 1.0
        watch.leave(monitor, watch.TOO_NEAR, time, first, second, least, 0)
        return False
    return True


@kernel
def renew(rule, near, begin, monitor, time):
    """Fill the half-planes of pairs from number ``begin`` on; False, with the exit latched, if one
    has none."""
    place = near.place
    for k in range(begin, int(near.numbers.pairs)):
        i, j = int(near.first[k]), int(near.second[k])
        size, slack = draw(rule, near, k)
        near.slack[k] = slack
        if not slack > 0.0 or not size > rule.distance:
            apart = cells.distance(rule.origin, place, place, i, j)
            watch.leave(monitor, watch.TOO_NEAR, time, i, j, apart, 0)
            return False
    return True


@kernel
def draw(rule, near, k):
    """Fill the half-plane of pair k, by where its agents were at the renewal; |p| and its slack."""
    i, j = int(near.first[k]), int(near.second[k])
    ahead = cells.difference(rule.origin, near.output, i, j)
    n, size = half_plane(rule, cells.difference(rule.origin, near.place, i, j), ahead)
    near.along[k], near.across[k] = n[0], n[1]
    if len(rule.origin) == 3:
        near.up[k] = n[2]
    return size, cells.dot(n, ahead) - rule.distance


@kernel
def slack_at(rule, near, y, k):
    """n.(y_i - y_j) - r of pair k at outputs y (m,), in m."""
    d = len(rule.origin)
    i, j = d * int(near.first[k]), d * int(near.second[k])
    apart = near.along[k] * (y[i] - y[j]) + near.across[k] * (y[i + 1] - y[j + 1])
    if d == 3:
        apart += near.up[k] * (y[i + 2] - y[j + 2])
    return apart - rule.distance


@kernel
def add_pushes(rule, near, k, size, out):
    """Add to out (m,) what moves the agents of pair k apart."""
    d = len(rule.origin)
    i, j = d * int(near.first[k]), d * int(near.second[k])
    x, y = size * near.along[k], size * near.across[k]
    out[i] += x
    out[i + 1] += y
    out[j] -= x
    out[j + 1] -= y
    if d == 3:
        z = size * near.up[k]
        out[i + 2] += z
        out[j + 2] -= z


@kernel
def farthest_move(rule, near, y):
    """How far the output that has gone farthest since the renewal has, to y (m,), in m; and whose
    it is."""
    farthest, agent = 0.0, 0
    for i in range(len(near.line)):
        a = len(rule.origin) * i
        along, across = y[a] - near.output[a], y[a + 1] - near.output[a + 1]
        square = along * along + across * across
        if len(rule.origin) == 3:
            square += (y[a + 2] - near.output[a + 2]) ** 2
        if farthest < np.inf and not square <= farthest:  # what is no number stays
            farthest, agent = square, i
    return np.sqrt(farthest), agent


@kernel
def stays(rule, near, parts, at):
    """Whether a later stage of a piece, or its end, may stand, mode continuous."""
    work, finest = parts.work, parts.work.division.level >= division.FINEST
    stage, most = max(at.stage, 0), rule.reach - rule.distance
    for k in range(int(near.numbers.pairs)):
        slack, start = slack_at(rule, near, work.y, k), near.slack[k]
        lost = start - slack <= division.USE * start or (finest and slack > 0.0)
        gained = slack - start <= division.GAIN * start or start >= most or finest
        if not lost or not gained:
            watch.leave(
                parts.monitor, watch.STEP_TOO_SMALL, at.time, near.first[k], near.second[k], slack,
                stage,
            )  # fmt: skip
            return False
    moved, agent = farthest_move(rule, near, work.y)
    if not 4.0 * moved <= most:  # two agents in opposite ways: half of it
        watch.leave(parts.monitor, watch.STEP_TOO_SMALL, at.time, agent, agent, 0.0, stage)
        return False
    return True


@kernel
def add_to_law(parts, at, origin):
    """Add what keeps agents apart to work.commanded, mode continuous; False if there is no input
    that actuators can take."""
    problem, work = parts.problem, parts.work
    near, rule = neighbours_in(work.separation, problem, origin), rule_of(problem, origin)
    rho, most = problem.settings[GAIN] * work.now.penalty, rule.reach - rule.distance
    for k in range(int(near.numbers.pairs)):
        add_pushes(rule, near, k, push(rho, slack_at(rule, near, work.y, k), most), work.commanded)
    return usable(at.time, max(at.stage, 0), work, parts.monitor)
