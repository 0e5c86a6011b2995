"""Penalised and variational equilibria, best responses, and the epsilon of the lemma."""

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import coupled_game
import numpy as np
import pytest
from builders import FIVE, V0, reference_osnr
from hypothesis import given
from hypothesis import strategies as st
from own_games import ring
from scipy.optimize import minimize, minimize_scalar

import reference
import reference_games
from gne_mj import banded
from gne_mj.equilibrium import (
    _solver,
    best_response,
    measured_epsilon,
    order,
    path,
    penalised_equilibrium,
    variational_equilibrium,
)
from gne_mj.errors import InfeasibleStart, InvalidInput, SolverError
from gne_mj.game_model import Game
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


def random_channels(rng, count):
    """A game, its oracle and a start that may lie very close to a bound."""
    game, parameters = random_osnr(rng, count)
    share = rng.choice([1e-6, 0.5, 1 - 1e-6])
    start = rng.dirichlet(np.ones(count)) * parameters["total_power_limit"] * share
    return game, reference_osnr(parameters), np.maximum(start, 1e-12)


def random_robots(rng, count):
    """The same of robots with desires and bounds that differ by orders of magnitude."""
    delta = 10.0 ** rng.uniform(-1.5, 1.0, count)
    desired = V0 + 10.0 ** rng.uniform(-1.0, 1.5) * rng.normal(size=count)
    weight = 10.0 ** rng.uniform(-2.0, 1.5, count) * rng.integers(0, 2, count)
    share = rng.choice([0.5, 0.99, 1 - 1e-9])
    start = V0 + np.cumsum(rng.uniform(-share, share, count) * delta)
    oracle = reference_games.VelocityGame(V0, delta, desired, weight)
    return velocity_game(count, V0, delta, desired, weight), oracle, start


def kkt(oracle, result):
    """Worst stationarity residual relative to its terms, constraint and complementarity."""
    y, multipliers = result.action, result.multipliers
    gradient = reference.pseudo_gradient(oracle, y)
    rows = np.array([oracle.constraint_gradient(k, y) for k in range(oracle.p)])
    size = np.abs(gradient) + multipliers @ np.abs(rows)
    g = reference.constraints(oracle, y)
    stationarity = np.abs(gradient + multipliers @ rows) / np.maximum(1.0, size)
    return np.max(stationarity), np.max(g), np.max(multipliers * -g)


any_game = pytest.mark.parametrize("build", [random_channels, random_robots])


@any_game
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12), exponent=st.integers(-6, 1))
def test_any_game_from_any_interior_start(build, seed, count, exponent):
    game, oracle, start = build(np.random.default_rng(seed), count)
    rho = 10.0**exponent
    result = penalised_equilibrium(game, rho, start)
    stationarity, g, _ = kkt(oracle, result)
    assert stationarity <= 1e-10
    assert g < 0
    assert np.allclose(result.multipliers * -game.constraints(result.action), rho, rtol=1e-5)
    again = penalised_equilibrium(game, rho, result)
    assert np.allclose(again.action, result.action, rtol=1e-9, atol=1e-9)


@any_game
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12))
def test_the_variational_equilibrium_meets_its_conditions(build, seed, count):
    """For a monotone F and convex constraints they are sufficient."""
    game, oracle, start = build(np.random.default_rng(seed), count)
    result = variational_equilibrium(game, start)
    stationarity, g, complementarity = kkt(oracle, result)
    assert stationarity < 1e-10
    assert g < 0
    y = result.action
    rows = np.abs(game.pseudo_gradient(y))
    rows += result.multipliers @ np.abs(game.constraint_jacobian(y))
    rows += np.max(np.abs(y)) * np.sum(np.abs(game.pseudo_gradient_jacobian(y)), axis=1)
    size = np.max(rows) * np.max(np.abs(y))  # of the costs
    # what is left of g has the rounding of y in it, which large multipliers magnify
    assert complementarity < 1e-11 * size * max(1.0, np.max(result.multipliers))
    assert result.complementarity < 1e-11 * size
    assert np.all(result.multipliers > 0)


@any_game
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6))
def test_measured_epsilon_is_within_the_lemma(build, seed, count):
    game, _, start = build(np.random.default_rng(seed), count)
    for rho in (0.1, 1e-3):
        y = penalised_equilibrium(game, rho, start).action
        gains = measured_epsilon(game, y)
        assert np.all(gains <= game.own_constraints * rho * (1 + 1e-9) + 1e-9)
        assert np.all(gains <= game.constraints_count * rho * (1 + 1e-9) + 1e-9)


def chain(count, seed=0):
    rng = np.random.default_rng(seed)
    desired, weight = V0 + rng.normal(size=count), np.full(count, 0.5)
    return velocity_game(count, V0, 0.4, desired, weight), desired, weight


def test_a_thousand_robots():
    game, desired, weight = chain(1000)
    oracle = reference_games.VelocityGame(V0, np.full(1000, 0.4), desired, weight)
    assert _solver(game)._half_band == 1
    result = variational_equilibrium(game, np.full(1000, V0 - 1e-3))
    stationarity, g, complementarity = kkt(oracle, result)
    assert stationarity < 1e-10
    assert g < 0
    assert complementarity < 1e-10
    assert np.mean(result.multipliers > -game.constraints(result.action)) > 0.1
    y = penalised_equilibrium(game, 0.1, result).action
    gains = measured_epsilon(game, y)
    for i in range(1000):  # an interval's least square, by hand
        before, after = (V0 if i == 0 else y[i - 1]), (y[i + 1] if i < 999 else None)
        low, high = before - 0.4, before + 0.4
        if after is not None:
            low, high = max(low, after - 0.4), min(high, after + 0.4)
        best = np.clip((before + weight[i] * desired[i]) / (1 + weight[i]), low, high)
        response = np.concatenate([y[:i], [best], y[i + 1 :]])
        assert gains[i] == pytest.approx(oracle.cost(i, y) - oracle.cost(i, response), abs=1e-9)


def test_a_best_response_has_the_multipliers_of_its_own_problem():
    game, _, _ = chain(6, seed=3)
    y = penalised_equilibrium(game, 0.1, np.full(6, V0)).action
    for agent in range(6):
        response = best_response(game, agent, y)
        others = np.setdiff1d(np.arange(6), [agent, agent + 1])
        assert np.all(response.multipliers[others] == 0.0)
        slope = game.pseudo_gradient(response.action)[agent]
        slope += response.multipliers @ game.constraint_jacobian(response.action)[:, agent]
        assert abs(slope) < 1e-10


def test_a_path_hands_on_what_it_found():
    game, _, _ = chain(8, seed=1)
    start = np.full(8, V0)
    rhos = np.geomspace(1.0, 1e-6, 13)
    for way in (rhos, rhos[::-1]):
        points = list(path(game, way, start))
        alone = [penalised_equilibrium(game, rho, start) for rho in way]
        for point, expected in zip(points, alone, strict=True):
            assert np.allclose(point.action, expected.action, rtol=0, atol=1e-10)
            assert point.rho == expected.rho
        assert sum(p.iterations for p in points[1:]) < sum(p.iterations for p in alone[1:])


def test_the_path_ends_at_the_variational_equilibrium():
    game, _, _ = chain(8, seed=1)
    points = list(path(game, 10.0 ** -np.arange(0, 9.0), np.full(8, V0)))
    end = variational_equilibrium(game, np.full(8, V0)).action
    distances = [np.max(np.abs(point.action - end)) for point in points]
    assert np.all(np.diff(distances) < 0)
    assert distances[-1] < 1e-7
    from_path = variational_equilibrium(game, points[3])
    assert np.allclose(from_path.action, end, rtol=0, atol=1e-9)


def coupled():
    return Game(
        name="coupled", kernels=coupled_game, parameters=np.array([0.5]),
        sizes=coupled_game.SIZES, in_cost=[range(3)] * 3,
        in_constraint=coupled_game.IN_CONSTRAINT, constraint_names=("ball", "product"),
    )  # fmt: skip


def test_actions_of_several_entries_and_curved_constraints():
    game = coupled()
    rng = np.random.default_rng(2)
    expected = None
    for start in rng.uniform(-0.9, 0.9, (10, 4)):
        result = penalised_equilibrium(game, 0.3, start)
        y = result.action
        push = (0.3 / -game.constraints(y)) @ game.constraint_jacobian(y)
        assert np.allclose(game.pseudo_gradient(y) + push, 0, atol=1e-11)
        expected = y if expected is None else expected
        assert np.allclose(y, expected, rtol=0, atol=1e-10)
        response = best_response(game, 0, start)

        def cost(own, start=start):
            return game.costs([*own, *start[2:]])[0]

        def room(own, start=start):
            return -game.constraints([*own, *start[2:]])

        found = minimize(
            cost, start[:2], method="SLSQP", constraints={"type": "ineq", "fun": room},
            options={"ftol": 1e-14},
        )  # fmt: skip
        assert found.success
        assert cost(response.action[:2]) <= found.fun + 1e-9
        assert np.allclose(response.action[:2], found.x, atol=1e-5)
        assert np.array_equal(response.action[2:], start[2:])


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 12), b=st.integers(0, 11))
def test_banded_factors_solve(seed, n, b):
    rng = np.random.default_rng(seed)
    b = min(b, n - 1)
    row, column = np.indices((n, n))
    matrix = np.where(np.abs(row - column) <= b, rng.normal(size=(n, n)), 0.0)
    right = rng.normal(size=n)
    band = np.zeros((n, 3 * b + 1))
    for r, c in zip(*np.nonzero(matrix), strict=True):
        band[r, c - r + b] = matrix[r, c]
    pivots, x = np.zeros(n, dtype=np.int64), right.copy()
    assert banded.factorise(band, n, b, pivots)
    banded.solve(band, n, b, pivots, x)
    size = np.abs(matrix) @ np.abs(x) + np.abs(right)
    assert np.all(np.abs(matrix @ x - right) <= 1e-12 * np.max(size))


def test_a_singular_band_is_told():
    band, pivots = np.zeros((3, 4)), np.zeros(3, dtype=np.int64)
    band[:, 1] = [1.0, 0.0, 1.0]
    assert not banded.factorise(band, 3, 1, pivots)


def test_unknowns_are_ordered_for_a_narrow_band():
    """A chain of agents numbered at random, with two actions each."""
    names = np.random.default_rng(0).permutation(50)
    following = {int(a): int(b) for a, b in zip(names[1:], names, strict=False)}
    game = Game(
        name="shuffled", kernels=coupled_game, parameters=np.zeros(1), sizes=(2,) * 50,
        in_cost=[[i, following[i]] if i in following else [i] for i in range(50)],
        in_constraint=[list(pair) for pair in following.items()],
        constraint_names=tuple(f"{pair}" for pair in following.items()),
    )  # fmt: skip
    position, half_band = order(game)
    assert sorted(position) == list(range(100))
    assert np.array_equal(position[1::2], position[::2] + 1)
    assert half_band == 3


def test_threads_may_share_a_game():
    game, _, _ = chain(20, seed=2)
    starts = [np.full(20, V0 + shift) for shift in np.linspace(-0.3, 0.3, 40)]

    def both(start):
        y = penalised_equilibrium(game, 0.1, start).action
        return np.concatenate([y, measured_epsilon(game, start)])

    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(both, starts))
    for start, found in zip(starts, together, strict=True):
        assert np.array_equal(found, both(start))


def test_many_best_responses_are_those_of_each_agent():
    """Shared among threads, in pieces, each with memory of its own."""
    game, _, _ = chain(300, seed=3)
    y = np.full(300, V0)
    told = []
    gains = measured_epsilon(game, y, lambda: told.append(1))
    assert len(told) == 300
    for agent in (0, 63, 64, 150, 299):
        alone = best_response(game, agent, y)
        gain = game.costs(y)[agent] - game.costs(alone.action)[agent]
        assert gains[agent] == pytest.approx(max(gain, 0.0), rel=1e-9, abs=1e-12)


def test_a_hole_in_the_set_hides_no_gain():
    """The ring's first player would rather be on its other side, as far left as may be."""
    y = np.array([0.97, -0.02])
    left = -np.sqrt(1.0 - 0.02**2)
    gain = 2.5 * ((0.97 + 3.0) ** 2 - (left + 3.0) ** 2)
    assert measured_epsilon(ring(), y) == pytest.approx([gain, 0.0], rel=1e-6)
    assert best_response(ring(), 0, y).action == pytest.approx([left, -0.02], abs=1e-6)


def test_a_game_that_is_not_used_any_more_is_forgotten():
    game, _, _ = chain(3)
    penalised_equilibrium(game, 0.1, np.full(3, V0))
    gone = weakref.ref(game)
    del game
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize("rho", [0.0, -1.0, np.nan, np.inf])
def test_a_rho_that_is_none_is_refused(rho):
    with pytest.raises(InvalidInput, match="rho"):
        penalised_equilibrium(OSNR, rho, START)


def test_a_failure_carries_its_numbers():
    """No floating-point y is so near the boundary."""
    with pytest.raises(SolverError) as caught:
        penalised_equilibrium(OSNR, 1e-30, START)
    assert caught.value.iterations > 0
    assert "OSNR" in str(caught.value)


def test_a_profile_of_another_size_is_refused():
    with pytest.raises(ValueError, match="shape"):
        penalised_equilibrium(OSNR, 0.1, 0.2)


def test_best_response_equals_a_scalar_minimisation():
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
