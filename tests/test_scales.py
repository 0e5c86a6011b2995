"""What the solver finds does not depend on the units of costs and constraints."""

import sys
from types import ModuleType

import coupled_game
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from gne_mj.equilibrium import measured_epsilon, penalised_equilibrium, variational_equilibrium
from gne_mj.game_model import Game
from gne_mj.games import cournot_game, osnr_game, velocity_game
from gne_mj.optimality import examine

CHANNELS = {
    "price": [1.0, 2.0, 1.5], "utility_weight": [2.0, 1.0, 3.0], "gain": [0.8, 0.5, 0.9],
    "noise_power": [0.1, 0.05, 0.2], "total_power_limit": 1.5,
    "system_matrix": [[0.0, 0.01, 0.02], [0.01, 0.0, 0.01], [0.03, 0.0, 0.0]],
}  # fmt: skip
COUPLED = Game(
    name="coupled", kernels=coupled_game, parameters=np.array([0.5]), sizes=coupled_game.SIZES,
    in_cost=[range(3)] * 3, in_constraint=coupled_game.IN_CONSTRAINT,
    constraint_names=("ball", "product"),
)  # fmt: skip
GAMES = {
    "channels": (osnr_game(**CHANNELS), np.full(3, 0.3)),
    "firms": (cournot_game(3), np.full(3, 20.0)),
    "robots": (velocity_game(3, 3.0, 0.5, [4.0, 3.2, 2.0], 2.0), np.full(3, 2.9)),
    "coupled": (COUPLED, np.array([0.3, -0.4, 0.5, -0.2])),
}


def scaled(game, cost, constraints):
    """The same game in other units, of plain functions around the kernels' Python."""
    own, q = game.kernels, np.asarray(game.parameters)
    module = ModuleType("scaled")
    module.cost = lambda _, i, y: cost * own.cost(q, i, y)
    module.cost_gradient = lambda _, i, a, y: cost * own.cost_gradient(q, i, a, y)
    module.add_cost_hessian = lambda _, i, a, y, scale, out: own.add_cost_hessian(
        q, i, a, y, cost * scale, out
    )
    module.constraint = lambda _, k, y: constraints[k] * own.constraint(q, k, y)
    module.constraint_gradient = lambda _, k, a, y: (
        constraints[k] * own.constraint_gradient(q, k, a, y)
    )
    module.constraint_hessian = lambda _, k, a, b, y: (
        constraints[k] * own.constraint_hessian(q, k, a, b, y)
    )
    return Game(
        name=game.name, kernels=module, parameters=np.zeros(1), sizes=game.sizes,
        in_cost=game.in_cost, in_constraint=game.in_constraint,
        constraint_names=game.constraint_names,
    )  # fmt: skip


@settings(max_examples=12)
@given(st.sampled_from(sorted(GAMES)), st.integers(-12, 12), st.integers(0, 2**32 - 1))
def test_units_of_costs_and_constraints_do_not_matter(name, exponent, seed):
    game, start = GAMES[name]
    cost = 10.0**exponent
    units = 10.0 ** np.random.default_rng(seed).uniform(-12, 12, game.constraints_count)
    other = scaled(game, cost, units)
    for rho, (one, two) in {
        0.05: [penalised_equilibrium(g, r, start) for g, r in ((game, 0.05), (other, 0.05 * cost))],
        0.0: [variational_equilibrium(g, start) for g in (game, other)],
    }.items():
        assert np.allclose(two.action, one.action, rtol=1e-9, atol=1e-12)
        back = two.multipliers * units / cost
        assert np.allclose(back, one.multipliers, rtol=1e-6 if rho else 1e-2, atol=1e-9)
        assert two.iterations <= one.iterations + 3
    found, expected = examine(other, two), examine(game, one)
    assert (found.active, found.weakly_active) == (expected.active, expected.weakly_active)
    gains = measured_epsilon(other, start) / cost
    assert np.allclose(gains, measured_epsilon(game, start), rtol=1e-6, atol=1e-9)


# A game of its own: (y_i - 3)^2 / 2 + y_i sum(y) / 10 below a sum of 4, in units that parameters
# set, and a bound that is a billionth of nothing.


def cost(q, i, y):
    return q[0] * (0.5 * (y[i] - 3.0) ** 2 + 0.1 * y[i] * sum(y))


def cost_gradient(q, i, a, y):
    return q[0] * ((y[i] - 3.0) + 0.1 * (y[i] + sum(y)))


def constraint(q, k, y):
    return q[1] * (sum(y) - 4.0) if k == 0 else q[2] * y[0] - 1.0


def constraint_gradient(q, k, a, y):
    return q[1] if k == 0 else (q[2] if a == 0 else 0.0)


@pytest.mark.parametrize("steep", [1e-15, 1e-3])
@pytest.mark.parametrize(("sc", "sg"), [(1, 1e12), (1e-12, 1), (1e12, 1e-12), (1e6, 1)])
def test_the_same_bound_binds_by_hand(sc, sg, steep):
    game = Game(
        name="units", kernels=sys.modules[__name__], parameters=np.array([sc, sg, steep]),
        sizes=(1,) * 3, in_cost=[range(3)] * 3, in_constraint=[range(3)] * 2,
        constraint_names=("sum", "flat"),
    )  # fmt: skip
    result = variational_equilibrium(game, np.full(3, 0.5))
    assert np.allclose(result.action, 4 / 3, rtol=1e-10)
    push = sc * (3.0 - 4 / 3 - 0.1 * (4 / 3 + 4.0))
    assert result.multipliers[0] == pytest.approx(push / sg, rel=1e-9)
    assert examine(game, result).active == (0,)


def one_agent(gradient, second, bounds, value=lambda y: 0.0):
    """Actions with J' (and J''), between bounds, none if infinite, as a game of plain functions."""
    module = ModuleType("own")
    low, high = bounds
    module.cost = lambda q, i, y: value(y[i])
    module.cost_gradient = lambda q, i, a, y: gradient(y[i])

    def add_cost_hessian(q, i, a, y, scale, out):
        out[a] += scale * second(y[i])

    module.add_cost_hessian = add_cost_hessian
    module.constraint = lambda q, k, y: low - y[0] if k == 0 else y[0] - high
    module.constraint_gradient = lambda q, k, a, y: -1.0 if k == 0 else 1.0
    module.constraint_hessian = lambda q, k, a, b, y: 0.0
    return Game(
        name="own", kernels=module, parameters=np.zeros(1), sizes=(1,), in_cost=[[0]],
        in_constraint=[[0], [0]], constraint_names=("low", "high"),
    )  # fmt: skip


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("push", [0.0, 1e-7, -1e-7])
def test_a_bound_with_a_multiplier_of_zero_is_found(unit, push):
    """J = (y/unit - 1 - push)^2 / 2 below y = unit: the path itself ends at sqrt(rho)."""
    game = one_agent(lambda y: (y / unit - 1.0 - push) / unit, lambda y: 1.0 / unit**2, (0.0, unit))
    result = variational_equilibrium(game, [0.3 * unit])
    assert 0.0 < 1.0 - result.action[0] / unit + min(push, 0.0) < 1e-9
    assert result.multipliers[1] * unit == pytest.approx(max(push, 0.0), abs=1e-9)
    found = examine(game, result)
    assert (found.active, found.weakly_active) == (
        ((1,), ()) if push > 0 else ((), (1,)) if push == 0 else ((), ())
    )


@pytest.mark.parametrize("start", [1e-17, 1e-9, 4.0 - 1e-12])
def test_a_start_by_a_pole_is_no_equilibrium(start):
    """J' = 1 - 0.3 / y is steep there, beside which everything seems small."""
    game = one_agent(lambda y: 1.0 - 0.3 / y, lambda y: 0.3 / y**2, (0.0, 4.0))
    assert variational_equilibrium(game, [start]).action[0] == pytest.approx(0.3, rel=1e-10)
    expected = brentq(lambda y: 1 - 0.3 / y - 0.1 / y + 0.1 / (4 - y), 1e-3, 3.0, xtol=1e-15)
    assert penalised_equilibrium(game, 0.1, [start]).action[0] == pytest.approx(expected, rel=1e-10)


def test_zero_is_as_good_a_place_as_any():
    """Nothing has a size there but the set; F is 3 - 3 + y with its rounding."""
    game = one_agent(lambda y: (y - 3.0) + 3.0, lambda y: 1.0, (-1.0, 1.0))
    for start in (0.0, 0.5, -0.999999):
        assert abs(variational_equilibrium(game, [start]).action[0]) < 1e-12
        assert abs(penalised_equilibrium(game, 0.1, [start]).action[0]) < 1e-12


def test_a_merely_monotone_game_has_some_equilibrium_found():
    """J_i = (y_1 + y_2 - 2)^2 with a bound on the sum: Newton's matrix has rank one everywhere."""
    module = ModuleType("flat")
    module.cost = lambda q, i, y: (y[0] + y[1] - 2.0) ** 2
    module.cost_gradient = lambda q, i, a, y: 2.0 * (y[0] + y[1] - 2.0)
    module.constraint = lambda q, k, y: y[0] + y[1] - 3.0
    module.constraint_gradient = lambda q, k, a, y: 1.0
    game = Game(
        name="flat", kernels=module, parameters=np.zeros(1), sizes=(1, 1), in_cost=[[0, 1]] * 2,
        in_constraint=[[0, 1]], constraint_names=("sum",),
    )  # fmt: skip
    for start in ([0.0, 0.0], [50.0, -60.0]):
        result = variational_equilibrium(game, start)
        assert np.sum(result.action) == pytest.approx(2.0, abs=1e-9)
        assert np.max(np.abs(result.action)) < 100.0
        assert abs(examine(game, result).monotonicity) < 1e-9


@pytest.mark.parametrize(
    ("matrix", "shift", "limit", "expected", "multiplier"),
    [
        # Harker 1991: the equilibrium (5, 9) lies inside
        ([[2.0, 8 / 3], [1.25, 2.0]], [34.0, 24.25], 15.0, [5.0, 9.0], 0.0),
        # Facchinei and Kanzow's A.11: (y_1 - 1)^2, (y_2 - 1/2)^2, y_1 + y_2 <= 1
        ([[2.0, 0.0], [0.0, 2.0]], [2.0, 1.0], 1.0, [0.75, 0.25], 0.5),
    ],
    ids=["Harker", "A.11"],
)
def test_known_games(matrix, shift, limit, expected, multiplier):
    matrix = np.array(matrix)
    module = ModuleType("known")
    module.cost = lambda q, i, y: (
        y[i] * (0.5 * matrix[i, i] * y[i] + matrix[i, 1 - i] * y[1 - i] - shift[i])
    )
    module.cost_gradient = lambda q, i, a, y: matrix[i] @ y - shift[i]
    module.constraint = lambda q, k, y: y[0] + y[1] - limit
    module.constraint_gradient = lambda q, k, a, y: 1.0
    game = Game(
        name="known", kernels=module, parameters=np.zeros(1), sizes=(1, 1), in_cost=[[0, 1]] * 2,
        in_constraint=[[0, 1]], constraint_names=("sum",),
    )  # fmt: skip
    result = variational_equilibrium(game, [0.1, 0.1])
    assert np.allclose(result.action, expected, rtol=1e-9)
    assert result.multipliers[0] == pytest.approx(multiplier, abs=1e-9)
    assert np.max(measured_epsilon(game, result.action)) < 1e-9
