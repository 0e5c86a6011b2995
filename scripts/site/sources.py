"""Files of the repository that pages link to, as pages of their own: what is outside docs/."""

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
_LINK = re.compile(r"\]\((?:\.\./)+([\w./-]+)\)")
_LANGUAGES = {".py": "python", ".toml": "toml", ".xml": "xml", ".md": "markdown"}


def page_of(path: str) -> str:
    """Where on the site a file or folder of the repository is shown."""
    return f"source/{path.rstrip('/')}.md"


def linked() -> set[str]:
    """Files and folders outside docs/ that pages link to, and the folders' folders."""
    found = {
        name.rstrip("/")
        for page in (ROOT / "docs").rglob("*.md")
        for name in _LINK.findall(page.read_text(encoding="utf-8"))
        if not name.endswith(".md") and (ROOT / name).exists()
    }
    for name in list(found):
        if (ROOT / name).is_dir() and not _files(ROOT / name):
            found |= {f"{name}/{each.name}" for each in _folders(ROOT / name)}
    return found


def with_links(markdown: str, page: str) -> str:
    """Links that leave docs/ lead to those pages.

    Args:
        page: the page's own address within docs/.
    """
    up = "../" * page.count("/")

    def link(found: re.Match[str]) -> str:
        name = found[1].rstrip("/")
        return f"]({up}{page_of(name)})" if (ROOT / name).exists() else found[0]

    return _LINK.sub(link, markdown)


def text_of(name: str) -> str:
    """The page of one file or folder."""
    path = ROOT / name
    parts = [f"# `{name}`\n"]
    files = _files(path) if path.is_dir() else [path]
    if path.is_dir():
        parts += [f"- [`{each.name}`]({path.name}/{each.name}.md)"
                  for each in _folders(path) if not files]  # fmt: skip
    for file in files:
        parts += [f"## `{file.name}`\n"] if len(files) > 1 else []
        parts += [_shown(file)]
    return "\n".join(parts)


def _shown(file: Path) -> str:
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        return "\n".join(
            "".join(cell["source"]) + "\n"
            if cell["cell_type"] == "markdown"
            else _fenced("".join(cell["source"]) + "\n", "python")
            for cell in cells
        )
    return _fenced(text, _LANGUAGES.get(file.suffix, "text"))


def _fenced(text: str, language: str) -> str:
    return f"````{language}\n{text}````\n"


def _files(folder: Path) -> list[Path]:
    return sorted(each for each in folder.rglob("*")
                  if each.suffix in {*_LANGUAGES, ".ipynb"} and each.is_file()
                  and folder.name != "examples")  # fmt: skip


def _folders(folder: Path) -> list[Path]:
    return sorted(each for each in folder.iterdir() if each.is_dir() and each.name[0] not in "._")
