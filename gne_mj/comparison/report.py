"""What is written of a comparison: a table in three formats, and a figure."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gne_mj.files import written
from gne_mj.run_metrics import SUCCESSES

if TYPE_CHECKING:
    import pandas
    import xarray

NAMES = ("comparison.md", "comparison.csv", "comparison.json")
ROUNDING = 1e-9  # of a bound, or of g: what is outside by less is on the boundary
_QUANTILES = {"median": 0.5, "90%": 0.9, "worst": 1.0}


class Shown(NamedTuple):
    """A column of the table: a figure of runs and which of its quantiles."""

    title: str
    name: str
    quantiles: tuple[str, ...] = ("median",)


COLUMNS = (
    Shown("violation", "largest_violation", ("median", "90%", "worst")),
    Shown("of the bound", "violation_of_bound", ("worst",)),
    Shown("outside (s)", "time_outside", ("median", "worst")),
    Shown("integral", "violation_integral", ("median",)),
    Shown("settling (s)", "settling_time_to_variational", ("median", "90%")),
    Shown("final error", "final_error_to_variational", ("median", "90%")),
    Shown("epsilon", "epsilon"),
    Shown("RMS input", "rms_input"),
    Shown("peak input", "peak_input", ("median", "worst")),
)


def table(data: "xarray.Dataset") -> "pandas.DataFrame":
    """A row for each law: how many runs stayed inside, came to their end, and quantiles of figures.

    Runs that were outside by rounding alone, as of laws that ride on the boundary, count as inside.
    Settling counts runs that did not settle as slower than all others, final errors runs that ended
    as farther: infinite where that many did.
    """
    import pandas

    rows = []
    for law in data["law"].to_numpy():
        own = data.sel(law=law)
        status = own["status"].to_numpy()
        inside = _inside(own)
        own = own.assign(
            {name: own[name].where(~inside, 0.0) for name in ("time_outside", "violation_integral")}
        )
        row: dict[str, Any] = {
            "law": str(law), "mode": str(own["mode"].item()),
            "certified": str(own["certified"].item()), "runs": len(status),
            "inside": int(inside.sum()),
            "to the end": int(np.isin(status, [*SUCCESSES, "went_outside"]).sum()),
        }  # fmt: skip
        for column in COLUMNS:
            values = own[column.name].to_numpy()
            row |= {
                f"{column.title}, {which}": _quantile(column.name, values, _QUANTILES[which])
                for which in column.quantiles
            }
        row["messages"] = float(own["messages"])
        row["step (us)"] = 1e6 * float(own["step_time"])
        row["gains"] = str(own["gains"].item())
        rows.append(row)
    return pandas.DataFrame(rows)


def _inside(own: "xarray.Dataset") -> Any:
    """(runs,) whether a run was never outside by more than rounding."""
    part = np.nan_to_num(own["violation_of_bound"].to_numpy(), nan=np.inf)
    return np.minimum(part, own["largest_violation"].to_numpy()) <= ROUNDING


def _quantile(name: str, values: Any, share: float) -> float:
    """Of runs; what is not known of some counts as more than all others where that is its sense."""
    if name.startswith(("settling", "final")):
        values = np.where(np.isnan(values), np.inf, values)
    values = values[~np.isnan(values)]
    return float(np.quantile(values, share, method="inverted_cdf")) if len(values) else np.nan


def markdown(rows: "pandas.DataFrame") -> str:
    """The table as Markdown has it."""
    lines = [[*rows.columns], ["---"] * len(rows.columns)]
    lines += [[_cell(value) for value in row] for row in rows.itertuples(index=False)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        if np.isnan(value):
            return "-"
        return "not" if np.isinf(value) else f"{value:.3g}"
    return str(value)


def lines(data: "xarray.Dataset") -> list[str]:
    """The table in words, with the columns that a terminal has room for."""
    rows = table(data)
    shown = {
        "law": "law", "inside": "inside", "violation, worst": "violation",
        "outside (s), median": "outside (s)", "settling (s), median": "settling (s)",
        "final error, median": "final error", "RMS input, median": "RMS input",
        "step (us)": "step (us)", "gains": "gains",
    }  # fmt: skip
    cells = [[*shown.values()]]
    cells += [[_cell(row[key]) for key in shown] for row in rows.to_dict("records")]
    widths = [max(len(line[at]) for line in cells) for at in range(len(shown))]
    found = [
        "  ".join(f"{cell:>{w}}" for cell, w in zip(line, widths, strict=True)) for line in cells
    ]
    refused = json.loads(data.attrs["refused"])
    return [*found, *(f"not for this scenario: {law} ({why})" for law, why in refused.items())]


def write(data: "xarray.Dataset", folder: Path) -> list[Path]:
    """Write the table as Markdown, CSV and JSON, and the figure; earlier ones are replaced.

    Returns:
        The files.
    """
    from gne_mj.plots.comparison import save_comparison

    rows = table(data)
    texts = (markdown(rows) + _not_there(data), rows.to_csv(index=False), _json(data, rows))
    paths = []
    for name, text in zip(NAMES, texts, strict=True):
        with written("out", folder / name, replace=True) as new:
            new.write_text(text, encoding="utf-8")
        paths.append(folder / name)
    with written("out", folder / "comparison.png", replace=True) as new:
        save_comparison(data, new)
    return [*paths, folder / "comparison.png"]


def _not_there(data: "xarray.Dataset") -> str:
    refused = json.loads(data.attrs["refused"])
    return "".join(f"\nNot for this scenario: {law} ({why}).\n" for law, why in refused.items())


def _json(data: "xarray.Dataset", rows: "pandas.DataFrame") -> str:
    """All that decides the table, and the table; what is infinite or not known is null."""
    attributes = {
        key: json.loads(value) if key in ("scenario", "refused", "versions") else value
        for key, value in data.attrs.items()
    }
    laws = json.loads(rows.replace([np.inf, -np.inf], np.nan).to_json(orient="records"))
    return json.dumps({**attributes, "laws": laws}, indent=2) + "\n"
