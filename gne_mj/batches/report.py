"""Tables and the figure of a batch's folder."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gne_mj import plots
from gne_mj.batch_variables import figures
from gne_mj.batches.engine_check import STATES, SUMMARIES
from gne_mj.batches.integrity import reading
from gne_mj.batches.store import RUNS, Store
from gne_mj.errors import InvalidInput
from gne_mj.files import refuse_existing, written
from gne_mj.run_metrics import SUCCESSES

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True)
class Report:
    """What was written of a batch.

    Attributes:
        runs: what is one number (or word) a run, of the runs that are stored.
        table: one row for each combination, see :func:`combinations`.
        paths: of the files.
        check: how far runs in MuJoCo are from their twins, see :func:`check_of`; None where that
            was not asked for.
    """

    runs: "xarray.Dataset"
    table: "pandas.DataFrame"
    paths: tuple[Path, ...]
    check: dict[str, Any] | None


def write_report(
    store: Store, target: Path, formats: tuple[str, ...] = ("png",), *, replace: bool
) -> Report:
    """Write ``combinations.csv``, ``runs.csv`` and the figure ``summary``.

    Args:
        store: of the batch, complete or not.
        target: folder to write to.
        formats: of the figure.
        replace: files of these names are replaced, each once the new one is whole.

    Raises:
        InvalidInput: no run is stored yet, something stored is missing or damaged, or files exist
            and may not be replaced.
        StorageError: the disk is full, or fails.
    """
    names = ["combinations.csv", "runs.csv", *(f"summary.{kind}" for kind in formats)]
    if not replace:
        refuse_existing("target", [target / name for name in names])
    runs = figures_of(store)
    if runs.sizes["run"] == 0:
        raise InvalidInput("store", str(store.folder), "it must hold at least one run")
    table, paths = combinations(runs), []
    for name, rows in (("combinations.csv", table), ("runs.csv", runs.to_dataframe())):
        with written("target", target / name, replace=True) as path:
            rows.to_csv(path, index=name == "runs.csv")
        paths.append(target / name)
    for kind in formats:
        with written("target", target / f"summary.{kind}", replace=True) as path:
            plots.save_batch(runs, path, kind)
        paths.append(target / f"summary.{kind}")
    return Report(runs, table, tuple(paths), check_of(runs))


def figures_of(store: Store) -> "xarray.Dataset":
    """What is one number (or word) a run, of the runs that are stored, in memory.

    Raises:
        InvalidInput: something of it is missing or damaged.
    """
    whole = store.dataset()
    one = [str(name) for name, variable in whole.data_vars.items() if variable.dims == ("run",)]
    kept = whole[one]
    others = [name for name, coordinate in kept.coords.items() if coordinate.dims != ("run",)]
    kept = kept.drop_vars(others)
    with reading(store.folder, store.folder / RUNS, map(str, kept.variables)):
        runs = kept.load()
    runs.attrs["planned"] = store.plan.runs
    return runs.isel(run=np.flatnonzero(runs["status"].notnull().to_numpy()))


def check_of(runs: "xarray.Dataset") -> dict[str, Any] | None:
    """How far runs that were made in MuJoCo too are from their twins; None if none were to be.

    Returns:
        runs: how many, of those that are stored; ended_differently: of these, those that ended
        early in one engine only; and of the others the greatest state_difference and
        summary_difference, each with its run (null where there is none).
    """
    if STATES not in runs:
        return None
    states, figures = runs[STATES].to_numpy(), runs[SUMMARIES].to_numpy()
    unlike = np.isinf(states) | np.isinf(figures)
    found: dict[str, Any] = {
        "runs": int(np.sum(~np.isnan(states))), "ended_differently": int(np.sum(unlike)),
    }  # fmt: skip
    for key, values in (("state_difference", states), ("summary_difference", figures)):
        known = np.flatnonzero(np.isfinite(values))
        worst = known[np.argmax(values[known])] if len(known) else None
        found[key] = None if worst is None else float(values[worst])
        found[f"{key}_run"] = None if worst is None else int(runs["run"].to_numpy()[worst])
    return found


def checked(check: dict[str, Any]) -> str:
    """That in one line."""
    words = f"checked in MuJoCo: {check['runs']:,} runs"
    if check["state_difference"] is not None:
        words += f"; states differ by {check['state_difference']:.2g} at most, summaries by"
        words += f" {check['summary_difference']:.2g}"
    if check["ended_differently"]:
        words += f"; {check['ended_differently']:,} ended differently"
    return words


def combinations(runs: "xarray.Dataset") -> "pandas.DataFrame":
    """One row for each combination of swept values: how its runs ended, and their figures.

    In medians a run that did not settle, or left, counts as slower, or farther, than any other;
    where such runs are in the middle there is none. The greatest final error is of those that
    stayed.
    """
    import pandas

    keys = list(runs.attrs["swept"])
    frame = runs.to_dataframe()
    groups: Any = frame.groupby(keys, sort=False) if keys else [((), frame)]
    rows = []
    for values, own in groups:
        row: dict[str, Any] = dict(zip(keys, values, strict=True))
        stayed = own["status"].isin(SUCCESSES)
        row |= {
            "runs": len(own),
            "ended_early": int((~stayed).sum()),
            "converged": int((own["status"] == "converged").sum()),
        }
        for figure in figures():
            for column in figure.columns if figure.name in own else ():
                value = column.of(own[figure.name])
                row[column.name] = np.nan if np.isinf(value) else value
        rows.append(row)
    return pandas.DataFrame(rows)


def summary(table: "pandas.DataFrame", keys: list[str], rows: int = 24) -> Iterator[str]:
    """The table of combinations in words, in lines; no more than so many.

    Settling times are medians over all runs ("-" where half of them or more did not settle); worst
    margins and final errors are the worst, of runs that have one.
    """
    names = {
        **{key: key for key in keys},
        "runs": "runs",
        "ended_early": "ended early",
        **{
            column.name: column.title
            for figure in figures()
            for column in figure.columns
            if column.title and column.name in table
        },
    }
    shown = table.head(rows)
    cells = [[_cell(row[key]) for key in names] for _, row in shown.iterrows()]
    widths = [
        max(len(title), *(len(line[at]) for line in cells))
        for at, title in enumerate(names.values())
    ]
    for line in ([*names.values()], *cells):
        yield "  ".join(f"{cell:>{width}}" for cell, width in zip(line, widths, strict=True))
    if len(table) > rows:
        yield f"... and {len(table) - rows} more combinations: see combinations.csv"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "-" if np.isnan(value) else f"{value:.4g}"
    return str(value)
