"""A trajectory in a notebook: a table of what it shows, and its figures."""

from base64 import b64encode
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

from gne_mj.errors import GneError
from gne_mj.extras import need
from gne_mj.summary import summary
from gne_mj.trajectory import Trajectory

if TYPE_CHECKING:
    from gne_mj.viewer.replay import Shown

HEIGHT = 560  # pixels of a replay
DPI = 64  # of the figures


def notebook_html(trajectory: Trajectory) -> str:
    """What IPython shows of a trajectory: a table for each system, and its figures.

    Some tens of kilobytes: a replay, which has the page's whole code, is shown where it is asked
    for (:func:`replay_html`). Where figures cannot be drawn a sentence says so.
    """
    tables = "".join(_table(name, report) for name, report in trajectory.reports.items())
    found = f'<div style="display:flex;flex-wrap:wrap;gap:2em">{tables}</div>'
    try:
        need("plots", "drawing figures")
    except GneError as error:
        return found + f"<p>There are no figures: {escape(str(error))}</p>"
    return found + _figures(trajectory)


def _figures(trajectory: Trajectory) -> str:
    from gne_mj import plots

    found = ""
    for name, figure in plots.draw(trajectory).items():
        stream = BytesIO()
        figure.savefig(stream, format="png", dpi=DPI)
        data = b64encode(stream.getvalue()).decode("ascii")
        found += f'<img alt="{escape(name)}" src="data:image/png;base64,{data}">'
    return found


def replay_html(shown: "Shown") -> str:
    """The replay of a run, or of up to four to compare, inline.

    It needs no server, and still works in a notebook that was sent on.

    Raises:
        GneError: there is no scenario to draw robots from, their files are gone, or the extra
            "view" is not installed.
    """
    from gne_mj.viewer import html_page

    page = escape(html_page(shown), quote=True)
    return (
        f'<iframe title="replay" sandbox="allow-scripts allow-downloads" srcdoc="{page}"'
        f' style="width:100%;height:{HEIGHT}px;border:1px solid #8888"></iframe>'
    )


def _table(name: str, report: dict[str, object]) -> str:
    rows = "".join(
        f'<tr><th style="text-align:left">{escape(key)}</th>'
        f'<td style="text-align:left">{escape(value)}</td></tr>'
        for key, value in summary(report).items()
    )
    return f"<table><caption><b>{escape(name)}</b></caption><tbody>{rows}</tbody></table>"
