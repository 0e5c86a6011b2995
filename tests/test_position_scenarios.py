"""Position robots as scenarios have them: keys, starts, certificates, reports, batches, pages."""

import json
from pathlib import Path

import numpy as np
import pytest

import gne_mj as gm
from gne_mj import plots
from gne_mj.batches.chunk import Runner
from gne_mj.batches.plan import make_plan
from gne_mj.batches.sweep import Sweep
from gne_mj.environment import load_environment
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.plants import mjcf_position, position_robot
from gne_mj.plants.ode import OdePlant
from gne_mj.scenario import load_scenario
from gne_mj.summary import summary
from gne_mj.system import Clock
from gne_mj.theory import certify
from gne_mj.viewer.shown_system import ShownSystem

TAU = 0.5
LANE = {
    "simulation": {"duration": 0.4, "timestep": 0.01, "integrator": "euler"},
    "systems": {
        "r": {
            "game": {
                "type": "velocity-synchronization", "reference_velocity": 0.0, "gap_bound": 2.0
            },
            "agents": {
                "type": "flexible-robot", "count": 3, "output": "position", "lookahead": TAU,
                "reference_velocity": 3.0,
            },
            "controller": {"information": "full", "mode": "implicit"},
            "plant": {"engine": "ode"},
            "initial": {"action": [1.0, 0.5, -0.5]},
        }
    },
}  # fmt: skip


def built(**changes):
    """The only system of the scenario, with keys of it changed."""
    scenario = load_scenario(LANE, {key.replace("__", "."): v for key, v in changes.items()})
    return scenario.system_objects()[0]


def test_the_damping_that_is_not_given_is_1_2_times_the_least():
    agents = built(agents__main_mass=[1.0, 2.0, 3.0], agents__damping=0.5).agents
    least = (np.array([1.0, 2.0, 3.0]) + 1.0) / TAU + 1.0 / (4 * TAU**2 * 0.5)
    assert agents.kind is position_robot
    assert np.allclose(agents.parameters[:, 5:].T, [[TAU] * 3, 1.2 * least, [3.0] * 3])
    given = built(agents__local_damping=[1.0, 9.0, 0.0]).agents.parameters[:, 6]
    assert np.array_equal(given, [1.0, 9.0, 0.0])


@pytest.mark.parametrize(
    ("given", "y", "v", "q"),
    [
        ({}, [1.0, 0.5, -0.5], [0, 0, 0], [1.0, 0.5, -0.5]),
        ({"position": [0.5, 0.5, 0.0]}, [1.0, 0.5, -0.5], [1, 0, -1], [0.5, 0.5, 0.0]),
        ({"velocity": [1.0, 0.0, -1.0]}, [1.0, 0.5, -0.5], [1, 0, -1], [0.5, 0.5, 0.0]),
        ({"action": None, "position": 0.3, "velocity": 0.2}, [0.4] * 3, [0.2] * 3, [0.3] * 3),
        ({"action": None, "position": 0.3}, [0.3] * 3, [0.0] * 3, [0.3] * 3),
    ],
)
def test_starts(given, y, v, q):
    table = {**LANE["systems"]["r"]["initial"], **given}
    table = {key: value for key, value in table.items() if value is not None}
    system = built(initial=table)
    assert np.allclose(system.start, y)
    assert np.allclose(system.start_positions, q)
    assert np.allclose(position_robot.velocity(system.agents.parameters, system.state), v)
    assert np.allclose(system.state[:, 2], v)  # appendages move along


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"agents__lookahead": None}, "agents.lookahead", "needs it"),
        ({"agents__output": "velocity"}, "agents.lookahead", "output = 'position'"),
        ({"agents__reference_velocity": [1.0, 2.0]}, "agents.reference_velocity", "a list of 1"),
        ({"agents__local_damping": -1.0}, "agents.local_damping", "negative"),
        ({"agents__damping": 0.0}, "agents.local_damping", "must be given where damping = 0"),
        ({"initial__integral": 1.0}, "initial.integral", "have no integral"),
        (
            {"initial__position": [0.9, 0.5, -0.5], "initial__velocity": 1.0},
            "initial.velocity",
            "action and position say",
        ),
    ],
)
def test_refusals_name_key_and_value(changes, key, words):
    agents = dict(LANE["systems"]["r"]["agents"])
    if changes.get("agents__lookahead", 0) is None:
        agents.pop("lookahead")
        changes = {"agents": agents}
    with pytest.raises(InvalidInput, match=rf"^systems\.r\.{key}: .*{words}"):
        built(**changes)


def test_positions_must_begin_inside():
    with pytest.raises(InfeasibleStart, match=r"initial positions .*'gap of agent 2'"):
        built(initial__velocity=[6.0, 0.0, 0.0])
    found, moved = load_scenario(LANE, {"initial.velocity": [6.0, 0.0, 0.0]}).inside_systems()
    assert "initial positions" in moved["r"]["why"]
    assert np.allclose(found[0].start_positions, found[0].start)


def test_mixed_fleets_and_velocity_robots_have_none():
    robots = gm.flexible_robots(2, output="position", lookahead=1.0)
    game = gm.game(3, lambda i, y, p: (y[i] - 1.0) ** 2, lambda y, p: iter([("a", y[0] <= 4.0)]))
    with pytest.raises(InvalidInput, match=r"groups\.0\.output.*velocities"):
        gm.setup(game, agents=gm.mixed_agents(robots, gm.integrators(1))).system_objects()
    with pytest.raises(InvalidInput, match=r"initial\.velocity.*have no velocity"):
        load_scenario("velocity-sync", {"initial.velocity": 1.0}).system_objects()


def test_certificates_say_what_is_promised_of_positions_and_what_is_missing():
    one, many = Clock(1.0, 0.01, 0.01, 0.1), Clock(1.0, 0.01, 0.03, 0.1)
    found = certify(built(), one)
    assert any("at every integration step" in text for text in found.guaranteed)
    assert found.positions["follow"]
    assert found.positions["least_damping"] == pytest.approx([5.0] * 3)
    assert "1.2 times the least" in str(found)
    assert any("up to the first" in text for text in certify(built(), many).guaranteed)
    assert any(
        "only Euler's" in text
        for text in certify(built(plant__integrator="rk4"), one).not_certified
    )
    exact = built(plant__integrator="rk4", controller__mode="continuous")
    found = certify(exact, one)
    assert found.status == "certified"
    assert "positions keep every shared constraint wherever outputs do so" in found.guaranteed
    for damping in (5.0, 4.0):
        weak = built(
            plant__integrator="rk4", controller__mode="continuous", agents__local_damping=damping
        )
        found = certify(weak, one)
        assert found.status == "not certified"
        assert any(
            f"{damping:g} N s/m of agent 1 must exceed" in text and "= 5 N s/m" in text
            for text in found.not_certified
        )
        assert not any("positions" in text for text in found.guaranteed)
    assert certify(load_scenario("velocity-sync").system_objects()[0], one).positions is None


def test_reports_trajectories_and_batches(tmp_path):
    run = gm.run(LANE, {"initial.velocity": [1.0, 0.0, -0.5]})
    seen = run.reports["r"]["positions"]
    assert seen["observed"] == 41
    assert seen["outside"] == 0
    data = run["r"]
    gaps = np.diff(data["position"].values, axis=1, prepend=0.0)
    assert seen["least_margin"] <= np.min(4.0 - gaps**2) + 1e-12
    y, q, v = (data[name].values for name in ("action", "position", "velocity"))
    assert np.allclose(y, q + TAU * v)
    assert np.allclose(data["place"], q + 3.0 * data["time"].values[:, None])
    assert summary(run.reports["r"])["positions"].startswith("outside at 0 of 41 observations")
    none = gm.run("velocity-sync", {"simulation.duration": 0.1}).reports["robots"]
    assert none["positions"] is None
    gm.batch(LANE, runs=5, spread=0.99, out=tmp_path / "runs")
    import xarray

    rows = xarray.open_dataset(tmp_path / "runs" / "runs.zarr", engine="zarr")
    assert np.all(rows["positions_outside"] == 0)
    assert np.all(rows["position_margin"] > 0)
    assert set(rows["status"].values) <= {"completed", "converged"}


@pytest.mark.parametrize("plane", [False, True])
def test_random_starts_draw_outputs_and_positions_inside(plane):
    scenario = {**LANE, "systems": {"r": PLANE}} if plane else LANE
    plan = make_plan(scenario, {"initial.velocity": 9.0}, starts=40, spread=0.999999)
    combination = plan.combination(0)
    game, numbers = combination.system.game, combination.system.agents.parameters
    runner = Runner(plan, 1)
    cases = list(runner._cases(runner._prepare(0), list(range(40))))
    for start, case in enumerate(cases):
        y, q = case.state[:, 1], case.state[:, 3]
        assert np.all(game.constraints(y) < 0)
        assert np.all(game.constraints(q) < 0)
        assert np.allclose(case.state[:, 2], position_robot.velocity(numbers, case.state))
        alone = plan.alone(start).system_objects()[0]
        assert np.array_equal(alone.state, case.state)
    speeds = np.array([np.max(np.abs(case.state[:, 1] - case.state[:, 3])) for case in cases])
    assert np.median(speeds) > 0.5


PLANE = {
    "game": {
        "type": "velocity-consensus", "reference_velocity": [0.0, 0.0], "gap_bound": 3.0,
        "leader_gap_bound": 3.0,
    },
    "agents": {
        "type": "planar-flexible-robot", "count": 4, "output": "position", "lookahead": TAU,
        "reference_velocity": [1.0, -2.0],
    },
    "initial": {"action": [[0.5, 0], [0, 0.5], [-0.5, 0], [0, -0.5]], "velocity": [1.0, 0.5]},
}  # fmt: skip


def test_the_plane_and_where_its_robots_are_drawn():
    scenario = {**LANE, "systems": {"r": PLANE}}
    found = {}
    for engine in ("mujoco", "ode"):
        run = gm.run(scenario, {"plant.engine": engine})
        assert run.reports["r"]["positions"]["outside"] == 0
        found[engine] = run["r"]
    assert np.allclose(found["mujoco"]["state"], found["ode"]["state"], atol=1e-11)
    system = load_scenario(scenario).system_objects()[0]
    assert np.array_equal(system.agents.parameters[:, 7], [1.0, -2.0] * 4)
    shown = ShownSystem(system, Clock(0.4, 0.01, 0.01, 0.05))
    values = {name: found["ode"][name].values for name in ("state", "place")}
    drawn = shown.fleet.qpos(values)[:, shown.fleet.plant.places.main_q]
    travelled = np.outer(found["ode"]["time"], system.agents.parameters[:, 7])
    assert np.allclose(drawn, found["ode"]["position"] + travelled)


def test_robots_of_a_file_need_their_damping(tmp_path):
    path = tmp_path / "cart.xml"
    path.write_text(
        '<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="x" type="slide"'
        ' axis="1 0 0"/><geom size=".1"/></body></worldbody>'
        '<actuator><motor name="u" joint="x"/></actuator></mujoco>'
    )
    keys = {"file": path, "output": "x", "input": "u"}
    game = gm.game(2, lambda i, y, p: (y[i] - 1.0) ** 2, lambda y, p: iter([("a", y[0] <= 4.0)]))
    with pytest.raises(InvalidInput, match=r"agents\.local_damping.*must be given"):
        gm.setup(game, agents=gm.mjcf_robots(2, **keys, lookahead=TAU)).system_objects()
    with pytest.raises(InvalidInput, match=r"agents\.local_damping.*with a lookahead"):
        gm.setup(game, agents=gm.mjcf_robots(2, **keys, local_damping=1.0)).system_objects()
    robots = gm.mjcf_robots(
        2, **keys, lookahead=TAU, local_damping=[8.0, 9.0], reference_velocity=-1.0
    )
    system = gm.setup(game, agents=robots).system_objects()[0]
    assert system.agents.kind is mjcf_position
    assert np.array_equal(system.agents.parameters, [[TAU, 8.0, -1.0], [TAU, 9.0, -1.0]])


def test_environments_begin_at_rest_and_move_as_the_plant():
    environment = load_environment(LANE, {"plant.engine": "mujoco"}, start="random", random=3)
    environment.reset()
    physics, plant = environment.physics, OdePlant(built().agents, 0.01, "euler")
    begun = physics.state
    assert np.array_equal(begun[:, 1], begun[:, 3])
    assert np.any(begun[:, 1] != 0.0)
    u = np.array([3.0, -1.0, 2.0])
    plant.reset(begun)
    for _ in range(5):
        environment.step(u)
        plant.step(u)
    assert np.allclose(physics.state, plant.state, atol=1e-12)


def test_sweeps_of_an_agents_numbers_in_mujoco(tmp_path):
    """Rows of one fleet, each with a look-ahead, a reference and masses of its own."""
    changes = {"plant.engine": "mujoco", "agents.reference_velocity": 3.0}
    scenario = load_scenario(LANE, changes)
    sweeps = {
        "agents.lookahead": [0.3, 0.8], "agents.reference_velocity": [0.0, 5.0],
        "agents.main_mass": [1.0, 2.0],
    }  # fmt: skip
    rows = gm.batch(scenario, sweeps, runs=2, out=tmp_path / "runs")
    assert set(rows["status"].values) <= {"completed", "converged"}
    plan = make_plan(
        scenario, sweeps=[Sweep(key, tuple(values)) for key, values in sweeps.items()], starts=2
    )
    for run in (0, 5, 10, 15):
        alone = gm.run(plan.alone(run)).reports["r"]
        found = rows.isel(run=run)
        assert float(found["position_margin"]) == alone["positions"]["least_margin"]
        assert float(found["peak_input"]) == alone["actuators"]["peak"]


GOLDEN = Path(__file__).parent / "golden" / "positions.json"


def figures(name):
    """What a run of a shipped scenario is known by."""
    run = gm.run(name)
    report, data = run.reports["robots"], run["robots"]
    least, most = (f(data["position"].values, axis=0).tolist() for f in (np.min, np.max))
    return report, {
        "margin": report["worst_constraint"]["margin"],
        "each": report["worst_constraint"]["each"],
        "positions": report["positions"]["least_margin"],
        "least": least,
        "most": most,
        "peak": report["actuators"]["peak"],
    }


@pytest.mark.parametrize("name", ["platoon", "formation"])
def test_shipped_scenarios(name):
    report, found = figures(name)
    golden = json.loads(GOLDEN.read_text())[name]
    for key, value in golden.items():
        assert found[key] == pytest.approx(value, abs=1e-8), key
    assert report["status"] == "converged"
    assert report["positions"]["outside"] == 0
    assert report["lyapunov"]["monotone"]
    assert report["lyapunov"]["claimed"]
    scenario = load_scenario(name)
    found = certify(scenario.system_objects()[0], scenario.clock())
    assert found.status == "certified"
    assert found.positions["follow"]


# ---------------------------------------------------------------------------- what is shown of it


def test_the_page_is_told_of_plans():
    clock = Clock(0.4, 0.01, 0.01, 0.05)
    shown = {
        name: ShownSystem(load_scenario(name).system_objects()[0], clock).meta()
        for name in ("platoon", "formation", "velocity-sync")
    }
    assert shown["velocity-sync"]["plan"] is None
    assert shown["platoon"]["plan"] == {"velocity": [3.0, 0.0], "region": [], "radius": [0.4] * 5}
    (spacing, place, *_) = shown["platoon"]["quantities"]
    assert spacing["between"] == [None, [1, 2], [2, 3], [3, 4], [4, 5]]
    assert place["between"] == []
    plan = shown["formation"]["plan"]
    assert plan["velocity"] == [1.0, 0.5]
    assert plan["radius"] == [None] * 5
    corners = load_scenario("formation").systems["robots"].game.region.vertices
    assert {tuple(np.round(each, 9) + 0.0) for each in plan["region"]} == set(map(tuple, corners))
    links = shown["formation"]["quantities"][0]["between"]
    assert links[:4] == [[1, 2], [1, 3], [2, 4], [3, 5]]
    assert set(map(str, links[4:])) == {"None"}


def test_ways_are_drawn_from_what_a_trajectory_keeps(tmp_path):
    run = gm.run("formation", {"simulation.duration": 0.2})
    run.save(tmp_path / "run.zarr")
    kept = gm.Trajectory.load(tmp_path / "run.zarr")
    figure = plots.draw(kept)["robots-plane"]
    (axes,) = figure.axes
    position = run["robots"]["position"].values.reshape(-1, 5, 2)
    ways = [line.get_xydata() for line in axes.lines]
    for agent in range(5):
        assert any(np.array_equal(way, position[:, agent]) for way in ways)
    assert "robots-plane" not in plots.draw(gm.run("platoon", {"simulation.duration": 0.1}))
    assert "robots-plane" not in plots.draw(gm.run("planar-sync", {"simulation.duration": 0.1}))
