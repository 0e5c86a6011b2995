"""Outputs of users' robots: velocities of their parts, read at every stage."""

import mujoco
import numpy as np
import pytest
from builders import run_loop

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.plants import mjcf_position
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_output import Output, OutputTable, channels_of
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile, mjcf_robots
from gne_mj.system import System

# A free hull that bears a mast on a ball joint, a wheel, and a sensor of each kind
VESSEL = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="hull" pos="0.3 -0.2 1" quat="0.9 0.2 -0.3 0.1">
      <joint name="free" type="free"/>
      <geom name="hull" type="box" size="0.3 0.2 0.1" pos="0.1 0 0.02" mass="2"/>
      <site name="bow" pos="0.4 0.1 0" euler="10 20 30"/>
      <body name="mast" pos="0 0.1 0.2">
        <joint name="ball" type="ball"/>
        <geom name="top" pos="0 0.1 0.5" size="0.1" mass="0.4"/>
        <site name="tip" pos="0 0 1"/>
      </body>
      <body name="wheel" pos="-0.3 0 0">
        <joint name="roll" axis="0 1 0"/>
        <geom name="rim" type="cylinder" size="0.1 0.02" mass="0.3"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="belt"><joint joint="roll" coef="0.1"/></fixed></tendon>
  <actuator>
    <motor name="push" site="bow" gear="1 0 0 0 0 0"/><motor name="turn" joint="roll" gear="3"/>
  </actuator>
  <sensor>
    <velocimeter name="log" site="bow"/><gyro name="gyro" site="tip"/>
    <framelinvel name="drift" objtype="body" objname="mast"/>
    <frameangvel name="turning" objtype="xbody" objname="hull"/>
    <framelinvel name="nearing" objtype="site" objname="tip" reftype="site" refname="bow"/>
    <ballangvel name="swing" joint="ball"/>
    <tendonvel name="belt" tendon="belt"/><actuatorvel name="turn" actuator="turn"/>
  </sensor>
</mujoco>
"""
OBJECT = mujoco.mjtObj
OBJECTS = {"body": OBJECT.mjOBJ_XBODY, "site": OBJECT.mjOBJ_SITE, "geom": OBJECT.mjOBJ_GEOM}


def plant_of(folder, outputs, text=VESSEL, input="turn", **options):
    path = folder / "robot.xml"
    path.write_text(text)
    robots = tuple(RobotFile(path, output, input) for output in outputs)
    return MjcfPlant(mjcf_robots(robots, np.full(len(robots), np.inf)), 0.002, **options)


def moved(plant, seed):
    """Anywhere, at any velocity, with kinematics that are stale."""
    rng = np.random.default_rng(seed)
    plant.data.qpos[:] += rng.normal(size=plant.model.nq)
    mujoco.mj_normalizeQuat(plant.model, plant.data.qpos)
    plant.data.qvel[:] = rng.normal(size=plant.model.nv)
    return plant.state


def objects_velocity(plant, robot, output):
    """MuJoCo's own word."""
    mujoco.mj_forward(plant.model, plant.data)
    found = np.empty(6)
    index = getattr(plant.model, output.kind)(f"robot_{robot + 1}/{output.name}").id
    mujoco.mj_objectVelocity(
        plant.model, plant.data, OBJECTS[output.kind], index, found, output.frame == "own"
    )
    return found[output.axis + 3 * (not output.angular)]


def test_velocities_of_frames_are_those_that_mujoco_tells(tmp_path):
    names = {"body": ["hull", "mast"], "site": ["bow", "tip"], "geom": ["hull", "top"]}
    outputs = [
        Output(kind, name, angular, frame, axis)
        for kind in names
        for name in names[kind]
        for angular in (False, True)
        for frame in ("world", "own")
        for axis in range(3)
    ]
    plant = plant_of(tmp_path, outputs)
    found = moved(plant, 1)
    expected = [objects_velocity(plant, i, output) for i, output in enumerate(outputs)]
    assert plant.measures_every_stage
    assert np.allclose(found[:, 0], expected, rtol=0, atol=1e-13)
    places = {"body": "xpos", "site": "site_xpos", "geom": "geom_xpos"}
    for i, output in enumerate(outputs):
        if not output.angular and output.frame == "world":
            index = getattr(plant.model, output.kind)(f"robot_{i + 1}/{output.name}").id
            at = getattr(plant.data, places[output.kind])[index, output.axis]
            assert found[i, 1] == pytest.approx(at, abs=1e-14)


def test_sensors_tendons_joints_and_sums_are_what_mujoco_measures(tmp_path):
    three = ["log", "gyro", "drift", "turning", "swing", "nearing"]
    sensors = [Output("sensor", name, axis=axis) for name in three for axis in range(3)]
    parts = (Output("joint", "roll", factor=2.0), Output("tendon", "belt", factor=-3.0))
    outputs = [
        *sensors, "belt", "turn", Output("tendon", "belt"), Output("actuator", "turn"),
        Output("joint", "ball", True, "", 2), Output("joint", "free", False, "", 1),
        Output("joint", "free", True, "", 0), Output("sum", terms=parts, factor=0.5),
    ]  # fmt: skip
    plant = plant_of(tmp_path, outputs)
    found = moved(plant, 2)[:, 0]
    assert not plant.measures_every_stage  # for 'nearing', which no kinematics say
    mujoco.mj_forward(plant.model, plant.data)
    data, per_robot = plant.data, plant.model.nv // len(outputs)
    expected = []
    for i, output in enumerate(outputs):
        qvel = data.qvel[per_robot * i :][:per_robot]  # free 6, ball 3, roll
        of_sensor = output if isinstance(output, str) else output.name
        others = {
            20: 0.1 * qvel[9], 21: 3 * qvel[9], 22: qvel[8], 23: qvel[1], 24: qvel[3],
            25: 0.5 * (2.0 * qvel[9] - 3.0 * 0.1 * qvel[9]),
        }  # fmt: skip
        if i in others:
            expected.append(others[i])
        else:
            axis = 0 if isinstance(output, str) else output.axis
            expected.append(data.sensor(f"robot_{i + 1}/{of_sensor}").data[axis])
    assert np.allclose(found, expected, rtol=0, atol=1e-13)


SLED = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody><body name="sled">
    <joint name="x" type="slide" axis="1 0 0" damping="0.3"/>
    <geom name="sled" type="box" size="0.2 0.1 0.1" mass="2"/>
    <body name="rider"><joint name="lean" axis="0 1 0" stiffness="3" damping="0.2"/>
      <geom pos="0 0 0.4" size="0.1" mass="0.5"/><site name="head" pos="0 0 0.5"/></body>
  </body></worldbody>
  <actuator><motor name="turn" joint="x"/></actuator>
</mujoco>
"""


def closed_loop(folder, output, mode, integrator):
    path = folder / "sled.xml"
    path.write_text(SLED)
    agents = mjcf_robots((RobotFile(path, output, "turn"),) * 3, np.full(3, np.inf))
    y = np.array([0.3, 0.5, 0.1])
    system = System(
        "sleds", velocity_game(3, 1.0, 2.0), agents, FullInformation(), 0.1,
        agents.equilibrium(y), engine="mujoco", mode=mode, integrator=integrator,
    )  # fmt: skip
    return run_loop(system, 0.005, 200, 0.01)


MODES = [("rk4", "continuous"), ("euler", "sampled"), ("rk4", "implicit")]


@pytest.mark.parametrize(("integrator", "mode"), MODES)
def test_a_body_that_slides_is_its_joint_at_every_stage(tmp_path, integrator, mode):
    """A stage that saw the step's start would be wrong by more than 1e-5 in mode continuous."""
    by_joint = closed_loop(tmp_path, "x", mode, integrator)
    body = Output("body", "sled", axis=0)
    states, inputs, _, loop = closed_loop(tmp_path, body, mode, integrator)
    assert np.allclose(states[:, :, 0], by_joint[0][:, :, 0], rtol=0, atol=1e-12)
    assert np.allclose(inputs, by_joint[1], rtol=0, atol=1e-9)
    if mode == "implicit":
        assert loop.monitor.prediction < 1e-9


def test_a_head_with_a_lookahead_begins_where_it_is_told(tmp_path):
    """Above a rider that leans: Newton's method finds the joints' positions."""
    path = tmp_path / "sled.xml"
    path.write_text(SLED)
    robots = (RobotFile(path, Output("site", "head", axis=0), "turn"),) * 2
    limit, state = np.full(2, np.inf), np.array([[0.9, 0.4], [-0.3, 0.1]])
    table = np.column_stack([np.full(2, 0.5), np.zeros(2), np.full(2, 0.2)])
    plant = MjcfPlant(MjcfRobots(mjcf_position, table, limit, robots=robots), 0.002)
    plant.reset(state)
    assert np.allclose(plant.state, state, rtol=0, atol=1e-11)
    assert plant.data.site("robot_1/head").xpos[0] == pytest.approx(0.4, abs=1e-11)
    assert np.all(plant.data.qpos != 0.0)
    with pytest.raises(InvalidInput, match=r"site 'head', x.*local_damping acts at joints"):
        MjcfPlant(MjcfRobots(mjcf_position, table + 0.1, limit, robots=robots), 0.002)
    angular = (RobotFile(path, Output("site", "head", True, axis=1), "turn"),) * 2
    with pytest.raises(InvalidInput, match=r"lookahead it must have a position"):
        MjcfPlant(MjcfRobots(mjcf_position, table, limit, robots=angular), 0.002)
    path.write_text(SLED.replace(' type="slide"', ""))
    plant = MjcfPlant(MjcfRobots(mjcf_position, table, limit, robots=robots), 0.002)
    with pytest.raises(InvalidInput, match=r"site 'head', x.*no joint positions give it"):
        plant.reset(state + 9.0)  # farther than it reaches


def test_outputs_are_given_for_all_agents_or_each():
    two = OutputTable(body="hull", axes=["x", "y"])
    x, y = (Output("body", "hull", axis=axis) for axis in (0, 1))
    assert channels_of(two, 2, 2) == [x, y, x, y]
    assert channels_of([two, two], 2, 2) == [x, y, x, y]
    assert channels_of([OutputTable(body="hull"), "r"], 2, 1) == [x, "r"]
    assert channels_of(["r", OutputTable(body="hull", axes=["y"])], 2, 2) == ["r", y, "r", y]
    assert channels_of([["r", "s"], [two]], 2, 2) == ["r", "s", x, y]
    with pytest.raises(InvalidInput, match="a list of 2 names or a list of 3 such lists; a table"):
        channels_of("r", 3, 2)


WRONG = [
    (Output("body", "hul", axis=0), "no such body; did you mean 'hull'"),
    (Output("site", "bow"), "three velocities: say which by axes"),
    (Output("joint", "free"), "a free joint, with several velocities"),
    (Output("joint", "ball", axis=1, frame="world"), "name the body"),
    (Output("joint", "roll", axis=1), "leave its axes out"),
    (Output("sensor", "gyro"), r"\{sensor = 'gyro', axes = \['x'\]\}"),
    (Output("sensor", "belt", axis=0), "one number: leave its axes out"),
    ("gyro", r"tells 3 numbers"),
]


@pytest.mark.parametrize(("output", "words"), WRONG)
def test_what_a_robot_does_not_have_is_refused(tmp_path, output, words):
    with pytest.raises(InvalidInput, match=rf"^agents.output: got .*{words}"):
        plant_of(tmp_path, [output])


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({}, "output"),
        ({"body": "hull", "tendon": "belt"}, "output"),
        ({"tendon": "belt", "axes": ["x"]}, "output.axes"),
        ({"sensor": "log", "frame": "own"}, "output.frame"),
        ({"body": "hull", "factor": 2.0}, "output.factor"),
        ({"sum": [{"body": "hull", "axes": ["x", "y"]}]}, "output.sum"),
    ],
)
def test_tables_that_say_too_little_or_too_much(table, key):
    with pytest.raises(InvalidInput) as caught:
        OutputTable.model_validate(table).channels(1)
    assert caught.value.key == key
