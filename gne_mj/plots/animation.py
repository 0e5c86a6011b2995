"""Agents in the plane as they move, from above: one picture file that plays by itself."""

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.files import written
from gne_mj.plots.plane import outlines, pairs, points
from gne_mj.plots.style import line_style, styled, subplots
from gne_mj.progress import Tell, nothing
from gne_mj.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray

FRAMES, PER_SECOND = 120, 20  # at most, and how fast they are shown
SIZE, DPI = 4.2, 100  # a square, in inches
TAIL = 0.25  # of the time shown: how much of their ways agents draw behind them
THERE = 0.01  # of the picture's width: who is as near to the end has arrived


def animate(
    trajectory: Trajectory, path: str | Path, *, replace: bool = True, progress: Tell = nothing
) -> Path:
    """Write the first system that moves in the plane as an animated WebP, and return its path.

    It is shown until all are where they end, in at most 6 s. Agents draw their ways behind them;
    around those that keep apart are discs of half of their distance, which therefore never overlap.
    As in the figure ``NAME-plane`` links are grey lines, and the region is dashed.

    Args:
        trajectory: what is shown.
        path: of the file.
        replace: a file that is there already is replaced.
        progress: called after every frame.

    Raises:
        InvalidInput: nothing of the trajectory is in the plane, or the file cannot be written to.
        StorageError: the disk is full, or fails.
    """
    path = Path(path)
    found = (trajectory[name] for name in trajectory.tree.children)
    data = next((each for each in found if points(each) is not None), None)
    if data is None:
        raise InvalidInput("animation", str(path), "no system of this run moves in the plane")
    with styled():
        frames = _frames(data, progress)
    with written("animation", path, replace=replace) as new:
        frames[0].save(
            new, format="WEBP", save_all=True, append_images=frames[1:], loop=0, quality=70,
            duration=[1000 // PER_SECOND] * (len(frames) - 1) + [1500], method=4,
        )  # fmt: skip
    return path


def _frames(data: "xarray.Dataset", progress: Tell) -> list[Any]:
    """Pictures at equal steps of time, of pillow."""
    from PIL import Image

    place = points(data)
    assert place is not None
    time = data["time"].to_numpy()
    figure, grid = subplots(1, 1, SIZE, SIZE)
    axes = grid[0, 0]
    width = _still(axes, data, place)
    moving = _Moving(axes, data, place)
    far = np.any(np.abs(place - place[-1]) > THERE * width, axis=(1, 2))
    last = min(int(np.max(np.flatnonzero(far), initial=0)) + 1, len(time) - 1)
    count = min(FRAMES, last + 1)
    frames = []
    for number, row in enumerate(np.linspace(0, last, count).round().astype(int)):
        moving.show(int(row), max(1, round(TAIL * last)))
        axes.set_title(f"{time[row]:.1f} s", loc="right")
        drawn = io.BytesIO()
        figure.savefig(drawn, format="png", dpi=DPI)
        frames.append(Image.open(drawn).convert("RGB"))
        progress(number + 1, count, f"{number + 1} of {count} frames")
    return frames


def _still(axes: Any, data: "xarray.Dataset", place: NDArray[np.float64]) -> float:
    """What does not move: the region, and the ends of what is shown; returns how wide that is."""
    shown = [place.reshape(-1, 2)]
    for corners in outlines(data):
        shown.append(np.array([*corners, corners[0]]))
        axes.plot(*shown[-1].T, color="black", linewidth=0.9, linestyle=(0, (4, 3)))
    low, high = np.min(np.concatenate(shown), axis=0), np.max(np.concatenate(shown), axis=0)
    middle, reach = 0.5 * (low + high), 0.52 * float(np.max(high - low)) + 0.5 * _distance(data)
    axes.set_xlim(middle[0] - reach, middle[0] + reach)
    axes.set_ylim(middle[1] - reach, middle[1] + reach)
    axes.set_aspect("equal")
    unit = data["action"].attrs.get("units", "")
    axes.set_xlabel(f"x ({unit})" if unit else "x")
    axes.set_ylabel(f"y ({unit})" if unit else "y")
    return 2.0 * reach


def _distance(data: "xarray.Dataset") -> float:
    """What agents keep apart; 0 where they do not."""
    apart = json.loads(data.attrs["structure"])["separation"]
    return 0.0 if apart is None else float(apart[0])


class _Moving:
    """Artists of what moves, changed from frame to frame."""

    def __init__(self, axes: Any, data: "xarray.Dataset", place: NDArray[np.float64]) -> None:
        from matplotlib.patches import Circle

        self._place, self._pairs = place, pairs(data)
        self._links = [axes.plot([], [], color="grey", linewidth=0.9)[0] for _ in self._pairs]
        styles = [line_style(agent) for agent in range(place.shape[1])]
        self._ways = [axes.plot([], [], **style)[0] for style in styles]
        self._dots = [
            axes.plot([], [], "o", color=style["color"], markersize=6)[0] for style in styles
        ]
        radius = 0.5 * _distance(data)
        self._discs = [
            axes.add_patch(Circle((0, 0), radius, fill=False, color="grey"))
            for _ in styles
            if radius > 0.0
        ]

    def show(self, row: int, tail: int) -> None:
        """Put all where it is at a row, with ways of so many rows."""
        now, ways = self._place[row], self._place[max(0, row - tail) : row + 1]
        for link, pair in zip(self._links, self._pairs, strict=True):
            link.set_data(*now[list(pair)].T)
        for agent, (way, dot) in enumerate(zip(self._ways, self._dots, strict=True)):
            way.set_data(*ways[:, agent].T)
            dot.set_data([now[agent, 0]], [now[agent, 1]])
        for disc, centre in zip(self._discs, now, strict=False):
            disc.center = tuple(centre)
