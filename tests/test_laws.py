"""The compiled laws against their formulas, and what each agent may and may not see."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from builders import (
    FIVE,
    UNEQUAL,
    V0,
    distributed,
    integrators,
    random_robot_state,
    reference_osnr,
    robot_state,
    robot_system,
    robots,
    run_loop,
)

import reference
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed
from gne_mj.controllers.propagation import no_propagator
from gne_mj.errors import InvalidInput
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.ode import CONTINUOUS, Clock, OdeLoop
from gne_mj.native import compiled, source_key
from gne_mj.plants.ode import EULER, Channels

RHO, EPSILON, GAIN = 0.1, 0.05, 0.7
STATES = 100


def case(kind, count):
    """A game of the product, the same of the reference, and a drawer of interior profiles."""
    rng = np.random.default_rng(count)
    if kind == "velocity":
        delta = rng.uniform(0.5, 3, count)
        game, oracle = velocity_game(count, V0, delta), reference.VelocityGame(V0, delta)

        def interior(rows):
            return V0 + np.cumsum(rng.uniform(-0.95, 0.95, (rows, count)) * delta, axis=1)
    else:
        game, oracle = osnr_game(**ten_channels()), reference_osnr()

        def interior(rows):
            return oracle.power_limit * rng.dirichlet(np.full(count + 1, 3.0), rows)[:, :count]

    return SimpleNamespace(game=game, oracle=oracle, interior=interior, count=count)


CASES = [("velocity", 1), ("velocity", 2), ("velocity", 5), ("osnr", 10)]
NETWORKS = [
    *((kind, count, graph) for kind, count in CASES for graph in ("line", "ring", "complete")),
    ("osnr", 10, "printed"),
    ("osnr", 10, "caption"),
]


def problem_of(game, law, limit=np.inf):
    bounds = np.full(game.actions, limit)
    settings, y = law.settings(RHO), np.zeros(game.actions)
    return Problem(game.data, law.graph_data, settings, bounds, y, no_propagator())


def loop_at(game, law, y, memory, h=1.0):
    """The product's compiled loop of integrators (state y), Euler, at any state and memory."""
    agents = integrators(game.actions)
    channels = Channels(agents.parameters, np.zeros((game.actions, 1)))
    clock = Clock(h, 1, CONTINUOUS, EULER)
    return OdeLoop(
        agents.kind, law.kernels, game.kernels, problem_of(game, law), channels, clock,
        y.reshape(-1, 1), memory,
    )  # fmt: skip


def step(game, law, y, memory):
    """u and the memory's rate at a state: an Euler step of length 1 adds exactly one rate."""
    loop = loop_at(game, law, y, memory)
    first = loop.advance(1, 1)
    assert loop.monitor[watch.EXIT] == watch.INSIDE
    assert np.array_equal(first.state[0, :, 0], y)
    assert np.array_equal(first.memory[0], memory, equal_nan=True)
    last = loop.finish()
    u = first.input[0]
    assert np.array_equal(last.state[0, :, 0], y + u)
    return u, last.memory[0] - memory


def pack_memory(estimates, z):
    return np.concatenate([estimates.ravel(), z])


def draw(case):
    """y, and for every agent a filtered profile of its own inside: estimates and z."""
    y = case.interior(1)[0]
    estimates = case.interior(case.count)
    z = np.diag(estimates).copy()
    np.fill_diagonal(estimates, np.nan)  # never read
    return y, estimates, z


def assert_same(got, expected):
    """To 1e-12 of the greatest entry."""
    assert np.all(np.isfinite(expected))
    assert np.max(np.abs(got - expected)) <= 1e-12 * np.max(np.abs(expected))


@pytest.mark.parametrize(("kind", "count"), CASES)
def test_full_information_is_the_formula(kind, count):
    now = case(kind, count)
    for y in now.interior(STATES):
        u, rate = step(now.game, FullInformation(), y, np.zeros(0))
        assert_same(u, reference.full_information(now.oracle, RHO, y))
        assert rate.shape == (0,)


@pytest.mark.parametrize(("kind", "count", "graph"), NETWORKS)
def test_fully_distributed_is_the_formula(kind, count, graph):
    now = case(kind, count)
    law = FullyDistributed(graphs.NAMED[graph](count), EPSILON, GAIN)
    edges = [*graphs.NAMED[graph](count).edges]
    if graph in ("line", "ring", "complete"):
        edges = getattr(reference, graph)(count)
    laplacian = reference.laplacian(count, edges)
    for _ in range(STATES):
        y, estimates, z = draw(now)
        u, rate = step(now.game, law, y, pack_memory(estimates, z))
        expected_u, z_rate, estimates_rate = reference.fully_distributed(
            now.oracle, RHO, laplacian, GAIN, EPSILON, y, z, estimates
        )
        assert_same(u, expected_u)
        assert_same(rate[count * count :], z_rate)
        rates = rate[: count * count].reshape(count, count)
        others = ~np.eye(count, dtype=bool)
        if count > 1:
            assert_same(rates[others], estimates_rate[others])


def test_own_blocks_of_the_estimates_stay_as_they_are():
    now = case("osnr", 10)
    y, estimates, z = draw(now)
    np.fill_diagonal(estimates, np.arange(10.0))
    _, rate = step(now.game, distributed(epsilon=EPSILON), y, pack_memory(estimates, z))
    assert np.all(np.diag(rate[:100].reshape(10, 10)) == 0)


def test_the_five_robots_first_forces():
    for engine in ("ode", "mujoco"):
        _, u, *_ = run_loop(robot_system(robot_state(FIVE), engine=engine), 1e-3, 1)
        assert np.allclose(u[0], [4.055, 2, 2.069444, -3, -3.044444], rtol=0, atol=5e-7)


# What the laws see is asked of the law itself, so that nothing else need be inside.


@cache
def native(law, game):
    """The law's kernels, compiled as a loop compiles them."""
    source = source_key(law, game)

    @compiled
    def action(problem, y, weights, memory, work, u):
        _ = source
        return law.action(game, problem, y, weights, memory, work, u)

    @compiled
    def rate(problem, y, memory, out):
        _ = source
        law.rate(problem, y, memory, out)

    return action, rate


def act(game, law, y, estimates, z):
    """Code, u, rates of the estimates and of z by the distributed law, true weights unknown."""
    action, rate = native(law.kernels, game.kernels)
    memory, u, rates = (
        pack_memory(estimates, z),
        np.full(len(y), np.nan),
        np.full(len(y) ** 2 + len(y), np.nan),
    )
    unknown = np.full(game.constraints_count, np.nan)
    problem = problem_of(game, law)
    code = action(problem, y, unknown, memory, work(len(y), len(unknown), game.agents), u)
    rate(problem, y, memory, rates)
    return code, u, rates[: len(y) ** 2].reshape(len(y), -1), rates[len(y) ** 2 :]


@pytest.mark.parametrize(
    ("kind", "count", "graph"),
    [("velocity", 5, "line"), ("osnr", 10, "ring"), ("osnr", 10, "printed")],
)
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


@pytest.mark.parametrize(
    ("kind", "count", "graph"),
    [("velocity", 5, "line"), ("osnr", 10, "ring"), ("osnr", 10, "printed")],
)
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


# --------------------------------------------------------------- estimates outside the set


def outside_cases():
    """Which agent's profile is moved, by what, and the constraint that must be named."""
    velocity, osnr = case("velocity", 5), case("osnr", 10)
    return [
        (velocity, 3, 2, 50.0, 3),  # its estimate of its predecessor: its own gap
        (velocity, 1, 2, -50.0, 2),  # its estimate of its follower: the follower's gap
        (velocity, 0, 1, np.nan, 1),
        (osnr, 7, 2, 50.0, 10),  # total power
        (osnr, 9, 9, -0.1, 9),  # its own filtered power
    ]


@pytest.mark.parametrize("number", range(5))
def test_an_estimate_outside_is_reported_with_its_agent_and_constraint(number):
    now, agent, entry, change, constraint = outside_cases()[number]
    law = FullyDistributed(graphs.ring(now.count), EPSILON, GAIN)
    y, estimates, z = draw(now)
    if entry == agent:
        z[agent] = change
    else:
        estimates[agent, entry] += change
    code, u, *_ = act(now.game, law, y, estimates, z)
    assert code == agent * now.game.constraints_count + constraint
    assert np.all(np.isfinite(u[:agent]))

    margins = reference.estimate_margins(now.oracle, z, estimates)
    loop = loop_at(now.game, law, y, pack_memory(estimates, z), h=1e-3)
    assert loop.advance(3, 1).input.shape == (0, now.count)
    monitor = loop.monitor
    finite = np.isfinite(margins[agent, constraint])
    assert monitor[watch.EXIT] == (watch.ESTIMATE_LEFT if finite else watch.DIVERGED)
    assert monitor[watch.EXIT_AGENT] == agent
    assert monitor[watch.EXIT_CONSTRAINT] == constraint
    assert monitor[watch.EXIT_STAGE] == monitor[watch.EXIT_TIME] == 0
    if finite:
        assert margins[agent, constraint] > 0
        assert monitor[watch.EXIT_VALUE] == pytest.approx(margins[agent, constraint], rel=1e-12)
    assert loop.time == 0
    assert np.all(np.isnan(loop.finish().input))


def test_an_agent_minds_only_constraints_that_contain_its_action():
    now, law = case("velocity", 5), FullyDistributed(graphs.line(5), EPSILON, GAIN)
    y, estimates, z = draw(now)
    code, u, *_ = act(now.game, law, y, estimates, z)
    far = estimates.copy()
    far[0, 3] += 50.0  # agents 4 and 5 are not in the constraints of agent 1
    assert np.any(reference.estimate_margins(now.oracle, z, far)[0] > 0)
    other_code, other_u, *_ = act(now.game, law, y, far, z)
    assert code == other_code == -1
    assert np.array_equal(u, other_u)


def test_exactly_on_the_boundary_an_estimate_has_left():
    game = velocity_game(2, 3.0, 3.0)
    law = FullyDistributed(graphs.line(2), EPSILON, GAIN)
    y, estimates, z = (
        np.array([2.0, 2.0]),
        np.array([[np.nan, 5.0], [2.0, np.nan]]),
        np.full(2, 2.0),
    )
    code, *_ = act(game, law, y, estimates, z)
    assert code == 0 * 2 + 1


def test_the_true_profile_comes_before_the_estimates():
    """Robots outside their set are said to be outside, whatever they take each other to be."""
    now = case("velocity", 5)
    law = FullyDistributed(graphs.line(5), EPSILON, GAIN)
    _, estimates, z = draw(now)
    loop = loop_at(now.game, law, np.full(5, V0 + 50.0), pack_memory(estimates, z))
    loop.advance(1, 1)
    assert loop.monitor[watch.EXIT] == watch.LEFT_SET
    assert loop.monitor[watch.EXIT_AGENT] == -1


def test_the_memory_at_the_start_knows_everybody():
    law = distributed("ring", count=4)
    y = np.array([1.0, 2.0, 3.0, 4.0])
    assert np.array_equal(law.initial_memory(y), [*y, *y, *y, *y, *y])
    assert FullInformation().initial_memory(y).shape == (0,)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("key", ["epsilon", "gain"])
def test_bad_numbers_of_the_law(key, bad):
    with pytest.raises(InvalidInput, match=f"controller.{key}"):
        distributed(count=3, graph="line", **{"epsilon": 0.1, key: bad})
