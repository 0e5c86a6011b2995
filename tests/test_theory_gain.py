"""Energy balances, the least gain and the rate of decay, against kernels and exact motions."""

import numpy as np
import pytest
import scipy.linalg
from builders import (
    FIVE,
    integrators,
    pi_cascades,
    robot_state,
    robot_system,
)
from hypothesis import given
from hypothesis import strategies as st
from theory_systems import monotone_slopes

from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade, position_robot
from gne_mj.theory.gain import decay_rate, least_beta, required_gain


@st.composite
def channels(draw):
    """An agent type, one channel's parameters, and two states and an input."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = draw(st.sampled_from([integrator, pi_cascade, flexible_robot, position_robot]))
    numbers = {
        integrator: lambda: np.zeros(0),
        pi_cascade: lambda: np.sort(rng.uniform(0.1, 3, 2))[::-1],
        flexible_robot: lambda: rng.uniform(0.1, 3, 5),
        position_robot: lambda: rng.uniform(0.3, 3, 8),
    }[kind]()
    return kind, numbers, rng.normal(size=len(kind.STATES)), rng.normal(size=2)


@given(channels())
def test_energy_balances_against_the_kernels(drawn):
    kind, q, x, (y, u) = drawn
    rest, rate = np.zeros(len(x)), np.zeros(len(x))
    kind.equilibrium(q, y, rest)
    kind.rate(q, x, u, rate)
    h = 1e-5
    storage_rate = (kind.storage(q, x + h * rate, rest) - kind.storage(q, x - h * rate, rest)) / (
        2 * h
    )
    storage, dissipation = (part[0] for part in kind.energy_balance(q[None]))
    e = (x - rest)[: len(storage)]
    balance = e[kind.OUTPUT] * u - e @ dissipation @ e
    assert storage_rate == pytest.approx(balance, rel=1e-6, abs=1e-6)
    bound = 0.5 * e @ storage @ e
    assert kind.storage(q, x, rest) <= bound * (1 + 1e-12)
    if kind not in (flexible_robot, position_robot):
        assert kind.storage(q, x, rest) == pytest.approx(bound, rel=1e-9, abs=1e-12)


def test_the_papers_pi_cascade():
    storage, dissipation = pi_cascade.energy_balance(np.array([[1.0, 0.5]]))
    np.testing.assert_allclose(storage[0], [[2, -1], [-1, 1]], rtol=1e-14)
    np.testing.assert_allclose(dissipation[0], [[2, -1], [-1, 0.5]], rtol=1e-14)


def test_the_least_beta():
    assert np.array_equal(least_beta(integrator.energy_balance(np.zeros((3, 0)))[1], 0), [0, 0, 0])
    assert least_beta(pi_cascade.energy_balance(np.array([[2.0, 0.3]]))[1], 0) == 0
    robot = flexible_robot.energy_balance(np.ones((1, 5)))[1]
    assert least_beta(robot, flexible_robot.OUTPUT) == np.inf
    assert least_beta(np.array([[[-0.3]]]), 0) == pytest.approx(0.3)
    short = np.array([[[0.1, 0.5], [0.5, 1.0]]])  # 0.1 + beta > 0.25
    assert least_beta(short, 0) == pytest.approx(0.15)


@given(monotone_slopes(), st.floats(0.05, 20))
def test_the_reduced_system_decays_at_least_at_the_rate_claimed(drawn, gain):
    """PI cascades, F linear: V along exact motions of x' = Ax - k G F(Cx)."""
    slope, _, agents, rng = drawn
    slope = slope[:agents, :agents]
    mu = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    v, k = 1.0, 0.5
    found = required_gain(pi_cascades(agents, v, k), mu, gain)
    assert found.least == 0
    eye, none = np.eye(agents), np.zeros((agents, agents))
    matrix = np.block([[-v * eye, k * eye], [none, none]])
    matrix -= gain * np.block([[slope, none], [slope, none]])
    storage = np.block([[2 * eye, -eye], [-eye, eye]])
    for time in (0.1, 1.0, 10.0):
        for x in rng.normal(size=(3, 2 * agents)):
            later = scipy.linalg.expm(time * matrix) @ x
            bound = np.exp(-found.decay_rate * time) * (x @ storage @ x)
            assert later @ storage @ later <= bound * (1 + 1e-9)


def test_integrators_decay_at_twice_k_mu():
    found = required_gain(integrators(3), 0.4, 0.7)
    assert (found.least, found.beta) == (0.0, 0.0)
    assert found.decay_rate == pytest.approx(2 * 0.7 * 0.4)
    assert found.alpha == pytest.approx(0.7 * 0.4)
    storage, dissipation = integrator.energy_balance(np.zeros((1, 0)))
    for k, rate in found.rates:
        assert rate == decay_rate(storage, dissipation, 0, 0.4 * k)


def test_fleets_in_which_one_type_fails():
    robots = robot_system(robot_state(FIVE)).agents
    fleet = mixed.join([robots, pi_cascades(2), integrators(1)])
    found = required_gain(fleet, 0.3, 1.0)
    assert found.fails == ("flexible robot",)
    assert found.least is None
    without = required_gain(mixed.join([pi_cascades(2), integrators(1)]), 0.3, 1.0)
    assert (without.fails, without.least) == ((), 0.0)
    assert without.decay_rate <= required_gain(pi_cascades(2), 0.3, 1.0).decay_rate
