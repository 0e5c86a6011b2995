"""What MkDocs calls while it builds the site: pages that follow from the program and its files."""

from typing import Any

from mathml import with_mathml
from mkdocs.structure.files import File, Files, InclusionLevel
from sources import linked, page_of, text_of, with_links

_NO_NAV = InclusionLevel.NOT_IN_NAV


def on_files(files: Files, *, config: Any) -> Files:
    """Add pages that no file of docs/ has."""
    for name in sorted(linked()):
        shown = File.generated(config, page_of(name), content=text_of(name), inclusion=_NO_NAV)
        files.append(shown)
    return files


def on_page_markdown(markdown: str, *, page: Any, config: Any, files: Files) -> str:
    """Links that leave docs/ lead to pages of these files."""
    return with_links(markdown, page.file.src_uri)


def on_page_content(html: str, *, page: Any, config: Any, files: Files) -> str:
    """Draw formulas."""
    return with_mathml(html)
