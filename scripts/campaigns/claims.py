"""What ``certify`` claims of random systems, right and wrong ones, against what their runs do."""

import sys
from collections import Counter
from typing import Any

import numpy as np
from campaign import CRASHED, campaign, parser
from checks import CHECKS, Check, run
from wrong import build, draw

from gne_mj.errors import GneError, InfeasibleStart, InvalidInput, SolverError
from gne_mj.theory import certify


def main() -> int:
    """Ask, run and check all; print the tables; 1 if a claim was contradicted."""
    options = parser("scripts/check-claims", __doc__, 2_000).parse_args()
    return campaign(options, one, crashed, report, lambda row: bool(row["against"]))


def crashed(index: int, error: Exception) -> dict[str, Any]:
    """What is not expected is told as a contradiction."""
    crash = Check("nothing crashes", False, f"{type(error).__name__}: {error}")
    row = {"index": index, "kind": "any", "mode": "any", "verdict": CRASHED}
    return row | _tally([crash])


def one(seed: int, index: int) -> dict[str, Any]:
    """One system: its verdict, the claims that were checked by kind, and the contradictions."""
    rng = np.random.default_rng([seed, index])
    parts = draw(rng)
    row: dict[str, Any] = {
        "index": index, "kind": parts.kind, "mode": parts.mode, "checked": {}, "against": [],
    }  # fmt: skip
    try:
        case = build(rng, parts)
        case.system.setup(case.clock)  # so that what a run refuses is not asked about
    except InfeasibleStart:
        return (
            row
            | {"verdict": "refused: start"}
            | _tally([Check("a start is refused that is outside", not parts.inside, None)])
        )
    except InvalidInput as error:
        return row | {"verdict": f"refused: {error.key.split('.')[-1]}"}
    except SolverError as error:
        return (
            row
            | {"verdict": "no equilibrium"}
            | _tally([Check("a system that fits together can be set up", False, str(error))])
        )
    system, clock = case.system, case.clock
    row |= {
        "agents": system.game.agents, "rho": system.rho, "integrator": system.integrator,
        "timestep": clock.timestep, "period": clock.control_period, "duration": clock.duration,
        "limited": bool(np.any(np.isfinite(system.agents.input_limit))),
        "faults": [type(fault).__name__ for fault in system.faults],
        "margin_declared": system.disturbance is not None,
    }  # fmt: skip
    checks = [Check("a start is taken that is inside", parts.inside, None)]
    try:
        told = certify(system, clock).to_dict()
    except GneError as error:
        checks.append(Check("certify answers", False, str(error)))
        return row | {"verdict": "no answer"} | _tally(checks)
    row["verdict"] = told["status"]
    try:
        seen = run(system, clock)
    except GneError as error:
        checks.append(Check("what certify answers about can be run", False, str(error)))
        return row | _tally(checks)
    row |= {"status": seen.report["status"], "message": seen.report["message"]}
    for check in CHECKS:
        checks += check(case, told, seen)
    return row | _tally(checks)


def _tally(checks: list[Check]) -> dict[str, Any]:
    against = [{"claim": c.claim, "numbers": c.numbers} for c in checks if not c.holds]
    return {"checked": dict(Counter(c.claim for c in checks)), "against": against}


def report(rows: list[dict[str, Any]]) -> tuple[list[str], int]:
    """Markdown tables: verdicts, claims by kind, and each contradiction; how many there are."""
    run_metrics = Counter((row["mode"], row["verdict"]) for row in rows)
    lines = ["| mode | verdict | systems |", "|---|---|---|"]
    lines += [f"| {mode} | {verdict} | {n} |" for (mode, verdict), n in sorted(run_metrics.items())]
    checked, against = Counter[str](), Counter[str]()
    for row in rows:
        checked.update(row["checked"])
        against.update(found["claim"] for found in row["against"])
    lines += ["", "| claim | checked | contradicted |", "|---|---|---|"]
    lines += [f"| {claim} | {n} | {against[claim]} |" for claim, n in sorted(checked.items())]
    lines.append(f"| all | {checked.total()} | {against.total()} |")
    shown = Counter[str]()
    for row in rows:
        for found in row["against"]:
            shown[found["claim"]] += 1
            if shown[found["claim"]] <= 5:
                what = f"{row['kind']}, {row['mode']}, {row['verdict']}"
                lines.append(f"index {row['index']} ({what}): {found['claim']}: {found['numbers']}")
    return lines, against.total()


if __name__ == "__main__":
    sys.exit(main())
