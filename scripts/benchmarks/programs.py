#!/usr/bin/env python
"""Quadratic programs of the sizes that rivals solve, by DAQP: from Python, and in a native loop.

Random projections on p half-spaces, each of a pair of neighbours among m actions, as gaps are.
Other libraries, if they are installed (quadprog, piqp, proxsuite, clarabel, osqp), are measured
beside it, called from Python at tight tolerances. Errors are against the active set's equations.
"""

import time
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix

from gne_mj import quadratic_program as programs
from gne_mj.native import compiled
from gne_mj.records import by_name, dtype_of

SIZES, COUNT, REPEATS = ((5, 5), (5, 10), (10, 11), (20, 40)), 60, 200
Array = np.ndarray


def problem(rng: np.random.Generator, m: int, p: int) -> tuple[Array, Array, Array]:
    """A point (m,), and A (p, m) and b (p,) of A x <= b."""
    rows = np.zeros((p, m))
    for k in range(p):
        rows[k, k % m], rows[k, (k + 1) % m] = 1.0, -rng.uniform(0.5, 1.5)
    return 3.0 * rng.normal(size=m), rows, rng.uniform(0.0, 0.5, p)


def exact(goal: Array, A: Array, b: Array, active: Array) -> Array:
    """The solution with these constraints active."""
    rows = A[active]
    return goal - rows.T @ np.linalg.solve(rows @ rows.T, rows @ goal - b[active])


def by_daqp(goal: Array, A: Array, b: Array) -> Array:
    """DAQP's solution."""
    import daqp

    return daqp.solve(np.eye(len(goal)), -goal, A, b, primal_tol=1e-12)[0]


def by_quadprog(goal: Array, A: Array, b: Array) -> Array:
    """quadprog's solution."""
    import quadprog

    return quadprog.solve_qp(np.eye(len(goal)), goal, -A.T, -b)[0]


def by_piqp(goal: Array, A: Array, b: Array) -> Array:
    """PIQP's solution."""
    import piqp

    solver = piqp.DenseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = 1e-11, 0.0
    solver.setup(np.eye(len(goal)), -goal, None, None, A, None, b)
    solver.solve()
    return solver.result.x


def by_proxqp(goal: Array, A: Array, b: Array) -> Array:
    """ProxQP's solution."""
    import proxsuite

    low = np.full(len(b), -1e30)
    return proxsuite.proxqp.dense.solve(
        np.eye(len(goal)), -goal, None, None, A, low, b, eps_abs=1e-11, eps_rel=0.0
    ).x


def by_clarabel(goal: Array, A: Array, b: Array) -> Array:
    """Clarabel's solution."""
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    one, rows = csc_matrix(np.eye(len(goal))), csc_matrix(A)
    cones = [clarabel.NonnegativeConeT(len(b))]
    return np.array(clarabel.DefaultSolver(one, -goal, rows, b, cones, settings).solve().x)


def by_osqp(goal: Array, A: Array, b: Array) -> Array:
    """OSQP's solution."""
    import osqp

    solver = osqp.OSQP()
    low = np.full(len(b), -np.inf)
    solver.setup(
        csc_matrix(np.eye(len(goal))), -goal, csc_matrix(A), low, b, verbose=False,
        eps_abs=1e-9, eps_rel=0.0, polishing=True, max_iter=20000,
    )  # fmt: skip
    return solver.solve().x


LIBRARIES: Mapping[str, tuple[str, Callable[..., Array]]] = {
    "DAQP": ("daqp", by_daqp),
    "quadprog": ("quadprog", by_quadprog),
    "PIQP": ("piqp", by_piqp),
    "ProxQP": ("proxsuite", by_proxqp),
    "Clarabel": ("clarabel", by_clarabel),
    "OSQP": ("osqp", by_osqp),
}


@compiled
def _many(solver: Any, flat: Any, m: Any, p: Any, repeats: Any) -> Any:
    program = programs.program_in(flat, 0, m, p, 0, 0)
    ended = 0
    for _ in range(repeats):
        ended = programs.solve(solver, program, programs.QUADRATIC)
    return ended


def native(goal: Array, A: Array, b: Array, repeats: int) -> tuple[float, Array, Array]:
    """Seconds of one program in a native loop, its solution, and which constraints are active."""
    p, m = A.shape
    flat = np.zeros(programs.program_length(m, p, 0, 0))
    program = by_name(flat, dtype_of(programs.Program, n=m, rows=p, bounds=0, full=0))
    program.matrix[:], program.upper[:], program.lower[:] = A, b - A @ goal, -programs.UNBOUNDED
    began = time.perf_counter()
    ended = _many(programs.solver(), flat, m, p, repeats)
    spent = (time.perf_counter() - began) / repeats
    assert ended == programs.SOLVED
    return spent, goal + program.x, program.multipliers > 1e-12


def row(
    size: tuple[int, int], name: str, seconds: float, found: list[Array], right: list[Array]
) -> None:
    """Tell what a library took and how far it was from what is right."""
    error = max(np.max(np.abs(x - y)) for x, y in zip(found, right, strict=True))
    print(f"m, p = {size}  {name:20} {1e6 * seconds:7.1f} us  error {error:.0e}")


def main() -> None:
    """All sizes, one after the other."""
    rng = np.random.default_rng(3)
    for size in SIZES:
        given = [problem(rng, *size) for _ in range(COUNT)]
        native(*given[0], 1)
        found = [native(*each, REPEATS) for each in given]
        right = [exact(*each, active) for each, (_, _, active) in zip(given, found, strict=True)]
        spent = float(np.mean([seconds for seconds, *_ in found]))
        row(size, "DAQP in a loop", spent, [x for _, x, _ in found], right)
        for name, (package, solve) in LIBRARIES.items():
            if find_spec(package) is None:
                continue
            solve(*given[0])
            began = time.perf_counter()
            xs = [solve(*each) for each in given]
            row(size, f"{name} from Python", (time.perf_counter() - began) / COUNT, xs, right)


if __name__ == "__main__":
    main()
