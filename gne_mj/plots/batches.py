"""The figure of a batch: margins, settling times and errors over the swept values."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.batch_variables import figures
from gne_mj.plots.style import line_style, styled, subplots
from gne_mj.run_metrics import SUCCESSES
from gne_mj.variables import Panel

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINES = 5  # combinations of the other swept values that get a line each
_RED = "#B00020"


def save_batch(runs: "xarray.Dataset", file: Path, kind: str = "png") -> None:
    """Draw a batch's summary: a panel for each figure, and the share of runs that ended early.

    Over the swept key with most numbers runs the horizontal axis; up to five combinations of the
    others get a line each, and more of them are put together. Lines are medians, bands hold 90% of
    the runs, dots are the worst run. Runs that did not settle, or left, count as slower, or
    farther, than all others, so that a line ends where they are in the middle. Without swept
    numbers the combinations stand side by side; without any there are histograms.

    Args:
        runs: figures of the runs, one each; attribute "planned" has how many there will be.
        file: to write.
        kind: of file: png, pdf or svg.
    """
    key = _horizontal(runs)
    lines = _groups(runs, key)
    early = ~np.isin(runs["status"].to_numpy(), SUCCESSES)
    shown = [(each.name, each.panel) for each in figures() if each.panel and each.name in runs]
    panels = len(shown) + bool(early.any())
    with styled():
        figure, grid = subplots(1, panels, 2.9 * panels, 2.9, sharex=key is not None)
        for axes, (name, panel) in zip(grid[0], shown, strict=False):
            unit, values = runs[name].attrs.get("units", ""), runs[name].to_numpy()
            label = f"{panel.title} ({unit})" if unit else panel.title
            if key is not None:
                _over(axes, runs[key].to_numpy(), values, panel, lines)
            elif len(lines) > 1:
                _beside(axes, values, panel, lines)
            else:
                _histogram(axes, values, label)
                continue
            axes.set_ylabel(label)
        if early.any():
            _share(grid[0, -1], runs, key, early, lines)
        if key is not None:
            for axes in grid[0]:
                axes.set_xlabel(key)
                _mark(axes, runs[key].to_numpy())
        if key is not None or len(lines) > 1:
            _explain(figure, grid[0, 0], _others(runs, key), "lines" if key else "dashes")
        planned = runs.attrs.get("planned", runs.sizes["run"])
        if planned > runs.sizes["run"]:
            figure.suptitle(f"partial: {runs.sizes['run']:,} of {planned:,} runs", fontsize=8.5)
        figure.savefig(file, dpi=200, format=kind)


def _explain(figure: "Figure", axes: "Axes", others: list[str], medians: str) -> None:
    """Below the panels, what is drawn: a legend, or words about all values of the other keys."""
    words = f"{medians}: medians of the runs; bands: 90% of them; dots: the worst"
    handles, labels = axes.get_legend_handles_labels()
    if len(labels) > 1:
        figure.legend(
            handles, labels, loc="outside lower center", ncols=min(len(labels), 5), title=words,
            title_fontsize=7.5,
        )  # fmt: skip
    elif others and medians == "lines":
        figure.supxlabel(f"{words}; all values of {', '.join(others)}", fontsize=7.5)
    else:
        figure.supxlabel(words, fontsize=7.5)


def _others(runs: "xarray.Dataset", key: str | None) -> list[str]:
    """Swept keys but this one."""
    return [other for other in runs.attrs["swept"] if other != key]


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
    others = _others(runs, key)
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


def _spread(values: NDArray[np.float64], panel: Panel) -> tuple[float, float, float, float]:
    """5%, 50% and 95% of the runs, and the worst; not a number where a run has no figure."""
    if len(values) == 0:
        return np.nan, np.nan, np.nan, np.nan
    known = np.where(np.isnan(values), -np.inf if panel.worst == "min" else np.inf, values)
    low, middle, high = np.quantile(known, [0.05, 0.5, 0.95], method="inverted_cdf")
    worst = known.min() if panel.worst == "min" else known.max()
    low, middle, high, worst = (float(v) if np.isfinite(v) else np.nan
                                for v in (low, middle, high, worst))  # fmt: skip
    return low, middle, high, worst


def _over(
    axes: "Axes",
    swept: NDArray[Any],
    values: NDArray[np.float64],
    panel: Panel,
    lines: list[tuple[str, NDArray[np.bool_]]],
) -> None:
    for number, (label, mine) in enumerate(lines):
        xs = np.unique(swept[mine])
        table = np.array([_spread(values[mine & (swept == x)], panel) for x in xs])
        low, middle, high, worst = table.T
        style = line_style(number)
        axes.plot(xs, middle, label=label or None, **style)
        top = _top(low, high, values)
        axes.fill_between(xs, low, top, color=style["color"], alpha=0.12, linewidth=0)
        axes.plot(xs, worst, ".", color=style["color"], markersize=3)
    _scale(axes, values, panel)


def _top(low: Any, high: Any, values: NDArray[np.float64]) -> Any:
    """Where a band ends: at the highest of all figures where runs at its end have none."""
    return np.where(np.isnan(high) & ~np.isnan(low), np.nanmax(values, initial=0.0), high)


def _beside(
    axes: "Axes",
    values: NDArray[np.float64],
    panel: Panel,
    lines: list[tuple[str, NDArray[np.bool_]]],
) -> None:
    """One bar for each combination, where there are words in place of numbers."""
    for number, (_, mine) in enumerate(lines):
        low, middle, high, worst = _spread(values[mine], panel)
        colour, top = line_style(number)["color"], _top(low, high, values)
        axes.plot([number, number], [low, top], color=colour, linewidth=6, alpha=0.3)
        axes.plot(number, middle, "_", color=colour, markersize=14, markeredgewidth=2)
        axes.plot(number, worst, ".", color=colour, markersize=5)
    _name(axes, lines)
    _scale(axes, values, panel)


def _name(axes: "Axes", lines: list[tuple[str, NDArray[np.bool_]]]) -> None:
    """The combinations along the horizontal axis."""
    words = [label.replace(", ", "\n").replace(" = ", "\n") for label, _ in lines]
    axes.set_xticks(range(len(lines)), words, fontsize=7)
    axes.set_xlim(-0.6, len(lines) - 0.4)


def _scale(axes: "Axes", values: NDArray[np.float64], panel: Panel) -> None:
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        axes.text(0.5, 0.5, "no run has one", ha="center", transform=axes.transAxes)
        axes.set_yticks([])
        return
    if panel.worst == "min" and finite.min() < 0.0:  # beyond the bound
        axes.axhline(0.0, color=_RED, linewidth=0.9, linestyle=(0, (4, 3)))
    if panel.log and _is_log(finite):
        from matplotlib.ticker import NullFormatter

        axes.set_yscale("log")
        axes.yaxis.set_minor_formatter(NullFormatter())


def _mark(axes: "Axes", swept: NDArray[np.float64]) -> None:
    """The horizontal axis over swept numbers."""
    from matplotlib.ticker import NullFormatter

    xs = np.unique(swept)
    if _is_log(swept):
        axes.set_xscale("log")
        axes.xaxis.set_minor_formatter(NullFormatter())
        ratio = (xs[-1] / xs[0]) ** 0.03
        axes.set_xlim(xs[0] / ratio, xs[-1] * ratio)
    else:
        margin = 0.03 * (xs[-1] - xs[0])
        axes.set_xlim(xs[0] - margin, xs[-1] + margin)


def _share(
    axes: "Axes",
    runs: "xarray.Dataset",
    key: str | None,
    early: NDArray[np.bool_],
    lines: list[tuple[str, NDArray[np.bool_]]],
) -> None:
    axes.set_ylabel("share of runs that ended early")
    axes.set_ylim(-0.03, 1.03)
    if key is None:
        for number, (_, mine) in enumerate(lines):
            axes.bar(number, early[mine].mean(), color=line_style(number)["color"], width=0.5)
        _name(axes, lines if len(lines) > 1 else [("all", early)])
        return
    swept = runs[key].to_numpy()
    for number, (_, mine) in enumerate(lines):
        xs = np.unique(swept[mine])
        shares = [early[mine & (swept == x)].mean() for x in xs]
        axes.plot(xs, shares, marker=".", **line_style(number))


def _histogram(axes: "Axes", values: NDArray[np.float64], label: str) -> None:
    values = values[np.isfinite(values)]
    if len(values):
        axes.hist(values, bins=min(40, max(5, len(values) // 5)), color=line_style(0)["color"])
    else:
        axes.text(0.5, 0.5, "no run has one", ha="center", transform=axes.transAxes)
    axes.set_xlabel(label)
    axes.set_ylabel("runs")


def _is_log(values: NDArray[np.float64]) -> bool:
    """Whether they look spaced in proportion."""
    return bool(values.min() > 0 and values.max() > 20.0 * values.min())
