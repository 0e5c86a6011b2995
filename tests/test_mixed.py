"""Fleets of several agent types: every agent moves as it does among its like."""

import numpy as np
import pytest
from builders import (
    EQUAL,
    UNEQUAL,
    V0,
    clock,
    integrators,
    pi_cascades,
    relative_error,
    robots,
)
from hypothesis import given
from hypothesis import strategies as st

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.plants.ode import OdePlant
from gne_mj.scenario import load_scenario, run
from gne_mj.system import System

GROUPS = (robots(UNEQUAL, 7.0), integrators(2), pi_cascades(3, 2.0, 0.7))
FLEET = mixed.join(GROUPS)
# where a type's states lie among the fleet's four
COLUMNS = {flexible_robot: [0, 1, 2, 3], integrator: [1], pi_cascade: [1, 2]}
SLICES = (slice(0, 5), slice(5, 7), slice(7, 10))


def spread(states):
    """Each group's own states (channels, own) as the fleet's (10, 4)."""
    out = np.zeros((10, 4))
    for group, rows, own in zip(GROUPS, SLICES, states, strict=True):
        out[rows, COLUMNS[group.kind]] = own
    return out


def random_states(rng):
    return [rng.normal(0, 2, (group.channels, group.states)) for group in GROUPS]


def test_joining_keeps_numbers_order_and_limits():
    assert FLEET.channels == 10
    assert list(FLEET.parameters[:, 0]) == [0] * 5 + [1] * 2 + [2] * 3
    for group, rows in zip(GROUPS, SLICES, strict=True):
        width = group.parameters.shape[1]
        assert np.all(FLEET.parameters[rows, 1 : 1 + width] == group.parameters)
        assert np.all(FLEET.parameters[rows, 1 + width :] == 0.0)
        assert np.all(FLEET.input_limit[rows] == group.input_limit)
    for kind, own in mixed.by_type(FLEET.parameters):
        assert own.shape[1] == len(kind.PARAMETERS)


@pytest.mark.parametrize("method", ["rk4", "euler"])
def test_each_group_moves_as_it_does_alone(method):
    rng = np.random.default_rng(1)
    states, u = random_states(rng), rng.normal(0, 1, 10)
    fleet = OdePlant(FLEET, 0.01, method)
    fleet.reset(spread(states))
    fleet.step(u, 300)
    alone = []
    for group, rows, own in zip(GROUPS, SLICES, states, strict=True):
        plant = OdePlant(group, 0.01, method)
        plant.reset(own)
        plant.step(u[rows], 300)
        alone.append(plant.state)
    # the compiler may join a product and a sum in one and not in the other
    assert relative_error(fleet.state, spread(alone)) < 1e-14
    assert np.all(fleet.state[5:, [0, 3]] == 0.0), "what a type does not use stays zero"


@given(seed=st.integers(0, 2**32 - 1))
def test_storage_and_equilibrium_are_each_types_own(seed):
    rng = np.random.default_rng(seed)
    states, y = random_states(rng), rng.normal(0, 2, 10)
    rest = FLEET.equilibrium(y)
    own_rest = [g.equilibrium(y[rows]) for g, rows in zip(GROUPS, SLICES, strict=True)]
    assert np.all(rest == spread(own_rest))
    got = FLEET.storage(spread(states), rest)
    for group, rows, own, point in zip(GROUPS, SLICES, states, own_rest, strict=True):
        assert got[rows] == pytest.approx(group.storage(own, point), rel=1e-14)


def test_jacobian_by_finite_differences():
    rng = np.random.default_rng(3)
    step = 1e-6
    for q, x in zip(FLEET.parameters, spread(random_states(rng)), strict=True):

        def rate(at, q=q):
            out = np.full(4, np.nan)
            mixed.rate(q, at, 0.3, out)
            return out

        got = np.full((4, 4), np.nan)
        mixed.jacobian(q, x, got)
        columns = [(rate(x + d) - rate(x - d)) / (2 * step) for d in step * np.eye(4)]
        assert np.allclose(got, np.transpose(columns), rtol=0, atol=1e-8)


def test_passive_only_if_all_are():
    assert mixed.is_passive(FLEET.parameters)
    undamped = robots({**EQUAL, "damping": [1.0, 1.0, 0.0, 1.0, 1.0]})
    fast = Agents(pi_cascade, np.array([[1.0, 1.5]]), np.array([np.inf]))
    for bad in (undamped, fast):
        assert not bad.kind.is_passive(bad.parameters)
        assert not mixed.is_passive(mixed.join([*GROUPS, bad]).parameters)


def test_a_fleet_of_one_type_closes_the_loop_as_that_type_does():
    y = np.array([1.0, 0.0, -1.0, 0.5, 2.0])
    game = velocity_game(5, V0, 3.0)
    results = []
    for agents in (robots(UNEQUAL), mixed.join([robots(UNEQUAL)])):
        system = System("s", game, agents, FullInformation(), 0.1, agents.equilibrium(y))
        loop = system.closed_loop(clock(0.01))
        results.append(loop.advance(400, 1))
    assert relative_error(results[1].state, results[0].state) < 1e-13
    assert relative_error(results[1].input, results[0].input) < 1e-13


def scenario(**changes):
    return {
        "simulation": {"duration": 60.0, "timestep": 0.01},
        "systems": {
            "all": {
                "game": {"type": "velocity-synchronization", "gap_bound": 2.0},
                "agents": {
                    "type": "mixed",
                    "groups": [
                        {"type": "flexible-robot", "count": 2, "main_mass": [1.0, 2.0]},
                        {"type": "integrator", "count": 1, "input_limit": 9.0},
                        {"type": "pi-cascade", "count": 1},
                    ],
                },
                **changes,
            }
        },
    }


def test_a_mixed_scenario_converges():
    trajectory = run(scenario())
    data = trajectory["all"]
    assert trajectory.status == "converged"
    assert list(data["component"].values) == ["extension", "output", "second", "position"]
    assert np.allclose(data["action"][-1], V0, rtol=0, atol=1e-3)
    assert np.all(data["action"][0] == V0 - 1.0), "half a bound below the reference"
    assert trajectory.reports["all"]["lyapunov"]["claimed"]
    assert trajectory.reports["all"]["lyapunov"]["monotone"]
    assert trajectory.reports["all"]["actuators"]["limits"][2] == 9.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"agents": {"type": "mixed"}},
            "systems.all.agents.groups: nothing is given, but this key must be given",
        ),
        ({"agents": {"type": "mixed", "groups": []}}, "systems.all.agents.groups: got"),
        (
            {"agents": {"type": "mixed", "groups": [{"type": "robot", "count": 1}]}},
            r"systems.all.agents.groups.0.type: got 'robot', but did you mean 'flexible-robot'",
        ),
        (
            {
                "agents": {
                    "type": "mixed",
                    "groups": [{"type": "integrator", "count": 1, "mass": 1}],
                }
            },
            r"systems.all.agents.groups.0.mass: got 1, but there is no such key",
        ),
        (
            {
                "agents": {
                    "type": "mixed",
                    "groups": [
                        {"type": "integrator", "count": 1},
                        {"type": "pi-cascade", "count": 2, "decay_rate": [1.0]},
                    ],
                }
            },
            r"systems.all.agents.groups.1.decay_rate: got \[1.0\].* a list of 2",
        ),
        ({"plant": {"engine": "mujoco"}}, "systems.all.plant.engine.*mixed fleets on 'ode'"),
        ({"initial": {"integral": 1.0}}, "systems.all.initial.integral.*mixed fleets have no"),
        ({"initial": {"action": [1.0]}}, "systems.all.initial.action.*a list of 4"),
    ],
)
def test_mistakes(changes, message):
    with pytest.raises(InvalidInput, match=message):
        load_scenario(scenario(**changes)).simulation_object()


def test_shapes():
    with pytest.raises(ValueError, match="y must be"):
        FLEET.equilibrium(np.zeros(9))
    with pytest.raises(InvalidInput, match="parameters"):
        Agents(mixed, np.zeros((3, 5)), np.ones(3))
