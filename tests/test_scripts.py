"""The commands in scripts/: each makes the environment that it needs, and campaigns are told."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SCRIPTS = [path for path in (ROOT / "scripts").iterdir() if path.is_file()]
LOCKS = {path.stem for path in (ROOT / "locks").glob("*.txt")}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_what_it_installs_is_locked(script):
    """An environment of no name ended scripts/arena before it began."""
    for line in re.findall(r"^make_environment\b.*", script.read_text(), re.MULTILINE):
        if "{" not in line:
            names = line.split()[1:]
            assert names
            assert set(names) <= LOCKS, line


def test_what_each_campaign_looks_for_is_told():
    """On the page that CONTRIBUTING.md names."""
    page = (ROOT / "docs" / "testing.md").read_text()
    campaigns = {path.name for path in SCRIPTS if path.name.startswith("check-")} - {"check-docs"}
    assert campaigns == set(re.findall(r"`(check-\w+)", page))
