"""A problem's own sizes, by which the interior-point method measures everything.

A user may state costs, constraints and actions in any units. Of one constraint all that counts is
unit-free by itself (lambda_l s_l, steps relative to slacks). For the rest there are

- the *length* of a profile: its greatest entry, but not much less than the set is wide;
- the size of a *row* r of F + sum_l lambda_l dg_l: the magnitudes of its terms, and what the cost's
  second derivatives make of that length; a residual is small if it is small beside it;
- the *costs' size*: the greatest row's times the length, in the unit of costs and of rho.
"""

import numpy as np

from gne_mj import game_functions as games
from gne_mj.native import kernel, shaped

WIDEST = 1e6  # profiles; a bound farther than that says nothing of the length
NARROWEST = 1e-5  # of the first length, below which a length does not fall
NOTHING = 1e-30  # a profile that is nowhere greater is zero, in whatever unit
ALIGNED = 0.7  # cosine between -F and dphi from which on a point counts as near the path
SHARP = 10.0  # times the share of the costs' size that rho falls to


@kernel
def largest(y):
    """Greatest magnitude."""
    value = 0.0
    for a in range(len(y)):
        value = max(value, abs(y[a]))
    return value


@kernel
def length_of(y):
    """Greatest magnitude, 1 of a profile that is zero."""
    length = largest(y)
    return length if length > NOTHING else 1.0


@kernel
def largest_free(data, free, y):
    """Greatest magnitude among the free agents' actions."""
    value, at = 0.0, data.offsets
    for entry in range(len(free.agents)):
        i = free.agents[entry]
        for a in range(at[i], at[i + 1]):
            value = max(value, abs(y[a]))
    return value


@kernel
def largest_held(free, y):
    """Greatest magnitude among the actions that are not free."""
    value = 0.0
    for a in range(len(y)):
        if free.position[a] < 0:
            value = max(value, abs(y[a]))
    return value


@kernel
def length_at(count, constraints, free, y, work):
    """The length of the problem as seen from y: of the profile, or the set's width where wider.

    The width is the narrowest one among the free actions, from y to the farther of its two bounds,
    to first order. g and the Jacobian must be filled; the steps are scratch.
    """
    above, below = work.step, work.unit
    for r in range(count):
        above[r] = below[r] = np.inf
    for k in range(constraints):
        for entry in range(work.row[k], work.row[k + 1]):
            r, slope = free.position[work.column[entry]], work.jacobian[entry]
            if slope > 0.0:
                above[r] = min(above[r], -work.g[k] / slope)
            elif slope < 0.0:
                below[r] = min(below[r], work.g[k] / slope)
    width = np.inf
    for r in range(count):
        own = above[r] if above[r] < np.inf else 0.0
        if below[r] < np.inf:
            own = max(own, below[r])
        if own > 0.0:
            width = min(width, own)
    length = largest(y)
    if width < np.inf:
        length = max(length, min(width, WIDEST * length) if length > NOTHING else width)
    return length if length > NOTHING else 1.0


@kernel
def largest_gradient(count, work):
    """Greatest entry of F; the stationarity residual must be F alone."""
    value = 0.0
    for r in range(count):
        value = max(value, abs(work.stationarity[r]))
    return value


@kernel
def balance(count, constraints, free, highest, work):
    """Near the path its own rho, where the barrier's gradient is as large as F; else ``highest``.

    Elsewhere a high rho leads away from the bounds first: along curved ones steps are tiny. The
    stationarity residual must be F alone.
    """
    costs, barrier, along = 0.0, 0.0, 0.0
    for r in range(count):
        costs += work.stationarity[r] ** 2
        work.step[r] = 0.0
    for k in range(constraints):
        for entry in range(work.row[k], work.row[k + 1]):
            if work.owned[entry] != 0:
                work.step[free.position[work.column[entry]]] -= work.jacobian[entry] / work.g[k]
    for r in range(count):
        barrier += work.step[r] ** 2
        along -= work.stationarity[r] * work.step[r]
    aligned = along > ALIGNED * np.sqrt(costs * barrier)
    return min(np.sqrt(costs / barrier), highest) if aligned else highest


@kernel
def add_costs(data, free, length, y, b, work):
    """Fill the band with the costs' second derivatives and the rows' sizes; the costs' size."""
    if len(work.step) == b + 1 and len(free.agents) == len(data.everyone):
        return add_all_costs(data, length, y, b, work)
    at, greatest = data.offsets, 0.0
    for entry in range(len(free.agents)):
        i = free.agents[entry]
        for a in range(at[i], at[i + 1]):
            r = free.position[a]
            games.add_cost_hessian(data, i, a, y, 1.0, work.hessian_row)
            work.unit[r] = work.terms[r] + length * take_row(data, free, i, r, b, work)
            greatest = max(greatest, work.unit[r])
    return greatest * length if greatest > 0.0 else 1.0


@kernel
def add_all_costs(data, length, y, b, work):
    """The same where everyone is free and no band is narrower than the matrix, in its own order."""
    m, stride, greatest = len(y), work.band.shape[1] - 1, 0.0
    flat = shaped(work.band, (work.band.size,))[b:]
    games.cost_rows(data, y, stride, flat)
    for r in range(m):
        slopes = 0.0
        for c in range(r * stride, r * stride + m):
            slopes += abs(flat[c])
        work.unit[r] = work.terms[r] + length * slopes
        greatest = max(greatest, work.unit[r])
    return greatest * length if greatest > 0.0 else 1.0


@kernel
def take_row(data, free, i, r, b, work):
    """Move agent i's row of second derivatives to the band's row r; the sum of its magnitudes."""
    at, position, band, slopes = data.offsets, free.position, work.band, 0.0
    for c in range(3 * b + 1):
        band[r, c] = 0.0
    for member in range(data.cost_pointer[i], data.cost_pointer[i + 1]):
        j = data.cost_index[member]
        for c in range(at[j], at[j + 1]):
            if position[c] >= 0:
                band[r, position[c] - r + b] += work.hessian_row[c]
                slopes += abs(work.hessian_row[c])
            work.hessian_row[c] = 0.0
    return slopes


@kernel
def sharpen(constraints, free, tolerance, length, point, work):
    """Lower the shares of bounds that neither bind nor are free to see; whether there are any.

    Where a multiplier and its slack tend to zero together, both are still about the square root of
    the last rho. Each bound gets a share of rho at which one of the two is ``tolerance``, relative
    to its row's size or to the length.
    """
    blurred = False
    for k in range(constraints):
        push, size = 0.0, 0.0
        for entry in range(work.row[k], work.row[k + 1]):
            slope = abs(work.jacobian[entry])
            r = free.position[work.column[entry]]
            if slope > 0.0 and work.owned[entry] != 0:
                push = max(push, point.multipliers[k] * slope / max(work.unit[r], work.terms[r]))
            size += slope * length
        if size == 0.0:
            continue
        room = point.slack[k] / size
        if min(push, room) > SHARP * tolerance:
            share = max(push, room, tolerance)
            if share < 0.5 * work.share[k]:
                work.share[k] = share
                blurred = True
    return blurred
