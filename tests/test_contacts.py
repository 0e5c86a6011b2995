"""Contacts between agents: what a run counts is what MuJoCo's own data shows in Python."""

import mujoco
import numpy as np
import pytest

import gne_mj as gm
from gne_mj.batches.plan import make_plan
from gne_mj.errors import InvalidInput
from gne_mj.loops.contacts import counter
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.plants.fleet_plant import build_fleet
from gne_mj.plants.native_contacts import contact_offsets
from gne_mj.plants.native_mujoco import PLANT_MARK, USERDATA_HEADER
from gne_mj.scenario import load_scenario
from gne_mj.summary import summary
from gne_mj.theory import certify

H, STEPS = 0.005, 500
SHORT = {
    "simulation.timestep": H, "simulation.duration": H * STEPS, "recording.period": H,
    "simulation.control_period": H,
}  # fmt: skip
EULER = {"controller.mode": "implicit", "simulation.integrator": "euler"}
SAMPLED = {"controller.mode": "sampled"}
# Spacings that are less than the robots are long, and wished for
CLOSE = {"game.least_spacing": 0.3, "game.desired_spacing": 0.35}
# Both wings want to be where the other one is
CROSSED = {
    "game.desired_place": [[2.0, 0.0], [0.8, -1.2], [0.8, 1.2], [-0.4, -0.1], [-0.4, 0.1]],
    "game.link_length": 3.0,
}


def seen(scenario, inputs):
    """Of MuJoCo's own steps under recorded inputs: (time, contacts between agents, state)."""
    (system,) = scenario.system_objects()
    plant = build_fleet(system.agents, H, system.integrator)
    plant.reset(system.state)
    model, data = plant.model, plant.data
    owner = [model.body(model.body_rootid[body]).name for body in model.geom_bodyid]
    data.userdata[:USERDATA_HEADER] = PLANT_MARK, plant._parameter_block.address
    found = []
    with callbacks(passive=plant.passive):
        for u in inputs:
            data.ctrl[plant.places.actuator] = u
            mujoco.mj_fwdPosition(model, data)
            pairs = [
                (owner[one], owner[other], distance)
                for (one, other), distance in zip(
                    data.contact.geom, data.contact.dist, strict=True
                )
                if owner[one] != owner[other]
            ]  # fmt: skip
            found.append((data.time, pairs, plant.state))
            mujoco.mj_step(model, data)
    return found


@pytest.mark.parametrize(
    ("name", "changes", "mode"),
    [
        ("platoon", CLOSE, EULER),
        ("platoon", CLOSE, SAMPLED),
        ("formation", CROSSED, SAMPLED),
        ("platoon", {}, EULER),
    ],
)
def test_a_run_counts_what_mujoco_has(name, changes, mode):
    scenario = load_scenario(name, {**SHORT, **changes, **mode})
    run = gm.run(scenario)
    data, report = run["robots"], run.reports["robots"]
    assert report["status"] == "completed"
    expected = seen(scenario, data["input"].values)
    states = np.array([state for *_, state in expected])
    assert np.allclose(data["state"], states, rtol=0, atol=1e-9)
    told, touching = report["contacts"], [(time, pairs) for time, pairs, _ in expected if pairs]
    assert told["count"] == sum(len(pairs) for _, pairs in touching)
    assert told["steps"] == len(touching)
    assert bool(told["count"]) == bool(changes)
    if changes:
        time, pairs = touching[0]
        assert told["first"] == pytest.approx(time, abs=1e-9)
        names = [f"robot_{agent}/" for agent in told["agents"]]
        assert sorted(pairs[0][:2]) == sorted(names)
        deepest = -min(distance for _, pairs in touching for *_, distance in pairs)
        assert told["depth"] == pytest.approx(deepest, abs=1e-9)
        assert "between agents at" in summary(report)["contacts"]
    else:
        assert summary(report)["contacts"] == "none between agents"


def test_mode_continuous_counts_at_the_start_of_steps_and_of_pieces():
    """As MuJoCo finds them at the recorded states, each put there anew."""
    scenario = load_scenario("platoon", {**SHORT, **CLOSE})
    run = gm.run(scenario)
    report, (system,) = run.reports["robots"], scenario.system_objects()
    plant = build_fleet(system.agents, H, system.integrator)
    counts = []
    for state in run["robots"]["state"].values:
        plant.reset(state)
        mujoco.mj_fwdPosition(plant.model, plant.data)
        counts.append(plant.data.ncon)  # nothing but hulls collides
    told, between = report["contacts"], report["steps"] - STEPS  # pieces of divided steps
    assert between > 0
    assert 0 <= told["steps"] - np.count_nonzero(counts) <= between
    assert 0 <= told["count"] - sum(counts) <= between * max(counts)
    first = run["robots"]["time"].values[np.flatnonzero(counts)[0]]
    assert first - H < told["first"] <= first + 1e-9


def test_batches_count_as_single_runs(tmp_path):
    scenario = load_scenario("platoon", {**SHORT, **CLOSE, **EULER, "recording.period": 0.1})
    rows = gm.batch(scenario, runs=4, spread=0.9, out=tmp_path / "runs")
    plan = make_plan(scenario, starts=4, spread=0.9)
    counts = rows["contacts"].values
    assert np.any(counts > 0)
    for run in range(4):
        assert counts[run] == gm.run(plan.alone(run)).reports["robots"]["contacts"]["count"]
    plain = gm.batch("velocity-sync", runs=1, out=tmp_path / "plain", seed=1)
    assert "contacts" not in plain


def test_nothing_collides_unless_it_is_asked_for():
    for dimension in (1, 2):
        table = np.ones((4, 5))
        off = compile_model(compose(table, dimension=dimension), timestep=H, integrator="Euler")
        assert not np.any(off.geom_contype | off.geom_conaffinity)
        on = compile_model(
            compose(table, dimension=dimension, decorated=False, contacts=True),
            timestep=H, integrator="Euler",
        )  # fmt: skip
        hulls = [on.geom(f"robot_{i + 1}/hull").id for i in range(4 // dimension)]
        assert list(range(on.ngeom)) == hulls
        assert np.array_equal(on.body_mass[1:], off.body_mass[off.body_mass > 0.0])
    assert (
        gm.run("velocity-sync", {"simulation.duration": 0.1}).reports["robots"]["contacts"] is None
    )


def test_the_hull_is_around_all_of_the_body():
    for dimension in (1, 2):
        spec = compose(np.ones((dimension, 5)), dimension=dimension, contacts=True)
        model = compile_model(spec, timestep=H, integrator="Euler")
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        hull = model.geom("robot_1/hull")
        size, centre = model.geom_aabb[hull.id, 3:], data.geom_xpos[hull.id]
        main = model.geom_bodyid == model.body("robot_1/main").id
        for geom in np.flatnonzero(main):
            corners = model.geom_aabb[geom, :3] + model.geom_aabb[geom, 3:] * np.array(
                np.meshgrid([-1, 1], [-1, 1], [-1, 1])
            ).reshape(3, -1).T  # fmt: skip
            placed = data.geom_xpos[geom] + corners @ data.geom_xmat[geom].reshape(3, 3).T
            low = placed[:, 2] < 0.21  # the mast is above all of the others'
            assert np.all(np.abs(placed[low, :2] - centre[:2]) <= size[:2] + 1e-9), geom


def test_refusals_and_what_is_promised():
    with pytest.raises(InvalidInput, match=r"agents\.contacts: got True.*only MuJoCo has bodies"):
        load_scenario("platoon", {"plant.engine": "ode"}).system_objects()
    scenario = load_scenario("platoon")
    (system,) = scenario.system_objects()
    told = certify(system, scenario.clock()).not_certified
    assert any("once bodies of two agents have touched" in text for text in told)
    assert not system.agents.repeated(3).contacts


def test_offsets_are_checked_and_the_counter_is_one():
    assert contact_offsets().size % 8 == 0
    assert counter() is counter()


BALL = """<mujoco><option gravity="0 0 0"/><worldbody>
  <body name="ball"><joint name="x" type="slide"/><geom name="ball" size="0.3" mass="1"/></body>
  </worldbody><actuator><motor name="push" joint="x"/></actuator></mujoco>"""


def crossing(file):
    """Two balls on one line that want to change places, as a user's own robots."""
    game = {"type": "platoon", "least_spacing": -3.0, "desired_spacing": -1.0,
            "greatest_spacing": 3.0, "leader_range": [-5.0, 5.0]}  # fmt: skip
    agents = {"type": "mjcf-robot", "count": 2, "file": str(file), "output": "x", "input": "push",
              "lookahead": 0.5, "local_damping": 4.0}  # fmt: skip
    return {
        "simulation": {"duration": 1.0, "timestep": H, "control_period": H, "integrator": "euler"},
        "recording": {"period": H},
        "systems": {"balls": {
            "game": game, "agents": agents, "controller": {"mode": "implicit"},
            "plant": {"engine": "mujoco"}, "initial": {"action": [0.5, -0.5]},
        }},
    }  # fmt: skip


def test_contacts_of_ones_own_robots_are_counted_where_they_can_touch(tmp_path):
    """Of two balls in one line the distance of their centres tells."""
    file = tmp_path / "ball.xml"
    file.write_text(BALL)
    run = gm.run(crossing(file))
    data, told = run["balls"], run.reports["balls"]["contacts"]
    apart = np.abs(data["position"].values[:, 0] - data["position"].values[:, 1]) - 0.6
    assert told["count"] == told["steps"] == np.sum(apart < 0.0) > 10
    assert told["agents"] == [1, 2]
    assert told["depth"] == pytest.approx(-np.min(apart), abs=1e-12)
    alone = crossing(file)
    alone["systems"]["balls"]["agents"]["contacts"] = "none"
    assert gm.run(alone).reports["balls"]["contacts"] is None


def test_a_shipped_robots_file_is_named_and_a_wrong_name_is_told(tmp_path):
    tables = crossing("gne_mj:carr.xml")
    with pytest.raises(InvalidInput, match=r"file: got 'gne_mj:carr.xml'.*did you mean 'car'"):
        load_scenario(tables).system_objects()
