"""The classical problems once more, by hand, and a solver of their KKT conditions by SciPy.

Costs are the examples' own functions, called with NumPy's numbers; constraints, all affine, are
written anew. Nothing here knows the package.
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares

INF = np.inf


def _spread(y):
    s = np.array([40, 35, 32]) - np.array([40 / 500, 35 / 400, 32 / 600]) * y.reshape(4, 3).sum(
        axis=0
    )
    d = s - np.roll(s, -1)
    return [*(d - 1), *(-d - 1)]


_A3 = [
    lambda y: y[0] + y[1] + y[2] - 20,
    lambda y: y[0] + y[1] - y[2] - y[3] + y[6] - 5,
    lambda y: y[3] - y[4] - y[1] - y[2] + y[5] - 7,
    lambda y: y[6] - y[0] - y[2] + y[3] - 4,
]
_A3_OWNERS = [[0], [0], [1], [2]]


def rows(name, y, p):
    """g(y) of all constraints but bounds of actions, and whose each is (None: everybody's)."""
    if name in ("a3", "a5"):
        return [g(y) for g in _A3], _A3_OWNERS
    found = {
        "a1": lambda: [y.sum() - 1],
        "a8": lambda: [y[0] + y[1] - 1, y[2] - y[0] - y[1]],
        "a11": lambda: [y.sum() - 1],
        "a12": list,
        "a13": lambda: [
            np.dot([3.25, 1.25, 4.125], y) - 100, np.dot([2.2915, 1.5625, 2.8125], y) - 100,
        ],
        "a14": lambda: [y.sum() - 1],
        "a15": list,
        "a16": lambda: [y.sum() - p.P],
        "a17": lambda: [y[0] + 2 * y[1] - y[2] - 14, 3 * y[0] + 2 * y[1] + y[2] - 30],
        "a18": lambda: [*(y.reshape(4, 3).sum(axis=1) - [100, 50, 100, 50]), *_spread(y)],
        "harker": lambda: [y.sum() - 15],
        "rosen": lambda: [1 - y.sum()],
        "rate": lambda: [
            *(y.reshape(3, 4).sum(axis=1) - 1), *(y.reshape(3, 4).sum(axis=0) - p.most),
        ],
        "transport": lambda: [y[1] + y[3] - p.K],
    }[name]()  # fmt: skip
    some = {"a1": [range(1, 10)], "a8": [[0, 1], [0, 1]]}
    return found, some.get(name, [None] * len(found))


LOWER = {"a1": [0.3] + 9 * [0.01], "a3": -10, "a11": -INF, "a12": -10, "a14": 0.01}
UPPER = {"a1": [0.5] + 9 * [INF], "a3": 10, "a5": 10, "a8": [INF, INF, 2], "a12": 10,
         "a15": [80, 80, 50, 55, 30, 40], "harker": 10}  # fmt: skip


def profile(y, sizes):
    """A flat profile as costs have it."""
    if len(set(sizes)) == 1:
        return y if sizes[0] == 1 else y.reshape(len(sizes), -1)
    parts = np.split(y, np.cumsum(sizes)[:-1])
    return tuple(part[0] if len(part) == 1 else part for part in parts)


def pseudo_gradient(cost, y, p, sizes):
    """F(y), each derivative by a complex step."""
    owner, found = np.repeat(np.arange(len(sizes)), sizes), np.zeros(len(y))
    for a in range(len(y)):
        z = y.astype(complex)
        z[a] += 1e-30j
        found[a] = np.imag(cost(int(owner[a]), profile(z, sizes), p)) / 1e-30
    return found


class Oracle:
    """One problem.

    Args:
        name: of the problem.
        cost: its function.
        parameters: its numbers.
        sizes: m_i.
    """

    def __init__(self, name, cost, parameters, sizes):
        self.name, self.cost, self.sizes = name, cost, sizes
        self.p = SimpleNamespace(**{
            key: np.array(value) if isinstance(value, list) else value
            for key, value in parameters.items()
        })  # fmt: skip
        m = sum(sizes)
        owner = np.repeat(np.arange(len(sizes)), sizes)
        zero, owners = rows(name, np.zeros(m), self.p)
        slopes = [np.array(rows(name, e, self.p)[0]) - zero for e in np.eye(m)]
        self.G = np.array(slopes).reshape(m, -1).T
        self.h = -np.array(zero, float)
        mask = np.array([[o is None or i in o for i in owner] for o in owners]).reshape(-1, m)
        self.own = self.G * mask
        for bound, sign in ((LOWER.get(name, 0), -1.0), (UPPER.get(name, INF), 1.0)):
            for a, each in enumerate(np.broadcast_to(np.array(bound, float), m)):
                if np.isfinite(each):
                    row = sign * np.eye(m)[a]
                    self.G, self.own = np.vstack([self.G, row]), np.vstack([self.own, row])
                    self.h = np.append(self.h, sign * each)

    def F(self, y):
        """The pseudo-gradient."""
        return pseudo_gradient(self.cost, y, self.p, self.sizes)

    def solve(self, y):
        """A KKT point with one multiplier a constraint, by Fischer and Burmeister's function."""
        m = len(y)

        def residual(z):
            y, multiplier = z[:m], z[m:]
            slack = self.h - self.G @ y
            complementary = np.hypot(multiplier, slack) - multiplier - slack
            return np.append(self.F(y) + multiplier @ self.own, complementary)

        start = np.append(y, np.full(len(self.h), 0.1))
        found = least_squares(residual, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=2000)
        return found.x[:m], float(np.max(np.abs(found.fun)))

    def best_response(self, y, i):
        """Agent i's, of one entry, from its cost at many places of its interval."""
        own, room = self.own[:, i], self.h - self.G @ y
        ends = [(room[k] / own[k], own[k]) for k in np.flatnonzero(own)]
        low = max((y[i] + t for t, slope in ends if slope < 0), default=-1e3)
        high = min((y[i] + t for t, slope in ends if slope > 0), default=1e3)

        def slope(t):
            return self.F(np.where(np.arange(len(y)) == i, t, y))[i]

        for _ in range(200):  # convex in its own action: bisection
            middle = 0.5 * (low + high)
            low, high = (low, middle) if slope(middle) > 0 else (middle, high)
        return 0.5 * (low + high)
