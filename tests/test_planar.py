"""Agents of two channels each: planar robots in MuJoCo and as ODE against plain integrations."""

import json

import mujoco
import numpy as np
import pytest
from builders import (
    clock,
    pi_cascades,
    random_consensus,
    relative_error,
    robot_state,
    run_loop,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_agents import FlexibleRobot

import reference
import reference_games
from gne_mj import plots
from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_consensus_game
from gne_mj.loops import monitor as watch
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.plants.ode import OdePlant
from gne_mj.scenario import load_scenario, run
from gne_mj.system import System

EDGES = [(0, 1), (1, 2), (2, 0), (2, 3)]
WEIGHT = [1.0, 0.0, 0.0, 0.5]
V_0 = [1.0, -0.5]
DELTA = [2.0, 1.5, 2.5, 2.0, 3.0, 2.5]
RHO = 0.1
EDGES_COUNT = len(EDGES)


def game():
    return velocity_consensus_game(EDGES, WEIGHT, V_0, DELTA[:EDGES_COUNT], DELTA[EDGES_COUNT:])


def oracle():
    return reference_games.VelocityConsensusGame(V_0, EDGES, WEIGHT, DELTA)


def numbers(seed=0):
    """Unequal robots, springs and dampers of each axis unequal too; masses as they must be."""
    rng = np.random.default_rng(seed)
    table = np.column_stack([rng.uniform(0.4, 3.0, 8) for _ in flexible_robot.PARAMETERS])
    table[1::2, :2] = table[::2, :2]
    return table


def fleet(table=None, limit=np.inf):
    table = numbers() if table is None else table
    return Agents(flexible_robot, table, np.full(len(table), limit), dimension=2)


def interior(rng, used=0.95, spread=2.0):
    """(8, 4) states: a profile that uses up to a part of a bound, masses apart and moving so."""
    it = oracle()
    away = rng.normal(size=it.N)
    y = np.tile(V_0, 4) + away
    widest = max(np.linalg.norm(it.gap(k, y)) / it.delta[k] for k in range(it.p))
    y = np.tile(V_0, 4) + away * rng.uniform(0.3, used) / widest
    return robot_state(
        y, extension=rng.uniform(-1, 1, 8), appendage=y + rng.uniform(-spread, spread, 8),
        position=rng.uniform(-5, 5, 8),
    )  # fmt: skip


def system(state, engine, **options):
    return System(
        "robots", game(), options.pop("agents", fleet()), FullInformation(), RHO, state,
        engine=engine, **options,
    )  # fmt: skip


def expected_rate():
    robot = FlexibleRobot(*numbers().T)
    return reference.closed_loop_rate(robot, "full_information", oracle(), RHO)


both = pytest.mark.parametrize("engine", [pytest.param("mujoco", marks=pytest.mark.slow), "ode"])


@both
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 3))])
def test_rk4_equals_a_plain_rk4(engine, seed):
    state, h, steps = interior(np.random.default_rng(seed), used=0.8), 0.005, 2000
    expected = reference.rk4_fixed(expected_rate(), state[:, :3].ravel(), h, steps)
    states, _, _, loop = run_loop(system(state, engine), h, steps)
    assert loop.monitor.exit == watch.INSIDE
    assert relative_error(states[:, :, :3].reshape(len(expected), -1), expected) < 1e-11


@both
def test_the_position_is_the_velocitys_integral(engine):
    state = interior(np.random.default_rng(5), used=0.8)
    states, *_ = run_loop(system(state, engine), 0.005, 1000)
    travelled = np.trapezoid(states[:, :, 1], dx=0.005, axis=0)
    assert np.allclose(states[-1, :, 3] - states[0, :, 3], travelled, rtol=0, atol=1e-4)
    assert np.allclose(states[0], state, rtol=0, atol=1e-15)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_fleet_over_any_graph_stays_inside(seed):
    """At every step: inside, V never rising; and what the monitor kept is what the samples show."""
    draw = random_consensus(seed, 2, tightest=1.0)
    rng, count = draw.rng, draw.oracle.agents
    table = np.repeat(rng.uniform(0.5, 2.0, (count, len(flexible_robot.PARAMETERS))), 2, axis=0)
    y = draw.interior(used=0.9)
    state = robot_state(
        y, extension=rng.uniform(-1, 1, 2 * count),
        appendage=y + rng.uniform(-4, 4, 2 * count),
    )  # fmt: skip
    fleet_of = Agents(flexible_robot, table, np.full(2 * count, np.inf), dimension=2)
    drawn = System("robots", draw.game, fleet_of, FullInformation(), RHO, state)
    states, _, _, loop = run_loop(drawn, 0.002, 1500)
    assert loop.monitor.exit == watch.INSIDE
    worst = loop.monitor.worst
    g = np.array([reference.constraints(draw.oracle, row) for row in states[:, :, 1]])
    assert np.all(worst < 0)
    sampled = np.max(g, axis=0)
    assert np.all(worst >= sampled - 1e-13)
    if loop.monitor.divided == 0:  # else pieces of steps were seen too
        assert np.allclose(worst, sampled, rtol=0, atol=1e-13)
    assert loop.monitor.storage_rise <= 1e-9 * max(1.0, loop.monitor.storage_start)


@pytest.mark.slow
def test_rk4_is_of_fourth_order_in_mujoco():
    state, end = interior(np.random.default_rng(6), used=0.6), 1.0
    exact = reference.dop853(expected_rate(), state[:, :3].ravel(), np.array([0.0, end]))[-1]
    errors = []
    for h in (0.005, 0.0025, 0.00125):  # longer ones are divided
        states, *_ = run_loop(system(state, "mujoco"), h, round(end / h))
        errors.append(np.max(np.abs(states[-1, :, :3].ravel() - exact)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 4.0) < 0.35), (errors, orders)
    assert errors[-1] < 1e-6


@pytest.mark.parametrize("count", [10, pytest.param(50, marks=pytest.mark.slow)])
def test_right_hand_sides_at_random_interior_states(count):
    """MuJoCo's accelerations and the ODE's rates against the slow ones, to rounding."""
    rng = np.random.default_rng(7)
    rate = expected_rate()
    for _ in range(count):
        state = interior(rng)
        expected = rate(0.0, state[:, :3].ravel()).reshape(8, 3)
        running = system(state, "mujoco", integrator="euler").closed_loop(clock(0.001))
        recorded = running.advance(1, 1)
        plant = running.plant
        places = plant.places
        got = np.empty((8, 3))
        got[:, 0] = state[:, 1] - state[:, 2]
        got[:, 1] = plant.data.qacc[places.main_v]
        got[:, 2] = plant.data.qacc[places.appendage_v]
        assert relative_error(got, expected) < 1e-12
        u = reference.full_information(oracle(), RHO, state[:, 1])
        assert relative_error(recorded.input[0], u) < 1e-12
        ode = np.empty((8, 4))
        for r, row in enumerate(numbers()):
            flexible_robot.rate(row, state[r], recorded.input[0, r], ode[r])
        assert relative_error(ode[:, :3], expected) < 1e-12


def test_both_engines_sample_and_hold_alike():
    state = interior(np.random.default_rng(8), used=0.7)
    runs = [
        run_loop(system(state, engine, mode="sampled", integrator="euler"), 0.002, 2000, 0.01)
        for engine in ("mujoco", "ode")
    ]
    assert relative_error(runs[0][0], runs[1][0]) < 1e-11
    assert relative_error(runs[0][1], runs[1][1]) < 1e-11
    assert np.all(runs[0][1][1:5] == runs[0][1][0])


def test_each_channel_has_its_own_limit():
    state = interior(np.random.default_rng(9), used=0.9)
    limit = np.tile([0.2, 0.4], 4)
    agents = Agents(flexible_robot, numbers(), limit, dimension=2)
    for engine in ("mujoco", "ode"):
        _, u, *_ = run_loop(system(state, engine, agents=agents), 0.002, 100)
        assert np.all(np.abs(u) <= limit)
        assert np.any(np.abs(u[:, ::2]) == 0.2)
        assert np.any(np.abs(u[:, 1::2]) == 0.4)


def test_channels_are_the_models_elements():
    table = numbers()
    plant = MujocoPlant(fleet(table), 0.002)
    model = plant.model
    assert (model.nq, model.nu) == (16, 8)
    for r in range(8):
        robot, axis = r // 2 + 1, "xy"[r % 2]
        joint = model.joint(f"robot_{robot}/position_{axis}")
        assert plant.places.main_q[r] == joint.qposadr[0]
        assert joint.axis.tolist() == [float(axis == "x"), float(axis == "y"), 0.0]
        assert plant.places.actuator[r] == model.actuator(f"robot_{robot}/force_{axis}").id
        spring = model.tendon(f"robot_{robot}/spring_{axis}")
        assert model.tendon_stiffness[spring.id].ravel()[0] == table[r, 2]
        assert model.tendon_damping[spring.id].ravel()[0] == table[r, 4]
        assert model.body(f"robot_{robot}/main").mass[0] == table[r, 0]
        assert model.body(f"robot_{robot}/appendage").mass[0] == table[r, 1]
    state = interior(np.random.default_rng(10))
    plant.reset(state)
    assert np.allclose(plant.state, state, rtol=0, atol=1e-15)
    mujoco.mj_forward(model, plant.data)
    for r in (0, 3):
        sensor = plant.data.sensor(f"robot_{r // 2 + 1}/velocity_{'xy'[r % 2]}")
        assert sensor.data[0] == state[r, 1]


def test_open_loop_with_and_without_decoration():
    rng = np.random.default_rng(11)
    state, agents = interior(rng), fleet()
    plants = [
        MujocoPlant(agents, 0.002),
        MujocoPlant(agents, 0.002, decorated=False),
        OdePlant(agents, 0.002),
    ]
    for plant in plants:
        plant.reset(state)
    for _ in range(200):
        force = rng.normal(0.0, 5.0, 8)
        for plant in plants:
            plant.step(force)
    assert plants[1].model.ngeom == 0
    assert np.array_equal(plants[0].state, plants[1].state)
    assert relative_error(plants[0].state, plants[2].state) < 1e-11


def test_masses_that_differ_between_axes_are_refused():
    table = numbers()
    table[3, 1] += 0.1
    with pytest.raises(InvalidInput, match="same on all axes"):
        compose(table, dimension=2)
    with pytest.raises(InvalidInput, match="one or two axes"):
        compose(np.ones((6, 5)), dimension=3)
    with pytest.raises(InvalidInput, match="divide the 8 channels"):
        Agents(flexible_robot, numbers(), np.ones(8), dimension=3)
    lane = compile_model(compose(numbers()[:2]), timestep=0.01, integrator="Euler")
    assert lane.joint("robot_2/position").type[0] == mujoco.mjtJoint.mjJNT_SLIDE


# ------------------------------------------------------------------------------- scenarios


@pytest.fixture(scope="module")
def shipped():
    return run("planar-sync")


def test_the_shipped_scenario(shipped):
    report, data = shipped.reports["robots"], shipped["robots"]
    assert shipped.status == "converged"
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    assert report["epsilon"]["p_rho_affine"] is None
    assert 0.9 < report["worst_gap"]["gap"] / report["worst_gap"]["bound"] < 1.0
    assert np.allclose(report["equilibrium"]["penalised"], np.tile([1.0, 0.5], 6), atol=1e-10)
    y = data["action"].to_numpy().reshape(-1, 6, 2)
    edges = np.array([[1, 2], [2, 3], [1, 3], [3, 4], [4, 5], [5, 6], [4, 6], [2, 5]]) - 1
    gaps = np.linalg.norm(y[:, edges[:, 0]] - y[:, edges[:, 1]], axis=2)
    to_v0 = np.linalg.norm(y[:, [0, 5]] - [1.0, 0.5], axis=2)
    assert np.allclose(data["gap"], np.concatenate([gaps, to_v0], axis=1), rtol=1e-14, atol=1e-15)
    assert data["gap_bound"].to_numpy().tolist() == [1.5] * 8 + [2.0] * 2


def test_its_dataset_says_whose_and_along_which_axis(shipped):
    data = shipped["robots"]
    for name in ("action", "input", "position", "extension", "appendage_velocity"):
        assert data[name].dims == ("time", "action"), name
    assert data["gap"].dims == ("time", "constraint")
    assert data["owner"].to_numpy().tolist() == np.repeat(range(1, 7), 2).tolist()
    assert data["axis"].to_numpy().tolist() == ["x", "y"] * 6
    assert data["input"].attrs["units"] == "N"
    second = data["action"].where((data["owner"] == 2) & (data["axis"] == "y"), drop=True)
    assert second.to_numpy()[0].tolist() == [0.4]
    assert data["position"].to_numpy()[0].reshape(6, 2)[1].tolist() == [1.5, 2.6]


def test_its_figures(shipped, tmp_path):
    figures = plots.draw(shipped)
    assert set(figures) == {"robots-velocities", "robots-gaps", "robots-constraints"}
    panels = figures["robots-velocities"].axes
    assert [panel.get_ylabel() for panel in panels] == [
        f"velocity $y_{{i,{axis}}}$ (m/s)" for axis in "xy"
    ]
    y = shipped["robots"]["action"].to_numpy()
    for axis, panel in enumerate(panels):
        drawn = np.array([line.get_ydata() for line in panel.get_lines()])
        assert np.array_equal(drawn, y[:, axis::2].T)
    (gaps,) = figures["robots-gaps"].axes
    assert len(gaps.get_lines()) == 10 + 2  # and each bound once
    assert [line.get_ydata()[0] for line in gaps.get_lines()[10:]] == [1.5, 2.0]
    assert len(plots.save(shipped, tmp_path)) == 3


def test_the_ode_engine_ends_likewise(shipped):
    other = run("planar-sync", {"plant.engine": "ode", "simulation.duration": 5.0})
    until = len(other["robots"]["time"])
    got, expected = other["robots"]["state"], shipped["robots"]["state"][:until]
    assert relative_error(got.to_numpy(), expected.to_numpy()) < 1e-10


def build(changes):
    return load_scenario("planar-sync", changes).simulation_object().systems[0]


def test_one_number_one_vector_or_one_for_each():
    pairs = [[1.0, 0.5 + 0.1 * i] for i in range(6)]
    for value, expected in (
        (0.75, np.full(12, 0.75)),
        ([1.0, 0.5], np.tile([1.0, 0.5], 6)),
        (pairs, np.ravel(pairs)),
    ):
        built = build({"initial.action": value, "agents.input_limit": value,
                       "initial.extension": value})  # fmt: skip
        assert np.array_equal(built.start, expected)
        assert np.array_equal(built.state[:, 0], expected)
        assert np.array_equal(built.agents.input_limit, expected)
    masses = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    built = build({"agents.main_mass": masses})
    assert np.array_equal(built.agents.parameters[:, 0], np.repeat(masses, 2))
    assert built.agents.dimension == 2


def test_defaults_of_a_game_of_ones_own():
    tables = {
        "systems": {
            "robots": {
                "game": {"type": "velocity-consensus"},
                "agents": {"type": "planar-flexible-robot", "count": 5},
            }
        }
    }
    built = load_scenario(tables).simulation_object().systems[0]
    assert built.game.constraint_names == (
        "gap of agents 1 and 2", "gap of agents 1 and 5", "gap of agents 2 and 3",
        "gap of agents 3 and 4", "gap of agents 4 and 5", "gap of agent 1 to v_0",
    )  # fmt: skip
    assert np.allclose(built.start.reshape(5, 2), [-0.5, 1.0])
    places = built.state[:, 3].reshape(5, 2)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 9 * np.eye(5)
    assert np.min(apart) == pytest.approx(1.5)
    assert np.ptp(places, axis=0).tolist() == [3.0, 1.5]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"initial.action": [1.0, 0.5, 0.0]}, ["initial.action", "one list of 2", "6 lists"]),
        ({"initial.action": [[1.0, 0.5]] * 5}, ["initial.action", "list of 6"]),
        ({"initial.action": [[1.0]] * 6}, ["initial.action", "one list of 2"]),
        ({"initial.action": [[1.0, "a"]] * 6}, ["initial.action.0.1", "'a'", "valid number"]),
        ({"initial.position": "here"}, ["initial.position", "here", "valid number"]),
        ({"agents.input_limit": [1.0, 0.0]}, ["agents.input_limit", "positive"]),
        ({"agents.main_mass": [[1.0, 1.0]] * 6}, ["agents.main_mass", "valid number"]),
        ({"agents.type": "flexible-robot"}, ["agents.type", "1 axis", "have 2"]),
        ({"game.reference_velocity": [1.0]}, ["agents.type", "2 axes", "have 1"]),
        ({"game.edges": [[1, 2], [2, 7]]}, ["game.edges", "[2, 7]", "numbered 1 to 6"]),
        ({"game.edges": "rinq"}, ["game.edges", "rinq"]),
        ({"game.edges": "printed"}, ["agents.count: got 6", "'printed' has 10 agents"]),
        ({"game.leader_weight": 0.0}, ["game.leader_weight", "needs a leader"]),
        ({"game.leader_weight": [1.0, 2.0]}, ["game.leader_weight", "6, one for each agent"]),
        ({"game.gap_bound": [1.0]}, ["game.gap_bound", "8, one for each edge"]),
    ],
)  # fmt: skip
def test_mistakes_are_named(changes, words):
    with pytest.raises(InvalidInput) as caught:
        build(changes)
    message = str(caught.value)
    assert message.startswith("systems.robots."), message
    for word in words:
        assert word in message


@pytest.mark.parametrize("kind", [pytest.param("integrator", marks=pytest.mark.slow), "pi-cascade"])
def test_other_agents_have_as_many_channels_as_the_action_has_entries(kind):
    tables = {
        "simulation": {"duration": 0.5, "timestep": 0.01},
        "systems": {
            "points": {
                "game": {
                    "type": "velocity-consensus", "reference_velocity": [1.0, 2.0, 3.0],
                    "edges": "line",
                },
                "agents": {"type": kind, "count": 3},
            }
        },
    }  # fmt: skip
    done = run(tables)
    assert done.status == "completed"
    data = done["points"]
    assert data.sizes["action"] == 9
    assert data["axis"].to_numpy().tolist() == ["x", "y", "z"] * 3
    assert data["input"].attrs["units"] == "m/s/s"
    assert ("integral" in data) == (kind == "pi-cascade")
    assert json.loads(data.attrs["quantities"]) == ["gap", "constraint"]
    assert len(plots.draw(done)["points-velocities"].axes) == 3


def test_channels_of_one_entry_each_are_the_default():
    assert pi_cascades(4).count == 4
    assert fleet().count == 4
