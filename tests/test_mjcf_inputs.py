"""Inputs of users' robots: shared actuators, and forces at bodies and sites."""

import mujoco
import numpy as np
import pytest
from builders import run_loop
from test_mjcf_outputs import SLED, VESSEL

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.plants import mjcf_robot
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_input import Input, InputTable, inputs_of
from gne_mj.plants.mjcf_output import Output
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile, mjcf_robots
from gne_mj.system import System


def plant_of(folder, inputs, text=VESSEL, limit=np.inf, axes=1):
    path = folder / "robot.xml"
    path.write_text(text)
    outputs = [Output("body", "hull", axis=axis) for axis in range(axes)]
    robots = tuple(RobotFile(path, o, i) for o, i in zip(outputs * len(inputs), inputs))  # noqa: B905
    limits = np.full(len(robots), limit)
    return MjcfPlant(
        MjcfRobots(mjcf_robot, np.zeros((len(robots), 0)), limits, axes, robots=robots), 0.002
    )


def test_forces_at_bodies_are_mujocos_own(tmp_path):
    """Each against mj_applyFT at the same point, anywhere."""
    inputs = [
        Input(kind=kind, name=name, torque=torque, own=own, axis=axis)
        for kind, name in (("body", "hull"), ("site", "tip"))
        for torque in (False, True)
        for own in (False, True)
        for axis in range(3)
    ]
    plant = plant_of(tmp_path, inputs)
    model, data, rng = plant.model, plant.data, np.random.default_rng(0)
    data.qpos[:] += rng.normal(size=model.nq)
    u = rng.normal(size=len(inputs))
    plant._driving.set(data.ctrl, u)
    mujoco.mj_forward(model, data)
    expected = np.zeros(model.nv)
    for i, given in enumerate(inputs):
        part = getattr(data, given.kind)(f"robot_{i + 1}/{given.name}")
        body = model.body(f"robot_{i + 1}/{'hull' if given.kind == 'body' else 'mast'}").id
        along = u[i] * (
            part.xmat.reshape(3, 3)[:, given.axis] if given.own else np.eye(3)[given.axis]
        )
        force, torque = (np.zeros(3), along) if given.torque else (along, np.zeros(3))
        mujoco.mj_applyFT(model, data, force, torque, part.xpos, body, expected)
    assert np.allclose(data.qfrc_actuator, expected, rtol=0, atol=1e-12)


PLATFORM = """
<mujoco><option gravity="0 0 0"/>
  <worldbody><body name="hull">
    <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
    <geom size="0.1" mass="2"/>
  </body></worldbody>
  <tendon>
    <fixed name="both"><joint joint="x" coef="0.6"/><joint joint="y" coef="0.8"/></fixed>
  </tendon>
  <actuator>
    <motor name="a" joint="x" gear="3"/><velocity name="b" joint="y" kv="5"/>
    <motor name="c" tendon="both" {clamp}/>
  </actuator>
</mujoco>
"""


def test_inputs_that_share_actuators(tmp_path):
    """u_1 drives a, c and u_2 drives b, c: force = B A u, of gears and a servo nothing is left."""
    rows = InputTable(actuators=["a", "b", "c"], factors=[[1.0, 0.0, 0.5], [0.0, 2.0, -1.0]])
    inputs = inputs_of(rows, 2, 2)
    plant = plant_of(tmp_path, inputs, PLATFORM.format(clamp=""), axes=2)
    plant.reset(np.zeros((4, 2)))
    u = np.array([1.0, -2.0, 0.3, 0.7])
    plant.step(u, 50)
    levers = np.array([[1.0, 0.0, 0.6], [0.0, 1.0, 0.8]])
    force = (levers @ np.array(rows.factors).T @ u.reshape(2, 2).T).T.ravel()
    assert np.allclose(plant.output, force / 2 * 0.1, rtol=1e-12, atol=0)
    clamped = PLATFORM.format(clamp='ctrlrange="-3 3"')
    with pytest.raises(InvalidInput, match=r"input_limit.*actuator 'c' of agent 1.*at most 2$"):
        plant_of(tmp_path, inputs, clamped, axes=2)
    assert plant_of(tmp_path, inputs, clamped, limit=2.0, axes=2).model.nu == 6


MODES = [("rk4", "continuous"), ("euler", "sampled"), ("rk4", "implicit")]


@pytest.mark.parametrize(("integrator", "mode"), MODES)
def test_a_force_at_a_body_is_that_of_its_motor(tmp_path, integrator, mode):
    """In the native loops, where half of it comes by each of two."""
    path = tmp_path / "sled.xml"
    path.write_text(
        SLED.replace("</actuator>", '<motor name="too" joint="x" gear="7"/></actuator>')
    )
    y, found = np.array([0.3, 0.5, 0.1]), []
    for given in ("turn", Input(kind="body", name="sled"), Input(("turn", "too"), (0.5, 0.5))):
        agents = mjcf_robots((RobotFile(path, "x", given),) * 3, np.full(3, np.inf))
        system = System(
            "sleds", velocity_game(3, 1.0, 2.0), agents, FullInformation(), 0.1,
            agents.equilibrium(y), engine="mujoco", mode=mode, integrator=integrator,
        )  # fmt: skip
        states, _, _, loop = run_loop(system, 0.005, 200, 0.01)
        found.append(states[:, :, 0])
        assert mode != "implicit" or loop.monitor.prediction < 1e-9
    assert np.allclose(found[1:], found[0], rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (Input(kind="body", name="hul"), "robot.xml has no such body; did you mean 'hull'"),
        (Input(("push", "trn"), (1.0, 1.0)), "got 'trn', but did you mean 'turn'"),
        (Input(kind="body", name="world"), "in robot.xml the body stands still"),
    ],
)
def test_what_a_file_does_not_have(tmp_path, given, words):
    with pytest.raises(InvalidInput, match=rf"agents.input: .*{words}"):
        plant_of(tmp_path, [given])


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({}, "input"),
        ({"body": "hull", "site": "bow"}, "input"),
        ({"actuators": ["a"], "axes": ["x"]}, "input.axes"),
        ({"actuators": ["a", "b"], "factors": [1.0]}, "input.factors"),
        ({"actuators": ["a", "b"], "factors": [[1.0, 0.0], [0.0, 0.0]]}, "input.factors"),
        ({"body": "hull", "factors": [1.0]}, "input.factors"),
    ],
)
def test_tables_that_say_too_little_or_too_much(table, key):
    with pytest.raises(InvalidInput) as caught:
        InputTable.model_validate(table).channels(1)
    assert caught.value.key == key
