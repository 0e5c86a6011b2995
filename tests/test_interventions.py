"""What a user does to a run that goes on: numbers changed, agents pushed, looks in between."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import FIVE, robot_state, robot_system

import gne_mj
import reference
from gne_mj import graph as graphs
from gne_mj.controllers import PartialInformation
from gne_mj.errors import EngineError, InfeasibleStart, InvalidInput
from gne_mj.faults import Push
from gne_mj.plants import mjcf_position
from gne_mj.scenario import load_scenario, scenario_of, shipped
from gne_mj.simulation import Simulation
from gne_mj.system import Clock
from gne_mj.toml_text import toml_text
from gne_mj.trajectory import Trajectory
from gne_mj.viewer.joints import Joints
from gne_mj.viewer.shown_system import ShownSystem

CLOCK = Clock(duration=4.0, timestep=0.01, control_period=0.01, sample_period=0.1)
EXAMPLES = Path(__file__).parent.parent / "examples"
OSNR = {"simulation.duration": 1.0, "recording.period": 0.1}


def robots(engine="ode", **options):
    return robot_system(robot_state(FIVE), engine=engine, **options)


def same(one: Trajectory, other: Trajectory) -> bool:
    return all(
        np.array_equal(one[name][key], other[name][key], equal_nan=True)
        for name in one.tree.children
        for key in one[name].variables
        if one[name][key].dtype.kind == "f"
    )


@pytest.mark.parametrize("engine", ["ode", "mujoco"])
def test_pieces_and_looks_change_no_bit(engine):
    whole = Simulation([robots(engine)], CLOCK).run()
    simulation = Simulation([robots(engine)], CLOCK)
    for steps in (1, 3, 9, 37, 50, 10, 200, 90):
        simulation.advance(steps)
        for run in simulation.runs.values():
            before = run.loop.monitor.copy()
            run.loop.present()
            run.recorded(1000)
            assert np.array_equal(before, run.loop.monitor)
    assert simulation.ended
    assert same(simulation.trajectory(), whole)
    assert simulation.trajectory().reports["robots"]["steps"] == 400


def test_what_is_recorded_is_thinned_evenly():
    simulation = Simulation([robots()], CLOCK)
    (run,) = simulation.runs.values()
    assert len(run.recorded(10)[0]) == 0
    simulation.advance(395)
    whole, variables = run.recorded(40)
    assert np.allclose(whole, 0.1 * np.arange(40))
    for most, every in ((39, 2), (20, 2), (13, 3), (1, 21)):
        time, thinned = run.recorded(most)
        assert np.array_equal(time, whole[::every])
        assert np.array_equal(thinned["action"], variables["action"][::every])


def test_a_run_that_goes_on_after_it_was_looked_at_is_the_same():
    whole = Simulation([robots()], CLOCK).run()
    simulation = Simulation([robots()], CLOCK)
    simulation.advance(150)
    halfway = simulation.trajectory(interrupted=True)
    assert halfway.status == "interrupted"
    assert float(halfway["robots"]["time"][-1]) == 1.5
    simulation.advance(250)
    assert same(simulation.trajectory(), whole)


def test_adaptive_steps_are_looked_at_without_a_change():
    whole = gne_mj.run("osnr", OSNR)
    simulation = load_scenario("osnr", OSNR).simulation_object()
    for steps in (7, 43, 150, 300):
        simulation.advance(steps)
        present = simulation.runs["channels"].loop.present()
        assert present.state.shape == (10, 2)
        assert present.memory.shape == (110,)
    assert same(simulation.trajectory(), whole)


@pytest.mark.parametrize("engine", ["ode", "mujoco"])
def test_changed_numbers_are_those_of_a_system_that_starts_there(engine):
    simulation = Simulation([robots(engine)], CLOCK)
    simulation.advance(100)
    loop = simulation.runs["robots"].loop
    present = loop.present()
    changed = replace(robots(engine, rho=0.7), state=present.state)
    simulation.change(changed, "rho = 0.7")
    simulation.advance(100)
    afresh = changed.closed_loop(CLOCK)
    afresh.advance(1, 100)
    # MuJoCo has positions, the fresh one extensions: the last bits differ
    assert np.allclose(loop.present().state, afresh.present().state, rtol=0, atol=1e-12)
    assert simulation.systems[0].rho == 0.7

    report = simulation.trajectory().reports["robots"]
    assert not report["lyapunov"]["claimed"]
    assert report["lyapunov"]["largest_rise"] < 1e-12  # V jumps with y*, and that is no rise
    assert report["equilibrium"]["penalised"] == changed.equilibrium.action.tolist()


def test_changed_numbers_act_at_once_between_adaptive_steps():
    """An adaptive step that goes beyond the change is not of the changed run."""
    simulation = load_scenario("osnr", {**OSNR, "simulation.duration": 3.0}).simulation_object()
    simulation.advance(1000)
    (run,) = simulation.runs.values()
    present, clock = run.loop.present(), simulation.clock
    changed = replace(run.system, rho=10.0, state=present.state, memory=present.memory)
    simulation.change(changed, "rho = 10")
    afresh = changed.closed_loop(clock)
    for _ in range(3):
        simulation.advance(25)
        afresh.advance(1, 25)
        got, expected = run.loop.present(), afresh.present()
        # to the integrator's tolerance, 1e-6, whose scale is the greatest state so far
        assert np.allclose(got.state, expected.state, rtol=1e-5)
    assert not np.allclose(got.state, present.state, rtol=1e-2)
    simulation.advance(425)
    trajectory = simulation.trajectory()
    assert trajectory.status in ("completed", "converged")
    assert np.all(np.diff(trajectory["channels"]["time"]) > 0.0)


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
def test_a_changed_gain_reaches_the_estimates(mode):
    law = PartialInformation(graphs.ring(5), 1.0, 1.0)
    simulation = Simulation([robots(law=law, mode=mode)], CLOCK)
    simulation.advance(50)
    simulation.trajectory()  # held modes: the estimates of now, not of the last control instant
    loop = simulation.runs["robots"].loop
    present = loop.present()
    changed = replace(
        robots(law=PartialInformation(graphs.ring(5), 3.0, 1.0), mode=mode),
        state=present.state, memory=present.memory,
    )  # fmt: skip
    simulation.change(changed, "c = 3")
    simulation.advance(50)
    afresh = changed.closed_loop(CLOCK)
    afresh.advance(1, 50)
    assert np.allclose(loop.present().state, afresh.present().state, rtol=0, atol=1e-13)
    assert np.allclose(loop.present().memory, afresh.present().memory, rtol=0, atol=1e-13)


def test_each_part_of_a_run_is_told_by_its_own_numbers(tmp_path):
    scenario = load_scenario("velocity-sync", {"plant.engine": "ode", "simulation.duration": 2})
    simulation = scenario.simulation_object()
    simulation.advance(500)
    other = load_scenario(
        scenario.model_dump(mode="json", exclude_none=True), {"game.reference_velocity": 2.0}
    )
    state = simulation.runs["robots"].loop.present().state
    simulation.change(replace(other.system_objects()[0], state=state), "v_0 = 2")
    simulation.advance(500)
    trajectory = simulation.trajectory()
    data = trajectory["robots"]
    first = data["gap"].to_numpy()[:, 0]
    velocity = data["action"].to_numpy()[:, 0]
    reference = np.where(data["time"] < 1.0, 3.0, 2.0)
    assert np.array_equal(first, velocity - reference)
    assert trajectory.interventions == [{"time": 1.0, "system": "robots", "what": "v_0 = 2"}]

    trajectory.save(tmp_path / "run.zarr")
    loaded = Trajectory.load(tmp_path / "run.zarr")
    assert loaded.interventions == trajectory.interventions
    assert loaded.report()["interventions"] == trajectory.interventions


def test_refused_numbers_change_nothing():
    simulation = Simulation([robots()], CLOCK)
    simulation.advance(10)
    fast = robots(law=PartialInformation(graphs.ring(5), 1.0, 1e-6))
    with pytest.raises(InvalidInput):
        simulation.change(fast, "too fast for this step")
    assert simulation.interventions == []
    assert simulation.systems[0].law.information == "full"


@pytest.mark.parametrize("channel", [1, 4])
def test_a_push_is_the_fault_of_the_same_force(channel):
    fault = Push(agents=(channel,), start=0.5, end=0.7, force=4.0)
    struck = Simulation([robots("mujoco", faults=(fault,))], CLOCK)
    struck.advance(200)
    pushed = Simulation([robots("mujoco")], CLOCK)
    pushed.advance(50)
    pushed.push("robots", channel, 4.0, 0.2)
    pushed.advance(150)
    one, other = (s.runs["robots"].loop.present().state for s in (struck, pushed))
    assert np.allclose(one, other, rtol=0, atol=1e-13)
    free = Simulation([robots("mujoco")], CLOCK)
    free.advance(200)
    assert np.max(np.abs(other - free.runs["robots"].loop.present().state)) > 1e-2
    report = pushed.trajectory().reports["robots"]
    assert not report["lyapunov"]["claimed"]
    assert pushed.interventions[0]["time"] == 0.5


def test_pushes_add_up_and_each_lasts_its_time():
    faults = (
        Push(agents=(1,), start=0.5, end=0.7, force=4.0),
        Push(agents=(1,), start=0.6, end=0.8, force=-1.0),
        Push(agents=(3,), start=0.6, end=0.7, force=2.0),
    )
    struck = Simulation([robots("mujoco", faults=faults)], CLOCK)
    struck.advance(200)
    pushed = Simulation([robots("mujoco")], CLOCK)
    pushed.advance(50)
    pushed.push("robots", 1, 4.0, 0.2)
    pushed.advance(10)
    pushed.push("robots", 1, -1.0, 0.2)
    pushed.push("robots", 3, 2.0, 0.1)
    pushed.advance(140)
    one, other = (s.runs["robots"].loop.present().state for s in (struck, pushed))
    assert np.allclose(one, other, rtol=0, atol=1e-13)
    assert [done["agent"] for done in pushed.interventions] == [2, 2, 4]


def test_what_is_done_to_one_system_takes_no_claim_from_another():
    scenario = load_scenario("velocity-sync", {"simulation.duration": 1.0})
    tables = scenario.model_dump(mode="json", exclude_none=True)
    tables["systems"]["others"] = tables["systems"]["robots"]
    simulation = load_scenario(tables).simulation_object()
    simulation.advance(100)
    simulation.push("robots", 0, 1.0, 0.1)
    reports = simulation.run().reports
    assert not reports["robots"]["lyapunov"]["claimed"]
    assert reports["others"]["lyapunov"]["claimed"]


def test_a_slider_on_its_way_is_one_change():
    simulation = Simulation([robots()], CLOCK)
    simulation.advance(10)
    for rho in (0.2, 0.3, 0.123456789):
        simulation.change(robots(rho=rho), f"rho = {rho!r}", key="rho", value=rho)
    simulation.advance(10)
    simulation.change(robots(rho=0.5), "rho = 0.5", key="rho", value=0.5)
    assert [done["value"] for done in simulation.interventions] == [0.123456789, 0.5]


def test_robots_that_have_left_are_not_pushed():
    law = {"controller.mode": "sampled", "simulation.control_period": 1.0}
    simulation = load_scenario("velocity-sync", law).simulation_object()
    simulation.run()
    with pytest.raises(InvalidInput, match="must not have left"):
        simulation.push("robots", 0, 1.0, 0.1)
    assert simulation.trajectory().reports["robots"]["exit"]["agents"] == [3, 4]


def test_only_robots_in_mujoco_are_pushed():
    simulation = Simulation([robots()], CLOCK)
    with pytest.raises(EngineError, match="only robots in MuJoCo"):
        simulation.push("robots", 0, 1.0, 0.1)
    assert simulation.interventions == []


def test_all_joints_of_own_robots_are_recorded():
    scenario = EXAMPLES / "robot" / "scenario.toml"
    simulation = load_scenario(scenario, {"simulation.duration": 0.5}).simulation_object()
    (run,) = simulation.runs.values()
    model = run.loop.plant.model
    data = simulation.run()[run.system.name]
    assert data["configuration"].shape == (len(data["time"]), model.nq)
    assert np.array_equal(data["configuration"][-1], run.loop.plant.data.qpos)
    at = run.loop.plant.places.position
    known = at >= 0
    assert np.array_equal(
        data["configuration"].to_numpy()[:, at[known]], data["position"].to_numpy()[:, known]
    )


def test_joints_on_a_page_have_the_units_of_what_they_do():
    """Rotors push, though their drag turns."""
    (drones,) = load_scenario("drones").system_objects()
    rows = ShownSystem(drones, CLOCK).joints.meta()[0]
    controls = {row["name"]: row["control"][1] for row in rows if "control" in row}
    assert set(controls.values()) == {"N"}
    assert len(controls) == 4


def test_a_position_with_a_look_ahead_is_no_joints_velocity():
    scenario = load_scenario(EXAMPLES / "robot" / "scenario.toml", {"simulation.duration": 0.1})
    (known,) = scenario.system_objects()
    values = {"action": np.full((1, 4), 7.0)}
    fleet = ShownSystem(known, CLOCK).fleet
    values["configuration"] = fleet.plant.data.qpos[None]
    assert np.any(Joints(fleet).recorded(values) == 7.0)
    plant = fleet.plant
    plant.agents = replace(plant.agents, kind=mjcf_position, parameters=np.ones((4, 3)))
    assert not np.any(Joints(fleet).recorded(values) == 7.0)


PLANNED = [
    {"time": 0.3, "changes": {"barrier.rho": 0.3, "game.reference_velocity": 2.5}},
    {"time": 0.5, "push": {"agent": 2, "force": 4.0, "duration": 0.2}},
    {"time": 0.6, "push": {"system": "robots", "agent": 4, "force": -1.0, "duration": 0.1}},
]


def test_what_was_done_by_hand_is_done_again_by_a_file():
    changes = {"simulation.duration": 1.0}
    simulation = load_scenario("velocity-sync", changes).simulation_object()
    simulation.advance(150)
    simulation.change({"barrier.rho": 0.3, "game.reference_velocity": 2.5})
    simulation.advance(100)
    simulation.push("robots", 1, 4.0, 0.2)
    simulation.advance(50)
    simulation.push("robots", 3, -1.0, 0.1)
    by_hand = simulation.run()
    text = scenario_of(by_hand).toml()
    again = gne_mj.run(tomllib.loads(text))
    planned = gne_mj.run("velocity-sync", {**changes, "interventions": PLANNED})
    for run in (again, planned):
        assert same(run, by_hand)
        reports = [
            {**each.reports["robots"], "wall_time": 0, "step_time": 0} for each in (run, by_hand)
        ]
        assert reports[0] == reports[1]
    assert planned.interventions == by_hand.interventions
    assert again.interventions[1]["what"] == "robot 2 pushed by 4 N for 0.2 s"
    assert not same(gne_mj.run("velocity-sync", changes), by_hand)


def test_steps_one_by_one_see_what_is_planned():
    scenario = load_scenario("velocity-sync", {"interventions": PLANNED})
    stepped, advanced = scenario.simulation_object(), scenario.simulation_object()
    for _ in range(160):
        stepped.step()
    advanced.advance(160)
    one, other = (each.runs["robots"].loop.present().state for each in (stepped, advanced))
    assert np.array_equal(one, other)
    assert stepped.systems[0].rho == 0.3


@pytest.mark.parametrize("name", sorted(shipped()))
def test_a_scenarios_text_is_read_as_the_same_scenario(name):
    scenario = load_scenario(name)
    again = load_scenario(tomllib.loads(scenario.toml()))
    assert again.model_dump(mode="json") == scenario.model_dump(mode="json")


def test_tables_of_any_texts_are_written_and_read():
    tables = {
        'a "b".c\n\x7f': 'é\t"\\', "list": [1, -2.5e-7, True], "empty": {}, "none": [],
        "in": {"of": {"x": 1e300, "each": [{"y": {"z.z": [[1], [2, 3]]}}, {}]}},
    }  # fmt: skip
    assert tomllib.loads(toml_text(tables)) == tables


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"time": 0.1}, "interventions.0: .*either changes, a push or a link"),
        ({"time": -1.0, "changes": {"barrier.rho": 1.0}}, "interventions.0.time: got -1.0"),
        ({"time": 0.1, "changes": {"barrier.roh": 1.0}}, "did you mean 'rho'"),
        ({"time": 0.1, "changes": {"simulation.duration": 1.0}}, "it stays as it is"),
        ({"time": 0.1, "push": {"agent": 6, "force": 1.0, "duration": 1.0}},
         "interventions.0.push.agent: got 6, but agents are numbered 1 to 5"),
        ({"time": 0.1, "push": {"agent": 1, "axis": "y", "force": 1.0, "duration": 1.0}},
         "interventions.0.push.axis: got 'y'"),
        ({"time": 0.1, "link": {"agents": [1, 2]}},
         r"interventions.0.link.agents: got \[\[1, 2\]\], but the full law has no links to lose"),
        ({"time": 0.1, "push": {"agent": 1, "force": np.nan, "duration": 1.0}},
         "interventions.0.push.force: got nan"),
        ({"time": 0.1, "push": {"system": "r", "agent": 1, "force": 1.0, "duration": 1.0}},
         "interventions.0.push.system: got 'r'"),
    ],
)  # fmt: skip
def test_plans_that_cannot_be_are_refused_before_the_run(table, words):
    with pytest.raises(InvalidInput, match=words):
        load_scenario("velocity-sync", {"interventions": [table]}).simulation_object()


def test_a_plan_that_is_refused_when_it_is_due_is_named():
    table = {"time": 0.1, "changes": {"game.reference_velocity": 30.0}}
    scenario = load_scenario("velocity-sync", {"interventions": [table], **OSNR})
    with pytest.raises(InfeasibleStart, match=r"interventions\.0\.changes"):
        scenario.simulation_object().run()


def test_what_knows_no_interventions_refuses_them():
    scenario = load_scenario("velocity-sync", {"interventions": PLANNED})
    for what in (gne_mj.certify, gne_mj.load_environment):
        with pytest.raises(InvalidInput, match="know none: leave them out"):
            what(scenario)


LINKED = {
    "simulation.duration": 1.0,
    "controller": {"information": "partial", "graph": "ring", "coupling": 5.0},
}


def test_links_that_were_lost_are_lost_again_by_a_file():
    """The run of the file that a run by hand leaves has the same bits."""
    simulation = load_scenario("velocity-sync", LINKED).simulation_object()
    simulation.advance(100)
    simulation.link("robots", (1, 0))
    simulation.advance(50)
    simulation.link("robots", (2, 3))  # two parts from here on
    simulation.change({"barrier.rho": 0.3})  # which brings no link back
    graph = simulation.systems[0].law.graph
    assert graph.edges == ((0, 4), (1, 2), (3, 4))
    simulation.advance(50)
    simulation.link("robots", (0, 1), lost=False)
    by_hand = simulation.run()
    assert simulation.systems[0].law.graph.edges == ((0, 1), (0, 4), (1, 2), (3, 4))
    again = gne_mj.run(tomllib.loads(scenario_of(by_hand).toml()))
    assert same(again, by_hand)
    assert again.interventions[:2] == by_hand.interventions[:2]
    assert by_hand.interventions[0]["what"] == "link between robots 1 and 2 lost"
    assert not by_hand.reports["robots"]["lyapunov"]["claimed"]


def test_agents_of_two_parts_estimate_as_two_networks_do():
    """A step of the paper's estimates with the Laplacian of the links that are left, by NumPy."""
    rng = np.random.default_rng(3)
    estimates = (1.0 + rng.normal(size=(5, 5))).tolist()
    changes = {**LINKED, "plant.engine": "ode", "initial.estimate": estimates}
    ends, h = {}, 1e-5
    for lost in ((), ((1, 2), (0, 4))):  # without these 1 and 2 are apart from 3, 4 and 5
        scenario = load_scenario("velocity-sync", {**changes, "simulation.timestep": h})
        simulation = scenario.simulation_object()
        for link in lost:
            simulation.link("robots", link)
        simulation.advance(1)
        ends[lost] = simulation.runs["robots"].loop.present().memory.reshape(5, 5)
        edges = {(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)} - set(lost)
        start = np.array(estimates)
        np.fill_diagonal(start, scenario.system_objects()[0].start)
        rates = -5.0 * reference.laplacian(5, edges) @ start
        others = ~np.eye(5, dtype=bool)
        expected = (start + h * rates)[others]
        np.testing.assert_allclose(ends[lost][others], expected, rtol=0, atol=5e3 * h * h)
    whole, parts = ends.values()
    assert np.max(np.abs(whole - parts)) > h


@pytest.mark.parametrize(
    ("changes", "link", "words"),
    [
        ({}, (0, 1), "the full law has no links to lose"),
        (LINKED, (0, 2), "there is no link between them"),
        ({**LINKED, "controller": {**LINKED["controller"], "graph":
          {"type": "switching", "graphs": ["ring", "line"], "every": 0.5}}}, (0, 1),
         "changes by itself"),
        ({**LINKED, "controller": {**LINKED["controller"], "mode": "sampled"},
          "faults": [{"type": "message-loss", "probability": 0.5}]}, (0, 1),
         "of a graph that stays"),
    ],
)  # fmt: skip
def test_links_that_cannot_be_lost_are_refused(changes, link, words):
    simulation = load_scenario("velocity-sync", changes).simulation_object()
    with pytest.raises(InvalidInput, match=words):
        simulation.link("robots", link)
    assert simulation.interventions == []
