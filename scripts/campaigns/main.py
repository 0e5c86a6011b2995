"""The long checks: random runs of the held modes, and runs under disturbances within margins."""

import argparse
import json
import sys
from pathlib import Path

import held
import loads
import margins


def main() -> int:
    """Run all, print the tables; 1 if a promise was broken."""
    parser = argparse.ArgumentParser(prog="scripts/check-held", description=__doc__)
    parser.add_argument("--runs", type=int, default=100_000, help="of each mode")
    parser.add_argument("--margin-runs", type=int, default=10_000, help="under disturbances")
    parser.add_argument("--load-runs", type=int, default=1_000, help="with observers of loads")
    parser.add_argument("--ratios", action="store_true", help="certified and breaking pushes too")
    parser.add_argument(
        "--guarded-runs", type=int, default=10_000, help="of each mode, guarded between instants"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="JSON file for the counts of the first part")
    options = parser.parse_args()
    if options.out and options.out.exists():
        parser.error(f"--out: {options.out} exists already; name another file")
    broken = 0
    if options.runs:
        lines, broken, counts = held.campaign(options.runs, options.seed, options.processes)
        print("\n".join(lines), flush=True)
        if options.out:
            options.out.write_text(json.dumps(counts, indent=2) + "\n", encoding="utf-8")
    if options.guarded_runs:
        lines, left, _ = held.campaign(
            options.guarded_runs, options.seed, options.processes, guarded=True
        )
        print("\n".join(lines), flush=True)
        broken += left
        few = options.guarded_runs // 5
        lines, left = margins.campaign(few, options.seed, options.processes, guarded=True)
        print("\n".join(["", "guarded, within margins", "", *lines]), flush=True)
        broken += left
    if options.margin_runs:
        lines, left = margins.campaign(options.margin_runs, options.seed, options.processes)
        print("\n".join(["", "within margins", "", *lines]), flush=True)
        broken += left
    if options.load_runs:
        lines, left = loads.campaign(options.load_runs, options.seed, options.processes)
        print("\n".join(["", "with observers of loads", "", *lines]), flush=True)
        broken += left
    if options.ratios:
        head = ["", "| period | certified push | breaking push | ratio |", "|---|---|---|---|"]
        print("\n".join([*head, *margins.ratios()]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
