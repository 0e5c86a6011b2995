"""The shipped games as expressions, beside the same games of hand-written kernels."""

from typing import Any

import numpy as np
from energy_kernels import energy_game

from gne_mj.expressions import fixed, game
from gne_mj.game_model import Game
from gne_mj.games import (
    cournot_game,
    formation_game,
    osnr_game,
    platoon_game,
    region_of,
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


def platoon(count: int = 6) -> tuple[Game, Game]:
    def cost(i, y, p):
        own = p.v[i] * (y[i] - p.place[i]) ** 2
        return own + (p.w[i] * (y[i - 1] - y[i] - p.d[i]) ** 2 if i > 0 else 0.0)

    def constraints(y, p):
        yield "least place of agent 1", y[0] >= p.least[0]
        for i in range(1, len(y)):
            yield f"least spacing of agents {i} and {i + 1}", y[i - 1] - y[i] >= p.least[i]
        yield "greatest place of agent 1", y[0] <= p.most[0]
        for i in range(1, len(y)):
            yield f"greatest spacing of agents {i} and {i + 1}", y[i - 1] - y[i] <= p.most[i]

    rng = np.random.default_rng(2)
    lower, upper = rng.uniform(0.5, 1.0, count), rng.uniform(2.0, 4.0, count)
    lower[0] = -3.0
    d, w = rng.uniform(0.0, 5.0, count), rng.uniform(0.5, 1.0, count)
    place, v = rng.normal(size=count), rng.uniform(0.3, 0.6, count)
    numbers = {"least": lower, "most": upper, "d": d, "w": w, "place": place, "v": v}
    return (
        game(count, cost, constraints, **numbers),
        platoon_game(
            count, lower[1:], upper[1:], desired_spacing=d[1:], spacing_weight=w[1:],
            desired_place=place, place_weight=v, leader_range=(-3.0, upper[0]),
        ),
    )  # fmt: skip


def formation(count: int = 6) -> tuple[Game, Game]:
    edges = [(0, 1), (1, 2), (2, 0), (3, 2), (3, 4), (5, 4)]
    links = [(0, 1), (2, 3), (5, 3), (4, 5)]

    def cost(i, y, p):
        near = [(k, b, 1.0) if a == i else (k, a, -1.0)
                for k, (a, b) in enumerate(p.edges) if i in (a, b)]  # fmt: skip
        total = p.v[i] * ((y[i] - p.place[i]) ** 2).sum()
        for k, j, sign in near:
            total += p.w[k] * ((y[i] - y[j] - sign * p.offset[k]) ** 2).sum()
        return total

    def constraints(y, p):
        for k, (i, j) in enumerate(p.links):
            yield f"link {i + 1} {j + 1}", ((y[i] - y[j]) ** 2).sum() <= p.length[k] ** 2
        for i in range(len(y)):
            yield f"bottom {i}", -y[i][1] <= 3.0
            yield f"right {i}", y[i][0] <= 4.0
            yield f"top {i}", y[i][1] <= 2.0
            yield f"left {i}", -y[i][0] <= 5.0
            yield f"disc {i}", ((y[i] - p.center) ** 2).sum() <= p.radius**2

    rng = np.random.default_rng(4)
    place, v = rng.normal(size=(count, 2)), np.array([1.0, 0.0, 0.0, 0.5, 0.0, 2.0])
    w, offset = rng.uniform(0.5, 2.0, len(edges)), rng.normal(size=(len(edges), 2))
    length, center, radius = rng.uniform(1.0, 3.0, len(links)), np.array([1.0, 0.5]), 3.5
    return (
        game(
            count, cost, constraints, dimension=2, edges=fixed(edges), links=fixed(links),
            place=place, v=v, w=w, offset=offset, length=length, center=center, radius=radius,
        ),
        formation_game(
            place, edges, v.tolist(),
            region_of(box=[[-5.0, -3.0], [4.0, 2.0]], center=center, radius=radius),
            edge_weight=w, desired_offset=offset, links=links, link_length=length,
        ),
    )  # fmt: skip


PAIRS = {
    "energy": energy,
    "velocity": velocity,
    "cournot": cournot,
    "osnr": osnr,
    "consensus": consensus,
    "platoon": platoon,
    "formation": formation,
}
