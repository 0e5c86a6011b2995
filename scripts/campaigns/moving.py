"""Random games that move: whether outputs leave their set, and stay within the tracking bound.

Agents follow each other, or meet over a random graph; references, wishes and bounds are ramps,
sines, steps with a limited rate and tables. Constraints are looked at in the recorded outputs by
formulas of this file, with the numbers at those times by formulas of this file too.
"""

import sys
from typing import Any

import numpy as np
from campaign import CRASHED, campaign, crash, parser

from gne_mj.scenario import load_scenario

KINDS = ("integrator, continuous", "integrator, implicit", "pi-cascade, continuous",
         "integrator, continuous, fed forward", "integrator, implicit, fed forward")  # fmt: skip
DURATION, STEP, SAMPLE = 3.0, 0.01, 0.1  # s
PAST = "bound_moved_past"
Row = dict[str, Any]


def main() -> int:
    """Run, print the table; 1 if outputs left, or were beyond their bound."""
    given = parser("scripts/check-moving", __doc__, 10_000).parse_args()
    return campaign(given, one, crashed, report, lambda row: bool(broken(row)))


def crashed(index: int, error: Exception) -> Row:
    """What is not expected counts as broken."""
    return crash(index, error) | {"kind": KINDS[index % len(KINDS)]}


def one(seed: int, index: int) -> Row:
    """The row of a run."""
    rng = np.random.default_rng([seed, index])
    kind = KINDS[index % len(KINDS)]
    tables = drawn(rng, kind)
    run = load_scenario(tables).simulation_object().run()
    report, data = run.reports["a"], run["a"]
    numbers = tables["systems"]["a"]["game"]
    outside = worst(numbers, data["time"].to_numpy(), data["action"].to_numpy())
    tracking = report["tracking"]
    return {
        "index": index, "kind": kind, "status": report["status"], "outside": outside,
        "past": ahead(tables, data) if report["status"] == PAST else None,
        "margin": None if report["worst_constraint"] is None
        else report["worst_constraint"]["margin"],
        "within": tracking["within"], "not_known": tracking["not_known"],
        "used": None if tracking["final_bound"] is None
        else tracking["final_distance"] / tracking["final_bound"],
        "rate": tracking["largest_rate"], "rate_bound": tracking["largest_rate_bound"],
    }  # fmt: skip


def broken(row: Row) -> list[str]:
    """What a row shows that is promised not to be."""
    good = row["status"] in ("converged", "completed")
    good |= row["status"] == PAST and row["past"] >= 0.0  # beyond the rate that is certified
    found = [] if good else [row["status"]]
    if row["status"] == CRASHED:
        return found
    found += ["outside"] * (row["outside"] >= 0.0)
    found += ["beyond its bound"] * (row["within"] is not True)
    rates = row["rate_bound"] is not None and row["rate"] > row["rate_bound"] * (1.0 + 1e-6)
    return found + ["rate beyond its bound"] * rates


def report(rows: list[Row]) -> tuple[list[str], int]:
    """A line for each kind, and how many rows are broken."""
    lines = ["| kind | runs | broken | bound moved past | least margin | of the bound at the end |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for kind in KINDS:
        own = [row for row in rows if row["kind"] == kind and row["status"] != CRASHED]
        bad = sum(bool(broken(row)) for row in rows if row["kind"] == kind)
        margins = [row["margin"] for row in own if row["margin"] is not None]
        used = [row["used"] for row in own if row["used"] is not None]
        past = sum(row["status"] == PAST for row in own)
        lines.append(
            f"| {kind} | {len(own)} | {bad} | {past} | {min(margins, default=np.nan):.3g} |"
            f" {max(used, default=np.nan):.3g} |"
        )
    for row in rows:
        if broken(row):
            lines.append(f"{row['index']}: {', '.join(broken(row))} {row.get('message', '')}")
    return lines, sum(bool(broken(row)) for row in rows)


# ------------------------------------------------------------------------------------- draws


def drawn(rng: np.random.Generator, kind: str) -> Row:
    """A scenario's tables: a line of agents whose reference, wishes and bounds move."""
    agents = int(rng.integers(1, 6))
    reference = moving(rng, rng.uniform(-2.0, 2.0), rng.uniform(0.1, 2.0))
    bounds = [moving(rng, rng.uniform(2.0, 4.0), rng.uniform(0.05, 0.8)) for _ in range(agents)]
    wishes = [moving(rng, rng.uniform(-4.0, 4.0), rng.uniform(0.1, 2.0)) for _ in range(agents)]
    game = {"type": "velocity-synchronization", "reference_velocity": reference,
            "gap_bound": bounds, "desired_velocity": wishes,
            "desired_weight": rng.uniform(0.0, 2.0, agents).tolist()}  # fmt: skip
    least = np.array([value(each, 0.0) for each in bounds])
    gaps = rng.uniform(-1.0, 1.0, agents) * least * (1.0 - 10.0 ** rng.uniform(-3.0, 0.0))
    start = value(reference, 0.0) + np.cumsum(gaps)
    agent, mode = kind.split(", ")[:2]
    controller = {"mode": mode, "feed_forward": "fed forward" in kind}
    period = STEP if mode == "continuous" else float(rng.choice([0.01, 0.02, 0.05]))
    return {
        "simulation": {"duration": DURATION, "timestep": STEP, "control_period": period},
        "recording": {"period": SAMPLE},
        "systems": {"a": {
            "game": game, "agents": {"type": agent, "count": agents}, "controller": controller,
            "barrier": {"rho": 10.0 ** rng.uniform(-2.0, 0.0)},
            "initial": {"action": start.tolist()},
        }},
    }  # fmt: skip


def moving(rng: np.random.Generator, middle: float, reach: float) -> Row:
    """A function of time about a value, at rates within what a period moves a gap by far less."""
    kind = rng.choice(["ramp", "sine", "steps", "table"])
    if kind == "ramp":
        return {"type": "ramp", "from": middle, "to": middle + reach * rng.uniform(-1.0, 1.0),
                "start": rng.uniform(0.0, 2.0), "rate": rng.uniform(0.1, 1.0)}  # fmt: skip
    if kind == "sine":
        return {"type": "sine", "mean": middle, "amplitude": 0.5 * reach,
                "period": rng.uniform(1.5, 6.0), "phase": rng.uniform(0.0, 6.0)}  # fmt: skip
    times = np.sort(rng.uniform(0.0, DURATION, 3)) + 0.01 * np.arange(3)
    values = (middle + reach * rng.uniform(-0.5, 0.5, 3)).tolist()
    if kind == "steps":
        return {"type": "steps", "from": middle, "times": times.tolist(), "to": values,
                "rate": rng.uniform(0.1, 1.0)}  # fmt: skip
    times = np.array([0.0, 1.5, 3.0])
    return {"type": "table", "times": times.tolist(), "values": values}


# ------------------------------------------------------------------------- formulas of this file


def value(given: Row, time: float) -> float:
    """A function's value at a time in s, step by step where it is limited in rate."""
    if given["type"] == "sine":
        angle = 2.0 * np.pi * time / given["period"] + given["phase"]
        return float(given["mean"] + given["amplitude"] * np.sin(angle))
    if given["type"] == "table":
        return float(np.interp(time, given["times"], given["values"]))
    if given["type"] == "ramp":
        change, gone = given["to"] - given["from"], max(0.0, time - given["start"]) * given["rate"]
        return float(given["from"] + np.sign(change) * min(abs(change), gone))
    now = given["from"]
    ends = [*given["times"][1:], np.inf]
    for begin, end, target in zip(given["times"], ends, given["to"], strict=True):
        if time > begin:
            most = given["rate"] * (min(time, end) - begin)
            now += float(np.clip(target - now, -most, most))
    return float(now)


def ahead(tables: Row, data: Any) -> float:
    """The greatest constraint at the last outputs and the end of the period that begins there."""
    end = float(data["time"][-1]) + tables["simulation"]["control_period"]
    last = data["action"].to_numpy()[-1:]
    return worst(tables["systems"]["a"]["game"], np.array([end]), last)


def worst(game: Row, times: np.ndarray, y: np.ndarray) -> float:
    """The greatest |gap|^2 - bound^2 of recorded outputs (times, agents)."""
    found = -np.inf
    for time, row in zip(times.tolist(), y, strict=True):
        gaps = np.diff(row, prepend=value(game["reference_velocity"], time))
        bounds = np.array([value(each, time) for each in game["gap_bound"]])
        found = max(found, float(np.max(gaps**2 - bounds**2)))
    return found


if __name__ == "__main__":
    sys.exit(main())
