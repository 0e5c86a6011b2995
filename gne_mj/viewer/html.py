"""The page as text: served with its scripts beside it, or as one file with everything inside."""

import base64
import html
import json
import re
from importlib.resources import files
from pathlib import Path

from gne_mj.files import written
from gne_mj.viewer.replay import Shown, replay_pack

_MESHCAT = "meshcat.min.js"  # the page's name for the bundle of the meshcat package
_SETTINGS = '<script id="settings" type="application/json">{}</script>'
# A page from disk has no business on any network.
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline';"
    " img-src data: blob:; base-uri 'none'; form-action 'none'"
)


def served_page(mode: str, title: str) -> str:
    """The page that asks its server for scripts; mode "live" or "served"."""
    return _begin(mode, title)


def html_page(shown: Shown, title: str | None = None) -> str:
    """A replay as one page that needs no other file and no network.

    Args:
        shown: a trajectory of a scenario, which it holds; or up to four, to compare.
        title: of the page; the systems' or runs' names if left out.

    Raises:
        InvalidInput: see :func:`gne_mj.viewer.replay.replay_pack`.
    """
    return packed_page(replay_pack(shown, title), title or "gne-mj replay")


def packed_page(pack: bytes, title: str) -> str:
    """The same of a replay's compressed pack."""
    data = base64.b64encode(pack).decode("ascii")
    text = _begin("file", title)
    text = text.replace(
        "<head>",
        f'<head>\n<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        1,
    )
    text = re.sub(r'<script src="([^"]+)"></script>', _script, text)
    text = re.sub(r'<link rel="stylesheet" href="([^"]+)">', _style, text)
    # before the scripts, which look for it at once
    return text.replace(
        "<body>", f'<body>\n<script id="replay" type="text/plain">{data}</script>', 1
    ).replace("</body>", f"<!--\n{_licences()}\n-->\n</body>")


def write_html(shown: Shown, path: str | Path, title: str | None = None) -> Path:
    """Write :func:`html_page` into a file, which it replaces only when it is whole.

    Raises:
        InvalidInput: see :func:`html_page`; or it is in no place that can be written to.
        StorageError: the disk is full, or fails.
    """
    path = Path(path)
    text = html_page(shown, title)
    with written("path", path, replace=True) as new:
        new.write_text(text, encoding="utf-8")
    return path


def page_file(name: str) -> bytes:
    """One of the page's files, or meshcat's bundle under the name that the page has for it.

    Raises:
        FileNotFoundError: there is no such file.
    """
    if not re.fullmatch(r"[\w-]+(\.[\w-]+)+", name, flags=re.ASCII):
        raise FileNotFoundError(name)
    if name == _MESHCAT:
        return (_meshcat_viewer() / "dist" / "main.min.js").read_bytes()
    return files("gne_mj.viewer").joinpath("page", name).read_bytes()


def _begin(mode: str, title: str) -> str:
    text = page_file("index.html").decode("utf-8")
    settings = json.dumps({"mode": mode})
    text = text.replace(_SETTINGS, _SETTINGS.replace("{}", settings), 1)
    return re.sub("<title>.*?</title>", lambda _: f"<title>{html.escape(title)}</title>", text)


def _script(match: re.Match[str]) -> str:
    text = page_file(match[1]).decode("utf-8")
    if match[1] != _MESHCAT:  # the page's own can be read in its folder: here it is to be short
        text = re.sub(r"^ +", "", text, flags=re.MULTILINE)
    # what ends a script, or begins a comment, for HTML's parser
    text = re.sub(r"<(/script|!--)", r"\\x3c\1", text, flags=re.IGNORECASE)
    return f"<script>{text}</script>"


def _style(match: re.Match[str]) -> str:
    return f"<style>{page_file(match[1]).decode('utf-8')}</style>"


def _licences() -> str:
    """Of what a page from disk carries along."""
    viewer = _meshcat_viewer()
    texts = [
        "meshcat\n" + (viewer / "LICENSE").read_text(encoding="utf-8"),
        (viewer / "dist" / "main.min.js.LICENSE.txt").read_text(encoding="utf-8"),
        "uPlot\n" + page_file("uPlot-LICENSE.txt").decode("utf-8"),
    ]
    return "\n".join(texts).replace("--", "- -")


def _meshcat_viewer() -> Path:
    from meshcat import viewer_assets_path

    return Path(viewer_assets_path())
