"""Random platoons and formations in MuJoCo: whether positions leave their set, and robots touch.

Unequal robots start near bounds in position and output, their appendages flying off. Positions are
looked at in the recorded states of every integration step, by formulas of this file. Half of the
runs are in mode continuous, the others in mode implicit with one Euler step a period. Robots of
platoons collide, and those of a part of the formations, which keep apart.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from campaign import CRASHED, campaign, crash, parser
from draws import towards_bound
from kinds import log_uniform

from gne_mj.controllers import FullInformation
from gne_mj.game_model import Game
from gne_mj.games import formation_game, platoon_game, region_of
from gne_mj.loops import monitor as watch
from gne_mj.loops.division import PIECES
from gne_mj.plants import position_robot
from gne_mj.plants.agents import Agents
from gne_mj.run_metrics import EXITS
from gne_mj.separation import Separation
from gne_mj.system import Clock, System

CLOSEST = 1e-6  # of the way to a bound
SHORTEST = 1e-7  # s, of a step
LENGTH = 0.54  # m, of a robot in the lane: what a platoon's spacings must exceed
DISTANCE, REACH = 0.6, 1.2  # m, of robots that keep apart
TRIES = 40  # draws of a start at which they are so
KINDS, MODES = ("platoon", "formation", "formation, apart"), ("continuous", "implicit")
GIVEN_UP = EXITS[watch.STEP_TOO_SMALL]


@dataclass
class Place:
    """A game, a profile well inside, and its constraints in plain NumPy.

    Attributes:
        values: maps profiles (T, m) to (T, constraints), negative inside.
    """

    game: Game
    middle: np.ndarray
    values: Callable[[np.ndarray], np.ndarray]


def main() -> int:
    """Run, print the tables; 1 if a position was outside, or robots that should not touched."""
    given = parser("scripts/check-positions", __doc__, 20_000).parse_args()
    return campaign(given, one, crashed, report, lambda row: bool(broken(row)))


def crashed(index: int, error: Exception) -> dict[str, Any]:
    """What is not expected counts as broken."""
    return crash(index, error, mode="any", observed=0)


def platoon(rng: np.random.Generator) -> Place:
    """Two to eight robots, each with wishes of its own."""
    count = int(rng.integers(2, 9))
    lower = rng.uniform(LENGTH + 0.01, 1.5, count - 1)
    upper = lower + log_uniform(rng, 0.1, 3.0, count - 1)
    ends = (-rng.uniform(0.5, 5.0), rng.uniform(0.5, 5.0))
    place = rng.uniform(0.0, 2.0, count) * (rng.random(count) < 0.5)
    place[0] = rng.uniform(0.2, 2.0)
    own = np.zeros(count)
    for i in range(1, count):  # with which F is strongly monotone
        own[i] = rng.uniform(0.1, 1.0) * (own[i - 1] + 2 * place[i - 1])
    game = platoon_game(
        count, lower, upper, desired_spacing=rng.uniform(0.0, 4.0, count - 1),
        spacing_weight=own[1:], desired_place=rng.uniform(-9.0, 9.0, count), place_weight=place,
        leader_range=ends,
    )  # fmt: skip
    low, high = np.append(ends[0], lower), np.append(ends[1], upper)

    def values(y: np.ndarray) -> np.ndarray:
        bounded = np.column_stack([y[:, 0], y[:, :-1] - y[:, 1:]])
        return np.concatenate([low - bounded, bounded - high], axis=1)

    middle = 0.5 * sum(ends) - np.cumsum(np.append(0.0, 0.5 * (lower + upper)))
    return Place(game, middle, values)


def formation(rng: np.random.Generator) -> Place:
    """Two to six robots, links between some of them, in a disc and a quadrangle."""
    count = int(rng.integers(2, 7))
    pairs = [(int(rng.integers(i)), i) for i in range(1, count)]
    links = [pair for pair in pairs if rng.random() < 0.7]
    length = rng.uniform(0.8, 3.0, len(links))
    angle = 0.5 * np.pi * (np.arange(4) + rng.uniform(0.1, 0.9, 4))
    corners = rng.uniform(2.0, 5.0) * np.column_stack([np.cos(angle), np.sin(angle)])
    radius = float(rng.uniform(2.0, 5.0))
    weight = rng.uniform(0.0, 2.0, count) * (rng.random(count) < 0.4)
    weight[0] = rng.uniform(0.2, 2.0)
    game = formation_game(
        rng.uniform(-4.0, 4.0, (count, 2)), pairs, weight,
        region_of(vertices=corners, radius=radius),
        edge_weight=rng.uniform(0.2, 3.0, len(pairs)), links=links, link_length=length,
    )  # fmt: skip
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    offset = np.sum(outward * corners, axis=1)

    def values(y: np.ndarray) -> np.ndarray:
        points = y.reshape(len(y), -1, 2)
        apart = [np.linalg.norm(points[:, i] - points[:, j], axis=1) for i, j in links]
        sides = (points @ outward.T - offset).reshape(len(y), -1)
        disc = np.linalg.norm(points, axis=2) - radius
        return np.column_stack([*(d - r for d, r in zip(apart, length, strict=True)), sides, disc])

    at = 0.05 * np.column_stack([np.cos(np.arange(count)), np.sin(np.arange(count))])
    return Place(game, at.ravel(), values)


def robots(rng: np.random.Generator, game: Game, contacts: bool) -> Agents:
    """Unequal robots, damped from just above the least on."""
    axes = game.sizes[0]
    table = log_uniform(rng, 0.3, 3.0, (game.agents, 5))
    table[:, 3] *= rng.random(game.agents) < 0.8
    table = np.repeat(table, axes, axis=0)
    tau = np.full(len(table), rng.uniform(0.2, 1.0))
    reference = np.tile(rng.uniform(-5.0, 5.0, axes), game.agents)
    table = np.column_stack([table, tau, np.zeros(len(table)), reference])
    share = np.repeat(log_uniform(rng, 1.01, 3.0, game.agents), axes)
    table[:, 6] = share * position_robot.least_damping(table)
    return Agents(position_robot, table, np.full(len(table), np.inf), axes, contacts)


def start(
    rng: np.random.Generator, place: Place, agents: Agents, margins: tuple[float, float]
) -> np.ndarray:
    """States whose outputs and positions leave these shares of the way to a bound."""
    y, q = (towards_bound(rng, place.game, place.middle, margin) for margin in margins)
    m, tau = place.game.actions, agents.parameters[:, position_robot.LOOKAHEAD]
    hard = log_uniform(rng, 0.1, 20.0)
    w = (y - q) / tau + hard * rng.uniform(-1.0, 1.0, m)
    return np.column_stack([0.2 * hard * rng.uniform(-1.0, 1.0, m), y, w, q])


def start_apart(
    rng: np.random.Generator, place: Place, agents: Agents, margins: tuple[float, float]
) -> np.ndarray | None:
    """The same, so that no two are too near on their ways; None where none was drawn."""
    rule, found = Separation(DISTANCE, REACH), None
    for _ in range(TRIES):
        state = start(rng, place, agents, margins)
        q, y = state[:, position_robot.POSITION], state[:, position_robot.OUTPUT]
        each = (-1, agents.dimension)
        if rule.nearest(q.reshape(each), y.reshape(each))[2] > DISTANCE:
            found = state
            break
    return found


def step(rng: np.random.Generator, agents: Agents) -> float:
    """Some part of the shortest time constant of the robots by themselves, in s."""
    main, appendage, stiffness, atan, gamma, _, damping, _ = agents.parameters.T
    lighter = np.minimum(main, appendage)
    fastest = (damping + gamma) / main + gamma / appendage + np.sqrt((stiffness + atan) / lighter)
    return float(rng.uniform(0.02, 0.5) / np.max(fastest))


def stiff_step(agents: Agents, rho: float, away: float) -> float:
    """Of which the finest piece is a tenth of the barrier's time constant so far from a bound."""
    main, tau = agents.parameters[:, 0], agents.parameters[:, position_robot.LOOKAHEAD]
    return 0.1 * PIECES * float(np.min(main / tau)) * away**2 / rho


def one(seed: int, index: int) -> dict[str, Any]:
    """Draw a system and run it: plain numbers and strings."""
    rng = np.random.default_rng([seed, index])
    kind, mode = KINDS[index % 2], MODES[index // 2 % 2]
    place = (platoon if kind == "platoon" else formation)(rng)
    agents = robots(rng, place.game, contacts=kind == "platoon")
    margins = tuple(float(log_uniform(rng, CLOSEST, 0.5)) for _ in range(2))
    state = start(rng, place, agents, margins)
    separation = None
    if kind == "formation" and index // 4 % 2:
        drawn = start_apart(np.random.default_rng([seed, index, 1]), place, agents, margins)
        if drawn is not None:
            kind, state, separation = KINDS[2], drawn, Separation(DISTANCE, REACH)
            agents = replace(agents, contacts=True)
    rho, continuous = float(log_uniform(rng, 3e-3, 1.0)), mode == "continuous"
    h, steps = step(rng, agents), int(rng.integers(100, 400 if continuous else 1200))
    if continuous:  # whose pieces of steps have an end, and the barrier is stiff near a bound
        nearest = float(np.min(-place.values(state[None, :, position_robot.OUTPUT])))
        h = min(h, max(stiff_step(agents, rho, nearest), SHORTEST))
    system = System(
        "robots", place.game, agents, FullInformation(), rho, state, mode=mode, engine="mujoco",
        integrator="rk4" if continuous else "euler", separation=separation,
    )  # fmt: skip
    loop = system.closed_loop(Clock(h * steps, h, h, h))
    recorded = loop.advance(steps, 1)
    states, monitor = np.concatenate([recorded.state, loop.finish().state]), loop.monitor
    y, q = (states[:, :, at] for at in (position_robot.OUTPUT, position_robot.POSITION))
    least = -np.max(place.values(q), axis=1)
    return {
        "index": index, "kind": kind, "mode": mode, "agents": place.game.agents, "rho": rho,
        "timestep": h, "margin": margins[0], "position_margin": margins[1],
        "status": EXITS.get(int(monitor.exit), "inside"), "observed": int(monitor.positions),
        "told_outside": int(monitor.positions_outside), "outside": int(np.sum(~(least >= 0.0))),
        "outputs_outside": int(np.sum(~np.all(place.values(y) < 0.0, axis=1))),
        "least": float(np.min(least)), "contacts": int(monitor.contacts),
    }  # fmt: skip


def broken(row: dict[str, Any]) -> list[str]:
    """Which promises a run has broken."""
    if row["status"] == CRASHED:
        return [CRASHED]
    names = ("outside", "told_outside", "outputs_outside", "contacts")
    found = [name for name in names if row[name]]
    return found + ([] if row["status"] in ("inside", GIVEN_UP) else [row["status"]])


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """A Markdown table by kind and mode, the broken runs, and how many these are."""
    lines = [
        "| kind | mode | runs | observations | positions outside | least margin (m) |"
        " outputs outside | contacts | step too small |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    ran = [row for row in rows if row["status"] != CRASHED]
    for kind, mode in [*((kind, mode) for kind in KINDS for mode in MODES), ("all", "all")]:
        own = [
            row for row in ran if kind in (row["kind"], "all") and mode in (row["mode"], "all")
        ]  # fmt: skip
        sums = {key: sum(row[key] for row in own) for key in
                ("observed", "outside", "outputs_outside", "contacts")}  # fmt: skip
        least = min((row["least"] for row in own), default=np.nan)
        given_up = sum(row["status"] == GIVEN_UP for row in own)
        touched = "-" if kind == "formation" else sums["contacts"]
        cells = (kind, mode, len(own), sums["observed"], sums["outside"], f"{least:.2g}",
                 sums["outputs_outside"], touched, given_up)  # fmt: skip
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    wrong = [row for row in rows if broken(row)]
    lines += ["", *(f"{row['index']}: {', '.join(broken(row))} {row}" for row in wrong[:20])]
    lines.append(f"broken: {len(wrong)} of {len(rows)}")
    return lines, len(wrong)


if __name__ == "__main__":
    sys.exit(main())
