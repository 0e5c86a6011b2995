"""Agents that keep apart, in plain and slow Python: an oracle for half-planes and pushes.

Points have 2 or 3 entries."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation


def nearest_point(a, b):
    """On the segment from a to b, nearest to 0."""
    way = b - a
    share = 0.0 if way @ way == 0.0 else np.clip(-(a @ way) / (way @ way), 0.0, 1.0)
    return a + share * way


def lifted(point):
    return np.array([*point, 0.0][:3])


def turning_axis(p):
    """What p turns about: the vertical's part that is across it; where it is upright, x's."""
    p = lifted(p)
    for direction in np.eye(3)[[2, 0]]:
        across = direction - (direction @ p) * p
        if np.hypot(*p[:2]) > 1e-9 or direction[0]:
            return across / np.linalg.norm(across)
    raise AssertionError


def half_plane(r, turn, a, b):
    """n by bisection: the nearest point's direction, turned while half of the margin is left."""
    p = nearest_point(a, b)
    size = np.linalg.norm(p)

    axis = turning_axis(p / size)

    def turned(angle):
        return (Rotation.from_rotvec(angle * axis).as_matrix() @ lifted(p / size))[: len(p)]

    def good(angle):
        n, least = turned(angle), r + 0.5 * (size - r)
        return min(n @ a, n @ b) >= least

    if good(turn):
        return turned(turn)
    low, high = 0.0, turn
    for _ in range(60):
        half = 0.5 * (low + high)
        low, high = (half, high) if good(half) else (low, half)
    return turned(low)


@dataclass
class Swap:
    """Rigid-law robots that want places: J_i = w |y_i - place_i|^2, in a disc or ball about 0."""

    place: np.ndarray  # (N, 2) or (N, 3)
    radius: float
    rho: float
    r: float
    reach: float
    turn: float
    weight: float = 1.0

    def pairs(self, q, y):
        """Those that are near, with their half-planes."""
        q, y = q.reshape(self.place.shape), y.reshape(self.place.shape)
        found = []
        for i in range(len(q)):
            for j in range(i + 1, len(q)):
                a, b = q[i] - q[j], y[i] - y[j]
                if np.linalg.norm(nearest_point(a, b)) < self.reach:
                    found.append((i, j, half_plane(self.r, self.turn, a, b)))
        return found

    def energy(self, y, pairs):
        """Whose gradient, the other way, is the law: costs, the disc's barrier and the pairs'."""
        points, most = y.reshape(self.place.shape), self.reach - self.r
        total = self.weight * np.sum((points - self.place) ** 2)
        total = total - self.rho * np.sum(np.log(self.radius**2 - np.sum(points**2, axis=1)))
        for i, j, n in pairs:
            slack = n @ (points[i] - points[j]) - self.r
            if slack.real < most:
                total = total - self.rho * (np.log(slack / most) - slack / most + 1.0)
        return total

    def law(self, y, pairs):
        """(m,) inputs, by complex steps."""
        steps = 1e-30j * np.eye(len(y))
        return -np.array([self.energy(y + step, pairs).imag / 1e-30 for step in steps])

    def implicit(self, free, slope, y, pairs):
        """The outputs y+ = free + slope law(y+), by SciPy from where agents are."""

        def equation(z):
            return (z - free) / slope - self.law(z, pairs)

        found = root(equation, y, tol=1e-13)
        assert np.max(np.abs(equation(found.x))) < 1e-8 * np.max(1.0 / slope)
        return found.x
