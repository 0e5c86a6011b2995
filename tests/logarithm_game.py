"""A cost that is defined for positive actions only, which no constraint says."""

import sys

import numpy as np

from gne_mj.game_model import Game


def game(count):
    return Game(
        name="logarithm", kernels=sys.modules[__name__], parameters=np.zeros(1),
        sizes=(1,) * count, in_cost=[[i] for i in range(count)],
        in_constraint=[[i] for i in range(count)],
        constraint_names=tuple(f"ceiling {i + 1}" for i in range(count)),
    )  # fmt: skip


def cost(q, i, y):
    return y[i] * np.log(y[i]) + 9.0 * y[i]


def cost_gradient(q, i, a, y):
    return np.log(y[i]) + 10.0


def constraint(q, k, y):
    return y[k] - 4.0


def constraint_gradient(q, k, a, y):
    return 1.0


def constraint_hessian(q, k, a, b, y):
    return 0.0
