"""Velocity consensus with leaders over random graphs, against the slow oracle and by itself."""

from fractions import Fraction

import numpy as np
import pytest
from builders import random_consensus, relative_error
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

import reference
from gne_mj.barrier import LogBarrier
from gne_mj.equilibrium import penalised_equilibrium, variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_consensus_game, velocity_game

RHO = 0.1
seeds = st.integers(0, 2**32 - 1)
dimensions = st.integers(1, 4)


def assert_equal_to_rounding(got, expected):
    expected = np.asarray(expected)
    assert got.shape == expected.shape
    scale = np.max(np.abs(expected), initial=1e-300)
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-13 * scale)


@given(seed=seeds, dimension=dimensions)
def test_values_equal_the_reference(seed, dimension):
    draw = random_consensus(seed, dimension)
    game, oracle = draw.game, draw.oracle
    assert (game.agents, game.actions) == (oracle.agents, oracle.N)
    assert game.constraints_count == len(game.constraint_names) == oracle.p
    for _ in range(3):
        y = draw.interior()
        assert_equal_to_rounding(game.costs(y), [oracle.cost(i, y) for i in range(oracle.agents)])
        assert_equal_to_rounding(game.pseudo_gradient(y), reference.pseudo_gradient(oracle, y))
        scale = oracle.delta**2  # what a value is the difference of
        g = game.constraints(y)
        assert np.all(np.abs(g - reference.constraints(oracle, y)) <= 1e-14 * scale)
        assert np.all(g < 0)
        (quantity,) = game.quantities
        gaps = quantity.at(y[None], game.entries(quantity))[0]
        expected = [np.linalg.norm(oracle.gap(k, y)) for k in range(oracle.p)]
        assert_equal_to_rounding(gaps, expected)
        assert np.array_equal(quantity.bounds(game.entries(quantity))["gap_bound"], oracle.delta)


@given(seed=seeds, dimension=dimensions)
def test_derivatives_equal_the_complex_step(seed, dimension):
    draw = random_consensus(seed, dimension)
    game, oracle, y = draw.game, draw.oracle, draw.interior()
    weights = draw.rng.uniform(-2, 2, oracle.p)

    def weighted(point):
        return sum(w * oracle.constraint_gradient(k, point) for k, w in enumerate(weights))

    pairs = [
        (game.pseudo_gradient_jacobian(y), reference.pseudo_gradient_jacobian(oracle, y)),
        (
            game.constraint_jacobian(y),
            reference.complex_step_jacobian(lambda x: reference.constraints(oracle, x), y),
        ),
        (
            game.weighted_constraint_hessian(y, weights),
            reference.complex_step_jacobian(weighted, y),
        ),
    ]
    for got, expected in pairs:
        assert_equal_to_rounding(got, expected)
    assert relative_error(
        LogBarrier(game, RHO).gradient(y), reference.barrier_gradient(oracle, RHO, y)
    ) < 1e-11  # fmt: skip


@given(seed=seeds, dimension=dimensions)
def test_what_the_game_says_of_itself(seed, dimension):
    """F is affine, symmetric and strongly monotone; index lists are the derivatives' sparsity."""
    draw = random_consensus(seed, dimension)
    game, y = draw.game, draw.interior()
    jacobian = game.pseudo_gradient_jacobian(y)
    assert game.affine
    assert np.array_equal(jacobian, game.pseudo_gradient_jacobian(draw.interior()))
    assert np.array_equal(jacobian, jacobian.T)
    assert np.linalg.eigvalsh(jacobian)[0] > 1e-3  # the least over all draws is far above
    owner = game.agent_of_action
    for i, members in enumerate(game.in_cost):
        assert set(owner[np.flatnonzero(jacobian[owner == i].any(axis=0))]) == set(members)
    for k, members in enumerate(game.in_constraint):
        assert set(owner[np.flatnonzero(game.constraint_jacobian(y)[k])]) == set(members)
    assert game.affine_constraints == (2 * draw.oracle.p if dimension == 1 else None)


@given(seed=seeds)
def test_the_box_is_the_least_one(seed):
    """On a line (d = 1) the set is a polytope, whose extents linear programs tell."""
    draw = random_consensus(seed, 1)
    oracle, (lower, upper) = draw.oracle, draw.game.box
    zero = np.zeros(oracle.N)
    rows = np.array([reference.complex_step_jacobian(lambda x, k=k: oracle.gap(k, x), zero)[0]
                     for k in range(oracle.p)])  # fmt: skip
    offsets = np.array([oracle.gap(k, zero)[0] for k in range(oracle.p)])
    both = np.vstack([rows, -rows])
    limit = np.concatenate([oracle.delta - offsets, oracle.delta + offsets])
    for a in range(oracle.N):
        for sign, expected in ((1, lower[a]), (-1, upper[a])):
            objective = sign * np.eye(oracle.N)[a]
            found = linprog(objective, A_ub=both, b_ub=limit, bounds=(None, None))
            assert sign * found.fun == pytest.approx(expected, abs=1e-9)


@given(seed=seeds, dimension=dimensions)
def test_interior_profiles_are_in_the_box(seed, dimension):
    draw = random_consensus(seed, dimension)
    lower, upper = draw.game.box
    for _ in range(20):
        y = draw.interior()
        assert np.all((lower < y) & (y < upper))


@given(seed=seeds, dimension=dimensions)
def test_everyone_ends_at_the_reference(seed, dimension):
    draw = random_consensus(seed, dimension)
    expected = np.tile(draw.oracle.v0, draw.oracle.agents)
    start = draw.interior()
    for solve in (
        lambda: penalised_equilibrium(draw.game, RHO, start),
        lambda: variational_equilibrium(draw.game, start),
    ):
        assert np.allclose(solve().action, expected, rtol=0, atol=1e-9)


@given(seed=seeds, count=st.integers(1, 6))
def test_a_chain_has_the_papers_constraints(seed, count):
    """In one dimension, along a line led by agent 1, the set is that of [eq:sensorNetGNE]."""
    rng = np.random.default_rng(seed)
    v0, delta = rng.uniform(-3, 3), rng.uniform(0.3, 4, count)
    edges = [(i, i - 1) for i in range(1, count)]
    game = velocity_consensus_game(edges, np.eye(count)[0], [v0], delta[1:], delta[:1])
    chain = velocity_game(count, v0, delta)
    y = v0 + np.cumsum(rng.uniform(-1.2, 1.2, count) * delta)
    assert np.array_equal(np.roll(game.constraints(y), 1), chain.constraints(y))
    for got, expected in zip(game.box, chain.box, strict=True):
        assert np.allclose(got, expected, rtol=1e-14, atol=0)


def test_few_digits_are_lost_close_to_the_bound():
    """With v_0 = 0 nothing is lost before; against exact fractions and the plain formula."""
    delta, game = 3.0, velocity_consensus_game([], [1.0], [0.0, 0.0], 1.0, 3.0)
    errors, plain = [], []
    for angle in np.linspace(0, 2 * np.pi, 101):
        for short in 10.0 ** -np.arange(1, 15):
            x, y = (delta - short) * np.array([np.cos(angle), np.sin(angle)])
            exact = Fraction(x) ** 2 + Fraction(y) ** 2 - Fraction(delta) ** 2
            errors.append(abs(float(Fraction(game.constraints([x, y])[0]) - exact)))
            plain.append(abs(float(Fraction(x**2 + y**2 - delta**2) - exact)))
    assert max(errors) <= 1.5e-16 * delta**2
    assert np.mean(errors) < 0.4 * np.mean(plain)


def test_names_and_numbers():
    game = velocity_consensus_game([(1, 2), (0, 1)], [0.0, 2.0, 0.0], [1.0, 2.0], [1.0, 2.0], 3.0)
    assert game.constraint_names == (
        "gap of agents 2 and 3", "gap of agents 1 and 2", "gap of agent 2 to v_0"
    )  # fmt: skip
    assert game.gap_bounds.tolist() == [1.0, 2.0, 3.0]
    assert game.axis_of_action == ("x", "y") * 3
    lower, upper = game.box
    assert upper.tolist() == [6.0, 7.0, 4.0, 5.0, 5.0, 6.0]
    assert lower.tolist() == [-4.0, -3.0, -2.0, -1.0, -3.0, -2.0]


GOOD = {
    "edges": [(0, 1), (1, 2)],
    "leader_weight": [1.0, 0.0, 1.0],
    "reference_velocity": [1.0, 0.0],
    "gap_bound": 1.0,
    "leader_gap_bound": 2.0,
}


@pytest.mark.parametrize(
    ("key", "bad", "words"),
    [
        ("edges", [(0, 3), (1, 2)], "numbered 1 to 3"),
        ("edges", [(0, 1), (1, 1)], "joins two agents"),
        ("edges", [(0, 1), (1, 2), (1, 0)], "once only"),
        ("leader_weight", [1.0, -1.0, 0.0], "negative"),
        ("leader_weight", [0.0, 0.0, 0.0], "agents 1, 2, 3 has none"),
        ("leader_weight", [1.0, np.nan, 0.0], "finite"),
        ("reference_velocity", [], "finite"),
        ("reference_velocity", [np.inf, 0.0], "finite"),
        ("gap_bound", [1.0, 1.0, 1.0], "2, one for each edge"),
        ("gap_bound", [1.0, 0.0], "positive"),
        ("leader_gap_bound", [1.0], "2, one for each leader"),
        ("leader_gap_bound", np.inf, "positive and finite"),
    ],
)
def test_bad_parameters(key, bad, words):
    assert velocity_consensus_game(**GOOD).constraints_count == 4
    with pytest.raises(InvalidInput, match=words) as caught:
        velocity_consensus_game(**{**GOOD, key: bad})
    assert caught.value.key == key


def test_a_part_without_a_leader_is_named():
    with pytest.raises(InvalidInput, match="that of agents 3, 4 has none"):
        velocity_consensus_game([(0, 1), (2, 3)], [1, 0, 0, 0], [0.0], 1.0, 1.0)
    with pytest.raises(InvalidInput, match="that of agent 3 has none"):
        velocity_consensus_game([(0, 1)], [1, 0, 0], [0.0], 1.0, 1.0)
