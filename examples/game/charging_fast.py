"""Electric vehicles charge behind one feeder, as a game of kernels.

Vehicle i chooses its power y_i (kW). J_i = a_i / 2 (y_i - d_i)^2 + c y_i sum_j y_j: it wants d_i,
and the price per kW rises with the total. Shared constraints: y_i >= 0 and sum y <= capacity.

q = [c, capacity, a_1, d_1, a_2, d_2, ...]
"""

import sys

import numpy as np

from gne_mj.game_model import Game
from gne_mj.native import kernel


def game(count, capacity, slope, weight, wanted):
    """The game of ``count`` vehicles; weight and wanted list one number for each."""
    if not len(weight) == len(wanted) == count:
        raise ValueError(f"weight and wanted must list {count} numbers each")
    everyone = list(range(count))
    return Game(
        name="charging",
        kernels=sys.modules[__name__],
        parameters=np.array([slope, capacity, *np.column_stack([weight, wanted]).ravel()]),
        sizes=(1,) * count,
        in_cost=[everyone] * count,
        in_constraint=[*([i] for i in everyone), everyone],
        constraint_names=(*(f"vehicle {i + 1} takes power" for i in everyone), "feeder"),
        action_name="power",
        action_unit="kW",
        affine=True,
    )


@kernel
def total(y):
    """Sum of all powers."""
    power = 0.0
    for j in range(len(y)):
        power += y[j]
    return power


@kernel
def cost(q, i, y):
    """J_i(y)."""
    return 0.5 * q[2 + 2 * i] * (y[i] - q[3 + 2 * i]) ** 2 + q[0] * y[i] * total(y)


@kernel
def cost_gradient(q, i, a, y):
    """dJ_i/dy_i."""
    return q[2 + 2 * i] * (y[i] - q[3 + 2 * i]) + q[0] * (y[i] + total(y))


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """out[b] += scale * d2J_i/dy_i dy_b."""
    for b in range(len(y)):
        out[b] += scale * q[0]
    out[i] += scale * (q[2 + 2 * i] + q[0])


@kernel
def constraint(q, k, y):
    """-y_k for the vehicles, then the feeder's load above its capacity."""
    return -y[k] if k < len(y) else total(y) - q[1]


@kernel
def constraint_gradient(q, k, a, y):
    """dg_k/dy_a."""
    return -1.0 if k < len(y) else 1.0


@kernel
def constraint_hessian(q, k, a, b, y):
    """All constraints are affine."""
    return 0.0
