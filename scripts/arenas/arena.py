"""Runs the arena: every case is a comparison of all laws, which a killed one goes on with."""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import product
from pathlib import Path

import cases

import page

ROOT = Path(__file__).parents[2]


def run_case(problem: str, condition: str, folder: Path, runs: int, budget: int, laws: str) -> str:
    """One comparison, if it has not been made yet; what to say of it.

    A child process imports what compiles when it is here.
    """
    from gne_mj.comparison import compare, report

    known, done = cases.PROBLEMS[problem], folder / problem / condition
    if (done / "comparison.json").exists():
        return "done before"
    changes = {**known.changes, **cases.CONDITIONS[condition](known)}
    data = compare(
        known.scenario, laws.split(","), changes, out=done, runs=runs, seed=cases.SEED,
        budget=budget, threads=1, resume=True,
    )  # fmt: skip
    report.write(data, done)
    page.keep_curves(data, done)
    return f"{data.sizes['law']} laws"


def main() -> int:
    """See --help."""
    parser = argparse.ArgumentParser(
        prog="scripts/arena",
        description="Put all laws beside each other on six problems under three conditions, and"
        " write docs/arena.md's tables and figure from the results. What is in the folder already"
        " is not run again.",
    )
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "arena", help="folder")
    parser.add_argument("--processes", type=int, default=2, help="cases at a time")
    parser.add_argument("--runs", type=int, default=cases.RUNS, help="random starts of each law")
    parser.add_argument("--budget", type=int, default=cases.BUDGET, help="gains tried for each law")
    parser.add_argument("--laws", default="all", help="as `gne-mj compare` has it")
    parser.add_argument("--problems", default=",".join(cases.PROBLEMS), help="which")
    parser.add_argument("--conditions", default=",".join(cases.CONDITIONS), help="which")
    parser.add_argument("--page", action="store_true", help="write docs/arena.md's tables anew")
    given = parser.parse_args()
    wanted = [*product(given.conditions.split(","), given.problems.split(","))]
    failed = 0
    with ProcessPoolExecutor(given.processes) as pool:
        futures = {
            pool.submit(
                run_case, problem, condition, given.out, given.runs, given.budget, given.laws
            ): f"{problem}, {condition}"
            for condition, problem in wanted
        }
        for future in as_completed(futures):
            try:
                words = future.result()
            except Exception as error:  # the other cases go on
                failed += 1
                words = f"failed: {type(error).__name__}: {error}"
            print(f"{futures[future]}: {words}", flush=True)
    results = page.collect(given.out)
    (given.out / "results.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if given.page:
        page.write(results, given.out)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
