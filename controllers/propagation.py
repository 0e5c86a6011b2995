"""Exact motion of the estimates over a control period in which all outputs are held.

All agents' estimates of one entry of agent j's action differ from it by errors e (N,), e_j = 0,
that obey d/dt e = -rate L_j e, with L_j the Laplacian without row and column j. So over a period
e becomes exp(-L_j s) e with s = rate * period. For few agents these matrices are formed; for many
the exponential acts through its Chebyshev series, which only needs products with the sparse
Laplacian: work and memory grow with edges times agents.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj.errors import InvalidInput
from gne_mj.graph import GraphData, laplacian_of
from gne_mj.native import kernel

# Columns of estimates that move together: rows long enough for vector instructions, and blocks
# small enough for the cache.
BLOCK = 64
# The series ends where what is left out is below this, relative to the errors' size.
_LEFT_OUT = 1e-15
LONGEST = 1e8  # half the bound times s: some 90,000 terms


class Propagator(NamedTuple):
    """exp(-L_j s) for all agents j, read-only: dense maps or a series, the other one empty."""

    # (N, N, N), symmetric, row and column j of the j-th are zero
    maps: Annotated[np.ndarray, "n // (agents * agents), agents, agents"]
    # of the Chebyshev polynomials in 2 L_j / bound - 1
    coefficients: Annotated[np.ndarray, "n"]
    numbers: Annotated[np.ndarray, "3"]  # [bound on the spectrum of L_j, s, exp(-s)]
    # Where only some keep estimates of j: the map among these, one behind the other, and where
    # each begins; -1 if a series stands for it (gne_mj.controllers.kept_propagation)
    blocks: Annotated[np.ndarray, "n"] = np.zeros(0)
    starts: Annotated[np.ndarray, "n", int] = np.zeros(0, dtype=np.int64)


@kernel
def scratch_length(agents):
    """Entries that :func:`propagate_estimates` needs."""
    return 4 * agents * BLOCK


def no_propagator() -> Propagator:
    """Of a law without estimates."""
    return Propagator(np.zeros((0, 0, 0)), np.zeros(0), np.zeros(3))


def propagator(lists: GraphData, duration: float) -> Propagator:
    """The exact maps over s = ``duration`` (rate times period), in the cheaper form.

    Args:
        lists: who hears whom, undirected.
        duration: in time constants of the estimates.
    """
    degrees = np.diff(lists.pointer)
    agents = len(degrees)
    # Anderson and Morley's bound; L_j is a principal submatrix, so it holds for all j.
    both = np.repeat(degrees, degrees) + degrees[lists.neighbour]
    bound = float(np.max(both, initial=1))
    numbers = np.array([bound, duration, np.exp(-duration)])
    half = 0.5 * bound * duration
    few = agents <= 64  # so that their maps stay small
    if few and half > 100.0:
        return Propagator(_dense(lists, duration), np.zeros(0), numbers)
    check_duration(agents, bound, duration)
    coefficients = series_of(half)
    if few and agents * agents <= len(coefficients) * (agents + len(lists.neighbour)):
        return Propagator(_dense(lists, duration), np.zeros(0), numbers)
    return Propagator(np.zeros((0, 0, 0)), coefficients, numbers)


def check_duration(agents: int, bound: float, duration: float) -> None:
    """Refuse a period for which the series would have too many terms."""
    if 0.5 * bound * duration > LONGEST:
        raise InvalidInput(
            "duration",
            f"{duration:.3g} time constants of the estimates",
            f"{agents} agents on this graph allow at most {2.0 * LONGEST / bound:.3g}",
        )


def series_of(half: float) -> np.ndarray:
    """Coefficients of exp(-half (1 + x)) in T_0(x), T_1(x), ... on [-1, 1]."""
    from scipy.special import ive  # slow to load, and for laws with estimates only

    terms = np.arange(30 + int(12 * half**0.5))  # they fall like exp(-k^2 / (2 half))
    size = 2.0 * ive(terms, half)
    size[0] *= 0.5
    left_out = np.cumsum(size[::-1])[::-1]
    keep = max(1, int(np.count_nonzero(left_out > _LEFT_OUT)))
    return (size * (-1.0) ** terms)[:keep]


def _dense(lists: GraphData, duration: float) -> np.ndarray:
    laplacian = laplacian_of(lists)
    agents = len(laplacian)
    maps = np.zeros((agents, agents, agents))
    for j in range(agents):
        others = np.delete(np.arange(agents), j)
        values, vectors = np.linalg.eigh(laplacian[np.ix_(others, others)])
        decay = (vectors * np.exp(-values * duration)) @ vectors.T
        maps[j][np.ix_(others, others)] = decay
    return maps


@kernel
def propagate_estimates(data, graph, propagator, y, memory, scratch):
    """Replace the estimates by their exact solution over the period, the outputs held at y.

    scratch has :func:`scratch_length` entries.
    """
    if len(propagator.coefficients) == 0:
        _apply_maps(data, propagator.maps, y, memory, scratch)
    else:
        _apply_series(data, graph, propagator, y, memory, scratch)


@kernel
def _apply_maps(data, maps, y, memory, scratch):
    at = data.offsets
    agents = len(at) - 1
    m = at[agents]
    result = scratch[:agents]
    for j in range(agents):
        for r in range(at[j], at[j + 1]):
            for i in range(agents):
                result[i] = y[r]
            for other in range(agents):
                if other != j:
                    # the maps are symmetric
                    _add_multiple(maps[j, other], memory[other * m + r] - y[r], result)
            for i in range(agents):
                memory[i * m + r] = result[i]


@kernel
def _add_multiple(column, scale, result):
    for i in range(len(result)):
        result[i] += column[i] * scale


@kernel
def _apply_series(data, graph, propagator, y, memory, scratch):
    """The series, summed by the polynomials' recurrence, a block of columns at a time."""
    at = data.offsets
    agents = len(at) - 1
    m = at[agents]
    coefficients, bound = propagator.coefficients, propagator.numbers[0]
    for start in range(0, m, BLOCK):
        w = min(BLOCK, m - start)
        size = agents * w
        before, now = scratch[:size], scratch[size : 2 * size]
        after, total = scratch[2 * size : 3 * size], scratch[3 * size : 4 * size]
        held = y[start : start + w]
        for i in range(agents):
            row, error = memory[i * m + start : i * m + start + w], now[i * w : (i + 1) * w]
            for c in range(w):
                error[c] = row[c] - held[c]
        _clear_own(data, start, w, now)
        for r in range(size):
            total[r] = coefficients[0] * now[r]
            before[r] = 0.0
        for term in range(1, len(coefficients)):
            # T_1 = x T_0, and T_k+1 = 2 x T_k - T_k-1, with x = 2 L_j / bound - 1
            scale = (2.0 if term == 1 else 4.0) / bound
            for i in range(agents):
                _term_of(graph, i, scale, bound, before, now, after)
            _clear_own(data, start, w, after)
            for r in range(size):
                total[r] += coefficients[term] * after[r]
            spare = before
            before = now
            now = after
            after = spare
        for i in range(agents):
            row, error = memory[i * m + start : i * m + start + w], total[i * w : (i + 1) * w]
            for c in range(w):
                row[c] = held[c] + error[c]


@kernel
def _term_of(graph, i, scale, bound, before, now, after):
    """Fill agent i's part of the next term, from the last two; of the first, ``before`` is zero."""
    w = len(now) // (len(graph.pointer) - 1)
    first, last = graph.pointer[i], graph.pointer[i + 1]
    diagonal = scale * (last - first) - 0.5 * scale * bound
    new, old = after[i * w : (i + 1) * w], before[i * w : (i + 1) * w]
    own = now[i * w : (i + 1) * w]
    for c in range(w):
        new[c] = diagonal * own[c] - old[c]
    for entry in range(first, last):
        j = graph.neighbour[entry]
        other = now[j * w : (j + 1) * w]
        for c in range(w):
            new[c] -= scale * other[c]


@kernel
def _clear_own(data, start, w, block):
    """Zero the entries that are no estimates: an agent's of its own action."""
    for c in range(w):
        block[data.owner[start + c] * w + c] = 0.0
