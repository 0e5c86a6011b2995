"""Slow, obvious games, from the paper alone and by the conventions of reference.py."""

import numpy as np


class VelocityGame:
    """Velocity synchronisation [eq:sensorNetGNE]: a chain of followers behind a reference.

    J_i = (y_i - y_{i-1})^2 + w_i (y_i - d_i)^2 and g_i = (y_i - y_{i-1})^2 - delta_i^2, with the
    reference v0 before agent 0. The constraints are shared, so y_i occurs in constraints i and
    i + 1.

    v0: float, m/s. delta: (N,) bounds on the velocity gaps, m/s. desired d: (N,), m/s, and
    weight w: (N,), which the paper's game does not have.
    """

    def __init__(self, v0, delta, desired=None, weight=None):
        self.v0 = float(v0)
        self.desired = np.zeros(len(delta)) if desired is None else np.array(desired, dtype=float)
        self.weight = np.zeros(len(delta)) if weight is None else np.array(weight, dtype=float)
        self.delta = np.array(delta, dtype=float)
        self.N = len(self.delta)
        self.p = self.N

    def gap(self, i, y):
        """y_i - y_{i-1} [eq:sensorNetGNE], a scalar; of agent 0: y_0 - v0. y: (N,)."""
        before = self.v0 if i == 0 else y[i - 1]
        return y[i] - before

    def cost(self, i, y):
        """J_i(y) [eq:sensorNetGNE], a scalar. y: (N,)."""
        return self.gap(i, y) ** 2 + self.weight[i] * (y[i] - self.desired[i]) ** 2

    def partial_gradient(self, i, y):
        """dJ_i/dy_i at y [eq:sensorNetGNE], a scalar. y: (N,)."""
        return 2 * self.gap(i, y) + 2 * self.weight[i] * (y[i] - self.desired[i])

    def constraint(self, l, y):  # noqa: E741
        """g_l(y) [eq:sensorNetGNE], a scalar, negative inside. y: (N,)."""
        return self.gap(l, y) ** 2 - self.delta[l] ** 2

    def constraint_gradient(self, l, y):  # noqa: E741
        """Full gradient of g_l at y [eq:sensorNetGNE]: (N,). y: (N,)."""
        gradient = np.zeros(self.N, dtype=np.asarray(y).dtype)
        gradient[l] = 2 * self.gap(l, y)
        if l > 0:
            gradient[l - 1] = -2 * self.gap(l, y)
        return gradient


class VelocityConsensusGame:
    """Velocity consensus with leaders, one entry of this oracle for each axis of each agent.

    J_i = sum over neighbours |y_i - y_j|^2 + w_i |y_i - v0|^2; |y_i - y_j|^2 - delta^2 <= 0 along
    every edge, then |y_i - v0|^2 - delta^2 <= 0 for every leader (w_i > 0).

    v0: (d,), m/s. edges: pairs of agents. weight: (agents,). delta: (edges + leaders,), m/s.
    N = agents * d scalar actions, agent by agent.
    """

    def __init__(self, v0, edges, weight, delta):
        self.v0 = np.array(v0, dtype=float)
        self.edges = [(int(i), int(j)) for i, j in edges]
        self.weight = np.array(weight, dtype=float)
        self.leaders = [i for i in range(len(weight)) if weight[i] > 0]
        self.delta = np.array(delta, dtype=float)
        self.d = len(self.v0)
        self.agents = len(self.weight)
        self.N = self.agents * self.d
        self.p = len(self.edges) + len(self.leaders)

    def velocity(self, i, y):
        """y_i: (d,). y: (N,)."""
        return y[i * self.d : (i + 1) * self.d]

    def cost(self, i, y):
        """J_i(y) of agent i, a scalar. y: (N,)."""
        own = self.velocity(i, y)
        total = self.weight[i] * np.sum((own - self.v0) ** 2)
        for edge in self.edges:
            if i in edge:
                other = edge[1] if edge[0] == i else edge[0]
                total = total + np.sum((own - self.velocity(other, y)) ** 2)
        return total

    def partial_gradient(self, a, y):
        """dJ_i/dy_a of the agent i that entry a belongs to, a scalar. y: (N,)."""
        i, k = divmod(a, self.d)
        total = 2 * self.weight[i] * (y[a] - self.v0[k])
        for edge in self.edges:
            if i in edge:
                other = edge[1] if edge[0] == i else edge[0]
                total = total + 2 * (y[a] - y[other * self.d + k])
        return total

    def gap(self, l, y):  # noqa: E741
        """y_i - y_j along edge l, then y_i - v0 of the leaders: (d,). y: (N,)."""
        if l < len(self.edges):
            i, j = self.edges[l]
            return self.velocity(i, y) - self.velocity(j, y)
        return self.velocity(self.leaders[l - len(self.edges)], y) - self.v0

    def constraint(self, l, y):  # noqa: E741
        """g_l(y), a scalar, negative inside. y: (N,)."""
        return np.sum(self.gap(l, y) ** 2) - self.delta[l] ** 2

    def constraint_gradient(self, l, y):  # noqa: E741
        """Full gradient of g_l at y: (N,). y: (N,)."""
        gradient = np.zeros((self.agents, self.d), dtype=np.asarray(y).dtype)
        if l < len(self.edges):
            i, j = self.edges[l]
            gradient[j] = -2 * self.gap(l, y)
        else:
            i = self.leaders[l - len(self.edges)]
        gradient[i] = 2 * self.gap(l, y)
        return gradient.ravel()


class OsnrGame:
    """Optical signal-to-noise ratio [eq:osnrGNE].

    J_i = a_i y_i - b_i ln(1 + c_i y_i / (n0_i + sum_{j != i} Gamma_ij y_j)); constraints in this
    order: -y_i <= 0 for i = 0..N-1, then sum(y) - P0 <= 0, so p = N + 1.

    price a, weight b, gain c, noise n0: (N,) each. gamma_matrix Gamma: (N, N), its diagonal is
    not used. power_limit P0: float. Powers in mW.
    """

    def __init__(self, price, weight, gain, noise, gamma_matrix, power_limit):
        self.price = np.array(price, dtype=float)
        self.weight = np.array(weight, dtype=float)
        self.gain = np.array(gain, dtype=float)
        self.noise = np.array(noise, dtype=float)
        self.gamma_matrix = np.array(gamma_matrix, dtype=float)
        self.power_limit = float(power_limit)
        self.N = len(self.price)
        self.p = self.N + 1

    def interference(self, i, y):
        """n0_i + sum_{j != i} Gamma_ij y_j [eq:osnrGNE], a scalar. y: (N,)."""
        total = self.noise[i]
        for j in range(self.N):
            if j != i:
                total = total + self.gamma_matrix[i, j] * y[j]
        return total

    def cost(self, i, y):
        """J_i(y) [eq:osnrGNE], a scalar. y: (N,)."""
        ratio = y[i] / self.interference(i, y)
        return self.price[i] * y[i] - self.weight[i] * np.log(1 + self.gain[i] * ratio)

    def partial_gradient(self, i, y):
        """dJ_i/dy_i at y [eq:osnrGNE], a scalar. y: (N,)."""
        denominator = self.interference(i, y) + self.gain[i] * y[i]
        return self.price[i] - self.weight[i] * self.gain[i] / denominator

    def constraint(self, l, y):  # noqa: E741
        """g_l(y) [eq:osnrGNE], a scalar, negative inside. y: (N,)."""
        if l < self.N:
            return -y[l]
        total = 0.0
        for j in range(self.N):
            total = total + y[j]
        return total - self.power_limit

    def constraint_gradient(self, l, y):  # noqa: E741
        """Full gradient of g_l at y [eq:osnrGNE]: (N,). y: (N,)."""
        gradient = np.zeros(self.N, dtype=np.asarray(y).dtype)
        if l < self.N:
            gradient[l] = -1
        else:
            gradient[:] = 1
        return gradient


class CournotGame:
    """Cournot competition of Salehisadaghiani, Shi and Pavel.

    J_i = cost_i y_i - y_i (intercept - sum_j y_j); constraints in this order: lower_i - y_i <= 0
    for i = 0..N-1, then y_i - upper_i <= 0 for i = 0..N-1, so p = 2 N.

    unit_cost, lower, upper: (N,) each. intercept: float, the price of an empty market.
    """

    def __init__(self, unit_cost, intercept, lower, upper):
        self.unit_cost = np.array(unit_cost, dtype=float)
        self.intercept = float(intercept)
        self.lower = np.array(lower, dtype=float)
        self.upper = np.array(upper, dtype=float)
        self.N = len(self.unit_cost)
        self.p = 2 * self.N

    def cost(self, i, y):
        """J_i(y), a scalar. y: (N,)."""
        return self.unit_cost[i] * y[i] - y[i] * (self.intercept - sum(y))

    def partial_gradient(self, i, y):
        """dJ_i/dy_i at y, a scalar. y: (N,)."""
        return self.unit_cost[i] - (self.intercept - sum(y)) + y[i]

    def constraint(self, l, y):  # noqa: E741
        """g_l(y), a scalar, negative inside. y: (N,)."""
        if l < self.N:
            return self.lower[l] - y[l]
        return y[l - self.N] - self.upper[l - self.N]

    def constraint_gradient(self, l, y):  # noqa: E741
        """Full gradient of g_l at y: (N,). y: (N,)."""
        gradient = np.zeros(self.N, dtype=np.asarray(y).dtype)
        gradient[l % self.N] = -1 if l < self.N else 1
        return gradient
