"""Exact motion of the estimates that are kept, over a control period with all outputs held.

Those that keep action j, but agent j itself, have errors e that obey d/dt e = -rate L_j e, L_j
being the Laplacian of the graph of all its keepers without j's row and column
(:mod:`gne_mj.controllers.propagation` has the same with everyone as a keeper). Few keepers have
their matrix exponential, many the Chebyshev series, whichever is less work.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gne_mj.controllers.propagation import LONGEST, Propagator, check_duration, series_of
from gne_mj.graph import Graph
from gne_mj.native import kernel

if TYPE_CHECKING:
    from gne_mj.controllers.kept import KeptData

_FEW = 64  # keepers whose matrix is formed where a series would be long
_LONG = 100.0  # half the bound times s


def kept_propagator(data: "KeptData", among: Callable[[int], Graph], duration: float) -> Propagator:
    """The exact maps over s = ``duration`` (rate times period), each in the cheaper form.

    Args:
        data: who keeps what.
        among: the graph of an agent's keepers, itself first.
        duration: s.

    Raises:
        InvalidInput: names ``duration``; a series would have too many terms.
    """
    degrees = np.diff(data.near_pointer)
    hearer, heard = np.repeat(degrees, degrees), degrees[np.searchsorted(data.place, data.near)]
    bound = float(np.max(hearer + heard, initial=1))
    half = 0.5 * bound * duration
    coefficients = series_of(half) if half <= LONGEST else np.zeros(0)
    starts: list[int] = []
    known: dict[tuple[tuple[int, int], ...], np.ndarray] = {}
    blocks, at = [np.zeros(0)], 0
    for j in range(len(data.pointer) - 1):
        first, last = data.pointer[j], data.pointer[j + 1]
        others, work = last - first - 1, data.near_pointer[last] - data.near_pointer[first]
        short = others * others <= len(coefficients) * (others + work)
        if not short and (half <= _LONG or others > _FEW):
            check_duration(len(starts), bound, duration)
            starts.append(-1)
            continue
        graph = among(j)
        if graph.edges not in known:
            known[graph.edges] = _exponential(graph, duration)
        starts.append(at)
        blocks.append(known[graph.edges])
        at += others * others
    if -1 not in starts:
        coefficients = np.zeros(0)
    numbers = np.array([bound, duration, np.exp(-duration)])
    return Propagator(
        np.zeros((0, 0, 0)), coefficients, numbers, np.concatenate(blocks),
        np.array(starts, dtype=np.int64),
    )  # fmt: skip


def _exponential(graph: Graph, duration: float) -> np.ndarray:
    """exp(-L s) flat, L being the graph's Laplacian without its first row and column."""
    values, vectors = np.linalg.eigh(graph.laplacian[1:, 1:])
    found: np.ndarray = ((vectors * np.exp(-values * duration)) @ vectors.T).ravel()
    return found


@kernel
def propagate_kept(kept, propagator, memory, scratch):
    """Replace the estimates by their exact solution over the period; own actions are in place."""
    for j in range(len(kept.pointer) - 1):
        first = kept.pointer[j]
        others, start = kept.pointer[j + 1] - first - 1, propagator.starts[j]
        width = kept.place[first + 1] - kept.place[first]
        for own in range(kept.place[first], kept.place[first + 1]):
            if others == 1 and start >= 0:  # as of neighbours on a line
                error = memory[own + width] - memory[own]
                memory[own + width] = memory[own] + propagator.blocks[start] * error
            elif others > 0:
                _move_all(kept, propagator, j, own, memory, scratch)


@kernel
def _move_all(kept, propagator, j, own, memory, scratch):
    """The same of all estimates of one entry of agent j's action, which is at ``own``."""
    first, start = kept.pointer[j], propagator.starts[j]
    n, width = kept.pointer[j + 1] - first - 1, kept.place[first + 1] - kept.place[first]
    errors, moved = scratch[:n], scratch[3 * n : 4 * n]
    for e in range(n):
        errors[e] = memory[own + (e + 1) * width] - memory[own]
    if start < 0:
        _apply_series(kept, propagator, first, scratch, moved)
    else:
        for e in range(n):
            moved[e] = 0.0
            for other in range(n):
                moved[e] += propagator.blocks[start + e * n + other] * errors[other]
    for e in range(n):
        memory[own + (e + 1) * width] = memory[own] + moved[e]


@kernel
def _apply_series(kept, propagator, first, scratch, total):
    """The series of agent j's keepers, by the polynomials' recurrence; ``first`` is its own pair.

    Errors are the first entries of scratch, which is overwritten.
    """
    n, coefficients, bound = len(total), propagator.coefficients, propagator.numbers[0]
    own, width = kept.place[first], kept.place[first + 1] - kept.place[first]
    now, before, after = scratch[:n], scratch[n : 2 * n], scratch[2 * n : 3 * n]
    for e in range(n):
        total[e] = coefficients[0] * now[e]
        before[e] = 0.0
    for term in range(1, len(coefficients)):
        # T_1 = x T_0, and T_k+1 = 2 x T_k - T_k-1, with x = 2 L_j / bound - 1
        scale = (2.0 if term == 1 else 4.0) / bound
        for e in range(n):
            pair = first + 1 + e
            begin, end = kept.near_pointer[pair], kept.near_pointer[pair + 1]
            value = (scale * (end - begin) - 0.5 * scale * bound) * now[e] - before[e]
            for q in range(begin, end):
                other = (kept.near[q] - own) // width - 1
                if other >= 0:
                    value -= scale * now[other]
            after[e] = value
        for e in range(n):
            total[e] += coefficients[term] * after[e]
        spare = before
        before = now
        now = after
        after = spare
