"""A trajectory in a notebook: its replay inline, and a table of what it shows."""

from html import escape

from gne_mj.errors import GneError
from gne_mj.summary import summary
from gne_mj.trajectory import Trajectory

HEIGHT = 560  # pixels of the replay


def notebook_html(trajectory: Trajectory) -> str:
    """What IPython shows of a trajectory: a table for each system and, below, the replay.

    All of it is in the notebook: it needs no server, and still works in one that was sent on. Where
    there is no scenario to draw robots from, their files are gone, or the extra "view" is not
    installed, a sentence says so.
    """
    tables = "".join(_table(name, report) for name, report in trajectory.reports.items())
    found = f'<div style="display:flex;flex-wrap:wrap;gap:2em">{tables}</div>'
    try:
        from gne_mj.viewer import html_page

        page = escape(html_page(trajectory), quote=True)
    except GneError as error:
        found += f"<p>There is no replay: {escape(str(error))}</p>"
    else:
        found += (
            f'<iframe title="replay" sandbox="allow-scripts" srcdoc="{page}"'
            f' style="width:100%;height:{HEIGHT}px;border:1px solid #8888;margin-top:1em">'
            "</iframe>"
        )
    return found


def _table(name: str, report: dict[str, object]) -> str:
    rows = "".join(
        f'<tr><th style="text-align:left">{escape(key)}</th>'
        f'<td style="text-align:left">{escape(value)}</td></tr>'
        for key, value in summary(report).items()
    )
    return f"<table><caption><b>{escape(name)}</b></caption><tbody>{rows}</tbody></table>"
