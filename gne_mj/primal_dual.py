"""Newton's equations of the interior-point method: what they are evaluated by, solved and moved on.

For the free agents' actions y, slacks s and multipliers lambda, of which all q constraints that
contain such an action have one, the unknowns' equations are

    F(y) + sum_l lambda_l dg_l(y) = 0,   g(y) + s = 0,   lambda_l s_l = rho (its share of it).

Eliminating s and lambda leaves dF/dy + sum_l lambda_l d2g_l + dg' diag(lambda / s) dg, which
couples actions of agents that meet in a cost or a constraint, and is stored as a band
(:mod:`gne_mj.banded`). Where it is singular, as in merely monotone games, its diagonal is raised a
little. A private constraint is in the rows of its owners only, and keeps its slack all the same.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj import banded, scales
from gne_mj import game_functions as games
from gne_mj.linear import add_part
from gne_mj.native import kernel

# What is added to the diagonal of a matrix that is singular, or whose step is longer than FAR
# profiles, relative to the rows' own slopes: SHIFT, and so many times HIGHER.
SHIFT, HIGHER, SHIFTS, FAR = 1e-12, 1e3, 5, 1e6
FEW = 4  # actions, of which adding a constraint's slopes row by row does not pay


class Free(NamedTuple):
    """Whose actions are unknown."""

    agents: Annotated[np.ndarray, "n", int]  # the free agents
    # the constraints that contain an action of theirs
    constraints: Annotated[np.ndarray, "n", int]
    # a free action's row in Newton's matrix, -1 if it is held
    position: Annotated[np.ndarray, "m", int]


class Iterate(NamedTuple):
    """A start, and then the result. q is the number of constraints."""

    y: Annotated[np.ndarray, "m"]
    slack: Annotated[np.ndarray, "q"]  # s > 0
    multipliers: Annotated[np.ndarray, "q"]  # lambda > 0


class NewtonScratch(NamedTuple):
    """Arrays that the method works on; n is the number of free actions."""

    trial: Iterate
    g: Annotated[np.ndarray, "q"]
    size: Annotated[np.ndarray, "q"]  # size of the terms in g whose rounding shows in it
    # where each constraint's entries begin in the next two
    row: Annotated[np.ndarray, "q + 1", int]
    # the free actions in one constraint after the other
    column: Annotated[np.ndarray, "entries", int]
    owned: Annotated[np.ndarray, "entries", int]  # 1 if the constraint is that action's agent's own
    # of a constraint whose actions have one row after the other the first of these; -1 of others
    first: Annotated[np.ndarray, "q", int]
    jacobian: Annotated[np.ndarray, "entries"]  # dg_l/dy_a for them
    stationarity: Annotated[np.ndarray, "m"]  # F + sum_l lambda_l dg_l, the first n entries
    terms: Annotated[np.ndarray, "m"]  # sum of the magnitudes of its terms, likewise
    unit: Annotated[np.ndarray, "m"]  # size of each row's terms, likewise
    # 0 where a constraint is declared to have no second derivatives, by its number in the game
    curved: Annotated[np.ndarray, "q", int]
    share: Annotated[np.ndarray, "q"]  # lambda_l s_l is to be this share of rho
    step: Annotated[np.ndarray, "m"]  # n entries
    step_slack: Annotated[np.ndarray, "q"]
    step_multipliers: Annotated[np.ndarray, "q"]
    # what is known of the steps' second order in lambda_l s_l; zero between uses
    bend: Annotated[np.ndarray, "q"]
    beyond: Annotated[np.ndarray, "q"]  # g along a step
    hessian_row: Annotated[np.ndarray, "m"]  # zero between uses
    band: Annotated[np.ndarray, "m, n // m"]  # n rows of 3 b + 1 entries or more
    pivots: Annotated[np.ndarray, "m", int]  # n entries


@kernel
def owns(data, j, l):
    """Whether constraint l, which contains agent j, is one of its own."""
    if len(data.own_index) == len(data.member_index):  # all are shared
        return True
    for entry in range(data.own_pointer[j], data.own_pointer[j + 1]):
        if data.own_index[entry] == l:
            return True
    return False


@kernel
def find_entries(data, free, work):
    """Fill row, column and owned: where the derivatives are that a step needs; how many actions
    move."""
    at, entry = data.offsets, 0
    for k in range(len(free.constraints)):
        l = free.constraints[k]
        work.row[k] = entry
        for member in range(data.member_pointer[l], data.member_pointer[l + 1]):
            j = data.member_index[member]
            if free.position[at[j]] >= 0:
                owned = 1 if owns(data, j, l) else 0
                for a in range(at[j], at[j + 1]):
                    work.column[entry] = a
                    work.owned[entry] = owned
                    entry += 1
    work.row[len(free.constraints)] = entry
    for k in range(len(free.constraints)):
        work.first[k] = first_row(free, work.column[work.row[k] : work.row[k + 1]])
    count = 0
    for member in range(len(free.agents)):
        i = free.agents[member]
        count += at[i + 1] - at[i]
    return count


@kernel
def first_row(free, columns):
    """The first of some actions' rows, if these are one after the other; else -1."""
    if len(columns) < FEW:
        return -1
    first = last = free.position[columns[0]]
    for entry in range(len(columns)):
        first = min(first, free.position[columns[entry]])
        last = max(last, free.position[columns[entry]])
    return first if last - first == len(columns) - 1 else -1


@kernel
def inside(data, free, y, work):
    """Fill g; False if y is not strictly inside."""
    games.values(data, free.constraints, y, work.g)
    good = True
    for k in range(len(free.constraints)):
        work.g[k] += data.tightening[free.constraints[k]]
        good &= work.g[k] < 0.0
    return good


@kernel
def evaluate(data, free, point, work):
    """Fill the Jacobian and the stationarity residual."""
    at, gradient = data.offsets, work.hessian_row
    games.gradients(data, free.agents, point.y, gradient)
    for entry in range(len(free.agents)):
        i = free.agents[entry]
        for a in range(at[i], at[i + 1]):
            work.stationarity[free.position[a]] = gradient[a]
            work.terms[free.position[a]] = abs(gradient[a])
            gradient[a] = 0.0
    games.slopes(data, free.constraints, work.row, work.column, point.y, work.jacobian)
    for k in range(len(free.constraints)):
        size = 0.0
        for entry in range(work.row[k], work.row[k + 1]):
            a = work.column[entry]
            slope = work.jacobian[entry]
            size += abs(slope * point.y[a])
            if work.owned[entry] != 0:
                r = free.position[a]
                work.stationarity[r] += point.multipliers[k] * slope
                work.terms[r] += point.multipliers[k] * abs(slope)
        work.size[k] = size


@kernel
def assemble(data, free, count, length, shift, point, b, work):
    """Fill the band with Newton's matrix, rows in the order of ``free.position``; the costs' size.

    ``shift`` is added to the diagonal, relative to the rows' own slopes.
    """
    band = work.band
    size = scales.add_costs(data, free, length, point.y, b, work)
    if shift > 0.0:
        for r in range(count):
            band[r, b] += shift * work.unit[r] / length
    for k in range(len(free.constraints)):
        if work.first[k] >= 0 and work.curved[free.constraints[k]] == 0:
            add_block(free, k, point, b, work)
        else:
            add_pairs(data, free, k, point, b, work)
    return size


@kernel
def add_pairs(data, free, k, point, b, work):
    """Add constraint k's part of Newton's matrix, entry by entry."""
    position, band = free.position, work.band
    l = free.constraints[k]
    weight = point.multipliers[k]
    ratio = weight / point.slack[k]
    for entry in range(work.row[k], work.row[k + 1]):
        if work.owned[entry] == 0:
            continue
        a = work.column[entry]
        r = position[a]
        slope = ratio * work.jacobian[entry]
        for other in range(work.row[k], work.row[k + 1]):
            c, term = work.column[other], slope * work.jacobian[other]
            if work.curved[l] != 0:
                term += weight * games.constraint_hessian(data, l, a, c, point.y)
            band[r, position[c] - r + b] += term


@kernel
def add_block(free, k, point, b, work):
    """The same, row by row, of a constraint without second derivatives and with rows in a block."""
    position, band, slopes, first = free.position, work.band, work.step, work.first[k]
    long = band.shape[1]
    count = work.row[k + 1] - work.row[k]
    ratio = point.multipliers[k] / point.slack[k]
    for entry in range(work.row[k], work.row[k + 1]):
        slopes[position[work.column[entry]] - first] = work.jacobian[entry]
    for entry in range(work.row[k], work.row[k + 1]):
        if work.owned[entry] != 0:
            r = position[work.column[entry]]
            add_part(
                ratio * work.jacobian[entry], slopes, 0, band, r * long + first - r + b, count
            )  # fmt: skip


@kernel
def newton(data, free, count, rho, length, point, b, work):
    """Fill the steps of y, s and lambda towards their rho; the costs' size, -1 if singular."""
    shift, solved, size = 0.0, False, 0.0
    for _ in range(SHIFTS):
        size = assemble(data, free, count, length, shift, point, b, work)
        solved = banded.factorise(work.band, count, b, work.pivots)
        if solved:
            solved = solve(free, count, rho, length, point, b, work)
        if solved:
            break
        shift = max(SHIFT, HIGHER * shift)
    if not solved:
        return -1.0
    complete(free, point, work)
    return size


@kernel
def complete(free, point, work):
    """Fill the steps of s, and add to lambda's what y's does."""
    for k in range(len(free.constraints)):
        along = 0.0
        for entry in range(work.row[k], work.row[k + 1]):
            along += work.jacobian[entry] * work.step[free.position[work.column[entry]]]
        work.step_slack[k] = -(work.g[k] + point.slack[k]) - along
        work.step_multipliers[k] += point.multipliers[k] / point.slack[k] * along


@kernel
def longest_entry(count, step):
    """Greatest magnitude of the first entries, not a number if one of them is none."""
    longest = 0.0
    for r in range(count):
        size = abs(step[r])
        if not size <= longest:
            longest = size
    return longest


@kernel
def solve(free, count, rho, length, point, b, work):
    """Fill the step of y, and lambda's if y stayed; False if it leads nowhere near."""
    for r in range(count):
        work.step[r] = -work.stationarity[r]
    for k in range(len(free.constraints)):
        change = work.share[k] * rho - work.bend[k] + point.multipliers[k] * work.g[k]
        change /= point.slack[k]
        work.step_multipliers[k] = change
        for entry in range(work.row[k], work.row[k + 1]):
            if work.owned[entry] != 0:
                work.step[free.position[work.column[entry]]] -= change * work.jacobian[entry]
    banded.solve(work.band, count, b, work.pivots, work.step)
    return longest_entry(count, work.step) <= FAR * length


@kernel
def local_length(constraints, point, work):
    """Length of the step relative to the distances to the bounds, all together."""
    total = 0.0
    for k in range(constraints):
        total += (work.step_slack[k] / point.slack[k]) ** 2
    return np.sqrt(total)


@kernel
def longest(constraints, keep, point, work):
    """Longest step, at most 1, that leaves slacks and multipliers a share ``keep`` of theirs."""
    length = 1.0
    for k in range(constraints):
        if work.step_slack[k] < 0.0:
            length = min(length, (keep - 1.0) * point.slack[k] / work.step_slack[k])
        if work.step_multipliers[k] < 0.0:
            length = min(length, (keep - 1.0) * point.multipliers[k] / work.step_multipliers[k])
    return length


@kernel
def move(data, free, length, point, work):
    """Set the trial to the point that many steps on."""
    at = data.offsets
    for entry in range(len(free.agents)):
        i = free.agents[entry]
        for a in range(at[i], at[i + 1]):
            work.trial.y[a] = point.y[a] + length * work.step[free.position[a]]
    for k in range(len(free.constraints)):
        work.trial.slack[k] = point.slack[k] + length * work.step_slack[k]
        work.trial.multipliers[k] = point.multipliers[k] + length * work.step_multipliers[k]


@kernel
def accept(data, free, point, trial):
    """Make the trial the point; held actions are equal in both."""
    at = data.offsets
    for entry in range(len(free.agents)):
        i = free.agents[entry]
        for a in range(at[i], at[i + 1]):
            point.y[a] = trial.y[a]
    for k in range(len(free.constraints)):
        point.slack[k] = trial.slack[k]
        point.multipliers[k] = trial.multipliers[k]
