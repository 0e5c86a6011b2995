"""The fixed-step loops: against plain Runge-Kutta, exact exponentials and NumPy's trapezoids."""

import numpy as np
import pytest
from builders import (
    FIVE,
    UNEQUAL,
    V0,
    clock,
    distributed,
    integrators,
    osnr_system,
    pi_cascades,
    random_robot_state,
    reference_osnr,
    reference_pi,
    reference_robots,
    relative_error,
    robot_state,
    robot_system,
    run_loop,
)
from reference_agents import Integrator
from scipy.linalg import expm

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import Problem
from gne_mj.loops.layout import LoopClock, Setup
from gne_mj.loops.link import link
from gne_mj.loops.ode import SAMPLED, OdeLoop
from gne_mj.plants.functions import RK4
from gne_mj.system import System

DELTA = np.full(5, 3.0)
RHO = 0.1


def powers(seed=0):
    """Unequal powers of ten channels, inside."""
    limit = reference_osnr().power_limit
    return 0.7 * limit * np.random.default_rng(seed).dirichlet(np.full(10, 5.0))


# ------------------------------------------------------------------------------- continuous


def full_information_cases():
    velocity, osnr = reference_games.VelocityGame(V0, DELTA), reference_osnr()
    robots = random_robot_state(np.random.default_rng(5), 0.8 * DELTA, spread=1.0)
    line = System(
        "line", velocity_game(5, V0, 3.0), integrators(5), FullInformation(), RHO, FIVE[:, None]
    )
    pi = osnr_system(pi_cascades(10), FullInformation(), powers())
    return {
        "robots": (robot_system(robots, UNEQUAL), reference_robots(UNEQUAL), velocity),
        "integrators in a line": (line, Integrator(), velocity),
        "integrators as channels": (
            osnr_system(integrators(10), FullInformation(), powers()), Integrator(), osnr,
        ),
        "PI cascades": (pi, reference_pi(10), osnr),
    }  # fmt: skip


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if name == "integrators as channels" else name
        for name in full_information_cases()
    ],
)
def test_full_information_equals_a_plain_rk4(name):
    system, agent, game = full_information_cases()[name]
    h, steps = (5e-5, 200) if game.N == 10 else (0.005, 400)  # none of them is divided
    rate = reference.closed_loop_rate(agent, "full_information", game, RHO)
    expected = reference.rk4_fixed(rate, system.state[:, : agent.n].ravel(), h, steps)
    states, u, _, loop = run_loop(system, h, steps)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.divided == 0
    assert loop.time == pytest.approx(h * steps)
    assert relative_error(states[:, :, : agent.n].reshape(len(expected), -1), expected) < 1e-11
    y = np.array([agent.output(x.reshape(-1, agent.n)) for x in expected])
    inputs = np.array([reference.full_information(game, RHO, row) for row in y])
    assert relative_error(u, inputs) < 1e-10


@pytest.mark.parametrize("graph", ["printed", "ring"])
@pytest.mark.parametrize(
    "name", [pytest.param("integrators", marks=pytest.mark.slow), "PI cascades"]
)
def test_fully_distributed_equals_a_plain_rk4(name, graph):
    agents, agent = {
        "integrators": (integrators(10), Integrator()),
        "PI cascades": (pi_cascades(10), reference_pi(10)),
    }[name]
    law = distributed(graph, epsilon=0.1, gain=0.1)
    system, game, h, steps = osnr_system(agents, law, powers()), reference_osnr(), 0.001, 60
    rate = reference.closed_loop_rate(
        agent, "fully_distributed", game, RHO,
        laplacian=reference.laplacian(10, law.graph.edges), k=0.1, epsilon=0.1,
    )  # fmt: skip
    z, estimates = reference.consensus_start(system.start, with_z=True)
    expected = reference.rk4_fixed(rate, reference.pack(system.state, z, estimates), h, steps)
    states, _, memory, loop = run_loop(system, h, steps)
    assert loop.monitor.exit == watch.INSIDE
    others = ~np.eye(10, dtype=bool)
    got = [
        np.concatenate([x.ravel(), row[100:], row[:100].reshape(10, 10)[others]])
        for x, row in zip(states, memory, strict=True)
    ]
    assert np.max(np.abs(expected[-1] - expected[0])) > 1e-3
    assert relative_error(np.array(got), expected) < 1e-11


# --------------------------------------------------------------- sampled: the memory is exact


@pytest.mark.parametrize("substeps", [1, 2, 5])
@pytest.mark.parametrize("graph", ["line", "ring", "complete", "printed", "caption"])
def test_sampled_memory_is_propagated_exactly(graph, substeps):
    """Against the exponential of the Laplacian with the sender's row held, column by column."""
    rng = np.random.default_rng(substeps)
    epsilon, period = 5e-6, 3e-6  # short, so that the agents hardly move meanwhile
    law = distributed(graph, epsilon)
    game = osnr_system(integrators(10), law, 0.2).game
    estimates = 2.4 * rng.dirichlet(np.full(11, 5.0), 10)[:, :10]
    y, z = powers(1), np.diag(estimates).copy()
    memory = np.concatenate([estimates.ravel(), z])
    problem = Problem(
        game.data,
        law.graph_data,
        law.settings(RHO),
        np.full(10, np.inf),
        np.zeros(10),
        law.propagator(period),
        functions=link(law.kernels, game.kernels, memory=True, held=True),
    )
    loop_clock = LoopClock(period / substeps, substeps, SAMPLED, RK4)
    setup = Setup(problem, np.zeros((10, 1)), loop_clock)
    loop = OdeLoop(integrators(10), setup, y[:, None], memory)
    laplacian = reference.laplacian(10, law.graph.edges)
    recorded = loop.advance(substeps, 1)
    assert len(recorded.input) == substeps, "left the set"
    unchanged = np.delete(recorded.memory - memory, np.arange(0, 100, 11), axis=1)
    assert np.all(unchanged == 0), "within the period, but for the own actions"
    assert np.all(recorded.input == recorded.input[0])
    expected = estimates.copy()
    for j in range(10):
        rates = -laplacian / epsilon
        rates[j] = 0.0
        start = estimates[:, j].copy()
        start[j] = y[j]
        end = expm(period * rates) @ start
        others = np.arange(10) != j
        expected[others, j] = end[others]
    after = loop.finish().memory[0]
    others = ~np.eye(10, dtype=bool)
    assert relative_error(after[:100].reshape(10, 10)[others], expected[others]) < 1e-12
    assert relative_error(after[100:], y + np.exp(-period / epsilon) * (z - y)) < 1e-12


@pytest.mark.parametrize("graph", ["line", "printed"])
def test_sampled_distributed_equals_a_plain_loop(graph):
    """Several periods, agents moving in between: law, hold, plant, exponential."""
    epsilon, gain, h, substeps, periods = 0.1, 0.1, 0.0005, 4, 25
    law = distributed(graph, epsilon, gain)
    system = osnr_system(pi_cascades(10), law, powers(), mode="sampled")
    agent, game = reference_pi(10), reference_osnr()
    laplacian = reference.laplacian(10, law.graph.edges)
    period = h * substeps
    maps = []
    for j in range(10):
        rates = -laplacian / epsilon
        rates[j] = 0.0
        maps.append(expm(period * rates))
    x = system.state.copy()
    z, estimates = reference.consensus_start(x[:, 0], with_z=True)
    rate = reference.held_input_rate(agent, 10)
    expected, inputs = [], []
    for _ in range(periods):
        y = agent.output(x)
        u, _, _ = reference.fully_distributed(game, RHO, laplacian, gain, epsilon, y, z, estimates)
        flat = x.ravel()
        for _ in range(substeps):
            expected.append(flat.reshape(10, 2))
            inputs.append(u)
            flat = reference.rk4_step(lambda t, s, u=u: rate(t, s, u), 0.0, flat, h)
        for j in range(10):
            start = estimates[:, j].copy()
            start[j] = y[j]
            estimates[:, j] = maps[j] @ start
        z = y + np.exp(-period / epsilon) * (z - y)
        x = flat.reshape(10, 2)
    expected.append(x)
    states, got, memory, loop = run_loop(system, h, substeps * periods, control=period)
    assert loop.monitor.exit == watch.INSIDE
    assert relative_error(states, np.array(expected)) < 1e-12
    assert relative_error(got[:-1], np.array(inputs)) < 1e-11
    assert relative_error(memory[-1][100:], z) < 1e-12


# ------------------------------------------------------------------------------- what is measured


ENGINES = pytest.mark.parametrize("engine", ["ode", "mujoco"])
MODES = pytest.mark.parametrize(
    ("mode", "integrator"), [("continuous", "rk4"), ("continuous", "euler"), ("sampled", "rk4")]
)


def measured_system(engine, mode, integrator, limit=np.inf):
    state = random_robot_state(np.random.default_rng(11), 0.8 * DELTA, spread=2.0)
    return robot_system(
        state, UNEQUAL, engine=engine, mode=mode, integrator=integrator, limit=limit
    )


@ENGINES
@MODES
@pytest.mark.parametrize("limit", [np.inf, 2.0], ids=["free", "limited"])
def test_the_monitor_is_what_numpy_makes_of_every_step(engine, mode, integrator, limit):
    h, steps = 0.004, 500
    system = measured_system(engine, mode, integrator, limit)
    loop = system.closed_loop(clock(h, h * steps, 5 * h))
    recorded, last = loop.advance(steps, 1), loop.finish()
    state = np.concatenate([recorded.state, last.state])
    u = np.concatenate([recorded.input, last.input])
    y, times, monitor = state[:, :, 1], h * np.arange(steps + 1), loop.monitor
    game = reference_games.VelocityGame(V0, DELTA)

    assert monitor.started == 1
    assert monitor.exit == watch.INSIDE
    assert monitor.steps == steps
    assert monitor.time == pytest.approx(times[-1], rel=1e-12)

    g = np.array([reference.constraints(game, row) for row in y])
    worst = monitor.worst, monitor.worst_time
    assert np.allclose(worst[0], g.max(axis=0), rtol=0, atol=1e-12)
    assert np.allclose(worst[1], times[g.argmax(axis=0)], rtol=1e-12)

    peak, peak_time, square, energy, last_y, last_u = (
        monitor[name] for name in ("peak", "peak_time", "square", "energy", "last_y", "last_u")
    )
    commanded = np.array([reference.full_information(game, RHO, row) for row in y])
    if mode == "sampled":
        commanded = np.repeat(commanded[::5], 5, axis=0)[: steps + 1]
        assert np.allclose(square, h * np.sum(u[:-1] ** 2, axis=0), rtol=1e-12)
        means = 0.5 * (y[1:] + y[:-1])
        assert np.allclose(energy, h * np.sum(u[:-1] * means, axis=0), rtol=1e-11, atol=1e-11)
    else:
        assert np.allclose(square, np.trapezoid(u**2, times, axis=0), rtol=1e-12)
        means_u, means_y = 0.5 * (u[1:] + u[:-1]), 0.5 * (y[1:] + y[:-1])
        assert np.allclose(energy, h * np.sum(means_u * means_y, axis=0), rtol=1e-11, atol=1e-11)
        fine = np.trapezoid(u * y, times, axis=0)
        assert np.allclose(energy, fine, rtol=0.02, atol=0.02)
    magnitude = np.abs(commanded)
    assert np.allclose(peak, magnitude.max(axis=0), rtol=1e-11)
    assert np.allclose(peak_time, times[magnitude.argmax(axis=0)], rtol=1e-12)
    assert np.array_equal(last_y, y[-1])
    assert np.array_equal(last_u, u[-1])
    assert np.allclose(u, np.clip(commanded, -limit, limit), rtol=1e-10, atol=1e-10)

    over = np.argwhere(magnitude > limit)
    assert monitor.saturated == (len(over) > 0) == (limit < np.inf)
    if len(over):
        step, action = over[0]
        assert monitor.saturated_time == pytest.approx(times[step])
        assert monitor.saturated_action == action
        assert monitor.saturated_command == pytest.approx(commanded[step, action], rel=1e-11)

    robot = reference_robots(UNEQUAL)
    rest = robot.equilibrium(np.full(5, V0))
    storage = np.array([robot.storage(row[:, :3], rest) for row in state])
    assert monitor.storage_start == pytest.approx(storage[0], rel=1e-12)
    assert monitor.storage == pytest.approx(storage[-1], rel=1e-9)
    rise = max(0.0, np.max(np.diff(storage)))
    assert monitor.storage_rise == pytest.approx(rise, rel=1e-6, abs=1e-12)


# ------------------------------------------------------------------- advancing piece by piece


def splits(loop_of):
    """The same 120 steps taken at once, in pieces, and with looks in between."""
    results = []
    for pieces, looks in (([120], False), ([1, 2, 7, 50, 60], False), ([3, 33, 84], True)):
        loop = loop_of()
        parts = []
        for piece in pieces:
            parts.append(loop.advance(piece, 1))
            if looks:
                loop.finish()
                loop.finish()
        parts.append(loop.finish())
        results.append(
            [
                *(np.concatenate([getattr(part, name) for part in parts])
                  for name in ("state", "input", "memory")),
                loop.monitor.copy(),
                np.array(loop.time),
            ]
        )  # fmt: skip
    return results


@ENGINES
@MODES
def test_splitting_a_run_changes_no_bit(engine, mode, integrator):
    system = measured_system(engine, mode, integrator)
    whole, pieces, looked = splits(lambda: system.closed_loop(clock(0.004, 1.0, 0.02)))
    for other in (pieces, looked):
        for first, second in zip(whole, other, strict=True):
            assert np.array_equal(first, second)


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
def test_splitting_a_distributed_run_changes_no_bit(mode):
    law = distributed(epsilon=0.1, gain=0.1)
    system = osnr_system(pi_cascades(10), law, powers(), mode=mode)
    whole, pieces, looked = splits(lambda: system.closed_loop(clock(0.0005, 1.0, 0.0025)))
    for other in (pieces, looked):
        for first, second in zip(whole, other, strict=True):
            assert np.array_equal(first, second)


@ENGINES
def test_recording_less_often_changes_no_bit(engine):
    system = measured_system(engine, "sampled", "rk4")
    often, seldom = (system.closed_loop(clock(0.004, 1.0, 0.02)) for _ in range(2))
    every = often.advance(120, 1)
    tenth = seldom.advance(12, 10)
    assert np.array_equal(every.state[::10], tenth.state)
    assert np.array_equal(every.input[::10], tenth.input)
    assert np.array_equal(often.monitor, seldom.monitor)
    assert np.array_equal(often.finish().state, seldom.finish().state)


# ------------------------------------------------------------------------------------- exits


def test_an_estimate_that_leaves_at_a_later_stage_is_latched():
    law = FullyDistributed(graphs.line(10), 3.0, 5.0)
    system = osnr_system(integrators(10), law, 0.2)
    loop = system.closed_loop(clock(0.05, 20.0))
    recorded = loop.advance(400, 1)
    monitor = loop.monitor
    assert monitor.exit in (watch.ESTIMATE_LEFT, watch.LEFT_SET)
    assert len(recorded.input) < 400
    if monitor.exit == watch.ESTIMATE_LEFT:
        assert 0 <= monitor.exit_agent < 10
    assert monitor.exit_value >= 0


def test_inputs_that_are_no_usable_numbers_are_a_divergence():
    game_scale = robot_system(robot_state(V0 + np.array([1e-12, 0, 0, 0, 0])), delta=2e-12, rho=1e3)
    loop = game_scale.closed_loop(clock(1e-3))
    assert len(loop.advance(1, 1).input) == 0
    assert loop.monitor.exit == watch.DIVERGED
    assert abs(loop.monitor.exit_value) >= 1e10


@pytest.mark.parametrize("engine", ["ode", "mujoco"])
def test_no_samples_are_no_observation(engine):
    """Neither a look at the present nor a step."""
    loop = robot_system(robot_state(FIVE), engine=engine).closed_loop(clock(0.01))
    assert len(loop.advance(0, 5).input) == 0
    assert loop.monitor == watch.fresh(5, 5)
    assert loop.time == 0.0
