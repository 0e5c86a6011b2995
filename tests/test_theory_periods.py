"""Rules for control periods, against closed forms and eigenvalues of held integrators."""

import numpy as np
import pytest
from builders import (
    EQUAL,
    FIVE,
    UNEQUAL,
    V0,
    distributed,
    integrators,
    robot_state,
    robot_system,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from theory_systems import osnr, partial_robots

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed
from gne_mj.games import velocity_game
from gne_mj.system import System
from gne_mj.theory.periods import linear_period, push_period


def test_mobility_is_one_over_the_mass():
    system = robot_system(robot_state(FIVE), UNEQUAL)
    np.testing.assert_allclose(system.agents.mobility, 1 / np.array(UNEQUAL["main_mass"]))
    np.testing.assert_array_equal(osnr(distributed()).agents.mobility, np.ones(10))


def test_rules_for_one_robot_near_its_bound():
    numbers = {key: [2.0] for key in EQUAL}
    for distance in (1e-2, 1e-3):
        system = robot_system(robot_state([V0 - 3.0 + distance]), numbers, rho=0.1)
        assert push_period(system, system.start) == pytest.approx(3.0 * 2 * distance / 0.2)
        # 2 M d^2 / rho up to the rest of the barrier and F
        period = linear_period(system, system.start)
        assert period == pytest.approx(2 * 2.0 * distance**2 / 0.1, rel=10 * distance)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_linear_rule_is_where_held_integrators_become_unstable(seed):
    rng = np.random.default_rng(seed)
    game = velocity_game(4, V0, 3.0)
    system = System(
        "s", game, integrators(4), FullInformation(), 0.1, V0 + rng.uniform(-1, 1, (4, 1))
    )
    y = system.equilibrium.action
    period = linear_period(system, y)
    ours = reference_games.VelocityGame(V0, np.full(4, 3.0))
    matrix = reference.pseudo_gradient_jacobian(ours, y) + reference.barrier_hessian(ours, 0.1, y)
    for factor, stable in ((0.999, True), (1.001, False)):
        step = np.eye(4) - factor * period * matrix
        assert (np.max(np.abs(np.linalg.eigvals(step))) < 1) is np.bool_(stable)


def test_the_coupling_and_the_gain_shorten_the_period():
    plain = robot_system(robot_state(FIVE))
    assert linear_period(partial_robots(4.0), FIVE) < linear_period(plain, FIVE)
    strong = robot_system(robot_state(FIVE), law=FullyDistributed(graphs.ring(5), 0.01, 2.0))
    assert linear_period(strong, FIVE) == pytest.approx(linear_period(plain, FIVE) / 2)
    assert push_period(strong, FIVE) == pytest.approx(push_period(plain, FIVE) / 2)
