"""Figures and replays of runs."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gne_mj.arguments import answering
from gne_mj.files import storing
from gne_mj.interface.running import run_scenario
from gne_mj.notebook import replay_html
from gne_mj.scenario import Source, load_scenario
from gne_mj.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gne_mj.viewer import Server
    from gne_mj.viewer.replay import Shown

DPI = 80  # of figures in a notebook


class Figures(dict[str, "Figure"]):
    """Matplotlib figures by name; a notebook shows them all.

    >>> gne_mj.run("velocity-sync").plot()["robots-gaps"].savefig("gaps.pdf")
    """

    def __init__(self, figures: Mapping[str, Figure]) -> None:
        super().__init__(figures)

    def __repr__(self) -> str:
        return f"<Figures: {', '.join(self) or 'none'}>"

    def _repr_html_(self) -> str:
        return "".join(
            f'<img alt="{escape(name)}" src="data:image/png;base64,{_png(figure)}">'
            for name, figure in self.items()
        )


def _png(figure: Figure) -> str:
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    return b64encode(stream.getvalue()).decode("ascii")


class Replay:
    """A replay, which a notebook shows inline and keeps.

    Args:
        shown: a trajectory of a scenario, which it holds; or up to four, to compare.
    """

    def __init__(self, shown: Shown) -> None:
        self.shown = shown

    def __repr__(self) -> str:
        return f"<Replay of {self.shown!r}>"

    def _repr_html_(self) -> str:
        return replay_html(self.shown)


@answering
def plot(
    shown: Trajectory | Source,
    folder: str | Path | None = None,
    formats: Sequence[str] = ("png",),
) -> Figures:
    """Draw a run: actions, what the game derives from them, and margins, with all bounds.

    Args:
        shown: a trajectory; a scenario or game is run first.
        folder: where to write the figures too, in place of older ones of the same names.
        formats: of the files: png, pdf, svg.

    Raises:
        MissingExtra: matplotlib is not installed.
        InvalidInput: the folder cannot be written to.
    """
    from gne_mj import plots

    trajectory = _trajectory(shown)
    figures = Figures(plots.draw(trajectory))
    if folder is not None:
        with storing("folder", Path(folder)):
            Path(folder).mkdir(parents=True, exist_ok=True)
        plots.save(trajectory, folder, tuple(formats))
    return figures


@answering
def view(
    shown: Trajectory | Source | list[Trajectory | Source] | tuple[Trajectory | Source, ...],
    title: str = "gne-mj replay",
    *,
    port: int = 0,
) -> Server:
    """Serve a run's replay on 127.0.0.1 until the server is closed or the process ends.

    Open its ``url`` in a browser. ``gne-mj run --view`` shows a run while it is going on.

    >>> gne_mj.view([gne_mj.run("paper"), gne_mj.run("paper", {"barrier.rho": 0.3})]).url

    Args:
        shown: a trajectory; a scenario or game is run first. A list of up to four is shown on one
            clock, a dict of trajectories by the names in it.
        title: of the page.
        port: 0 for any that is free.

    Raises:
        MissingExtra: what the page needs is not installed.
        InvalidInput: there is no scenario to draw robots from, or too many runs; the port is taken.
    """
    from gne_mj.viewer import serve

    if isinstance(shown, Mapping) and shown:
        named = {str(name): each for name, each in shown.items() if isinstance(each, Trajectory)}
        if len(named) == len(shown):
            return serve(named, title, port=port)
    if isinstance(shown, list | tuple):
        return serve([_trajectory(each) for each in shown], title, port=port)
    return serve(_trajectory(shown), title, port=port)


def _trajectory(shown: Trajectory | Source) -> Trajectory:
    if isinstance(shown, Trajectory):
        return shown
    return run_scenario(load_scenario(shown))
