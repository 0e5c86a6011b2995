"""Costs that fall for ever: no equilibrium."""

import sys

import numpy as np

from gne_mj.game_model import Game


def game(count):
    return Game(
        name="endless", kernels=sys.modules[__name__], parameters=np.zeros(1), sizes=(1,) * count,
        in_cost=[[i] for i in range(count)], in_constraint=[[i] for i in range(count)],
        constraint_names=tuple(f"floor {i + 1}" for i in range(count)),
    )  # fmt: skip


def cost(q, i, y):
    return -y[i]


def cost_gradient(q, i, a, y):
    return -1.0


def constraint(q, k, y):
    return -1.0 - y[k]


def constraint_gradient(q, k, a, y):
    return -1.0
