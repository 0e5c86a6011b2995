"""Random certified systems in mode continuous: how runs end, and how near they stay to continuous
time, which a stiff solver computes from the paper's equations."""

import sys
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import stiff
from campaign import CRASHED, campaign, crash, parser
from checks import LEFT
from kinds import KINDS, Draw, draw

from gne_mj.controllers import FullyDistributed
from gne_mj.errors import GneError
from gne_mj.simulation import Simulation

LARGEST = 160  # states of a system that is compared
WANTED = 1e-6  # greatest relative difference
ALLOWED = 1e-9  # error in an adaptive step
# Each with the relative tolerances of its two solutions; the second where the first is not sure
METHODS = ((stiff.follow, 1e-11, 1e-10), (stiff.follow_by_radau, 1e-10, 1e-9))
CRUDE = 1e-7  # relative tolerance where only the solution's end matters
SURE = 1e-7  # greatest relative difference of the two where the solver is relied on
AS_CONTINUOUS = "left, as in continuous time"
REFUSED = "refused"
# Of the law without its barrier, step times greatest rate: below it RK4 can be asked for WANTED
SMOOTH = 0.05


def main() -> int:
    """Run, print the tables; 1 if a run left, or was farther off than wanted."""
    options = parser("scripts/check-continuous", __doc__, 10_000)
    options.add_argument("--against", type=int, default=400, help="of them with a stiff solver")
    options.add_argument(
        "--adaptive", action="store_true", help="ODE agents by tsit5 in place of fixed steps"
    )
    given = options.parse_args()
    share = 1.0 if given.index is not None else given.against / max(given.runs, 1)
    return campaign(
        given, partial(one, share=share, adaptive=given.adaptive), crashed, report, is_notable
    )


def crashed(index: int, error: Exception) -> dict[str, Any]:
    """What is not expected counts as broken."""
    return crash(index, error, integrator="any", divided=0)


def is_notable(row: dict[str, Any]) -> bool:
    """Whether a run is kept in the file: compared, divided or broken."""
    return "error" in row or _is_broken(row) or bool(row["divided"])


def one(seed: int, index: int, *, share: float, adaptive: bool = False) -> dict[str, Any]:
    """Draw a system, run it, and compare a share of them; plain numbers, strings and None."""
    # Spread evenly, so that which runs are compared follows from the counts alone
    against = int((index + 1) * share) > int(index * share)
    drawn = draw(np.random.default_rng([seed, index]))
    system, clock = drawn.system, drawn.clock
    if adaptive and system.engine == "ode" and system.integrator != "rosenbrock":
        system = replace(system, integrator="tsit5", rtol=ALLOWED)
    row: dict[str, Any] = {
        "index": index, "kind": drawn.kind, "agents": system.game.agents, "rho": system.rho,
        "margin": drawn.margin, "kick": drawn.kick, "integrator": system.integrator,
        "timestep": clock.timestep, "duration": clock.duration, "divided": 0,
    }  # fmt: skip
    try:
        simulation = Simulation([system], clock)
        trajectory = simulation.run()
    except GneError as error:
        return row | {"status": REFUSED, "message": str(error)}
    report = trajectory.reports["run"]
    row |= {"status": report["status"], "message": report["message"], "end": report["end_time"]}
    division = report.get("division") or {}
    row["divided"] = division.get("divided_steps", 0)
    row["smallest_step"] = division.get("smallest_step")
    data = trajectory["run"]
    y = data["action"].to_numpy().reshape(len(data["time"]), -1)
    times = data["time"].to_numpy()
    if drawn.loop.length > LARGEST:
        return row
    # The theorem is for some small epsilon: with this one continuous time may leave, too.
    conditional = row["status"] in LEFT and isinstance(system.law, FullyDistributed)
    if conditional and leaves(drawn, times[-1] + 2 * clock.sample_period):
        row["status"] = AS_CONTINUOUS
    elif against:
        row |= compare(drawn, times, y)
    return row


def leaves(drawn: Draw, until: float) -> bool:
    """Whether the stiff solution ends before a time in s."""
    return len(stiff.follow(drawn.loop, drawn.x, np.array([0.0, until]), CRUDE)) < 2


def compare(drawn: Draw, times: np.ndarray, y: np.ndarray) -> dict[str, Any]:
    """The greatest relative difference from the stiff solution, and how sure that solution is.

    Args:
        drawn: the system.
        times: (samples,) in s.
        y: (samples, m) outputs of the run; where it ended early, up to there.
    """
    best, own = solution(drawn.loop, drawn.x, times)
    reached = min(len(y), len(best))
    away = _relative(y[:reached], best[:reached])
    at = int(np.argmax(away))
    return {
        "error": float(away[at]),
        "error_time": float(times[at]),
        "reference_error": float(own),
        "compared": reached,
        "step_times_rate": smooth_rate(drawn) * drawn.clock.timestep,
    }


def solution(loop: stiff.Loop, x: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, float]:
    """Outputs at the times that are reached, and how far those of two tolerances are apart.

    By another method where one does not agree with itself.
    """
    for follow, *tolerances in METHODS:
        best, other = (follow(loop, x, times, rtol) for rtol in tolerances)
        reached = min(len(best), len(other))
        apart = float(np.max(_relative(other[:reached], best[:reached])))
        if apart <= SURE and len(best) == len(times):
            break
    return best[:reached], apart


def _relative(y: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Greatest difference of each row, relative to the reference's greatest where above 1."""
    scale = np.maximum(1.0, np.max(np.abs(reference), axis=1))
    return np.max(np.abs(y - reference), axis=1) / scale


def smooth_rate(drawn: Draw) -> float:
    """Greatest rate, in 1/s, of the closed loop at the start without the barrier."""
    loop = drawn.loop
    rho, loop.rho = loop.rho, 0.0
    slope = loop.jacobian(0.0, drawn.x)
    loop.rho = rho
    return float(np.max(np.abs(np.linalg.eigvals(slope))))


def _is_broken(row: dict[str, Any]) -> bool:
    wrong = row["integrator"] != "euler" and row.get("error", 0.0) > WANTED
    return row["status"] in (*LEFT, CRASHED) or wrong


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """Markdown tables: how runs ended by kind, and how far off they were; what is broken."""
    statuses = sorted({row["status"] for row in rows})
    lines = ["| kind | runs | " + " | ".join(statuses) + " | with divided steps |"]
    lines.append("|---" * (len(statuses) + 3) + "|")
    for kind in (*KINDS, "all"):
        own = [row for row in rows if kind in (row["kind"], "all")]
        cells = [sum(row["status"] == status for row in own) for status in statuses]
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
    crashed = sum(row["status"] == CRASHED for row in rows)
    smallest = min((row["smallest_step"] for row in rows if row.get("smallest_step")), default=None)
    if smallest is not None:
        lines.append(f"smallest step: {smallest:.3g} s")
    lines.append(
        f"left: {left} of {len(rows)}; farther off than {WANTED:g}, but inside:"
        f" {len(broken) - left - crashed}; crashed: {crashed}"
    )
    return lines, len(broken)


def _differences(rows: list[dict[str, Any]]) -> list[str]:
    lines = [
        f"| integrator, step x rate | compared | greatest difference | over {WANTED:g} |"
        " of the solver's two solutions | solver not sure |",
        "|---|---|---|---|---|---|",
    ]
    for integrator in ("rk4", "tsit5", "rosenbrock", "euler"):
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
    sys.exit(main())
