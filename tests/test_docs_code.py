"""The Python of the documents runs as it stands, each page from top to bottom."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from commands import environment

import gne_mj as gm

ROOT = Path(__file__).parents[1]
EXCERPTS = {"developers.md", "internals.md"}  # parts of files, with "..." for the rest
PAGES = [
    page
    for page in (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")))
    if "```python" in page.read_text(encoding="utf-8") and page.name not in EXCERPTS
]


def blocks(page):
    """The page's Python, one block behind the other."""
    return re.findall(r"(?ms)^```python\n(.*?)^```$", page.read_text(encoding="utf-8"))


def test_the_pages_that_have_python():
    assert [page.name for page in PAGES] == [
        "README.md", "batches.md", "expressions.md", "index.md", "learning.md", "view.md", "your-own.md",
    ]  # fmt: skip
    for page in PAGES:
        for block in blocks(page):
            compile(block, page.name, "exec")


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_it_runs(page, tmp_path):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    if page.name in ("README.md", "batches.md"):  # they read what a command above has written
        swept = {"simulation.control_period": [0.01, 0.1], "barrier.rho": [0.1, 1.0]}
        short = {"simulation.duration": 0.5, "controller.mode": "sampled"}
        scenario = gm.load_scenario("velocity-sync", short)
        gm.batch(scenario, swept, runs=2, out=tmp_path / "results/periods")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", "\n".join(blocks(page))], cwd=tmp_path,
        env={**environment(), "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"}, capture_output=True,
        text=True, check=False, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
