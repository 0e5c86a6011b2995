"""Commands that show a run in a browser."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gne_mj.cli.application import app
from gne_mj.cli.arguments import INDEX, PORT, REPLACE, settings
from gne_mj.cli.output import Results, tell
from gne_mj.cli.signals import stopping
from gne_mj.cli.simulating import is_batch, keep, simulate, source_of, stored, warn
from gne_mj.progress import PREPARING, on_terminal, say, telling

if TYPE_CHECKING:
    from gne_mj.trajectory import Trajectory
    from gne_mj.viewer.replay import Shown
    from gne_mj.viewer.session import Begin

REPLAY = "preparing the replay"


@app.command()
def view(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Folder that `run --out`, `paper`, a program's `save` or (with --index) `batch`"
            " wrote; up to four are compared, on one clock.",
        ),
    ],
    index: INDEX = None,
    html: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write one file that opens from disk instead."),
    ] = None,
    port: PORT = None,
    replace: REPLACE = False,
) -> None:
    """Show stored runs in a browser, with a time slider; a batch's run is run again for it."""
    from gne_mj.errors import InvalidInput
    from gne_mj.extras import need
    from gne_mj.files import refuse_existing, written

    need("view", "a replay")
    if html is not None and port is not None:
        raise InvalidInput("port", port, "it is of no use with `html`")
    if html is not None and (html.is_dir() or not html.parent.is_dir()):
        raise InvalidInput("html", str(html), "it must be a file, in a folder that exists")
    if html is not None and not replace:
        refuse_existing("html", [html])
    shown, title = _replayed(folders, index)
    if html is not None:
        from gne_mj.viewer import html_page

        with telling(REPLAY):
            page = html_page(shown, title)
        with written("html", html, replace=replace) as new:
            new.write_text(page, encoding="utf-8")
        print(html)
        return
    _show(shown, title, port)


def _replayed(folders: list[Path], index: int | None) -> "tuple[Shown, str]":
    """What to show of these folders, and a title."""
    from gne_mj.errors import InvalidInput

    names = [_title(folder.resolve().name) for folder in folders]
    if len(folders) > 1:
        from gne_mj.viewer.comparison import MOST
        from gne_mj.viewer.differences import unique

        if index is not None:
            raise InvalidInput("index", index, "it goes with one folder, that `batch` wrote")
        if len(folders) > MOST:
            raise InvalidInput("runs", len(folders), f"at most {MOST} can be compared")
        if len(set(names)) < len(names):
            names = unique([_title(str(folder)) for folder in folders])
        runs = {name: stored(folder) for name, folder in zip(names, folders, strict=True)}
        return runs, " · ".join(names)
    (folder,) = folders
    if index is None:
        return stored(folder), names[0]
    if not is_batch(folder):
        raise InvalidInput("index", index, "it goes with a folder that `batch` wrote")
    trajectory = simulate(source_of(None, folder, index), None, Results(None), quiet=False)
    return trajectory, f"{names[0]}, run {index}"


def watch(
    source: "str | Mapping[str, Any]",
    changes: list[str] | None,
    results: Results,
    as_json: bool,
    *,
    title: str,
    speed: str | None,
    port: int | None,
    begin: "Begin" = "viewer",
) -> "Trajectory":
    """Run a scenario on a live page until Ctrl-C; what is kept and told is the first run.

    A viewer's restart ends that run, as Ctrl-C does.

    Args:
        source, changes: what to run, with what --set changes.
        results: where to keep it.
        as_json: print the report and nothing else.
        title: of the page.
        speed: as --speed gives it.
        port: as --port gives it.
        begin: when, see :class:`gne_mj.viewer.Session`.
    """
    from gne_mj.extras import need
    from gne_mj.scenario import load_scenario

    need("view", "a live page")
    factor = _speed(speed)
    with stopping() as stop, ExitStack() as page:
        with telling(PREPARING, quiet=as_json):
            from gne_mj.viewer import Session

            scenario = load_scenario(source, settings(changes))
            session = Session(scenario, _title(title), speed=factor, port=port or 0, begin=begin)
        page.callback(session.server.close)
        warn(session.simulation)
        page.enter_context(_announced(session.server.url))
        if begin != "now":
            say(
                "it begins when "
                + ("a viewer says so" if begin == "paused" else "a browser is there")
            )
        trajectory = session.run(stop)
        with results.written() as folder:
            if folder is not None:
                keep(trajectory, folder)
        tell(trajectory, as_json, results.out)
        sys.stdout.flush()  # whoever reads it need not wait for the page's end
        if not stop.is_set():
            session.show(trajectory)
            session.linger(stop)
    return trajectory


def _title(name: str) -> str:
    """A page's title from a file's name, which need not be UTF-8."""
    return name.encode(errors="replace").decode()


def _show(shown: "Shown", title: str, port: int | None) -> None:
    with stopping() as stop:
        with telling(REPLAY):
            from gne_mj.viewer import serve

            server = serve(shown, title, port=port or 0)
        with _announced(server.url):
            while not stop.is_set():
                time.sleep(0.2)
        server.close()


def _speed(given: str | None) -> float | None:
    """Times real time; None for as fast as possible."""
    from gne_mj.errors import InvalidInput
    from gne_mj.viewer.session import FASTEST

    if given == "max":
        return None
    try:
        speed = 1.0 if given is None else float(given)
    except ValueError:
        speed = 0.0
    if not 0.0 < speed <= FASTEST:
        raise InvalidInput(
            "speed", given, f"it must be 'max' or a positive number, at most {FASTEST:g}"
        )
    return speed


@contextmanager
def _announced(url: str) -> Iterator[None]:
    """Say where the page is, and open it where somebody sits in front of a screen.

    The browser is given a file of the user's own that leads there: what is on a command line all
    users of the machine can read, and the address holds the page's secret.
    """
    say(f"view        {url}   (Ctrl-C ends)")
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if not (on_terminal() and (screen or sys.platform == "darwin")):
        yield
        return
    with tempfile.NamedTemporaryFile("w", prefix="gne-mj-", suffix=".html") as file:
        file.write(f'<meta http-equiv="refresh" content="0; url={url}">')
        file.flush()
        # A process of its own: some browsers stay in the foreground, or write to the terminal.
        subprocess.Popen(
            [sys.executable, "-m", "webbrowser", Path(file.name).as_uri()],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
        yield
