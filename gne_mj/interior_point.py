"""A primal-dual interior-point method on a game's kernels, compiled and without allocation.

For the free agents' actions y it solves F(y) + sum_l lambda_l dg_l(y) = 0 with lambda_l s_l = rho
and s = -g(y), where F has the free agents' own gradients: for all agents the penalised equilibrium
[eq:NEcondition], and for rho -> 0 the variational GNE [eq:vGNE]; for one agent its best response.
The slacks s are unknowns of their own: they keep the digits that g(y) loses when it is small beside
its terms. Iterates stay strictly inside.

Steps are Newton's, shortened until the residuals' norm falls. Where only tiny steps do (along
curved bounds, far from the path), the method sets the multipliers to rho / s and is careful until
the path is reached: at a high rho if none was reached yet, else at its own.

Nothing depends on the units of costs, constraints or actions: all is measured by the problem's own
sizes (:mod:`gne_mj.scales`).

The equations of a step are in :mod:`gne_mj.primal_dual`.
"""

from functools import cache
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numba import types

from gne_mj import best_response, lines, scales
from gne_mj.native import call_integer, callback, compiled, copy, kernel, source_key
from gne_mj.predictor import Fall, correct_fall, gentle_fall, may_fall, next_length
from gne_mj.primal_dual import (
    accept,
    evaluate,
    find_entries,
    inside,
    local_length,
    longest,
    longest_entry,
    move,
    newton,
)
from gne_mj.solver_memory import FOLLOW, free_in, memory_in, sizes_in

_whole, _real = types.int64, types.float64

# How an iteration ended
CONVERGED, OUTSIDE, SINGULAR, NO_WAY_ON, TOO_MANY = range(5)
# The end of the path to rho -> 0, as a share of the costs' size (gne_mj.scales). There only the
# order of lambda_l s_l counts, so that it may be off by half.
LOWEST, HALF = 1e-12, 0.5
LARGEST_COUNT = 300
ACCEPTED = 100.0  # tolerances, where rounding ends the progress before
TO_BOUNDARY = 0.005  # share of a slack or multiplier that one step leaves at least
DECREASE = 1e-4  # of the merit, relative to the step's length
MERIT = 0.1  # weight of the stationarity residual in it, for the length of a profile
ROUNDING = 1e-14  # of the terms of g
NEAR = 1e-6  # error below which rounding can hide progress, and full steps are taken as they are
# So many steps in a row shorter than SHORT make the method careful: damped steps at one rho,
# multipliers rho / s, until a step's length in the barrier's own norm is within CENTRED; each
# LONG steps that this takes, rho grows by GROW.
PATIENCE, SHORT, CENTRED, LONG, GROW = 3, 0.1, 0.3, 30, 10.0


class Path(NamedTuple):
    """From which rho to which (a start without multipliers may take a lower one), and when it ends.

    There the stationarity residual must be within ``tolerance`` of its rows' sizes
    (:mod:`gne_mj.scales`), and lambda_l s_l within ``spread * last_rho`` of last_rho.
    """

    rho: float  # 0 for one that suits the costs
    last_rho: float
    tolerance: float
    spread: float
    to_zero: bool  # last_rho is a share of the costs' size, and no bound is to look blurred there
    gently: bool  # follow it closely: other stationary points are not to be jumped to


@kernel
def merit(count, constraints, rho, length, point, work):
    """Squared norm of all residuals in units of cost, complementarity measured from rho."""
    total = 0.0
    for r in range(count):
        total += (MERIT * length * work.stationarity[r]) ** 2
    for k in range(constraints):
        total += (point.multipliers[k] * point.slack[k] - work.share[k] * rho) ** 2
    return total


@kernel
def stationarity_error(count, work):
    """Greatest residual of F + sum_l lambda_l dg_l, relative to its row's size."""
    worst = 0.0
    for r in range(count):
        error = abs(work.stationarity[r])
        if error != 0.0:
            error /= max(work.unit[r], work.terms[r])
        if not error <= worst:
            worst = error
    return worst


@kernel
def spread(constraints, rho, point, work):
    """Greatest distance of lambda_l s_l from what it is to be, relative to that."""
    worst = 0.0
    for k in range(constraints):
        own = work.share[k] * rho
        worst = max(worst, abs(point.multipliers[k] * point.slack[k] - own) / own)
    return worst


@kernel
def correct(constraints, rho, least, factor, before, point, work):
    """Set slacks that curvature has moved off -g to it; False if one is below its share of before.

    A difference that rounding explains is left: there the slack is the better of the two.
    Multipliers are kept within a ``factor`` of rho / s.
    """
    for k in range(constraints):
        if abs(work.g[k] + point.slack[k]) > ROUNDING * max(work.size[k], point.slack[k]):
            point.slack[k] = -work.g[k]
        if not point.slack[k] >= least * before.slack[k]:
            return False
        centre = work.share[k] * rho / point.slack[k]
        point.multipliers[k] = min(max(point.multipliers[k], centre / factor), centre * factor)
    return True


@kernel
def complementarity(constraints, point):
    """Greatest lambda_l s_l."""
    worst = 0.0
    for k in range(constraints):
        worst = max(worst, point.multipliers[k] * point.slack[k])
    return worst


@kernel
def begin(data, free, count, b, path, known, point, work):
    """Fill slacks and unknown multipliers, and evaluate; the first rho, 0 if y is not inside.

    Unknown multipliers are rho / s, with a rho that suits y. Besides, a rho that leads away from
    bounds, the length of the problem and the costs' size.
    """
    constraints = len(free.constraints)
    for k in range(constraints):
        work.share[k] = 1.0
        if not known:
            point.multipliers[k] = 0.0
    if not inside(data, free, point.y, work):
        return 0.0, 0.0, 1.0, 1.0
    evaluate(data, free, point, work)
    for k in range(constraints):
        point.slack[k] = -work.g[k]
    length = scales.length_at(count, constraints, free, point.y, work)
    size = scales.add_costs(data, free, length, point.y, b, work)
    if known:
        return path.rho, path.rho, length, size
    last = path.last_rho * size if path.to_zero else path.last_rho
    suited = path.rho if path.rho > 0.0 else scales.largest_gradient(count, work) * length
    highest = max(last, suited)
    rho = max(last, scales.balance(count, constraints, free, highest, work))
    for k in range(constraints):
        point.multipliers[k] = rho / point.slack[k]
        for entry in range(work.row[k], work.row[k + 1]):
            if work.owned[entry] != 0:
                r = free.position[work.column[entry]]
                work.stationarity[r] += point.multipliers[k] * work.jacobian[entry]
                work.terms[r] += point.multipliers[k] * abs(work.jacobian[entry])
    return rho, highest, length, size


@kernel
def centre(data, free, rho, point, work):
    """Set the multipliers to what they are on the path beside y, and evaluate."""
    inside(data, free, point.y, work)
    for k in range(len(free.constraints)):
        point.multipliers[k] = work.share[k] * rho / point.slack[k]
    evaluate(data, free, point, work)


@kernel
def last_of(path, size, first, last):
    """The path's last rho, which was ``first`` at first and is now ``last``."""
    if not path.to_zero:
        return last
    there = min(path.last_rho * size, first)  # near y = 0 costs look small
    return last if 0.5 * last <= there <= 10.0 * last else there


@kernel
def follow(memory, free, half_band, path, known):
    """Follow the path to path.last_rho, from point's y; the point becomes its end."""
    data, point, work, report = memory.data, memory.point, memory.work, memory.report
    count, constraints = find_entries(data, free, work), len(free.constraints)
    b = min(half_band, max(count - 1, 0))
    rho, highest, length, size = begin(data, free, count, b, path, known, point, work)
    if rho == 0.0:
        return OUTSIDE
    least = max(scales.NARROWEST * length, scales.largest_held(free, point.y))
    first = last = path.last_rho * size if path.to_zero else path.last_rho
    distance, before, stalled, slow, still, careful = np.inf, np.inf, 0, 0, False, False
    for iteration in range(LARGEST_COUNT):
        near_enough, falls, residual = False, False, stationarity_error(count, work)
        off = spread(constraints, rho, point, work)
        last = last_of(path, size, first, last)
        fall = Fall(count, rho, last, length, size, residual)
        if not careful:
            falls = may_fall(constraints, fall, path.tolerance, point, work)
            error = max(residual, off * (path.tolerance / path.spread))
            report.iterations, report.stationarity, report.rho = iteration, residual, rho
            report.error, report.complementarity = error, complementarity(constraints, point)
            if rho <= last:
                stalled = stalled + 1 if error > 0.5 * before else 0
                near_enough = is_near_enough(path, residual, off, distance, still)
                done = stalled >= 2 and near_enough
                if error <= path.tolerance:
                    ahead = next_length(free, fall, distance, point, b, work)
                    done = done or min(distance, ahead) <= CENTRED
                if done and not sharper(constraints, free, path, length, point, work):
                    return CONVERGED
                before, stalled = (np.inf, 0) if done else (error, stalled)
        length = max(least, scales.largest_free(data, free, point.y))
        if falls and path.gently:
            highest, off, rho, falls = 0.0, np.inf, gentle_fall(fall), False
        size = newton(data, free, count, last if falls else rho, length, point, b, work)
        if size < 0.0:
            return SINGULAR
        if falls:
            highest, off, rho = 0.0, np.inf, correct_fall(data, free, fall, point, b, work)
        distance = local_length(constraints, point, work)
        still = distance <= CENTRED and longest_entry(count, work.step) <= ROUNDING * length
        close = max(rho / size, residual)
        keep, factor, share = reach(constraints, careful, distance, close, point, work)
        search = Search(count, rho, length, keep, factor, careful or max(residual, off) <= NEAR)
        share, found = search_along(data, free, search, share, point, work)
        if not found and near_enough:
            return CONVERGED
        if found:
            accept(data, free, point, work.trial)
        slow = slow + 1 if careful or share < SHORT else 0
        if careful:
            careful = distance > CENTRED
            lost, higher = careful and slow >= LONG, GROW * rho
        else:
            careful = lost = slow >= PATIENCE or not found
            higher = max(fall.rho, highest)
        if lost:
            rho, slow, distance = higher, 0, np.inf
            centre(data, free, rho, point, work)
    return TOO_MANY


@kernel
def is_near_enough(path, residual, off, distance, still):
    """Whether the end may be taken where rounding lets the residuals fall no more."""
    enough = ACCEPTED * path.tolerance
    near_enough = residual <= enough and (still or off <= max(8.0 * path.spread, enough))
    # slacks do not tell of a step where all gradients of constraints vanish
    return near_enough or (distance <= path.tolerance and residual <= NEAR)


@kernel
def sharper(constraints, free, path, length, point, work):
    """Whether shares of rho were lowered, where rho is to fall to 0: the path goes on."""
    return path.to_zero and scales.sharpen(constraints, free, path.last_rho, length, point, work)


@kernel
def reach(constraints, careful, distance, close, point, work):
    """How a step is bounded, as :class:`Search` has it, and its share to begin with."""
    if careful:
        return CENTRED, 1.0, 1.0 / (1.0 + distance)
    keep = min(TO_BOUNDARY, close)
    return keep, np.inf, longest(constraints, keep, point, work)


class Search(NamedTuple):
    """What a search along a step goes by."""

    actions: int  # n
    rho: float
    length: float
    keep: float  # see :func:`correct`
    factor: float
    any: bool  # whether any finite residual will do, near the path


@kernel
def search_along(data, free, search, share, point, work):
    """Halve the share of the step until the residuals fall; that share, and whether they did."""
    rho, length, constraints = search.rho, search.length, len(free.constraints)
    now = merit(search.actions, constraints, rho, length, point, work)
    for _ in range(60):
        move(data, free, share, point, work)
        if inside(data, free, work.trial.y, work) and correct(
            constraints, rho, search.keep, search.factor, point, work.trial, work
        ):
            evaluate(data, free, work.trial, work)
            then = merit(search.actions, constraints, rho, length, work.trial, work)
            fallen = then <= (1.0 - 2.0 * DECREASE * share) * now
            if fallen or (search.any and then < np.inf):
                return share, True
        share *= 0.5
    return share, False


@cache
def build() -> SimpleNamespace:
    """The native functions for all games, compiled at their first call.

    Each is given the address of a solver's memory (:mod:`gne_mj.solver_memory`).
    """
    source = source_key()

    def along(block, agent, known, rho, last_rho, tolerance):
        _ = source
        sizes = sizes_in(block)
        memory = memory_in(block, sizes.actions)
        path = Path(rho, last_rho, tolerance, tolerance, False, agent >= 0)
        if last_rho == 0.0:
            path = Path(rho, LOWEST, tolerance, HALF, True, agent >= 0)
        copy(memory.point.y, memory.work.trial.y)
        free = free_in(memory, agent)
        return follow(memory, free, sizes.half_band, path, known != 0)

    entry = callback(_whole(_whole, _whole, _whole, _real, _real, _real), along)

    @compiled
    def run(block, agent, known, rho, last_rho, tolerance):
        """``follow`` from point.y, and its multipliers if those are ``known``, to last_rho or 0."""
        _ = source
        memory = memory_in(block, sizes_in(block).actions)
        return call_integer(
            memory.functions[FOLLOW], (block, agent, known, rho, last_rho, tolerance)
        )

    @compiled
    def respond(block, first, last, costs):
        """Best responses of some agents to ``start``; the first with a failure, ``last`` if none.

        costs (N,) is filled with what they reach; ``best`` is the last one's.
        """
        _ = source
        sizes = sizes_in(block)
        memory = memory_in(block, sizes.actions)
        for i in range(first, last):
            best_response.respond(block, memory, sizes.holes != 0, i)
            costs[i] = memory.response.cost
            if memory.response.failures > 0.0:
                return i
        return last

    @compiled
    def to_middle(block):
        """``lines.to_middle`` of point.y."""
        _ = source
        memory = memory_in(block, sizes_in(block).actions)
        lines.to_middle(memory.data, memory.point.y, memory.direction, memory.work.trial.y)

    return SimpleNamespace(entry=entry, run=run, respond=respond, to_middle=to_middle)
