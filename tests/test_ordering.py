import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee as scipys

from gne_mj.ordering import reverse_cuthill_mckee


def half_band(matrix, sequence):
    place = np.argsort(sequence)
    row, column = matrix.nonzero()
    return int(np.max(np.abs(place[row] - place[column]), initial=0))


@given(st.integers(1, 40), st.integers(0, 60), st.integers(0, 2**32 - 1))
def test_as_narrow_as_scipys(count, edges, seed):
    first, second = np.random.default_rng(seed).integers(0, count, (2, edges))
    ends = (
        np.concatenate([first, second, range(count)]),
        np.concatenate([second, first, range(count)]),
    )
    matrix = csr_array((np.ones(len(ends[0])), ends), shape=(count, count))
    matrix.sort_indices()
    order = reverse_cuthill_mckee(matrix.indptr, matrix.indices)
    assert sorted(order.tolist()) == list(range(count))
    # Which of equally short rows comes first is left open, and may cost a few diagonals.
    other = scipys(matrix, symmetric_mode=True)
    assert half_band(matrix, order) <= 2 * half_band(matrix, other) + 2


@pytest.mark.parametrize("ring", [False, True], ids=["line", "ring"])
def test_a_shuffled_line_or_ring_is_a_narrow_band(ring):
    count = 2000
    names = np.random.default_rng(0).permutation(count)
    first, second = names[:-1], names[1:]
    if ring:
        first, second = names, np.roll(names, -1)
    ends = np.concatenate([first, second]), np.concatenate([second, first])
    matrix = csr_array((np.ones(len(ends[0])), ends), shape=(count, count))
    order = reverse_cuthill_mckee(matrix.indptr, matrix.indices)
    assert half_band(matrix, order) == 1 + ring
