"""J_i = y_i log y_i + 9 y_i below 4, as kernels."""

import math

from gne_mj.native import kernel


@kernel
def cost(q, i, y):
    return y[i] * math.log(y[i]) + 9.0 * y[i]


@kernel
def cost_gradient(q, i, a, y):
    return math.log(y[i]) + 10.0


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    out[a] += scale / y[a]


@kernel
def constraint(q, k, y):
    return y[k] - 4.0


@kernel
def constraint_gradient(q, k, a, y):
    return 1.0


@kernel
def constraint_hessian(q, k, a, b, y):
    return 0.0
