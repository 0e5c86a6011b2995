"""Slow versions of the laws for actions of any dimension, as reference.py has them for scalars.

A game here is plain Python: sizes (m_i), cost(i, y), constraint(l, y), p and members (agents of
each constraint). Gradients are taken by the complex step. estimates: (N, m), row i agent i's
profile **y**^i, whose own block is never read.
"""

import numpy as np

STEP = 1e-30


class CoupledGame:
    """The formulas in the docstring of coupled_game.py."""

    sizes = (2, 1, 1)
    p = 2

    def __init__(self, quartic):
        self.quartic = quartic

    def cost(self, i, y):
        own = [[0, 1], [2], [3]][i]
        total = 0.0
        for a in own:
            others = sum((a + b + 1) * np.sin(y[b]) for b in range(4) if b not in own)
            total += y[a] ** 2 / 2 + self.quartic * y[a] ** 4 / 4 + 0.1 * y[a] * others
        return total

    def constraint(self, l, y):  # noqa: E741
        return [y @ y - 4, y[1] * y[2] - 1][l]


def blocks(sizes):
    """Where each agent's action stands in a profile."""
    ends = np.cumsum(sizes)
    return [slice(end - size, end) for size, end in zip(sizes, ends, strict=True)]


def gradient(function, y):
    """Of a real function of a profile, (m,)."""
    y = np.asarray(y, dtype=float)
    return np.array([np.imag(function(y + 1j * STEP * e)) / STEP for e in np.eye(len(y))])


def barrier_gradient(game, rho, y):
    """sum_l rho / (-g_l) grad g_l [eq:logbarrier], (m,)."""
    total = np.zeros(len(y))
    for k in range(game.p):
        slope = gradient(lambda x, k=k: game.constraint(k, x), y)
        total += rho / -game.constraint(k, y) * slope
    return total


def profiles_of(game, y, estimates):
    """The rows **y**^i with the true own actions in place."""
    rows = np.array(estimates, dtype=float)
    for i, at in enumerate(blocks(game.sizes)):
        rows[i, at] = y[at]
    return rows


def disagreements(rows, neighbours):
    """sum_{j in N_i} (**y**^i - **y**^j), (N, m)."""
    return np.array(
        [sum((rows[i] - rows[j] for j in heard), 0 * rows[i]) for i, heard in enumerate(neighbours)]
    )


def cost_gradients(game, rows):
    """col(dJ_i/dy_i) at each agent's own profile, (m,)."""
    total = np.zeros(rows.shape[1])
    for i, at in enumerate(blocks(game.sizes)):
        total[at] = gradient(lambda x, i=i: game.cost(i, x), rows[i])[at]
    return total


def full_information(game, rho, y):
    """[eq:nonlinFIfeedback]: u (m,)."""
    rows = np.tile(y, (len(game.sizes), 1))
    return -cost_gradients(game, rows) - barrier_gradient(game, rho, y)


def partial_information(game, rho, neighbours, c, tau, y, estimates):
    """[eq:nonlinearPIFeedback]: u (m,) and the estimates' rates (N, m), own blocks zero."""
    rows = profiles_of(game, y, estimates)
    apart = disagreements(rows, neighbours)
    u = -cost_gradients(game, rows) - barrier_gradient(game, rho, y)
    rates = -c / tau * apart
    for i, at in enumerate(blocks(game.sizes)):
        u[at] -= c * apart[i, at]
        rates[i, at] = 0.0
    return u, rates


def fully_distributed(game, rho, neighbours, k, epsilon, y, z, estimates):
    """[eq:CenterFeedback]: u (m,), the rates of the estimates (N, m) and of z (m,)."""
    rows = profiles_of(game, y, estimates)
    filtered = profiles_of(game, z, estimates)
    u = -k * cost_gradients(game, rows)
    rates = -disagreements(rows, neighbours) / epsilon
    for i, at in enumerate(blocks(game.sizes)):
        u[at] -= k * barrier_gradient(game, rho, filtered[i])[at]
        rates[i, at] = 0.0
    return u, rates, (y - z) / epsilon
