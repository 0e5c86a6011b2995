"""Shows a simulation in a browser: live, as a replay, or as one file that needs no network.

From MuJoCo's model and state come drawing commands and one array of poses (`mirror.py`, which
serves any model and any ``meshcat.Visualizer``). With a game's quantities, bounds and messages they
make up a scene of stages, one a system (`shown_system.py`, `fleet.py`, `scene.py`). A live page is
fed by a session in the simulation's own thread through a server on the loopback interface
(`session.py`, `server.py`). A replay is the same numbers in one pack (`replay.py`, `pack.py`), with
the page around it or beside it (`html.py`, `page/`); several runs are one too (`comparison.py`,
`differences.py`).
"""

from gne_mj.extras import need

need("view", "a page in the browser")

from gne_mj.viewer.html import html_page, write_html
from gne_mj.viewer.mirror import Mirror
from gne_mj.viewer.replay import Shown, replay_pack
from gne_mj.viewer.server import Server
from gne_mj.viewer.session import Session

__all__ = ["Mirror", "Server", "Session", "html_page", "replay_pack", "serve", "write_html"]


def serve(shown: Shown, title: str = "gne-mj replay", *, port: int = 0) -> Server:
    """Serve a replay on 127.0.0.1 until the server is closed or the process ends.

    Args:
        shown: a trajectory of a scenario, which it holds; or up to four, to compare.
        title: of the page.
        port: 0 for any that is free.

    Raises:
        InvalidInput: see :func:`gne_mj.viewer.replay.replay_pack`; the port is taken.
    """
    return Server(title, replay=replay_pack(shown, title), port=port)
