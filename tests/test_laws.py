"""The compiled laws against their formulas, and what each agent may and may not see."""

from types import SimpleNamespace

import block_reference
import coupled_game
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
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.controllers.propagation import no_propagator
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.loops import functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.layout import LoopClock, Setup, problem_and_parameter_block
from gne_mj.loops.link import link
from gne_mj.loops.ode import CONTINUOUS, OdeLoop
from gne_mj.plants.functions import EULER

RHO, EPSILON, GAIN = 0.1, 0.05, 0.7
COUPLING, TAU = 1.7, 0.3
STATES = 100


def case(kind, count):
    """A game of the product, the same of the reference, and a drawer of interior profiles."""
    rng = np.random.default_rng(count)
    if kind == "velocity":
        delta = rng.uniform(0.5, 3, count)
        game, oracle = velocity_game(count, V0, delta), reference_games.VelocityGame(V0, delta)

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
    addresses = link(law.kernels, game.kernels, memory=law.graph is not None, held=False)
    return Problem(
        game.data, law.graph_data, settings, bounds, y, no_propagator(), functions=addresses
    )


def tabled(problem, memory):
    """The problem with its table, which has to be kept."""
    rest, clock = np.zeros((len(problem.limit), 1)), LoopClock(1.0, 1, CONTINUOUS, EULER)
    return problem_and_parameter_block(
        Setup(problem, rest, clock), integrators(len(problem.limit)), len(memory)
    )


def loop_at(game, law, y, memory, h=2.0**-30):
    """The product's compiled loop of integrators (state y), Euler, at any state and memory."""
    agents = integrators(game.actions)
    rest, clock = np.zeros((game.actions, 1)), LoopClock(h, 1, CONTINUOUS, EULER)
    setup = Setup(problem_of(game, law), rest, clock)
    return OdeLoop(agents, setup, y.reshape(-1, 1), memory)


def step(game, law, y, memory):
    """u, by an Euler step that is too short to be divided, and the memory's rate at a state."""
    memory = own_actions_in(memory, y, game.agent_of_action)
    loop = loop_at(game, law, y, memory)
    first = loop.advance(1, 1)
    assert loop.monitor.exit == watch.INSIDE
    assert np.array_equal(first.state[0, :, 0], y)
    assert np.array_equal(first.memory[0], memory)
    u, rate = first.input[0], np.zeros(len(memory))
    assert np.array_equal(loop.finish().state[0, :, 0], y + 2.0**-30 * u)
    problem, _parameter_block = tabled(problem_of(game, law), memory)
    functions.rate(problem, y, memory, rate)
    return u, rate


def own_actions_in(memory, y, owner):
    """The memory as the law keeps it: each agent's own action in its own block."""
    memory, m = memory.copy(), len(y)
    if len(memory):
        memory[owner * m + np.arange(m)] = y
    return memory


def pack_memory(estimates, z):
    return np.concatenate([estimates.ravel(), z])


def laplacian_of(graph, count):
    """By the reference's own edges where it has them."""
    edges = graphs.NAMED[graph](count).edges
    if graph in ("line", "ring", "complete"):
        edges = getattr(reference, graph)(count)
    return reference.laplacian(count, edges)


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
    laplacian = laplacian_of(graph, count)
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


@pytest.mark.parametrize(
    ("kind", "count", "graph"),
    [  # for the channels a loop is compiled that no other test uses
        pytest.param(*network, marks=[pytest.mark.slow] if network[0] == "osnr" else [])
        for network in NETWORKS
    ],
)
def test_partial_information_is_the_formula(kind, count, graph):
    now = case(kind, count)
    law = PartialInformation(graphs.NAMED[graph](count), COUPLING, TAU)
    laplacian = laplacian_of(graph, count)
    for _ in range(STATES):
        y, estimates, _ = draw(now)
        u, rate = step(now.game, law, y, estimates.ravel())
        expected_u, estimates_rate = reference.partial_information(
            now.oracle, RHO, laplacian, COUPLING, TAU, y, estimates
        )
        assert_same(u, expected_u)
        others = ~np.eye(count, dtype=bool)
        if count > 1:
            assert_same(rate.reshape(count, count)[others], estimates_rate[others])


def test_by_default_coupling_and_time_constant_are_the_papers():
    law = PartialInformation(graphs.ring(5))
    assert (law.coupling, law.time_constant, law.estimate_rate) == (1.0, 1.0, 1.0)
    now = case("velocity", 5)
    y, estimates, _ = draw(now)
    u, rate = step(now.game, law, y, estimates.ravel())
    expected_u, expected = reference.partial_information(
        now.oracle, RHO, laplacian_of("ring", 5), 1.0, 1.0, y, estimates
    )
    assert_same(u, expected_u)
    others = ~np.eye(5, dtype=bool)
    assert_same(rate.reshape(5, 5)[others], expected[others])


def test_own_blocks_are_the_own_actions_and_have_no_rate():
    """What stood there before is overwritten: a garbled own block changes nothing."""
    now = case("osnr", 10)
    y, estimates, z = draw(now)
    garbled = estimates.copy()
    np.fill_diagonal(garbled, np.arange(10.0))
    for law in (distributed(epsilon=EPSILON), PartialInformation(graphs.ring(10))):
        weights = np.ones(now.game.constraints_count)
        code, u, rates = ask(now.game, law, y, weights, pack_memory(garbled, z))
        again, same, _ = ask(now.game, law, y, weights, pack_memory(estimates, z))
        assert code == again == -1
        assert np.array_equal(u, same)
        assert np.all(np.diag(rates[:100].reshape(10, 10)) == 0)


def test_the_five_robots_first_forces():
    for engine in ("ode", "mujoco"):
        _, u, *_ = run_loop(robot_system(robot_state(FIVE), engine=engine), 1e-3, 1)
        assert np.allclose(u[0], [4.055, 2, 2.069444, -3, -3.044444], rtol=0, atol=5e-7)


# What the laws see is asked of the law itself, so that nothing else need be inside.


def ask(game, law, y, weights, memory):
    """Code, u and the memory's rates by the law's kernels."""
    u, rates = np.full(len(y), np.nan), np.full(len(memory), np.nan)
    problem, _parameter_block = tabled(problem_of(game, law), memory)
    scratch = work(len(y), len(weights), game.agents)
    scratch.now.penalty = RHO
    code = functions.action(problem, y, weights, memory, scratch, u)
    functions.rate(problem, y, memory, rates)
    return code, u, rates


def act(game, law, y, estimates, z):
    """Code, u, rates of the estimates and of z by the distributed law, true weights unknown."""
    unknown = np.full(game.constraints_count, np.nan)
    code, u, rates = ask(game, law, y, unknown, pack_memory(estimates, z))
    size = estimates.size
    return code, u, rates[:size].reshape(estimates.shape), rates[size:]


def act_partially(game, law, y, weights, estimates):
    """u and the estimates' rates under partial information, with these barrier weights."""
    code, u, rates = ask(game, law, y, weights, estimates.ravel())
    assert code == -1
    return u, rates.reshape(estimates.shape)


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


# --------------------------------------------------------------- actions of several entries


BLOCK_GRAPHS = {
    "line": ((0, 1), (1, 2)),
    "star": ((0, 2), (0, 1)),
    "complete": ((0, 1), (0, 2), (1, 2)),
}


def coupled():
    """A game with actions of two, one and one entries, and its plain version."""
    return Game(
        "coupled", coupled_game, np.array([0.3]), coupled_game.SIZES, ((0, 1, 2),) * 3,
        coupled_game.IN_CONSTRAINT, ("ball", "product"),
    ), block_reference.CoupledGame(0.3)  # fmt: skip


def block_profiles(oracle, rng, rows):
    """Random profiles strictly inside, (rows, 4)."""
    found = []
    while len(found) < rows:
        y = rng.uniform(-1.6, 1.6, 4)
        if all(oracle.constraint(l, y) < -0.05 for l in range(2)):  # noqa: E741
            found.append(y)
    return np.array(found)


def block_draw(oracle, rng):
    """y, estimates whose own blocks are no numbers, z, all inside."""
    y, z, *rows = block_profiles(oracle, rng, 5)
    estimates = np.array(rows)
    for i, at in enumerate(block_reference.blocks(oracle.sizes)):
        while True:
            filtered = estimates[i].copy()
            filtered[at] = z[at]
            if all(oracle.constraint(l, filtered) < 0 for l in range(2)):  # noqa: E741
                break
            estimates[i] = block_profiles(oracle, rng, 1)[0]
        estimates[i, at] = np.nan
    return y, estimates, z


@pytest.mark.parametrize("name", BLOCK_GRAPHS)
def test_laws_of_actions_of_several_entries(name):
    game, oracle = coupled()
    rng = np.random.default_rng(len(name))
    graph = graphs.Graph(3, BLOCK_GRAPHS[name])
    neighbours = [list(np.flatnonzero(row < 0)) for row in graph.laplacian]
    own = game.agent_of_action == np.arange(3)[:, None]
    partial = PartialInformation(graph, COUPLING, TAU)
    distributed_law = FullyDistributed(graph, EPSILON, GAIN)
    for _ in range(STATES):
        y, estimates, z = block_draw(oracle, rng)
        weights = RHO / -np.array([oracle.constraint(l, y) for l in range(2)])  # noqa: E741
        _, u, _ = ask(game, FullInformation(), y, weights, np.zeros(0))
        assert_same(u, block_reference.full_information(oracle, RHO, y))

        u, rates = act_partially(game, partial, y, weights, estimates)
        expected_u, expected = block_reference.partial_information(
            oracle, RHO, neighbours, COUPLING, TAU, y, estimates
        )
        assert_same(u, expected_u)
        assert_same(rates[~own], expected[~own])
        assert np.all(rates[own] == 0)

        code, u, rates, z_rates = act(game, distributed_law, y, estimates, z)
        expected_u, expected, expected_z = block_reference.fully_distributed(
            oracle, RHO, neighbours, GAIN, EPSILON, y, z, estimates
        )
        assert code == -1
        assert_same(u, expected_u)
        assert_same(rates[~own], expected[~own])
        assert np.all(rates[own] == 0)
        assert_same(z_rates, expected_z)


@pytest.mark.slow
def test_loops_of_actions_of_several_entries():
    """The same by the compiled loops."""
    game, oracle = coupled()
    rng = np.random.default_rng(7)
    graph = graphs.Graph(3, BLOCK_GRAPHS["star"])
    neighbours = [list(np.flatnonzero(row < 0)) for row in graph.laplacian]
    own = (game.agent_of_action == np.arange(3)[:, None]).ravel()
    for _ in range(STATES):
        y, estimates, z = block_draw(oracle, rng)
        u, _ = step(game, FullInformation(), y, np.zeros(0))
        assert_same(u, block_reference.full_information(oracle, RHO, y))
        u, rates = step(game, PartialInformation(graph, COUPLING, TAU), y, estimates.ravel())
        expected_u, expected = block_reference.partial_information(
            oracle, RHO, neighbours, COUPLING, TAU, y, estimates
        )
        assert_same(u, expected_u)
        assert_same(rates[~own], expected.ravel()[~own])
        u, rates = step(game, FullyDistributed(graph, EPSILON, GAIN), y, pack_memory(estimates, z))
        expected_u, expected, expected_z = block_reference.fully_distributed(
            oracle, RHO, neighbours, GAIN, EPSILON, y, z, estimates
        )
        assert_same(u, expected_u)
        assert_same(rates[:12][~own], expected.ravel()[~own])
        assert_same(rates[12:], expected_z)


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
    assert monitor.exit == (watch.ESTIMATE_LEFT if finite else watch.DIVERGED)
    assert monitor.exit_agent == agent
    assert monitor.exit_constraint == constraint
    assert monitor.exit_stage == monitor.exit_time == 0
    if finite:
        assert margins[agent, constraint] > 0
        assert monitor.exit_value == pytest.approx(margins[agent, constraint], rel=1e-12)
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
    assert loop.monitor.exit == watch.LEFT_SET
    assert loop.monitor.exit_agent == -1


def test_the_memory_at_the_start_knows_everybody():
    law = distributed("ring", count=4)
    y = np.array([1.0, 2.0, 3.0, 4.0])
    assert np.array_equal(law.initial_memory(y), [*y, *y, *y, *y, *y])
    assert FullInformation().initial_memory(y).shape == (0,)
    partial = PartialInformation(graphs.ring(4))
    assert np.array_equal(partial.initial_memory(y), [*y, *y, *y, *y])


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("key", ["epsilon", "gain"])
def test_bad_numbers_of_the_law(key, bad):
    with pytest.raises(InvalidInput, match=f"^{key}"):
        distributed(count=3, graph="line", **{"epsilon": 0.1, key: bad})


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("key", ["coupling", "time_constant"])
def test_bad_numbers_of_partial_information(key, bad):
    with pytest.raises(InvalidInput, match=f"^{key}"):
        PartialInformation(graphs.line(3), **{key: bad})
