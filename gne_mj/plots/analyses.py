"""Figures of analyses: a path of equilibria, a map of where a set is left."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from gne_mj.exit_map import Cell
from gne_mj.plots.style import line_style, styled, subplots
from gne_mj.solutions import Solution, bounds_of


def save_path(solution: Solution, file: Path) -> None:
    """Draw how a path of equilibria nears the variational GNE as rho falls, in log scales."""
    rho = np.array([point.equilibrium.rho for point in solution.path])
    lines = {
        "distance to the vGNE": [point.distance for point in solution.path],
        "measured $\\epsilon$": [np.max(point.gains) for point in solution.path],
        "its bound": [
            bounds_of(solution.game, point)["bound"] or np.nan for point in solution.path
        ],
    }
    with styled():
        figure, ((axes,),) = subplots(1, 1, 4.6, 2.9)
        for index, (label, values) in enumerate(lines.items()):
            nowhere = not np.any(np.asarray(values) > 0.0)  # log scales have no place for zero
            label += " (zero)" if nowhere else ""
            axes.loglog(rho, values, label=label, **line_style(index))
        axes.set_xlabel("penalty parameter $\\rho$")
        axes.legend()
        figure.savefig(file, dpi=200)


# Of a cell of the map: where it was left first
MARKS = {"x": "at a control instant", "o": "between instants only", "_": "refused"}


def save_map(cells: Sequence[Cell], file: Path) -> None:
    """Draw where the set was left: a panel for each mode and push, period against start margin.

    Colour is the share of runs that left; a cross marks cells in which one was first seen outside
    at a control instant, a ring those that were left between instants only, a bar those that were
    refused.
    """
    modes = list(dict.fromkeys(cell.mode for cell in cells))
    pushes = sorted({cell.push for cell in cells})
    periods = sorted({cell.period for cell in cells})
    margins = sorted({cell.margin for cell in cells})
    with styled(**{"axes.grid": False}):
        figure, grid = subplots(
            len(modes), len(pushes), 1.4 + 2.3 * len(pushes), 0.9 + 1.9 * len(modes),
            sharex=True, sharey=True,
        )  # fmt: skip
        known: dict[str, Any] = {}
        for axes, (mode, push) in zip(grid.flat, product(modes, pushes), strict=True):
            share = np.full((len(margins), len(periods)), np.nan)
            marks: dict[str, list[tuple[int, int]]] = {marker: [] for marker in MARKS}
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
                    known[marker] = axes.plot(
                        columns, rows, marker, color="#B00020", markersize=4.5, fillstyle="none",
                        markeredgewidth=1.0,
                    )[0]  # fmt: skip
            axes.set_title(f"{mode}, push {push:g}", fontsize=8.5)
            short = [f"{float(f'{1e3 * period:.2g}'):g}" for period in periods]
            axes.set_xticks(range(len(periods)), short)
            axes.set_yticks(range(len(margins)), [f"{m:.1g}" for m in margins])
            axes.tick_params(labelsize=7)
        for axes in grid[-1]:
            axes.set_xlabel("control period (ms)")
        for axes in grid[:, 0]:
            axes.set_ylabel("margin of the start,\nshare of the way")
        figure.colorbar(image, ax=grid, label="share that left the set", shrink=0.8)
        if known:
            figure.legend(
                known.values(), [MARKS[marker] for marker in known], loc="outside lower center",
                ncols=len(known), handletextpad=0.1,
            )  # fmt: skip
        figure.savefig(file, dpi=180)
