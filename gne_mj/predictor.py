"""How far rho falls in one step of the interior-point method: a predictor and its corrector.

A step towards the end of the path at once, with no rho on the way, shows how far slacks and
multipliers let it go and what it leaves out: what its second order makes of lambda_l s_l, and of
curved constraints. The step that is taken has both in its equations, and a rho that the first one
would have come near. Its matrix is the same one, factorised once (S. Mehrotra, On the
Implementation of a Primal-Dual Interior Point Method, SIAM Journal on Optimization 2, 1992).
"""

from typing import NamedTuple

import numpy as np

from gne_mj import game_functions as games
from gne_mj.native import kernel
from gne_mj.primal_dual import complete, local_length, longest, solve

SHRINK = 0.1  # of rho, far from the path; there a step tells little
LOW, HIGH = 0.05, 100.0  # within which lambda_l s_l may be off rho, relative to it, while it falls
ROUNDING = 1e-14  # of the terms of g


class Fall(NamedTuple):
    """What a fall of rho goes by."""

    actions: int  # n
    rho: float
    last: float  # the lowest that it may fall to
    length: float
    size: float  # of costs
    residual: float  # of stationarity, relative


@kernel
def may_fall(constraints, fall, tolerance, point, work):
    """Whether the point is near enough to rho's place on the path for a lower one."""
    good = (fall.last < fall.rho) & (fall.rho < np.inf)
    good &= fall.residual <= max(10.0 * fall.rho / fall.size, tolerance)
    for k in range(constraints):
        part = point.multipliers[k] * point.slack[k] / (work.share[k] * fall.rho)
        good &= (part >= LOW) & (part <= HIGH)
    return good


@kernel
def gentle_fall(fall):
    """A rho so near that the step to it needs no look ahead."""
    return max(fall.last, fall.rho * min(SHRINK, np.sqrt(fall.rho / fall.size)))


@kernel
def correct_fall(data, free, fall, point, b, work):
    """Correct the step towards fall.last that is in ``work``; the rho that it leads to."""
    share = longest(len(free.constraints), 0.0, point, work)
    part, mean = reached(len(free.constraints), share, point, work)
    add_curvature(data, free, share, point, work)
    unsure = fall.residual * fall.residual * max(fall.size, fall.rho)
    rho = max(min(fall.rho, mean * part * part), min(SHRINK * fall.rho, unsure))
    rho = max(fall.last, rho)
    solve(free, fall.actions, rho, fall.length, point, b, work)
    complete(free, point, work)
    for k in range(len(free.constraints)):
        work.bend[k] = 0.0
    return rho


@kernel
def reached(constraints, share, point, work):
    """What a share of the step leaves of all lambda_l s_l, as a part; and their mean before.

    What the step's second order adds to each is filled in.
    """
    now, then, shares = 0.0, 0.0, 0.0
    for k in range(constraints):
        slack, multiplier = point.slack[k], point.multipliers[k]
        change, other = work.step_slack[k], work.step_multipliers[k]
        now += slack * multiplier
        then += (slack + share * change) * (multiplier + share * other)
        shares += work.share[k]
        work.bend[k] = change * other
    return max(then / now, 0.0), now / shares


@kernel
def add_curvature(data, free, share, point, work):
    """Add to g what a step's second order makes of curved constraints, seen along a share of it."""
    at, y, curved = data.offsets, work.trial.y, False
    for k in range(len(free.constraints)):
        curved |= work.curved[free.constraints[k]] != 0
    if not curved:
        return
    for entry in range(len(free.agents)):
        i = free.agents[entry]
        for a in range(at[i], at[i + 1]):
            y[a] = point.y[a] + share * work.step[free.position[a]]
    games.values(data, free.constraints, y, work.beyond)
    for k in range(len(free.constraints)):
        which, slack = free.constraints[k], point.slack[k]
        along = -work.step_slack[k] - work.g[k] - slack
        rest = work.beyond[k] + data.tightening[which] - work.g[k] - share * along
        seen = abs(rest) > ROUNDING * max(work.size[k], slack)
        rest /= share * share
        if work.curved[which] != 0 and seen and abs(rest) < np.inf:
            work.g[k] += rest


@kernel
def next_length(free, fall, distance, point, b, work):
    """At most how long the next step is, relative to slacks, after one of length ``distance``.

    A residual that is small beside steep terms, as by a pole, does not tell enough. The matrix of
    the last step does, without one of its own: its slopes are at most (1 + distance)^2 times those
    here, steep terms by a pole being of order 2. Infinite if there was no step.
    """
    if not distance < np.inf:
        return np.inf
    constraints = len(free.constraints)
    for k in range(constraints):  # lambda_l s_l is looked at by itself
        work.bend[k] = work.share[k] * fall.rho + point.multipliers[k] * work.g[k]
    solve(free, fall.actions, fall.rho, fall.length, point, b, work)
    complete(free, point, work)
    for k in range(constraints):
        work.bend[k] = 0.0
    return local_length(constraints, point, work) * (1.0 + distance) ** 2
