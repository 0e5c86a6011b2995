"""Random runs of modes implicit and sampled: who leaves the set, when, and whether it is seen.

With a guard between control instants none of either mode may leave at any integration step.
"""

import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from draws import Draw, Fleet, progress

from gne_mj.errors import InvalidInput, SolverError
from gne_mj.loops import monitor as watch
from gne_mj.margins import influence

RUNS_A_FLEET = 100
DECADES = (1e-4, 1e-3, 5e-3, 2e-2, 0.1, 0.3, 1.01)  # s, edges of the table's rows
VARIANTS = ("implicit", "decentralised", "sampled")
GUARDED = tuple(f"guarded {variant}" for variant in VARIANTS)


def campaign(
    runs: int, seed: int, processes: int, guarded: bool = False
) -> tuple[list[str], int, dict[str, int]]:
    """Tables of what came out, how many promises were broken, and all counts."""
    started, total = time.perf_counter(), Counter[tuple[str, str, str]]()
    variants = GUARDED if guarded else VARIANTS
    jobs = [(seed, job, variants) for job in range(-(-runs // RUNS_A_FLEET))]
    with ProcessPoolExecutor(processes) as pool:
        for counts in progress(pool.map(_fleet, jobs), len(jobs), "fleets"):
            total.update(counts)
    broken = sum(
        n for key, n in total.items()
        if key[2] in UNSEEN
        or (key[0] != "sampled" and key[2] == BROKEN)
        or (guarded and key[2].startswith("left"))
    )  # fmt: skip
    lines = [
        *table(total, variants),
        f"{time.perf_counter() - started:.0f} s; promises broken: {broken}",
    ]
    return lines, broken, {" | ".join(key): n for key, n in sorted(total.items())}


BROKEN, UNSEEN = "left at an instant, promised", ("silent", "misdated")


def _fleet(job: tuple[int, int, tuple[str, ...]]) -> Counter[tuple[str, str, str]]:
    """These variants of the runs of one fleet, counted by (variant, period, outcome)."""
    *numbers, variants = job
    fleet = Fleet(np.random.default_rng(numbers))
    counts = Counter[tuple[str, str, str]]()
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
        for variant in variants:
            system = replace(
                draw.system,
                mode="sampled" if "sampled" in variant else "implicit",
                decentralised="decentralised" in variant,
                between="guarded" if "guarded" in variant else "watched",
            )
            for outcome in _outcomes(replace(draw, system=system), plants, variant, promised):
                counts[variant, row, outcome] += 1
    return counts


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
    code = int(monitor.exit)
    if code == watch.INSIDE:
        found.append("silent" if np.any(outside) else "inside")
    else:
        step = round(monitor.exit_time / clock.timestep)
        # every step before the exit was inside, and the exit is told of the very next one
        if np.any(outside[:-1]) or step > len(recorded.state):
            found.append("misdated")
        if code == watch.DIVERGED:
            found.append("diverged")
        elif code == watch.FORESEEN:
            found.append("ended before it left")
        elif step % period == 0:
            found.append(f"left at an instant, {'promised' if promised else 'not promised'}")
        else:
            found.append("left between instants")
    if monitor.cut > 0:
        found.append("with a period cut")
    if monitor.unsolved > 0:
        found.append("not accurate")
    if monitor.not_monotone > 0:
        found.append("not monotone")
    if not promised:
        found.append("slope not certified")
    return found


def _row(period: float) -> str:
    for low, high in pairwise(DECADES):
        if low <= period < high:
            return f"{low:g} to {min(high, 1.0):g} s"
    return "other"


def table(total: Counter[tuple[str, str, str]], variants: tuple[str, ...]) -> list[str]:
    """Markdown, a table for each variant."""
    lines = []
    rows = [_row(low) for low in DECADES[:-1]]
    for variant in variants:
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
