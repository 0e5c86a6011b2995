"""Random certified systems in mode continuous: how runs end, and how near they stay to continuous
time, which a stiff solver computes from the paper's equations."""

import argparse
import json
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import stiff
from draws import progress
from kinds import KINDS, Draw, draw

from gne_mj.errors import InvalidInput, SolverError
from gne_mj.simulation import Simulation
from gne_mj.theory import Theorem
from gne_mj.theory.theorem import CONDITIONAL

RUNS_A_JOB = 25
LARGEST = 160  # states of a system that is compared
WANTED = 1e-6  # greatest relative difference
TIGHT, LOOSE = 1e-10, 1e-8  # relative tolerances of the two solutions
SURE = 1e-7  # greatest relative difference of the two where the solver is relied on
LEFT = ("left_feasible_set", "estimate_left_feasible_set", "diverged")
AS_CONTINUOUS = "left, as in continuous time"
REFUSED = "refused"
# Of the law without its barrier, step times greatest rate: below it RK4 can be asked for WANTED
SMOOTH = 0.05


def main() -> int:
    """Run, print the tables; 1 if a run left, or was farther off than wanted."""
    parser = argparse.ArgumentParser(prog="scripts/check-continuous", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--against", type=int, default=400, help="of them against a stiff solver")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--index", type=int, help="repeat this run alone")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON file for the counts and each notable run")
    options = parser.parse_args()
    started = time.perf_counter()
    if options.index is not None:
        found = one(options.seed, options.index, against=True)
        print(json.dumps(found, indent=2))
        return 0
    share = options.against / max(options.runs, 1)
    jobs = [
        (options.seed, first, min(first + RUNS_A_JOB, options.runs), share)
        for first in range(0, options.runs, RUNS_A_JOB)
    ]
    rows: list[dict[str, Any]] = []
    with ProcessPoolExecutor(options.processes) as pool:
        for part in progress(pool.map(_job, jobs), len(jobs), "runs"):
            rows += part
    lines, broken = report(rows)
    print("\n".join([*lines, "", f"{time.perf_counter() - started:.0f} s"]))
    if options.out:
        kept = [row for row in rows if "error" in row or _is_broken(row) or row["divided"]]
        text = json.dumps({"seed": options.seed, "runs": len(rows), "notable": kept}, indent=1)
        options.out.write_text(text + "\n", encoding="utf-8")
    return 1 if broken else 0


def _job(job: tuple[int, int, int, float]) -> list[dict[str, Any]]:
    seed, first, last, share = job
    # Spread evenly, so that which runs are compared follows from the counts alone
    return [
        one(seed, index, against=int((index + 1) * share) > int(index * share))
        for index in range(first, last)
    ]


def one(seed: int, index: int, *, against: bool) -> dict[str, Any]:
    """Draw a system, run it, and compare it if asked; plain numbers, strings and None."""
    drawn = draw(np.random.default_rng([seed, index]))
    system, clock = drawn.system, drawn.clock
    row: dict[str, Any] = {
        "index": index, "kind": drawn.kind, "agents": system.game.agents, "rho": system.rho,
        "margin": drawn.margin, "kick": drawn.kick, "integrator": system.integrator,
        "timestep": clock.timestep, "duration": clock.duration, "divided": 0,
    }  # fmt: skip
    try:
        simulation = Simulation([system], clock)
        trajectory = simulation.run()
    except (InvalidInput, SolverError) as error:
        return row | {"status": REFUSED, "message": str(error)}
    report = trajectory.reports["run"]
    row |= {"status": report["status"], "message": report["message"], "end": report["end_time"]}
    division = report.get("division") or {}
    row["divided"] = division.get("divided_steps", 0)
    row["smallest_step"] = division.get("smallest_step")
    data = trajectory["run"]
    y = data["action"].to_numpy().reshape(len(data["time"]), -1)
    excused = row["status"] in LEFT and Theorem(system).status == CONDITIONAL
    if (against or excused) and drawn.loop.length <= LARGEST:
        row |= compare(drawn, data["time"].to_numpy(), y, tight_only=excused)
        # The theorem is for some small epsilon: with this one continuous time may leave, too.
        if excused and row["reference_ends"] <= row["end"] + 2 * clock.sample_period:
            row["status"] = AS_CONTINUOUS
    return row


def compare(
    drawn: Draw, times: np.ndarray, y: np.ndarray, *, tight_only: bool = False
) -> dict[str, Any]:
    """The greatest relative difference from the stiff solution, and how sure that solution is.

    Of a run that ended early the state at its end is the last one compared, or, where that is a
    sample less, its last sample.
    """
    if tight_only:
        end = drawn.clock.sample_period * np.arange(1, 3) + times[-1]
        times = np.append(times, end)
    solutions = [stiff.follow(drawn.loop, drawn.x, times, rtol) for rtol in (TIGHT, LOOSE)]
    reached = min(len(y), *map(len, solutions))
    best = solutions[0][:reached]
    scale = np.maximum(1.0, np.max(np.abs(best), axis=1))
    own = np.max(np.max(np.abs(best - solutions[1][:reached]), axis=1) / scale)
    away = np.max(np.abs(y[:reached] - best), axis=1) / scale
    at = int(np.argmax(away))
    return {
        "error": float(away[at]),
        "error_time": float(times[at]),
        "reference_error": float(own),
        "reference_ends": float(times[len(solutions[0]) - 1])
        if len(solutions[0]) < len(times)
        else np.inf,
        "step_times_rate": smooth_rate(drawn) * drawn.clock.timestep,
    }


def smooth_rate(drawn: Draw) -> float:
    """Greatest rate, in 1/s, of the closed loop at the start without the barrier."""
    loop = drawn.loop
    rho, loop.rho = loop.rho, 0.0
    slope = loop.jacobian(0.0, drawn.x)
    loop.rho = rho
    return float(np.max(np.abs(np.linalg.eigvals(slope))))


def _is_broken(row: dict[str, Any]) -> bool:
    wrong = row["integrator"] != "euler" and row.get("error", 0.0) > WANTED
    return row["status"] in LEFT or wrong


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """Markdown tables: how runs ended by kind, and how far off they were; what is broken."""
    found = Counter((row["kind"], row["status"]) for row in rows)
    statuses = sorted({row["status"] for row in rows})
    lines = ["| kind | runs | " + " | ".join(statuses) + " | with divided steps |"]
    lines.append("|---" * (len(statuses) + 3) + "|")
    for kind in (*KINDS, "all"):
        own = [row for row in rows if kind in (row["kind"], "all")]
        cells = [sum(row["status"] == status for row in own) for status in statuses]
        if kind != "all":
            assert cells == [found[kind, status] for status in statuses]
        divided = sum(row["divided"] > 0 for row in own)
        lines.append(f"| {kind} | {len(own)} | " + " | ".join(map(str, cells)) + f" | {divided} |")
    compared = [row for row in rows if "error" in row]
    lines += ["", *_differences(compared), ""]
    broken = [row for row in rows if _is_broken(row)]
    for row in broken[:20]:
        shown = {key: row[key] for key in ("index", "kind", "status") if key in row}
        numbers = ("agents", "rho", "margin", "kick", "timestep", "error", "step_times_rate")
        shown |= {key: f"{row[key]:.4g}" for key in numbers if row.get(key) is not None}
        lines.append(", ".join(f"{key} {value}" for key, value in shown.items()))
    left = sum(row["status"] in LEFT for row in rows)
    lines.append(f"left: {left} of {len(rows)}; farther off than {WANTED:g}: {len(broken) - left}")
    return lines, len(broken)


def _differences(rows: list[dict[str, Any]]) -> list[str]:
    lines = [
        f"| integrator, step x rate | compared | greatest difference | over {WANTED:g} |"
        " of the solver's two solutions | solver not sure |",
        "|---|---|---|---|---|---|",
    ]
    for integrator in ("rk4", "rosenbrock", "euler"):
        for low, high in ((0.0, SMOOTH), (SMOOTH, np.inf)):
            own = [
                row for row in rows
                if row["integrator"] == integrator and low <= row["step_times_rate"] < high
            ]  # fmt: skip
            if not own:
                continue
            side = f"below {high:g}" if np.isfinite(high) else f"from {low:g}"
            errors = np.array([row["error"] for row in own])
            solver = np.array([row["reference_error"] for row in own])
            lines.append(
                f"| {integrator}, {side} | {len(own)} | {errors.max():.2g} |"
                f" {np.sum(errors > WANTED)} | {solver.max():.1g} |"
                f" {np.sum(solver > SURE)} |"
            )
    return lines


if __name__ == "__main__":
    # One thread a process: matrices are small, and two processes fill two cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
