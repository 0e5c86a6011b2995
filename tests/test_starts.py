"""Random starts strictly inside."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.starts import interior_profile, random_starts


@given(st.integers(0, 2**32), st.floats(0.01, 0.999), st.integers(1, 6))
def test_random_starts_are_inside_and_not_beyond_the_spread(seed, spread, count):
    game = velocity_game(count, 3.0, np.linspace(0.5, 3.0, count))
    middle = np.full(count, 3.0)
    starts = random_starts(game, middle, range(seed, seed + 20), spread)
    assert np.all(game.constraints(starts) < 0)
    # scaled up by 1 / spread they are inside still: none lies farther than that share of the way
    assert np.all(game.constraints(middle + (starts - middle) / spread * (1 - 1e-9)) < 1e-9)


def test_a_start_has_one_direction_in_all_games():
    wide, narrow = velocity_game(3, 3.0, 3.0), velocity_game(3, 3.0, 0.1)
    one, two = (random_starts(g, np.full(3, 3.0), [7, 8], 0.5) - 3.0 for g in (wide, narrow))
    np.testing.assert_allclose(one, 30.0 * two, rtol=1e-9)


def test_random_starts_reach_all_around():
    """Uniform in a disc, of which a quarter lies within half of the radius."""
    game = velocity_game(2, 0.0, 1.0)
    found = random_starts(game, np.zeros(2), range(4000), 0.999)
    gaps = np.stack([found[:, 0], found[:, 1] - found[:, 0]])
    share = np.max(np.abs(gaps), axis=0)
    assert abs(np.mean(share < 0.5) - 0.25) < 0.03
    assert np.all(np.abs(np.mean(found, axis=0)) < 0.05)


def test_where_a_set_has_no_boundary_starts_stay_near():
    game = osnr_game(**{**ten_channels(), "total_power_limit": 1e6})
    found = random_starts(game, np.full(10, 0.2), range(50), 0.9)
    assert np.all(game.constraints(found) < 0)
    assert np.max(np.abs(found)) < 50


@pytest.mark.parametrize("shift", [0.0, 50.0])
def test_an_interior_profile_is_found_from_outside(shift):
    game = velocity_game(5, 3.0, 0.5)
    outside = np.array([1.0, 0.0, -1.0, 0.5, 2.0]) + shift
    assert np.any(game.constraints(outside) > 0)
    assert np.all(game.constraints(interior_profile(game, outside)) < 0)
