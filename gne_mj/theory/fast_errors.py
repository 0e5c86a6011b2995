"""How far estimates and z lag behind actions that move: the fast part of [eq:CenterFeedback].

What agent i takes action r of agent j to be is off by xi, with epsilon xi' = -L_j xi - epsilon y_r'
over all i (L_j: the Laplacian without row and column j), and z_r by zeta, with 1 in place of L_j.
From zero, xi(t) = -epsilon * integral of k(s) y_r'(t - epsilon s) over s >= 0, where
k_ij(s) = (exp(-L_j s) 1)_i. Since L_j is an M-matrix with L_j 1 >= 0, k lies between 0 and 1 and
falls in s; its integral over all s is h_j = L_j^-1 1.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.graph import Graph

Array = NDArray[np.float64]

# The integrals of greatest kernels: points, and the end in time constants of the slowest mode
_POINTS, _END = 600, 40.0


class Lags:
    """Lags of all agents' estimates and z, per unit of epsilon and speed.

    Args:
        graph: over which agents communicate.
    """

    def __init__(self, graph: Graph) -> None:
        self._agents = graph.agents
        self._laplacian = graph.laplacian

    def grounded(self, agent: int) -> Array:
        """L_j (N - 1, N - 1)."""
        rest = np.arange(self._agents) != agent
        return self._laplacian[np.ix_(rest, rest)]

    @cached_property
    def total(self) -> Array:
        """h (N, N): h_ij of agent i about agent j; 1 on the diagonal, of z."""
        found = np.ones((self._agents, self._agents))
        for j in range(self._agents):
            rest = np.arange(self._agents) != j
            found[rest, j] = np.linalg.solve(self.grounded(j), np.ones(self._agents - 1))
        return found

    def of_greatest(self, owners: NDArray[np.int64]) -> Array:
        """The integral of max_j k_ij(s) over these agents j, from above: (N,).

        The kernels fall, so that a sum of left ends over the points is above the integral; what is
        beyond the last point is at most the sum over j of all that is left of each.
        """
        widths, kernels, rest = self._sampled
        greatest = np.max(kernels[:, :, owners], axis=2)
        return np.sum(widths[:, None] * greatest, axis=0) + np.sum(rest[:, owners], axis=1)

    @cached_property
    def _sampled(self) -> "_Sampled":
        n = self._agents
        slowest = [np.linalg.eigvalsh(self.grounded(j))[0] for j in range(n) if n > 1]
        end = _END / min([1.0, *slowest])
        times = end * np.linspace(0.0, 1.0, _POINTS) ** 2
        kernels = np.repeat(np.exp(-times)[:, None, None], n, axis=1).repeat(n, axis=2)
        rest = np.full((n, n), np.exp(-end))
        for j in range(n):
            others = np.arange(n) != j
            values, basis = np.linalg.eigh(self.grounded(j))
            fading = np.exp(-np.outer(times, values)) * basis.sum(axis=0)
            kernels[:, others, j] = fading @ basis.T
            rest[others, j] = basis @ (fading[-1] / values)
        return _Sampled(np.diff(times), kernels[:-1], rest)


class _Sampled(NamedTuple):
    widths: Array  # (points,)
    kernels: Array  # (points, N, N), at each interval's left end
    rest: Array  # (N, N), of the integral beyond the last point
