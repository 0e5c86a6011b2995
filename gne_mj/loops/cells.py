"""Which agents in the plane are near each other, by cells: work grows with neighbours, not pairs.

An agent is a segment here, from its position q to its output y. The difference of two agents runs
from q_i - q_j to y_i - y_j, and its least length is their distance. Cells are as wide as the reach
and the longest of those segments together, so that whoever is within reach is in the same cell or
in one beside it.
"""

from typing import Any, NamedTuple

import numpy as np

from gne_mj.native import kernel

WIDEST = 1e12  # of the agents' extent, in cells: beyond it one cell holds all


class Grid(NamedTuple):
    """Cells over all agents' middles."""

    left: Any  # m
    low: Any  # m
    side: Any  # m
    columns: Any
    rows: Any


@kernel
def nearest_point(ax, ay, bx, by):
    """The point nearest to 0 on the segment from a to b."""
    ex, ey = bx - ax, by - ay
    length = ex * ex + ey * ey
    along = -(ax * ex + ay * ey)
    share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    return ax + share * ex, ay + share * ey


@kernel
def distance(place, output, i, j):
    """Of agents i and j, in m: the least length on the way from q_i - q_j to y_i - y_j."""
    x, y = nearest_point(
        place[2 * i] - place[2 * j], place[2 * i + 1] - place[2 * j + 1],
        output[2 * i] - output[2 * j], output[2 * i + 1] - output[2 * j + 1],
    )  # fmt: skip
    return np.sqrt(x * x + y * y)


@kernel
def grid_over(place, output, reach, most):
    """Cells for agents at places and outputs (m,), at most ``most`` of them."""
    left, low, right, high, longest = np.inf, np.inf, -np.inf, -np.inf, 0.0
    for a in range(0, len(place), 2):
        x, y = 0.5 * (place[a] + output[a]), 0.5 * (place[a + 1] + output[a + 1])
        left, right, low, high = min(left, x), max(right, x), min(low, y), max(high, y)
        for b in range(a, a + 2):
            longest = max(longest, abs(output[b] - place[b]))
    side = reach + longest
    if not max(right - left, high - low) < WIDEST * side:
        return Grid(left, low, side, 1, 1)
    columns, rows = int((right - left) / side) + 1, int((high - low) / side) + 1
    while columns * rows > most:
        side *= 2.0
        columns, rows = int((right - left) / side) + 1, int((high - low) / side) + 1
    return Grid(left, low, side, columns, rows)


@kernel
def place_in(grid, x, y):
    """Column and row of a point."""
    column = min(int((x - grid.left) / grid.side), grid.columns - 1) if grid.columns > 1 else 0
    row = min(int((y - grid.low) / grid.side), grid.rows - 1) if grid.rows > 1 else 0
    return column, row


@kernel
def find(near, place, output, reach, known):
    """Append all pairs that are nearer than ``reach`` to near.first and near.second.

    Args:
        near: with room for them, and near.numbers.pairs that are there; likewise changed.
        place, output: q and y (m,) in m.
        reach: in m.
        known: pairs nearer than this (m) by near.place and near.output are there already, as are
            those behind the first near.numbers.renewed; 0 where nothing is.
    """
    head, following = near.head, near.following
    grid = grid_over(place, output, reach, len(head))
    for cell in range(grid.columns * grid.rows):
        head[cell] = -1.0
    for i in range(len(place) // 2):
        x = 0.5 * (place[2 * i] + output[2 * i])
        y = 0.5 * (place[2 * i + 1] + output[2 * i + 1])
        column, row = place_in(grid, x, y)
        for other in range(max(row - 1, 0), min(row + 2, grid.rows)):
            for beside in range(max(column - 1, 0), min(column + 2, grid.columns)):
                begin = int(head[other * grid.columns + beside])
                append(near, place, output, Wanted(reach, known, i), begin)
        cell = row * grid.columns + column
        following[i], head[cell] = head[cell], i


class Wanted(NamedTuple):
    """Whose neighbours, within what, and not those that are known."""

    reach: Any
    known: Any
    agent: Any


@kernel
def append(near, place, output, wanted, begin):
    """Append the pairs with agents of a cell, of which ``begin`` came last; -1 of an empty one."""
    i, j, numbers = wanted.agent, begin, near.numbers
    while j >= 0:
        close = distance(place, output, j, i) < wanted.reach
        if close and not is_known(near, wanted.known, j, i):
            count = int(numbers.pairs)
            near.first[count], near.second[count] = j, i
            numbers.pairs = count + 1.0
        j = int(near.following[j])


@kernel
def is_known(near, known, i, j):
    """Whether a pair is in the list."""
    if known == 0.0:
        return False
    if distance(near.place, near.output, i, j) < known:
        return True
    for k in range(int(near.numbers.renewed), int(near.numbers.pairs)):
        if near.first[k] == i and near.second[k] == j:
            return True
    return False
