"""What each agent of an environment sees, and what is hidden from it."""

from collections import OrderedDict
from functools import cache
from pathlib import Path

import numpy as np
from builders import FIVE, V0, clock, robot_state, robot_system
from hypothesis import given
from hypothesis import strategies as st

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.environment import environment_of, load_environment

ROBOT = Path(__file__).resolve().parents[1] / "examples/robot/scenario.toml"


# Agent 3 hears everyone, everyone else hears agent 3 only
STAR = graphs.Graph(5, ((2, 0), (2, 1), (2, 3), (2, 4)))


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
