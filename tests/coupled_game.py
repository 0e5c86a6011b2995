"""Kernels of a game whose agents have actions of two, one and one entries, and curved constraints.

J_i = sum_a (y_a^2 / 2 + q_0 y_a^4 / 4 + 0.1 y_a sum_b (a + b + 1) sin y_b), a over the agent's
entries and b over the others'; g_0 = |y|^2 - 4 and g_1 = y_1 y_2 - 1, of agents 0 and 1.
"""

import numpy as np

from gne_mj.native import kernel

SIZES = (2, 1, 1)
IN_CONSTRAINT = ((0, 1, 2), (0, 1))


@kernel
def own(i, b):
    """Whether entry b is agent i's."""
    return b < 2 if i == 0 else b == i + 1


@kernel
def cost(q, i, y):
    total = 0.0
    for a in range(4):
        if own(i, a):
            total += 0.5 * y[a] ** 2 + 0.25 * q[0] * y[a] ** 4
            for b in range(4):
                if not own(i, b):
                    total += 0.1 * y[a] * (a + b + 1) * np.sin(y[b])
    return total


@kernel
def cost_gradient(q, i, a, y):
    total = y[a] + q[0] * y[a] ** 3
    for b in range(4):
        if not own(i, b):
            total += 0.1 * (a + b + 1) * np.sin(y[b])
    return total


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    for b in range(4):
        if b == a:
            out[b] += scale * (1.0 + 3.0 * q[0] * y[a] ** 2)
        elif not own(i, b):
            out[b] += scale * 0.1 * (a + b + 1) * np.cos(y[b])


@kernel
def constraint(q, l, y):  # noqa: E741
    if l == 0:
        return y[0] ** 2 + y[1] ** 2 + y[2] ** 2 + y[3] ** 2 - 4.0
    return y[1] * y[2] - 1.0


@kernel
def constraint_gradient(q, l, a, y):  # noqa: E741
    if l == 0:
        return 2.0 * y[a]
    if a == 0:
        return 0.0
    return y[2] if a == 1 else y[1]


@kernel
def constraint_hessian(q, l, a, b, y):  # noqa: E741
    if l == 0:
        return 2.0 if a == b else 0.0
    return 1.0 if a != b and a > 0 and b > 0 else 0.0
