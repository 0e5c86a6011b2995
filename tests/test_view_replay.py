"""What a page is given: packs, shares of bounds, messages, and a trajectory's replay."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import FIVE, robot_state, robot_system
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import gne_mj
from gne_mj import graph as graphs
from gne_mj.controllers import PartialInformation
from gne_mj.errors import InvalidInput, StorageError
from gne_mj.faults import MessageLoss, Silence, for_native
from gne_mj.games import velocity_game
from gne_mj.loops import faults as native
from gne_mj.notebook import notebook_html, replay_html
from gne_mj.quantity import Quantity
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import Clock
from gne_mj.viewer import html_page, replay_pack, write_html
from gne_mj.viewer.html import page_file
from gne_mj.viewer.pack import MAGIC, pack, packed_small, unpack
from gne_mj.viewer.shares import shares
from gne_mj.viewer.shown_system import ShownSystem

BASED = """<mujoco><worldbody>
  <body name="base"><geom size="0.1"/>
    <body name="cart"><joint name="slide" type="slide" axis="1 0 0"/><geom size="0.1"/></body>
  </body></worldbody>
  <actuator><motor name="force" joint="slide"/></actuator>
  <sensor><actuatorvel name="speed" actuator="force"/></sensor></mujoco>
"""
OF_BASED = """
[systems.fleet.game]
type = "velocity-synchronization"
[systems.fleet.agents]
type = "mjcf-robot"
count = 2
file = "based.xml"
output = "speed"
input = "force"
[systems.fleet.controller]
mode = "sampled"
"""
ROOT = Path(__file__).parent.parent
SHORT = {"simulation.duration": 1.0}


@given(
    st.dictionaries(
        st.text(min_size=1, max_size=20),
        arrays.arrays(
            st.sampled_from([np.float64, np.float32, np.int32, np.uint8]),
            arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=7),
        ),
        max_size=4,
    ),
    st.dictionaries(st.text(), st.floats(allow_nan=False, allow_infinity=False) | st.text()),
)
def test_packs_carry_every_bit(given_arrays, meta):
    for bytes_ in (pack(meta, given_arrays), packed_small(meta, given_arrays)):
        found_meta, found = unpack(bytes_)
        assert found_meta == meta
        assert list(found) == list(given_arrays)
        for name, array in given_arrays.items():
            assert found[name].dtype == array.dtype
            assert found[name].shape == array.shape
            assert found[name].tobytes() == array.tobytes()


def test_a_packs_arrays_begin_at_multiples_of_eight():
    data = pack({"a": "é"}, {"x": np.zeros(3, dtype=np.uint8), "y": np.arange(2.0)})
    assert data.startswith(MAGIC)
    length = int.from_bytes(data[4:8], "little")
    header = json.loads(data[8 : 8 + length])
    assert [entry["offset"] for entry in header["arrays"]] == [0, 8]
    start = -(-(8 + length) // 8) * 8
    assert np.frombuffer(data[start + 8 : start + 24]).tolist() == [0.0, 1.0]


def test_no_number_of_the_header_may_be_infinite():
    with pytest.raises(ValueError, match="JSON"):
        pack({"bound": np.inf}, {})


def test_shares_of_two_sided_bounds_are_those_of_the_gaps():
    game = robot_system(robot_state(FIVE)).game
    y = np.array([[1.0, 0.0, -1.0, 0.5, 2.0], [3.0, 6.0, 9.5, 9.5, 9.5]])
    gaps = np.array([[-2.0, -1.0, -1.0, 1.5, 1.5], [0.0, 3.0, 3.5, 0.0, 0.0]])
    assert np.allclose(shares(game, {"action": y, "gap": gaps}), np.abs(gaps) / 3.0)


def test_shares_of_a_total_are_everybodys():
    game = load_scenario("osnr").system_objects()[0].game
    y = np.full((2, 10), 0.2)
    found = shares(game, {"action": y, "total_power": np.array([2.0, 2.75])})
    assert np.allclose(found, np.array([[0.8], [1.1]]) * np.ones(10))


@pytest.mark.parametrize(
    ("high", "low", "values", "expected"),
    [
        (2.0, None, [1.0, -4.0, 2.5], [0.5, -2.0, 1.25]),
        (None, -2.0, [1.0, -1.0, -3.0], [-0.5, 0.5, 1.5]),
        (None, 0.0, [1.0, 0.0, 2.0], [np.nan] * 3),  # no part of the way to 0 is known
        (4.0, 2.0, [3.0, 2.0, 4.5], [0.0, 1.0, 1.5]),
        (None, None, [1.0, 2.0, 3.0], [np.nan] * 3),
    ],
)
def test_shares_go_by_the_bounds_there_are(high, low, values, expected):
    quantity = Quantity("it", "it", "", lambda y: y, each="agent", bound=high, lower_bound=low)
    game = velocity_game(3, 3.0, 3.0)
    game = replace(game, quantities=(quantity,))
    row = np.array([values])
    assert np.allclose(shares(game, {"action": row, "it": row}), [expected], equal_nan=True)


def test_shares_of_edges_are_the_greatest_of_an_agents():
    system = load_scenario("planar-sync").system_objects()[0]
    game, rng = system.game, np.random.default_rng(1)
    y = system.start + 0.1 * rng.normal(size=(3, game.actions))
    (quantity,) = game.quantities
    values = quantity.at(y, game.entries(quantity))
    bounds = quantity.bounds(game.entries(quantity))["gap_bound"]
    found = shares(game, {"action": y, "gap": values})
    for row, used in zip(values / bounds, found, strict=True):
        for agent in range(game.agents):
            own = [row[k] for k, members in enumerate(game.in_constraint) if agent in members]
            assert used[agent] == pytest.approx(max(own))


def test_shares_are_not_known_without_bounds():
    game = load_scenario("cournot").system_objects()[0].game
    assert game.quantities == ()
    assert np.all(np.isnan(shares(game, {"action": np.ones((1, game.agents))})))


def test_messages_are_counted_as_the_law_gets_them():
    lost, silent = MessageLoss(probability=0.4), Silence(agents=(2,), start=0.3, end=0.5)
    law = PartialInformation(graphs.ring(5), 1.0, 1.0)
    system = robot_system(robot_state(FIVE), law=law, mode="sampled", faults=(lost, silent))
    clock = Clock(duration=1.0, timestep=0.01, control_period=0.02, sample_period=0.1)
    shown_system = ShownSystem(system, clock)
    links = shown_system.meta()["links"]
    assert len(links) == 10
    assert sorted(map(sorted, links))[::2] == shown_system.meta()["edges"]
    found = shown_system.messages(13, 97)["robots/messages"]

    faults = for_native(system.faults, system.game, law.graph, system.seed)
    plain = np.zeros((10, 2))
    for step in range(13, 97):
        if step % 2:
            continue
        for link, (_, sender) in enumerate(links):
            gone = False
            for number in range(faults.pointer[-1]):
                row = native.fault(faults, number)
                on = row.start <= step * 0.01 + 1e-9 < row.end
                if row.target != link or not on:
                    continue
                with np.errstate(over="ignore"):
                    chance = native.uniform(system.seed, row.stream, link, step // 2)
                silence = number >= faults.pointer[native.SILENCE]
                gone |= silence or chance < row.amount
            if sender == 3 and 30 <= step < 50:
                assert gone
            plain[link, int(gone)] += 1
    assert np.array_equal(found, plain)
    assert np.sum(found) == 42 * 10


def test_nothing_is_lost_without_faults_and_nothing_counted_in_continuous_time():
    law = PartialInformation(graphs.ring(5), 1.0, 1.0)
    clock = Clock(duration=1.0, timestep=0.01, control_period=0.02, sample_period=0.1)
    held = ShownSystem(robot_system(robot_state(FIVE), law=law, mode="sampled"), clock)
    assert np.all(held.messages(0, 10)["robots/messages"] == [5, 0])
    flowing = ShownSystem(robot_system(robot_state(FIVE), law=law), clock)
    assert flowing.meta()["message_period"] is None
    assert flowing.messages(0, 10) == {}
    measured = ShownSystem(robot_system(robot_state(FIVE)), clock).meta()
    assert measured["edges_are"] == "measurements"
    assert measured["edges"] == [[1, 2], [2, 3], [3, 4], [4, 5]]


def poses_of(found):
    """(T, K, 8), as the page puts them together."""
    samples = len(found["time"])
    poses = np.tile(found["pose_base"], (samples, 1))
    poses[:, found["pose_columns"]] = found["pose_values"]
    return poses.reshape(samples, -1, 8)


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_a_replay_has_every_robot_where_the_trajectory_has_it(engine):
    trajectory = gne_mj.run("velocity-sync", {**SHORT, "plant.engine": engine})
    meta, found = unpack(replay_pack(trajectory))
    data = trajectory["robots"]
    assert np.array_equal(found["time"], data["time"])
    poses = poses_of(found)
    (about,) = meta["systems"]
    for agent, item in enumerate(about["anchors"]):
        assert meta["items"][item] == f"meshcat/robots/robot_{agent + 1}/main"
        assert np.array_equal(poses[:, item, 0], data["position"][:, agent])
        assert np.all(poses[:, item, 1:] == [0, 0, 1, 0, 0, 0, 1])
    coil = meta["items"].index("meshcat/robots/robot_2/coil")
    # from the mast's top to the hook, which hangs 0.35 m behind an unstretched spring
    assert np.allclose(poses[:, coil, 7], np.abs(data["extension"][:, 1] + 0.35), atol=1e-12)
    assert np.allclose(found["robots/action"], data["action"], rtol=1e-6)
    assert np.allclose(found["robots/quantity/gap"], data["gap"], rtol=1e-6, atol=1e-6)
    assert np.allclose(found["robots/margin"], -data["constraint"].max("constraint"), rtol=1e-6)
    assert meta["outcome"]["robots"]["status"] == trajectory.status
    assert sum(meta["command_lengths"]) == len(found["commands"])
    assert about["quantities"][0]["bound"] == [3.0] * 5


def test_a_replay_of_own_robots_moves_all_their_joints():
    scenario = ROOT / "examples" / "robot" / "scenario.toml"
    trajectory = gne_mj.run(scenario, {"simulation.duration": 0.5})
    (name,) = trajectory.tree.children
    meta, found = unpack(replay_pack(trajectory))
    moving = {meta["items"][column // 8] for column in found["pose_columns"]}
    assert len(moving) > len(meta["systems"][0]["anchors"])
    data = trajectory[name]
    (system,) = load_scenario(scenario).system_objects()
    plant = system.mujoco_plant(load_scenario(scenario).clock())
    import mujoco

    for sample in (0, 3, -1):
        plant.data.qpos[:] = data["configuration"][sample]
        mujoco.mj_kinematics(plant.model, plant.data)
        for body in range(1, plant.model.nbody):
            path = f"meshcat/{name}/{plant.model.body(body).name}"
            if path in meta["items"]:
                pose = poses_of(found)[sample, meta["items"].index(path)]
                assert np.allclose(pose[:3], plant.data.xpos[body], atol=1e-12)


def test_robots_of_which_no_body_moves_first_are_drawn_by_one_that_does(tmp_path):
    (tmp_path / "based.xml").write_text(BASED, encoding="utf-8")
    (tmp_path / "scenario.toml").write_text(OF_BASED, encoding="utf-8")
    trajectory = gne_mj.run(tmp_path / "scenario.toml", {"simulation.duration": 0.1})
    meta, _ = unpack(replay_pack(trajectory))
    anchors = meta["systems"][0]["anchors"]
    assert [meta["items"][i] for i in anchors] == [f"meshcat/fleet/robot_{i}/cart" for i in (1, 2)]
    old = gne_mj.Trajectory(trajectory.tree.copy(deep=True))
    del old.tree["fleet"]["configuration"]
    with pytest.raises(InvalidInput, match="an older version"):
        replay_pack(old)
    more = BASED.replace('<body name="cart">', '<body name="more"><joint name="j"/>'
                         '<geom size="0.1"/></body><body name="cart">')  # fmt: skip
    (tmp_path / "based.xml").write_text(more, encoding="utf-8")
    with pytest.raises(InvalidInput, match="the robots' files have changed"):
        replay_pack(trajectory)
    (tmp_path / "based.xml").unlink()
    assert "<table>" in notebook_html(trajectory)
    with pytest.raises(InvalidInput, match=r"based\.xml"):
        replay_html(trajectory)


def test_systems_that_end_early_stay_and_their_lines_stop():
    changes = {"robots.controller.mode": "sampled", "simulation.control_period": 1.0,
               "simulation.duration": 3.0}  # fmt: skip
    trajectory = gne_mj.run("paper", changes)
    assert trajectory.reports["robots"]["status"] == "left_feasible_set"
    ended = float(trajectory["robots"]["time"][-1])
    meta, found = unpack(replay_pack(trajectory))
    later = found["time"] > ended + 1e-9
    assert np.any(later)
    assert np.all(np.isnan(found["robots/action"][later]))
    assert not np.any(np.isnan(found["channels/action"]))
    poses = poses_of(found)
    assert np.all(poses[later] == poses[found["time"] <= ended + 1e-9][-1])
    assert meta["outcome"]["robots"]["exit_time"] == pytest.approx(ended, abs=0.51)


def test_systems_in_lanes_stand_beside_each_other_and_one_that_went_outside_is_told():
    """Two laws from one start: what is drawn of both, and how the second one's run ended."""
    tables = json.loads(load_scenario("desired-velocity").model_dump_json(exclude_none=True))
    (robots,) = tables["systems"].values()
    rival = {**robots, "controller": {"information": "primal-dual", "dual_gain": 10.0}}
    tables["systems"] = {"ours": robots, "rival": rival}
    changes = {"simulation.on_exit": "continue", "simulation.duration": 0.5}
    meta, found = unpack(replay_pack(gne_mj.run(tables, changes)))
    poses = poses_of(found)
    lanes = [poses[:, system["anchors"], 1] for system in meta["systems"]]
    assert np.all(lanes[0] == 0.0)
    assert np.all(lanes[1] == -1.2)
    told = meta["outcome"]["rival"]
    assert told["status"] == "went_outside"
    assert 0.0 < told["exit_time"] < 0.5


def test_long_trajectories_are_thinned_and_keep_their_end(monkeypatch):
    monkeypatch.setattr("gne_mj.viewer.replay.SAMPLES", 7)
    trajectory = gne_mj.run("velocity-sync", {**SHORT, "plant.engine": "ode"})
    _, found = unpack(replay_pack(trajectory))
    assert len(found["time"]) == 7 + 1
    assert found["time"][-1] == 1.0
    assert np.all(np.isin(found["time"], trajectory["robots"]["time"]))


def test_a_trajectory_of_no_scenario_is_refused():
    clock = Clock(duration=0.1, timestep=0.01, control_period=0.01, sample_period=0.1)
    trajectory = Simulation([robot_system(robot_state(FIVE))], clock).run()
    with pytest.raises(InvalidInput, match="robots are drawn from the scenario"):
        replay_pack(trajectory)


def test_the_file_has_all_inside_and_asks_for_nothing(tmp_path):
    trajectory = gne_mj.run("paper", SHORT)
    path = write_html(trajectory, tmp_path / "run.html", "<b>& co</b>")
    text = path.read_text(encoding="utf-8")
    assert "&lt;b&gt;&amp; co&lt;/b&gt;" in text
    assert "connect-src" not in text.split("</head>")[0]  # so that default-src 'none' holds for it
    assert "default-src 'none'" in text
    assert ' src="' not in text.replace(page_file("meshcat.min.js").decode(), "")
    assert re.findall("<link [^>]*>", text) == ['<link rel="icon" href="data:,">']
    for licence in ("Robin Deits", "Leon Sorokin"):
        assert licence in text
    assert list(tmp_path.iterdir()) == [path]


def test_the_page_is_one_script_and_one_style_besides_meshcat():
    page = page_file("index.html").decode()
    assert re.findall('<script[^>]* src="([^"]*)"', page) == ["meshcat.min.js", "page.js"]
    assert re.findall('<link rel="stylesheet" href="([^"]*)"', page) == ["page.css"]
    assert not re.search(r"@import|url\(", page_file("page.css").decode())
    script = page_file("page.js").decode()
    inside = re.fullmatch(r'//.*?\n"use strict";\n\(\(\) => \{\n(.*)\}\)\(\);\n', script, re.S)
    assert inside
    # all of it is within that function: but ends of texts of two lines every line is indented
    assert not re.search(r"^[^ \n`]", inside[1], re.M)
    assert not re.search(r"\bimport\(", script)


def test_every_element_that_scripts_look_for_is_in_the_page():
    types = (Path(__file__).parents[1] / "page" / "src" / "types.d.ts").read_text()
    elements = types.partition("export interface Elements {")[2].partition("}")[0]
    looked_for = set(re.findall(r'^  "?([\w-]+)"?:', elements, re.M))
    there = set(re.findall(r' id="([\w-]+)"', page_file("index.html").decode()))
    assert looked_for - there == {"replay"}  # which only a file from disk has
    assert len(looked_for) > 30


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "run.html"
    path.write_text("old")
    trajectory = gne_mj.run("velocity-sync", {**SHORT, "plant.engine": "ode"})

    def full(self, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(StorageError, match="space"):
        write_html(trajectory, path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_scripts_cannot_end_the_page_they_are_in():
    trajectory = gne_mj.run("velocity-sync", {**SHORT, "plant.engine": "ode"})
    text = html_page(trajectory, "</script><script>alert(1)")
    assert text.count("<script") == text.count("</script>")


def of_integrators(**more):
    """A system's tables: three integrators in the velocity game, all inputs held."""
    return {
        "game": {"type": "velocity-synchronization", **more.pop("game", {})},
        "agents": {"type": "integrator", "count": 3},
        "controller": {"mode": "sampled", **more},
    }


@pytest.mark.slow
def test_bounds_that_move_kept_estimates_and_counted_messages_are_shown():
    bound = {"type": "ramp", "from": 3.0, "to": 2.0, "rate": 1.0}
    partial = {"information": "partial", "graph": "line"}
    trajectory = gne_mj.run(load_scenario({
        "simulation": {"duration": 0.4, "timestep": 0.01},
        "systems": {
            "moving": of_integrators(game={"gap_bound": [3.5, bound, 3.5]}),
            "kept": of_integrators(estimates="needed", **partial),
            "events": of_integrators(communication={"type": "event", "threshold": 0.01}, **partial),
            "pushed": of_integrators(mode="implicit", observer=1.0)
            | {"faults": [{"type": "push", "force": 2.0}]},
        },
    }))  # fmt: skip
    meta, found = unpack(replay_pack(trajectory))
    moving, kept, events, pushed = meta["systems"]
    gap = next(each for each in moving["quantities"] if each["name"] == "gap")
    assert gap["moving_bounds"] == {"bound": "gap_bound", "lower_bound": "gap_lower_bound"}
    assert gap["bound"] is None
    bounds = np.array([[3.5, 3.0 - time, 3.5] for time in found["time"]])
    assert np.allclose(found["moving/quantity/gap_bound"], bounds, atol=1e-6)
    gaps = trajectory["moving"]["gap"].to_numpy()
    used = np.abs(gaps) / bounds
    assert np.allclose(found["moving/share"], used, rtol=0, atol=2.0**-12 + 1e-7)  # as is shown
    assert np.array_equal(found["moving/share"] > 1.0, used > 1.0)
    # each follower needs its predecessor's velocity, and no other
    assert kept["kept"] == {"by": [2, 3], "action": [0, 1]}
    assert found["kept/estimate"].shape == (len(found["time"]), 2)
    assert events["kept"] is None
    assert events["triggered"] is True
    assert events["message_period"] is None
    (messages,) = (each for each in events["quantities"] if each["name"] == "sent_message")
    assert messages["labels"] == ["1", "2", "3"]
    counted = found["events/quantity/sent_message"]
    assert np.all(np.diff(counted, axis=0) >= 0.0)
    assert np.sum(counted[-1]) == trajectory.reports["events"]["messages"]["sent"] > 0
    assert [each["name"] for each in pushed["quantities"]][-1] == "load"
    assert np.allclose(found["pushed/quantity/load"][-1], 2.0)
