"""Figures of a trajectory: actions and derived quantities over time.

What is drawn follows from the trajectory alone, so a game of one's own is drawn like any other.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.files import refuse_existing, written
from gne_mj.plots.plane import plane
from gne_mj.plots.style import LEGEND, axis_label, line_style, styled, subplots
from gne_mj.progress import Tell, nothing
from gne_mj.run_metrics import SUCCESSES
from gne_mj.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


ROOM = 0.04  # of a panel's height, beyond bounds


def draw(trajectory: Trajectory) -> dict[str, "Figure"]:
    """All figures of a trajectory's systems, by name.

    For each system its actions, one panel for each of their axes, as ``robots-velocities``, and
    each other variable that figures draw (:class:`gne_mj.variables.Variable`), with its bounds, as
    ``robots-gaps`` or, where it is one number, ``channels-total-power``. Of positions in the plane
    ``robots-plane`` has the ways from above (:mod:`gne_mj.plots.plane`).
    """
    figures = {}
    with styled():
        for name in trajectory.tree.children:
            data = trajectory[name]
            titles = {"action": data["action"].attrs["long_name"]}
            others = json.loads(data.attrs["quantities"])
            titles |= {drawn: drawn.replace("_", "-") for drawn in others}
            for drawn, title in titles.items():
                words = title if data[drawn].ndim == 1 else _plural(title)
                figures[f"{name}-{words}"] = _drawn(data, drawn)
            from_above = plane(data)
            if from_above is not None:
                figures[f"{name}-plane"] = from_above
    return figures


def save(
    trajectory: Trajectory,
    folder: str | Path,
    formats: tuple[str, ...] = ("png",),
    *,
    replace: bool = True,
    progress: Tell = nothing,
) -> list[Path]:
    """Write every figure of :func:`draw` into a folder; returns the files' paths.

    Args:
        trajectory: what is drawn.
        folder: where to.
        formats: each one of ``FORMATS``.
        replace: files of the same names are replaced, each once the new one is whole.
        progress: called after every file.

    Raises:
        InvalidInput: files exist and may not be replaced, or the folder cannot be written to.
        StorageError: the disk is full, or fails.
    """
    figures = draw(trajectory)
    paths = {name: [Path(folder) / f"{name}.{kind}" for kind in formats] for name in figures}
    files, done = len(figures) * len(formats), 0
    progress(done, files, f"{files} figures")
    if not replace:
        refuse_existing("folder", [path for each in paths.values() for path in each])
    for name, figure in figures.items():
        for path in paths[name]:
            with written("folder", path, replace=replace) as new:
                figure.savefig(new, dpi=200)
            done += 1
            progress(done, files, f"{done} of {files} figures")
    return [path for each in paths.values() for path in each]


def _plural(noun: str) -> str:
    noun = noun.replace(" ", "-")
    return f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"


def _figure(data: "xarray.Dataset", panels: int, width: float) -> tuple["Figure", list["Axes"]]:
    """Empty panels above each other, over time."""
    figure, grid = subplots(panels, 1, width, 1.0 + 1.9 * panels, sharex=True)
    time = data["time"].to_numpy()
    axes: list[Axes] = list(grid[:, 0])
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(time[0], max(time[-1], time[0] + 1e-9))
    if data.attrs["status"] not in SUCCESSES:
        axes[0].set_title(data.attrs["status"].replace("_", " "), color="#B00020", fontsize=9)
        for panel in axes:
            panel.axvline(time[-1], color="#B00020", linewidth=1.0)
    return figure, axes


def _legend(figure: "Figure", axes: "Axes", title: str | None) -> None:
    """Beside the axes, so that it hides nothing."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside right center", title=title, handlelength=2.4)


def _drawn(data: "xarray.Dataset", name: str) -> "Figure":
    """A variable with its bounds: a panel for each axis of actions, or one."""
    variable = data[name]
    single, of_actions = variable.ndim == 1, "action" in variable.dims
    of_agents = of_actions or "agent" in variable.dims
    values = variable.to_numpy().reshape(len(variable), -1)
    axis = data["axis"].to_numpy() if of_actions else np.full(values.shape[1], "")
    names = data["owner" if of_actions else "agent" if of_agents else "constraint_name"].to_numpy()
    there = ~np.all(np.isnan(values), axis=0)  # of a quantity of some constraints only these
    panels = list(dict.fromkeys(axis.tolist())) or [""]
    figure, axes = _figure(data, len(panels), 4.6 if single or of_agents else 5.6)
    for panel, along in zip(axes, panels, strict=True):
        mine = (axis == along) & there
        numbers = names[mine] - 1 if of_agents else np.arange(np.count_nonzero(mine))
        labels = [] if single else [str(each) for each in names[mine]]
        _lines(panel, data["time"].to_numpy(), values[:, mine], numbers, labels)
        words = variable.attrs.get("long_name", name)
        each = "\neach " if len(numbers) > 1 else " "
        label: str | None = f"bound of{each}{words.split(',')[0]}"
        for bound in (f"{name}_bound", f"{name}_lower_bound"):
            if bound in data and "time" in data[bound].dims:
                limit = data[bound].to_numpy().reshape(len(variable), -1)[:, mine]
                _moving_bounds(panel, data["time"].to_numpy(), limit, numbers, label)
                label = None
            elif bound in data:
                _bounds(panel, data[bound].to_numpy().reshape(-1)[mine], numbers, label)
                label = None
        # trajectories hold no symbol of the action
        symbol = variable.attrs.get("symbol", "y_i" if name == "action" else "")
        if along:
            symbol = symbol.replace("_i", f"_{{i,{along}}}")
        panel.set_ylabel(axis_label(words, symbol, variable.attrs.get("units", "")))
    _legend(figure, axes[0], data.attrs["agent_name"] if of_agents else None)
    return figure


def _lines(
    axes: "Axes",
    time: NDArray[np.float64],
    values: NDArray[np.float64],
    numbers: NDArray[np.int64],
    names: list[str],
) -> None:
    """One line a column; columns of one number look alike in every panel."""
    labels = names if len(names) <= LEGEND else []
    for index, number in enumerate(numbers):
        label = labels[index] if labels else None
        axes.plot(time, values[:, index], label=label, **line_style(int(number)))


def _moving_bounds(
    axes: "Axes",
    time: NDArray[np.float64],
    bounds: NDArray[np.float64],
    numbers: NDArray[np.int64],
    label: str | None,
) -> None:
    """The same of bounds (time, lines) that move."""
    for index, number in enumerate(numbers):
        colour = line_style(int(number))["color"] if len(numbers) > 1 else "black"
        dashes = (0, (4, 3))
        axes.plot(time, bounds[:, index], color=colour, lw=0.9, linestyle=dashes, label=label)
        label = None


def _bounds(
    axes: "Axes", bounds: NDArray[np.float64], numbers: NDArray[np.int64], label: str | None
) -> None:
    """Each bound once: in black, or in its line's colour where it is one line's of several."""
    values, first, counts = np.unique(bounds, return_index=True, return_counts=True)
    for value, at, count in zip(values, first, counts, strict=True):
        own = count == 1 and len(bounds) > 1
        colour = line_style(int(numbers[at]))["color"] if own else "black"
        axes.axhline(value, color=colour, linewidth=0.9, linestyle=(0, (4, 3)), label=label)
        label = None
    low, high = axes.get_ylim()
    room, drawn = ROOM * (high - low), values[np.isfinite(values)]
    if len(drawn):  # a bound on the edge of a panel is hard to see
        axes.set_ylim(min(low, np.min(drawn) - room), max(high, np.max(drawn) + room))
