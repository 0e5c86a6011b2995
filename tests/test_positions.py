"""Robots whose outputs are positions with a look-ahead: theory, and every engine and mode."""

import numpy as np
import pytest
from builders import (
    UNEQUAL,
    position_robots,
    reference_position_robots,
    relative_error,
    run_loop,
    with_damping,
)
from reference_agents import PositionRobot

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InfeasibleStart
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.margins import influence
from gne_mj.passivity import examine
from gne_mj.passivity.examine import plants_of
from gne_mj.passivity.report import NO_VIOLATION, VIOLATED
from gne_mj.plants import position_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.fleet_plant import build_fleet
from gne_mj.plants.ode import OdePlant
from gne_mj.system import System

TAU, BOUND = 0.7, np.array([2.0, 1.5, 2.5, 2.0, 1.8])
Y, V = np.array([1.0, 0.2, -0.6, 0.4, 1.1]), np.array([0.5, -0.3, 0.8, 0.1, -0.4])
ORACLE = reference_position_robots(UNEQUAL, TAU)


def start(y=Y, v=V, extension=(0.3, -0.2, 0.0, 0.5, -0.4), spread=0.6):
    """Kicked: masses at y - tau v, appendages on ways of their own."""
    return ORACLE.states(extension, v, v - spread * np.sign(v), y - TAU * v)


def system_of(state=None, law=None, agents=None, bound=BOUND, rho=0.1, **options):
    """Robots that keep between each other, and the first one and the reference, bounded gaps."""
    game = velocity_game(5, 0.0, bound)
    agents = agents or position_robots(UNEQUAL, TAU)
    state = start() if state is None else state
    return System("robots", game, agents, law or FullInformation(), rho, state, **options)


def oracle_rate(rho=0.1):
    game = reference_games.VelocityGame(0.0, BOUND)
    return reference.closed_loop_rate(ORACLE, "full_information", game, rho)


# ------------------------------------------------------------------------------- what is proven


def drawn(rng, many):
    """So many robots with numbers of their own: the oracle at the least damping that is proven."""
    names = ("main_mass", "appendage_mass", "stiffness", "atan_coefficient", "damping")
    numbers = {name: np.exp(rng.uniform(-2, 2, many)) for name in names}
    return numbers, float(np.exp(rng.uniform(-1, 1)))


def differences(robot, rng, many):
    """(dV(x) - dV(x'))'(f(x) - f(x')) of pairs of states, one a robot, over its size."""
    found = []
    for _ in range(2):
        s, v, w, q = rng.normal(size=(4, many)) * np.exp(rng.uniform(-3, 3, (4, many)))
        x = robot.states(s, v, w, q)
        rates = robot.rate(x, np.zeros(many))
        acceleration = (rates[:, 1] - rates[:, 3]) / robot.tau
        found.append((robot.stored_gradient(x), rates, acceleration))
    gradient = found[0][0] - found[1][0]
    rates = found[0][1] - found[1][1]
    rates[:, 1] = found[0][2] - found[1][2]
    products = gradient * rates
    return products.sum(axis=1) / np.abs(products).sum(axis=1)


def test_passivity_of_differences_at_the_least_damping_and_not_below():
    rng, many = np.random.default_rng(0), 100_000
    numbers, tau = drawn(rng, many)
    worst = {}
    for share in (1.0, 0.9):
        lookahead, damping = with_damping(numbers, tau, share)
        robot = PositionRobot(*numbers.values(), lookahead=lookahead, local_damping=damping)
        worst[share] = np.max(differences(robot, np.random.default_rng(1), many))
    assert worst[1.0] <= 1e-12
    assert worst[0.9] > 1e-3


def test_the_storage_functions_gradient_and_rate():
    """Its slope along the input is y, and V' = y u less the quadratic form of the proof."""
    rng, h = np.random.default_rng(2), 1e-6
    M, m, gamma = ORACLE.main_mass, ORACLE.appendage_mass, ORACLE.damping
    agents, rest = position_robots(UNEQUAL, TAU), np.zeros((5, 4))
    for _ in range(20):
        s, v, w, q = rng.normal(0, 2, (4, 5))
        u = rng.normal(0, 3, 5)
        x = ORACLE.states(s, v, w, q)
        ahead, behind = (agents.storage(ORACLE.states(s, v + side, w, q), rest) for side in (h, -h))
        assert np.allclose((ahead - behind) / (2 * h) / M, x[:, 1], rtol=1e-7, atol=1e-7)
        rates = ORACLE.rate(x, u)
        change = agents.storage(x + h * rates, rest) - agents.storage(x - h * rates, rest)
        bracket = (TAU * ORACLE.d - M - m) * v**2 + m * v * (v - w) + TAU * gamma * (v - w) ** 2
        assert np.allclose(change / (2 * h), x[:, 1] * u - bracket, rtol=1e-6, atol=1e-6)


def test_the_default_damping_and_what_certificates_know_of_it():
    for share, met in ((1.2, True), (1.0001, True), (1.0, False), (0.9, False)):
        table = position_robots(UNEQUAL, TAU, share).parameters
        assert position_robot.is_passive(table) is met
        assert bool(position_robot.why_not_passive(table)) is not met
    table = position_robots(UNEQUAL, TAU).parameters.copy()
    table[3, 6] = 0.25
    for dimension, agent in ((1, 4), (2, 2)):
        told = position_robot.why_not_passive(table, dimension)
        assert told.startswith(f"local_damping 0.25 N s/m of agent {agent} must exceed")


@pytest.mark.parametrize(("share", "status"), [(1.0, NO_VIOLATION), (0.3, VIOLATED)])
def test_experiments_agree(share, status):
    build = plants_of(position_robots(UNEQUAL, TAU, share), "ode", "rk4")
    bound = np.full(5, 2.0)
    report = examine(build, 0.01, duration=8.0, trials=24, outputs=(-bound, bound))
    assert report.status == status, report


# ------------------------------------------------------------------------- engines and modes


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_continuous_equals_a_plain_rk4(engine):
    h, steps = 0.004, 1500
    expected = reference.rk4_fixed(oracle_rate(), start().ravel(), h, steps)
    states, _, _, loop = run_loop(system_of(engine=engine), h, steps)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.divided == 0
    assert relative_error(states.reshape(len(expected), -1), expected) < 1e-11


def test_continuous_is_close_to_dop853():
    times = np.linspace(0.0, 4.0, 9)
    exact = reference.dop853(oracle_rate(), start().ravel(), times)
    states, *_ = run_loop(system_of(engine="mujoco"), 2e-3, 2000, every=250)
    assert relative_error(states.reshape(len(exact), -1), exact) < 1e-9


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_euler_is_semi_implicit_and_positions_are_means(engine):
    h, steps, game = 0.005, 400, reference_games.VelocityGame(0.0, BOUND)
    expected = [start()]
    for _ in range(steps):
        u = reference.full_information(game, 0.1, expected[-1][:, 1])
        expected.append(ORACLE.euler(expected[-1], u, h))
    states, *_ = run_loop(system_of(engine=engine, integrator="euler"), h, steps)
    assert relative_error(states, np.array(expected)) < 1e-11
    y, q = states[1:, :, 1], states[:, :, 3]
    mean = (q[:-1] + h / TAU * y) / (1 + h / TAU)
    assert relative_error(q[1:], mean) < 1e-12


RING = graphs.ring(5)
LAWS = {
    "partial": PartialInformation(RING, 2.0, 0.05),
    "distributed": FullyDistributed(RING, 0.02, 1.0),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    ("mode", "integrator"), [("continuous", "rk4"), ("sampled", "rk4"), ("implicit", "euler")]
)
def test_every_law_and_mode_in_mujoco_as_the_ode(law, mode, integrator):
    bound, h, steps = 4.0 * BOUND, 0.002, 500
    found = {}
    for engine in ("mujoco", "ode"):
        system = system_of(
            law=LAWS[law], bound=bound, engine=engine, mode=mode, integrator=integrator
        )
        *found[engine], loop = run_loop(system, h, steps, control=2 * h, every=10)
        assert loop.monitor.exit == watch.INSIDE
        assert loop.monitor.positions_outside == 0
    for got, expected in zip(found["mujoco"], found["ode"], strict=True):
        assert relative_error(got, expected) < 1e-9


def test_the_adaptive_method_looks_at_positions_too():
    law, found = LAWS["distributed"], {}
    for integrator in ("rosenbrock", "rk4"):
        system = system_of(law=law, bound=4.0 * BOUND, integrator=integrator)
        states, _, _, loop = run_loop(system, 0.002, 500, every=50)
        seen = loop.monitor
        assert seen.exit == watch.INSIDE
        assert seen.positions >= seen.steps + 1  # rows in between are looked at as well
        assert seen.positions_outside == 0
        found[integrator] = states, seen.positions_worst
    assert relative_error(found["rosenbrock"][0], found["rk4"][0]) < 1e-5
    assert found["rosenbrock"][1] == pytest.approx(found["rk4"][1], rel=1e-3)


@pytest.mark.parametrize("mujoco", [True, False])
def test_the_one_step_map_of_mode_implicit(mujoco):
    """dy+/du = (h/M)(tau + h), of Euler's step."""
    agents, h = position_robots(UNEQUAL, TAU), 0.01
    plant = build_fleet(agents, h, "euler") if mujoco else OdePlant(agents, h, "euler")
    reached = []
    for u in (-3.0, 5.0):
        plant.reset(start())
        plant.step(np.full(5, u))
        reached.append(plant.output)
    slope = h / ORACLE.main_mass * (TAU + h)
    assert np.allclose((reached[1] - reached[0]) / 8.0, slope, rtol=1e-11)
    assert np.allclose(influence(agents, h, "euler", 1).least_slope, slope, rtol=1e-12)


@pytest.mark.parametrize(("integrator", "steps"), [("euler", 1), ("euler", 6), ("rk4", 4)])
def test_bounds_of_the_map_over_a_period(integrator, steps):
    """The gains of pushes and readings and the least slope bound what trials show."""
    agents, h, rng = position_robots(UNEQUAL, TAU), 0.01, np.random.default_rng(3)
    effect = influence(agents, h, integrator, steps)
    plant = OdePlant(agents, h, integrator)

    def reached(state, u):
        plant.reset(state)
        plant.step(u, steps)
        return plant.output

    for _ in range(20):
        state = ORACLE.states(*rng.normal(0, 2, (4, 5)))
        u, read = rng.normal(0, 2, 5), state.copy()
        moved = reached(state, u + 1.0) - reached(state, u)
        assert np.all(moved >= effect.least_slope * (1 - 1e-9))
        assert np.all(moved <= effect.push_gain * (1 + 1e-9))
        read[:, 1] += 1e-3
        off = np.abs(reached(read, u) - reached(state, u))
        assert np.all(off <= 1e-3 * effect.noise_gain * (1 + 1e-9))


# ------------------------------------------------------------------------ where positions are


def edge_start(rng, near):
    """Outputs and positions whose gaps use up all of their bounds but the part ``near``."""
    ways = rng.choice([-1.0, 1.0], (2, 5)) * (1.0 - near)
    y, q = np.cumsum(ways * BOUND, axis=1)
    v = (y - q) / TAU
    return ORACLE.states(rng.uniform(-2, 2, 5), v, v + rng.normal(0, 3, 5), q)


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
@pytest.mark.parametrize(
    ("mode", "integrator"), [("implicit", "euler"), ("continuous", "rk4"), ("continuous", "euler")]
)
def test_positions_stay_inside_from_the_very_edge(engine, mode, integrator):
    rng, steps = np.random.default_rng(4), 100
    h, nearest = (0.02, 1e-6) if mode == "implicit" else (0.002, 1e-4)
    for near in (nearest, 1e-2):
        system = system_of(
            edge_start(rng, near), engine=engine, mode=mode, integrator=integrator, rho=0.01
        )
        states, _, _, loop = run_loop(system, h, steps)
        seen = loop.monitor
        assert seen.exit == watch.INSIDE
        assert seen.positions == seen.steps + 1  # once at the start of each piece, and at the end
        assert seen.steps >= steps
        assert seen.positions_outside == 0
        at_samples = system.game.constraints(states[:, :, 3])
        assert np.all(at_samples < 0)
        assert seen.positions_worst >= np.max(at_samples) - 1e-12
        if mode == "implicit":
            assert seen.positions_worst == pytest.approx(np.max(at_samples), rel=1e-9)


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_positions_that_leave_are_counted(engine):
    """With look-aheads that differ nothing keeps coupled positions: the monitor must see it."""
    table = position_robots(UNEQUAL, TAU).parameters.copy()
    table[:, 5] = 0.3, 3.0, 0.3, 3.0, 0.3
    table[:, 6] = 1.2 * position_robot.least_damping(table)
    agents = Agents(position_robot, table, np.full(5, np.inf))
    y, q = np.full(5, 1.8), np.full(5, -1.8)
    velocity = (y - q) / table[:, 5]
    state = np.column_stack([np.zeros(5), y, velocity, q])
    system = system_of(state, agents=agents, engine=engine, integrator="euler", mode="implicit")
    states, _, _, loop = run_loop(system, 0.01, 300)
    g = system.game.constraints(states[:, :, 3])
    outside = np.any(g > 0, axis=1)
    assert 0 < np.sum(outside) < len(outside)
    assert loop.monitor.positions_outside == np.sum(outside)
    assert loop.monitor.positions == len(outside)
    worst = np.unravel_index(np.argmax(g), g.shape)
    assert loop.monitor.positions_worst == pytest.approx(g[worst], rel=1e-9)
    assert loop.monitor.positions_constraint == worst[1]
    assert loop.monitor.positions_worst_time == pytest.approx(0.01 * worst[0])


def test_a_start_with_positions_outside_is_refused():
    y, q = Y, Y + np.array([0.0, 4.0, 0.0, 0.0, 0.0])
    v = (y - q) / TAU
    with pytest.raises(InfeasibleStart, match=r"initial positions .*'gap of agent 3'"):
        system_of(ORACLE.states(0.0, v, v, q))


def test_the_reference_moves_only_where_it_is_seen():
    """Motions beside references of any velocity are the same, and MuJoCo's robots really move."""
    found = []
    for v_0 in (0.0, 3.0, -20.0):
        agents = position_robots(UNEQUAL, TAU, v_0=v_0)
        system = system_of(agents=agents, engine="mujoco")
        states, _, _, loop = run_loop(system, 0.005, 400)
        found.append(states)
        place = loop.plant.data.qpos[loop.plant.places.main_q]
        assert np.allclose(place, states[-1, :, 3] + v_0 * 2.0, atol=1e-12)
    for states in found[1:]:
        assert relative_error(states, found[0]) < 1e-11
