"""Penalised and variational equilibria, best responses, and the epsilon of the lemma."""

import numpy as np
import pytest
from builders import FIVE, V0, reference_osnr
from hypothesis import given
from hypothesis import strategies as st

import reference
from gne_mj.equilibrium import (
    best_response,
    measured_epsilon,
    penalised_equilibrium,
    variational_equilibrium,
)
from gne_mj.errors import InfeasibleStart
from gne_mj.games import osnr_game, ten_channels, velocity_game

OSNR = osnr_game(**ten_channels())
START = np.full(10, 0.2)


def random_osnr(rng, count):
    parameters = {
        "price": rng.uniform(0.5, 3.0, count),
        "utility_weight": rng.uniform(0.5, 3.0, count),
        "gain": rng.uniform(0.2, 1.0, count),
        "noise_power": rng.uniform(0.02, 0.2, count),
        "system_matrix": rng.uniform(0.0, 0.01, (count, count)),
        "total_power_limit": rng.uniform(0.1, 1.0) * count,
    }
    return osnr_game(**parameters), parameters


def test_robots_rest_at_the_reference_velocity():
    for rho in (10.0, 0.1, 1e-6):
        result = penalised_equilibrium(velocity_game(5, V0, 3.0), rho, FIVE)
        assert np.allclose(result.action, V0, rtol=0, atol=1e-12)
        assert result.residual <= 1e-12


def test_osnr_facts():
    penalised = penalised_equilibrium(OSNR, 0.1, START)
    assert np.sum(penalised.action) == pytest.approx(2.4676, abs=5e-5)
    variational = variational_equilibrium(OSNR, START)
    assert np.sum(variational.action) == pytest.approx(2.5, abs=1e-9)
    assert variational.multipliers[-1] > 1.0
    assert np.all(variational.multipliers[:-1] < 1e-9)
    assert np.all(OSNR.constraints(variational.action) < 0)


@pytest.mark.parametrize("rho", [1.0, 0.1, 0.01])
def test_penalised_equilibrium_equals_the_reference(rho):
    expected = reference.penalised_equilibrium(reference_osnr(), rho, START)
    result = penalised_equilibrium(OSNR, rho, START)
    assert np.allclose(result.action, expected, rtol=0, atol=1e-11)
    assert np.allclose(
        OSNR.pseudo_gradient(result.action)
        + reference.barrier_gradient(reference_osnr(), rho, result.action),
        0,
        atol=1e-11,
    )
    assert np.allclose(result.multipliers, rho / -OSNR.constraints(result.action), rtol=1e-9)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12), exponent=st.integers(-6, 1))
def test_any_game_from_any_interior_start(seed, count, exponent):
    rng = np.random.default_rng(seed)
    rho = 10.0**exponent
    game, _ = random_osnr(rng, count)
    limit = game.parameters[1]
    for share in (1e-6, 0.5, 1 - 1e-6):
        start = rng.dirichlet(np.ones(count)) * limit * share
        start = np.maximum(start, 1e-12)
        result = penalised_equilibrium(game, rho, start)
        assert result.residual <= 1e-10
        assert np.all(game.constraints(result.action) < 0)
    delta = rng.uniform(0.5, 4.0, count)
    robots = velocity_game(count, V0, delta)
    start = V0 + np.cumsum(rng.uniform(-0.999, 0.999, count) * delta)
    assert np.allclose(penalised_equilibrium(robots, rho, start).action, V0, atol=1e-9)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6))
def test_measured_epsilon_is_within_the_lemma(seed, count):
    game, _ = random_osnr(np.random.default_rng(seed), count)
    start = np.full(count, 0.5 * game.parameters[1] / count)
    for rho in (0.1, 1e-3):
        y = penalised_equilibrium(game, rho, start).action
        gains = measured_epsilon(game, y)
        assert np.all(gains <= game.own_constraints * rho + 1e-9)
        assert np.all(gains <= game.constraints_count * rho + 1e-9)


def test_best_response_equals_a_scalar_minimisation():
    from scipy.optimize import minimize_scalar

    y = penalised_equilibrium(OSNR, 0.1, START).action
    for agent in range(10):
        room = y[agent] - np.sum(y) + 2.5

        def cost(action, agent=agent):
            return OSNR.costs(np.concatenate([y[:agent], [action], y[agent + 1 :]]))[agent]

        expected = minimize_scalar(cost, bounds=(0.0, room), options={"xatol": 1e-10})
        found = best_response(OSNR, agent, y)
        assert np.array_equal(np.delete(found.action, agent), np.delete(y, agent))
        assert cost(found.action[agent]) <= expected.fun + 1e-9


def test_a_start_outside_is_refused():
    with pytest.raises(InfeasibleStart, match="total power"):
        penalised_equilibrium(OSNR, 0.1, np.full(10, 0.3))
