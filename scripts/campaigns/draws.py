"""Random systems for the campaigns: games, fleets, starts, periods."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games import (
    cournot_game,
    osnr_game,
    ten_channels,
    velocity_consensus_game,
    velocity_game,
)
from gne_mj.plants import flexible_robot, integrator, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.progress import telling
from gne_mj.system import Clock, System

LONGEST_STEP = 5e-3  # s
CLOSEST = 1e-9  # of a bound


@dataclass
class Draw:
    """One system on one clock, and what a table counts it under."""

    system: System
    clock: Clock
    kind: str
    margin: float


class Fleet:
    """A game with agents, from which many runs are drawn."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.kind = str(
            rng.choice(
                ["robots", "planar robots", "OSNR", "Cournot", "integrators"],
                p=[0.6, 0.15, 0.1, 0.05, 0.1],
            )
        )
        self.engine = "mujoco" if "robots" in self.kind else "ode"
        self.game, self.agents = getattr(self, "_" + self.kind.replace(" ", "_"))()

    def _numbers(self, count: int, dimension: int) -> np.ndarray:
        """Robots of masses, springs and dampers that differ by a factor of up to 25."""
        rng = self.rng
        table = np.exp(rng.uniform(np.log(0.2), np.log(5.0), (count, 5)))
        table[:, 3] *= rng.random(count) < 0.8
        return np.repeat(table, dimension, axis=0)

    def _robots(self) -> tuple[Game, Agents]:
        rng = self.rng
        count = int(rng.choice([1, 2, 3, 5, 8, 13, 20]))
        delta = np.exp(rng.uniform(np.log(0.3), np.log(5.0), count))
        weight = np.where(rng.random(count) < 0.3, rng.uniform(0, 2, count), 0.0)
        desired = rng.uniform(-6, 6, count)
        game = velocity_game(count, rng.uniform(-3, 3), delta, desired, weight)
        agents = Agents(flexible_robot, self._numbers(count, 1), np.full(count, np.inf))
        return game, agents

    def _planar_robots(self) -> tuple[Game, Agents]:
        rng = self.rng
        count = int(rng.choice([2, 4, 6]))
        edges = [(i, i + 1) for i in range(count - 1)]
        edges += [(0, count - 1)] if count > 2 and rng.random() < 0.5 else []
        weight = np.where(np.arange(count) == 0, 1.0, 0.0)
        game = velocity_consensus_game(
            edges, weight, rng.uniform(-2, 2, 2), rng.uniform(0.5, 3, len(edges)), 2.0
        )
        agents = Agents(flexible_robot, self._numbers(count, 2), np.full(2 * count, np.inf), 2)
        return game, agents

    def _OSNR(self) -> tuple[Game, Agents]:
        rng = self.rng
        game = osnr_game(**{**ten_channels(), "total_power_limit": float(rng.uniform(1, 4))})
        v = rng.uniform(0.5, 2, 10)
        table = np.column_stack([v, v * rng.uniform(0.1, 0.9, 10)])
        return game, Agents(pi_cascade, table, np.full(10, np.inf))

    def _Cournot(self) -> tuple[Game, Agents]:
        count = int(self.rng.choice([3, 10]))
        game = cournot_game(count, upper_bound=float(self.rng.uniform(20, 100)))
        return game, Agents(integrator, np.zeros((count, 0)), np.full(count, np.inf))

    def _integrators(self) -> tuple[Game, Agents]:
        game, _ = self._robots()
        count = game.agents
        return game, Agents(integrator, np.zeros((count, 0)), np.full(count, np.inf))

    def start(self, margin: float) -> np.ndarray:
        """States (m, states) whose outputs are within this share of the way to some bound."""
        rng, game = self.rng, self.game
        y = towards_bound(rng, game, self._center(), margin)
        state = self.agents.equilibrium(y)
        if self.agents.kind is flexible_robot:
            m = game.actions
            hard = rng.choice([1.0, 5.0, 20.0])  # kicks
            state[:, 0] = rng.uniform(-1, 1, m) * hard * 0.2
            state[:, 2] = y + rng.uniform(-1, 1, m) * hard
        elif self.agents.kind is pi_cascade:
            state[:, 1] *= rng.uniform(0.2, 2.0, game.actions)
        return state

    def _center(self) -> np.ndarray:
        game = self.game
        if game.name == "OSNR":
            return np.full(game.actions, game.parameters[1] / (2 * game.actions))
        lower, upper = game.box
        return 0.5 * (lower + upper)

    def draw(self, mode: str, *, decentralised: bool = False) -> Draw:
        """One run: a period from 0.1 ms to 1 s of steps up to 5 ms, a penalty and a start."""
        rng = self.rng
        period = float(np.exp(rng.uniform(np.log(1e-4), np.log(1.0))))
        steps = max(1, int(np.ceil(period / LONGEST_STEP - 1e-9)))
        margin = float(np.exp(rng.uniform(np.log(CLOSEST), np.log(0.9))))
        system = System(
            self.kind.replace(" ", "-"),
            self.game,
            self.agents,
            FullInformation(),
            float(np.exp(rng.uniform(np.log(1e-3), np.log(1.0)))),
            self.start(margin),
            mode=mode,
            engine=self.engine,
            integrator="euler",
            decentralised=decentralised,
        )
        periods = int(rng.integers(4, 25))
        clock = Clock(period * periods, period / steps, period, period * periods)
        return Draw(system, clock, self.kind, margin)


def towards_bound(
    rng: np.random.Generator, game: Game, inner: np.ndarray, margin: float
) -> np.ndarray:
    """A profile (m,) on a random ray from ``inner``, this share of the way to the bound left.

    Where the game is tightened, that is the tightened bound.

    Raises:
        InvalidInput: ``inner`` is not inside.
    """

    def inside(y: np.ndarray) -> bool:
        return bool(np.all(game.constraints(y) + game.margins < 0))

    if not inside(inner):
        raise InvalidInput("margin", game.name, "a tightened set that holds its middle")
    direction = rng.normal(size=game.actions)
    low, high = 0.0, 1.0
    while inside(inner + high * direction):
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if inside(inner + middle * direction):
            low = middle
        else:
            high = middle
    y, back = inner + low * (1.0 - margin) * direction, 1e-12
    while not inside(y):  # rounding near the bound, or a hole in the set
        y = inner + (y - inner) * (1.0 - back)
        back = min(2.0 * back, 0.5)
    return y


def progress(done: Iterable[Any], total: int, what: str) -> Iterator[Any]:
    """The same, telling on stderr how far it is."""
    with telling(what) as tell:
        tell(0, total, f"{total} {what}")
        for count, each in enumerate(done, start=1):
            yield each
            tell(count, total, f"{count} of {total} {what}")
