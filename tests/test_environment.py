"""The dm_env environment: the fleet's own motion, what each agent sees, costs, ends and starts."""

import os
import subprocess
import sys
import unittest
from collections import OrderedDict
from functools import cache
from math import inf, nan
from pathlib import Path
from types import ModuleType

import kernel_game
import mujoco
import numpy as np
import pytest
from builders import EQUAL, FIVE, UNEQUAL, V0, clock, robot_state, robot_system, robots, run_loop
from dm_control.rl import control
from dm_env import specs, test_utils
from hypothesis import given, settings
from hypothesis import strategies as st
from mjcf_files import MOTOR, flexible

import gne_mj
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.environment import environment_of, law_policy, load_environment
from gne_mj.environment.observation import NotFinite, finite_costs
from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.game_model import Game
from gne_mj.games import velocity_game
from gne_mj.games import velocity_synchronization as velocity
from gne_mj.plain import FUNCTIONS
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.scenario import load_scenario
from gne_mj.system import System

ROBOT = Path(__file__).resolve().parents[1] / "examples/robot/scenario.toml"
HELD = {"controller.mode": "sampled", "simulation.control_period": 0.01}
SHORT = {"simulation.control_period": 0.01, "simulation.duration": 0.05}
# Agent 3 hears everyone, everyone else hears agent 3 only
STAR = graphs.Graph(5, ((2, 0), (2, 1), (2, 3), (2, 4)))


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


# What is seen


def test_each_structure_tells_what_its_law_may_measure():
    system = robot_system(robot_state(FIVE), engine="mujoco")
    gaps = np.diff(FIVE, prepend=V0)
    g = gaps**2 - 9.0
    told = {  # which constraints agents 1 to 5 are told, by the paper's definitions
        "full": [[0, 1], [1, 2], [2, 3], [3, 4], [4]],
        "partial": [[0, 1], [1, 2], [2, 3], [3, 4], [4]],
        "distributed": [[0], [2], [2, 3], [3], []],  # agents 1 and 2 do not hear each other
    }
    for structure, constraints in told.items():
        environment = environment_of(system, clock(0.01), information=structure, graph=STAR)
        seen = environment.reset().observation
        assert isinstance(seen, OrderedDict)
        heard = [[2], [2], [0, 1, 3, 4], [2], [2]]
        if structure == "full":
            heard = [[j for j in range(5) if j != i] for i in range(5)]
        for i in range(5):
            name = f"agent_{i + 1}"
            assert np.array_equal(seen[f"{name}/own"], [0.0, FIVE[i], FIVE[i], 0.0])
            assert np.array_equal(seen[f"{name}/neighbours"], FIVE[heard[i]])
            assert np.allclose(seen[f"{name}/constraints"], g[constraints[i]], rtol=1e-14, atol=0)
        shared = [key for key in seen if key.startswith("all/")]
        arrays = list(seen.values())
        for i, array in enumerate(arrays):
            assert not any(np.shares_memory(array, other) for other in arrays[:i])
        assert len(seen) == 15 + len(shared)
        if structure == "full":
            assert shared == ["all/output", "all/state", "all/constraint", "all/gap"]
            assert np.array_equal(seen["all/output"], FIVE)
            assert np.array_equal(seen["all/gap"], gaps), "which tells the first robot of v_0"
        else:
            assert not shared


def test_the_laws_own_structure_is_the_default():
    for law, expected in (
        (FullInformation(), "full"),
        (PartialInformation(graphs.ring(5)), "partial"),
    ):
        system = robot_system(robot_state(FIVE), law=law, engine="mujoco")
        environment = environment_of(system, clock(0.01))
        assert environment.task.information.structure == expected
    seen = environment.reset().observation
    assert np.array_equal(seen["agent_1/neighbours"], FIVE[[1, 4]])


@cache
def star(structure):
    system = robot_system(robot_state(FIVE), engine="mujoco")
    return environment_of(system, clock(0.01), information=structure, graph=STAR)


@given(
    structure=st.sampled_from(["partial", "distributed"]),
    agent=st.integers(0, 4),
    seed=st.integers(0, 2**32 - 1),
)
def test_what_is_hidden_from_an_agent_does_not_change_its_observation(structure, agent, seed):
    """All states of others but the outputs it hears, and (partial) those its constraints read."""
    environment = star(structure)
    rng = np.random.default_rng(seed)
    hidden = rng.normal(size=(2, 5, 4))
    shown = {agent, *([2] if agent != 2 else [0, 1, 3, 4])}
    if structure == "partial":
        shown |= {max(agent - 1, 0), min(agent + 1, 4)}
    hidden[1, agent] = hidden[0, agent]
    hidden[1, sorted(shown), 1] = hidden[0, sorted(shown), 1]
    seen = []
    for state in hidden:
        environment.physics.place(state)
        observation = environment.task.get_observation(environment.physics)
        seen.append({k: v for k, v in observation.items() if k.startswith(f"agent_{agent + 1}/")})
    assert seen[0].keys() == seen[1].keys()
    for name in seen[0]:
        assert np.array_equal(seen[0][name], seen[1][name]), name


def test_a_users_robot_sees_all_its_own_joints():
    environment = load_environment(ROBOT)
    environment.reset()
    timestep = environment.step(np.array([1.0, -2.0, 3.0, -4.0]))
    data = environment.physics.data
    for i, names in enumerate([("travel", "swing"), ("roll", "lean")] * 2):
        joints = [data.joint(f"robot_{i + 1}/{name}") for name in names]
        expected = np.concatenate([*(j.qpos for j in joints), *(j.qvel for j in joints)])
        assert np.array_equal(timestep.observation[f"agent_{i + 1}/joints"], expected)
        assert np.all(expected != 0.0)


# What it costs


def test_rewards_are_the_costs_with_the_sign_turned():
    system = robot_system(robot_state(FIVE), UNEQUAL, engine="mujoco")
    of_run = clock(0.01, 1.0, 0.05)
    environments = [environment_of(system, of_run, reward=kind) for kind in ("sum", "each")]
    first, second = ([each.reset(), each.step(-np.ones(5))][1] for each in environments)
    y = first.observation["all/output"]
    expected = [(y[0] - V0) ** 2, *((y[i] - y[i - 1]) ** 2 for i in range(1, 5))]
    assert np.allclose(second.reward, -np.array(expected), rtol=1e-14)
    assert first.reward == pytest.approx(-sum(expected), rel=1e-14)
    assert isinstance(first.reward, float)
    assert np.allclose(environments[0].task.costs(environments[0].physics), expected, rtol=1e-14)
    assert environments[0].reward_spec().shape == ()
    environments[1].reward_spec().validate(second.reward)
    assert second.reward.shape == (5,)


def test_leaving_costs_what_standing_still_would_have_unless_told_otherwise():
    system = robot_system(robot_state(FIVE), engine="mujoco")
    of_run = clock(0.01, 1.0, 0.05)  # an episode is 20 control periods
    still = 20 * np.sum(np.diff(FIVE, prepend=V0) ** 2)
    for cost, expected in ((None, still), (7.0, 7.0), (0.0, 0.0)):
        rewards = []
        for kind in ("sum", "each"):
            environment = environment_of(system, of_run, exit_cost=cost, reward=kind)
            environment.reset()
            timestep = environment.step(np.full(5, 1e4))
            y = timestep.observation["all/output"]
            assert timestep.discount == 0.0
            rewards.append(timestep.reward + environment.task.costs(environment.physics).sum())
        each = np.diff(y, prepend=V0) ** 2
        assert rewards[0] == pytest.approx(-expected, abs=1e-6)
        assert np.allclose(timestep.reward, -each - expected / 5, rtol=1e-12)


# How it ends


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
def test_an_exit_between_the_ends_of_a_period_ends_the_episode(integrator):
    """A stretched spring throws a robot over its bound and back within one control period."""
    h, substeps = 0.01, 300
    start = robot_state(np.array([5.9]), extension=-2.0)
    numbers = {name: [1.0] for name in EQUAL} | {"appendage_mass": [4.0], "damping": [0.1]}
    system = robot_system(start, numbers, engine="mujoco", integrator=integrator)
    plant = MujocoPlant(robots(numbers), h, integrator)
    plant.reset(start)
    outputs = []
    for _ in range(substeps):
        plant.step(np.full(1, -2.0))
        outputs.append(float(plant.output[0]))
    outside = np.abs(np.array(outputs) - V0) >= 3.0
    first = int(np.argmax(outside))
    assert 0 < first < substeps - 1
    assert not outside[-1], "at the period's end all is well again"
    environment = environment_of(system, clock(h, 2 * substeps * h, substeps * h))
    environment.reset()
    timestep = environment.step(np.full(1, -2.0))
    assert timestep.last()
    assert timestep.discount == 0.0
    left = environment.physics.exit
    assert left.constraint == "gap of agent 1"
    assert left.time == pytest.approx((first + 1) * h, rel=1e-12)
    assert timestep.observation["all/output"][0] == outputs[first]
    assert left.value == pytest.approx((outputs[first] - V0) ** 2 - 9.0, rel=1e-9)
    assert str(left).startswith(f"at {left.time:.6g} s 'gap of agent 1' was violated, g = ")
    assert not left.restored
    assert environment.step(np.zeros(1)).first(), "and the next one starts afresh"
    assert environment.physics.exit is None
    assert environment.physics.time() == 0.0


@pytest.mark.parametrize(
    ("periods", "h", "substeps"), [(1, 0.1, 3), (7, 0.005, 2), (100, 0.002, 1)]
)
def test_time_is_up_after_so_many_periods_and_that_is_no_end(periods, h, substeps):
    system = robot_system(robot_state(np.full(5, V0)), engine="mujoco")
    environment = environment_of(system, clock(h, periods * substeps * h, substeps * h))
    assert environment.control_timestep() == pytest.approx(substeps * h)
    for _ in range(2):
        environment.reset()
        timesteps = [environment.step(np.zeros(5)) for _ in range(periods)]
        assert [each.last() for each in timesteps] == [False] * (periods - 1) + [True]
        assert timesteps[-1].discount == 1.0
    # but leaving in the last of them is
    environment.reset()
    for _ in range(periods - 1):
        environment.step(np.zeros(5))
    timestep = environment.step(np.full(5, -1e6))
    assert timestep.last()
    assert timestep.discount == 0.0


def game_with(cost):
    """The velocity game of plain functions, with another cost."""
    own, module = velocity_game(5, V0, 3.0), ModuleType("plain")
    for name in FUNCTIONS:
        function = cost if name == "cost" else getattr(velocity, name)
        setattr(module, name, lambda *given, function=function: function(*given))
    names = ("name", "parameters", "sizes", "in_cost", "in_constraint", "constraint_names")
    return Game(kernels=module, **{name: getattr(own, name) for name in names})


def own_game(game):
    state = robot_state(FIVE)
    return System("robots", game, robots(EQUAL), FullInformation(), 0.1, state, engine="mujoco")


@pytest.mark.parametrize("outside", [nan, inf, None])
def test_where_an_exit_is_no_number_the_state_before_it_is_observed(outside):
    of_run = clock(0.01, 1.0, 0.05)

    def cost(q, i, y):
        if velocity.constraint(q, 0, y) < 0.0:
            return velocity.cost(q, i, y)
        if outside is None:
            raise ValueError("not defined there")
        return outside

    environment = environment_of(own_game(game_with(cost)), of_run)
    environment.reset()
    timestep = environment.step(np.array([1e4, 0.0, 0.0, 0.0, 0.0]))
    left = environment.physics.exit
    assert timestep.discount == 0.0
    assert left.restored
    assert left.constraint == "gap of agent 1"
    assert left.value > 0.0
    assert np.array_equal(timestep.observation["all/output"], FIVE), "it left in the first step"
    assert environment.physics.time() == 0.0
    expected = np.sum(np.diff(FIVE, prepend=V0) ** 2)
    assert timestep.reward == pytest.approx(-expected - 20 * expected, rel=1e-12)


def test_a_cost_that_is_no_number_inside_is_an_error_and_no_reward():
    fails = []  # later than at load, where it would be refused
    system = own_game(game_with(lambda q, i, y: nan if fails else velocity.cost(q, i, y)))
    fails.append(True)
    where = r"test_environment.py, line \d+.* not a number for agent 1 at y = \["
    with pytest.raises(UserCodeError, match=where):
        environment_of(system, clock(0.01, 1.0))
    environment = environment_of(system, clock(0.01, 1.0), exit_cost=0.0)
    environment.reset()
    with pytest.raises(UserCodeError, match=where):
        environment.step(np.zeros(5))


def test_what_kernels_cost_where_it_is_no_number_is_an_error():
    game = Game(
        name="kernels", kernels=kernel_game, parameters=np.zeros(1), sizes=(1, 1),
        in_cost=[[0], [1]], in_constraint=[[0], [1]], constraint_names=("a", "b"),
    )  # fmt: skip
    with pytest.raises(NotFinite, match=r"costs at \[0.5, -0.1\] are not finite: \[.*, nan\]"):
        finite_costs(game, np.array([0.5, -0.1]))


def test_a_state_that_is_no_number_is_not_observed():
    environment = environment_of(robot_system(robot_state(FIVE), engine="mujoco"), clock(0.01, 1.0))
    environment.reset()
    before = environment.step(np.zeros(5))
    environment.physics.data.qpos[3] = np.nan  # of an appendage, on which no constraint depends
    timestep = environment.step(np.zeros(5))
    assert timestep.discount == 0.0
    assert environment.physics.exit.restored
    assert "no longer a number" in str(environment.physics.exit)
    for values in timestep.observation.values():
        assert np.all(np.isfinite(values))
    assert np.isfinite(timestep.reward)
    assert before.mid()


# Where it starts


@cache
def random_environment(structure="full"):
    system = robot_system(robot_state(FIVE, position=7.0), engine="mujoco")
    rng = np.random.default_rng(0)
    return environment_of(system, clock(0.01, 1.0), start="random", spread=0.95, random=rng)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_random_starts_are_inside_at_rest_and_follow_from_the_seed(seed):
    environment = random_environment()
    drawn = []
    for _ in range(2):
        environment.task._rng = np.random.default_rng(seed)
        drawn.append([environment.reset().observation["all/state"] for _ in range(3)])
    assert np.array_equal(*drawn)
    assert not np.array_equal(drawn[0][0], drawn[0][1])
    for extension, velocities, appendages, positions in (state.T for state in drawn[0]):
        assert np.all(np.abs(np.diff(velocities, prepend=V0)) < 0.95 * 3.0 * (1 + 1e-9))
        assert np.array_equal(velocities, appendages)
        assert np.all(extension == 0.0)
        assert np.all(positions == 7.0)


def test_episodes_repeat_by_seed():
    def episode(seed):
        environment = load_environment("velocity-sync", SHORT, start="random", random=seed)
        rng = np.random.default_rng(5)
        timesteps = [environment.reset()]
        for _ in range(9):  # on into a second episode
            timesteps.append(environment.step(rng.normal(size=5)))
        return np.array([list(each.observation["all/state"].ravel()) for each in timesteps])

    assert np.array_equal(episode(3), episode(3))
    assert not np.array_equal(episode(3), episode(4))


def test_starts_of_ones_own():
    system = robot_system(robot_state(FIVE), engine="mujoco")
    environment = environment_of(system, clock(0.01), start=lambda rng: FIVE + 0.25)
    assert np.array_equal(environment.reset().observation["all/output"], FIVE + 0.25)
    on = np.array([0.0, 0.0, -1.0, 0.5, 2.0])  # the first gap is its bound
    for start, said in (
        (FIVE + 10.0, "gap of agent 1"),
        (on, "gap of agent 1' was violated, g = 0"),
        (FIVE[:4], "5 finite numbers"),
    ):
        wrong = environment_of(system, clock(0.01), start=lambda rng, start=start: start)
        with pytest.raises(InvalidInput, match=said):
            wrong.reset()


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
