"""Which agents are near each other, by cells: work grows with neighbours, not pairs.

An agent is a segment here, from its position q to its output y. The difference of two agents runs
from q_i - q_j to y_i - y_j, and its least length is their distance. Cells are as wide as the reach
and the longest of those segments together, so that whoever is within reach is in the same cell or
in one beside it.

Points lie behind each other in flat arrays, 2 or 3 numbers each. How many is the length of a tuple,
PLANE or SPACE, and so known to the compiler; by themselves they are tuples of three.
"""

from typing import Any, NamedTuple

import numpy as np

from gne_mj.native import kernel

PLANE, SPACE = (0.0, 0.0), (0.0, 0.0, 0.0)
WIDEST = 1e12  # of the agents' extent, in cells: beyond it one cell holds all


class Grid(NamedTuple):
    """Cells over all agents' middles."""

    left: Any  # m
    near: Any  # m
    low: Any  # m
    side: Any  # m
    columns: Any
    rows: Any
    layers: Any


@kernel
def dot(a, b):
    """a.b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def difference(origin, points, i, j):
    """From point j to point i."""
    a, b = len(origin) * i, len(origin) * j
    up = points[a + 2] - points[b + 2] if len(origin) == 3 else 0.0
    return points[a] - points[b], points[a + 1] - points[b + 1], up


@kernel
def nearest_point(a, b):
    """The point nearest to 0 on the segment from a to b."""
    e = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    length, along = dot(e, e), -dot(a, e)
    share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    return a[0] + share * e[0], a[1] + share * e[1], a[2] + share * e[2]


@kernel
def distance(origin, place, output, i, j):
    """Of agents i and j, in m: the least length on the way from q_i - q_j to y_i - y_j."""
    p = nearest_point(difference(origin, place, i, j), difference(origin, output, i, j))
    return np.sqrt(dot(p, p))


@kernel
def grid_over(origin, place, output, reach, most):
    """Cells for agents at places and outputs (m,), at most ``most`` of them."""
    left, near, low = np.inf, np.inf, np.inf
    right, far, high, longest = -np.inf, -np.inf, -np.inf, 0.0
    for i in range(len(place) // len(origin)):
        x, y, z = middle(origin, place, output, i)
        left, right, near, far = min(left, x), max(right, x), min(near, y), max(far, y)
        if len(origin) == 3:
            low, high = min(low, z), max(high, z)
            longest = max(longest, abs(output[3 * i + 2] - place[3 * i + 2]))
        for a in range(len(origin) * i, len(origin) * i + 2):
            longest = max(longest, abs(output[a] - place[a]))
    side = reach + longest
    if not max(right - left, far - near, high - low) < WIDEST * side:
        return Grid(left, near, low, side, 1, 1, 1)
    while True:
        columns, rows = int((right - left) / side) + 1, int((far - near) / side) + 1
        layers = int((high - low) / side) + 1 if len(origin) == 3 else 1
        if not columns * rows * layers > most:
            return Grid(left, near, low, side, columns, rows, layers)
        side *= 2.0


@kernel
def middle(origin, place, output, i):
    """Of agent i's segment."""
    a = len(origin) * i
    up = 0.5 * (place[a + 2] + output[a + 2]) if len(origin) == 3 else 0.0
    return 0.5 * (place[a] + output[a]), 0.5 * (place[a + 1] + output[a + 1]), up


@kernel
def place_in(grid, point):
    """Column, row and layer of a point."""
    return (
        min(int((point[0] - grid.left) / grid.side), grid.columns - 1) if grid.columns > 1 else 0,
        min(int((point[1] - grid.near) / grid.side), grid.rows - 1) if grid.rows > 1 else 0,
        min(int((point[2] - grid.low) / grid.side), grid.layers - 1) if grid.layers > 1 else 0,
    )


@kernel
def find(origin, near, place, output, reach, known):
    """Append all pairs that are nearer than ``reach`` to near.first and near.second.

    Args:
        origin: PLANE or SPACE.
        near: with room for them, and near.numbers.pairs that are there; likewise changed.
        place, output: q and y (m,) in m.
        reach: in m.
        known: pairs nearer than this (m) by near.place and near.output are there already, as are
            those behind the first near.numbers.renewed; 0 where nothing is.
    """
    head, following = near.head, near.following
    grid = grid_over(origin, place, output, reach, len(head))
    for cell in range(grid.columns * grid.rows * grid.layers):
        head[cell] = -1.0
    for i in range(len(place) // len(origin)):
        column, row, layer = place_in(grid, middle(origin, place, output, i))
        wanted = Wanted(origin, reach, known, i)
        for above in range(max(layer - 1, 0), min(layer + 2, grid.layers)):
            for other in range(max(row - 1, 0), min(row + 2, grid.rows)):
                for beside in range(max(column - 1, 0), min(column + 2, grid.columns)):
                    begin = int(head[(above * grid.rows + other) * grid.columns + beside])
                    append(near, place, output, wanted, begin)
        cell = (layer * grid.rows + row) * grid.columns + column
        following[i], head[cell] = head[cell], i


class Wanted(NamedTuple):
    """Whose neighbours, within what, and not those that are known."""

    origin: Any
    reach: Any
    known: Any
    agent: Any


@kernel
def append(near, place, output, wanted, begin):
    """Append the pairs with agents of a cell, of which ``begin`` came last; -1 of an empty one."""
    i, j, numbers = wanted.agent, begin, near.numbers
    while j >= 0:
        close = distance(wanted.origin, place, output, j, i) < wanted.reach
        if close and not is_known(wanted.origin, near, wanted.known, j, i):
            count = int(numbers.pairs)
            near.first[count], near.second[count] = j, i
            numbers.pairs = count + 1.0
        j = int(near.following[j])


@kernel
def is_known(origin, near, known, i, j):
    """Whether a pair is in the list."""
    if known == 0.0:
        return False
    if distance(origin, near.place, near.output, i, j) < known:
        return True
    for k in range(int(near.numbers.renewed), int(near.numbers.pairs)):
        if near.first[k] == i and near.second[k] == j:
            return True
    return False
