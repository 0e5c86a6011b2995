"""Measure what is compared, as ratios, in turns in one process; keep and compare what was found.

A table in Markdown, and the same as JSON beside it. What is kept is in docs/benchmarks, one file a
machine and version, of which docs/benchmarks.md shows the last one written.
"""

import argparse
import importlib
import sys
import time
from pathlib import Path

import comparison
import history

# What is measured, and where; those of :mod:`peer_common` come last
GROUPS = {
    "startup": "startup", "batch": "batch", "fleet": "fleet", "positions": "positions",
    "growth": "growth", "solver": "solver", "twin": "twin", "view": "view", "mjx": "peer_mjx",
    "learning": "learning", "diffrax": "peer_diffrax", "cbfpy": "peer_cbfpy",
}  # fmt: skip
DOCS = Path(__file__).parents[2] / "docs"


def main() -> None:
    """Parse the arguments and measure or compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="turns of which the median counts")
    parser.add_argument(
        "--only", nargs="+", choices=GROUPS, metavar="GROUP", help=f"of {', '.join(GROUPS)}"
    )
    parser.add_argument("--out", type=Path, metavar="FILE.md", help="where to; printed if left out")
    parser.add_argument(
        "--keep", action="store_true", help="keep the rows in docs/benchmarks and the page"
    )
    parser.add_argument(
        "--compare", nargs=2, type=Path, metavar=("BEFORE", "AFTER"),
        help="measure nothing; name rows of two JSON files that became worse: exit status 1",
    )  # fmt: skip
    options = parser.parse_args()
    if options.compare:
        sys.exit(comparison.tell(*map(history.read, options.compare)))
    if options.out and options.out.exists():
        parser.error(f"--out: {options.out} exists already; name another file")
    measured = _measured(options.only or list(GROUPS), options.runs, options.out)
    if options.keep:
        history.keep(measured, DOCS)
    if not options.out:
        print(history.table(measured))


def _measured(names: list[str], runs: int, out: Path | None) -> history.Measured:
    """The rows of some groups; those in `out` after each group outlive an interruption."""
    # All before any is measured, and peers first, which settle what JAX computes with
    groups = {name: importlib.import_module(GROUPS[name]) for name in reversed(names)}
    found = history.Measured.here(runs)
    for name in names:
        began = time.perf_counter()
        found = found.with_rows(name, groups[name].rows(runs))
        print(f"{name}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
        if out:
            history.write(found, out)
    return found


if __name__ == "__main__":
    main()
