import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import reference
from gne_mj import graph as graphs
from gne_mj.errors import InvalidInput


def test_algebraic_connectivity_of_the_papers_graphs():
    assert graphs.printed().algebraic_connectivity == pytest.approx(2.38907, abs=5e-6)
    assert graphs.caption().algebraic_connectivity == pytest.approx(2.61583, abs=5e-6)
    assert len(graphs.printed().edges) == 23
    assert set(graphs.caption().edges) - set(graphs.printed().edges) == {(3, 5), (3, 7)}


@pytest.mark.parametrize("name", ["line", "ring", "complete"])
@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_named_graphs_equal_the_reference(name, count):
    graph = graphs.NAMED[name](count)
    expected = reference.laplacian(count, getattr(reference, name)(count))
    assert np.array_equal(graph.laplacian, expected)


@given(st.integers(2, 12), st.randoms(use_true_random=False))
def test_random_trees_with_extra_edges(count, random):
    edges = [(i, random.randrange(i)) for i in range(1, count)]
    edges += [tuple(random.sample(range(count), 2)) for _ in range(random.randrange(5))]
    graph = graphs.Graph(count, tuple(edges))
    assert np.all(graph.laplacian.sum(axis=1) == 0)
    assert graph.algebraic_connectivity > 0
    for i in range(count):
        heard = graph.data.neighbour[graph.data.pointer[i] : graph.data.pointer[i + 1]]
        assert set(heard) == set(np.flatnonzero(graph.laplacian[i] < 0))


def test_refusals():
    with pytest.raises(InvalidInput, match="agent 1 cannot reach agent 3, 4"):
        graphs.Graph(4, ((0, 1), (2, 3)))
    with pytest.raises(InvalidInput, match="joins two agents"):
        graphs.Graph(2, ((0, 0), (0, 1)))
    with pytest.raises(InvalidInput, match="numbered 1 to 2"):
        graphs.Graph(2, ((0, 2),))
    with pytest.raises(InvalidInput, match="10 agents, not 5"):
        graphs.printed(5)
