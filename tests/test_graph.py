import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

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


@given(st.integers(1, 40), st.integers(0, 60), st.integers(0, 2**32 - 1))
def test_parts_are_the_connected_components(count, edges, seed):
    first, second = np.random.default_rng(seed).integers(0, count, (2, edges))
    matrix = csr_array((np.ones(edges), (first, second)), shape=(count, count))
    _, label = connected_components(matrix, directed=False)
    part = graphs.parts(first, second, count)
    assert np.array_equal(part, [np.flatnonzero(label == own)[0] for own in label])


def test_refusals():
    with pytest.raises(InvalidInput, match="agent 1 cannot reach agents 3, 4"):
        graphs.Graph(4, ((0, 1), (2, 3)))
    with pytest.raises(InvalidInput, match="joins two agents"):
        graphs.Graph(2, ((0, 0), (0, 1)))
    with pytest.raises(InvalidInput, match="numbered 1 to 2"):
        graphs.Graph(2, ((0, 2),))
    with pytest.raises(InvalidInput, match="agents: got 5, but the graph 'printed' has 10 agents"):
        graphs.printed(5)


@pytest.mark.parametrize("count", [2, 3, 10, 200])
def test_extreme_eigenvalues_in_closed_form(count):
    ring, line, complete = (getattr(graphs, name)(count) for name in ("ring", "line", "complete"))
    turns = 2 - 2 * np.cos(2 * np.pi * np.arange(count) / count)
    if count > 2:
        assert ring.algebraic_connectivity == pytest.approx(turns[1], rel=1e-9)
        assert ring.largest_eigenvalue == pytest.approx(np.max(turns), rel=1e-12)
    half_turns = 2 - 2 * np.cos(np.pi * np.arange(count) / count)
    assert line.algebraic_connectivity == pytest.approx(half_turns[1], rel=1e-9)
    assert line.largest_eigenvalue == pytest.approx(half_turns[-1], rel=1e-12)
    assert complete.algebraic_connectivity == pytest.approx(count, rel=1e-12)
    assert complete.largest_eigenvalue == pytest.approx(count, rel=1e-12)


def test_a_single_agent_has_no_eigenvalue_to_speak_of():
    graph = graphs.line(1)
    assert graph.algebraic_connectivity == graph.largest_eigenvalue == 0.0
    assert graph.data.pointer.tolist() == [0, 0]


def test_eigenvalues_of_a_thousand_agents_on_a_ring():
    graph = graphs.ring(1000)
    assert graph.algebraic_connectivity == pytest.approx(2 - 2 * np.cos(2 * np.pi / 1000), rel=1e-9)
    assert graph.largest_eigenvalue == pytest.approx(4.0, rel=1e-4)


@given(st.integers(3, 60), st.integers(0, 2**32 - 1))
def test_sparse_and_dense_eigenvalues_agree(count, seed):
    rng = np.random.default_rng(seed)
    edges = [(i, int(rng.integers(i))) for i in range(1, count)]
    edges += [tuple(rng.choice(count, 2, replace=False).tolist()) for _ in range(count // 2)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(graphs, "_DENSE", 1)
        sparse = graphs.Graph(count, tuple(edges))
        found = sparse.algebraic_connectivity, sparse.largest_eigenvalue
        again = graphs.Graph(count, tuple(edges)).largest_eigenvalue
    expected = np.linalg.eigvalsh(reference.laplacian(count, sparse.edges))
    assert found[0] == pytest.approx(expected[1], rel=1e-8)
    assert found[1] == pytest.approx(expected[-1], rel=1e-4)
    assert found[1] == again
    dense = graphs.Graph(count, tuple(edges))
    assert dense.algebraic_connectivity == pytest.approx(expected[1], rel=1e-10)
    assert dense.largest_eigenvalue == pytest.approx(expected[-1], rel=1e-12)


def test_a_large_graph_stays_sparse():
    graph = graphs.ring(5000)
    assert graph.sparse_laplacian.nnz == 3 * 5000
    assert len(graph.data.neighbour) == 2 * 5000
    with pytest.raises(InvalidInput, match=r"agent 1 cannot reach agents 3, 4, 5, 6, 7, \.\.\."):
        graphs.Graph(5000, ((0, 1),))
