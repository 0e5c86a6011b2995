"""Estimates over a control period, against SciPy's matrix exponential."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.sparse.linalg import expm_multiply

from gne_mj import graph as graphs
from gne_mj.controllers import propagation
from gne_mj.controllers.propagation import (
    BLOCK,
    Propagator,
    propagate_estimates,
    propagator,
    scratch_length,
)
from gne_mj.game_model import GameData
from gne_mj.native import compiled, source_key

NOTHING = np.zeros(0, dtype=np.int64)


@cache
def native():
    source = source_key()

    @compiled
    def move(data, graph, propagator, y, memory, scratch):
        _ = source
        propagate_estimates(data, graph, propagator, y, memory, scratch)

    return move


def random_graph(rng, count, extra):
    """A random tree with some more edges."""
    edges = [(i, int(rng.integers(i))) for i in range(1, count)]
    for _ in range(extra if count > 1 else 0):
        i, j = rng.choice(count, 2, replace=False)
        edges.append((int(i), int(j)))
    return graphs.Graph(count, tuple(edges))


def data_of(sizes):
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    return GameData(np.zeros(0), offsets, owner, *[NOTHING] * 6, np.zeros(0), *[NOTHING] * 3)


def series(graph, duration):
    """The series whatever the graph's size."""
    found = propagator(graph.data, duration)
    if len(found.coefficients):
        return found
    terms = propagation.series_of(0.5 * found.numbers[0] * duration)
    return Propagator(np.zeros((0, 0, 0)), terms, found.numbers)


def dense(graph, duration):
    """The maps whatever the graph's size."""
    numbers = np.array([np.nan, duration, np.exp(-duration)])
    return Propagator(propagation._dense(graph.data, duration), np.zeros(0), numbers)


def moved(graph, sizes, found, y, rows):
    """The product's estimates at the period's end, (N, m)."""
    memory = rows.ravel().copy()
    scratch = np.full(scratch_length(graph.agents), np.nan)
    native()(data_of(sizes), graph.data, found, y, memory, scratch)
    return memory.reshape(rows.shape)


def draw(rng, graph, sizes):
    """y and estimates, what stands in the own blocks being no numbers."""
    owner = np.repeat(np.arange(graph.agents), sizes)
    y, rows = rng.normal(size=len(owner)), rng.normal(size=(graph.agents, len(owner)))
    rows[owner, np.arange(len(owner))] = np.nan
    return owner, y, rows


def exact(graph, owner, duration, y, rows, columns):
    """Errors at the end of these columns by expm of the grounded Laplacian, and their norms."""
    for r in columns:
        others = np.arange(graph.agents) != owner[r]
        grounded = graph.laplacian[np.ix_(others, others)]
        start = rows[others, r] - y[r]
        yield r, others, y[r] + expm(-duration * grounded) @ start, np.linalg.norm(start)


FORMS = pytest.mark.parametrize("form", [series, dense])


@FORMS
@settings(max_examples=25)
@given(
    st.integers(1, 40),
    st.integers(0, 60),
    st.floats(-6.0, 4.0),
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 3]),
)
def test_random_graphs_and_actions_of_any_size(form, count, extra, magnitude, seed, largest):
    rng = np.random.default_rng(seed)
    graph = random_graph(rng, count, extra)
    duration = 10.0**magnitude / max(1.0, graph.largest_eigenvalue)
    sizes = rng.integers(1, largest + 1, count)
    owner, y, rows = draw(rng, graph, sizes)
    end = moved(graph, sizes, form(graph, duration), y, rows)
    # own blocks, no numbers at the start, have touched nothing else and are not to be read
    own = owner == np.arange(count)[:, None]
    assert np.all(np.isfinite(end[~own]))
    columns = rng.choice(len(owner), min(5, len(owner)), replace=False)
    for r, others, expected, size in exact(graph, owner, duration, y, rows, columns):
        assert np.linalg.norm(end[others, r] - expected) <= 1e-12 * size


@pytest.mark.parametrize("count", [BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK - 1, 300])
@pytest.mark.parametrize("magnitude", [1e-6, 0.3, 50.0, 1e4])
def test_block_edges_and_large_graphs(count, magnitude):
    rng = np.random.default_rng(count)
    graph = random_graph(rng, count, count)
    duration = magnitude / graph.largest_eigenvalue
    owner, y, rows = draw(rng, graph, np.ones(count, dtype=int))
    end = moved(graph, np.ones(count, dtype=int), series(graph, duration), y, rows)
    columns = [0, min(BLOCK, count) - 1, count // 2, count - 1]
    for r, others, expected, size in exact(graph, owner, duration, y, rows, columns):
        assert np.linalg.norm(end[others, r] - expected) <= 1e-12 * size


def test_a_large_ring_against_expm_multiply():
    count, duration = 1000, 20.0
    rng = np.random.default_rng(0)
    graph = graphs.ring(count)
    owner, y, rows = draw(rng, graph, np.ones(count, dtype=int))
    end = moved(graph, np.ones(count, dtype=int), propagator(graph.data, duration), y, rows)
    for r in (0, 499, 999):
        others = np.arange(count) != owner[r]
        start = rows[others, r] - y[r]
        grounded = graph.sparse_laplacian[others][:, others]
        expected = y[r] + expm_multiply(-duration * grounded, start)
        assert np.linalg.norm(end[others, r] - expected) <= 1e-12 * np.linalg.norm(start)


@FORMS
@pytest.mark.parametrize("duration", [1e-3, 0.7, 300.0])
def test_two_half_periods_are_one(form, duration):
    rng = np.random.default_rng(1)
    graph, sizes = random_graph(rng, 19, 10), rng.integers(1, 4, 19)
    _, y, rows = draw(rng, graph, sizes)
    once = moved(graph, sizes, form(graph, duration), y, rows)
    half = form(graph, 0.5 * duration)
    twice = moved(graph, sizes, half, y, moved(graph, sizes, half, y, rows))
    assert np.nanmax(np.abs(once - twice)) <= 1e-12 * np.nanmax(np.abs(rows))


@FORMS
def test_estimates_that_agree_stay_and_long_periods_end_at_the_actions(form):
    rng = np.random.default_rng(2)
    graph, sizes = random_graph(rng, 12, 5), np.ones(12, dtype=int)
    _, y, rows = draw(rng, graph, sizes)
    same = moved(graph, sizes, form(graph, 3.0), y, np.tile(y, (12, 1)))
    assert np.array_equal(same, np.tile(y, (12, 1)))
    end = moved(graph, sizes, form(graph, 1e4), y, rows)
    assert np.nanmax(np.abs(end - y)) <= 1e-12


def test_the_cheaper_form_is_taken_and_many_agents_need_no_cubes():
    few = propagator(graphs.complete(10).data, 5.0)
    assert few.maps.shape == (10, 10, 10)
    assert len(few.coefficients) == 0
    short = propagator(graphs.ring(30).data, 1e-3)
    assert short.maps.size == 0
    for count in (300, 3000):
        for duration in (1e-3, 1.0, 100.0):
            found = propagator(graphs.ring(count).data, duration)
            assert found.maps.size == 0
            assert len(found.coefficients) <= 40 + 12 * (2.0 * duration) ** 0.5
        assert scratch_length(count) == 4 * BLOCK * count


@pytest.mark.parametrize("graph", [graphs.ring(40), graphs.complete(12), graphs.printed()])
def test_the_bound_holds_for_the_spectrum(graph):
    assert graph.largest_eigenvalue <= propagator(graph.data, 1.0).numbers[0] + 1e-12
