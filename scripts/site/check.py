"""What must hold of the built site: python scripts/site/check.py build/site"""

import ast
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Attributes by which a page asks for something when it is opened; a link only leads somewhere.
_RESOURCES = {"link": "href", "script": "src", "img": "src", "iframe": "src", "source": "src",
              "video": "src", "audio": "src", "object": "data", "embed": "src"}  # fmt: skip
_NO_RESOURCE = {"canonical", "prev", "next"}  # of a <link>


class _Page(HTMLParser):
    """What a page asks for."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.asked: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag != "link" or given.get("rel") not in _NO_RESOURCE:
            self.asked += [given.get(_RESOURCES.get(tag, "")) or ""]
        self.asked += re.findall(r"url\(([^)]*)\)", given.get("style") or "")


def wrong(site: Path) -> Iterator[str]:
    """What is wrong with the site, in sentences."""
    pages = sorted(site.rglob("*.html"))
    if len(pages) < 20:
        yield f"{site} has {len(pages)} pages"
    for page in pages:
        text = page.read_text(encoding="utf-8")
        name = page.relative_to(site)
        for asked in _Page(text).asked:
            if re.match(r"[\"']?(\w+:)?//", asked):
                yield f"{name} asks another host: {asked}"
        if 'class="arithmatex"' in text:
            yield f"{name} has a formula that was not drawn"
    yield from _not_shown(site)
    for style in site.rglob("*.css"):
        for asked in re.findall(r"url\(([^)]*)\)|@import", style.read_text(encoding="utf-8")):
            if re.match(r"[\"']?(\w+:)?//", asked):
                yield f"{style.relative_to(site)} asks another host: {asked}"


def _declared(module: str) -> list[str]:
    """Its ``__all__``, read only: some modules need packages that the site does not."""
    path = ROOT.joinpath(*module.split("."))
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    for statement in ast.parse(source.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "__all__":
            return list(ast.literal_eval(statement.value))
    return []


def _not_shown(site: Path) -> Iterator[str]:
    """Public names without an entry, keys without their cells, scenarios without their replay."""
    import gne_mj
    from gne_mj.scenario import shipped

    entries = (site / "reference/python.html").read_text(encoding="utf-8")
    for name in gne_mj.__all__:
        if f'id="gne_mj.{name}"' not in entries and name != "__version__":
            yield f"gne_mj.{name} has no entry in reference/python.md"
    modules = (ROOT / "docs/reference/modules.md").read_text(encoding="utf-8")
    entries = (site / "reference/modules.html").read_text(encoding="utf-8")
    for module in re.findall(r"(?m)^## .*: `([\w.]+)`", modules):
        for name in _declared(module):
            if f'id="{module}.{name}"' not in entries and not name.isupper():
                yield f"{module}.{name} has no entry in reference/modules.md"
    for name in shipped():
        if not (site / f"gallery/{name}/replay.html").exists():
            yield f"the gallery does not show {name}"


if __name__ == "__main__":
    found = list(wrong(Path(sys.argv[1])))
    print("\n".join(found), file=sys.stderr)
    sys.exit(bool(found))
