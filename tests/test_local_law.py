"""Laws written for one agent: the paper's two laws over graphs again, and what is refused."""

import numpy as np
import pytest

import gne_mj as gm
from gne_mj.errors import InvalidInput, UserCodeError

TARGETS = np.array([1.0, 2.0, 3.0, 4.0])
GUESS = 0.7


def cost(i, y, p):
    return (y[i] - p.target[i]) ** 2 + 0.5 * y[i] * y.mean()


def constraints(y, p):
    yield "sum", (y**2).sum() <= 12.0
    yield "pair", y[0] + y[1] <= 3.0


GAME = gm.game(4, cost, constraints, target=TARGETS)
GRAPH = gm.Graph(4, ((0, 1), (1, 2), (2, 3)))
SHORT = {"rho": 0.1, "duration": 0.3, "timestep": 0.001, "start": 0.5}


def estimates(agent, **_):
    return agent.completed(np.full(4, GUESS))


def spread(agent):
    own = agent.completed(agent.memory[:4])
    rate = -sum(own - other.completed(other.memory[:4]) for other in agent.neighbours)
    rate[agent.block] = 0.0
    return rate


def partial_action(agent, coupling):
    believed = agent.completed(agent.memory)
    disagreement = sum(agent.y - other.memory[agent.block] for other in agent.neighbours)
    descent = agent.cost_gradient(believed) + agent.barrier_gradient()
    return -descent - coupling * disagreement


def partial_rate(agent, coupling):
    return coupling * spread(agent)


def distributed_action(agent, epsilon):
    believed = agent.completed(agent.memory[:4])
    filtered = believed.copy()
    filtered[agent.block] = agent.memory[4:]
    return -agent.cost_gradient(believed) - agent.barrier_gradient(filtered)


def distributed_rate(agent, epsilon):
    return np.concatenate([spread(agent), agent.y - agent.memory[4:]]) / epsilon


def distributed_memory(agent, epsilon):
    return np.concatenate([estimates(agent), agent.y])


@pytest.mark.parametrize("information", ["partial", "distributed"])
def test_the_papers_laws_written_for_one_agent(information):
    if information == "partial":
        law = gm.partial_information(GRAPH, coupling=2.0)
        functions, numbers = (partial_action, partial_rate, estimates), {"coupling": 2.0}
    else:
        law = gm.fully_distributed(GRAPH, epsilon=0.05)
        functions = (distributed_action, distributed_rate, distributed_memory)
        numbers = {"epsilon": 0.05}
    guessed = {"initial.estimate": GUESS}
    package = gm.run(gm.setup(GAME, law=law, **SHORT), guessed)
    own = gm.run(gm.setup(GAME, law=gm.own_law(*functions, graph=GRAPH, **numbers), **SHORT))
    assert abs(package.data["action"][-1] - package.data["action"][0]).max() > 0.1
    for name in ("action", "input"):
        assert np.allclose(own.data[name], package.data[name], rtol=0, atol=1e-11)


def test_an_agent_knows_its_neighbours_and_no_one_else():
    heard = {}

    def action(agent):
        heard[agent.index] = [other.index for other in agent.neighbours]
        public = {name for name in dir(agent) if not name.startswith("_")}
        assert public == {
            "index", "y", "memory", "block", "rho", "neighbours",
            "completed", "cost_gradient", "barrier_gradient",
        }  # fmt: skip
        return -agent.y

    gm.run(GAME, law=gm.own_law(action, graph=GRAPH), **{**SHORT, "duration": 0.002})
    assert heard == {0: [1], 1: [0, 2], 2: [1, 3], 3: [2]}


def test_memories_may_differ_in_length():
    def start(agent):
        return np.full(agent.index + 1, 0.1 * agent.index)

    def rate(agent):
        return -agent.memory

    def action(agent):
        return agent.memory.sum() - agent.y

    law = gm.own_law(action, rate, start)
    run = gm.run(GAME, law=law, **SHORT)
    own = 0.1 * np.arange(4) * (np.arange(4) + 1) * np.exp(-0.3)
    assert np.allclose(run.data["input"][-1], own - run.data["action"][-1], rtol=0, atol=1e-9)


def test_a_law_of_one_agent_in_a_file(tmp_path):
    (tmp_path / "mine.py").write_text(
        "def action(agent, gain):\n"
        "    return -gain * (agent.cost_gradient(agent.completed([0.5] * 3)) +"
        " agent.barrier_gradient())\n"
    )
    (tmp_path / "mine.toml").write_text(
        '[systems.s.game]\ntype = "cournot"\n[systems.s.agents]\ntype = "integrator"\ncount = 3\n'
        '[systems.s.controller]\ninformation = "custom"\nfile = "mine.py"\n'
        "parameters = { gain = 2.0 }\n[systems.s.initial]\naction = 20.0\n"
    )
    scenario = gm.load_scenario(tmp_path / "mine.toml")
    (system,) = scenario.system_objects()
    run = gm.run(scenario, {"simulation.duration": 0.001, "simulation.timestep": 0.001})
    game = system.game
    y = np.full(3, 20.0)
    believed = np.full((3, 3), 0.5) + np.diag(y - 0.5)
    gradient = np.array([game.pseudo_gradient(row)[i] for i, row in enumerate(believed)])
    barrier = gm.LogBarrier(game, scenario.systems["s"].barrier.rho).gradient(y)
    assert np.allclose(run.data["input"][0], -2.0 * (gradient + barrier), rtol=1e-12)


@pytest.mark.parametrize(
    ("action", "says"),
    [
        (lambda agent: [1.0, 2.0], "1 numbers for agent 1, not 2"),
        (lambda agent: "fast", "a row of numbers for agent 1"),
        (lambda agent: agent.barrier_gradient(np.full(4, 9.0)), "agent 1 has no gradient outside"),
    ],
)
def test_what_a_law_of_one_agent_may_not_do(action, says):
    with pytest.raises(UserCodeError, match=says):
        gm.run(GAME, law=gm.own_law(action), **SHORT)


def test_its_functions_must_take_an_agent():
    def action(agent, gain):
        return -gain * agent.y

    with pytest.raises(InvalidInput, match=r"action\(agent\)"):
        gm.run(GAME, law=gm.own_law(action), **SHORT)
