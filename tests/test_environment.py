"""The dm_env environment: the fleet's own motion under forces, and what a user is refused."""

import os
import subprocess
import sys
import unittest
from math import nan
from pathlib import Path

import mujoco
import numpy as np
import pytest
from builders import EQUAL, FIVE, UNEQUAL, clock, robot_state, robot_system, run_loop
from dm_control.rl import control
from dm_env import specs, test_utils
from mjcf_files import MOTOR, flexible

import gne_mj
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation
from gne_mj.environment import environment_of, law_policy, load_environment
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.scenario import load_scenario
from gne_mj.system import System

ROBOT = Path(__file__).resolve().parents[1] / "examples/robot/scenario.toml"
HELD = {"controller.mode": "sampled", "simulation.control_period": 0.01}
SHORT = {"simulation.control_period": 0.01, "simulation.duration": 0.05}


def of_scenario(name, changes):
    """The one system of a scenario, and its clock."""
    scenario = load_scenario(name, changes)
    (system,) = scenario.system_objects()
    return system, scenario.clock()


# dm_env's own tests of conformance; each class has some of the ends of an episode
class Conformance(test_utils.EnvironmentTestMixin):
    scenario, changes, options = "velocity-sync", SHORT, {}

    def make_object_under_test(self):
        return load_environment(self.scenario, self.changes, **self.options)


class TestLaneWithoutLimits(Conformance, unittest.TestCase):
    """The default actions are the greatest that MuJoCo takes, and leave the set at once."""


class TestLaneWithLimits(Conformance, unittest.TestCase):
    changes = SHORT | {"agents.input_limit": 2.0}  # time is up, every five actions
    options = {"reward": "each", "start": "random", "random": 1}  # noqa: RUF012


class TestPlane(Conformance, unittest.TestCase):
    scenario = "planar-sync"
    options = {"information": "partial", "graph": "ring"}  # noqa: RUF012


class TestOwnRobots(Conformance, unittest.TestCase):
    scenario, changes = ROBOT, SHORT | {"agents.input_limit": 3.0}
    options = {"information": "distributed", "graph": "line"}  # noqa: RUF012


# The motion


# A lag of its own, and a box that tumbles on the ground: to what the solver of contacts finds it
# matters where it starts from
LAG = '<general name="lag" joint="rear" dyntype="filter" dynprm="0.1"/>'
BOX = """<worldbody><geom type="plane" size="5 5 1" pos="0 0 -1"/>
<body pos="0 0 -0.9" euler="10 20 30"><freejoint/><geom type="box" size="0.1 0.06 0.04"/></body>
</worldbody>"""


def with_boxes(folder, output):
    """Two robots of a user's own."""
    text = flexible(dict.fromkeys(EQUAL, 1.5), MOTOR + LAG, BOX)
    flags = 'gravity="0 0 0"><flag contact="disable" constraint="disable"/>'
    assert flags in text
    path = folder / "robot.xml"
    path.write_text(text.replace(flags, 'gravity="0 0 -9.81">'))
    return mjcf_robots((RobotFile(path, output, "push"),) * 2, np.full(2, np.inf))


def fleet_of(kind, folder, integrator):
    if kind == "lane":
        state = robot_state(FIVE, extension=0.3, appendage=-FIVE)
        return robot_system(state, UNEQUAL, 1e3, engine="mujoco", integrator=integrator)
    if kind == "plane":
        wide = {"game.gap_bound": 1e3, "game.leader_gap_bound": 1e3}
        return of_scenario("planar-sync", wide | {"simulation.integrator": integrator})[0]
    agents = with_boxes(folder, kind)
    state = agents.equilibrium(np.array([1.0, -1.0]))
    return System(
        "robots", velocity_game(2, 0.0, 1e3), agents, FullInformation(), 0.1, state,
        mode="sampled", engine="mujoco", integrator=integrator,
    )  # fmt: skip


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
@pytest.mark.parametrize("kind", ["lane", "plane", "front", "tendon_speed"])
def test_moves_exactly_as_the_plant_under_the_same_forces(tmp_path, kind, integrator):
    h, substeps = 0.005, 7
    system = fleet_of(kind, tmp_path, integrator)
    environment = environment_of(system, clock(h, 40 * substeps * h, substeps * h))
    assert isinstance(environment, control.Environment)
    own = kind in ("lane", "plane")
    plant = (MujocoPlant if own else MjcfPlant)(system.agents, h, integrator)
    plant.reset(system.state)
    environment.reset()
    data = environment.physics.data
    rng = np.random.default_rng(0)
    hit = False
    for _ in range(40):
        force = rng.normal(size=system.game.actions, scale=5.0)
        timestep = environment.step(force)
        plant.step(force, substeps)
        for name in ("qpos", "qvel", "act", "time"):
            assert np.array_equal(getattr(data, name), getattr(plant.data, name)), name
        hit |= data.nefc > 0
    assert hit == (not own), "contacts are among what is tested"
    assert np.array_equal(timestep.observation["all/state"], plant.state)
    assert timestep.last()
    assert timestep.discount == 1.0
    if not own:  # two slides, a free joint and an activation each
        expected = [*data.qpos[9:], *data.qvel[8:], *data.act[1:]]
        assert np.array_equal(timestep.observation["agent_2/joints"], expected)
        assert len(expected) == 18
    # and nothing is left behind in MuJoCo
    assert mujoco.get_mjcb_passive() is None
    assert mujoco.get_mjcb_control() is None


@pytest.mark.parametrize("name", ["velocity-sync", "planar-sync", ROBOT])
def test_the_law_as_a_policy_is_the_native_loop_in_mode_sampled(name):
    system, of_run = of_scenario(name, HELD | {"simulation.duration": 3.0})
    h, period = of_run.timestep, of_run.control_period
    steps, every = of_run.steps(3.0), of_run.steps(period)
    states, inputs, _, _ = run_loop(system, h, steps, period, every)
    environment = environment_of(system, of_run)
    policy, timestep = law_policy(system), environment.reset()
    for expected, force in zip(states[:-1], inputs[:-1], strict=True):
        assert np.allclose(timestep.observation["all/state"], expected, rtol=0, atol=1e-12)
        assert np.allclose(policy(timestep), force, rtol=0, atol=1e-11)
        timestep = environment.step(policy(timestep))
    assert timestep.last()
    assert np.allclose(timestep.observation["all/state"], states[-1], rtol=0, atol=1e-12)
    assert np.ptp(states[:, :, system.agents.kind.OUTPUT], axis=0).max() > 0.5, "it moved"
    assert np.array_equal(policy(timestep), np.zeros(system.game.actions)), "the end needs no law"


def test_forces_are_within_the_actuators_limits():
    changes = HELD | {"agents.input_limit": [1.0, 2.0, 3.0, 4.0, 5.0]}
    system, of_run = of_scenario("velocity-sync", changes)
    environments = [environment_of(system, of_run) for _ in range(2)]
    limit = np.arange(1.0, 6.0)
    spec = environments[0].action_spec()
    assert isinstance(spec, specs.BoundedArray)
    assert np.array_equal(spec.maximum, limit)
    assert np.array_equal(spec.minimum, -limit)
    # a demand beyond is delivered as far as the actuators can, infinite or not
    for environment, force in zip(environments, (limit, np.full(5, np.inf)), strict=True):
        environment.reset()
        environment.step(force)
    first, second = (each.physics.state for each in environments)
    assert np.array_equal(first, second)
    # and so is the law's, of [4.055, 2, 2.069444, -3, -3.044444] by hand
    asked = law_policy(system)(environments[0].reset())
    assert np.allclose(asked, [1.0, 2.0, 2.069444, -3.0, -3.044444], rtol=0, atol=1e-6)


# What is refused, and what a user is spared
@pytest.mark.parametrize(
    ("arguments", "options", "sentence"),
    [
        (("osnr",), {}, "systems.channels.plant.engine: got 'ode', but"),
        (("disturbed",), {}, "systems.robots.faults: got '4 faults', but"),
        (("paper",), {}, "system: nothing is given, but name one of robots, channels"),
        (("velocity-sync", None, "robot"), {}, "got 'robot', but did you mean 'robots'?"),
        (("velocity-sync",), {"information": "parital"}, "did you mean 'partial'?"),
        (("velocity-sync",), {"information": "partial"}, "graph: nothing is given, but"),
        (("velocity-sync",), {"information": "partial", "graph": "rin"}, "'ring'?"),
        (
            ("velocity-sync",),
            {"information": "partial", "graph": graphs.ring(4)},
            "the game has 5 agents",
        ),
        (("velocity-sync",), {"reward": "both"}, "reward: got 'both', but choose from sum, each"),
        (("velocity-sync",), {"start": "anywhere"}, "start: got 'anywhere', but"),
        (("velocity-sync",), {"start": "random", "spread": 1.0}, "spread: got 1.0, but"),
        (("velocity-sync",), {"exit_cost": nan}, "exit_cost: got nan, but"),
        (
            ("velocity-sync", {"simulation.control_period": 0.7}),
            {},
            "a multiple of the control period 0.7 s",
        ),
        ((ROBOT, {"agents.input": "winches"}), {}, "systems.fleet.agents.input: got 'winches'"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(arguments, options, sentence):
    with pytest.raises(InvalidInput) as caught:
        load_environment(*arguments, **options)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_forces_that_are_no_forces_are_refused():
    environment = gne_mj.load_environment("velocity-sync", SHORT)
    environment.reset()
    with pytest.raises(InvalidInput, match="its shape must be"):
        environment.step(np.zeros(4))
    with pytest.raises(InvalidInput, match="must be a number"):
        environment.step(np.array([0.0, nan, 0.0, 0.0, 0.0]))
    assert environment.step(np.zeros(5)).mid(), "and nothing has happened"


def test_the_law_says_what_it_needs():
    environment = load_environment("velocity-sync", information="partial", graph="line")
    with pytest.raises(InvalidInput, match="information 'full'"):
        law_policy(environment.task.system)(environment.reset())
    falling, _ = of_scenario("velocity-sync", {"barrier.schedule": "reciprocal"})
    with pytest.raises(InvalidInput, match="does not know the time"):
        law_policy(falling)


def test_a_user_sees_no_warning_and_pays_for_nothing_unused():
    program = """
import sys
import gne_mj
assert not {"mujoco", "dm_control", "numba"} & set(sys.modules)
environment = gne_mj.load_environment("velocity-sync")
environment.reset()
"""
    quiet = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    done = subprocess.run(
        [sys.executable, "-c", program], env=quiet, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
