"""What MkDocs calls while it builds the site: pages that follow from the program and its files."""

from typing import Any

import roles
import shown
import sources
from command_page import commands_page
from mathml import with_mathml
from mkdocs.structure.files import File, Files, InclusionLevel

_NO_NAV = InclusionLevel.NOT_IN_NAV
_MADE = {"commands": commands_page, "gallery": shown.gallery_page}  # by a mark, <!-- commands -->


def on_files(files: Files, *, config: Any) -> Files:
    """Add pages and pictures that no file of docs/ has."""
    for name in sorted(sources.linked()):
        content, place = sources.text_of(name), sources.page_of(name)
        files.append(File.generated(config, place, content=content, inclusion=_NO_NAV))
    for file in shown.pictures():
        files.append(File.generated(config, shown.address(file), abs_src_path=str(file)))
    return files


def on_page_markdown(markdown: str, *, page: Any, config: Any, files: Files) -> str:
    """Fill in what is made, and lead links that leave docs/ to the pages of these files."""
    for mark, made in _MADE.items():
        if f"<!-- {mark} -->" in markdown:
            markdown = markdown.replace(f"<!-- {mark} -->", made())
    return sources.with_links(markdown, page.file.src_uri)


def on_page_content(html: str, *, page: Any, config: Any, files: Files) -> str:
    """Draw formulas, and link what docstrings refer to."""
    return roles.with_links(with_mathml(html))
