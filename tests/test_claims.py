"""What the theorems claim of all three laws, on games, graphs and starts drawn at random."""

import numpy as np
import pytest
from builders import (
    UNEQUAL,
    V0,
    integrators,
    osnr_system,
    pi_cascades,
    random_robot_state,
    reference_osnr,
    reference_robots,
    robot_system,
    run_loop,
)
from hypothesis import given, settings
from hypothesis import strategies as st

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.system import System
from gne_mj.system.steps import largest_step


def required_coupling(game, graph):
    """The least c with 4 mu (c lambda_2 - theta_2) > (theta_1 + theta_2)^2, F being affine."""
    jacobian = reference.pseudo_gradient_jacobian(game, np.full(game.N, game.v0))
    mu, first, second = reference.affine_constants(jacobian)
    connectivity = reference.algebraic_connectivity(reference.laplacian(graph.agents, graph.edges))
    return (second + (first + second) ** 2 / (4 * mu)) / connectivity


def random_graph(rng, count):
    edges = [(i, int(rng.integers(i))) for i in range(1, count)]
    for _ in range(int(rng.integers(0, count + 1)) if count > 1 else 0):
        i, j = rng.choice(count, 2, replace=False)
        edges.append((int(i), int(j)))
    return graphs.Graph(count, tuple(edges))


def storages(states, memory, equilibrium, tau, storage):
    """V of the agents plus tau/2 |estimates - y*|^2, at every row, slowly."""
    count = len(equilibrium)
    values = []
    for x, row in zip(states, memory, strict=True):
        estimates = row[: count * count].reshape(count, count)
        others = ~np.eye(count, dtype=bool)
        apart = (estimates - equilibrium)[others]
        values.append(storage(x) + 0.5 * tau * apart @ apart)
    return np.array(values)


def rises(values):
    """The greatest rise from one row to the next."""
    return max(0.0, float(np.max(np.diff(values))))


def integrator_line(rng, count):
    """A drawn velocity game of integrators: game, oracle, start inside, graph."""
    delta = rng.uniform(0.5, 4.0, count)
    v0 = rng.uniform(-5.0, 5.0)
    y = v0 + np.cumsum(rng.uniform(-0.9, 0.9, count) * delta)
    game, oracle = velocity_game(count, v0, delta), reference_games.VelocityGame(v0, delta)
    return game, oracle, y, random_graph(rng, count)


@settings(max_examples=25)
@given(st.integers(2, 6), st.floats(1.05, 3.0), st.floats(-2.0, 0.3), st.integers(0, 2**32 - 1))
def test_partial_information_with_enough_coupling(count, above, log_tau, seed):
    """Inside at all times, V never rises beyond the discretisation, and y* is reached."""
    rng = np.random.default_rng(seed)
    game, oracle, y, graph = integrator_line(rng, count)
    rho, tau = 10.0 ** rng.uniform(-1, 0), 10.0**log_tau
    coupling = above * required_coupling(oracle, graph)
    law = PartialInformation(graph, coupling, tau)
    estimates = y + rng.normal(0, 0.1, (count, count))  # inside or not: only y is guarded
    system = System(
        "line", game, integrators(count), law, rho, y[:, None],
        memory=law.initial_memory(y, estimates),
    )  # fmt: skip
    # The push of wrong estimates is met by the barrier, whose slope then is about push^2 / rho.
    laplacian = reference.laplacian(count, graph.edges)
    push, _ = reference.partial_information(oracle, rho, laplacian, coupling, tau, y, estimates)
    fastest = coupling * graph.largest_eigenvalue * max(1.0, 1.0 / tau)
    h = 0.2 / (fastest + 20.0 + np.max(np.abs(push)) ** 2 / rho)
    stride = max(1, round(0.002 / h))
    steps = stride * round(0.5 / (stride * h))
    equilibrium = reference.penalised_equilibrium(oracle, rho, np.full(count, oracle.v0))
    assert np.allclose(system.equilibrium.action, equilibrium, rtol=0, atol=1e-9)
    found = []
    for refine in (1, 2):
        states, _, memory, loop = run_loop(
            system, h / refine, steps * refine, every=stride * refine
        )
        monitor = loop.monitor
        assert monitor.exit == watch.INSIDE
        assert np.all(monitor.worst < 0)  # at every step
        values = storages(
            states[:, :, 0], memory, equilibrium, tau,
            lambda x: 0.5 * (x - equilibrium) @ (x - equilibrium),
        )  # fmt: skip
        assert monitor.storage_start == pytest.approx(values[0], rel=1e-12)
        assert monitor.storage == pytest.approx(values[-1], rel=1e-9, abs=1e-12)
        found.append((values, monitor.storage_rise))
    coarse, fine = found[0][0], found[1][0]
    error = np.max(np.abs(coarse - fine)) + 1e-13 * coarse[0]
    assert rises(coarse) <= error
    assert found[0][1] <= error
    assert coarse[-1] < coarse[0]


@settings(max_examples=25)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_full_information_of_drawn_games(count, seed):
    rng = np.random.default_rng(seed)
    game, oracle, y, _ = integrator_line(rng, count)
    rho = 10.0 ** rng.uniform(-2, 0)
    system = System("line", game, integrators(count), FullInformation(), rho, y[:, None])
    h, steps = 0.005, 200
    values = []
    for refine in (1, 2):
        states, _, _, loop = run_loop(system, h / refine, steps * refine, every=refine)
        assert loop.monitor.exit == watch.INSIDE
        assert np.all(game.constraints(states[:, :, 0]) < 0)
        values.append(0.5 * np.sum((states[:, :, 0] - oracle.v0) ** 2, axis=1))
    error = np.max(np.abs(values[0] - values[1])) + 1e-13 * values[0][0]
    assert rises(values[0]) <= error
    end = run_loop(system, h, 20_000, every=20_000)[0][-1, :, 0]
    assert np.max(np.abs(end - oracle.v0)) < 1e-6


@settings(max_examples=3)
@given(st.integers(2, 5), st.integers(0, 2**32 - 1))
def test_all_laws_of_drawn_games_end_at_one_equilibrium(count, seed):
    rng = np.random.default_rng(seed)
    game, oracle, y, graph = integrator_line(rng, count)
    y = oracle.v0 + 0.3 * (y - oracle.v0)
    ends = []
    for law in (
        FullInformation(),
        PartialInformation(graph, 1.1 * required_coupling(oracle, graph), 0.05),
        FullyDistributed(graph, 0.02, 0.2),
    ):
        system = System("line", game, integrators(count), law, 0.1, y[:, None])
        # c sets the pace: an agent is held by what its neighbours still take it to be
        h = min(0.01, 0.5 * largest_step(system))
        steps = round(400.0 / h)
        states, _, _, loop = run_loop(system, h, steps, every=steps)
        assert loop.monitor.exit == watch.INSIDE
        ends.append(states[-1, :, 0])
    assert np.max(np.abs(np.array(ends) - system.equilibrium.action)) < 1e-6


def robots_of(law, h):
    state = random_robot_state(np.random.default_rng(3), np.full(5, 1.0), spread=1.0)
    return robot_system(state, UNEQUAL, law=law, engine="mujoco", delta=3.0), h


def test_robots_in_mujoco_end_at_the_equilibrium_under_partial_information():
    graph = graphs.ring(5)
    oracle = reference_games.VelocityGame(V0, [3.0] * 5)
    coupling = 1.05 * required_coupling(oracle, graph)
    system, h = robots_of(PartialInformation(graph, coupling, 0.05), 1e-3)
    found, robot = [], reference_robots(UNEQUAL)
    equilibrium = np.full(5, V0)
    rest = robot.equilibrium(equilibrium)
    for refine in (1, 2):
        states, _, memory, loop = run_loop(system, h / refine, 4000 * refine, every=refine)
        assert loop.monitor.exit == watch.INSIDE
        values = storages(
            states[::10], memory[::10], equilibrium, 0.05, lambda x: robot.storage(x[:, :3], rest)
        )
        found.append((values, loop.monitor.copy()))
    coarse, monitor = found[0]
    error = np.max(np.abs(coarse - found[1][0])) + 1e-13 * coarse[0]
    assert rises(coarse) <= error
    assert monitor.storage_rise <= error
    assert monitor.storage_start == pytest.approx(coarse[0], rel=1e-12)
    assert monitor.storage == pytest.approx(coarse[-1], rel=1e-9)


@pytest.mark.slow
def test_robots_under_all_laws_end_at_the_same_equilibrium():
    graph = graphs.ring(5)
    coupling = 1.05 * required_coupling(reference_games.VelocityGame(V0, [3.0] * 5), graph)
    for law, duration in (
        (FullInformation(), 200.0),
        (PartialInformation(graph, coupling, 0.01), 400.0),
        (FullyDistributed(graph, 0.01, 0.2), 800.0),
    ):
        system, _ = robots_of(law, 0.002)
        h = min(0.005, 0.5 * largest_step(system))
        steps = round(duration / h)
        states, _, _, loop = run_loop(system, h, steps, every=steps)
        assert loop.monitor.exit == watch.INSIDE
        assert np.max(np.abs(states[-1, :, 1] - V0)) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("agents", [integrators(10), pi_cascades(10)], ids=["integrators", "pi"])
def test_channels_under_all_laws_end_at_the_same_equilibrium(agents):
    graph = graphs.printed()
    expected = reference.penalised_equilibrium(reference_osnr(), 0.1, np.full(10, 0.2))
    for law, duration in (
        (FullInformation(), 200.0),
        (PartialInformation(graph, 5.0, 0.05), 400.0),
        (FullyDistributed(graph, 0.01, 0.1), 800.0),
    ):
        system = osnr_system(agents, law, 0.2)
        h = 0.001
        steps = round(duration / h)
        states, _, _, loop = run_loop(system, h, steps, every=steps)
        assert loop.monitor.exit == watch.INSIDE
        assert np.max(np.abs(states[-1, :, 0] - expected)) < 1e-6


def decrease(oracle, graph, coupling):
    """Q of dV/dt = -E'QE near y* without the barrier; E: errors of all profiles, flat (N N)."""
    count = oracle.N
    jacobian = reference.pseudo_gradient_jacobian(oracle, np.full(count, oracle.v0))
    laplacian = reference.laplacian(count, graph.edges)
    form = coupling * np.kron(laplacian, np.eye(count))
    for i in range(count):
        form[i * count + i, i * count : (i + 1) * count] += jacobian[i]
    return 0.5 * (form + form.T)


@settings(max_examples=20)
@given(st.integers(2, 5), st.integers(0, 2**32 - 1))
def test_v_rises_where_the_coupling_is_too_weak(count, seed):
    """What is checked above can fail: there are starts from which V rises at a small c."""
    rng = np.random.default_rng(seed)
    game, oracle, _, graph = integrator_line(rng, count)
    enough = required_coupling(oracle, graph)
    assert np.linalg.eigvalsh(decrease(oracle, graph, enough))[0] > 0
    values, vectors = np.linalg.eigh(decrease(oracle, graph, 0.01))
    assert values[0] < 0
    errors = 0.1 * vectors[:, 0].reshape(count, count)
    law = PartialInformation(graph, 0.01, 1.0)
    y = oracle.v0 + np.diag(errors)
    system = System(
        "line", game, integrators(count), law, 1e-3, y[:, None],
        memory=law.initial_memory(y, oracle.v0 + errors),
    )  # fmt: skip
    monitor = run_loop(system, 0.001, 10)[3].monitor
    assert monitor.storage_rise > 1e-6 * monitor.storage_start
