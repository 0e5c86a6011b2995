"""Random swaps and herds in MuJoCo, contacts on: whether robots keep apart, touch, and arrive.

Unequal robots, kicked. Of 11 runs 10 are swaps of 8 or 16 robots (from a circle to the opposite
side, or from anywhere to anywhere), one is the herd of the shipped scenario, turned and moved at
random. Of five one is in mode continuous. Distances are looked at in the recorded states of every
integration step, by a formula of this file. What did not arrive must be told as held.
"""

import sys
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from campaign import CRASHED, by_kind, campaign, crash, parser
from kinds import log_uniform

from gne_mj.controllers import FullInformation
from gne_mj.errors import InfeasibleStart
from gne_mj.game_model import Game
from gne_mj.games import formation_game, region_of
from gne_mj.loops import monitor as watch
from gne_mj.plants import position_robot
from gne_mj.plants.agents import Agents
from gne_mj.run_metrics import EXITS
from gne_mj.scenario import load_scenario
from gne_mj.separation import Separation
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System

DISTANCE, TAU, RHO, ARRIVED = 0.6, 0.5, 0.05, 1e-2
LONGEST = 90.0  # s
KINDS = ("circle of 8", "circle of 16", "anywhere, 8", "anywhere, 16", "herd of 30")


@dataclass
class Draw:
    """A game and where its robots begin.

    Attributes:
        kind: one of KINDS.
        place, start: (N, 2) where robots want to be and where they begin, in m.
        velocity: (N, 2) in m/s, at the start.
        masses: (N, 2) of main masses and appendages, in kg.
        reach: of the separation, in m.
        continuous: whether in mode continuous.
        period: control period in s, one Euler step, where it is not.
    """

    kind: str
    place: np.ndarray
    start: np.ndarray
    velocity: np.ndarray
    masses: np.ndarray
    reach: float
    continuous: bool
    period: float = 0.01


def main() -> int:
    """Run, print the tables; 1 if robots were too near or touched, or a deadlock was not told."""
    options = parser("scripts/check-separation", __doc__, 2200)
    options.add_argument("--search", type=int, help="rounds of a search for a slowest swap of 8")
    options.add_argument(
        "--hard", action="store_true",
        help="mode implicit only: periods of up to 0.1 s, harder kicks, two robots just apart",
    )  # fmt: skip
    given = options.parse_args()
    if given.search:
        return search(given.seed, given.search)
    runs = hard_one if given.hard else one
    return campaign(
        given, runs, crashed, report, lambda row: bool(broken(row)) or not row["arrived"]
    )


def crashed(index: int, error: Exception) -> dict[str, Any]:
    """What is not expected counts as broken."""
    return crash(index, error, arrived=False)


def scattered(rng: np.random.Generator, count: int, radius: float, apart: float) -> np.ndarray:
    """(count, 2) points in a disc, at least so far apart."""
    points: list[np.ndarray] = []
    while len(points) < count:
        point = rng.uniform(-radius, radius, 2)
        if np.hypot(*point) < radius and all(np.hypot(*(point - p)) > apart for p in points):
            points.append(point)
    return np.array(points)


def drawn(seed: int, index: int) -> Draw:
    """The draw of a seed and an index."""
    rng = np.random.default_rng([seed, index])
    kind = KINDS[4] if index % 11 == 10 else KINDS[index % 11 % 4]
    reach = float(rng.uniform(1.1, 1.8))
    if kind == KINDS[4]:
        reach, (place, start) = float(rng.uniform(0.9, 1.15)), turned_herd(rng)
    elif kind.startswith("circle"):
        count = int(kind.split()[-1])
        radius = (3.0 if count == 8 else 5.0) * rng.uniform(0.9, 1.1)
        angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.05, 0.05, count)) / count
        start = radius * np.column_stack([np.cos(angle), np.sin(angle)])
        place = -start
        start = start + rng.normal(0.0, 0.05, start.shape) * rng.integers(2)
    else:
        count = int(kind.split()[-1])
        radius = 4.0 if count == 8 else 6.0
        place, start = (scattered(rng, count, radius, gap) for gap in (reach, 1.2 * DISTANCE))
    velocity = rng.normal(0.0, rng.choice([0.0, 0.1, 1.0]), start.shape)
    masses = np.column_stack([log_uniform(rng, 0.7, 1.5, len(start)),
                              log_uniform(rng, 0.1, 0.6, len(start))])  # fmt: skip
    return Draw(kind, place, start, velocity, masses, reach, index % 5 == 4)


def hardened(draw: Draw, rng: np.random.Generator) -> Draw:
    """Two robots begin a millionth more than the distance apart; a long period, hard kicks."""
    start = draw.start.copy()
    i = int(rng.integers(len(start) - 1))
    j = i + 1  # linked with it in the herd
    way = start[j] - start[i]
    start[j] = start[i] + (1.0 + 1e-6) * DISTANCE * way / np.hypot(*way)
    if least_distance(start.reshape(1, -1)) <= DISTANCE:  # on top of a third one
        start = draw.start
    kick = draw.velocity * rng.choice([1.0, 10.0])
    period = float(rng.choice([0.02, 0.05, 0.1]))
    return replace(draw, start=start, velocity=kick, continuous=False, period=period)


def turned_herd(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Places of the shipped herd, and where it begins: turned and moved."""
    place = np.array(herd_table().desired_place)
    angle = rng.uniform(-np.pi, np.pi)
    c, s = np.cos(angle), np.sin(angle)
    return place, place @ np.array([[c, s], [-s, c]]) + rng.uniform(-1.5, 1.5, 2)


def herd_table() -> Any:
    """The game's table of the shipped herd."""
    return load_scenario("herd").systems["robots"].game


def game_of(draw: Draw) -> Game:
    """Each wants its own place; of the herd neighbours' places as well, and a chain of links."""
    if draw.kind == KINDS[4]:
        return herd_table().build(len(draw.place))
    weight = np.ones(len(draw.place))
    return formation_game(draw.place, [], weight, region_of(radius=10.0), links=[])


def system_of(draw: Draw) -> System:
    """In MuJoCo, contacts on; robots whose kicks would bring them too near are kicked less."""
    table = np.repeat(draw.masses, 2, axis=0)
    rest = np.tile([2.0, 1.0, 1.0, TAU, 0.0, 0.0], (len(table), 1))
    table = np.column_stack([table, rest])
    table[:, 6] = 1.2 * position_robot.least_damping(table)
    agents = Agents(position_robot, table, np.full(len(table), np.inf), 2, True)
    q, velocity = draw.start.ravel(), draw.velocity.ravel()
    while True:
        state = np.column_stack([0.0 * q, q + TAU * velocity, velocity, q])
        try:
            return System(
                "robots", game_of(draw), agents, FullInformation(), RHO, state,
                mode="continuous" if draw.continuous else "implicit", engine="mujoco",
                integrator="rk4" if draw.continuous else "euler",
                separation=Separation(DISTANCE, draw.reach),
            )  # fmt: skip
        except InfeasibleStart:
            if not np.any(velocity):
                raise
            velocity = 0.5 * velocity * (np.abs(velocity) > 1e-6)


def least_distance(q: np.ndarray) -> float:
    """Of any two agents at any of the rows (T, m), in m."""
    points = q.reshape(len(q), -1, 2)
    i, j = np.triu_indices(points.shape[1], 1)
    return float(np.sqrt(np.min(np.sum((points[:, i] - points[:, j]) ** 2, axis=2))))


def run(draw: Draw) -> dict[str, Any]:
    """Plain numbers and strings of a run, until robots have arrived for 5 s or time is up."""
    system = system_of(draw)
    h = 0.005 if draw.continuous else draw.period
    loop, piece = system.closed_loop(Clock(LONGEST, h, h, h)), round(5.0 / h)
    least, late, monitor = np.inf, 0.0, loop.monitor
    while loop.time < LONGEST - 1e-9 and monitor.exit == watch.INSIDE:
        begun, recorded = loop.time, loop.advance(piece, 1)
        least = min(least, least_distance(recorded.state[:, :, position_robot.POSITION]))
        away = np.max(np.abs(recorded.state[:, :, position_robot.OUTPUT] - system.centre), axis=1)
        if not np.any(away > ARRIVED):
            break
        late = begun + h * (1 + int(np.flatnonzero(away > ARRIVED)[-1]))
    least = min(least, least_distance(loop.finish().state[:, :, position_robot.POSITION]))
    arrived = monitor.exit == watch.INSIDE and late < loop.time - 1.0
    return {
        "kind": draw.kind, "mode": system.mode, "status": EXITS.get(int(monitor.exit), "inside"),
        "least": least, "told_least": float(monitor.least_distance),
        "too_near": int(monitor.too_near) + (least < DISTANCE), "contacts": int(monitor.contacts),
        "outside": int(monitor.positions_outside), "most_pairs": int(monitor.most_pairs),
        "arrived": bool(arrived), "time": late,
    }  # fmt: skip


def told(draw: Draw) -> str:
    """What a whole run that does not arrive says of itself."""
    h = 0.005 if draw.continuous else draw.period
    found = Simulation([system_of(draw)], Clock(LONGEST, h, h, 0.05), tolerance=ARRIVED).run()
    return str(found.reports["robots"]["message"])


def one(seed: int, index: int) -> dict[str, Any]:
    """Draw a system and run it."""
    return judged(index, drawn(seed, index))


def hard_one(seed: int, index: int) -> dict[str, Any]:
    """The same, made harder."""
    return judged(index, hardened(drawn(seed, index), np.random.default_rng([seed, index, 1])))


def judged(index: int, draw: Draw) -> dict[str, Any]:
    """A run's row, with what it says of itself if it does not arrive."""
    row = {"index": index, **run(draw)}
    if row["status"] == "inside" and not row["arrived"]:
        row["message"] = told(draw)
    return row


def broken(row: dict[str, Any]) -> list[str]:
    """Which promises a run has broken."""
    if row["status"] == CRASHED:
        return [CRASHED]
    found = [name for name in ("too_near", "contacts", "outside") if row[name]]
    found += [] if row["status"] == "inside" else [row["status"]]
    silent = row["status"] == "inside" and not row["arrived"]
    return found + ["not told"] * (silent and "held by the separation" not in row["message"])


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """A Markdown table by kind, the hardest runs, the broken ones, and how many these are."""
    lines = [
        "| | runs | least distance (m) | too near | contacts | arrive | held |"
        " median, last arrival (s) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind, own in by_kind(rows, KINDS):
        times = [row["time"] for row in own if row["arrived"]] or [np.nan]
        held = sum("held by" in row.get("message", "") for row in own)
        cells = (
            kind, len(own), f"{min(row['least'] for row in own):.6f}",
            sum(row["too_near"] for row in own), sum(row["contacts"] for row in own),
            f"{sum(row['arrived'] for row in own) / len(own):.2%}", held,
            f"{np.median(times):.1f}, {max(times):.1f}",
        )  # fmt: skip
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    ran = [row for row in rows if row["status"] != CRASHED]
    slow = sorted((row for row in ran if row["arrived"]), key=lambda row: -row["time"])[:3]
    lines += ["", *(f"late: {row}" for row in slow)]
    lines += [f"held: {row}" for row in ran if not row["arrived"]][:20]
    wrong = [row for row in rows if broken(row)]
    lines += ["", *(f"{row['index']}: {', '.join(broken(row))} {row}" for row in wrong[:20])]
    lines.append(f"broken: {len(wrong)} of {len(rows)}")
    return lines, len(wrong)


def search(seed: int, rounds: int) -> int:
    """Change a swap of 8 a little again and again, and keep what takes longer; 1 if one breaks."""
    rng = np.random.default_rng(seed)
    best, hardest = drawn(seed, 0), -1.0
    for number in range(rounds):
        size = float(log_uniform(rng, 0.01, 1.0))
        start, place = (
            points + size * rng.normal(0.0, 0.3, points.shape) * rng.integers(0, 2, (8, 1))
            for points in (best.start, best.place)
        )
        gaps = [least_distance(points.reshape(1, -1)) for points in (start, place)]
        if not (gaps[0] > 1.05 * DISTANCE and gaps[1] > best.reach):
            continue
        draw = replace(best, start=start, place=place, continuous=False)
        row = run(draw)
        if row["status"] != "inside" or row["too_near"] or row["contacts"]:
            print(f"broken: {row} {draw}")
            return 1
        took = row["time"] if row["arrived"] else LONGEST
        if took > hardest:
            best, hardest = draw, took
            print(f"{number}: {took:.2f} s, {row}")
        if not row["arrived"]:
            print(f"held: {told(draw)}\n{draw}")
            return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
