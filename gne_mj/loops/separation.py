"""Agents that keep apart in the plane: half-planes that turn, renewed at every control instant.

For each pair that is near, a unit vector n is found with n.(q_i - q_j) > r and n.(y_i - y_j) > r,
and until the next instant the law has a barrier of r - n.(y_i - y_j) < 0 besides those of the game.
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
    # n.(y_i - y_j) - r in m: at the renewal; in mode implicit at the trial
    slack: Annotated[np.ndarray, "agents * (agents - 1) // 2"]
    place: Annotated[np.ndarray, "2 * agents"]  # q at the renewal
    output: Annotated[np.ndarray, "2 * agents"]  # y there
    head: Annotated[np.ndarray, "4 * agents"]  # of each cell the agent that came last, or -1
    following: Annotated[np.ndarray, "agents"]  # the one before it in the same cell
    # Mode implicit: agents along a line, and each action's row of Newton's matrix with its half
    # bandwidth, these two whole numbers
    line: Annotated[np.ndarray, "agents"]
    position: Annotated[np.ndarray, "2 * agents"]
    band: Annotated[np.ndarray, "2"]


neighbours_length, _neighbours_in = in_array(Neighbours, "agents")


class Rule(NamedTuple):
    """How agents keep apart, in numbers."""

    distance: Any  # r in m
    reach: Any  # in m
    turn: Any  # in rad


@kernel
def rule_of(problem):
    """Of a run."""
    numbers = problem.separation
    return Rule(numbers[0], numbers[1], numbers[2])


@kernel
def neighbours_in(flat, problem):
    """The views into ``work.separation``."""
    return _neighbours_in(flat, 0, len(problem.data.offsets) - 1)


@kernel
def half_plane(rule, ax, ay, bx, by):
    """The unit vector n of a pair with q_i - q_j = a and y_i - y_j = b, and |p|.

    p, the point of the segment from a to b that is nearest to 0, has the direction that is farthest
    from both. It is turned by up to ``rule.turn``, but by no more than leaves n.a - r and n.b - r
    half of |p| - r.
    """
    px, py = cells.nearest_point(ax, ay, bx, by)
    size = np.sqrt(px * px + py * py)
    px, py = px / size, py / size
    least = rule.distance + 0.5 * (size - rule.distance)
    angle = min(rule.turn, room_to_turn(px, py, ax, ay, least))
    angle = max(min(angle, room_to_turn(px, py, bx, by, least)), 0.0)
    c, s = np.cos(angle), np.sin(angle)
    return c * px - s * py, s * px + c * py, size


@kernel
def room_to_turn(px, py, x, y, least):
    """How far in rad the unit vector p may turn so that its product with (x, y) is ``least``."""
    size = np.sqrt(x * x + y * y)
    return np.arctan2(px * y - py * x, px * x + py * y) + np.arccos(min(least / size, 1.0))


@kernel
def push(rho, slack, most):
    """What the barrier pushes a pair apart with at a slack below ``most``, in the input's unit."""
    return rho * (1.0 / slack - 1.0 / most) if slack < most else 0.0


@kernel
def keep(parts, at, state):
    """Look at the agents, at a stage of a step or at its start; False, with the exit latched, if
    they are not kept apart.

    Args:
        parts: of the loop, with its outputs.
        at: when.
        state: flat, there.
    """
    problem, clock, work = parts.problem, parts.clock, parts.work
    near, rule = neighbours_in(work.separation, problem), rule_of(problem)
    if at.stage != 0:
        return stays(rule, near, parts, at)
    numbers, states = near.numbers, parts.channels.equilibrium_state.shape[1]
    instant = clock.mode == 0 or at.step % clock.period == 0
    for a in range(len(near.place)):
        near.place[a] = state[a * states + parts.channels.position]
        near.output[a] = work.y[a] if instant else near.place[a]
    numbers.pairs = 0.0
    cells.find(near, near.place, near.output, rule.reach, 0.0)
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
        apart = cells.distance(near.place, near.place, i, j)
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
    place, output = near.place, near.output
    for k in range(begin, int(near.numbers.pairs)):
        i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
        bx, by = output[i] - output[j], output[i + 1] - output[j + 1]
        x, y, size = half_plane(rule, place[i] - place[j], place[i + 1] - place[j + 1], bx, by)
        near.along[k], near.across[k] = x, y
        near.slack[k] = x * bx + y * by - rule.distance
        if not near.slack[k] > 0.0 or not size > rule.distance:
            apart = cells.distance(place, place, i // 2, j // 2)
            watch.leave(monitor, watch.TOO_NEAR, time, i // 2, j // 2, apart, 0)
            return False
    return True


@kernel
def slack_at(rule, near, y, k):
    """n.(y_i - y_j) - r of pair k at outputs y (m,), in m."""
    i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
    apart = near.along[k] * (y[i] - y[j]) + near.across[k] * (y[i + 1] - y[j + 1])
    return apart - rule.distance


@kernel
def add_pushes(rule, near, k, size, out):
    """Add to out (m,) what moves the agents of pair k apart."""
    i, j = 2 * int(near.first[k]), 2 * int(near.second[k])
    x, y = size * near.along[k], size * near.across[k]
    out[i] += x
    out[i + 1] += y
    out[j] -= x
    out[j + 1] -= y


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
    for a in range(0, len(work.y), 2):
        x, y = work.y[a] - near.output[a], work.y[a + 1] - near.output[a + 1]
        if not 4.0 * np.sqrt(x * x + y * y) <= most:  # two agents in opposite ways: half of it
            watch.leave(parts.monitor, watch.STEP_TOO_SMALL, at.time, a // 2, a // 2, 0.0, stage)
            return False
    return True


@kernel
def add_to_law(parts, at):
    """Add what keeps agents apart to work.commanded, mode continuous; False if there is no input
    that actuators can take."""
    problem, work = parts.problem, parts.work
    near, rule = neighbours_in(work.separation, problem), rule_of(problem)
    rho, most = problem.settings[GAIN] * work.now.penalty, rule.reach - rule.distance
    for k in range(int(near.numbers.pairs)):
        add_pushes(rule, near, k, push(rho, slack_at(rule, near, work.y, k), most), work.commanded)
    return usable(at.time, max(at.stage, 0), work, parts.monitor)
