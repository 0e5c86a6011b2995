#!/usr/bin/env python
"""How much faster the OSNR twin is than SciPy, at the same measured accuracy.

Ten channels under the fully distributed law over the printed graph, rho = 0.1, y(0) = 0.2, T = 30 s
sampled each 0.05 s, for integrators and PI cascades and two (k, epsilon). Every solver's tolerance
is the loosest of a grid whose greatest error over all states and samples is at most 1e-6 of a
DOP853 reference at 1e-12; SciPy's absolute tolerance is 1e-3 of the relative one or equal to it,
whichever is faster, as is its method: Radau, BDF or LSODA. Ours includes the law, the monitor and
the inputs at all samples. SciPy is given the rate and the analytic Jacobian, compiled by numba; in
the rows "law by NumPy" the fastest of the three methods gets the rate written with NumPy arrays,
with that same compiled Jacobian or with none, as in a script where SciPy takes differences.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from gne_mj import graph as graphs
from gne_mj.controllers import FullyDistributed
from gne_mj.controllers.propagation import no_propagator
from gne_mj.games import osnr_game, ten_channels
from gne_mj.loops.feedback import Problem
from gne_mj.loops.layout import LoopClock, Setup
from gne_mj.loops.link import link
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.loops.rosenbrock import RosenbrockLoop
from gne_mj.plants import integrator, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.plants.functions import RK4

N, RHO, START, END, ACCURACY = 10, 0.1, 0.2, 30.0, 1e-6
TIMES = np.linspace(0.0, END, 601)
CASES = ((0.1, 1e-2), (1.0, 1e-3))
GRID = 10.0 ** -np.arange(3.5, 9.1, 0.25)
METHODS = ("Radau", "BDF", "LSODA")


class Twin:
    """One case: our loop, and the same equations for SciPy without the agents' own estimates."""

    def __init__(self, kind: Any, gain: float, epsilon: float) -> None:
        self.states = len(kind.STATES)
        self.kind, self.gain, self.epsilon = kind, gain, epsilon
        self.graph = graphs.printed()
        self.law = FullyDistributed(self.graph, epsilon, gain)
        self.game = osnr_game(**ten_channels())
        numbers = np.tile([1.0, 0.5], (N, 1)) if kind is pi_cascade else np.zeros((N, 0))
        self.start = np.tile([START, 2 * START], (N, 1))[:, : self.states].copy()
        self.agents = Agents(kind, numbers, np.full(N, np.inf))
        self.problem = Problem(
            self.game.data, self.graph.data, self.law.settings(RHO), np.full(N, np.inf),
            np.zeros(N), no_propagator(),
            functions=link(self.law.kernels, self.game.kernels, memory=True, held=False),
        )  # fmt: skip
        self.memory = self.law.initial_memory(np.full(N, START))
        flat = np.concatenate([self.start.ravel(), self.memory])
        size = N * self.states
        own = size + np.arange(N) * (N + 1)
        self.kept = np.delete(np.arange(len(flat)), own)
        self.first = flat[self.kept]
        self.linear = self._linear_part(len(flat), size)
        self._compile()

    def loop(self, rtol: float) -> RosenbrockLoop:
        """Our loop, at its start."""
        clock = LoopClock(0.05, 1, CONTINUOUS, RK4)
        setup = Setup(self.problem, np.zeros((N, self.states)), clock)
        return RosenbrockLoop(
            self.agents, setup, self.graph, self.start, self.memory, rtol, 1e-3 * rtol,
            affine=self.game.constraint_class == "affine",
        )  # fmt: skip

    def ours(self, rtol: float) -> tuple[float, np.ndarray]:
        """Time in s and all samples, (601, states that SciPy has)."""
        loop = self.loop(rtol)
        began = time.perf_counter()
        rows, last = loop.advance(600, 1), loop.finish()
        spent = time.perf_counter() - began
        state = np.concatenate([rows.state, last.state]).reshape(601, -1)
        memory = np.concatenate([rows.memory, last.memory])
        return spent, np.concatenate([state, memory], axis=1)[:, self.kept]

    def scipy(
        self, method: str, rtol: float, atol: float, rate: Any, *, analytic: bool = True
    ) -> tuple[float, np.ndarray]:
        """The same of a SciPy method, with the analytic Jacobian or its own differences."""
        jacobian = {"jac": self.jacobian} if analytic and method != "DOP853" else {}
        began = time.perf_counter()
        result = solve_ivp(
            rate, (0.0, END), self.first, method, t_eval=TIMES, rtol=rtol, atol=atol, **jacobian
        )
        spent = time.perf_counter() - began
        return spent, result.y.T if result.success else np.full((601, 1), np.inf)

    def _linear_part(self, n: int, size: int) -> np.ndarray:
        """The Jacobian's constant rows and columns: estimates, z and the agents themselves."""
        matrix = np.zeros((n, n))
        eye = np.eye(n)
        for c in range(n):
            x = eye[c, :size].reshape(N, self.states)
            y = np.ascontiguousarray(x[:, 0])
            memory = eye[c, size:].copy()
            memory[np.arange(N) * (N + 1)] = y  # own actions stand in the rows that agents send
            self.law.kernels.rate(self.problem, y, memory, matrix[size:, c])
            for r in range(N):
                out = np.zeros(self.states)
                self.kind.rate(self.agents.parameters[r], x[r], 0.0, out)
                matrix[r * self.states : (r + 1) * self.states, c] = out
        return np.ascontiguousarray(matrix[np.ix_(self.kept, self.kept)])

    def _compile(self) -> None:
        numbers = Numbers(self)
        rate, jacobian, with_numpy = numbers.rate(), numbers.jacobian(), numbers.with_numpy()
        self.rate, self.jacobian, self.with_numpy = rate, jacobian, with_numpy
        nudged = self.first * (1.0 + 1e-3 * np.sin(np.arange(len(self.first))))
        if not np.allclose(rate(0.0, nudged), with_numpy(0.0, nudged), rtol=1e-10, atol=1e-10):
            raise ArithmeticError("the compiled and the NumPy rate differ")
        step = 1e-6 * np.eye(len(nudged))  # a peer with a wrong Jacobian would be slow
        slopes = [(rate(0.0, nudged + e) - rate(0.0, nudged - e)) / 2e-6 for e in step]
        if not np.allclose(jacobian(0.0, nudged), np.transpose(slopes), rtol=1e-5, atol=1e-4):
            raise ArithmeticError("the Jacobian is not the rate's")


class Numbers:
    """The numbers of a case, and SciPy's functions (time, states) of them.

    States are the agents', then the estimates, row by row without the agents' own, then z.
    """

    def __init__(self, twin: Twin) -> None:
        self.states, self.gain, self.epsilon = twin.states, twin.gain, twin.epsilon
        q = twin.game.parameters
        self.limit = q[1]
        self.a, self.b, self.c, self.n0 = (q[2 + N * k : 2 + N * (k + 1)].copy() for k in range(4))
        self.crosstalk = q[2 + 4 * N :].reshape(N, N) + np.diag(self.c)
        self.laplacian, self.linear = np.array(twin.graph.laplacian), twin.linear
        self.cascade = twin.kind is pi_cascade
        size = N * self.states
        self.at_z = size + N * (N - 1)
        self.off = np.array(
            [[size + i * (N - 1) + j - (j > i) for j in range(N)] for i in range(N)]
        )

    def rate(self) -> Any:
        """The rate, compiled."""
        states, gain, epsilon, cascade = self.states, self.gain, self.epsilon, self.cascade
        a, b, c, n0, crosstalk, limit = self.a, self.b, self.c, self.n0, self.crosstalk, self.limit
        laplacian, off, at_z = self.laplacian, self.off, self.at_z

        @njit(error_model="numpy")
        def rate(_time, v):
            out = np.empty_like(v)
            e = np.empty((N, N))
            for i in range(N):
                for j in range(N):
                    e[i, j] = v[i * states] if j == i else v[off[i, j]]
            for i in range(N):
                received, total, y, z = n0[i], -limit, v[i * states], v[at_z + i]
                for j in range(N):
                    received += crosstalk[i, j] * e[i, j]
                    total += e[i, j]
                total += z - y
                u = -gain * (a[i] - b[i] * c[i] / received - RHO / total - RHO / z)
                if not (total < 0.0 and z > 0.0):
                    u = np.nan
                if cascade:
                    out[i * states] = -y + 0.5 * v[i * states + 1] + u
                    out[i * states + 1] = u
                else:
                    out[i] = u
                out[at_z + i] = (y - z) / epsilon
                for j in range(N):
                    if j != i:
                        flow = 0.0
                        for k in range(N):
                            flow += laplacian[i, k] * e[k, j]
                        out[off[i, j]] = -flow / epsilon
            return out

        return rate

    def jacobian(self) -> Any:
        """Its derivatives by the states, compiled."""
        states, gain, linear, off, at_z = self.states, self.gain, self.linear, self.off, self.at_z
        b, c, n0, crosstalk, limit = self.b, self.c, self.n0, self.crosstalk, self.limit

        @njit(error_model="numpy")
        def jacobian(_time, v):
            out = linear.copy()
            for i in range(N):
                y, z = v[i * states], v[at_z + i]
                received, total = n0[i] + c[i] * y, z - limit
                for j in range(N):
                    if j != i:
                        received += crosstalk[i, j] * v[off[i, j]]
                        total += v[off[i, j]]
                factor = b[i] * c[i] / received**2
                bound = RHO / total**2
                for s in range(states):
                    row = i * states + s
                    for j in range(N):
                        if j == i:
                            out[row, i * states] -= gain * factor * c[i]
                        else:
                            out[row, off[i, j]] -= gain * (factor * crosstalk[i, j] + bound)
                    out[row, at_z + i] -= gain * (bound + RHO / z**2)
            return out

        return jacobian

    def with_numpy(self) -> Any:
        """The rate as a script would have it."""
        states, gain, epsilon, cascade = self.states, self.gain, self.epsilon, self.cascade
        a, b, c, n0, crosstalk, limit = self.a, self.b, self.c, self.n0, self.crosstalk, self.limit
        laplacian, others, size, at_z = (
            self.laplacian,
            ~np.eye(N, dtype=bool),
            N * states,
            self.at_z,
        )

        def with_numpy(_time, v):
            x, z = v[:size].reshape(N, states), v[at_z:]
            y, e = x[:, 0], np.empty((N, N))
            e[others] = v[size:at_z]
            np.fill_diagonal(e, y)
            total = e.sum(axis=1) - y + z - limit
            slope = a - b * c / (n0 + (crosstalk * e).sum(axis=1))
            u = -gain * (slope - RHO / total - RHO / z)
            out = np.empty_like(v)
            agents = out[:size].reshape(N, states)
            agents[:, 0] = u
            if cascade:
                agents[:, 0] += -y + 0.5 * x[:, 1]
                agents[:, 1] = u
            out[size:at_z] = (laplacian @ e)[others] / -epsilon
            out[at_z:] = (y - z) / epsilon
            return out

        return with_numpy


def loosest(
    run: Callable[[float], tuple[float, np.ndarray]], reference: np.ndarray
) -> tuple[float, float, float] | None:
    """(time in s, relative tolerance, error) of the first in the grid that is accurate enough."""
    for rtol in GRID:
        run(rtol)
        spent, got = run(rtol)
        error = float(np.max(np.abs(got - reference)))
        if error <= ACCURACY:
            return spent, float(rtol), error
    return None


def measure(twin: Twin, name: str, runs: int) -> list[dict[str, str]]:
    """The rows of one case."""
    reference = twin.scipy("DOP853", 1e-12, 1e-13, twin.rate)[1]
    twin.ours(1e-4)
    ours = loosest(twin.ours, reference)
    tuned = []
    for method in METHODS:
        for ratio in (1e-3, 1.0):
            found = loosest(
                lambda rtol, method=method, ratio=ratio: twin.scipy(
                    method, rtol, ratio * rtol, twin.rate
                ),
                reference,
            )
            if found is not None:
                tuned.append((found[0], method, found[1], ratio * found[1]))
    if ours is None or not tuned:
        raise ArithmeticError(f"{name}: no tolerance of the grid reaches {ACCURACY:g}")
    _, method, rtol, atol = min(tuned)
    spent: dict[str, list[float]] = {"ours": [], "numba": [], "numpy": [], "alone": []}
    for run in range(runs):  # in turns, so that all see the same machine
        spent["ours"].append(twin.ours(ours[1])[0])
        spent["numba"].append(twin.scipy(method, rtol, atol, twin.rate)[0])
        if run < 5:  # the slow one
            spent["numpy"].append(twin.scipy(method, rtol, atol, twin.with_numpy)[0])
            alone = twin.scipy(method, rtol, atol, twin.with_numpy, analytic=False)
            spent["alone"].append(alone[0])
    median = {key: 1e3 * statistics.median(values) for key, values in spent.items()}
    return [
        {
            "what": f"{name}, T = 30 s, error 1e-6: ms; SciPy {method}, {law} / ours",
            "ours": f"{median['ours']:.2f}",
            "other": f"{median[key]:.2f}",
            "ratio": f"{median[key] / median['ours']:.1f}",
            "target": target,
            "better": "higher",
        }
        for key, law, target in (
            ("numba", "law and Jacobian by numba", ">= 10"),
            ("numpy", "law by NumPy, Jacobian by numba", ""),
            ("alone", "law by NumPy", ">= 40"),
        )
    ]


def rows(runs: int = 20) -> list[dict[str, str]]:
    """The OSNR twin's lines: medians of ``runs`` runs in ms (of 5 for the NumPy law)."""
    return [
        row
        for kind in (pi_cascade, integrator)
        for gain, epsilon in CASES
        for row in measure(
            Twin(kind, gain, epsilon),
            f"OSNR twin, {kind.NAME}, k = {gain:g}, epsilon = {epsilon:g}",
            runs,
        )
    ]


if __name__ == "__main__":
    for line in rows():
        print(*line.values(), sep="  ")
