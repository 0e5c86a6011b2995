"""The compiled laws against their formulas."""

import block_reference
import coupled_game
import numpy as np
import pytest
from builders import FIVE, distributed, robot_state, robot_system, run_loop
from law_cases import COUPLING, EPSILON, GAIN, RHO, TAU, ask, case, draw, pack_memory, step

import reference
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game

STATES = 100
CASES = [("velocity", 1), ("velocity", 2), ("velocity", 5), ("osnr", 10)]
NETWORKS = [
    *((kind, count, graph) for kind, count in CASES for graph in ("line", "ring", "complete")),
    ("osnr", 10, "printed"),
    ("osnr", 10, "caption"),
]


def laplacian_of(graph, count):
    """By the reference's own edges where it has them."""
    edges = graphs.NAMED[graph](count).edges
    if graph in ("line", "ring", "complete"):
        edges = getattr(reference, graph)(count)
    return reference.laplacian(count, edges)


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


# Actions of several entries

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


def by_kernels(game, law, y, memory):
    """u and the memory's rate by the law's kernels."""
    code, u, rate = ask(game, law, y, RHO / -game.constraints(y), memory)
    assert code == -1
    return u, rate


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        *((name, by_kernels) for name in BLOCK_GRAPHS),
        pytest.param("star", step, marks=pytest.mark.slow),
    ],
)
def test_laws_of_actions_of_several_entries(name, asked):
    game, oracle = coupled()
    rng = np.random.default_rng(len(name))
    graph = graphs.Graph(3, BLOCK_GRAPHS[name])
    neighbours = [list(np.flatnonzero(row < 0)) for row in graph.laplacian]
    own = (game.agent_of_action == np.arange(3)[:, None]).ravel()
    for _ in range(STATES):
        y, estimates, z = block_draw(oracle, rng)
        u, _ = asked(game, FullInformation(), y, np.zeros(0))
        assert_same(u, block_reference.full_information(oracle, RHO, y))

        u, rates = asked(game, PartialInformation(graph, COUPLING, TAU), y, estimates.ravel())
        expected_u, expected = block_reference.partial_information(
            oracle, RHO, neighbours, COUPLING, TAU, y, estimates
        )
        assert_same(u, expected_u)
        assert_same(rates[~own], expected.ravel()[~own])
        assert np.all(rates[own] == 0)

        memory = pack_memory(estimates, z)
        u, rates = asked(game, FullyDistributed(graph, EPSILON, GAIN), y, memory)
        expected_u, expected, expected_z = block_reference.fully_distributed(
            oracle, RHO, neighbours, GAIN, EPSILON, y, z, estimates
        )
        rates, z_rates = rates[: len(own)], rates[len(own) :]
        assert_same(u, expected_u)
        assert_same(rates[~own], expected.ravel()[~own])
        assert np.all(rates[own] == 0)
        assert_same(z_rates, expected_z)


# What a law is given


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
