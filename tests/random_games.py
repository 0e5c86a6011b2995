"""Kernels of games of one action an agent, with any affine F and any constraints of degree two.

J_i = y_i (M_ii y_i / 2 + sum_{j != i} M_ij y_j + c_i), so that F = M y + c; and
g_l = sum_a (A_la y_a + Q_la y_a^2 / 2) - b_l. q = [N, M by rows, c, (A_l, Q_l, b_l) of each l].
"""

import sys

import numpy as np

from gne_mj.game_model import Game
from gne_mj.native import kernel


@kernel
def cost(q, i, y):
    n = int(q[0])
    total = q[1 + n * n + i] + 0.5 * q[1 + n * i + i] * y[i]
    for j in range(n):
        if j != i:
            total += q[1 + n * i + j] * y[j]
    return y[i] * total


@kernel
def cost_gradient(q, i, a, y):
    n = int(q[0])
    total = q[1 + n * n + i]
    for j in range(n):
        total += q[1 + n * i + j] * y[j]
    return total


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    n = int(q[0])
    for j in range(n):
        out[j] += scale * q[1 + n * i + j]


@kernel
def row(q, k):
    n = int(q[0])
    return 1 + n * n + n + k * (2 * n + 1)


@kernel
def constraint(q, k, y):
    n, at = int(q[0]), row(q, k)
    total = -q[at + 2 * n]
    for a in range(n):
        total += (q[at + a] + 0.5 * q[at + n + a] * y[a]) * y[a]
    return total


@kernel
def constraint_gradient(q, k, a, y):
    n, at = int(q[0]), row(q, k)
    return q[at + a] + q[at + n + a] * y[a]


@kernel
def constraint_hessian(q, k, a, b, y):
    n, at = int(q[0]), row(q, k)
    return q[at + n + a] if a == b else 0.0


class RandomGame:
    """A random game, its numbers, and the Game of the product.

    F is strongly monotone and not symmetric, 0 is inside, and the unconstrained equilibrium is not.
    """

    def __init__(self, seed, agents=3, constraints=3, curved=False):
        rng = np.random.default_rng(seed)
        n, p = agents, constraints
        mixed = rng.normal(size=(n, n))
        self.M = 0.3 * (mixed - mixed.T) + np.diag(rng.uniform(1.0, 2.0, n))
        self.c = -self.M @ rng.uniform(1.0, 2.0, n)
        self.A = rng.uniform(0.2, 1.0, (p, n))
        self.Q = rng.uniform(0.2, 1.0, (p, n)) if curved else np.zeros((p, n))
        self.b = rng.uniform(0.5, 1.0, p)
        rows = np.hstack([self.A, self.Q, self.b[:, None]])
        everyone = list(range(n))
        self.game = Game(
            "random", sys.modules[__name__],
            np.concatenate([[n], self.M.ravel(), self.c, rows.ravel()]),
            (1,) * n, [[i, *(j for j in everyone if j != i)] for i in everyone], [everyone] * p,
            tuple(f"constraint {k + 1}" for k in range(p)), affine=True,
            constraint_class="quadratic" if curved else "affine", smooth=True, tested=True,
        )  # fmt: skip

    def F(self, y):
        return self.M @ y + self.c

    def g(self, y):
        return self.A @ y + 0.5 * self.Q @ y**2 - self.b

    def J(self, y):
        return self.A + self.Q * y
