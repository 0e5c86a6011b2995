"""A user's own MJCF: the same robot as the built-in one must move as it does."""

import mujoco
import numpy as np
import pytest
from builders import FIVE, UNEQUAL, V0, relative_error, robot_system, run_loop
from mjcf_files import flexible
from scipy.linalg import expm

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.system import System

LINEAR = {**UNEQUAL, "atan_coefficient": [0.0] * 5}
NUMBERS = [{name: values[i] for name, values in LINEAR.items()} for i in range(5)]


def fleet(folder, output="front", count=5, limit=np.inf, **options):
    """Robots with unequal numbers, each with a file of its own."""
    robots = []
    for i in range(count):
        path = folder / f"robot{i}.xml"
        path.write_text(flexible(NUMBERS[i], **options))
        robots.append(RobotFile(path, output, "push"))
    return mjcf_robots(tuple(robots), np.full(count, limit))


def own_system(agents, y=FIVE, law=None, **options):
    game = velocity_game(len(y), V0, 3.0)
    state = agents.equilibrium(np.asarray(y, dtype=float))
    return System(
        "robots", game, agents, law or FullInformation(), 0.1, state, engine="mujoco", **options
    )


def builtin_state(y=FIVE):
    """What a user's robot starts from: of all velocities with these outputs the smallest."""
    zeros = np.zeros(5)
    return np.column_stack([zeros, y, zeros, zeros])


MODES = [("rk4", "continuous"), ("euler", "continuous"), ("rk4", "sampled"), ("euler", "sampled")]


@pytest.mark.parametrize(("integrator", "mode"), MODES)
def test_a_copy_of_the_builtin_robot_moves_as_it_does(tmp_path, integrator, mode):
    h, steps = 0.005, 1000
    options = {"integrator": integrator, "mode": mode}
    got, inputs, _, loop = run_loop(own_system(fleet(tmp_path), **options), h, steps, 2 * h)
    assert loop.plant.model.opt.timestep == h
    for engine in ("mujoco", "ode"):
        system = robot_system(builtin_state(), LINEAR, engine=engine, **options)
        expected, forces, _, _ = run_loop(system, h, steps, 2 * h)
        assert relative_error(got[:, :, 0], expected[:, :, 1]) < 1e-12
        assert relative_error(got[:, :, 1], expected[:, :, 3]) < 1e-12
        assert relative_error(inputs, forces) < 1e-12


@pytest.mark.parametrize("sensor", ["joint_speed", "tendon_speed", "actuator_speed"])
@pytest.mark.parametrize(("integrator", "mode"), MODES)
def test_velocity_sensors_measure_what_the_joint_does(tmp_path, sensor, integrator, mode):
    system = own_system(fleet(tmp_path, sensor), integrator=integrator, mode=mode)
    states, inputs, *_ = run_loop(system, 0.005, 300, 0.01)
    by_joint = own_system(fleet(tmp_path), integrator=integrator, mode=mode)
    expected, forces, *_ = run_loop(by_joint, 0.005, 300, 0.01)
    assert np.all(states[:, :, 0] == expected[:, :, 0])
    assert np.all(inputs == forces)


@pytest.mark.slow
def test_estimates_of_a_partial_law_ride_along(tmp_path):
    def law():
        return PartialInformation(graphs.ring(5), coupling=2.0, time_constant=0.5)

    for integrator, mode in (MODES[0], MODES[3]):
        options = {"law": law(), "integrator": integrator, "mode": mode}
        got = run_loop(own_system(fleet(tmp_path), **options), 0.005, 400, 0.01)
        system = robot_system(builtin_state(), LINEAR, engine="mujoco", **options)
        expected = run_loop(system, 0.005, 400, 0.01)
        assert relative_error(got[0][:, :, 0], expected[0][:, :, 1]) < 1e-12
        assert relative_error(got[2], expected[2]) < 1e-12


@pytest.mark.slow
def test_actuators_with_dynamics_of_their_own_beside_a_memory(tmp_path):
    """A filtered motor: its activation a' = (u - a) / T lies before the law's memory in act."""
    h, steps, lag, period = 0.01, 300, 0.05, 1
    actuator = f'<general name="push" joint="front" dyntype="filter" dynprm="{lag}"/>'
    agents = fleet(tmp_path, actuator=actuator)
    law = PartialInformation(graphs.ring(5), coupling=1.0, time_constant=1.0)
    states, inputs, memory, loop = run_loop(
        own_system(agents, law=law, mode="sampled", integrator="rk4"), h, steps, period * h
    )
    assert loop.plant.model.na == 5  # mode sampled keeps the memory elsewhere
    # independently: RK4 of masses, spring and filter under the recorded inputs, held
    mass, other, stiffness, _, damping = (np.array(LINEAR[k]) for k in LINEAR)

    def rate(x, u):
        d, e, v, w, a = x
        pull = stiffness * (d - e) + damping * (v - w)
        return np.array([v, w, (a - pull) / mass, pull / other, (u - a) / lag])

    x = np.array([np.zeros(5), np.zeros(5), FIVE, np.zeros(5), np.zeros(5)])
    for step in range(steps):
        assert np.allclose(states[step, :, 0], x[2], rtol=0, atol=1e-12)
        u = inputs[step]
        k1 = rate(x, u)
        k2 = rate(x + h / 2 * k1, u)
        k3 = rate(x + h / 2 * k2, u)
        k4 = rate(x + h * k3, u)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    # and the estimates are those of the same law under the measured outputs
    y, own = states[:, :, 0], np.eye(5, dtype=bool)
    estimates = memory.reshape(-1, 5, 5)
    laplacian = law.graph.laplacian
    for j in range(5):
        others = ~own[j]
        decay = expm(-laplacian[np.ix_(others, others)] * h)
        error = estimates[:-1, others, j] - y[:-1, None, j]
        moved = y[:-1, None, j] + error @ decay.T
        assert np.allclose(estimates[1:, others, j], moved, rtol=0, atol=1e-12)


GRAVITY = """
<mujoco>
  <compiler angle="{angle}"/>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="cart">
      <joint name="roll" type="slide" axis="1 0 0"/>
      <geom size="0.1" mass="2" contype="0" conaffinity="0"/>
      <body pos="0 0 -{length}">
        <joint name="swing" type="hinge" axis="0 1 0" pos="0 0 {length}" damping="0.5"
               springref="{springref}" stiffness="3"/>
        <geom size="0.1" mass="1" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="roll"/></actuator>
  <keyframe><key name="home" qpos="1 0.2"/></keyframe>
</mujoco>
"""


def pendulums(folder):
    robots = []
    for angle, springref, length in (("degree", 30, 1), ("radian", 0.4, 0.5)):
        path = folder / f"{angle}.xml"
        path.write_text(GRAVITY.format(angle=angle, springref=springref, length=length))
        robots.append(RobotFile(path, "roll", "drive"))
    return robots * 2


def test_each_of_different_files_moves_as_it_does_alone(tmp_path):
    """Gravity, angle units and springs of a file are kept; keyframes are no hindrance."""
    robots = pendulums(tmp_path)
    plant = MjcfPlant(mjcf_robots(tuple(robots), np.full(4, np.inf)), 0.002, "rk4")
    assert plant.model.nkey == 0
    start = np.array([[1.0, 0.0], [-0.5, 2.0], [0.2, -1.0], [0.0, 0.0]])
    plant.reset(start)
    assert np.all(plant.state == start)
    u = np.array([1.0, -2.0, 0.5, 3.0])
    plant.step(u, 500)
    for i, robot in enumerate(robots):
        model = mujoco.MjModel.from_xml_path(str(robot.path))
        model.opt.timestep, model.opt.integrator = 0.002, mujoco.mjtIntegrator.mjINT_RK4
        data = mujoco.MjData(model)
        data.qvel[0], data.qpos[0], data.ctrl[0] = start[i, 0], start[i, 1], u[i]
        mujoco.mj_step(model, data, 500)
        assert np.allclose(plant.state[i], [data.qvel[0], data.qpos[0]], rtol=1e-12, atol=1e-12)
    swing = plant.model.joint("robot_1/swing").qpos_spring[0]
    assert swing == pytest.approx(np.radians(30))
    assert plant.model.joint("robot_2/swing").qpos_spring[0] == pytest.approx(0.4)


def test_reset_reaches_outputs_of_sensors(tmp_path):
    """A tendon over both masses: many joint velocities give its speed, the smallest are taken."""
    extra = (
        '<tendon><fixed name="sum"><joint joint="front" coef="1"/><joint joint="rear" coef="2"/>'
    )
    extra += '</fixed></tendon><sensor><tendonvel name="sum" tendon="sum"/></sensor>'
    plant = MjcfPlant(fleet(tmp_path, "sum", extra=extra), 0.01, "euler")
    plant.reset(np.column_stack([FIVE, np.zeros(5)]))
    assert np.allclose(plant.output, FIVE, rtol=0, atol=1e-14)
    expected = np.column_stack([FIVE / 5, 2 * FIVE / 5]).ravel()
    assert np.allclose(plant.data.qvel, expected, rtol=0, atol=1e-14)
    plant.step(np.zeros(5))
    assert plant.data.time == 0.01


def test_a_first_joint_without_name_holds_a_memory_too(tmp_path):
    path = tmp_path / "nameless.xml"
    path.write_text(
        "<mujoco><worldbody><body><joint type='hinge'/><geom size='1'/><body>"
        "<joint name='j' type='slide'/><geom size='.1'/></body></body></worldbody>"
        "<actuator><motor name='a' joint='j'/></actuator></mujoco>"
    )
    agents = mjcf_robots((RobotFile(path, "j", "a"),) * 2, np.full(2, np.inf))
    plant = MjcfPlant(agents, 0.01, memory=4)
    assert plant.model.na == 4
    plant.reset([[1.0, 0.0], [2.0, 0.0]])
    plant.step([0.0, 0.0], 3)
    assert np.all(plant.data.act == 0.0)


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"output": "frnt"}, "agents.output", "did you mean 'front'?"),
        ({"output": "place"}, "agents.output", "jointvel, tendonvel or actuatorvel"),
        ({"input": "xyz"}, "agents.input", "choose from push"),
        ({"path": "none.xml"}, "agents.path", "MuJoCo must read it"),
    ],
)
def test_names_that_are_not_there(tmp_path, change, key, words):
    path = tmp_path / "robot.xml"
    path.write_text(flexible(NUMBERS[0]))
    given = {"path": path, "output": "front", "input": "push", **change}
    agents = mjcf_robots((RobotFile(**given),), np.full(1, np.inf))
    with pytest.raises(InvalidInput) as caught:
        MjcfPlant(agents, 0.01)
    assert caught.value.key == key
    assert words in str(caught.value)


def test_files_that_do_not_fit_together_or_clamp(tmp_path):
    one, other = tmp_path / "one.xml", tmp_path / "other.xml"
    one.write_text(flexible(NUMBERS[0]))
    other.write_text(flexible(NUMBERS[1]).replace('gravity="0 0 0"', 'gravity="0 0 -1.6"'))
    robots = tuple(RobotFile(path, "front", "push") for path in (one, other))
    with pytest.raises(InvalidInput, match="gravity must be that of the first file"):
        MjcfPlant(mjcf_robots(robots, np.full(2, np.inf)), 0.01)
    motor = '<motor name="push" joint="front" ctrlrange="-2 3" forcerange="-9 9"/>'
    with pytest.raises(InvalidInput, match=r"agents.input_limit: got inf.*at most 2"):
        MjcfPlant(fleet(tmp_path, actuator=motor), 0.01)
    assert MjcfPlant(fleet(tmp_path, actuator=motor, limit=2.0), 0.01).model.nu == 5


def test_outputs_that_no_velocity_gives(tmp_path):
    path = tmp_path / "ball.xml"
    path.write_text(
        "<mujoco><worldbody><body><joint name='j' type='slide'/><geom size='1'/></body></worldbody>"
        "<tendon><fixed name='t'><joint joint='j' coef='0'/></fixed></tendon>"
        "<actuator><motor name='a' joint='j'/></actuator>"
        "<sensor><tendonvel name='s' tendon='t'/></sensor></mujoco>"
    )
    plant = MjcfPlant(mjcf_robots((RobotFile(path, "s", "a"),), np.full(1, np.inf)), 0.01)
    with pytest.raises(InvalidInput, match=r"agents.output: got 's'.*initial value"):
        plant.reset([[1.0, 0.0]])
