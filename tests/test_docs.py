"""What the documents name is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    *sorted(ROOT.glob("docs/**/*.md")),
    *sorted(ROOT.glob("examples/*/*.md")),
]
SOURCES = [
    path.relative_to(ROOT).as_posix()
    for folder in ("gne_mj", "controllers", "models", "examples", "page/src", "scripts", "tests")
    for path in (ROOT / folder).rglob("*")
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text)
    missing = [
        link for link in links if "://" not in link and not (page.parent / link).resolve().exists()
    ]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_that_are_named_are_there(page):
    text = page.read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w./-]+\.(?:py|js|xml))`", text))
    made = re.findall(r"gne-mj new \w+ (\w+)", text)
    missing = [
        name
        for name in named
        if Path(name).stem not in made
        and not any(f"/{source}".endswith(f"/{name}") for source in SOURCES)
        and not (page.parent / name).exists()
    ]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_headings_that_are_linked_are_there(page):
    for target, anchor in re.findall(r"\]\(([\w.-]*\.md)?#([\w-]+)\)", page.read_text("utf-8")):
        other = (page.parent / target) if target else page
        headings = re.findall(r"(?m)^#+ (.+)$", other.read_text(encoding="utf-8"))
        anchors = {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings}
        assert anchor in anchors, f"{other.name}#{anchor}"
