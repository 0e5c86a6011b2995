"""Games from expressions against hand-written kernels, differences and refusals."""

import numpy as np
import pytest
from expression_games import PAIRS


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
