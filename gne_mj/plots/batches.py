"""The figure of a batch: margins, settling times and errors over the swept values."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.plots.style import STYLE, line_style

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

LINES = 5  # combinations of the other swept values that get a line each
_RED = "#B00020"


@dataclass(frozen=True)
class _Figure:
    """One of the run's figures: how it is called, drawn and made worst of."""

    name: str
    title: str
    log: bool
    worst: str  # "min" or "max" of the runs


_PANELS = (
    _Figure("least_margin", "worst margin", True, "min"),
    _Figure("settling_time", "settling time", False, "max"),
    _Figure("final_error", "final error", True, "max"),
)


def save_batch(runs: "xarray.Dataset", file: Path) -> None:
    """Draw a batch's summary: a panel for each figure, and one for the share of runs that left.

    Over the swept key with most numbers runs the horizontal axis; up to five combinations of the
    others get a line each, and more of them are put together. Lines are medians, bands hold 90% of
    the runs, small marks are the worst run. Without swept numbers there are histograms.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    runs = runs[[*(panel.name for panel in _PANELS), "status"]].load()
    runs = runs.isel(run=np.flatnonzero(runs["status"].notnull().to_numpy()))
    key = _horizontal(runs)
    left = ~np.isin(runs["status"].to_numpy(), ["converged", "completed"])
    panels = len(_PANELS) + bool(left.any())
    with plt.rc_context(STYLE):
        figure, grid = plt.subplots(
            1, panels, figsize=(2.9 * panels, 2.9), layout="constrained", squeeze=False
        )
        lines = _groups(runs, key)
        for axes, panel in zip(grid[0], _PANELS, strict=False):
            unit = runs[panel.name].attrs.get("units", "")
            label = f"{panel.title} ({unit})" if unit else panel.title
            if key is None:
                _histogram(axes, runs[panel.name].to_numpy(), label)
            else:
                _over(axes, runs, key, panel, lines)
                axes.set_ylabel(label)
        if left.any():
            _share(grid[0, -1], runs, key, left, lines)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        if len(labels) > 1:
            figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 5))
        figure.savefig(file, dpi=200)
    plt.close(figure)


def _horizontal(runs: "xarray.Dataset") -> str | None:
    """The swept key with most numbers; None if none has two."""
    counts = {
        key: len(np.unique(runs[key].to_numpy()))
        for key in runs.attrs["swept"]
        if runs[key].dtype.kind == "f"
    }
    best = max(counts, key=lambda key: counts[key], default=None)
    return best if best is not None and counts[best] > 1 else None


def _groups(runs: "xarray.Dataset", key: str | None) -> list[tuple[str, NDArray[np.bool_]]]:
    """The lines: what each is of, and which runs are its."""
    everyone = np.ones(runs.sizes["run"], dtype=bool)
    others = [other for other in runs.attrs["swept"] if other != key]
    values = list(zip(*(runs[other].to_numpy().tolist() for other in others), strict=True))
    distinct = list(dict.fromkeys(values))
    if not others or len(distinct) > LINES:
        return [("", everyone)]
    short = [other.rsplit(".", 1)[-1].replace("_", " ") for other in others]
    return [
        (
            ", ".join(f"{n} = {_word(v)}" for n, v in zip(short, one, strict=True)),
            np.array([value == one for value in values]),
        )
        for one in distinct
    ]


def _word(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _over(
    axes: "Axes",
    runs: "xarray.Dataset",
    key: str,
    panel: _Figure,
    lines: list[tuple[str, NDArray[np.bool_]]],
) -> None:
    swept, values = runs[key].to_numpy(), runs[panel.name].to_numpy()
    finite = values[np.isfinite(values)]
    axes.set_xlabel(key)
    if len(finite) == 0:
        _nothing(axes)
        return
    for number, (label, mine) in enumerate(lines):
        xs = np.unique(swept[mine])
        table = np.full((len(xs), 4), np.nan)
        for row, x in enumerate(xs):
            found = values[mine & (swept == x)]
            found = found[np.isfinite(found)]
            if len(found):
                worst = found.min() if panel.worst == "min" else found.max()
                table[row] = *np.quantile(found, [0.05, 0.5, 0.95]), worst
        style = line_style(number)
        axes.plot(xs, table[:, 1], label=label or None, **style)
        axes.fill_between(
            xs, table[:, 0], table[:, 2], color=style["color"], alpha=0.12, linewidth=0
        )
        axes.plot(xs, table[:, 3], ".", color=style["color"], markersize=3)
    if panel.worst == "min" and finite.min() < 0.0:  # beyond the bound
        axes.axhline(0.0, color=_RED, linewidth=0.9, linestyle=(0, (4, 3)))
    if _is_log(swept):
        axes.set_xscale("log")
    if panel.log and _is_log(finite):
        axes.set_yscale("log")


def _share(
    axes: "Axes",
    runs: "xarray.Dataset",
    key: str | None,
    left: NDArray[np.bool_],
    lines: list[tuple[str, NDArray[np.bool_]]],
) -> None:
    axes.set_ylabel("share of runs that left the set")
    axes.set_ylim(0.0, 1.0)
    if key is None:
        names = [label or "all" for label, _ in lines]
        axes.bar(names, [left[mine].mean() for _, mine in lines], color=_RED, width=0.5)
        return
    swept = runs[key].to_numpy()
    for number, (_, mine) in enumerate(lines):
        xs = np.unique(swept[mine])
        shares = [left[mine & (swept == x)].mean() for x in xs]
        axes.plot(xs, shares, marker=".", **line_style(number))
    if _is_log(swept):
        axes.set_xscale("log")
    axes.set_xlabel(key)


def _histogram(axes: "Axes", values: NDArray[np.float64], label: str) -> None:
    values = values[np.isfinite(values)]
    if len(values):
        axes.hist(values, bins=min(40, max(5, len(values) // 5)), color=line_style(0)["color"])
    else:
        _nothing(axes)
    axes.set_xlabel(label)
    axes.set_ylabel("runs")


def _nothing(axes: "Axes") -> None:
    axes.text(0.5, 0.5, "no run has one", ha="center", transform=axes.transAxes)
    axes.set(xticks=[], yticks=[])


def _is_log(values: NDArray[np.float64]) -> bool:
    """Whether they look spaced in proportion."""
    return bool(values.min() > 0 and values.max() > 20.0 * values.min())
