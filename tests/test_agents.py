"""Agents and plants: rates, Jacobians, storage functions and passivity."""

import numpy as np
import pytest
from builders import (
    UNEQUAL,
    integrators,
    pi_cascades,
    position_robots,
    reference_pi,
    reference_position_robots,
    reference_robots,
    robots,
)
from hypothesis import given
from hypothesis import strategies as st
from reference_agents import Integrator

import reference
from gne_mj.errors import InvalidInput
from gne_mj.plants import (
    agent_type,
    flexible_robot,
    integrator,
    mixed,
    mjcf_robot,
    pi_cascade,
    position_robot,
)
from gne_mj.plants.agents import Agents
from gne_mj.plants.fleet_plant import FleetPlant, build_fleet
from gne_mj.plants.ode import OdePlant

KINDS = {
    "integrator": (integrators(5), Integrator(), 1),
    "pi cascade": (pi_cascades(5, 1.3, 0.6), reference_pi(5, 1.3, 0.6), 2),
    "robot": (robots(UNEQUAL), reference_robots(UNEQUAL), 3),
    "position robot": (position_robots(UNEQUAL), reference_position_robots(UNEQUAL), 4),
}


@pytest.fixture(params=KINDS)
def kind(request):
    return KINDS[request.param]


def rate(agents, state, u):
    out = np.zeros_like(state)
    for r in range(agents.channels):
        agents.kind.rate(agents.parameters[r], state[r], u[r], out[r])
    return out


def test_rates_equal_the_reference(kind):
    agents, oracle, states = kind
    rng = np.random.default_rng(0)
    for _ in range(100):
        state, u = rng.normal(0, 3, (5, agents.states)), rng.normal(0, 3, 5)
        expected = oracle.rate(state[:, :states], u)
        assert np.allclose(rate(agents, state, u)[:, :states], expected, rtol=1e-12, atol=1e-12)


def test_jacobians_by_finite_differences(kind):
    agents, _, _ = kind
    rng = np.random.default_rng(1)
    for _ in range(20):
        state, u, n = rng.normal(0, 2, (5, agents.states)), rng.normal(0, 3, 5), agents.states
        for r in range(5):
            jacobian, numeric = np.zeros((n, n)), np.zeros((n, n))
            agents.kind.jacobian(agents.parameters[r], state[r], jacobian)
            for s in range(n):
                step = np.zeros_like(state)
                step[r, s] = 1e-5
                difference = rate(agents, state + step, u) - rate(agents, state - step, u)
                numeric[:, s] = difference[r] / 2e-5
            assert np.allclose(jacobian, numeric, atol=1e-8)


def test_rates_are_affine_in_the_input(kind):
    agents, _, _ = kind
    state = np.random.default_rng(2).normal(0, 2, (5, agents.states))
    zero, one, two = (rate(agents, state, np.full(5, u)) for u in (0.0, 1.0, 2.0))
    assert np.allclose(two - one, one - zero, atol=1e-12)
    assert np.all((one - zero)[:, agents.kind.OUTPUT] > 0)


def test_arrays_of_a_wrong_shape_are_refused(kind):
    agents, _, _ = kind
    with pytest.raises(InvalidInput, match="input_limit"):
        Agents(agents.kind, agents.parameters, np.array([1.0]))
    with pytest.raises(InvalidInput, match="parameters"):
        Agents(agents.kind, np.zeros((5, 7)), np.full(5, np.inf))
    with pytest.raises(ValueError, match="y must be"):
        agents.equilibrium(np.zeros(4))
    with pytest.raises(ValueError, match="states must be"):
        agents.storage(np.zeros((5, agents.states)), np.zeros((4, agents.states)))
    with pytest.raises(ValueError, match="could not be broadcast"):
        OdePlant(agents, 0.01).step(np.zeros(6))


def test_equilibria_rest_and_storage_equals_the_reference(kind):
    agents, oracle, states = kind
    rng = np.random.default_rng(3)
    y = rng.normal(0, 2, 5)
    rest = agents.equilibrium(y)
    assert np.allclose(rest[:, agents.kind.OUTPUT], y)
    assert np.allclose(rate(agents, rest, np.zeros(5))[:, :states], 0, atol=1e-12)
    assert np.allclose(rest[:, :states], oracle.equilibrium(y))
    for _ in range(20):
        state = rng.normal(0, 2, (5, agents.states))
        got = agents.storage(state, rest).sum()
        expected = np.sum(oracle.storage(state[:, :states], oracle.equilibrium(y)))
        assert got == pytest.approx(expected, rel=1e-11)


@given(
    seed=st.integers(0, 2**32 - 1),
    scale=st.sampled_from([0.1, 1.0, 10.0]),
)
def test_equilibrium_independent_passivity(seed, scale):
    """dV/dt <= (y - y*) u along the flow, for any equilibrium, state and input [eq:EIP]."""
    rng = np.random.default_rng(seed)
    for agents, _, _ in KINDS.values():
        y, u = rng.normal(0, scale, 5), rng.normal(0, scale, 5)
        rest = agents.equilibrium(y)
        state = rest + rng.normal(0, scale, rest.shape)
        velocity = rate(agents, state, u)
        h = 1e-6
        ahead = agents.storage(state + h * velocity, rest)
        behind = agents.storage(state - h * velocity, rest)
        change = (ahead - behind) / (2 * h)
        supply = (state[:, agents.kind.OUTPUT] - y) * u
        assert np.all(change <= supply + 1e-5 * (1 + scale) ** 3)


def test_plants_step_by_the_same_rates(kind):
    agents, oracle, states = kind
    plant = OdePlant(agents, 0.01)
    start = np.random.default_rng(4).normal(0, 1, (5, agents.states))
    plant.reset(start)
    u = np.array([1.0, -2.0, 0.5, 0.0, 3.0])
    plant.step(u, 200)
    held = reference.held_input_rate(oracle, 5)

    def flat(time, x):
        return held(time, x, u)

    expected = reference.rk4_fixed(flat, start[:, :states].ravel(), 0.01, 200)[-1]
    got = plant.state[:, :states].ravel()
    assert np.allclose(got, expected, rtol=1e-11, atol=1e-11)
    assert np.array_equal(plant.output, plant.state[:, agents.kind.OUTPUT])


@pytest.mark.parametrize(
    "kind", [flexible_robot, position_robot, mjcf_robot, integrator, pi_cascade, mixed]
)
def test_a_type_with_bodies_names_the_module_of_its_fleets(kind):
    module = agent_type.fleet_module(kind)
    assert (module is not None) == agent_type.in_mujoco(kind)
    assert agent_type.in_mujoco(kind) == (kind in (flexible_robot, position_robot, mjcf_robot))
    if module is None:
        agents = Agents(kind, np.zeros((2, len(kind.PARAMETERS))), np.full(2, np.inf))
        with pytest.raises(InvalidInput, match=rf"^agents: got '{kind.NAME}'.*no model in MuJoCo"):
            build_fleet(agents, 0.01)
    else:
        assert module.AGENT is kind
        assert issubclass(module.PLANT, FleetPlant)
    placed = agent_type.placed_state(kind)
    assert placed is None or placed in [name for name, _ in kind.STATES]
    assert (placed is not None) == (kind is flexible_robot)


def test_the_types_of_a_fleet_are_told_with_their_numbers():
    robot, point = np.arange(1.0, 6.0)[None], np.zeros((2, 0))
    fleet = mixed.join(
        [
            Agents(flexible_robot, robot, np.full(1, np.inf)),
            Agents(integrator, point, np.full(2, np.inf)),
        ]
    )
    (first, own), (second, none) = agent_type.by_type(fleet.kind, fleet.parameters)
    assert (first, second) == (flexible_robot, integrator)
    assert np.array_equal(own, robot)
    assert none.shape == (2, 0)
    ((kind, same),) = agent_type.by_type(flexible_robot, robot)
    assert kind is flexible_robot
    assert same is robot
