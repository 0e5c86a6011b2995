"""The stiff twin's integrator: its method, its accuracy, its exits."""

from dataclasses import dataclass

import coupled_game
import numpy as np
import pytest
from builders import (
    EQUAL,
    UNEQUAL,
    V0,
    clock,
    distributed,
    integrators,
    pi_cascades,
    reference_osnr,
    reference_pi,
    reference_robots,
    robot_state,
    robot_system,
    run_loop,
)
from reference_agents import Integrator
from scipy.integrate import solve_ivp

import reference
import reference_games
from gne_mj import banded, linear, native
from gne_mj import graph as graphs
from gne_mj.controllers import FullyDistributed
from gne_mj.errors import InfeasibleStart
from gne_mj.game_model import Game
from gne_mj.games import osnr_game, ten_channels
from gne_mj.loops import monitor as watch
from gne_mj.loops import rodas
from gne_mj.plants.agents import Agents
from gne_mj.system import System

# ------------------------------------------------------------------------------------ the method


def butcher():
    """alpha, beta and the weights of new state, embedded state, and dense output d_l."""
    method = rodas.method(1e-6, 1e-9)
    gamma = np.linalg.inv(np.eye(rodas.STAGES) / rodas.GAMMA - method.rate)
    alpha = method.stage[:-1] @ gamma
    return alpha, alpha + gamma, method.stage[-1] @ gamma, method.stage[-2] @ gamma, (
        method.dense @ gamma
    )  # fmt: skip


def order_conditions():
    """(order, elementary weight before b, 1 / its density): Hairer and Wanner II, section IV.7."""
    alpha, beta, *_ = butcher()
    a, c = alpha.sum(axis=1), beta.sum(axis=1)
    return [
        (1, np.ones_like(a), 1),
        (2, c, 2), (3, a**2, 3), (3, beta @ c, 6),
        (4, a**3, 4), (4, a * (alpha @ c), 8), (4, beta @ a**2, 12), (4, beta @ beta @ c, 24),
        (5, a**4, 5), (5, a**2 * (alpha @ c), 10), (5, (alpha @ c) ** 2, 20),
        (5, a * (alpha @ a**2), 15), (5, a * (alpha @ beta @ c), 30), (5, beta @ a**3, 20),
        (5, beta @ (a * (alpha @ c)), 40), (5, beta @ beta @ a**2, 60),
        (5, beta @ beta @ beta @ c, 120),
    ]  # fmt: skip


def test_orders_of_the_method():
    _, _, new, embedded, dense = butcher()
    for order, weight, density in order_conditions():
        assert new @ weight == pytest.approx(1 / density, abs=1e-11)
        if order < rodas.ORDER:
            assert embedded @ weight == pytest.approx(1 / density, abs=1e-11)
            for theta in (0.2, 0.5, 0.9):
                bend = dense[0] + theta * (dense[1] + theta * dense[2])
                inside = theta * (new + (1 - theta) * bend)
                assert inside @ weight == pytest.approx(theta**order / density, abs=1e-10)
    assert abs(embedded @ order_conditions()[-1][1] - 1 / 120) > 1e-5  # an estimate of the error


def test_stability_of_the_method():
    _, beta, new, _, _ = butcher()
    assert new == pytest.approx(beta[-1], abs=1e-11)  # stiffly accurate
    ones = np.ones(rodas.STAGES)

    def growth(z):
        return 1 + z * new @ np.linalg.solve(np.eye(rodas.STAGES) - z * beta, ones)

    assert abs(growth(-1e9)) < 1e-6
    assert max(abs(growth(1j * y)) for y in np.logspace(-2, 6, 200)) < 1 + 1e-9


def test_stages_add_up():
    stage = rodas.method(1e-6, 1e-9).stage
    for i in range(rodas.ADDING, rodas.STAGES + 1):
        assert stage[i] - stage[i - 1] == pytest.approx(np.eye(rodas.STAGES)[i - 1])


def test_small_systems():
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(6, 6))
    matrix[0, 0] = 0.0  # needs a pivot
    b = rng.normal(size=6)
    expected = np.linalg.solve(matrix, b)
    pivot = np.zeros(6, dtype=np.int64)
    band = dense_band(matrix)
    assert banded.factorise(band, 6, 5, pivot)
    banded.solve(band, 6, 5, pivot, b)
    assert b == pytest.approx(expected, rel=1e-10)
    assert not banded.factorise(dense_band(np.ones((3, 3))), 3, 2, np.zeros(3, dtype=np.int64))


@native.compiled
def sum_rows(out, matrix, weights):
    linear.weighted_sum(out, matrix, weights)


@native.compiled
def add_part(factor, source, first, target, begin, count):
    linear.add_part(factor, source, first, target, begin, count)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 17])
def test_parts_of_rows(count):
    """To the bit what is written, and nothing beside it."""
    source, target = np.random.default_rng(3).normal(size=(2, 40))
    expected = target.copy()
    linear.add_part(1.7, source, 3, expected, 11, count)
    assert np.all((expected != target) == ((np.arange(40) >= 11) & (np.arange(40) < 11 + count)))
    add_part(1.7, source, 3, target, 11, count)
    assert np.array_equal(target, expected)


@pytest.mark.parametrize(("count", "width"), [(0, 3), (1, 1), (2, 7), (9, 10), (3, 16), (4, 17)])
def test_sums_of_rows(count, width):
    """Eight entries at a time, none beyond the end, in the order of the rows to the bit."""
    rng = np.random.default_rng(2)
    matrix, weights = rng.normal(size=(2, count, width))
    around = np.full(width + 2, 7.0)
    sum_rows(around[1:-1], matrix, weights)
    expected = np.zeros(width)
    for row, factors in zip(matrix, weights, strict=True):
        expected += row * factors
    assert np.array_equal(around, [7.0, *expected, 7.0])


def dense_band(matrix):
    """A dense matrix as the stages' systems keep it."""
    n = len(matrix)
    band = np.zeros((n, 3 * n - 2))
    for r in range(n):
        band[r, n - 1 - r : 2 * n - 1 - r] = matrix[r]
    return band


# --------------------------------------------------------------------------------- the closed loop


def three_channels():
    """The first, fifth and last of the ten channels, with more crosstalk between them."""
    p, some = ten_channels(), [0, 4, 9]
    three = {key: np.array(p[key])[some] for key in ("price", "utility_weight", "gain")}
    three["noise_power"] = np.array(p["noise_power"])[some]
    three["system_matrix"] = 20.0 * np.array(p["system_matrix"])[np.ix_(some, some)]
    three["total_power_limit"] = 0.9
    return three


@dataclass(frozen=True, eq=False)
class Misled(FullyDistributed):
    """The law, with estimates that start elsewhere than at the true actions."""

    estimates: tuple = ()

    def initial_memory(self, y):
        return np.concatenate([np.ravel(self.estimates), y])


def channels(agents, epsilon, gain=1.0, y=0.2, law=None, **options):
    law = law or FullyDistributed(graphs.line(3), epsilon, gain)
    game = osnr_game(**three_channels())
    state = agents.equilibrium(np.broadcast_to(y, 3).astype(float))
    options = {"integrator": "rosenbrock", **options}
    return System("channels", game, agents, law, 0.1, state, **options)


def flat(rows, memory, n):
    """Samples in the layout of reference.py; its agents have the first n states."""
    agents = rows.shape[1]
    off = ~np.eye(agents, dtype=bool)
    return np.array([
        reference.pack(x[:, :n], one[agents * agents :])
        .tolist() + list(one[: agents * agents].reshape(agents, agents)[off])
        for x, one in zip(rows, memory, strict=True)
    ])  # fmt: skip


def expected(system, agent, game, times, epsilon, gain):
    """SciPy's Radau at tight tolerance on the oracle's rate."""
    rate = reference.closed_loop_rate(
        agent, "fully_distributed", game, system.rho,
        laplacian=np.array(system.law.graph.laplacian), k=gain, epsilon=epsilon,
    )  # fmt: skip
    z, estimates = reference.consensus_start(system.start, with_z=True)
    start = reference.pack(system.state[:, : agent.n], z, estimates)
    solution = solve_ivp(
        rate, (0.0, times[-1]), start, "Radau", t_eval=times, rtol=1e-8, atol=1e-10
    )
    assert solution.success
    return solution.y.T


@pytest.mark.parametrize("epsilon", [1e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("kind", [pytest.param("integrator", marks=pytest.mark.slow), "pi_cascade"])
def test_channels_agree_with_scipy(kind, epsilon):
    agents, oracle = {
        "integrator": (integrators(3), Integrator()),
        "pi_cascade": (pi_cascades(3), reference_pi(3)),
    }[kind]
    system = channels(agents, epsilon)
    rows, _, memory, loop = run_loop(system, 0.05, 20)
    assert loop.monitor.exit == watch.INSIDE
    want = expected(
        system, oracle, reference_osnr(three_channels()), np.arange(21) * 0.05, epsilon, 1.0
    )
    assert np.max(np.abs(flat(rows, memory, oracle.n) - want)) < 1e-6
    assert abs(want[-1, 0] - 0.2) > 5e-3  # something happened


def test_a_start_within_1e_10_of_a_bound_is_followed():
    """The law acts there within 1e-12 s, before z moves: the first steps are shorter still."""
    agents, y = pi_cascades(3), np.array([0.2, 1e-10, 0.1])
    system = channels(agents, 1e-5, y=y)
    rows, _, memory, loop = run_loop(system, 0.02, 5)
    assert loop.monitor.exit == watch.INSIDE
    want = expected(
        system, reference_pi(3), reference_osnr(three_channels()), np.arange(6) * 0.02, 1e-5, 1.0
    )
    assert np.max(np.abs(flat(rows, memory, 2) - want)) < 1e-6


@pytest.mark.slow
def test_robots_agree_with_scipy():
    y = np.array([1.0, 0.5, 1.5])
    numbers = {key: values[:3] for key, values in UNEQUAL.items()}
    law = FullyDistributed(graphs.line(3), 1e-2, 0.3)
    system = robot_system(robot_state(y, extension=0.3), numbers, law=law, integrator="rosenbrock")
    rows, _, memory, _ = run_loop(system, 0.1, 15)
    game = reference_games.VelocityGame(V0, [3.0] * 3)
    want = expected(system, reference_robots(numbers), game, np.arange(16) * 0.1, 1e-2, 0.3)
    assert np.max(np.abs(flat(rows, memory, 3) - want)) < 5e-6


@pytest.mark.slow  # compiles two loops for a game of its own
def test_actions_of_several_entries_and_curved_constraints():
    game = Game(
        "coupled", coupled_game, np.array([0.3]), coupled_game.SIZES, [[0, 1, 2]] * 3,
        coupled_game.IN_CONSTRAINT, ("ball", "product"),
    )  # fmt: skip
    law = FullyDistributed(graphs.line(3), 0.05, 0.7)
    agents = Agents(pi_cascades(4).kind, pi_cascades(4).parameters, np.full(4, np.inf))
    state = agents.equilibrium(np.array([0.5, 0.8, 0.6, -0.3]))
    got, want = (
        run_loop(System("c", game, agents, law, 0.1, state, integrator=how), 1e-3, 1000, every=50)
        for how in ("rosenbrock", "rk4")
    )
    for ours, other in zip(got[:3], want[:3], strict=True):
        assert np.max(np.abs(ours - other)) < 3e-6


@pytest.mark.slow
def test_input_limit():
    limited = Agents(pi_cascades(3).kind, pi_cascades(3).parameters, np.full(3, 0.3))
    got, want = (
        run_loop(channels(limited, 1e-2, integrator=how), 1e-3, 1000, every=50)
        for how in ("rosenbrock", "rk4")
    )
    assert np.max(np.abs(got[0] - want[0])) < 1e-5
    assert np.max(np.abs(got[1])) == 0.3
    assert got[3].monitor.saturated == 1.0


def test_steps_hardly_depend_on_epsilon():
    counts = []
    for epsilon in (1e-2, 1e-4, 1e-6, 1e-8):
        loop = channels(pi_cascades(3), epsilon, 0.1).closed_loop(clock(0.05, 30.0))
        loop.advance(600, 1)
        assert loop.monitor.exit == watch.INSIDE
        counts.append(loop.steps[0])
    assert max(counts) < 1.5 * min(counts)
    assert max(counts) < 150


def test_samples_do_not_depend_on_how_a_run_is_divided():
    system = channels(pi_cascades(3), 1e-3)
    whole = system.closed_loop(clock(0.01))
    parts = system.closed_loop(clock(0.01))
    one = whole.advance(40, 5)
    several = [parts.advance(count, 5) for count in (1, 9, 0, 30)]
    ends = whole.finish(), parts.finish()
    for name in ("state", "input", "memory"):
        pieces = np.concatenate([getattr(samples, name) for samples in several])
        assert np.array_equal(getattr(one, name), pieces)
        assert np.array_equal(*(getattr(end, name) for end in ends))
    assert np.array_equal(whole.monitor, parts.monitor)
    assert whole.steps == parts.steps


def exit_of(loop):
    monitor = loop.monitor
    codes = (monitor.exit, monitor.exit_agent, monitor.exit_constraint)
    return (*map(int, codes), monitor.exit_time)


@pytest.mark.slow
def test_an_estimate_that_leaves():
    # Agent 0 hears at once that channel 1 sends more than it thought, and only through agent 1,
    # who is as wrong as itself, that channel 2 sends less: in between its sum exceeds the limit.
    y = np.array([0.3, 0.4, 0.05])
    estimates = ((0.3, 0.05, 0.5), (0.05, 0.4, 0.4), (0.3, 0.4, 0.05))
    law = Misled(graphs.line(3), 1e-2, 0.1, estimates=estimates)
    ours = run_loop(channels(integrators(3), 0, y=y, law=law), 1e-2, 100)[3]
    code, agent, constraint, time = exit_of(ours)
    assert (code, agent, constraint) == (watch.ESTIMATE_LEFT, 0, 3)
    assert 0.0 < time < 0.01
    # an RK4 run at 1e-5 s says 0.00258
    assert time == pytest.approx(0.00258, abs=2e-5)
    assert ours.time == time
    last = ours.finish()
    assert np.all(np.isfinite(last.state))
    assert len(ours.advance(5, 1).input) == 0  # it has ended


@pytest.mark.slow
def test_the_true_profile_leaves():
    # With estimates slower than the actions everyone goes on spending power that is not there.
    law = Misled(graphs.line(3), 1e3, 5.0, estimates=((0.01,) * 3,) * 3)
    system = channels(integrators(3), 0, y=0.01, law=law)
    loop = run_loop(system, 1e-2, 500)[3]
    code, agent, constraint, time = exit_of(loop)
    assert (code, agent, constraint) == (watch.LEFT_SET, -1, 3)
    assert time > 0.0


def test_a_start_with_an_estimate_outside_is_refused():
    law = Misled(graphs.line(3), 1e-2, 1.0, estimates=((0.2,) * 3, (0.2, 0.2, 0.9), (0.2,) * 3))
    with pytest.raises(InfeasibleStart, match=r"initial estimates of agent 2 .*'total power'"):
        channels(integrators(3), 0, law=law)


@pytest.mark.slow
def test_close_to_the_boundary():
    law = distributed("line", 1e-4, 1.0, 5)
    system = robot_system(
        robot_state([1e-6, 0.5, 0.0, 0.5, 2.0]), EQUAL, law=law, integrator="rosenbrock"
    )
    loop = run_loop(system, 1e-2, 100)[3]
    assert loop.monitor.exit == watch.INSIDE
    assert loop.steps[0] < 300
