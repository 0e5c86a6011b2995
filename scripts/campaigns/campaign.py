"""What the campaigns over seeds share: their command line, their jobs and what they write."""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from draws import progress

Row = dict[str, Any]
RUNS_A_JOB = 10
CRASHED = "crashed"  # the status of a draw that raised what it should not


def parser(name: str, about: str | None, runs: int) -> argparse.ArgumentParser:
    """The command line of a campaign with so many runs."""
    made = argparse.ArgumentParser(prog=name, description=about)
    made.add_argument("--runs", type=int, default=runs)
    made.add_argument("--seed", type=int, default=0)
    made.add_argument("--first", type=int, default=0, help="index of the first run")
    made.add_argument("--index", type=int, help="repeat this one alone")
    made.add_argument("--processes", type=int, default=2)
    made.add_argument("--out", type=_new_file, help="JSON file for the rows of all that is notable")
    return made


def _new_file(text: str) -> Path:
    path = Path(text)
    if path.exists():
        raise argparse.ArgumentTypeError(f"{path} exists already; name another file")
    return path


def crash(index: int, error: Exception, **more: Any) -> Row:
    """The row of a draw that raised what it should not, with what else the campaign's rows have."""
    message = f"{type(error).__name__}: {error}"
    return {"index": index, "kind": "any", "status": CRASHED, "message": message, **more}


def by_kind(rows: list[Row], kinds: Sequence[str]) -> Iterator[tuple[str, list[Row]]]:
    """The rows of each kind, and of "all", that did not crash; kinds without any are left out."""
    ran = [row for row in rows if row["status"] != CRASHED]
    for kind in (*kinds, "all"):
        if own := [row for row in ran if kind in (row["kind"], "all")]:
            yield kind, own


def campaign(
    options: argparse.Namespace,
    one: Callable[[int, int], Row],
    crashed: Callable[[int, Exception], Row],
    report: Callable[[list[Row]], tuple[list[str], int]],
    notable: Callable[[Row], bool],
) -> int:
    """Run all, or the one that is asked for, and print the tables.

    Args:
        options: of :func:`parser`.
        one: the row of a seed and an index; a function of a module, for other processes.
        crashed: the row of an index where ``one`` raised what it does not expect.
        report: lines to print, and how many rows are broken.
        notable: whether a row is kept in the file.

    Returns:
        1 if a row is broken, else 0.
    """
    started = time.perf_counter()
    if options.index is not None:
        print(json.dumps(one(options.seed, options.index), indent=2))
        return 0
    end = options.first + options.runs
    jobs = [
        (one, crashed, options.seed, first, min(first + RUNS_A_JOB, end))
        for first in range(options.first, end, RUNS_A_JOB)
    ]
    rows: list[Row] = []
    with ProcessPoolExecutor(options.processes) as pool:
        for part in progress(pool.map(_job, jobs), len(jobs), "jobs"):
            rows += part
    lines, broken = report(rows)
    print("\n".join([*lines, "", f"{time.perf_counter() - started:.0f} s"]))
    if options.out:
        kept = [row for row in rows if notable(row)]
        made = {"seed": options.seed, "first": options.first, "runs": len(rows), "notable": kept}
        text = json.dumps(made, indent=1)
        options.out.write_text(text + "\n", encoding="utf-8")
    return 1 if broken else 0


def _job(job: tuple) -> list[Row]:
    one, crashed, seed, first, last = job
    rows = []
    for index in range(first, last):
        try:
            rows.append(one(seed, index))
        except Exception as error:  # what it does not expect ends no campaign
            rows.append(crashed(index, error))
    return rows
