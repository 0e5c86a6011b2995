"""Run every benchmark and write one Markdown table of ratios."""

import argparse
import platform
from importlib.metadata import version
from pathlib import Path

import batch
import fleet
import peer_cbfpy
import peer_diffrax
import peer_mjx
import positions
import solver
import twin
import view


def main() -> None:
    """Parse the arguments, measure, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=25, help="turns of which the median counts")
    parser.add_argument("--out", type=Path, help="Markdown file to write; printed if left out")
    options = parser.parse_args()
    if options.out and options.out.exists():
        parser.error(f"--out: {options.out} exists already; name another file")
    rows: list[dict[str, str]] = []
    for group in (batch, fleet, positions, solver, twin, view, peer_mjx, peer_diffrax, peer_cbfpy):
        rows.extend(group.rows(options.runs))
        if options.out:  # after each group, so that an interruption keeps what was measured
            options.out.write_text(table(rows, options.runs), encoding="utf-8")
    if not options.out:
        print(table(rows, options.runs))


def table(rows: list[dict[str, str]], runs: int) -> str:
    """The rows in Markdown, with the machine and the versions named."""
    packages = (
        "gne-mj", "mujoco", "numba", "numpy", "scipy", "nashopt", "jax", "mujoco-mjx", "diffrax",
        "cbfpy", "elastiqp", "qpax",
    )  # fmt: skip
    versions = ", ".join(f"{name} {version(name)}" for name in packages)
    lines = [
        "# Benchmarks",
        "",
        f"Medians of {runs} turns in one process, compiled and warm, one thread where no"
        f" cores are named. Machine: {_processor()}; Python {platform.python_version()},"
        f" {versions}. Repeat with `scripts/benchmark`.",
        "",
        "| what | ours | other | ratio | target |",
        "|---|---|---|---|---|",
        *(
            f"| {row['what']} | {row['ours']} | {row['other']} | {row['ratio']} | {row['target']} |"
            for row in rows
        ),
    ]
    return "\n".join(lines) + "\n"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
