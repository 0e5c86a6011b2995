"""Systems of the product beside the same ones of reference.py, for tests to compare."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from reference_agents import FlexibleRobot, PiCascade, PositionRobot

import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed
from gne_mj.games import osnr_game, ten_channels, velocity_consensus_game, velocity_game
from gne_mj.plants import flexible_robot, integrator, pi_cascade, position_robot
from gne_mj.plants.agents import Agents
from gne_mj.system import Clock, System

V0 = 3.0
FIVE = np.array([1.0, 0.0, -1.0, 0.5, 2.0])

EQUAL = {
    "main_mass": [1.0] * 5,
    "appendage_mass": [1.0] * 5,
    "stiffness": [1.0] * 5,
    "atan_coefficient": [1.0] * 5,
    "damping": [1.0] * 5,
}
UNEQUAL = {
    "main_mass": [1.0, 2.5, 0.7, 1.3, 4.0],
    "appendage_mass": [0.5, 1.0, 2.0, 0.3, 1.7],
    "stiffness": [1.0, 0.4, 3.0, 2.0, 1.1],
    "atan_coefficient": [1.0, 2.0, 0.0, 0.5, 3.0],
    "damping": [1.0, 0.2, 0.6, 2.0, 0.9],
}


def robots(numbers, limit=np.inf):
    """Agents of the product with these numbers (lists), one robot an entry."""
    table = np.column_stack([numbers[name] for name in flexible_robot.PARAMETERS])
    return Agents(flexible_robot, np.ascontiguousarray(table), np.full(len(table), limit))


def reference_robots(numbers):
    return FlexibleRobot(*[numbers[name] for name in flexible_robot.PARAMETERS])


def with_damping(numbers, tau, share=1.2):
    """Numbers of robots (lists) with a look-ahead in s, and this share of the least damping."""
    big, small, gamma = (np.array(numbers[n]) for n in ("main_mass", "appendage_mass", "damping"))
    least = (big + small) / tau + small**2 / (4 * tau**2 * gamma)
    return np.full(len(big), tau), share * least


def position_robots(numbers, tau=0.7, share=1.2, v_0=3.0):
    """Robots whose outputs are positions, beside a reference that moves at v_0 in m/s."""
    columns = [numbers[name] for name in flexible_robot.PARAMETERS]
    lookahead, damping = with_damping(numbers, tau, share)
    table = np.column_stack([*columns, lookahead, damping, np.full(len(damping), v_0)])
    return Agents(position_robot, table, np.full(len(table), np.inf))


def reference_position_robots(numbers, tau=0.7, share=1.2):
    columns = [numbers[name] for name in flexible_robot.PARAMETERS]
    lookahead, damping = with_damping(numbers, tau, share)
    return PositionRobot(*columns, lookahead=lookahead, local_damping=damping)


def integrators(count):
    return Agents(integrator, np.zeros((count, 0)), np.full(count, np.inf))


def pi_cascades(count, v=1.0, k=0.5):
    table = np.column_stack([np.full(count, v), np.full(count, k)])
    return Agents(pi_cascade, table, np.full(count, np.inf))


def reference_pi(count, v=1.0, k=0.5):
    return PiCascade(np.full(count, v), np.full(count, k))


def reference_osnr(parameters=None):
    p = parameters or ten_channels()
    return reference_games.OsnrGame(
        p["price"],
        p["utility_weight"],
        p["gain"],
        p["noise_power"],
        p["system_matrix"],
        p["total_power_limit"],
    )


def robot_state(y, extension=0.0, appendage=None, position=0.0):
    """(N, 4) states of robots; appendages move along unless told otherwise."""
    y = np.asarray(y, dtype=float)
    columns = (extension, y, y if appendage is None else appendage, position)
    return np.column_stack([np.broadcast_to(column, y.shape) for column in columns])


def random_robot_state(rng, delta, v0=V0, spread=4.0):
    """An interior start with random extensions and appendages up to ``spread`` m/s off."""
    n = len(delta)
    y = v0 + np.cumsum(rng.uniform(-0.95, 0.95, n) * delta)
    return robot_state(
        y, extension=rng.uniform(-1, 1, n), appendage=y + rng.uniform(-spread, spread, n)
    )


def robot_system(state, numbers=EQUAL, delta=3.0, rho=0.1, law=None, limit=np.inf, **options):
    """Velocity synchronisation of flexible robots."""
    game = velocity_game(len(state), V0, delta)
    law = law or FullInformation()
    agents = robots(numbers, limit)
    return System("robots", game, agents, law, rho, np.asarray(state, dtype=float), **options)


def osnr_system(agents, law, y, rho=0.1, **options):
    """The ten-channel OSNR game, at rest at y."""
    game = osnr_game(**ten_channels())
    state = agents.equilibrium(np.broadcast_to(y, (game.actions,)).astype(float))
    return System("channels", game, agents, law, rho, state, **options)


def distributed(graph="printed", epsilon=0.01, gain=1.0, count=10):
    return FullyDistributed(graphs.NAMED[graph](count), epsilon, gain)


def clock(h, duration=1.0, control=None, sample=None):
    return Clock(duration, h, control or h, sample or h)


def run_loop(system, h, steps, control=None, every=1):
    """All samples of a system's native loop, the last state included, and the loop."""
    loop = system.closed_loop(clock(h, steps * h, control))
    recorded = loop.advance(steps // every, every)
    last = loop.finish()
    return (
        np.concatenate([recorded.state, last.state]),
        np.concatenate([recorded.input, last.input]),
        np.concatenate([recorded.memory, last.memory]),
        loop,
    )


def relative_error(got, expected):
    """Greatest absolute error over the greatest magnitude."""
    return np.max(np.abs(got - expected)) / np.max(np.abs(expected))


@dataclass
class Consensus:
    """A random game of velocity consensus, an oracle of it, and a source of interior profiles."""

    game: Any
    oracle: Any
    rng: Any

    def interior(self, used=0.99):
        """A profile whose gaps use up to this part of their bounds, on a random way from v_0."""
        oracle, rng = self.oracle, self.rng
        away = rng.normal(size=(oracle.agents, oracle.d)) * rng.uniform(0.1, 3)
        gaps = np.array([oracle.gap(k, (oracle.v0 + away).ravel()) for k in range(oracle.p)])
        widest = np.max(np.linalg.norm(gaps, axis=1) / oracle.delta)
        return (oracle.v0 + away * rng.uniform(0.05, used) / widest).ravel()


def random_consensus(seed, dimension, tightest=0.3):
    """Any graph of up to seven agents, in one or more parts, each with one leader or more."""
    rng = np.random.default_rng(seed)
    agents = int(rng.integers(1, 8))
    pairs = [(i, j) for i in range(agents) for j in range(i + 1, agents)]
    edges = [pair[:: rng.choice([1, -1])] for pair in pairs if rng.random() < rng.random()]
    part = list(range(agents))
    for i, j in edges:
        part = [part[j] if label == part[i] else label for label in part]
    weight = np.where(rng.random(agents) < 0.3, rng.uniform(0.2, 2, agents), 0.0)
    for label in set(part):
        members = [i for i in range(agents) if part[i] == label]
        if not np.any(weight[members] > 0):
            weight[rng.choice(members)] = rng.uniform(0.2, 2)
    leaders = int(np.sum(weight > 0))
    v0, delta = rng.uniform(-3, 3, dimension), rng.uniform(tightest, 4, len(edges) + leaders)
    game = velocity_consensus_game(edges, weight, v0, delta[: len(edges)], delta[len(edges) :])
    return Consensus(game, reference_games.VelocityConsensusGame(v0, edges, weight, delta), rng)
