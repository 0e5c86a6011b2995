"""The shipped games as expressions, beside the same games of hand-written kernels."""

from typing import Any

import numpy as np
from energy_kernels import energy_game

from gne_mj.expressions import fixed, game
from gne_mj.game_model import Game
from gne_mj.games import (
    cournot_game,
    osnr_game,
    ten_channels,
    velocity_consensus_game,
    velocity_game,
)


def energy(count: int = 6) -> tuple[Game, Game]:
    def cost(i, y, p):
        return 0.5 * p.weight[i] * (y[i] - p.wanted[i]) ** 2 + p.price * y[i] * y.mean()

    def constraints(y, p):
        yield "energy", (y**2).sum() <= p.budget
        for i in range(len(y)):
            yield f"gap {i}", abs(y[i] - y[i - 1]) <= p.gap

    wanted = np.linspace(1.0, 3.0, count)
    numbers = {"price": 0.2, "budget": 5.0 * count, "gap": 2.0}
    return (
        game(count, cost, constraints, weight=1.0, wanted=wanted, **numbers),
        energy_game(np.ones(count), wanted, **numbers),
    )


def velocity(count: int = 5) -> tuple[Game, Game]:
    def cost(i, y, p):
        before = y[i - 1] if i > 0 else p.v0
        return (y[i] - before) ** 2 + p.w[i] * (y[i] - p.wanted[i]) ** 2

    def constraints(y, p):
        for i in range(len(y)):
            yield f"gap of agent {i + 1}", abs(y[i] - (y[i - 1] if i > 0 else p.v0)) <= p.delta[i]

    rng = np.random.default_rng(1)
    delta, wanted, w = rng.uniform(1, 3, count), rng.normal(size=count), rng.uniform(0, 1, count)
    return (
        game(count, cost, constraints, v0=3.0, delta=delta, wanted=wanted, w=w),
        velocity_game(count, 3.0, delta, wanted, w),
    )


def cournot(count: int = 10) -> tuple[Game, Game]:
    def cost(i, y, p):
        return y[i] * (p.c[i] - (p.D - y.sum()))

    c = count * (1.0 + 0.5 * np.arange(count))
    return game(count, cost, lower=7.0, upper=100.0, c=c, D=60.0 * count), cournot_game(count)


def osnr() -> tuple[Game, Game]:
    def cost(i, y, p):
        noise = p.noise_power[i] + p.gamma[i] @ y
        return p.price[i] * y[i] - p.utility_weight[i] * np.log1p(p.gain[i] * y[i] / noise)

    def constraints(y, p):
        yield "power", y >= 0
        yield "total power", y.sum() <= p.total_power_limit

    numbers: dict[str, Any] = ten_channels()
    gamma = np.array(numbers["system_matrix"])
    np.fill_diagonal(gamma, 0.0)
    given = {k: v for k, v in numbers.items() if k != "system_matrix"}
    return game(len(gamma), cost, constraints, gamma=gamma, **given), osnr_game(**numbers)


def consensus() -> tuple[Game, Game]:
    edges = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (0, 2), (1, 3), (5, 0), (6, 5), (6, 4), (7, 6),
             (7, 1), (8, 2), (8, 7), (9, 3), (9, 8)]  # fmt: skip

    def cost(i, y, p):
        near = [b if a == i else a for a, b in p.edges if i in (a, b)]
        gaps = sum(((y[i] - y[j]) ** 2).sum() for j in near)
        return gaps + p.w[i] * ((y[i] - p.v0) ** 2).sum()

    def constraints(y, p):
        for i, j in p.edges:
            yield f"gap of {i + 1} and {j + 1}", ((y[i] - y[j]) ** 2).sum() <= p.delta**2
        yield "gap of leader", ((y[0] - p.v0) ** 2).sum() <= p.delta**2

    w = np.zeros(10)
    w[0] = 1.0
    return (
        game(10, cost, constraints, dimension=2, edges=fixed(edges), w=w, v0=[1.0, 0.5], delta=3.0),
        velocity_consensus_game(edges, w.tolist(), [1.0, 0.5], 3.0, 3.0),
    )


PAIRS = {
    "energy": energy,
    "velocity": velocity,
    "cournot": cournot,
    "osnr": osnr,
    "consensus": consensus,
}
