"""Figures: actions and derived quantities of a trajectory, and a path of equilibria.

Reads results only.

What is drawn follows from the trajectory alone, so a game of one's own is drawn like any other.
"""

import json
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.exit_map import Cell
from gne_mj.solve import Solution
from gne_mj.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "pdf", "svg")

# Readable in grey: lines differ in dash as well as in colour (Okabe and Ito's palette).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9")
_DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)), (0, (1, 1)))
# Beyond this many lines a legend says less than it hides.
_LEGEND = 12
_STYLE: Any = {
    "font.size": 9,
    "font.family": "serif",
    "mathtext.fontset": "cm",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "svg.hashsalt": "gne-mj",
}


def draw(trajectory: Trajectory) -> dict[str, "Figure"]:
    """All figures of a trajectory's systems, by name.

    For each system its actions, one panel for each of their axes, as ``robots-velocities``, and
    each quantity that its game derives, with its bounds, as ``robots-gaps`` or, where it is one
    number, ``channels-total-power``.
    """
    import matplotlib

    matplotlib.use("Agg")
    figures = {}
    with matplotlib.rc_context(_STYLE):
        for name in trajectory.tree.children:
            data = trajectory[name]
            figures[f"{name}-{_plural(data['action'].attrs['long_name'])}"] = _actions(data)
            for quantity in json.loads(data.attrs["quantities"]):
                title = quantity if data[quantity].ndim == 1 else _plural(quantity)
                figures[f"{name}-{title.replace('_', '-')}"] = _quantity(data, quantity)
    return figures


def save(
    trajectory: Trajectory, folder: str | Path, formats: tuple[str, ...] = ("png",)
) -> list[Path]:
    """Write every figure of :func:`draw` into a folder; returns the files' paths."""
    import matplotlib.pyplot as plt

    paths = []
    for name, figure in draw(trajectory).items():
        for kind in formats:
            path = Path(folder) / f"{name}.{kind}"
            figure.savefig(path, dpi=200)
            paths.append(path)
        plt.close(figure)
    return paths


def save_path(solution: Solution, file: Path) -> None:
    """Draw how a path of equilibria nears the variational GNE as rho falls, in log scales."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rho = np.array([point.equilibrium.rho for point in solution.path])
    lines = {
        "distance to the vGNE": [point.distance for point in solution.path],
        "measured $\\epsilon$": [np.max(point.gains) for point in solution.path],
        "$p\\rho$": solution.game.constraints_count * rho,
    }
    with plt.rc_context(_STYLE):
        figure, axes = plt.subplots(figsize=(4.6, 2.9), layout="constrained")
        for index, (label, values) in enumerate(lines.items()):
            nowhere = not np.any(np.asarray(values) > 0.0)  # log scales have no place for zero
            label += " (zero)" if nowhere else ""
            axes.loglog(rho, values, label=label, **_line_style(index))
        axes.set_xlabel("penalty parameter $\\rho$")
        axes.legend()
        figure.savefig(file, dpi=200)
    plt.close(figure)


def save_map(cells: Sequence[Cell], file: Path) -> None:
    """Draw where the set was left: a panel for each mode and push, period against start margin.

    Colour is the share of runs that left; a cross marks cells in which one was first seen outside
    at a control instant, a ring those that were left between instants only, a bar those that were
    refused.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    modes = list(dict.fromkeys(cell.mode for cell in cells))
    pushes = sorted({cell.push for cell in cells})
    periods = sorted({cell.period for cell in cells})
    margins = sorted({cell.margin for cell in cells})
    with plt.rc_context({**_STYLE, "axes.grid": False}):
        figure, grid = plt.subplots(
            len(modes), len(pushes), figsize=(1.4 + 2.3 * len(pushes), 0.9 + 1.9 * len(modes)),
            layout="constrained", sharex=True, sharey=True, squeeze=False,
        )  # fmt: skip
        for axes, (mode, push) in zip(grid.flat, product(modes, pushes), strict=True):
            share = np.full((len(margins), len(periods)), np.nan)
            marks: dict[str, list[tuple[int, int]]] = {"x": [], "o": [], "_": []}
            for cell in cells:
                if (cell.mode, cell.push) != (mode, push):
                    continue
                at = margins.index(cell.margin), periods.index(cell.period)
                share[at] = cell.share
                if cell.refused == cell.runs:
                    marks["_"].append(at)
                elif cell.left_at_instant + cell.no_action:
                    marks["x"].append(at)
                elif cell.left_between:
                    marks["o"].append(at)
            image = axes.imshow(
                share, origin="lower", aspect="auto", cmap="Blues", vmin=0.0, vmax=1.0
            )
            for marker, places in marks.items():
                if places:
                    rows, columns = np.array(places).T
                    axes.plot(
                        columns, rows, marker, color="#B00020", markersize=4.5, fillstyle="none",
                        markeredgewidth=1.0,
                    )  # fmt: skip
            axes.set_title(f"{mode}, push {push:g}", fontsize=8.5)
            short = [f"{float(f'{1e3 * period:.2g}'):g}" for period in periods]
            axes.set_xticks(range(len(periods)), short)
            axes.set_yticks(range(len(margins)), [f"{m:.1g}" for m in margins])
            axes.tick_params(labelsize=7)
        for axes in grid[-1]:
            axes.set_xlabel("control period (ms)")
        for axes in grid[:, 0]:
            axes.set_ylabel("margin of the start")
        figure.colorbar(image, ax=grid, label="share that left the set", shrink=0.8)
        figure.savefig(file, dpi=180)
    plt.close(figure)


def _plural(noun: str) -> str:
    noun = noun.replace(" ", "-")
    return f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"


def _figure(data: "xarray.Dataset", panels: int, width: float) -> tuple["Figure", list["Axes"]]:
    """Empty panels above each other, over time."""
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        panels, 1, figsize=(width, 1.0 + 1.9 * panels), layout="constrained", sharex=True,
        squeeze=False,
    )  # fmt: skip
    time = data["time"].to_numpy()
    axes: list[Axes] = list(grid[:, 0])
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(time[0], max(time[-1], time[0] + 1e-9))
    if data.attrs["status"] not in ("converged", "completed"):
        axes[0].set_title(data.attrs["status"].replace("_", " "), color="#B00020", fontsize=9)
        for panel in axes:
            panel.axvline(time[-1], color="#B00020", linewidth=1.0)
    return figure, axes


def _legend(figure: "Figure", axes: "Axes", title: str | None) -> None:
    """Beside the axes, so that it hides nothing."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside right center", title=title, handlelength=2.4)


def _actions(data: "xarray.Dataset") -> "Figure":
    """Every agent's action, a panel for each axis."""
    action = data["action"]
    values = action.to_numpy()
    if action.dims[1] == "agent":
        panels = {"": (values, data["agent"].to_numpy())}
    else:
        axis, owner = data["axis"].to_numpy(), data["owner"].to_numpy()
        panels = {
            str(name): (values[:, axis == name], owner[axis == name])
            for name in dict.fromkeys(axis.tolist())
        }
    figure, axes = _figure(data, len(panels), 4.6)
    for panel, (name, (columns, owners)) in zip(axes, panels.items(), strict=True):
        names = [str(number) for number in owners]
        _lines(panel, data["time"].to_numpy(), columns, owners - 1, names)
        symbol = f"y_{{i,{name}}}" if name else "y_i"
        panel.set_ylabel(_label(action.attrs["long_name"], symbol, action.attrs["units"]))
    _legend(figure, axes[0], data.attrs["agent_name"])
    return figure


def _quantity(data: "xarray.Dataset", name: str) -> "Figure":
    """A derived quantity with its bounds."""
    quantity = data[name]
    values = quantity.to_numpy().reshape(len(quantity), -1)
    single, of_agents = quantity.ndim == 1, "agent" in quantity.dims
    names = [str(n) for n in data["agent" if of_agents else "constraint_name"].to_numpy()]
    figure, (axes,) = _figure(data, 1, 4.6 if single or of_agents else 5.6)
    numbers = np.arange(values.shape[1])
    _lines(axes, data["time"].to_numpy(), values, numbers, [] if single else names)
    labelled = False
    for bound in (f"{name}_bound", f"{name}_lower_bound"):
        if bound in data:
            _bounds(axes, np.atleast_1d(data[bound].to_numpy()), "bound" if not labelled else None)
            labelled = True
    axes.set_ylabel(_label(*(quantity.attrs[key] for key in ("long_name", "symbol", "units"))))
    _legend(figure, axes, data.attrs["agent_name"] if of_agents else None)
    return figure


def _label(words: str, symbol: str, unit: str) -> str:
    return " ".join([words, *([f"${symbol}$"] if symbol else []), *([f"({unit})"] if unit else [])])


def _line_style(number: int) -> dict[str, Any]:
    return {
        "color": _COLOURS[number % len(_COLOURS)],
        "linestyle": _DASHES[(number + number // len(_COLOURS)) % len(_DASHES)],
    }


def _lines(
    axes: "Axes",
    time: NDArray[np.float64],
    values: NDArray[np.float64],
    numbers: NDArray[np.int64],
    names: list[str],
) -> None:
    """One line a column; columns of one number look alike in every panel."""
    labels = names if len(names) <= _LEGEND else []
    for index, number in enumerate(numbers):
        label = labels[index] if labels else None
        axes.plot(time, values[:, index], label=label, **_line_style(int(number)))


def _bounds(axes: "Axes", bounds: NDArray[np.float64], label: str | None) -> None:
    """Each bound once: in black, or in its line's colour where it is one line's of several."""
    values, first, counts = np.unique(bounds, return_index=True, return_counts=True)
    for value, number, count in zip(values, first, counts, strict=True):
        own = count == 1 and len(bounds) > 1
        colour = _line_style(int(number))["color"] if own else "black"
        axes.axhline(value, color=colour, linewidth=0.9, linestyle=(0, (4, 3)), label=label)
        label = None
