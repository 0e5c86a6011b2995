"""The Cournot game: its equilibria in closed form, with and without active bounds."""

import itertools

import numpy as np
import pytest
from builders import integrators, run_loop
from hypothesis import given
from hypothesis import strategies as st
from reference_agents import Integrator
from scipy.optimize import brentq

import reference
import reference_games
from gne_mj import run
from gne_mj.controllers import FullInformation
from gne_mj.equilibrium import measured_epsilon, penalised_equilibrium, variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.games import cournot_game
from gne_mj.scenario import load_scenario
from gne_mj.system import System

COST = 10 * (1 + np.arange(10) / 2)
START = np.full(10, 50.0)


def clipped_equilibrium(cost, intercept, lower, upper):
    """The GNE in closed form but for one scalar: given the total s, firm i makes
    D - s - c_i, clipped to its bounds (the complementarity conditions of one firm), and s is the
    root of the falling function sum_i clip(D - s - c_i) - s."""

    def made(total):
        return np.clip(intercept - total - cost, lower, upper)

    total = brentq(lambda s: made(s).sum() - s, lower.sum(), upper.sum(), xtol=1e-13, rtol=1e-15)
    return made(total)


def enumerated_equilibrium(cost, intercept, lower, upper):
    """The same by brute force: each firm free, at its lower or at its upper bound (3^N cases)."""
    n, found = len(cost), []
    matrix = np.eye(n) + np.ones((n, n))
    for case in itertools.product((-1, 0, 1), repeat=n):
        at = np.array(case)
        y = np.where(at < 0, lower, upper)
        free = at == 0
        right = intercept - cost[free] - y[~free].sum()
        y[free] = np.linalg.solve(matrix[np.ix_(free, free)], right)
        gradient = cost - intercept + y + y.sum()
        inside = np.all(y >= lower - 1e-9) and np.all(y <= upper + 1e-9)
        if inside and np.all(gradient[at < 0] >= -1e-9) and np.all(gradient[at > 0] <= 1e-9):
            found.append(y)
    return found


def test_no_bound_is_active_with_the_published_numbers():
    """y_i = D - s - c_i with s = (N D - sum c) / (N + 1): from 84.0909 - 10 down by 5 each."""
    total = (10 * 600 - COST.sum()) / 11
    expected = 600 - total - COST
    assert expected[[0, -1]] == pytest.approx([74.090909, 29.090909], abs=1e-6)
    assert np.allclose(cournot_game(10).pseudo_gradient(expected), 0, atol=1e-10)
    game = cournot_game(10)
    found = variational_equilibrium(game, START)
    assert np.allclose(found.action, expected, rtol=1e-10, atol=0)
    assert np.max(found.multipliers) < 1e-11 * 600  # of the price
    assert np.min(-game.constraints(found.action)) == pytest.approx(22.090909, abs=1e-6)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6))
def test_equilibria_with_active_bounds_equal_the_closed_form(seed, count):
    rng = np.random.default_rng(seed)
    cost, intercept = rng.uniform(0, 60, count), rng.uniform(20, 60 * count)
    lower = rng.uniform(0, 10, count)
    upper = lower + rng.uniform(1, 60, count)
    expected = clipped_equilibrium(cost, intercept, lower, upper)
    cases = enumerated_equilibrium(cost, intercept, lower, upper)
    assert cases
    for case in cases:
        assert np.allclose(case, expected, atol=1e-8)
    game = cournot_game(count, cost, intercept, lower, upper)
    found = variational_equilibrium(game, 0.5 * (lower + upper))
    # degenerate bounds (active with almost no multiplier) are approached as sqrt(rho) only
    assert np.allclose(found.action, expected, rtol=0, atol=1e-5)
    gradient = game.pseudo_gradient(found.action)
    assert np.allclose(
        found.multipliers[:count] - found.multipliers[count:], gradient, rtol=0, atol=1e-8
    )


def test_a_variant_whose_bounds_bind():
    lower, upper = np.full(10, 32.0), np.full(10, 70.0)
    expected = clipped_equilibrium(COST, 600.0, lower, upper)
    found = variational_equilibrium(cournot_game(10, lower_bound=32.0, upper_bound=70.0), START)
    assert np.allclose(found.action, expected, rtol=0, atol=1e-8)
    active = np.flatnonzero(found.multipliers > 1e-6)
    assert {int(i) for i in active} == {9, 10}  # firm 10's least, firm 1's greatest quantity


@pytest.mark.parametrize("rho", [10.0, 0.1])
def test_penalised_equilibrium_and_its_epsilon(rho):
    game = cournot_game(10)
    oracle = reference_games.CournotGame(COST, 600.0, np.full(10, 7.0), np.full(10, 100.0))
    found = penalised_equilibrium(game, rho, START)
    assert np.allclose(found.action, reference.penalised_equilibrium(oracle, rho, START), atol=1e-9)
    assert np.all(game.own_constraints == 2)
    assert np.all(measured_epsilon(game, found.action) <= 2 * rho)


def test_constants_of_monotonicity():
    mu, theta_1, _ = reference.affine_constants(cournot_game(10).pseudo_gradient_jacobian(START))
    assert (mu, theta_1) == (pytest.approx(1.0), pytest.approx(11.0))


@pytest.mark.slow  # of this game a loop is compiled, as below
def test_the_shipped_scenario_has_the_defaults_and_converges():
    shipped = load_scenario("cournot").systems["firms"].game.build(10)
    assert np.array_equal(shipped.parameters, cournot_game(10).parameters)
    assert np.array_equal(shipped.box, cournot_game(10).box)
    trajectory = run("cournot")
    report = trajectory.reports["firms"]
    assert report["status"] == "converged"
    assert report["lyapunov"]["monotone"]
    final = trajectory["firms"]["action"].values[-1]
    assert np.allclose(final, 600 - (6000 - COST.sum()) / 11 - COST, atol=0.02)


@pytest.mark.slow
def test_the_closed_loop_equals_an_independent_one():
    y = np.array([8.0, 90.0, 20.0, 75.0, 30.0, 60.0, 40.0, 50.0, 95.0, 10.0])
    oracle = reference_games.CournotGame(COST, 600.0, np.full(10, 7.0), np.full(10, 100.0))
    system = System(
        "firms", cournot_game(10), integrators(10), FullInformation(), 0.1, y[:, None].copy()
    )
    states, *_, loop = run_loop(system, 0.001, 200)
    assert loop.monitor.divided == 0
    rate = reference.closed_loop_rate(Integrator(), "full_information", oracle, 0.1)
    assert np.allclose(
        states[:, :, 0], reference.rk4_fixed(rate, y, 0.001, 200), rtol=1e-12, atol=1e-11
    )


@pytest.mark.parametrize(
    ("key", "bad"),
    [
        ("unit_cost", [1.0, 2.0]),
        ("unit_cost", 1.0),
        ("unit_cost", [1.0, 2.0, np.nan]),
        ("demand_intercept", np.inf),
        ("lower_bound", [1.0, 2.0]),
        ("lower_bound", -np.inf),
        ("upper_bound", 7.0),
        ("upper_bound", [8.0, 8.0, 6.0]),
    ],
)
def test_bad_numbers(key, bad):
    with pytest.raises(InvalidInput) as caught:
        cournot_game(3, **{key: bad})
    assert caught.value.key == key


def test_bad_numbers_in_a_scenario_name_the_system():
    with pytest.raises(InvalidInput, match=r"systems\.firms\.game\.upper_bound"):
        load_scenario("cournot", {"game.upper_bound": 5.0}).simulation_object()
    with pytest.raises(InvalidInput, match=r"systems\.firms\.game\.lower_bound"):
        load_scenario("cournot", {"game.lower_bound": [1.0, 2.0]}).simulation_object()
