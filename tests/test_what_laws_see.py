"""What each agent may and may not see: what is hidden from it changes no bit of its action."""

import numpy as np
import pytest
from builders import UNEQUAL, V0, random_robot_state, robot_state, robot_system, robots, run_loop
from law_cases import COUPLING, EPSILON, GAIN, RHO, TAU, act, act_partially, case, draw, step

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation

DISTRIBUTED_NETWORKS = pytest.mark.parametrize(
    ("kind", "count", "graph"),
    [("velocity", 5, "line"), ("osnr", 10, "ring"), ("osnr", 10, "printed")],
)


@DISTRIBUTED_NETWORKS
def test_a_distributed_action_depends_on_what_the_agent_has(kind, count, graph):
    """Its own action, filter and estimates: no one else's, no true profile, no true barrier."""
    now, law = case(kind, count), FullyDistributed(graphs.NAMED[graph](count), EPSILON, GAIN)
    y, estimates, z = draw(now)
    _, u, *_ = act(now.game, law, y, estimates, z)
    for i in range(count):
        _, other_estimates, other_z = draw(now)
        other_y = np.full(count, np.nan)
        other_y[i], other_z[i], other_estimates[i] = y[i], z[i], estimates[i]
        other_estimates[i, i] = 1e3
        code, other_u, *_ = act(now.game, law, other_y, other_estimates, other_z)
        assert code == -1
        assert other_u[i] == u[i]
        assert not np.any(np.delete(other_u, i) == np.delete(u, i))


@DISTRIBUTED_NETWORKS
def test_distributed_rates_depend_on_neighbours_messages_only(kind, count, graph):
    """All that is not in a neighbour's message becomes NaN, and not a bit changes."""
    now, law = case(kind, count), FullyDistributed(graphs.NAMED[graph](count), EPSILON, GAIN)
    y, estimates, z = draw(now)
    _, _, estimates_rate, z_rate = act(now.game, law, y, estimates, z)
    assert np.all(np.isfinite(estimates_rate))
    for i in range(count):
        heard = np.flatnonzero(law.graph.laplacian[i] < 0)
        hidden_y, hidden = np.full(count, np.nan), np.full((count, count), np.nan)
        hidden_y[heard], hidden_y[i] = y[heard], y[i]
        hidden[heard], hidden[i] = estimates[heard], estimates[i]
        hidden[heard, i] = np.nan  # what others take agent i's action to be, it need not know
        hidden_z = np.full(count, np.nan)
        hidden_z[i] = z[i]
        _, _, rates, z_rates = act(now.game, law, hidden_y, hidden, hidden_z)
        assert np.array_equal(rates[i], estimates_rate[i])
        assert z_rates[i] == z_rate[i]


PARTIAL_NETWORKS = pytest.mark.parametrize(
    ("kind", "count", "graph"),
    [
        ("velocity", 5, "line"),
        ("velocity", 5, "ring"),
        ("osnr", 10, "line"),
        ("osnr", 10, "printed"),
    ],
)


@PARTIAL_NETWORKS
def test_a_partial_action_depends_on_what_the_agent_may_see(kind, count, graph):
    """y_i, the barrier of its own constraints, its estimates of agents in its cost, and what its
    neighbours take y_i to be; all else becomes NaN, and not a bit changes."""
    now = case(kind, count)
    game, law = now.game, PartialInformation(graphs.NAMED[graph](count), COUPLING, TAU)
    y, estimates, _ = draw(now)
    weights = RHO / -game.constraints(y)
    u, _ = act_partially(game, law, y, weights, estimates)
    assert np.all(np.isfinite(u))
    for i in range(count):
        heard = np.flatnonzero(law.graph.laplacian[i] < 0)
        shared = [l for l, members in enumerate(game.in_constraint) if i in members]  # noqa: E741
        measured = sorted({i}.union(*(game.in_constraint[l] for l in shared)))  # noqa: E741
        seen_weights, seen_y = np.full(len(weights), np.nan), np.full(count, np.nan)
        seen_weights[shared], seen_y[measured] = weights[shared], y[measured]
        measurement = np.full((count, count), np.nan)
        costly = [j for j in game.in_cost[i] if j != i]
        measurement[i, costly] = estimates[i, costly]
        measurement[heard, i] = estimates[heard, i]
        other_u, _ = act_partially(game, law, seen_y, seen_weights, measurement)
        assert other_u[i] == u[i]
        # and it does depend on each of these
        for j in costly:
            changed = estimates.copy()
            changed[i, j] += 0.01
            assert act_partially(game, law, y, weights, changed)[0][i] != u[i]
        for j in heard:
            changed = estimates.copy()
            changed[j, i] += 0.01
            assert act_partially(game, law, y, weights, changed)[0][i] != u[i]


@PARTIAL_NETWORKS
def test_partial_rates_depend_on_neighbours_messages_only(kind, count, graph):
    """Neighbours' rows, with their own actions in place; not even the agent's own action."""
    now = case(kind, count)
    game, law = now.game, PartialInformation(graphs.NAMED[graph](count), COUPLING, TAU)
    y, estimates, _ = draw(now)
    unknown = np.full(game.constraints_count, np.nan)
    _, rates = act_partially(game, law, y, unknown, estimates)
    for i in range(count):
        heard = np.flatnonzero(law.graph.laplacian[i] < 0)
        seen_y, measurement = np.full(count, np.nan), np.full((count, count), np.nan)
        seen_y[heard], measurement[heard], measurement[i] = y[heard], estimates[heard], estimates[i]
        measurement[heard, i] = np.nan
        _, other = act_partially(game, law, seen_y, unknown, measurement)
        assert np.array_equal(other[i], rates[i])
        assert np.all(np.isfinite(other[i]))


def test_full_information_sees_outputs_only():
    rng = np.random.default_rng(7)
    delta = np.full(5, 3.0)
    for engine in ("ode", "mujoco"):
        for _ in range(5):
            y = random_robot_state(rng, delta)[:, 1]
            states = [
                robot_state(y, rng.uniform(-3, 3, 5), rng.uniform(-9, 9, 5), rng.uniform(-9, 9, 5))
                for _ in range(2)
            ]
            inputs = [
                run_loop(robot_system(state, numbers=UNEQUAL, engine=engine), 1e-3, 1)[1][0]
                for state in (*states, robot_state(y))
            ]
            assert np.array_equal(inputs[0], inputs[1])
            assert np.array_equal(inputs[0], inputs[2])
    assert robots(UNEQUAL).states == 4


def test_a_robot_feels_its_predecessor_and_its_follower_only():
    now = case("velocity", 5)
    y = V0 + np.cumsum([0.2, -0.3, 0.1, 0.25, -0.2])
    u, _ = step(now.game, FullInformation(), y, np.zeros(0))
    for changed in range(5):
        other = y.copy()
        other[changed] += 0.01
        new, _ = step(now.game, FullInformation(), other, np.zeros(0))
        assert set(np.flatnonzero(new != u)) == {i for i in range(5) if abs(i - changed) <= 1}
