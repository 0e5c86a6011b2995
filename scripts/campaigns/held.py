"""Random runs of modes implicit and sampled: who leaves the set, when, and whether it is seen.

scripts/check-held [--runs N] [--seed S] [--out FILE.json]
"""

import argparse
import copy
import json
import sys
import time
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from draws import Draw, Fleet
from rich.progress import Progress

from gne_mj.errors import InvalidInput, SolverError
from gne_mj.loops import monitor as watch
from gne_mj.margins import influence

RUNS_A_FLEET = 100
DECADES = (1e-4, 1e-3, 5e-3, 2e-2, 0.1, 0.3, 1.01)  # s, edges of the table's rows
VARIANTS = ("implicit", "decentralised", "sampled")


def main() -> int:
    """Run, print the table, write the numbers; 1 if a promise was broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100_000, help="runs of each mode")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON file for the numbers")
    options = parser.parse_args()
    started, total = time.perf_counter(), defaultdict(int)
    jobs = range(-(-options.runs // RUNS_A_FLEET))
    with ProcessPoolExecutor(options.processes) as pool, Progress(
        disable=not sys.stderr.isatty()
    ) as bar:
        task = bar.add_task("fleets", total=len(jobs))
        for counts in pool.map(_fleet, [(options.seed, job) for job in jobs]):
            for key, count in counts.items():
                total[key] += count
            bar.advance(task)
    print("\n".join(table(total)))
    broken = sum(
        n for key, n in total.items()
        if key[2] in UNSEEN or (key[0] != "sampled" and key[2] == BROKEN)
    )  # fmt: skip
    print(f"{time.perf_counter() - started:.0f} s; promises broken: {broken}")
    if options.out:
        flat = {" | ".join(map(str, key)): n for key, n in sorted(total.items())}
        options.out.write_text(json.dumps(flat, indent=2) + "\n", encoding="utf-8")
    return 1 if broken else 0


BROKEN, UNSEEN = "left at an instant, promised", ("silent", "misdated")


def _fleet(job: tuple[int, int]) -> dict[tuple[str, str, str], int]:
    """All variants of the runs of one fleet, counted by (variant, period, outcome)."""
    fleet = Fleet(np.random.default_rng(list(job)))
    counts: dict[tuple[str, str, str], int] = defaultdict(int)
    plants: dict[str, Any] = {}
    for _ in range(RUNS_A_FLEET):
        draw = fleet.draw("implicit")
        promised = bool(
            np.all(
                influence(
                    fleet.agents, draw.clock.timestep, "euler",
                    draw.clock.steps(draw.clock.control_period),
                ).least_slope > 0
            )
        )  # fmt: skip
        row = _row(draw.clock.control_period)
        for variant in VARIANTS:
            mode = "sampled" if variant == "sampled" else "implicit"
            system = replace(draw.system, mode=mode, decentralised=variant == "decentralised")
            for outcome in _outcomes(replace_draw(draw, system), plants, variant, promised):
                counts[variant, row, outcome] += 1
    return dict(counts)


def replace_draw(draw: Draw, system: Any) -> Draw:
    """The same draw of another mode."""
    other = copy.copy(draw)
    other.system = system
    return other


def _outcomes(draw: Draw, plants: dict[str, Any], variant: str, promised: bool) -> list[str]:
    system, clock = draw.system, draw.clock
    try:
        loop = system.closed_loop(clock, plants.get(variant))
    except (InvalidInput, SolverError) as error:
        return ["runs", f"refused: {type(error).__name__}"]
    if system.engine == "mujoco":
        plants[variant] = loop.plant  # type: ignore[attr-defined]
    period = clock.steps(clock.control_period)
    total = clock.steps(clock.duration)
    recorded = loop.advance(total, 1)
    last = loop.finish()
    monitor = loop.monitor
    found = ["runs"]
    # An independent look: the recorded states of every step, and the game as an array function.
    y = np.concatenate([recorded.state, last.state])[:, :, system.agents.kind.OUTPUT]
    with np.errstate(invalid="ignore"):
        outside = ~np.all(system.game.constraints(y) < 0, axis=1)
    code = int(monitor[watch.EXIT])
    if code == watch.INSIDE:
        found.append("silent" if np.any(outside) else "inside")
    else:
        step = round(monitor[watch.EXIT_TIME] / clock.timestep)
        # finish() repeats the state at which the exit was seen
        if np.any(outside[:-1]) or (code == watch.LEFT_SET and loop.time > 0 and step < len(recorded.state)):
            found.append("misdated")
        if code == watch.DIVERGED:
            found.append("diverged")
        elif step % period == 0:
            found.append(f"left at an instant, {'promised' if promised else 'not promised'}")
        else:
            found.append("left between instants")
    if monitor[watch.UNSOLVED] > 0:
        found.append("not accurate")
    if monitor[watch.NOT_MONOTONE] > 0:
        found.append("not monotone")
    if not promised:
        found.append("slope not certified")
    return found


def _row(period: float) -> str:
    for low, high in zip(DECADES, DECADES[1:], strict=False):
        if low <= period < high:
            return f"{low:g} to {min(high, 1.0):g} s"
    return "other"


def table(total: dict[tuple[str, str, str], int]) -> list[str]:
    """Markdown, a table for each variant."""
    lines = []
    rows = [f"{low:g} to {min(high, 1.0):g} s" for low, high in zip(DECADES, DECADES[1:], strict=False)]
    for variant in VARIANTS:
        outcomes = sorted({key[2] for key in total if key[0] == variant} - {"runs"})
        lines += ["", f"{variant}", "", "| period | runs | " + " | ".join(outcomes) + " |"]
        lines.append("|---" * (len(outcomes) + 2) + "|")
        for row in rows:
            cells = [total.get((variant, row, outcome), 0) for outcome in ("runs", *outcomes)]
            lines.append(f"| {row} | " + " | ".join(map(str, cells)) + " |")
        cells = [
            sum(n for key, n in total.items() if key[0] == variant and key[2] == outcome)
            for outcome in ("runs", *outcomes)
        ]
        lines.append("| all | " + " | ".join(map(str, cells)) + " |")
    return lines


if __name__ == "__main__":
    sys.exit(main())
