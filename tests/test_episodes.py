"""Episodes of environments: what they cost, how they end and where they start."""

from functools import cache
from math import inf, nan
from types import ModuleType

import kernel_game
import numpy as np
import pytest
from builders import EQUAL, FIVE, UNEQUAL, V0, clock, robot_state, robot_system, robots
from hypothesis import given, settings
from hypothesis import strategies as st

from gne_mj.controllers import FullInformation
from gne_mj.environment import environment_of, load_environment
from gne_mj.environment.observation import NotFinite, finite_costs
from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.game_model import Game
from gne_mj.games import velocity_game
from gne_mj.games import velocity_synchronization as velocity
from gne_mj.plain import FUNCTIONS
from gne_mj.plants.mujoco import MujocoPlant
from gne_mj.system import System

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
    where = r"test_episodes.py, line \d+.* not a number for agent 1 at y = \["
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
    changes = {"simulation.control_period": 0.01, "simulation.duration": 0.05}

    def episode(seed):
        environment = load_environment("velocity-sync", changes, start="random", random=seed)
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
