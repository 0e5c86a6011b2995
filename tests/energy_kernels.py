"""The energy game in hand-written kernels: q = [price, budget, gap, weights (N), wanted (N)].

J_i = w_i / 2 (y_i - d_i)^2 + c y_i mean(y); sum y^2 <= budget; |y_i - y_{i-1}| <= gap on a ring.
"""

import sys

import numpy as np

from gne_mj.game_model import Game
from gne_mj.native import kernel


def energy_game(weight, wanted, price, budget, gap):
    n = len(wanted)
    return Game(
        name="energy",
        kernels=sys.modules[__name__],
        parameters=np.array([price, budget, gap, *weight, *wanted]),
        sizes=(1,) * n,
        in_cost=[list(range(n))] * n,
        in_constraint=[list(range(n)), *([i, (i - 1) % n] for i in range(n))],
        constraint_names=("energy", *(f"gap {i}" for i in range(n))),
        affine=True,
        constraint_class="quadratic",
        smooth=True,
        tested=True,
        box=(np.full(n, -np.sqrt(budget)), np.full(n, np.sqrt(budget))),
    )


@kernel
def mean(y):
    total = 0.0
    for j in range(len(y)):
        total += y[j]
    return total / len(y)


@kernel
def cost(q, i, y):
    n = len(y)
    return 0.5 * q[3 + i] * (y[i] - q[3 + n + i]) ** 2 + q[0] * y[i] * mean(y)


@kernel
def cost_gradient(q, i, a, y):
    n = len(y)
    return q[3 + i] * (y[i] - q[3 + n + i]) + q[0] * (mean(y) + y[i] / n)


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    n = len(y)
    for b in range(n):
        out[b] += scale * q[0] / n
    out[i] += scale * (q[3 + i] + q[0] / n)


@kernel
def before(l, y):
    return y[l - 2] if l > 1 else y[len(y) - 1]


@kernel
def constraint(q, l, y):
    if l == 0:
        total = -q[1]
        for j in range(len(y)):
            total += y[j] ** 2
        return total
    gap = y[l - 1] - before(l, y)
    return (gap - q[2]) * (gap + q[2])


@kernel
def constraint_gradient(q, l, a, y):
    if l == 0:
        return 2.0 * y[a]
    return (2.0 if a == l - 1 else -2.0) * (y[l - 1] - before(l, y))


@kernel
def constraint_hessian(q, l, a, b, y):
    if l == 0:
        return 2.0 if a == b else 0.0
    return 2.0 if a == b else -2.0
