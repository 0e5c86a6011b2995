"""Random systems in mode continuous, each beside the same one as a stiff differential equation.

A kind is a combination of game, agents, law and engine: each compiles loops of its own, so that
there are few of them, and what is drawn at random are numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import stiff
from draws import towards_bound
from quadratic import Numbers, quadratic_game

from gne_mj.controllers import FullInformation, FullyDistributed, Law, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games import cournot_game, osnr_game, velocity_consensus_game, velocity_game
from gne_mj.graph import Graph
from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.system import Clock, System
from gne_mj.system.steps import largest_step
from gne_mj.theory import Theorem

STEPS = (5e-4, 1e-2)  # s, shortest and longest integration step
CLOSEST = 1e-9  # of the way to a bound
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 50, 60)
OFTEN = np.array([5, 10, 15, 10, 20, 10, 10, 6, 4, 3, 4, 2, 1]) / 100


@dataclass
class Both:
    """A game of the product and the same in the oracle's words, and a profile well inside."""

    game: Game
    oracle: stiff.Game
    middle: np.ndarray


@dataclass
class Draw:
    """One system on its clock, the same as a differential equation, and what it is counted by.

    Attributes:
        loop, x: the oracle's loop and its flat state at the start.
        kind: which kind of system.
        margin: share of the way to the bound that the start leaves.
        kick: greatest of the robots' relative velocities and extensions.
    """

    system: System
    clock: Clock
    loop: stiff.Loop
    x: np.ndarray
    kind: str
    margin: float
    kick: float


def log_uniform(rng: np.random.Generator, low: float, high: float, shape: Any = None) -> Any:
    """Between two positive numbers, each decade as often."""
    return np.exp(rng.uniform(np.log(low), np.log(high), shape))


def _pairs(rng: np.random.Generator, count: int) -> list[tuple[int, int]]:
    """A random connected graph: a tree and some more edges."""
    edges = {(int(rng.integers(i)), i) for i in range(1, count)}
    for _ in range(int(rng.integers(0, count)) if count > 2 else 0):
        i, j = sorted(rng.choice(count, 2, replace=False).tolist())
        edges.add((i, j))
    return sorted(edges)


# ------------------------------------------------------------------------------------- games


def lane(rng: np.random.Generator, count: int) -> Both:
    """Velocity synchronisation, half of the time with desired velocities."""
    v0, delta = rng.uniform(-3, 3), log_uniform(rng, 0.3, 5.0, count)
    wishes = rng.random() < 0.5
    weight = np.where(rng.random(count) < 0.6, rng.uniform(0, 2, count), 0.0) * wishes
    desired = rng.uniform(-6, 6, count)
    chain = np.eye(count) - np.eye(count, k=-1)
    first = np.eye(count)[0] * v0
    oracle = stiff.Game(
        owner=np.arange(count),
        pull=stiff.Affine(2 * chain + 2 * np.diag(weight), -2 * first - 2 * weight * desired),
        line=np.zeros((0, count)), bound=np.zeros(0),
        disc=chain[:, None, :], center=first[:, None], radius=delta,
    )  # fmt: skip
    game = velocity_game(count, v0, delta, desired, weight)
    return Both(game, oracle, np.full(count, v0))


def plane(rng: np.random.Generator, count: int, most: int = 2) -> Both:
    """Velocity consensus in one or two dimensions, or more."""
    d = int(rng.integers(1, most + 1))
    edges = _pairs(rng, count)
    weight = np.where(rng.random(count) < 0.3, rng.uniform(0.2, 2, count), 0.0)
    weight[int(rng.integers(count))] = rng.uniform(0.2, 2)
    leaders = np.flatnonzero(weight)
    v0 = rng.uniform(-2, 2, d)
    delta = log_uniform(rng, 0.5, 3.0, len(edges))
    reach = log_uniform(rng, 0.5, 3.0, len(leaders))
    ends = np.zeros((len(edges) + len(leaders), count))
    for row, (i, j) in enumerate(edges):
        ends[row, i], ends[row, j] = 1.0, -1.0
    ends[np.arange(len(edges), len(ends)), leaders] = 1.0
    links = ends[: len(edges)]
    slope = 2 * (links.T @ links + np.diag(weight))
    center = np.zeros((len(ends), d))
    center[len(edges) :] = v0
    oracle = stiff.Game(
        owner=np.repeat(np.arange(count), d),
        pull=stiff.Affine(np.kron(slope, np.eye(d)), np.kron(-2 * weight, v0)),
        line=np.zeros((0, count * d)), bound=np.zeros(0),
        disc=np.array([np.kron(row, np.eye(d)) for row in ends]), center=center,
        radius=np.concatenate([delta, reach]),
    )  # fmt: skip
    game = velocity_consensus_game(edges, weight, v0, delta, reach)
    return Both(game, oracle, np.tile(v0, count))


def space(rng: np.random.Generator, count: int) -> Both:
    """Velocity consensus in one, two or three dimensions, of which MuJoCo has two."""
    return plane(rng, count, 3)


def channels(rng: np.random.Generator, count: int) -> Both:
    """OSNR, weakly coupled as links are."""
    price, weight = rng.uniform(0.5, 2, count), rng.uniform(0.5, 2, count)
    gain, noise = rng.uniform(0.3, 1, count), rng.uniform(0.05, 0.3, count)
    matrix = rng.uniform(0, 6e-3, (count, count)) * (1 - np.eye(count))
    power = rng.uniform(0.1, 0.4) * count + 0.3
    oracle = stiff.Game(
        owner=np.arange(count),
        pull=stiff.Osnr(price, weight, gain, noise, matrix),
        line=np.concatenate([-np.eye(count), np.ones((1, count))]),
        bound=np.append(np.zeros(count), power),
        disc=np.zeros((0, 1, count)), center=np.zeros((0, 1)), radius=np.zeros(0),
    )  # fmt: skip
    game = osnr_game(price, weight, gain, noise, matrix, power)
    return Both(game, oracle, np.full(count, power / (2 * count)))


def firms(rng: np.random.Generator, count: int) -> Both:
    """Cournot competition."""
    cost = rng.uniform(0, 40, count)
    intercept = rng.uniform(20, 60) * np.sqrt(count)
    lower = rng.uniform(0, 7, count)
    upper = lower + rng.uniform(2, 60, count)
    oracle = stiff.Game(
        owner=np.arange(count),
        pull=stiff.Affine(np.eye(count) + 1.0, cost - intercept),
        line=np.concatenate([-np.eye(count), np.eye(count)]),
        bound=np.concatenate([-lower, upper]),
        disc=np.zeros((0, 1, count)), center=np.zeros((0, 1)), radius=np.zeros(0),
    )  # fmt: skip
    game = cournot_game(count, cost, intercept, lower, upper)
    return Both(game, oracle, 0.5 * (lower + upper))


def quadratic_numbers(rng: np.random.Generator, count: int) -> tuple[Numbers, np.ndarray]:
    """A strongly monotone affine F and convex constraints about 0, and half its box (m,)."""
    sizes = tuple(int(n) for n in rng.integers(1, 3, count))
    m = sum(sizes)
    owner = np.repeat(np.arange(count), sizes)
    turn, _ = np.linalg.qr(rng.normal(size=(m, m)))
    slope = turn.T @ np.diag(log_uniform(rng, 0.1, 10.0, m)) @ turn
    twist = rng.normal(size=(m, m)) * log_uniform(rng, 0.1, 5.0)
    slope += (twist - twist.T) * (owner[:, None] != owner)
    half = log_uniform(rng, 0.3, 10.0, m)
    discs = int(rng.integers(0, 4))
    disc = rng.normal(size=(discs, m, m)) * (rng.random((discs, 1, m)) < 0.7)
    disc[:, 0, 0] += 1.0
    radius = log_uniform(rng, 0.5, 5.0, discs)
    center = rng.normal(size=(discs, m))
    center *= (0.8 * rng.random(discs) * radius / np.linalg.norm(center, axis=1))[:, None]
    extra = rng.normal(size=(int(rng.integers(0, 3)), m))
    numbers = Numbers(
        sizes, slope, rng.normal(size=m) * log_uniform(rng, 0.1, 30.0),
        np.concatenate([-np.eye(m), np.eye(m), extra]),
        np.concatenate([half, half, log_uniform(rng, 0.2, 3.0, len(extra))]),
        disc, center, radius, np.ones(discs),
    )  # fmt: skip
    return numbers, half


def _quadratic(rng: np.random.Generator, count: int, plain: bool) -> Both:
    n, half = quadratic_numbers(rng, count)
    oracle = stiff.Game(
        np.repeat(np.arange(count), n.sizes), stiff.Affine(n.slope, n.offset),
        n.line, n.bound, n.disc, n.center, n.radius,
    )  # fmt: skip
    game = quadratic_game(n, plain=plain, box=(-half, half))
    return Both(game, oracle, np.zeros(game.actions))


def kernels(rng: np.random.Generator, count: int) -> Both:
    """A game of one's own, of kernels."""
    return _quadratic(rng, count, plain=False)


def functions(rng: np.random.Generator, count: int) -> Both:
    """The same of plain Python functions."""
    return _quadratic(rng, count, plain=True)


# ------------------------------------------------------------------------------------ agents


def robots(rng: np.random.Generator, game: Game) -> Agents:
    """Masses, springs and dampers that differ by a factor of up to 25."""
    size = game.sizes[0]
    table = log_uniform(rng, 0.2, 5.0, (game.agents, 5))
    table[:, 3] *= rng.random(game.agents) < 0.8
    free = np.full(game.actions, np.inf)
    return Agents(flexible_robot, np.repeat(table, size, axis=0), free, size)


def integrators(rng: np.random.Generator, game: Game) -> Agents:
    """Integrators."""
    return Agents(integrator, np.zeros((game.actions, 0)), np.full(game.actions, np.inf))


def cascades(rng: np.random.Generator, game: Game) -> Agents:
    """PI cascades."""
    v = log_uniform(rng, 0.3, 3.0, game.actions)
    table = np.column_stack([v, v * rng.uniform(0.1, 0.9, game.actions)])
    return Agents(pi_cascade, table, np.full(game.actions, np.inf))


def mixture(rng: np.random.Generator, game: Game) -> Agents:
    """Robots, integrators and cascades side by side."""
    parts = (robots(rng, game), integrators(rng, game), cascades(rng, game))
    rows = []
    for r in range(game.actions):
        group = parts[int(rng.integers(3))]
        rows.append(Agents(group.kind, group.parameters[r : r + 1], group.input_limit[r : r + 1]))
    return mixed.join(rows)


def oracle_channels(agents: Agents) -> list[tuple[str, list[float]]]:
    """The channels' types and numbers, as :class:`stiff.Loop` takes them."""
    names = {flexible_robot: stiff.ROBOT, integrator: stiff.INTEGRATOR, pi_cascade: stiff.CASCADE}
    if agents.kind is not mixed:
        return [(names[agents.kind], row.tolist()) for row in agents.parameters]
    types = [mixed.TYPES[int(row[0])] for row in agents.parameters]
    return [
        (names[kind], row[1 : 1 + len(kind.PARAMETERS)].tolist())
        for kind, row in zip(types, agents.parameters, strict=True)
    ]


def oracle_states(agents: Agents, state: np.ndarray) -> list[np.ndarray]:
    """The product's states of the channels as the oracle has them."""
    if agents.kind is not mixed:
        return [row[: stiff.STATES[kind]] for (kind, _), row in
                zip(oracle_channels(agents), state, strict=True)]  # fmt: skip
    cut = {stiff.ROBOT: slice(0, 3), stiff.INTEGRATOR: slice(1, 2), stiff.CASCADE: slice(1, 3)}
    return [row[cut[kind]] for (kind, _), row in zip(oracle_channels(agents), state, strict=True)]


def kicked(rng: np.random.Generator, agents: Agents, y: np.ndarray, hard: float) -> np.ndarray:
    """States with these outputs: appendages flying off at up to ``hard`` m/s, springs extended."""
    state = agents.equilibrium(y)
    for r, (kind, _) in enumerate(oracle_channels(agents)):
        if kind == stiff.ROBOT:
            state[r, 0] = rng.uniform(-1, 1) * hard * 0.2
            state[r, 2] = y[r] + rng.uniform(-1, 1) * hard
        elif kind == stiff.CASCADE:
            state[r, agents.kind.OUTPUT + 1] *= rng.uniform(0.2, 2.0)
    return state


# ------------------------------------------------------------------------------------- kinds


@dataclass
class Kind:
    """What is compiled for: game, agents, law, engine; and how often it is drawn."""

    game: Callable[[np.random.Generator, int], Both]
    agents: Callable[[np.random.Generator, Game], Agents]
    law: str
    engine: str = "ode"
    share: float = 1.0
    most: int = 60  # agents


KINDS = {
    "lane robots": Kind(lane, robots, "full", share=3.0),
    "lane robots, MuJoCo": Kind(lane, robots, "full", "mujoco", share=3.0),
    "lane robots, partial": Kind(lane, robots, "partial", share=2.0, most=20),
    "lane robots, partial, MuJoCo": Kind(lane, robots, "partial", "mujoco", most=20),
    "space robots": Kind(space, robots, "full", share=2.0, most=20),
    "plane robots, MuJoCo": Kind(plane, robots, "full", "mujoco", share=2.0, most=20),
    "space integrators, partial": Kind(space, integrators, "partial", most=10),
    "lane mixed": Kind(lane, mixture, "full", share=1.5),
    "channels, cascades": Kind(channels, cascades, "full", share=2.0, most=10),
    "channels, cascades, partial": Kind(channels, cascades, "partial", most=5),
    "channels, cascades, distributed": Kind(channels, cascades, "distributed", share=2.0, most=10),
    "firms": Kind(firms, integrators, "full", share=1.5),
    "custom": Kind(kernels, integrators, "full", share=2.0, most=6),
    "custom, partial": Kind(kernels, integrators, "partial", most=5),
    "custom, plain": Kind(functions, integrators, "full", share=0.3, most=3),
}


def draw(rng: np.random.Generator, kind: str | None = None) -> Draw:
    """A random system that is certified (under Euler's method: but for that method).

    Args:
        rng: whose numbers it depends on alone.
        kind: of this kind; of any if left out.
    """
    shares = np.array([each.share for each in KINDS.values()])
    name = kind or str(rng.choice(list(KINDS), p=shares / shares.sum()))
    while True:
        found = _try(rng, name)
        if found is not None:
            return found


def _try(rng: np.random.Generator, name: str) -> Draw | None:
    kind = KINDS[name]
    counts = np.array(COUNTS)
    often = np.where(counts <= kind.most, OFTEN, 0.0)
    count = int(rng.choice(counts, p=often / often.sum()))
    if kind.law != "full":
        count = max(count, 2)
    both = kind.game(rng, count)
    agents = kind.agents(rng, both.game)
    margin = float(log_uniform(rng, CLOSEST, 0.9))
    hard = float(rng.choice([0.0, 1.0, 5.0, 20.0]))
    y = towards_bound(rng, both.game, both.middle, margin)
    step = float(log_uniform(rng, *STEPS))
    law = random_law(rng, kind.law, count)
    system = System(
        "run", both.game, agents, law, float(log_uniform(rng, 1e-6, 1.0)),
        kicked(rng, agents, y, hard), engine=kind.engine,
        integrator="euler" if rng.random() < 0.1 else "rk4",
    )  # fmt: skip
    if isinstance(law, PartialInformation):
        coupled = _coupled(rng, system, law)
        if coupled is None:
            return None
        system = replace(system, law=coupled, memory=_estimates(rng, system, law, y))
    if isinstance(law, FullyDistributed):
        system = _slow_enough(rng, system, law, step)
    step = min(step, 0.9 * largest_step(system))
    if step < STEPS[0] or Theorem(system).obstacles:
        return None
    samples = int(rng.integers(15, 40))
    every = max(1, round(float(log_uniform(rng, 0.05, 0.5)) / (samples * step)))
    if not both.game.native:
        every = 1  # plain functions, hundreds of times slower: a few steps
    clock = Clock(samples * every * step, step, step, every * step)
    loop, x = as_stiff(system, both.oracle)
    return Draw(system, clock, loop, x, name, margin, hard)


def random_law(rng: np.random.Generator, information: str, count: int) -> Law:
    """A law on a random graph; coupling gain and epsilon are 1 and still to be chosen."""
    if information == "full":
        return FullInformation()
    graph = Graph(count, tuple(_pairs(rng, count)))
    if information == "partial":
        return PartialInformation(graph, 1.0, float(log_uniform(rng, 0.05, 2.0)))
    return FullyDistributed(graph, 1.0, float(log_uniform(rng, 0.02, 1.0)))


def _coupled(
    rng: np.random.Generator, system: System, law: PartialInformation
) -> PartialInformation | None:
    """The same law with a gain above the least that is certified."""
    coupling = Theorem(system).coupling
    assert coupling is not None
    conditions = [coupling.rigorous, *([coupling.quadratic] if coupling.quadratic else [])]
    least = min((c.least for c in conditions if c.certified), default=np.inf)
    if not np.isfinite(least):
        return None
    return replace(law, coupling=max(least, 0.01) * float(log_uniform(rng, 1.02, 4.0)))


def _estimates(
    rng: np.random.Generator, system: System, law: PartialInformation, y: np.ndarray
) -> np.ndarray:
    """Estimates at the start: those of y(0), or off by up to some part of the box."""
    lower, upper = system.game.box or (y - 1.0, y + 1.0)
    off = float(rng.choice([0.0, 0.1, 0.5])) * (upper - lower)
    rows = np.clip(y + off * rng.uniform(-1, 1, (law.graph.agents, len(y))), lower, upper)
    rows[system.game.agent_of_action, np.arange(len(y))] = y
    return rows.ravel()


def _slow_enough(
    rng: np.random.Generator, system: System, law: FullyDistributed, step: float
) -> System:
    """An epsilon, and the integrator that can follow it."""
    if rng.random() < 0.5:
        slow = replace(law, epsilon=float(log_uniform(rng, 1e-6, 1e-2)))
        return replace(system, law=slow, integrator="rosenbrock")
    fastest = step * max(1.0, law.graph.largest_eigenvalue) / 1.8
    return replace(system, law=replace(law, epsilon=fastest * float(log_uniform(rng, 1.0, 10.0))))


def as_stiff(system: System, oracle: stiff.Game) -> tuple[stiff.Loop, np.ndarray]:
    """The system as the oracle has it: its loop and its flat state at the start."""
    law, m = system.law, system.game.actions
    agents = system.game.agents
    states = oracle_states(system.agents, system.state)
    channels_ = oracle_channels(system.agents)
    if isinstance(law, FullInformation):
        loop = stiff.Loop(oracle, stiff.Law("full"), system.rho, channels_)
        return loop, loop.pack(states)
    laplacian = np.zeros((agents, agents))
    assert law.graph is not None
    for i, j in law.graph.edges:
        laplacian[[i, j], [i, j]] += 1.0
        laplacian[[i, j], [j, i]] -= 1.0
    estimates = system.memory[: agents * m]
    if isinstance(law, PartialInformation):
        told = stiff.Law("partial", laplacian, law.coupling, law.time_constant)
        loop = stiff.Loop(oracle, told, system.rho, channels_)
        return loop, loop.pack(states, estimates)
    if not isinstance(law, FullyDistributed):
        raise InvalidInput("law", law.information, "one of the paper's three")
    told = stiff.Law("distributed", laplacian, gain=law.gain, epsilon=law.epsilon)
    loop = stiff.Loop(oracle, told, system.rho, channels_)
    return loop, loop.pack(states, estimates, system.memory[agents * m :])
