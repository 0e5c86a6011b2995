"""Lines of an agent's actions through a profile: how far they stay inside, where it costs least.

A best response that is found by Newton's method is a stationary point near where it began. Along
lines, costs are compared: for an action of one entry, on all of the feasible interval, or intervals
where the set is not known to be convex.
"""

import numpy as np

from gne_mj import game_functions as games
from gne_mj import scales
from gne_mj.native import copy, kernel

# A line is followed from FIRST to FARTHEST lengths of the profile, doubling, and on either side
# costs are compared at these places and at POINTS equal distances. Beyond where it leaves, the set
# is looked for again at distances that grow by STRIDE.
FIRST, FARTHEST, POINTS, STRIDE = 1e-6, 1e6, 32, 1.1
HALVINGS = 50
SWEEPS = 10  # over all actions, on the way to the middle


@kernel
def stays(data, own, y):
    """Whether y is strictly inside an agent's own constraints."""
    for k in range(len(own)):
        value = games.constraint(data, own[k], y) + data.tightening[own[k]]
        if not value < 0.0:
            return False
    return True


@kernel
def place(data, i, y, direction, t, trial):
    """Set agent i's actions in the trial: those of y, t times the direction further."""
    for a in range(data.offsets[i], data.offsets[i + 1]):
        trial[a] = y[a] + t * direction[a]


@kernel
def end(data, i, own, y, direction, sign, length, trial):
    """The greatest t, as far as FARTHEST, up to which y + sign t direction stays inside."""
    low, high, left = 0.0, FIRST * length, False
    while 0.0 < high < np.inf and high <= FARTHEST * length:  # what does not grow ends, too
        place(data, i, y, direction, sign * high, trial)
        left = not stays(data, own, trial)
        if left:
            break
        low, high = high, 2.0 * high
    if left:
        for _ in range(HALVINGS):
            half = 0.5 * (low + high)
            place(data, i, y, direction, sign * half, trial)
            if stays(data, own, trial):
                low = half
            else:
                high = half
    return low


@kernel
def compare(data, i, y, direction, t, trial, found):
    """Keep the place t on the line if the cost is less there."""
    place(data, i, y, direction, t, trial)
    value = games.cost(data, i, trial)
    if value < found.line_cost:
        found.line_cost, found.line_place = value, t


@kernel
def lowest(data, i, own, holes, y, direction, trial, found):
    """Fill found.line_cost and line_place with agent i's least cost on the line and where; y is
    inside.

    Where the set may have ``holes``, the parts of the line beyond them count too.
    """
    length = scales.length_of(y)
    copy(y, trial)
    found.line_cost, found.line_place = games.cost(data, i, y), 0.0
    for side in range(2):
        sign = 1.0 - 2.0 * side
        last = end(data, i, own, y, direction, sign, length, trial)
        t = FIRST * length
        while t < last:
            compare(data, i, y, direction, sign * t, trial, found)
            t *= 2.0
        for k in range(POINTS):
            t = last * (k + 1) / POINTS
            compare(data, i, y, direction, sign * t, trial, found)
        beyond = FIRST * length
        while holes and beyond <= FARTHEST * length:
            t = sign * (last + beyond)
            place(data, i, y, direction, t, trial)
            if stays(data, own, trial):
                compare(data, i, y, direction, t, trial, found)
            beyond *= STRIDE


@kernel
def to_middle(data, y, direction, trial):
    """Move y (m,) to the middle along each action in turn; where that is far away, a little."""
    copy(y, trial)
    shared = len(data.own_index) == len(data.member_index)
    for _ in range(SWEEPS):
        for i in range(len(data.offsets) - 1):
            own = data.all_constraints[:]
            if shared:
                own = data.own_index[data.own_pointer[i] : data.own_pointer[i + 1]]
            for a in range(data.offsets[i], data.offsets[i + 1]):
                length = scales.length_of(y)
                direction[a] = 1.0
                above = end(data, i, own, y, direction, 1.0, length, trial)
                below = end(data, i, own, y, direction, -1.0, length, trial)
                direction[a] = 0.0
                if max(above, below) > 0.25 * FARTHEST * length:  # no bound on this side
                    most = max(length, min(above, below))
                    above, below = min(above, most), min(below, most)
                y[a] += 0.5 * (above - below)
                place(data, i, y, direction, 0.0, trial)
