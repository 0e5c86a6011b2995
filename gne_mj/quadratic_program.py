"""Quadratic programs inside native loops, by DAQP, whose C function is called at its address.

    minimise x'Hx/2 + f'x  subject to  lower <= (x_1, ..., x_bounds, A x) <= upper

DAQP is a dual active-set method (Arnstrom, Bemporad and Axehill, IEEE Transactions on Automatic
Control 67(8), 2022, doi 10.1109/TAC.2022.3176430), so that a solution is exact up to rounding. It
also solves the affine variational inequality of an H that is not symmetric: with C the set of these
constraints, (H x + f)'(z - x) >= 0 for all z in C.

It comes with the extra ``arena``. What its C function is given lies as in ``include/types.h`` and
``include/api.h`` of the version that is pinned; another layout is noticed when it is loaded.
"""

import ctypes
from functools import cache
from importlib.util import find_spec
from typing import Annotated, Any, NamedTuple

import numpy as np

from gne_mj.errors import EngineError
from gne_mj.extras import need
from gne_mj.native import address_in, call_integer, compiled, kernel, source_key
from gne_mj.parameter_block import exact, integers_at
from gne_mj.records import by_name, dtype_of, in_array

# Words of the structs DAQPProblem, DAQPResult and DAQPSettings, one behind the other
_RESULT, _SETTINGS = 10, 18
_DEFAULTS = (
    # tolerances: primal (the default is 1e-6), dual, zero, pivot, progress
    1e-12, 1e-12, 1e-11, 1e-8, 1e-14,
    # _ITERATIONS below; the greatest value; eps_prox, eta_prox; rho_soft
    0.0, 1e30, -1e-6, -1.0, 1e-6,
    # of branches, relative and absolute; singular, refactor; limit of time; soft, linear; two
    # whole numbers of what is not used here
    0.0, 0.0, 3.7e-11, 1e-9, 0.0, 0.0, 0.0,
)  # fmt: skip
_ITERATIONS = 10 + (10000 << 32)  # most cycles and iterations, two 32-bit whole numbers in a word

UNBOUNDED = 1e30  # a bound that is none
SOFT = 8  # what a constraint's entry of ``kinds`` says if it may be violated
# A violation s of a soft constraint costs WEIGHT s^2 / 2, its row of A taken to have length one
WEIGHT = 1e6
SOLVED, RELAXED = 1, 2  # how solving ended; anything else is no solution
QUADRATIC, VARIATIONAL = 0, 1  # what is solved


class Program(NamedTuple):
    """A quadratic program of n unknowns; ``full`` is 1, or 0 where H is the identity and f zero."""

    hessian: Annotated[np.ndarray, "full * n, n"]
    linear: Annotated[np.ndarray, "full * n"]
    matrix: Annotated[np.ndarray, "rows, n"]  # A
    lower: Annotated[np.ndarray, "bounds + rows"]
    upper: Annotated[np.ndarray, "bounds + rows"]
    x: Annotated[np.ndarray, "n"]  # the solution
    multipliers: Annotated[np.ndarray, "bounds + rows"]  # negative at lower bounds
    kinds: Annotated[np.ndarray, "bounds + rows"]  # 32-bit whole numbers, the room of twice as many
    words: Annotated[np.ndarray, "35"]  # what DAQP is told, and tells


program_length, program_in = in_array(Program, "n rows bounds full")


@kernel
def clear(program):
    """Begin with A = 0, H = 0, f = 0 and no bounds."""
    for r in range(len(program.matrix)):
        program.matrix[r, :] = 0.0
    for r in range(len(program.hessian)):
        program.hessian[r, :] = 0.0
        program.linear[r] = 0.0
    for k in range(len(program.upper)):
        program.lower[k], program.upper[k] = -UNBOUNDED, UNBOUNDED


@kernel
def solve(solver, program, problem):
    """Fill program.x and program.multipliers; how that ended.

    Where no x meets all constraints those of A are soft, and the way to end is RELAXED.

    Args:
        solver: DAQP's address.
        program: what to solve, which stays as it is.
        problem: QUADRATIC or VARIATIONAL.
    """
    ended = _called(solver, program, problem, 0)
    if ended < SOLVED and problem == QUADRATIC:
        ended = _called(solver, program, problem, SOFT)
    return ended


@kernel
def _called(solver, program, problem, kind):
    n, total, words = len(program.x), len(program.upper), program.words
    bounds = total - len(program.matrix)
    kinds = integers_at(address_in(program.kinds), total)
    for k in range(total):
        kinds[k] = 0
    for k in range(bounds, total):
        half = k // 2
        kinds[half] += kind << (32 * (k % 2))
    whole = integers_at(address_in(words), len(words))
    full = len(program.linear) > 0
    whole[0] = n + (total << 32)
    whole[1] = bounds
    whole[2] = address_in(program.hessian) if full else 0
    whole[3] = address_in(program.linear) if full else 0
    whole[4] = address_in(program.matrix)
    whole[5] = address_in(program.upper)
    whole[6] = address_in(program.lower)
    whole[7] = address_in(program.kinds)
    whole[8] = 0
    whole[9] = problem << 32
    whole[_RESULT] = address_in(program.x)
    whole[_RESULT + 1] = address_in(program.multipliers)
    for k in range(len(_DEFAULTS)):
        words[_SETTINGS + k] = _DEFAULTS[k]
    whole[_SETTINGS + 5] = _ITERATIONS
    at = address_in(words)
    call_integer(solver, (at + 8 * _RESULT, at, at + 8 * _SETTINGS))
    low = whole[_RESULT + 4] & 0xFFFFFFFF
    return low if low < 0x80000000 else low - 0x100000000


@cache
def solver() -> int:
    """DAQP's address, which a double holds exactly.

    Raises:
        MissingExtra: it is not installed.
        EngineError: it is not laid out as the version that is pinned.
    """
    need("arena", "a law that solves quadratic programs")
    found = find_spec("daqp")
    assert found is not None
    try:
        library = ctypes.CDLL(str(found.origin))
        address = ctypes.cast(library.daqp_quadprog, ctypes.c_void_p).value
        settings = np.zeros(len(_DEFAULTS))
        library.daqp_default_settings(ctypes.c_void_p(settings.ctypes.data))
    except (OSError, AttributeError) as error:
        raise EngineError(f"the package daqp has no C function to call: {error}") from None
    known = all(settings[k] == _DEFAULTS[k] for k in (1, 6, 9, 13))
    if not known or not _solves(int(address or 0)):
        raise EngineError("the package daqp is not laid out as the version that gne-mj is made for")
    return exact(int(address or 0))


def _solves(address: int) -> bool:
    """Whether it finds the known solutions of two small problems."""
    flat, solving = np.zeros(program_length(2, 1, 2, 1)), _solving()
    program = by_name(flat, dtype_of(Program, n=2, rows=1, bounds=2, full=1))
    program.linear[:], program.matrix[:], program.lower[:] = -1.0, 1.0, -UNBOUNDED
    found = []
    for problem, skew, upper in ((VARIATIONAL, 0.5, UNBOUNDED), (QUADRATIC, 0.0, 0.125)):
        program.hessian[:] = [[1.0, skew], [-skew, 1.0]]
        program.upper[:] = [upper, UNBOUNDED, 0.5]
        ended = solving(address, flat, problem)
        found.append(ended == SOLVED and np.allclose(program.x, [0.125, 0.375], atol=1e-9))
    return all(found)


@cache
def _solving() -> Any:
    source = source_key()

    def solving(address, flat, problem):
        _ = source
        return solve(address, program_in(flat, 0, 2, 1, 2, 1), problem)

    return compiled(solving)
