"""Graphs that change: which one it is when, and that certificates speak of the worst of them."""

import itertools

import numpy as np
import pytest
from builders import velocity_game
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from gne_mj.changing_graph import disc, switching
from gne_mj.errors import InvalidInput
from gne_mj.graph import Graph, complete, connected, laplacian_of, line, ring, star
from gne_mj.theory import Slopes
from gne_mj.theory.coupling import coupling

THREE = (ring(5), line(5), complete(5))


def test_each_graph_has_its_time_and_they_come_again():
    """Against the plainest reading: walk along the times."""
    graph = switching(THREE, (0.1, 0.5, 0.2))
    expected, at = [], 0.0
    while at < 2.4 - 1e-9:
        expected += [(at + sum((0.1, 0.5, 0.2)[:k]), k) for k in range(3)]
        at += 0.8
    for (begin, number), (end, following) in itertools.pairwise(expected):
        for time in (begin, 0.5 * (begin + end), end - 1e-6):
            assert graph.number_at(time, 0) == number
            assert_allclose(graph.next_look(time), end, atol=1e-12)
        assert graph.number_at(end, 0) == following
    assert_array_equal(graph.lists_at(0.3, None, 0).neighbour, line(5).data.neighbour)


def test_a_random_order_is_the_seeds_and_all_graphs_come():
    graph = switching(THREE, 0.1, random=True)
    of = [[graph.number_at(0.1 * k, seed) for k in range(60)] for seed in (1, 1, 2)]
    assert of[0] == of[1] != of[2]
    assert set(of[0]) == {0, 1, 2}


def test_which_edges_there_are():
    graph = switching((line(4), star(4)), 1.0)
    assert graph.edges == ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3))
    found = graph.edges_at(np.array([0.0, 1.5]), None, 0)
    assert_array_equal(found, [[1, 0, 0, 1, 1], [1, 1, 1, 0, 0]])


def test_a_disc_graph_joins_whoever_is_near():
    graph = disc(3, 1.0)
    places = np.array([[[0.0, 0.0], [0.6, 0.8], [1.5, 0.9]]])
    lists = graph.lists_at(0.0, places[0], 0)
    assert_array_equal(laplacian_of(lists), [[1, -1, 0], [-1, 2, -1], [0, -1, 1]])
    assert_array_equal(graph.edges_at(np.zeros(1), places, 0), [[True, False, True]])
    assert connected(lists)
    assert not connected(graph.lists_at(0.0, 10.0 * places[0], 0))


@pytest.mark.parametrize("agents", range(2, 7))
def test_a_discs_members_are_all_trees_and_the_path_is_the_worst(agents):
    graph = disc(agents, 1.0)
    trees = {member.edges for member in graph.members}
    assert len(trees) == len(graph.members) == agents ** max(agents - 2, 0)  # Cayley
    least = min(tree.algebraic_connectivity for tree in graph.members)
    assert_allclose(graph.algebraic_connectivity, least, rtol=1e-12)
    assert disc(7, 1.0).members is None


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_connected_graph_needs_more_than_the_worst_that_is_counted(seed):
    rng = np.random.default_rng(seed)
    slopes = Slopes(velocity_game(4, 3.0, 3.0), None, np.zeros(4), feasible=False)
    worst = coupling(slopes, disc(4, 1.0), 1.0)
    while True:
        pairs = tuple((i, j) for i in range(4) for j in range(i) if rng.random() < 0.5)
        try:
            own = coupling(slopes, Graph(4, pairs), 1.0)
            break
        except InvalidInput:  # not connected
            continue
    for condition in ("printed", "rigorous", "quadratic"):
        most = getattr(worst, condition).least
        assert getattr(own, condition).least <= most * (1 + 1e-9) + 1e-12


def test_of_a_switching_graph_the_worst_member_counts():
    slopes = Slopes(velocity_game(5, 3.0, 3.0), None, np.zeros(5), feasible=False)
    of = [coupling(slopes, graph, 1.0) for graph in THREE]
    found = coupling(slopes, switching(THREE, 1.0), 1.0)
    for condition in ("rigorous", "quadratic"):
        worst = max(getattr(each, condition).least for each in of)
        assert getattr(found, condition).least == worst
    assert switching(THREE, 1.0).largest_eigenvalue == complete(5).largest_eigenvalue


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: switching((), 1.0), "graphs.*at least one"),
        (lambda: switching((ring(3), ring(4)), 1.0), "graphs.*the same agents"),
        (lambda: switching(THREE, (1.0, 2.0)), "every.*3 of them"),
        (lambda: switching(THREE, (1.0, 1.0, 2.0), random=True), "every.*one number"),
        (lambda: switching(THREE, 0.0), "every.*positive"),
        (lambda: disc(3, -1.0), "radius.*positive"),
        (lambda: disc(3, 1.0, 0.0), "interval.*positive"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(InvalidInput, match=words):
        make()
