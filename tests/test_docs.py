"""What the documents name is there."""

import re
from pathlib import Path

import pytest

import gne_mj

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


def test_every_public_name_has_an_entry():
    """Of the built site, with modules' names, scripts/site/check.py asks the same."""
    text = (ROOT / "docs/reference/python.md").read_text(encoding="utf-8")
    entries = re.findall(r"(?m)^::: gne_mj\.(\w+)$", text)
    assert sorted(entries) == sorted(set(gne_mj.__all__) - {"__version__"})


def test_every_page_is_in_the_sites_order():
    order = re.findall(r": ([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.M)
    pages = [path.relative_to(ROOT / "docs").as_posix() for path in ROOT.glob("docs/**/*.md")]
    assert sorted(order) == sorted(pages)
