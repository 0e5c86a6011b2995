"""MJCF robots of one's own whose outputs are positions with a look-ahead."""

import numpy as np
import pytest
from builders import UNEQUAL, position_robots, relative_error, run_loop, with_damping
from mjcf_files import MOTOR, flexible

import gne_mj as gm
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.graph import ring
from gne_mj.loops import monitor as watch
from gne_mj.plants import mjcf_position
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile
from gne_mj.system import System

TAU, V_0, COUNT = 0.7, 3.0, 5
LINEAR = {**UNEQUAL, "atan_coefficient": [0.0] * COUNT}
Y, Q = np.array([1.0, 0.2, -0.6, 0.4, 1.1]), np.array([0.4, 0.5, -0.9, 0.1, 1.4])
V = (Y - Q) / TAU


def fleet(folder, output="front", actuator=MOTOR):
    robots = []
    for i in range(COUNT):
        numbers = {name: values[i] for name, values in LINEAR.items()}
        path = folder / f"robot{i}.xml"
        path.write_text(flexible(numbers, actuator=actuator))
        robots.append(RobotFile(path, output, "push"))
    table = np.column_stack([*with_damping(LINEAR, TAU), np.full(COUNT, V_0)])
    return MjcfRobots(mjcf_position, table, np.full(COUNT, np.inf), robots=tuple(robots))


def system_of(agents, state, **options):
    game = velocity_game(COUNT, 0.0, 3.0)
    law = options.pop("law", None) or FullInformation()
    return System("robots", game, agents, law, 0.1, state, engine="mujoco", **options)


def builtin_state():
    """What a user's robot starts from: its rear rests, in the world, where the front begins."""
    return np.column_stack([Q, Y, np.full(COUNT, -V_0), Q])


MODES = [("rk4", "continuous"), ("euler", "sampled"), ("euler", "implicit"), ("rk4", "implicit")]


@pytest.mark.parametrize(("integrator", "mode"), MODES)
def test_a_copy_of_the_builtin_robot_moves_as_it_does(tmp_path, integrator, mode):
    """In mode implicit the prediction has the robots' own damping too, or outputs would differ."""
    h, steps, options = 0.005, 400, {"integrator": integrator, "mode": mode}
    own = system_of(fleet(tmp_path), np.column_stack([Y, Q]), **options)
    got, inputs, _, loop = run_loop(own, h, steps, 2 * h)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.positions == steps + 1
    assert loop.monitor.positions_outside == 0
    if mode == "implicit":
        assert loop.monitor.prediction < 1e-9
    expected, forces, *_ = run_loop(
        system_of(position_robots(LINEAR, TAU), builtin_state(), **options), h, steps, 2 * h
    )
    tolerance = 1e-11 if mode != "implicit" else 1e-8  # where inputs are solved for
    assert relative_error(got[:, :, 0], expected[:, :, 1]) < tolerance
    assert relative_error(got[:, :, 1], expected[:, :, 3]) < tolerance
    assert relative_error(inputs, forces) < 100 * tolerance


def test_estimates_ride_along(tmp_path):
    options = {"law": PartialInformation(ring(COUNT), 2.0, 0.05), "mode": "sampled"}
    own = system_of(fleet(tmp_path), np.column_stack([Y, Q]), **options)
    got, _, memory, _ = run_loop(own, 0.005, 200)
    builtin = system_of(position_robots(LINEAR, TAU), builtin_state(), **options)
    expected, _, others, _ = run_loop(builtin, 0.005, 200)
    assert relative_error(got[:, :, 0], expected[:, :, 1]) < 1e-11
    assert relative_error(memory, others) < 1e-11


def test_a_plant_alone_is_damped_too(tmp_path):
    agents = fleet(tmp_path)
    plant, u = MjcfPlant(agents, 0.002, "euler"), np.linspace(-1, 1, COUNT)
    plant.reset(np.column_stack([Y, Q]))
    assert np.allclose(plant.state, np.column_stack([Y, Q]), atol=1e-14)
    plant.step(u)
    M, d = np.array(LINEAR["main_mass"]), agents.parameters[:, 1]
    link = np.array(LINEAR["stiffness"]) * Q + np.array(LINEAR["damping"]) * (V + V_0)
    v = V + 0.002 * (u - d * V - link) / M
    q = Q + 0.002 * v
    assert np.allclose(plant.state, np.column_stack([q + TAU * v, q]), atol=1e-13)


@pytest.mark.parametrize("sensor", ["tendon_speed", "actuator_speed"])
def test_outputs_must_be_joints(tmp_path, sensor):
    with pytest.raises(InvalidInput, match=r"^agents.output: got '.*'.*lookahead.*joint"):
        MjcfPlant(fleet(tmp_path, sensor), 0.01)
    assert MjcfPlant(fleet(tmp_path, "joint_speed"), 0.01).outputs == ["joint_speed"] * COUNT


PLANAR = """
<mujoco><option gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body name="front">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
      <geom size=".1" mass="{main_mass}"/>
    </body>
    <body name="rear">
      <joint name="rear_x" type="slide" axis="1 0 0"/>
      <joint name="rear_y" type="slide" axis="0 1 0"/>
      <geom size=".1" mass="{appendage_mass}"/>
    </body>
  </worldbody>
  <tendon>
    <fixed stiffness="{stiffness}" damping="{damping}" springlength="0">
      <joint joint="x" coef="1"/><joint joint="rear_x" coef="-1"/>
    </fixed>
    <fixed stiffness="{stiffness}" damping="{damping}" springlength="0">
      <joint joint="y" coef="1"/><joint joint="rear_y" coef="-1"/>
    </fixed>
  </tendon>
  <actuator><motor name="u_x" joint="x"/><motor name="u_y" joint="y"/></actuator>
</mujoco>
"""


@pytest.mark.parametrize("mode", ["continuous", "implicit"])
def test_two_axes_in_one_plane(tmp_path, mode):
    """Two slide joints each; all robots are at one place, as their positions say."""
    files = []
    for i in range(3):
        numbers = {name: values[i] for name, values in LINEAR.items()}
        files.append(tmp_path / f"planar{i}.xml")
        files[-1].write_text(PLANAR.format(**numbers))
    _, damping = with_damping(LINEAR, TAU)
    keys = {
        "lookahead": TAU, "local_damping": damping[:3].tolist(), "reference_velocity": [1.0, -0.5]
    }  # fmt: skip
    start = {"action": [[0.5, 0.0], [0.0, 0.5], [-0.5, 0.0]], "velocity": [0.3, -0.2]}
    robots = gm.mjcf_robots(3, files, output=["x", "y"], input=["u_x", "u_y"], **keys)
    names = ("main_mass", "appendage_mass", "stiffness", "atan_coefficient", "damping")
    numbers = {name: LINEAR[name][:3] for name in names}
    # whose appendages rest in the world, as those of files do
    rest = {"appendage_velocity": [-1.0, 0.5], "extension": (np.array([[0.5, 0.0], [0.0, 0.5],
            [-0.5, 0.0]]) - TAU * np.array([0.3, -0.2])).tolist()}  # fmt: skip
    found = {}
    for name, agents, more in (
        ("file", robots, {}),
        ("ode", gm.planar_robots(3, output="position", **numbers, **keys), rest),
    ):
        agents_table = agents.model_dump(exclude_none=True)
        scenario = {
            "simulation": {"duration": 1.0, "timestep": 0.01, "integrator": "euler"},
            "systems": {"r": {
                "game": {"type": "velocity-consensus", "reference_velocity": [0.0, 0.0]},
                "agents": agents_table, "initial": {**start, **more},
                "controller": {"information": "full", "mode": mode},
            }},
        }  # fmt: skip
        run = gm.run(scenario)
        assert run.reports["r"]["positions"]["outside"] == 0
        found[name] = run["r"]
    for name in ("action", "position", "velocity"):
        assert relative_error(found["file"][name], found["ode"][name]) < 1e-8
    assert np.allclose(found["file"]["configuration"][0, [0, 4]], [0.5 - 0.3 * TAU, -0.3 * TAU])


@pytest.mark.parametrize("names", ["x", ["x", "y", "z"], [["x", "y"]] * 3, [["x", "y"], ["x"]]])
def test_as_many_names_as_axes(tmp_path, names):
    path = tmp_path / "planar.xml"
    path.write_text(PLANAR.format(**{name: values[0] for name, values in LINEAR.items()}))
    robots = gm.mjcf_robots(2, path, output=names, input=["u_x", "u_y"])
    with pytest.raises(InvalidInput, match=r"output: .*list of 2 names or a list of 2 such"):
        robots.build((2, 2))


def test_robots_at_one_place_must_not_overlap(tmp_path):
    path = tmp_path / "planar.xml"
    numbers = {name: values[0] for name, values in LINEAR.items()}
    text = PLANAR.format(**numbers).replace('<flag contact="disable"/>', "")
    path.write_text(text.replace('mass="0.5"', 'mass="0.5" contype="0" conaffinity="0"'))
    robots = tuple(RobotFile(path, *axis) for axis in (("x", "u_x"), ("y", "u_y")) * 2)
    table, limit = np.tile([TAU, 9.0, 0.0], (4, 1)), np.full(4, np.inf)
    agents = MjcfRobots(mjcf_position, table, limit, 2, robots=robots, together=True)
    plant = MjcfPlant(agents, 0.01)
    apart = np.array([0.0, 0.0, 1.0, 0.0])
    plant.reset(np.column_stack([apart, apart]))
    with pytest.raises(InvalidInput, match=r"agent 1 overlaps .* of agent 2: let their positions"):
        plant.reset(np.column_stack([0.1 * apart, 0.1 * apart]))
    assert not agents.repeated(2).together
    assert agents.repeated(1).together
