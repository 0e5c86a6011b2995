"""The compiled laws at any state and memory, and games to ask them about.

By the kernels alone (:func:`ask`), where nothing else need be inside, or by the compiled loop
(:func:`step`).
"""

from types import SimpleNamespace

import numpy as np
from builders import V0, integrators, reference_osnr

import reference_games
from gne_mj.controllers.propagation import no_propagator
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.loops import functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.layout import LoopClock, Setup, problem_and_parameter_block
from gne_mj.loops.link import link
from gne_mj.loops.ode import CONTINUOUS, OdeLoop
from gne_mj.plants.functions import EULER

RHO, EPSILON, GAIN = 0.1, 0.05, 0.7
COUPLING, TAU = 1.7, 0.3


def case(kind, count):
    """A game of the product, the same of the reference, and a drawer of interior profiles."""
    rng = np.random.default_rng(count)
    if kind == "velocity":
        delta = rng.uniform(0.5, 3, count)
        game, oracle = velocity_game(count, V0, delta), reference_games.VelocityGame(V0, delta)

        def interior(rows):
            return V0 + np.cumsum(rng.uniform(-0.95, 0.95, (rows, count)) * delta, axis=1)
    else:
        game, oracle = osnr_game(**ten_channels()), reference_osnr()

        def interior(rows):
            return oracle.power_limit * rng.dirichlet(np.full(count + 1, 3.0), rows)[:, :count]

    return SimpleNamespace(game=game, oracle=oracle, interior=interior, count=count)


def draw(case):
    """y, and for every agent a filtered profile of its own inside: estimates and z."""
    y = case.interior(1)[0]
    estimates = case.interior(case.count)
    z = np.diag(estimates).copy()
    np.fill_diagonal(estimates, np.nan)  # never read
    return y, estimates, z


def problem_of(game, law, limit=np.inf):
    bounds = np.full(game.actions, limit)
    settings, y = law.settings(RHO), np.zeros(game.actions)
    addresses = link(law.kernels, game.kernels, memory=law.graph is not None, held=False)
    return Problem(
        game.data, law.graph_data, settings, bounds, y, no_propagator(), functions=addresses
    )


def tabled(problem, memory):
    """The problem with its table, which has to be kept."""
    rest, clock = np.zeros((len(problem.limit), 1)), LoopClock(1.0, 1, CONTINUOUS, EULER)
    return problem_and_parameter_block(
        Setup(problem, rest, clock), integrators(len(problem.limit)), len(memory)
    )


def loop_at(game, law, y, memory, h=2.0**-30):
    """The product's compiled loop of integrators (state y), Euler, at any state and memory."""
    agents = integrators(game.actions)
    rest, clock = np.zeros((game.actions, 1)), LoopClock(h, 1, CONTINUOUS, EULER)
    setup = Setup(problem_of(game, law), rest, clock)
    return OdeLoop(agents, setup, y.reshape(-1, 1), memory)


def own_actions_in(memory, y, owner):
    """The memory as the law keeps it: each agent's own action in its own block."""
    memory, m = memory.copy(), len(y)
    if len(memory):
        memory[owner * m + np.arange(m)] = y
    return memory


def step(game, law, y, memory):
    """u, by an Euler step that is too short to be divided, and the memory's rate at a state."""
    memory = own_actions_in(memory, y, game.agent_of_action)
    loop = loop_at(game, law, y, memory)
    first = loop.advance(1, 1)
    assert loop.monitor.exit == watch.INSIDE
    assert np.array_equal(first.state[0, :, 0], y)
    assert np.array_equal(first.memory[0], memory)
    u, rate = first.input[0], np.zeros(len(memory))
    assert np.array_equal(loop.finish().state[0, :, 0], y + 2.0**-30 * u)
    problem, _parameter_block = tabled(problem_of(game, law), memory)
    functions.rate(problem, y, memory, rate)
    return u, rate


def ask(game, law, y, weights, memory):
    """Code, u and the memory's rates by the law's kernels."""
    u, rates = np.full(len(y), np.nan), np.full(len(memory), np.nan)
    problem, _parameter_block = tabled(problem_of(game, law), memory)
    scratch = work(len(y), len(weights), game.agents)
    scratch.now.penalty = RHO
    code = functions.action(problem, y, weights, memory, scratch, u)
    functions.rate(problem, y, memory, rates)
    return code, u, rates


def pack_memory(estimates, z):
    return np.concatenate([estimates.ravel(), z])


def act(game, law, y, estimates, z):
    """Code, u, rates of the estimates and of z by the distributed law, true weights unknown."""
    unknown = np.full(game.constraints_count, np.nan)
    code, u, rates = ask(game, law, y, unknown, pack_memory(estimates, z))
    size = estimates.size
    return code, u, rates[:size].reshape(estimates.shape), rates[size:]


def act_partially(game, law, y, weights, estimates):
    """u and the estimates' rates under partial information, with these barrier weights."""
    code, u, rates = ask(game, law, y, weights, estimates.ravel())
    assert code == -1
    return u, rates.reshape(estimates.shape)
