"""Random runs over graphs that switch: whether V falls and all stay inside.

Unequal robots or integrators under partial information, mode continuous. The graphs are ring, line
and complete, or two to four random connected ones; each is there for 2 ms to 5 s, in order or at
random. The gain is 1.02 to 5 times the least that is certified for the worst of them.
"""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from campaign import by_kind, campaign, crash, parser
from kinds import log_uniform

from gne_mj.changing_graph import SwitchingGraph, switching
from gne_mj.controllers import PartialInformation
from gne_mj.games import velocity_game
from gne_mj.graph import Graph, complete, line, ring
from gne_mj.plants import flexible_robot, integrator
from gne_mj.plants.agents import Agents
from gne_mj.run_metrics import SUCCESSES
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.system.steps import largest_step
from gne_mj.theory import Theorem

DURATION, UNIT = 5.0, 2e-3  # s; graphs change after multiples of the unit
KINDS = ("robots", "integrators")


def main() -> int:
    """Run them all; 1 if one has broken a promise."""
    options = parser("scripts/check-networks", __doc__, 1000).parse_args()
    return campaign(options, one, crash, report, lambda row: bool(broken(row)))


def random_graph(rng: np.random.Generator, count: int) -> Graph:
    """Connected; a random tree with some edges more."""
    order = rng.permutation(count)
    edges = [(int(order[k]), int(order[rng.integers(k)])) for k in range(1, count)]
    pairs = [(i, j) for i in range(count) for j in range(i)]
    more = [pair for pair in pairs if rng.random() < rng.choice([0.0, 0.2, 0.6])]
    return Graph(count, (*edges, *more))


def drawn_graph(rng: np.random.Generator, count: int) -> SwitchingGraph:
    """Its members, times and order."""
    if rng.random() < 0.3:
        graphs = [ring(count), line(count), complete(count)]
    else:
        graphs = [random_graph(rng, count) for _ in range(rng.integers(2, 5))]
    times = UNIT * np.ceil(log_uniform(rng, UNIT, 5.0, len(graphs)) / UNIT)
    if rng.random() < 0.4:
        return switching(graphs, float(times[0]), random=True)
    return switching(graphs, times.tolist())


def drawn(seed: int, index: int) -> tuple[System, Clock]:
    """The system of a seed and an index, with a gain that is certified."""
    rng = np.random.default_rng([seed, index])
    count, kind = int(rng.integers(3, 9)), KINDS[index % 2]
    delta = log_uniform(rng, 1.0, 5.0, count)
    if kind == "robots":
        table = np.column_stack([log_uniform(rng, 0.3, 3.0, count) for _ in range(5)])
        agents = Agents(flexible_robot, table, np.full(count, np.inf))
    else:
        agents = Agents(integrator, np.zeros((count, 0)), np.full(count, np.inf))
    share = 1.0 - float(log_uniform(rng, 1e-2, 1.0, 1)[0])
    y = 3.0 + np.cumsum(rng.uniform(-share, share, count) * delta)
    tau, rho = log_uniform(rng, 0.05, 1.0, 1)[0], log_uniform(rng, 1e-2, 1.0, 1)[0]
    law = PartialInformation(drawn_graph(rng, count), time_constant=float(tau))
    game, state = velocity_game(count, 3.0, delta), agents.equilibrium(y)
    system = System(kind, game, agents, law, float(rho), state, seed=index)
    needed = Theorem(system).coupling
    assert needed is not None
    assert needed.quadratic is not None
    gain = float(needed.quadratic.least * log_uniform(rng, 1.02, 5.0, 1)[0])
    system = replace(system, law=replace(law, coupling=gain), memory=np.zeros(0))
    h = UNIT
    while h > 0.9 * largest_step(system):
        h *= 0.5
    return system, Clock(DURATION, h, h, 0.1)


def one(seed: int, index: int) -> dict[str, Any]:
    """Draw a system and run it."""
    system, clock = drawn(seed, index)
    graph = system.law.graph
    assert isinstance(graph, SwitchingGraph)
    simulation = Simulation([system], clock)
    seen = simulation.run().report()["systems"][system.name]
    v = seen["lyapunov"]
    return {
        "index": index, "kind": system.name, "status": seen["status"], "agents": len(system.state),
        "times": [min(graph.durations), max(graph.durations)], "timestep": clock.timestep,
        "changes": seen["network"]["changes"], "claimed": v["claimed"], "monotone": v["monotone"],
        "rise": v["largest_rise"] / v["start"] if v["start"] else 0.0,
    }  # fmt: skip


def broken(row: dict[str, Any]) -> list[str]:
    """Which promises a run has broken."""
    if row["status"] not in SUCCESSES:
        return [row.get("message", row["status"])]
    return [name for name in ("claimed", "monotone") if not row[name]]


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """A Markdown table by kind, the broken ones, and how many these are."""
    lines = [
        "| | runs | changes, median and most | ended outside | V not claimed | V rose |"
        " greatest rise over V(0) |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind, own in by_kind(rows, KINDS):
        changes = [row["changes"] for row in own]
        cells = (
            kind, len(own), f"{np.median(changes):.0f}, {max(changes)}",
            sum(row["status"] not in SUCCESSES for row in own),
            sum(not row["claimed"] for row in own), sum(not row["monotone"] for row in own),
            f"{max(row['rise'] for row in own):.1e}",
        )  # fmt: skip
        lines.append(f"| {' | '.join(map(str, cells))} |")
    bad = [row for row in rows if broken(row)]
    lines += [f"broken: {row['index']} {', '.join(broken(row))}" for row in bad]
    return lines, len(bad)


if __name__ == "__main__":
    sys.exit(main())
