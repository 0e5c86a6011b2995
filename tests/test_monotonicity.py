"""Bounds of mu and of the coupling gain for many agents, against all corners and dense forms."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gne_mj import graph as graphs
from gne_mj.games import osnr_game, velocity_game
from gne_mj.theory import Slopes
from gne_mj.theory.coupling import coupling, least_coupling
from gne_mj.theory.monotonicity import least_eigenvalue

SEEDS = st.integers(0, 2**32 - 1)


def corners(short, long):
    """Least eigenvalue of the symmetric part over all 2^m choices of rows."""
    choice = np.array(list(product((False, True), repeat=len(short))))
    ends = np.where(choice[:, :, None], long, short)
    return np.linalg.eigvalsh(0.5 * (ends + ends.transpose(0, 2, 1)))[:, 0].min()


def drawn_rows(rng, dominant):
    """Rows of one direction each, as an OSNR game's or with entries of any size and sign."""
    m = int(rng.integers(1, 8))
    response = rng.normal(size=(m, m)) * rng.choice([0.02, 0.3, 1.0])
    if dominant:
        response = 0.5 * np.eye(m) + np.abs(response) * rng.choice([0.02, 0.2])
    short = 10.0 ** rng.uniform(-2, 1, m)
    long = short * 10.0 ** (rng.uniform(0, 3, m) * (rng.random(m) < 0.8))
    return short[:, None] * response, long[:, None] * response


@settings(max_examples=25)
@given(SEEDS, st.booleans())
def test_no_corner_is_below_the_bound_and_the_bound_is_near_them(seed, dominant):
    short, long = drawn_rows(np.random.default_rng(seed), dominant)
    bound, size = least_eigenvalue(short, long), np.max(np.abs(long))
    assert bound.value <= corners(short, long) + 1e-12 * size
    # The relaxation of a matrix cube needs no more room than the cube itself has with its sides
    # pi/2 times as long; twice as long, so that the search need not have found the best.
    middle, half = 0.5 * (short + long), 0.5 * (long - short)
    assert bound.value >= corners(middle - 2 * half, middle + 2 * half) - 1e-3 * size


@settings(max_examples=25)
@given(SEEDS)
def test_the_loss_bounds_every_matrix_between_the_rows(seed):
    rng = np.random.default_rng(seed)
    short, long = drawn_rows(rng, dominant=True)
    bound = least_eigenvalue(short, long)
    lost = bound.loss.T @ bound.loss
    for _ in range(10):
        slope = short + rng.uniform(size=(len(short), 1)) * (long - short)
        left = slope - bound.base + lost
        scale = np.max(np.abs(long))
        assert np.linalg.eigvalsh(0.5 * (left + left.T))[0] >= -1e-12 * scale
    assert bound.value == pytest.approx(
        np.linalg.eigvalsh(0.5 * (bound.base + bound.base.T) - lost)[0], abs=1e-10
    )


def test_rows_that_do_not_move_give_the_least_eigenvalue_itself():
    slope = np.array([[2.0, 1.0], [0.0, 3.0]])
    bound = least_eigenvalue(slope, slope)
    assert bound.value == pytest.approx(np.linalg.eigvalsh(0.5 * (slope + slope.T))[0])
    assert not np.any(bound.loss)


def test_the_bound_does_not_depend_on_the_unit():
    short, long = drawn_rows(np.random.default_rng(3), dominant=True)
    plain, scaled = least_eigenvalue(short, long).value, least_eigenvalue(1e9 * short, 1e9 * long)
    assert scaled.value == pytest.approx(1e9 * plain, rel=1e-6)


# ------------------------------------------------------------------------------------------ osnr


def channels(count, seed=0, crosstalk=0.02):
    """A link like the shipped one with so many channels: the same figures, weaker crosstalk."""
    rng = np.random.default_rng(seed)
    price = np.linspace(1.0, 2.0, count)
    matrix = rng.uniform(0.0, crosstalk / count, (count, count))
    return osnr_game(price, price, np.full(count, 0.5), np.full(count, 0.05), matrix, 2.5)


def slopes_of(game, feasible=True):
    return Slopes(game, game.box, np.full(game.actions, 0.5 / game.actions), feasible)


@given(SEEDS)
def test_bounds_over_the_feasible_powers_hold_there(seed):
    rng = np.random.default_rng(seed)
    game = channels(int(rng.integers(1, 6)), seed, crosstalk=1.0)
    lower, upper = game.feasible_jacobian_bounds
    n, limit = game.actions, game.box[1][0]
    # All of the power in one channel is what a row's receiver hears most or least of.
    for y in (*(limit * np.eye(n)), *(limit * rng.dirichlet(np.ones(n + 1), 10)[:, :n])):
        slope = game.pseudo_gradient_jacobian(y)
        assert np.all(slope >= lower * (1 - 1e-12))
        assert np.all(slope <= upper * (1 + 1e-12))
    least = np.min([game.pseudo_gradient_jacobian(y) for y in limit * np.eye(n)], axis=0)
    np.testing.assert_allclose(lower, least, rtol=1e-12)


@pytest.mark.parametrize("count", [13, 40])
@pytest.mark.parametrize("feasible", [True, False])
def test_links_of_many_channels_are_certified(count, feasible):
    slopes = slopes_of(channels(count), feasible)
    assert slopes.monotone
    assert 0.1 < slopes.mu.value < slopes.mu.sampled
    assert slopes.theta_1.value >= slopes.theta_1.sampled


def test_crosstalk_that_breaks_monotonicity_is_not_certified():
    slopes = slopes_of(channels(13, crosstalk=2.0))
    assert slopes.mu.sampled < 0
    assert slopes.mu.value <= slopes.mu.sampled
    assert not slopes.monotone


# -------------------------------------------------------------------------------------- coupling


def dense_form(slope, owner, graph, gain, loss=None):
    """c L (x) I + sum_r sym(e_r s_r') - w_r w_r' in the owners' blocks, entry by entry."""
    agents, m = graph.agents, len(owner)
    form = gain * np.kron(graph.laplacian, np.eye(m))
    for r, i in enumerate(owner):
        unit = np.zeros(agents * m)
        unit[i * m + r] = 1.0
        for row, weight in ((slope[r], 0.5), *(() if loss is None else ((loss[r], None),))):
            wide = np.zeros(agents * m)
            wide[i * m : (i + 1) * m] = row
            if weight is None:
                form -= np.outer(wide, wide)
            else:
                form += weight * (np.outer(unit, wide) + np.outer(wide, unit))
    return form


def drawn_sparse(rng):
    """A sparse dF/dy, strongly monotone, of agents with one or two actions on a sparse graph."""
    agents = int(rng.integers(2, 7))
    owner = np.repeat(np.arange(agents), rng.integers(1, 3, agents))
    m = len(owner)
    slope = rng.normal(size=(m, m)) * (rng.random((m, m)) < 0.3)
    slope += (0.2 - np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]) * np.eye(m)
    tree = tuple((int(rng.integers(0, i)), i) for i in range(1, agents))
    return slope, owner, graphs.Graph(agents, tree)


@given(SEEDS)
def test_the_reduced_form_is_definite_exactly_where_the_whole_one_is(seed):
    rng = np.random.default_rng(seed)
    slope, owner, graph = drawn_sparse(rng)
    loss = 0.1 * rng.normal(size=slope.shape) * (rng.random(slope.shape) < 0.3)
    for each in (None, loss):
        least = least_coupling(slope, graph, owner, loss=each)
        if least == np.inf:
            lost = 0.0 if each is None else each.T @ each
            assert np.linalg.eigvalsh(0.5 * (slope + slope.T) - lost)[0] <= 1e-9
            continue
        above = dense_form(slope, owner, graph, 1.001 * least + 1e-6, each)
        assert np.linalg.eigvalsh(above)[0] > 0
        if least > 1e-6:
            below = dense_form(slope, owner, graph, 0.999 * least, each)
            assert np.linalg.eigvalsh(below)[0] < 0


def chain(agents):
    game = velocity_game(agents, 3.0, 3.0)
    return Slopes(game, game.box, np.full(agents, 3.0), feasible=True)


def test_two_hundred_robots_on_a_line():
    """c > 4095 by an independent sparse factorisation, within 0.2%."""
    found = coupling(chain(200), graphs.line(200), 5000.0)
    assert found.quadratic.least == pytest.approx(4095.0, rel=2e-3)
    assert found.quadratic.certified
    assert found.certified


def test_the_gain_grows_with_the_square_of_the_line():
    least = [coupling(chain(n), graphs.line(n), 1.0).quadratic.least for n in (50, 100, 200)]
    assert least[1] / least[0] == pytest.approx(4.0, rel=0.05)
    assert least[2] / least[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.slow
def test_a_thousand_robots_on_a_line():
    assert coupling(chain(1000), graphs.line(1000), 1.0).quadratic.least == pytest.approx(
        25.0 * coupling(chain(200), graphs.line(200), 1.0).quadratic.least, rel=0.02
    )
