"""What files of robots say of the whole world: honoured, refused, or told to no one."""

import dataclasses
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest

import gne_mj
from gne_mj.errors import EngineError, InvalidInput
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import MjcfAgents, RobotFile, mjcf_robots
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.plants.native_mujoco import LOST, check_warnings, lost_text
from gne_mj.scenario import load_scenario

# A boat that swings a mast against a stop, over a floor of its own
BOAT = """
<mujoco>
  {compiler}
  <option {option}>{flags}</option>
  {size}
  <worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body name="hull" pos="0 0 0.3">
      <joint name="x" type="slide" axis="1 0 0" {joint}/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="hull" type="box" size="0.2 0.1 0.05" mass="{mass}"/>
      <body name="mast" pos="0 0 0.1">
        <joint name="lean" axis="0 1 0" stiffness="4" damping="0.1" range="-20 20"/>
        <geom name="top" pos="0 0 0.4" size="0.05" mass="0.5"/>
      </body>
      <body name="ball" pos="0 0 -0.1">
        <joint name="roll" axis="0 1 0" armature="0.1"/>
        <geom name="ball" size="0.1" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  {extra}
  <actuator><motor name="u" joint="x"/></actuator>
</mujoco>
"""
NOTHING = {
    "compiler": "", "option": 'gravity="0 0 -9.81"', "flags": "", "size": "", "extra": "",
    "mass": "3", "joint": "",
}  # fmt: skip


def boat(folder, name="boat.xml", **more):
    path = folder / name
    path.write_text(BOAT.format(**{**NOTHING, **more}))
    return RobotFile(path, "x", "u")


def plant_of(*robots, integrator="euler"):
    return MjcfPlant(mjcf_robots(robots, np.full(len(robots), np.inf)), 0.002, integrator)


HONOURED = [
    {},
    {"option": 'gravity="0 0 0" density="1000" viscosity="0.1"'},
    {"option": 'gravity="0.5 0 -2" density="900" wind="3 0 0"'},
    {"option": 'o_solref="0.1 1" o_margin="0.02"', "flags": '<flag override="enable"/>'},
    {"option": 'cone="elliptic" impratio="3" solver="CG" iterations="7"'},
    {"flags": '<flag contact="disable" limit="disable" gravity="disable"/>'},
    {"extra": '<contact><exclude body1="world" body2="ball"/></contact>'},
    {"extra": '<contact><pair geom1="floor" geom2="ball" solref="0.2 1"/></contact>'},
    {"extra": '<equality><joint joint1="roll" joint2="x" polycoef="0 9 0 0 0"/></equality>'},
    {"compiler": '<compiler angle="radian" boundmass="1" balanceinertia="true"/>'},
    {"compiler": '<compiler fusestatic="true" discardvisual="true" inertiafromgeom="true"/>'},
    {"joint": 'frictionloss="0.4" damping="0.2" armature="0.3"'},
    {"extra": '<custom><numeric name="n" data="1"/></custom><keyframe><key qpos="1 1 0 0"/>'
              "</keyframe>"},
    {"size": '<size memory="2M" nuserdata="5" nuser_body="2"/>'},
]  # fmt: skip


@pytest.mark.parametrize("more", HONOURED)
@pytest.mark.parametrize("integrator", ["euler", "rk4"])
def test_each_robot_moves_in_a_fleet_as_its_file_does_alone(tmp_path, more, integrator):
    robot = boat(tmp_path, **more)
    plant = plant_of(robot, robot, robot, integrator=integrator)
    plant.reset([[1.0, 0.0], [-0.5, 0.2], [0.3, 0.0]])
    model = mujoco.MjModel.from_xml_path(str(robot.path))
    model.opt.timestep, model.opt.integrator = 0.002, plant.model.opt.integrator
    data = mujoco.MjData(model)
    first = model.nq
    data.qpos[:], data.qvel[:] = plant.data.qpos[first : 2 * first], plant.data.qvel[first:][:first]
    data.ctrl[0] = 2.0
    plant.step([1.0, 2.0, 3.0], 300)
    mujoco.mj_step(model, data, 300)
    assert np.ptp(data.qpos) > 1e-3
    # one solver for all robots ends its iterations at other residuals
    assert np.allclose(plant.data.qpos[first : 2 * first], data.qpos, rtol=0, atol=1e-5)


DIFFERENT = [
    ("density", 'density="2"'),
    ("viscosity", 'viscosity="2"'),
    ("wind", 'wind="0 1 0"'),
    ("gravity", 'gravity="0 0 -1"'),
    ("magnetic", 'magnetic="1 1 1"'),
    ("impratio", 'impratio="2"'),
    ("cone", 'cone="elliptic"'),
    ("tolerance", 'tolerance="1e-3"'),
    ("iterations", 'iterations="3"'),
    ("o_margin", 'o_margin="3"'),
    ("actuatorgroupdisable", 'actuatorgroupdisable="4"'),
]


@pytest.mark.parametrize(("name", "option"), DIFFERENT)
def test_files_of_one_fleet_with_different_options_are_refused(tmp_path, name, option):
    option = option if "gravity" in option else option + ' gravity="0 0 -9.81"'
    first, second = boat(tmp_path), boat(tmp_path, "other.xml", option=option)
    for robots in ((first, second), (second, first)):
        with pytest.raises(InvalidInput, match=rf"its {name} must be that of the first file"):
            plant_of(*robots)
    assert plant_of(second, second).model.nu == 2


def test_files_of_one_fleet_with_different_flags_are_refused(tmp_path):
    first = boat(tmp_path)
    for flag in ("contact='disable'", "energy='enable'"):
        second = boat(tmp_path, "other.xml", flags=f"<flag {flag}/>")
        with pytest.raises(InvalidInput, match="its flags must be that of the first file"):
            plant_of(first, second)


def test_the_automatic_reset_is_off_whatever_files_say(tmp_path):
    flags = ('<flag autoreset="disable"/>', '<flag autoreset="enable"/>')
    plant = plant_of(*[boat(tmp_path, f"{k}.xml", flags=flag) for k, flag in enumerate(flags)])
    assert plant.model.opt.disableflags == mujoco.mjtDisableBit.mjDSBL_AUTORESET


def test_a_scenarios_clock_stands_above_a_files(tmp_path):
    clocks = ('timestep="0.1" integrator="implicit"', 'timestep="0.2"')
    robots = [boat(tmp_path, f"{k}.xml", option=clock) for k, clock in enumerate(clocks)]
    plant = plant_of(*robots, integrator="rk4")
    assert plant.model.opt.timestep == 0.002
    assert plant.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4


WRONG = [
    ({"mass": "nan"}, "every number must be finite, and one of its is nan"),
    ({"mass": "inf"}, "its body_mass has inf"),
    ({"option": 'wind="0 inf 0"'}, "its wind has inf"),
    ({"option": 'gravity="0 0 nan"'}, "every number must be finite"),
    ({"joint": 'damping="-inf"'}, "every number must be finite, and its dof_damping has -inf"),
    ({"mass": "-1"}, "MuJoCo must"),
    ({"mass": "heavy"}, "MuJoCo must read it: XML Error"),
    ({"extra": "<contact"}, "MuJoCo must read it"),
    ({"flags": '<flag sleep="enable"/>'}, "leave the flag 'sleep' out"),
]


@pytest.mark.parametrize(("more", "words"), WRONG)
def test_files_that_no_fleet_can_have_are_refused_in_one_sentence(tmp_path, more, words):
    good, bad = boat(tmp_path), boat(tmp_path, "bad.xml", **more)
    with pytest.raises(InvalidInput) as caught:
        plant_of(good, bad)
    said = str(caught.value)
    assert caught.value.key == "agents.path"
    assert "bad.xml" in said
    assert words in said
    assert "\n" not in said


def test_mujoco_says_nothing_and_leaves_no_file(tmp_path, monkeypatch, capfd):
    """Neither of options it leaves behind, nor of numbers, nor of what becomes unstable."""
    monkeypatch.chdir(tmp_path)
    robot = boat(tmp_path, option='timestep="0.1" density="5"', size='<size nuserdata="3"/>')
    stiff = boat(tmp_path, "stiff.xml", joint='stiffness="1e9" springref="1"')
    nan = boat(tmp_path, "nan.xml", mass="nan")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plant_of(robot, robot).reset([[1.0, 0.0], [0.0, 0.0]])
        plant = plant_of(stiff)
        plant.reset([[0.0, 0.0]])
        plant.step([0.0], 2000)
        assert not np.all(np.isfinite(plant.state))
        with pytest.raises(InvalidInput):
            plant_of(nan)
    assert not Path("MUJOCO_LOG.TXT").exists()
    assert capfd.readouterr() == ("", "")


def test_contacts_that_do_not_fit_are_told():
    balls = "".join(
        f'<body pos="0 0 {0.05 * k}"><freejoint/><geom size="0.1"/></body>' for k in range(40)
    )
    said = []
    mujoco.set_mju_user_warning(said.append)
    try:
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><size memory="60K"/><worldbody>{balls}</worldbody></mujoco>'
        )
        data = mujoco.MjData(model)
        check_warnings(data)
        mujoco.mj_step(model, data)
    finally:
        mujoco.set_mju_user_warning(None)
    assert said
    with pytest.raises(EngineError, match="left out con"):
        check_warnings(data)
    # where the motion had diverged before, that is the reason, and what runs say
    data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number = 1
    check_warnings(data)


def test_memory_that_files_ask_for_is_given(tmp_path):
    robot = boat(tmp_path, size='<size memory="40M"/>')
    assert plant_of(robot, robot).model.narena == 2 * 40 * 2**20
    small = boat(tmp_path, size='<size memory="1K"/>')
    assert plant_of(small).model.narena > 2**20


@pytest.mark.parametrize("count", [1, 3, 10])
def test_robots_stand_on_one_floor(tmp_path, count):
    """As many contacts for each robot as alone, and the same height."""
    robot = boat(tmp_path)
    plant = plant_of(*[robot] * count)
    plant.reset(np.zeros((count, 2)))
    plant.step(np.zeros(count), 1500)
    assert plant.data.ncon == count
    heights = plant.data.qpos.reshape(count, -1)[:, 1]
    model = mujoco.MjModel.from_xml_path(str(robot.path))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1500)
    assert np.allclose(heights, data.qpos[1], rtol=0, atol=1e-6)


def test_other_floors_stay_apart(tmp_path):
    """Planes of another height, direction or surface are not the same."""
    text = BOAT.format(**NOTHING)
    floors = ('friction="2 1 1"', 'pos="0 0 -0.1"', 'zaxis="0.1 0 1"', "")
    robots = []
    for k, floor in enumerate((*floors, *floors)):
        path = tmp_path / f"{k}.xml"
        path.write_text(text.replace('size="5 5 1"', f'size="5 5 1" {floor}'))
        robots.append(RobotFile(path, "x", "u"))
    plant = plant_of(*robots)
    planes = plant.model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    assert np.count_nonzero(planes & (plant.model.geom_contype > 0)) == 4


def test_robots_that_overlap_at_the_start_are_refused(tmp_path):
    """What is wider than the 2 m between robots, or a floor that is no plane."""
    text = BOAT.format(**NOTHING)
    wide = text.replace('size="0.2 0.1 0.05" mass="3"', 'size="0.2 1.01 0.05" mass="3"')
    box = text.replace('type="plane" size="5 5 1"', 'type="box" size="5 5 0.01" pos="0 0 0.09"')
    for name, words in ((wide, "'robot_1/hull' of agent 1 overlaps 'robot_2/hull' of agent 2"),
                        (box, "of agent 1 overlaps 'robot_2/floor' of agent 2")):  # fmt: skip
        path = tmp_path / "over.xml"
        path.write_text(name)
        one = plant_of(RobotFile(path, "x", "u"))
        one.reset([[0.0, 0.0]])
        two = plant_of(*[RobotFile(path, "x", "u")] * 2)
        with pytest.raises(InvalidInput, match="2 m beside it") as caught:
            two.reset(np.zeros((2, 2)))
        assert words in str(caught.value)


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
@pytest.mark.parametrize("kind", sorted(LOST))
def test_a_run_ends_where_forces_are_left_out_and_keeps_what_it_had(mode, kind):
    changes = {"simulation.duration": 1.0, "controller.mode": mode}
    whole = gne_mj.run("velocity-sync", changes)["robots"]
    simulation = load_scenario("velocity-sync", changes).simulation_object()
    simulation.advance(200)
    simulation.runs["robots"].loop.plant.data.warning[kind].number = 1
    simulation.advance(300)
    kept = simulation.trajectory()
    report = kept.reports["robots"]
    assert kept.status == report["status"] == "forces_left_out"
    assert report["end_time"] == pytest.approx(0.4)
    assert report["message"] == f"at 0.4 s {lost_text(kind)}"
    times = kept["robots"]["time"].to_numpy()
    assert times[-1] == pytest.approx(0.4)
    assert np.all(np.diff(times) > 0.0)
    same = whole.sel(time=times)
    for name in ("action", "position"):
        assert np.array_equal(kept["robots"][name].to_numpy(), same[name].to_numpy())


def test_a_batch_keeps_its_runs_where_forces_were_left_out(tmp_path, monkeypatch):
    """One run of a batch, and the next one of the same thread begins without the warning."""
    reset, count = MujocoPlant.reset, []

    def warned(self, state):
        reset(self, state)
        count.append(state)
        self.data.warning[min(LOST)].number = int(len(count) == 3)

    monkeypatch.setattr(MujocoPlant, "reset", warned)
    found = gne_mj.batch(
        "velocity-sync", out=tmp_path / "b", changes={"simulation.duration": 0.1}, runs=4, threads=1
    )
    status = found["status"].to_numpy().tolist()
    assert sorted(status) == ["completed"] * 3 + ["forces_left_out"]


BALL = """
<mujoco><worldbody>
  <geom type="plane" size="5 5 1"/>
  <body name="ball" pos="0 0 0.1"><freejoint/><geom size="0.1"/><site name="middle"/></body>
</worldbody></mujoco>"""
# contacts with the floor and of neighbours, which overlap, and whether they rest
TOUCHES = {"floor": (3, 0, True), "agents": (0, 2, False), "none": (0, 0, False)}


@pytest.mark.parametrize("which", TOUCHES)
def test_contacts_that_there_are(tmp_path, which):
    path, spacing = tmp_path / "ball.xml", 0.15
    path.write_text(BALL)
    table = MjcfAgents.model_validate({
        "type": "mjcf-robot", "count": 3, "file": str(path), "output": {"site": "middle"},
        "input": {"body": "ball"}, "contacts": which, "spacing": spacing,
    })  # fmt: skip
    path.write_text(BALL.replace("<body pos", '<body name="body" pos'))
    plant = MjcfPlant(table.build((1, 1, 1)), 0.001, "euler")
    mujoco.mj_forward(plant.model, plant.data)
    floor, pairs, rests = TOUCHES[which]
    with_floor = np.any(plant.model.geom_bodyid[plant.data.contact.geom] == 0, axis=-1)
    assert (int(np.sum(with_floor)), int(np.sum(~with_floor))) == (floor, pairs)
    assert np.allclose(plant.data.qpos[1::7], [0.0, 0.15, 0.3])
    plant.step(np.zeros(3), 200)
    heights = plant.data.qpos[2::7]
    if rests:
        assert np.allclose(heights, 0.1, rtol=0, atol=2e-3)
    if which == "none":
        assert np.allclose(heights, 0.1 - 0.5 * 9.81 * 0.2**2, rtol=0, atol=1.1e-3)


def test_all_contacts_are_as_files_say_and_neighbours_need_room(tmp_path):
    robot = boat(tmp_path)
    agents = dataclasses.replace(mjcf_robots((robot,) * 2, np.full(2, np.inf)), spacing=0.1)
    with pytest.raises(InvalidInput, match=r"overlaps 'robot_2/hull' of agent 2, 0.1 m beside it"):
        MjcfPlant(agents, 0.002).reset(np.zeros((2, 2)))


def test_a_floor_that_all_files_bring_is_seen_once(tmp_path):
    robot = boat(tmp_path)
    model = plant_of(robot, robot, robot).model
    planes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    seen = [model.geom(geom).name for geom in planes if model.geom_group[geom] == 0]
    assert len(planes) == 2  # its own, which is hidden, and theirs
    assert seen == ["robot_1/floor"]
