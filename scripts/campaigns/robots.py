"""Random runs of a shipped fleet of robots: starts, loads and noise of sensors drawn by seed.

A fleet is a shipped scenario with the draws of this file. Of each run it is told whether outputs
left their set or robots came too near or touched, and how far y was from y* at the end, as a share
of how far y* is from 0 at most. What did not arrive must say why.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from campaign import CRASHED, campaign, crash, parser

from gne_mj.registry import GAMES
from gne_mj.scenario import load_scenario
from gne_mj.starts import random_starts

ARRIVED = 0.02
GOOD = ("converged", "completed")
Row = dict[str, Any]
Tables = dict[str, Any]


@dataclass(frozen=True)
class Fleet:
    """How runs of a shipped scenario are drawn.

    Attributes:
        scenario: its name.
        start: fills its table ``initial``, of a generator and its tables.
        load: greatest force on each entry of an action, in N.
        noise: greatest error of a reading, in the output's unit; 0 where sensors read true. In
            mode implicit the drawn one is the scenario's margin, too.
        changes: of the scenario besides.
    """

    scenario: str
    start: Callable[[np.random.Generator, Tables], Tables]
    load: float = 0.0
    noise: float = 0.0
    changes: Mapping[str, Any] = field(default_factory=dict)


def speeds(rng: np.random.Generator, tables: Tables, share: float = 0.95) -> Tables:
    """Speeds within the bounds on gaps, whose steps along the line are uniform."""
    game = tables["game"]
    bounds = np.broadcast_to(game["gap_bound"], tables["agents"]["count"])
    gaps = rng.uniform(-share, share, len(bounds)) * bounds
    return {"action": (game["reference_velocity"] + np.cumsum(gaps)).tolist()}


def places(rng: np.random.Generator, tables: Tables) -> Tables:
    """Places in the region, at rest, at least 1.1 distances apart; half near where others go."""
    rest = np.array(tables["game"]["desired_place"])
    if rng.random() < 0.5:
        moved = rng.permutation(rest) + rng.normal(0.0, 0.1, rest.shape)
        return {"action": moved.tolist()}
    radius, apart = tables["game"]["region"]["radius"], 1.1 * tables["separation"]["distance"]
    points: list[np.ndarray] = []
    while len(points) < tables["agents"]["count"]:
        point = rng.uniform(-0.9 * radius, 0.9 * radius, rest.shape[1])
        near = any(np.linalg.norm(point - other) < apart for other in points)
        if np.linalg.norm(point) < 0.9 * radius and not near:
            points.append(point)
    return {"action": [point.tolist() for point in points]}


def velocities(rng: np.random.Generator, tables: Tables) -> Tables:
    """Velocities in space about the one to agree on, 50 to 95% of the way to the bounds."""
    game = GAMES[tables["game"]["type"]].model_validate(tables["game"])
    count = tables["agents"]["count"]
    middle = np.tile(tables["game"]["reference_velocity"], count)
    seed = int(rng.integers(2**31))
    (found,) = random_starts(game.game(count), middle, [seed], float(rng.uniform(0.5, 0.95)))
    return {"action": found.reshape(count, -1).tolist()}


def in_the_air(rng: np.random.Generator, tables: Tables) -> Tables:
    """Places in a ball above the floor, all 0.2 m more than the least distance apart."""
    numbers, apart = tables["game"]["parameters"], tables["separation"]["distance"] + 0.2
    middle, radius = np.array(numbers["middle"]), 0.95 * numbers["radius"]
    points: list[np.ndarray] = []
    while len(points) < tables["agents"]["count"]:
        point = middle + rng.uniform(-radius, radius, 3)
        inside = np.linalg.norm(point - middle) < radius and point[2] > numbers["lowest"] + 0.05
        if inside and all(np.linalg.norm(point - other) > apart for other in points):
            points.append(point)
    return {"action": [point.tolist() for point in points]}


FLEETS = {
    "cars": Fleet("cars", speeds, load=2.0, noise=0.005),
    # mode sampled knows no margins, and observes no loads
    "cars-sampled": Fleet(
        "cars",
        speeds,
        noise=0.02,
        changes={"controller.mode": "sampled", "controller.observer": 0.0},
    ),
    # agents that keep apart need sensors that read true
    "cars-apart": Fleet("cars-apart", places, load=1.0),
    "boats": Fleet("boats", places, load=3.0),
    "drones": Fleet("drones", velocities, load=0.3, noise=0.003),
    "drones-apart": Fleet("drones-apart", in_the_air, load=0.15),
    "mixed": Fleet("mixed", partial(speeds, share=0.6), load=0.2, noise=0.003),
}


def main() -> int:
    """Run, print the table; 1 if a run left its set, touched, or did not arrive and said no why."""
    options = parser("scripts/check-robots", __doc__, 500)
    options.add_argument("fleet", choices=[*FLEETS, "all"])
    given = options.parse_args()
    worst = 0
    for name in FLEETS if given.fleet == "all" else [given.fleet]:
        print(f"{name}:")
        worst |= campaign(given, partial(one, name), crashed, report, lambda row: bool(broken(row)))
    return worst


def crashed(index: int, error: Exception) -> Row:
    """What is not expected counts as broken."""
    return crash(index, error)


def drawn(fleet: Fleet, rng: np.random.Generator) -> Tables:
    """The changes of a fleet's scenario that make a run."""
    scenario = load_scenario(fleet.scenario, fleet.changes)
    ((name, _),) = scenario.systems.items()
    tables = scenario.model_dump(mode="json", exclude_unset=True)["systems"][name]
    faults: list[Tables] = []
    if fleet.load:
        agents = tables["agents"]["count"]
        faults = [
            {"type": "push", "agents": [agent + 1], "force": float(force)}
            for agent, force in enumerate(rng.uniform(-fleet.load, fleet.load, agents))
        ]
    margin: Tables = {}
    if fleet.noise:
        amplitude = float(rng.uniform(0.0, fleet.noise))
        faults.append({"type": "noise", "amplitude": amplitude})
        if tables["controller"]["mode"] == "implicit":
            margin = {f"systems.{name}.margin": {"noise": amplitude}}
    return {
        **fleet.changes,
        **margin,
        f"systems.{name}.initial": fleet.start(rng, tables),
        f"systems.{name}.faults": faults,
        "simulation.seed": int(rng.integers(2**31)),
    }


def one(name: str, seed: int, index: int) -> Row:
    """The row of a run of the fleet of a name."""
    fleet = FLEETS[name]
    rng = np.random.default_rng([seed, index])
    run = load_scenario(fleet.scenario, drawn(fleet, rng)).simulation_object().run()
    ((system, report),) = run.reports.items()
    rest = run[system]["equilibrium"].values
    away = float(np.max(np.abs(run[system]["action"].values[-1] - rest)))
    apart, contacts, held = (report.get(key) for key in ("separation", "contacts", "implicit"))
    held = held or {"solutions": 0, "not_accurate": 0, "periods_not_monotone": 0}
    return {
        "index": index, "kind": name, "status": report["status"],
        "message": report["message"], "away": away / float(np.max(np.abs(rest))),
        "contacts": contacts["count"] if contacts else 0,
        "too_near": apart["too_near"] if apart else 0,
        "least": apart["least_distance"] if apart else None,
        "settled": report["settling_time"], "accurate": held["solutions"] - held["not_accurate"],
        "solutions": held["solutions"], "not_monotone": held["periods_not_monotone"],
        "positions": report["positions"]["outside"] if report["positions"] else 0,
    }  # fmt: skip


def broken(row: Row) -> list[str]:
    """What a row shows that must not be."""
    if row["status"] == CRASHED:
        return [CRASHED]
    found = [] if row["status"] in GOOD else [row["status"]]
    found += [name for name in ("contacts", "too_near", "positions") if row[name]]
    silent = row["away"] > ARRIVED and ";" not in row["message"]
    return found + ["not told"] * (row["status"] in GOOD and silent)


def report(rows: list[Row]) -> tuple[list[str], int]:
    """A line of figures, those that did not arrive or are broken, and how many these are."""
    ran = [row for row in rows if row["status"] != CRASHED]
    wrong = [row for row in rows if broken(row)]
    lines = [
        "| runs | ended inside | contacts | too near | arrive | farthest (%) | least distance (m) |"
        " last settled (s) | solved accurately | not monotone |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    if ran:
        least = [row["least"] for row in ran if row["least"] is not None]
        settled = [row["settled"] for row in ran if row["settled"] is not None]
        cells = (
            len(ran), sum(row["status"] in GOOD for row in ran),
            sum(row["contacts"] for row in ran), sum(row["too_near"] > 0 for row in ran),
            sum(row["away"] <= ARRIVED for row in ran),
            f"{100.0 * max(row['away'] for row in ran):.3g}",
            f"{min(least):.5g}" if least else "", f"{max(settled, default=np.nan):.4g}",
            f"{sum(row['accurate'] for row in ran)} of {sum(row['solutions'] for row in ran)}",
            sum(row["not_monotone"] for row in ran),
        )  # fmt: skip
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    away = [row for row in ran if row["away"] > ARRIVED]
    lines += [f"{row['index']}: {row['away']:.3%} away: {row['message']}" for row in away[:20]]
    lines += [
        f"{row['index']}: {', '.join(broken(row))} {row.get('message')}" for row in wrong[:20]
    ]
    lines.append(f"broken: {len(wrong)} of {len(rows)}")
    return lines, len(wrong)


if __name__ == "__main__":
    sys.exit(main())
