"""Figures: the paper's from a trajectory, and a path of equilibria. Reads results only."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

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
# Beyond this many agents a legend says less than it hides.
_LEGEND = 12


def draw(trajectory: Trajectory) -> dict[str, "Figure"]:
    """All figures that apply to a trajectory's systems, by name.

    Velocity games: ``SYSTEM-velocities`` and ``SYSTEM-gaps``; OSNR games: ``SYSTEM-powers`` and
    ``SYSTEM-total-power``; other games: ``SYSTEM-actions``.
    """
    figures = {}
    for name in trajectory.tree.children:
        data = trajectory[name]
        if "gap" in data:
            figures[f"{name}-velocities"] = _figure(data, _actions, "velocity $y_i$ (m/s)")
            figures[f"{name}-gaps"] = _figure(data, _gaps, "velocity gap $y_i - y_{i-1}$ (m/s)")
        elif data.attrs["game"] == "OSNR":
            figures[f"{name}-powers"] = _figure(data, _actions, "channel power $y_i$ (mW)")
            figures[f"{name}-total-power"] = _figure(data, _total, "total power (mW)")
        else:
            figures[f"{name}-actions"] = _figure(data, _actions, "action $y_i$")
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
    rho = np.array([point.equilibrium.rho for point in solution.path])
    lines = {
        "distance to the vGNE": [point.distance for point in solution.path],
        "measured $\\epsilon$": [np.max(point.gains) for point in solution.path],
        "$p\\rho$": solution.game.constraints_count * rho,
    }
    plt, style = _matplotlib()
    with plt.rc_context(style):
        figure, axes = plt.subplots(figsize=(4.6, 2.9), layout="constrained")
        for index, (label, values) in enumerate(lines.items()):
            axes.loglog(rho, values, color=_COLOURS[index], linestyle=_DASHES[index], label=label)
        axes.set_xlabel("penalty parameter $\\rho$")
        axes.legend()
        figure.savefig(file, dpi=200)
    plt.close(figure)


def _matplotlib() -> tuple[Any, dict[str, Any]]:
    """pyplot without a display, and the style of all figures."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt, {
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


def _figure(
    data: "xarray.Dataset", content: Callable[["Axes", "xarray.Dataset"], None], label: str
) -> "Figure":
    plt, style = _matplotlib()
    with plt.rc_context(style):
        figure, axes = plt.subplots(figsize=(4.6, 2.9), layout="constrained")
        content(axes, data)
        if axes.get_legend_handles_labels()[0]:  # beside the axes, so that it hides nothing
            figure.legend(loc="outside right center", title=_agent_name(data), handlelength=2.4)
        axes.set_xlabel("time (s)")
        axes.set_ylabel(label)
        time = data["time"].to_numpy()
        axes.set_xlim(time[0], max(time[-1], time[0] + 1e-9))
        if data.attrs["status"] not in ("converged", "completed"):
            axes.axvline(time[-1], color="#B00020", linewidth=1.0)
            axes.set_title(data.attrs["status"].replace("_", " "), color="#B00020", fontsize=9)
    return figure


def _agent_name(data: "xarray.Dataset") -> str:
    return "robot" if "gap" in data else "channel" if data.attrs["game"] == "OSNR" else "agent"


def _lines(axes: "Axes", data: "xarray.Dataset", name: str) -> None:
    values = data[name].to_numpy()
    time = data["time"].to_numpy()
    for index in range(values.shape[1]):
        axes.plot(
            time,
            values[:, index],
            color=_COLOURS[index % len(_COLOURS)],
            linestyle=_DASHES[(index + index // len(_COLOURS)) % len(_DASHES)],
            label=f"{index + 1}" if values.shape[1] <= _LEGEND else None,
        )


def _limit(axes: "Axes", value: float, label: str | None) -> None:
    axes.axhline(value, color="black", linewidth=0.9, linestyle=(0, (4, 3)), label=label)


def _actions(axes: "Axes", data: "xarray.Dataset") -> None:
    _lines(axes, data, "action")


def _gaps(axes: "Axes", data: "xarray.Dataset") -> None:
    _lines(axes, data, "gap")
    bounds = np.unique(data["gap_bound"].to_numpy())
    for index, bound in enumerate(bounds[:3]):
        _limit(axes, bound, "bound" if index == 0 else None)
        _limit(axes, -bound, None)


def _total(axes: "Axes", data: "xarray.Dataset") -> None:
    total = data["action"].sum(axis=1)
    axes.plot(data["time"], total, color=_COLOURS[0])
    # g of the last constraint is the total power less its limit
    limit = float(total[0] - data["constraint"].to_numpy()[0, -1])
    _limit(axes, limit, None)
    axes.annotate("limit $P_0$", (1.0, limit), xycoords=("axes fraction", "data"), ha="right",
                  xytext=(0, 3), textcoords="offset points")  # fmt: skip
