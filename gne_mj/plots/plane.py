"""The figure of agents that move in the plane: their ways, links and the region, from above."""

import json
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.plots.style import LEGEND, line_style, subplots

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 4.6  # inches


def plane(data: "xarray.Dataset") -> "Figure | None":
    """Ways of a system whose actions are places in the plane; None of others.

    These are the systems of which a quantity says between whom it is, or of what part of the plane:
    distances are drawn as lines between the agents at the end. Positions that follow outputs are
    drawn as lines, the outputs at the end as rings; where an agent began is a small dot. Around
    agents that keep apart are discs of half of their distance.
    """
    place = points(data)
    if place is None:
        return None
    output = _channels(data, "action")
    from matplotlib.patches import Circle

    apart = json.loads(data.attrs["structure"])["separation"]
    figure, grid = subplots(1, 1, WIDTH + 1.0, WIDTH)
    axes = grid[0, 0]
    for corners in outlines(data):
        _outline(axes, corners)
    for i, j in pairs(data):
        axes.plot(*place[-1, [i, j]].T, color="grey", linewidth=0.9, zorder=1)
    for agent in range(place.shape[1]):
        style = line_style(agent)
        label = str(agent + 1) if place.shape[1] <= LEGEND else None
        axes.plot(*place[:, agent].T, label=label, **style)
        axes.plot(*place[0, agent], ".", color=style["color"], markersize=4)
        axes.plot(*place[-1, agent], "o", color=style["color"], markersize=6)
        if apart is not None:
            disc = Circle(tuple(place[-1, agent]), 0.5 * apart[0], fill=False, color="grey")
            axes.add_patch(disc)
        if "position" in data:
            ring = {"markerfacecolor": "none", "markersize": 10}
            axes.plot(*output[-1, agent], "o", color=style["color"], **ring)
    unit = data["action"].attrs.get("units", "")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x ({unit})" if unit else "x")
    axes.set_ylabel(f"y ({unit})" if unit else "y")
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        title = data.attrs["agent_name"]
        figure.legend(handles, labels, loc="outside right center", title=title, handlelength=2.4)
    return figure


def points(data: "xarray.Dataset") -> NDArray[np.float64] | None:
    """Places in the plane over time, (T, N, 2), of the systems that :func:`plane` draws."""
    if not _spatial(data) or "axis" not in data or set(data["axis"].to_numpy()) != {"x", "y"}:
        return None
    return _channels(data, "position" if "position" in data else "action")


def pairs(data: "xarray.Dataset") -> list[tuple[int, int]]:
    """Agents between whom a quantity is, numbered from 0."""
    between = (json.loads(each.attrs.get("between", "[]")) for each in _spatial(data))
    return [(i, j) for each in between for i, j in each if i >= 0]


def outlines(data: "xarray.Dataset") -> list[list[list[float]]]:
    """Corners of the parts of the plane that quantities are of."""
    found = (json.loads(each.attrs.get("outline", "[]")) for each in _spatial(data))
    return [corners for corners in found if corners]


def _spatial(data: "xarray.Dataset") -> list["xarray.DataArray"]:
    quantities = [data[name] for name in json.loads(data.attrs["quantities"])]
    return [each for each in quantities if {"between", "outline"} & set(each.attrs)]


def _channels(data: "xarray.Dataset", name: str) -> NDArray[np.float64]:
    """(T, N, 2) of a variable of actions, whose axes alternate."""
    values: NDArray[np.float64] = data[name].to_numpy()
    return values.reshape(len(values), -1, 2)


def _outline(axes: "Axes", corners: list[list[float]]) -> None:
    x, y = np.array([*corners, corners[0]]).T
    axes.fill(x, y, color="black", alpha=0.05, linewidth=0)
    axes.plot(x, y, color="black", linewidth=0.9, linestyle=(0, (4, 3)))
