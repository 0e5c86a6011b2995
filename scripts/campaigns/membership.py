"""Random runs in which agents leave and join: whether all stay inside, and V falls between changes.

Unequal robots or integrators that follow each other, under full information, partial information
(with 1.02 to 5 times the gain that is certified for the worst set of agents) or in mode implicit,
and optical channels under fully distributed information. One to eight changes at random times; who
joins announces an output that may be outside, and is not admitted then; some try again.
"""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from campaign import by_kind, campaign, crash, parser
from kinds import log_uniform
from networks import random_graph

from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.graph import complete
from gne_mj.membership import Change, Membership
from gne_mj.plants import flexible_robot, integrator, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.run_metrics import SUCCESSES
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.system.steps import largest_step
from gne_mj.theory import Theorem

DURATION, UNIT, V0 = 5.0, 0.01, 3.0  # s; changes are made after multiples of the unit; m/s
# Where channels join within 1e-3 of the limit, estimates are too fast for any step
ENDED = (*SUCCESSES, "step_too_small")
ATTEMPTS = 200  # to draw changes that leave a connected graph and a constraint
KINDS = ("robots, full", "robots, partial", "integrators, partial", "robots, implicit", "channels")


def main() -> int:
    """Run them all; 1 if one has broken a promise."""
    options = parser("scripts/check-membership", __doc__, 500).parse_args()
    return campaign(options, one, crash, report, lambda row: bool(broken(row)))


def drawn_changes(rng: np.random.Generator, outputs: np.ndarray, reach: np.ndarray) -> Any:
    """One to eight changes; who joins announces an output about those of the start."""
    count, there = len(outputs), np.ones(len(outputs), dtype=bool)
    times = UNIT * np.sort(rng.choice(np.arange(1, 490), rng.integers(1, 9), replace=False))
    for agent in rng.permutation(count)[: rng.integers(0, 2)]:  # who is away at the start
        there[agent] = False
    changes = []
    for time in times:
        leaves = [i for i in np.flatnonzero(there).tolist() if rng.random() < 1.2 / count]
        joins = [i for i in np.flatnonzero(~there).tolist() if rng.random() < 0.6]
        if not leaves and not joins:
            continue
        action = outputs[joins] + reach[joins] * rng.uniform(-1.0, 1.0, len(joins))
        retry = 0.1 if rng.random() < 0.3 else 0.0
        changes.append(Change(float(time), tuple(leaves), tuple(joins), action, retry))
        there[leaves], there[joins] = False, True
    return tuple(changes)


def following(rng: np.random.Generator, kind: str) -> tuple[System, np.ndarray]:
    """Robots or integrators that follow each other, and how far outputs of who joins vary."""
    count = int(rng.integers(3, 9))
    delta, numbers = log_uniform(rng, 1.0, 5.0, count), np.zeros((count, 0))
    if "robots" in kind:
        numbers = np.column_stack([log_uniform(rng, 0.3, 3.0, count) for _ in range(5)])
    plant = flexible_robot if "robots" in kind else integrator
    agents = Agents(plant, numbers, np.full(count, np.inf))
    share = 1.0 - float(log_uniform(rng, 1e-2, 1.0, 1)[0])
    y = V0 + np.cumsum(rng.uniform(-share, share, count) * delta)
    law: Any = FullInformation()
    if "partial" in kind:
        graph = complete(count) if rng.random() < 0.3 else random_graph(rng, count)
        law = PartialInformation(graph, time_constant=float(log_uniform(rng, 0.05, 1.0)))
    mode = "implicit" if "implicit" in kind else "continuous"
    system = System(
        "players", velocity_game(count, V0, delta), agents, law,
        float(log_uniform(rng, 1e-2, 1.0)), agents.equilibrium(y), mode=mode,
        integrator="euler" if mode == "implicit" else "rk4",
    )  # fmt: skip
    return system, 1.5 * delta


def channels(rng: np.random.Generator) -> tuple[System, np.ndarray]:
    """Ten channels that share a power, and how far powers of who joins vary."""
    game = osnr_game(**ten_channels())
    agents = Agents(pi_cascade, np.tile([1.0, 0.5], (10, 1)), np.full(10, np.inf))
    limit = ten_channels()["total_power_limit"]
    y = rng.uniform(0.2, 0.6) * limit * rng.dirichlet(np.full(10, 3.0))
    law = FullyDistributed(complete(10), epsilon=float(log_uniform(rng, 5e-4, 2e-3)))
    rho = float(log_uniform(rng, 0.3, 1.0))  # of which so small an epsilon does
    return System("players", game, agents, law, rho, agents.equilibrium(y)), 1.2 * y


def drawn(seed: int, index: int) -> tuple[System, Clock]:
    """The system of a seed and an index, with changes that can be made."""
    rng, kind = np.random.default_rng([seed, index]), KINDS[index % len(KINDS)]
    system, reach = channels(rng) if kind == "channels" else following(rng, kind)
    away = 0.0 if kind == "channels" else V0
    keeps = frozenset({"total power"} if kind == "channels" else ())
    for _ in range(ATTEMPTS):
        changes = drawn_changes(rng, system.start, reach)
        membership = Membership(changes, np.full(len(reach), away), keeps)
        try:
            found = replace(system, membership=membership)
        except InvalidInput:  # nobody is left, or a graph falls apart
            continue
        if changes:
            break
    if "partial" in kind:
        needed = []
        for _, there in membership.intervals(len(reach)):
            coupling = Theorem(found.among(there, found.start).system).coupling
            assert coupling is not None
            least = None if coupling.quadratic is None else coupling.quadratic.least
            needed.append(0.0 if least is None else least)  # of one agent none is needed
        gain = float(max(*needed, 1e-3) * log_uniform(rng, 1.02, 5.0))
        found = replace(found, law=replace(found.law, coupling=gain), memory=np.zeros(0))
    h = 2e-3
    while h > 0.9 * largest_step(found):
        h *= 0.5
    return found, Clock(DURATION, h, UNIT if "implicit" in kind else h, 0.05)


def outside(system: System, y: np.ndarray) -> int:
    """At how many samples (samples, m) a constraint of those present is violated, by formulas."""
    if system.game.name == "OSNR":
        total = np.nansum(y, axis=1) >= ten_channels()["total_power_limit"]
        return int(np.sum(total | np.any(y <= 0.0, axis=1)))
    before = np.column_stack([np.full(len(y), V0), y[:, :-1]])
    assert system.game.gap_bounds is not None
    return int(np.sum(np.any(np.abs(y - before) >= system.game.gap_bounds, axis=1)))


def planned(system: System, seen: dict[str, Any]) -> bool:
    """Whether all sets of agents that were there are those of a run in which all are admitted."""
    assert system.membership is not None
    sets = {tuple(there.tolist()) for _, there in system.membership.intervals(system.game.agents)}
    every = range(1, system.game.agents + 1)
    ever = [seen["at_start"], *(change["there"] for change in seen["changes"])]
    return all(tuple(i in there for i in every) in sets for there in ever)


def one(seed: int, index: int) -> dict[str, Any]:
    """Draw a system and run it."""
    system, clock = drawn(seed, index)
    trajectory = Simulation([system], clock).run()
    seen, v = trajectory.reports["players"], trajectory.reports["players"]["lyapunov"]
    y = trajectory["players"]["action"].to_numpy()
    changes = seen["membership"]["changes"]
    refused = [each for each in changes if not each["done"]]
    there = changes[-1]["there"] if changes else seen["membership"]["at_start"]
    return {
        "index": index, "kind": KINDS[index % len(KINDS)], "status": seen["status"],
        "agents": len(y[0]), "changes": len(changes) - len(refused), "refused": len(refused),
        "violated": outside(system, y),
        "unfounded": sum((each["value"] or 0.0) < 0.0 for each in refused),
        "apart": sum(each["constraint"] is None for each in refused),
        "miscounted": (1 + np.flatnonzero(np.isfinite(y[-1]))).tolist() != there,
        # who is not admitted leaves a set of agents for which no gain was drawn
        "claimed": v["claimed"] or not planned(system, seen["membership"]),
        "monotone": v["monotone"],
        "rise": v["largest_rise"] / v["start"] if v["start"] else 0.0,
    }  # fmt: skip


def broken(row: dict[str, Any]) -> list[str]:
    """Which promises a run has broken."""
    if row["status"] not in ENDED:
        return [row.get("message", row["status"])]
    found = [name for name in ("violated", "unfounded", "miscounted") if row[name]]
    if row["kind"] in KINDS[:3]:  # of the others V is not claimed
        found += [name for name in ("claimed", "monotone") if not row[name]]
    return found


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """A Markdown table by kind, the broken ones, and how many these are."""
    lines = [
        "| | runs | changes made | not admitted | impossible | ended outside | step too small |"
        " V not claimed | V rose | greatest rise over V(0) |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for kind, own in by_kind(rows, KINDS):
        of_v = [row for row in own if row["kind"] in KINDS[:3]]
        cells = (
            kind, len(own), sum(row["changes"] for row in own),
            sum(row["refused"] - row["apart"] for row in own), sum(row["apart"] for row in own),
            sum(row["status"] not in ENDED or row["violated"] > 0 for row in own),
            sum(row["status"] == "step_too_small" for row in own),
            sum(not row["claimed"] for row in of_v) if of_v else "-",
            sum(not row["monotone"] for row in of_v) if of_v else "-",
            f"{max(row['rise'] for row in of_v):.1e}" if of_v else "-",
        )  # fmt: skip
        lines.append(f"| {' | '.join(map(str, cells))} |")
    bad = [row for row in rows if broken(row)]
    lines += [f"broken: {row['index']} {', '.join(broken(row))}" for row in bad]
    return lines, len(bad)


if __name__ == "__main__":
    sys.exit(main())
