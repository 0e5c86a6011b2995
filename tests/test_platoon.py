"""The platoon: its derivatives, its equilibria by brute force, runs under all laws, bad input."""

import itertools

import numpy as np
import pytest
from builders import clock, integrators
from hypothesis import given, settings
from hypothesis import strategies as st
from position_games import random_platoon
from scipy.optimize import linprog, root

from gne_mj import graph as graphs
from gne_mj import plots
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.equilibrium import measured_epsilon, penalised_equilibrium, variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.game_check import examine
from gne_mj.games import platoon_game
from gne_mj.games.platoon import PlatoonTable
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.theory import certify
from gne_mj.viewer.shares import shares

seeds = st.integers(0, 2**32 - 1)


def rows(numbers):
    """(A, b): the constraints are A y <= b, the leader's first of each half."""
    n = len(numbers["place_weight"])
    spacing = np.eye(n)[:-1] - np.eye(n)[1:]
    low, high = numbers["leader_range"]
    first = np.vstack([np.eye(n)[:1], spacing])
    lower = np.concatenate([[low], numbers["least_spacing"]])
    upper = np.concatenate([[high], numbers["greatest_spacing"]])
    return np.vstack([-first, first]), np.concatenate([-lower, upper])


def affine(numbers):
    """(M, c): F(y) = M y + c, by differentiating J by hand."""
    v, r = numbers["place_weight"], numbers["desired_place"]
    n, w, d = len(v), numbers["spacing_weight"], numbers["desired_spacing"]
    matrix, constant = np.diag(2 * v), -2 * v * r
    for i in range(1, n):
        matrix[i, i] += 2 * w[i - 1]
        matrix[i, i - 1] -= 2 * w[i - 1]
        constant[i] += 2 * w[i - 1] * d[i - 1]
    return matrix, constant


@given(seed=seeds)
def test_values_are_those_of_plain_matrices(seed):
    draw = random_platoon(seed)
    (matrix, constant), (slopes, limits) = affine(draw.numbers), rows(draw.numbers)
    game, y = draw.game, draw.interior()
    np.testing.assert_allclose(game.pseudo_gradient(y), matrix @ y + constant, atol=1e-12)
    np.testing.assert_allclose(game.constraints(y), slopes @ y - limits, atol=1e-13)
    np.testing.assert_array_equal(game.pseudo_gradient_jacobian(y), matrix)
    np.testing.assert_array_equal(game.constraint_jacobian(y), slopes)
    assert np.all(game.constraints(y) < 0)


@settings(max_examples=8)
@given(seed=seeds)
def test_the_game_agrees_with_itself(seed):
    draw = random_platoon(seed)
    report = examine(draw.game, draw.interior(), points=4, most=8)
    assert report.holds, report


@given(seed=seeds)
def test_the_box_is_the_least_one(seed):
    draw = random_platoon(seed)
    slopes, limits = rows(draw.numbers)
    lower, upper = draw.game.box
    for a, direction in enumerate(np.eye(draw.game.actions)):
        for sign, expected in ((1, lower[a]), (-1, upper[a])):
            found = linprog(sign * direction, slopes, limits, bounds=(None, None))
            assert sign * found.fun == pytest.approx(expected, abs=1e-9)


def by_enumeration(numbers):
    """The variational equilibrium: each pair's spacing, and the leader, free or on a bound."""
    matrix, constant = affine(numbers)
    slopes, limits = rows(numbers)
    n = len(constant)
    for case in itertools.product((None, 0, 1), repeat=n):
        active = [k + half * n for k, half in enumerate(case) if half is not None]
        bound = slopes[active]
        size = n + len(active)
        system = np.zeros((size, size))
        system[:n, :n], system[:n, n:], system[n:, :n] = matrix, bound.T, bound
        found = np.linalg.solve(system, np.concatenate([-constant, limits[active]]))
        y, multipliers = found[:n], found[n:]
        if np.all(multipliers >= -1e-9) and np.all(slopes @ y <= limits + 1e-9):
            return y, active
    raise AssertionError("no case is an equilibrium")


@given(seed=seeds)
def test_the_variational_equilibrium_is_that_of_all_cases(seed):
    draw = random_platoon(seed, count=1 + seed % 5)
    expected, _ = by_enumeration(draw.numbers)
    found = variational_equilibrium(draw.game, draw.interior(0.9))
    # a bound that is active with almost no multiplier is approached as sqrt(rho) only
    assert np.allclose(found.action, expected, rtol=0, atol=1e-5)
    if np.min(found.multipliers[-draw.game.constraints(found.action) < 1e-6], initial=1.0) > 1e-3:
        assert np.allclose(found.action, expected, rtol=0, atol=1e-7)


def test_where_bounds_bind_the_leader_waits_and_else_all_is_as_wished():
    """Wished 4 m apart where 3 m is the most: 2 (4 - 3) = lambda_3 of the last agent, the same is
    lambda_2 - lambda_3 of the one before, and 2 y_1 + lambda_2 = 0 of the leader."""
    far = platoon_game(3, desired_spacing=4.0, desired_place=0.0)
    found = variational_equilibrium(far, [0.0, -2.0, -4.0])
    assert found.action == pytest.approx([-2.0, -5.0, -8.0], abs=1e-7)
    assert found.multipliers[4:] == pytest.approx([4.0, 2.0], abs=1e-6)
    near = platoon_game(3, desired_spacing=2.0, spacing_weight=[1.0, 0.2], leader_range=(-1, 3))
    assert variational_equilibrium(near, [0.5, -1.0, -2.0]).action == pytest.approx(
        [0.0, -2.0, -4.0], abs=1e-7
    )


@given(seed=seeds)
def test_the_penalised_equilibrium_is_scipys(seed):
    draw, rho = random_platoon(seed), 0.1
    (matrix, constant), (slopes, limits) = affine(draw.numbers), rows(draw.numbers)
    found = penalised_equilibrium(draw.game, rho, draw.interior(0.9)).action

    def residual(y):
        return matrix @ y + constant + slopes.T @ (rho / (limits - slopes @ y))

    again = root(residual, found + 1e-4, tol=1e-14).x
    assert np.allclose(again, found, rtol=0, atol=1e-7)
    assert np.all(measured_epsilon(draw.game, found) <= rho * draw.game.own_constraints + 1e-9)


# ---------------------------------------------------------------------------------- monotonicity


@given(seed=seeds)
def test_weights_are_refused_if_and_only_if_f_is_not_strongly_monotone(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    weights = {"spacing_weight": rng.uniform(0, 2, n - 1) * (rng.random(n - 1) < 0.8),
               "place_weight": rng.uniform(0, 1, n) * (rng.random(n) < 0.8)}  # fmt: skip
    others = {"desired_spacing": np.zeros(n - 1), "desired_place": np.zeros(n)}
    matrix, _ = affine({**weights, **others})
    mu = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0]
    if mu > 1e-9:
        assert platoon_game(n, **weights).affine
    if mu < 1e-15:
        with pytest.raises(InvalidInput, match="F must be strongly monotone"):
            platoon_game(n, **weights)


@given(count=st.integers(2, 60))
def test_a_leader_that_weighs_half_as_much_suffices_for_any_length(count):
    assert platoon_game(count, place_weight=[0.5, *[0.0] * (count - 1)]).agents == count
    with pytest.raises(
        InvalidInput
    ):  # mu > 0 needs 1/4 (1 + 1/(N - 1)) / ... of few, and 1/2 of all
        platoon_game(count, place_weight=[0.24, *[0.0] * (count - 1)])


# ------------------------------------------------------------------------- what is shown of it


def test_names_quantities_and_shares():
    game = platoon_game(3, [0.5, 1.0], [2.5, 3.0], leader_range=(-2.0, 4.0))
    assert game.constraint_names == (
        "least place of agent 1", "least spacing of agents 1 and 2",
        "least spacing of agents 2 and 3", "greatest place of agent 1",
        "greatest spacing of agents 1 and 2", "greatest spacing of agents 2 and 3",
    )  # fmt: skip
    spacing, place = game.quantities
    y = np.array([[2.5, 1.0, -1.9]])
    np.testing.assert_allclose(spacing.at(y, (3,)), [[np.nan, 1.5, 2.9]])
    np.testing.assert_allclose(spacing.bounds((3,))["spacing_bound"], [np.nan, 2.5, 3.0])
    np.testing.assert_allclose(spacing.bounds((3,))["spacing_lower_bound"], [np.nan, 0.5, 1.0])
    np.testing.assert_allclose(place.at(y, (3,)), [[2.5, np.nan, np.nan]])
    values = {"action": y, "spacing": spacing.at(y, (3,)), "leader_place": place.at(y, (3,))}
    np.testing.assert_allclose(shares(game, values), [[0.5, 0.0, 0.9]])
    assert len(platoon_game(1).quantities) == 1


def test_the_default_start_is_inside():
    for table in (PlatoonTable(type="platoon"),
                  PlatoonTable(type="platoon", least_spacing=[1.0, 2.0], greatest_spacing=2.5,
                               leader_range=(3.0, 4.0))):  # fmt: skip
        game, start = table.build(3), table.default_start(3)
        assert np.all(game.constraints(start) < -0.1)


# ---------------------------------------------------------------------------------------- runs

START = [2.0, 1.15, -1.8, -2.7, -5.6]  # two spacings near 0.8 m, two near 3 m
LAWS = {
    "full": FullInformation(),
    "partial": PartialInformation(graphs.ring(5), coupling=12.0, time_constant=0.1),
    "distributed": FullyDistributed(graphs.ring(5), 5e-3, 1.0),
}


@pytest.mark.parametrize("law", LAWS)
def test_integrators_stay_inside_and_settle_under_every_law(law):
    game = platoon_game(5, desired_spacing=[2.0, 3.5, 0.5, 1.0])
    system = System("fleet", game, integrators(5), LAWS[law], 0.05, np.array(START)[:, None])
    run = Simulation([system], clock(0.002, 20.0, sample=0.5)).run()
    report = run.reports["fleet"]
    assert report["status"] == "converged"
    assert report["worst_constraint"]["margin"] > 0
    bounds = run["fleet"]["spacing_bound"].values
    spacing = run["fleet"]["spacing"].values[:, 1:]
    assert np.all((spacing > 0.8) & (spacing < bounds[1:]))


def test_a_scenario_is_certified_runs_and_is_drawn():
    tables = {
        "simulation": {"duration": 0.5, "timestep": 0.01},
        "systems": {"fleet": {"game": {"type": "platoon", "greatest_spacing": [3.0, 2.0]},
                              "agents": {"type": "integrator", "count": 3}}},
    }  # fmt: skip
    (system,) = load_scenario(tables).system_objects()
    report = certify(system, clock(0.01, 0.5))
    assert {a["label"]: a["status"] for a in report.theorem["assumptions"]} == {
        "asmp:cost": "met", "asmp:pseudo(a)": "met", "asmp:nonlinearPlant": "met",
    }  # fmt: skip
    matrix = system.game.pseudo_gradient_jacobian(system.start)
    mu = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0]
    assert report.constants["mu"]["value"] == pytest.approx(mu, rel=1e-12)
    run = load_scenario(tables).simulation_object().run()
    assert run.status == "completed"
    assert set(plots.draw(run)) >= {"fleet-positions", "fleet-spacings", "fleet-leader-places"}


# ------------------------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    ("key", "bad", "words"),
    [
        ("agents", 0, "one at least"),
        ("agents", 20_001, "at most 20000"),
        ("least_spacing", [1.0], "a list of 2, one for each pair of neighbours"),
        ("least_spacing", np.nan, "finite"),
        ("greatest_spacing", [2.0, 2.0, 2.0], "a list of 2"),
        ("greatest_spacing", [2.0, 0.8], "above the least one"),
        ("greatest_spacing", np.inf, "finite"),
        ("desired_spacing", [np.inf, 1.0], "finite"),
        ("spacing_weight", -1.0, "not negative"),
        ("spacing_weight", [1.0, 9.0], "F must be strongly monotone"),
        ("desired_place", [0.0, 1.0], "a list of 3, one for each agent"),
        ("place_weight", [1.0, -1.0, 0.0], "not negative"),
        ("leader_range", (1.0, 1.0), "the first one below"),
        ("leader_range", (0.0, np.inf), "two finite numbers"),
        ("leader_range", 3.0, "two finite numbers"),
    ],
)
def test_bad_numbers(key, bad, words):
    with pytest.raises(InvalidInput, match=words) as caught:
        platoon_game(**{"agents": 3, key: bad})
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"greatest_spacing": 0.5}, r"systems\.s\.game\.greatest_spacing: got 0\.5, but every one"),
        ({"spacing_weight": 9.0}, r"systems\.s\.game\.spacing_weight: got 9\.0, but F must be"),
        ({"spacing": 1.0}, r"game\.spacing"),
        ({"leader_range": [1.0]}, r"game\.leader_range"),
    ],
)
def test_bad_numbers_in_a_scenario_name_the_key(changes, words):
    game = {"type": "platoon", **changes}
    tables = {"systems": {"s": {"game": game, "agents": {"type": "integrator", "count": 3}}}}
    with pytest.raises(InvalidInput, match=words):
        load_scenario(tables).simulation_object()
