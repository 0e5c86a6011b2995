"""Games from expressions against hand-written kernels, differences and refusals."""

import numpy as np
import pytest
from expression_games import PAIRS
from random_expressions import RandomGame, hyper_dual

from gne_mj.expressions import fixed, game


def _interior(game, rng):
    """A random profile; OSNR's powers are positive."""
    y = rng.uniform(0.1, 1.0, game.actions)
    return y if game.name == "OSNR" else 3.0 * rng.normal(size=game.actions)


def _agree(got, expected):
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", PAIRS)
def test_the_same_numbers_as_hand_written_kernels(name):
    own, shipped = PAIRS[name]()
    rng = np.random.default_rng(3)
    assert [sorted(a) for a in own.in_cost] == [sorted(a) for a in shipped.in_cost]
    assert [sorted(a) for a in own.in_constraint] == [sorted(a) for a in shipped.in_constraint]
    assert own.affine == shipped.affine
    assert own.constraint_class == shipped.constraint_class
    for _ in range(30):
        y = _interior(shipped, rng)
        weights = rng.uniform(0.1, 1.0, shipped.constraints_count)
        for method in ("costs", "pseudo_gradient", "constraints", "pseudo_gradient_jacobian",
                       "constraint_jacobian"):  # fmt: skip
            _agree(getattr(own, method)(y), getattr(shipped, method)(y))
        _agree(
            own.weighted_constraint_hessian(y, weights),
            shipped.weighted_constraint_hessian(y, weights),
        )


def random_error(seed):
    """The worst relative error of a random game's six functions against hyper-dual numbers."""
    drawn = RandomGame(seed)
    made = game(drawn.count, drawn.cost, drawn.constraints, near=fixed(drawn.near), **drawn.numbers)
    q, y, p, kernels = made.parameters, drawn.y, drawn.plain(), made.kernels
    errors = []

    def compare(got, expected):
        errors.append(abs(got - expected) / (1.0 + abs(expected)))

    for i in range(drawn.count):
        row = np.zeros(drawn.count)
        kernels.add_cost_hessian(q, i, i, y, 1.0, row)
        compare(kernels.cost(q, i, y), drawn.cost(i, y, p))
        for b in range(drawn.count):
            _, first, second = hyper_dual(lambda z, i=i: drawn.cost(i, z, p), y, i, b)
            compare(row[b], second)
        compare(kernels.cost_gradient(q, i, i, y), first)
        for a in made.in_constraint[i]:
            for b in made.in_constraint[i]:
                f, first, second = hyper_dual(lambda z, i=i: drawn.g(i, z, p), y, a, b)
                compare(kernels.constraint_hessian(q, i, a, b, y), second)
            compare(kernels.constraint(q, i, y), f)
            compare(kernels.constraint_gradient(q, i, a, y), first)
        for a in set(range(drawn.count)) - set(made.in_constraint[i]):
            compare(hyper_dual(lambda z, i=i: drawn.g(i, z, p), y, a, a)[1], 0.0)
    return max(errors)


@pytest.mark.parametrize("seed", range(12))
def test_random_games_have_the_derivatives_of_hyper_dual_numbers(seed):
    assert random_error(seed) < 1e-11


@pytest.mark.slow
def test_two_hundred_random_games():
    assert max(random_error(seed) for seed in range(200)) < 1e-11
