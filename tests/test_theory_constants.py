"""mu, theta_1 and theta_2 of a game's slopes, against closed forms and pairs of profiles."""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    FIVE,
    V0,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from theory_systems import chain_slopes, coupled, osnr_slopes

import reference
import reference_games
from gne_mj.games import osnr_game, ten_channels
from gne_mj.theory import Slopes
from gne_mj.theory.constants import profiles
from gne_mj.theory.coupling import needed_connectivity


@st.composite
def small_osnr(draw):
    """A game of two to four channels and a box of powers."""
    n = draw(st.integers(2, 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    game = osnr_game(
        rng.uniform(0.5, 2, n), rng.uniform(0.5, 2, n), rng.uniform(0.3, 2, n),
        rng.uniform(0.05, 0.5, n), rng.uniform(0, 0.1, (n, n)), rng.uniform(0.5, 3),
    )  # fmt: skip
    return game, (np.zeros(n), rng.uniform(0.2, 3, n)), rng


@pytest.mark.parametrize("agents", [2, 5, 9])
def test_the_chain_has_closed_forms(agents):
    slopes = chain_slopes(agents)
    assert slopes.mu.value == pytest.approx(2 - 2 * np.cos(np.pi / (agents + 1)), rel=1e-12)
    assert slopes.theta_1.value == pytest.approx(4 * np.cos(np.pi / (2 * agents + 1)), rel=1e-12)
    assert slopes.theta_2.value == pytest.approx(np.sqrt(8), rel=1e-12)
    assert {slopes.mu.label, slopes.theta_1.label, slopes.theta_2.label} == {"exact"}


def test_the_papers_five_robots():
    slopes = chain_slopes(5)
    expected = reference.affine_constants(
        reference.pseudo_gradient_jacobian(reference_games.VelocityGame(V0, np.full(5, 3.0)), FIVE)
    )
    values = slopes.mu.value, slopes.theta_1.value, slopes.theta_2.value
    np.testing.assert_allclose(values, expected, rtol=1e-12)
    np.testing.assert_allclose(values, [0.267949, 3.837972, 2.828427], rtol=1e-6)
    # No unweighted graph of five has lambda_2 above 5.
    printed, rigorous = needed_connectivity(slopes)
    assert 5 < printed < rigorous


@given(small_osnr())
def test_osnr_bounds_hold_the_jacobian_everywhere_in_the_box(drawn):
    game, box, rng = drawn
    lower, upper = game.jacobian_bounds(box)
    corners = (box[0], box[1])
    for y in (*corners, *rng.uniform(box[0], box[1], (20, game.actions))):
        slope = game.pseudo_gradient_jacobian(y)
        assert np.all(slope >= lower - 1e-12 * np.abs(lower))
        assert np.all(slope <= upper + 1e-12 * np.abs(upper))
    # Attained: everybody receives least at one corner and most at the other.
    np.testing.assert_allclose(game.pseudo_gradient_jacobian(box[0]), upper, rtol=1e-12)
    np.testing.assert_allclose(game.pseudo_gradient_jacobian(box[1]), lower, rtol=1e-12)


@settings(max_examples=25)
@given(small_osnr())
def test_bounded_constants_bound_all_pairs_of_profiles(drawn):
    game, box, rng = drawn
    slopes = osnr_slopes(game, box)
    assert slopes.label == "bounded"
    n = game.actions
    for _ in range(20):
        y, other = rng.uniform(box[0], box[1], (2, n))
        change, distance = game.pseudo_gradient(y) - game.pseudo_gradient(other), y - other
        assert change @ distance >= slopes.mu.value * (distance @ distance) - 1e-9
        assert np.linalg.norm(change) <= slopes.theta_1.value * np.linalg.norm(distance) + 1e-9
        own, others = rng.uniform(box[0], box[1], (2, n, n))  # a profile for each agent
        extended = np.diag(game.pseudo_gradient(own) - game.pseudo_gradient(others))
        apart = np.linalg.norm(own - others)
        assert np.linalg.norm(extended) <= slopes.theta_2.value * apart + 1e-9


def test_osnr_is_certified_where_bounds_of_the_entries_are_too_coarse():
    fine = osnr_slopes()
    coarse = osnr_slopes(replace(fine.game, row_scaled=False))
    assert fine.monotone
    assert fine.mu.value == pytest.approx(0.128076, rel=1e-5)
    feasible = replace(fine, feasible=True)  # the total power is known there
    assert feasible.mu.value == pytest.approx(0.146434, rel=1e-5)
    assert fine.mu.sampled > fine.mu.value
    assert coarse.label == "bounded"
    assert coarse.mu.value < 0 < coarse.mu.sampled
    assert not coarse.monotone
    assert not coarse.refuted
    assert coarse.theta_1.value >= fine.theta_1.value * (1 - 1e-12)
    assert coarse.theta_2.value >= fine.theta_2.value * (1 - 1e-12)


@given(st.integers(0, 2**32 - 1))
def test_bounds_of_the_entries_alone(seed):
    rng = np.random.default_rng(seed)
    exact = chain_slopes(4)
    center = exact.game.pseudo_gradient_jacobian(exact.center)
    radius = rng.uniform(0, 0.1, center.shape)
    game = replace(
        exact.game, affine=False, jacobian_bounds=lambda box: (center - radius, center + radius)
    )
    slopes = Slopes(game, game.box, exact.center, feasible=True)
    for _ in range(20):
        slope = center + rng.uniform(-1, 1, center.shape) * radius
        mu, theta_1, theta_2 = reference.affine_constants(slope)
        assert slopes.mu.value <= mu + 1e-12
        assert slopes.theta_1.value >= theta_1 - 1e-12
        assert slopes.theta_2.value >= theta_2 - 1e-12
    assert slopes.mu.value >= exact.mu.value - np.linalg.norm(radius, 2) - 1e-12


def test_sampled_constants_are_never_certified():
    game = replace(osnr_game(**ten_channels()), jacobian_bounds=None)
    slopes = osnr_slopes(game)
    assert slopes.mu.label == slopes.theta_1.label == slopes.theta_2.label == "sampled"
    assert slopes.mu.value > 0
    assert not slopes.mu.certified
    assert not slopes.monotone


def test_a_game_that_is_not_affine_is_not_believed():
    game = replace(osnr_game(**ten_channels()), affine=True, jacobian_bounds=None)
    assert osnr_slopes(game).label == "sampled"


def test_no_bounds_where_received_powers_need_not_be_positive():
    game = osnr_game(**ten_channels())
    slopes = osnr_slopes(box=(np.full(10, -1.0), game.box[1]))
    assert slopes.label == "sampled"
    assert not slopes.monotone


def test_sampled_profiles_are_where_they_should_be():
    game = osnr_game(**ten_channels())
    center = np.full(10, 0.2)
    inside = profiles(game, center, game.box, 50, feasible=True)
    assert np.all(game.constraints(inside) < 0)
    assert np.min(-game.constraints(inside)) < 1e-9  # some on the boundary, up to rounding
    everywhere = profiles(game, center, game.box, 50, feasible=False)
    assert np.all((everywhere >= game.box[0]) & (everywhere <= game.box[1]))
    assert np.any(game.constraints(everywhere) > 0)
    boundless = profiles(game, center, None, 50, feasible=True)
    assert np.all(game.constraints(boundless) < 0)
    assert np.ptp(boundless) > 0.1


def test_theta_2_of_actions_of_several_entries():
    """Bounds of a game with sizes 2, 1, 1, against pairs of profiles, one for each agent."""
    rows, columns = np.indices((4, 4))
    off = 0.1 * (rows + columns + 1) * (coupled(0.3).game.agent_of_action != 0)
    off[2:] = 0.1 * (rows + columns + 1)[2:]
    np.fill_diagonal(off, 0.0)
    bounds = (np.eye(4) - off, 4.6 * np.eye(4) + off)  # for |y_a| <= 2
    box = (np.full(4, -2.0), np.full(4, 2.0))
    game = replace(coupled(0.3).game, jacobian_bounds=lambda _: bounds, box=box)
    slopes = Slopes(game, box, np.zeros(4), feasible=False)
    assert slopes.theta_2.label == "bounded"
    assert slopes.theta_2.sampled <= slopes.theta_2.value < slopes.theta_1.value
    rng = np.random.default_rng(0)
    rows_of = game.agent_of_action
    for _ in range(50):
        own, others = rng.uniform(-2, 2, (2, 3, 4))
        change = game.pseudo_gradient(own) - game.pseudo_gradient(others)
        extended = change[rows_of, np.arange(4)]
        distance = np.linalg.norm(own - others)
        assert np.linalg.norm(extended) <= slopes.theta_2.value * distance + 1e-12


def test_a_direction_that_is_not_monotone_is_found():
    box = (np.full(4, -2.0), np.full(4, 2.0))
    assert Slopes(coupled(-2.0).game, box, np.zeros(4), feasible=True).refuted
    assert not chain_slopes(5).refuted
